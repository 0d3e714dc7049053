"""One file per program, which defines ``WRITER``; `bushcli.export.writer.all_writers` finds them."""
