"""One file per program, offered as ``WRITER``; `bushcli.export.writer.all_writers` finds them."""
