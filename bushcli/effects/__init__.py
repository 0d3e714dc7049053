"""The effects, one file each; `bushcli.effect` says what they are and finds them."""
