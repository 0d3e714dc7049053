"""FMI 2.0: the force law with memory of every channel as a co-simulation FMU, which contains its own code.

The FMU needs a Python on the machine that runs it, like every FMU made with PythonFMU, but not bushcli.
"""

from __future__ import annotations

from typing import Literal

from bushcli.export.writer import Order, Writer, one_line


def writer(version: Literal[2, 3]) -> Writer:
    """Return the writer of a version of the standard."""

    def write(order: Order) -> bytes:
        from bushcli.export.fmu.build import build

        assert order.bushing.law is not None
        return build(order.bushing.law.data(order.name, one_line(order.title), order.units), version)

    standard = f"FMI {version}.0"
    return Writer(
        name=f"fmu{version}",
        title=f"{standard} (FMU)",
        kind="force_law",
        ending=".fmu",
        comment=("", ""),
        write=write,
        source=f"{standard}, https://fmi-standard.org",
    )


WRITER = writer(2)
