"""The effects, one file each; `bushcli.effects.effect` says what they are and finds them."""
