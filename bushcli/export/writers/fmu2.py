"""FMI 2.0: the force law with memory of every channel as a co-simulation FMU, which contains its own code.

The FMU needs a Python on the machine that runs it, like every FMU made with PythonFMU, but not bushcli.
"""

from __future__ import annotations

from bushcli.export.writer import Order, Writer, one_line


def write(order: Order) -> bytes:
    """Return the archive."""
    from bushcli.export.fmu.build import build

    assert order.bushing is not None
    assert order.bushing.law is not None
    return build(order.bushing.law.data(order.name, one_line(order.title), order.units), 2)


WRITER = Writer(
    name="fmu2",
    title="FMI 2.0 (FMU)",
    kind="force_law",
    ending=".fmu",
    comment=("", ""),
    write=write,
    source="FMI 2.0, https://fmi-standard.org",
)
