"""One file per standard; `bushcli.standards.standard` finds them."""
