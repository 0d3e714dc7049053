"""`python -m bushcli.cli`."""

from bushcli.cli import main

main()
