"""Nastran and Altair OptiStruct: a bushing (`PBUSH`) whose stiffness and damping are tables over frequency (`PBUSHT`).

In a frequency response the bushing's complex stiffness is K(f) + i omega B(f): K is the storage stiffness and B = K'' /
omega. Both programs take B for each direction, while Nastran has one loss factor GE for all of them. Fields of 16
columns keep nine digits.
"""

from __future__ import annotations

from collections.abc import Sequence

from bushcli.errors import InputError, Problem
from bushcli.export.vibration import FORCES, by_direction
from bushcli.export.writer import Order, Writer, one_line

# Number of the property, which a model that has one of this number changes.
_PROPERTY = 1


def write(order: Order) -> str:
    """Return the property and its twelve tables; refuse a direction without two frequencies at least."""
    vibrations = by_direction(order.bushing.vibrations, "nastran")
    units, columns = order.units, {}
    for direction, vibration in vibrations.items():
        per = units.of_moment(1.0) if vibration.rotational else units.of_force(1.0) / units.of_length(1.0)
        frequency = [units.of_frequency(f) for f in vibration.frequency]
        damping = [units.of_time(per * c) for c in vibration.damping]
        columns[direction] = frequency, [per * k for k in vibration.stiffness.real], damping
        if len(vibration.frequency) < 2:
            what = f"{direction} has one frequency, and a table of Nastran has two or more"
            raise InputError(Problem("--to nastran", what, "", "add frequencies to [load_cases.dynamic]"))
    lines = [f"$ {direction}: {one_line(vibration.state)}" for direction, vibration in vibrations.items()]
    lines += [f"$ {one_line(remark)}" for remark in order.bushing.remarks]
    nominal = [[columns[direction][i][0] for direction in FORCES] for i in (1, 2)]
    lines += _wide("PBUSH", [_PROPERTY, "K", *nominal[0], "", "B", *nominal[1]])
    # Tables 11 to 16 are the stiffness of directions 1 to 6, 21 to 26 their damping.
    tables = [[10 * i + k for k in range(1, 7)] for i in (1, 2)]
    for head, name, row in zip(("PBUSHT", ""), "KB", tables, strict=True):
        first = str(_PROPERTY) if head else ""
        lines.append(f"{head:8s}{first:>8s}{name:>8s}" + "".join(f"{number:8d}" for number in row))
    for i, row in zip((1, 2), tables, strict=True):
        for direction, number in zip(FORCES, row, strict=True):
            pairs = zip(columns[direction][0], columns[direction][i], strict=True)
            points = [value for pair in pairs for value in pair]
            lines += _wide("TABLED1", [number, "LINEAR", "LINEAR", *[""] * 5, *points, "ENDT"])
    return "\n".join(lines)


def _wide(name: str, fields: Sequence[str | int | float]) -> list[str]:
    """Return an entry in large fields, four to a line; Nastran's real numbers have a decimal point."""
    texts = [f"{value:.8E}" if isinstance(value, float) else str(value) for value in fields]
    rows = [texts[i : i + 4] for i in range(0, len(texts), 4)]
    return [
        f"{f'{name}*' if i == 0 else '*':8s}{''.join(f'{text:>16s}' for text in row)}"
        for i, row in enumerate(rows)
    ]


WRITER = Writer(
    name="nastran",
    title="Nastran and Altair OptiStruct frequency-dependent bushing",
    kind="vibration",
    ending=".bdf",
    comment=("$", ""),
    write=write,
    remarks=(
        "directions 1 to 6 are FX FY FZ TX TY TZ; the bushing's axis is z of the coordinate system of CBUSH",
        "for frequency responses; PBUSH has the values at the lowest frequency, tables are extended as straight lines",
    ),
    source="Altair OptiStruct 2021 help, PBUSH, PBUSHT, TABLED1; Autodesk Nastran 2025 Reference Manual, PBUSHT",
)
