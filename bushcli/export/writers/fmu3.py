"""FMI 3.0: the same co-simulation FMU as of FMI 2.0 (`fmu2`)."""

from bushcli.export.writers.fmu2 import writer

WRITER = writer(3)
