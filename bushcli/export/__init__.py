"""A case or its result -> files of other programs: material cards, vehicle models, force laws as FMU.

`source.read_source` finds the rubber, curves and stiffness matrices of a case or a folder of results;
`writer.all_writers` returns the writers, one file per program in ``bushcli/export/writers``.
"""

from bushcli.export.source import ExportSource, read_source
from bushcli.export.units import SYSTEMS, UnitSystem, unit_system
from bushcli.export.writer import Order, Writer, all_writers, writer_for

__all__ = [
    "SYSTEMS",
    "ExportSource",
    "Order",
    "UnitSystem",
    "Writer",
    "all_writers",
    "read_source",
    "unit_system",
    "writer_for",
]
