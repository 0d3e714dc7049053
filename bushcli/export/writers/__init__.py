"""One file per program, offered as ``WRITER``; `bushcli.export.writer.writers` finds them."""
