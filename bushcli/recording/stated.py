"""Units that the lines above a table state: ``Force unit: lbf``, ``# units: s, in, lbf``, ``Kraft in daN``."""

from __future__ import annotations

import re

from bushcli.recording.header import heading
from bushcli.recording.match import Wanted, quality_of
from bushcli.recording.table import Table
from bushcli.recording.units import Unit, find_unit

_UNITS = re.compile(r"\b(?:units?|einheit(?:en)?|unités?)\b\W*", re.IGNORECASE)
#: A statement ends at these, or after a unit in brackets.
_ENDS = re.compile(r"[,;\t|]|(?<=[\])])")


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
        listed = [find_unit(part, wanted.measured) for part in _ENDS.split(text.strip()[label.end() :])]
        return [unit for unit in listed if unit is not None and unit.measured == wanted.measured]
    for parts in ([text], _ENDS.split(text)):
        units = []
        for part in parts:
            head = heading(_UNITS.sub(" ", part))
            said = head.written or head.doubtful
            if not quality_of(head, wanted) or len(said) != 1:
                continue
            unit = find_unit(said[0], wanted.measured)
            if unit is not None and unit.measured == wanted.measured:
                units.append(unit)
        if units:
            return units
    return []
