"""Units that the lines above a table state: ``Force unit: lbf``, ``# units: s, in, lbf``, ``Kraft in daN``."""

from __future__ import annotations

import re
from itertools import pairwise

from bushcli.recording.header import heading
from bushcli.recording.match import Wanted, quality_of
from bushcli.recording.table import Table
from bushcli.recording.units import Unit, find_unit, tabulated_unit

_UNITS = re.compile(
    r"(?:\b|(?<=[a-zé])(?=U))(?:units?(?:\s+(?:set|system))?|einheit(?:en)?|unités?)\b\W*", re.IGNORECASE
)
#: A statement ends at these, or after a unit in brackets.
_ENDS = re.compile(r"[,;\t|]|(?<=[\])])")
_BETWEEN = re.compile(r"[\s,;|/-]+")
#: Systems of units: they do not say which unit a column has.
_SYSTEM = re.compile(
    r"\b(?:imperial|(?:us|u\.s\.)[ -]customary|english units|inch[ -]pound)\b", re.IGNORECASE
)
#: Words of a statement that belong to no name of a column.
_ABOUT = re.compile(r"\b(?:all|alle|toutes?|les|is|are|in|of|channel|kanal)\b\s*\d*|[:=]", re.IGNORECASE)


def stated_units(table: Table, wanted: Wanted) -> tuple[tuple[int, Unit], ...]:
    """Return the units of a quantity that the lines above a table state, each with the number of the line.

    A number before a unit makes it a value, such as the range of a sensor, and no statement.

    Parameters
    ----------
    table : Table
    wanted : Wanted
    """
    return tuple((number, unit) for number, text in table.preamble for unit in _stated(text, wanted))


def _stated(text: str, wanted: Wanted) -> list[Unit]:
    """Return the units of a quantity that one line states."""
    label = _UNITS.match(text.strip())
    if label:
        rest = text.strip()[label.end() :]
        listed = [find_unit(part, wanted.measured) for part in _ENDS.split(rest)]
        listed += [tabulated_unit(part, wanted.measured) for part in _BETWEEN.split(rest)]
        units = [unit for unit in listed if unit is not None and unit.measured == wanted.measured]
        if units:
            return list(dict.fromkeys(units))
    parts = _ENDS.split(text)
    # "Travel;in;Force;lbf" has each unit behind its name.
    pairs = [f"{name} [{unit.strip()}]" for name, unit in pairwise(parts) if tabulated_unit(unit) is not None]
    for split in (pairs, [text], re.split(r"[;\t|]", text), parts):
        units = [unit for part in split if (unit := _said(part, wanted)) is not None]
        if units:
            return units
    return []


def _said(part: str, wanted: Wanted) -> Unit | None:
    """Return the unit of a quantity that a part of a line states, such as "Kraft in daN" or "forces are in kN"."""
    plain = _UNITS.sub(" ", part)
    # "in" is a unit at the end, and a preposition before one.
    words = _ABOUT.sub(" ", plain).split()
    for text in (plain, " ".join(word.removesuffix("s") if len(word) > 4 else word for word in words)):
        head = heading(text)
        said = head.written or head.doubtful
        if quality_of(head, wanted) and len(said) == 1:
            unit = find_unit(said[0], wanted.measured)
            if unit is not None and unit.measured == wanted.measured:
                return unit
    return None


def stated_system(table: Table) -> tuple[int, str] | None:
    """Return the line above a table, its number and words, that names a system of units: "Units: Imperial"; or None."""
    for number, text in table.preamble:
        found = _SYSTEM.search(text)
        if found:
            return number, found[0]
    return None
