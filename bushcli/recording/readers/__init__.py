"""One file per format; `bushcli.recording.reader` finds them."""
