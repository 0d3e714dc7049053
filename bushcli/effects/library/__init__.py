"""The effects, one file each; `bushcli.effects.effect` defines their type and finds them."""
