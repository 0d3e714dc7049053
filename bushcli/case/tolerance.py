"""Tolerances: the band within which a simulated stiffness is accepted, and numbers of a case with a tolerance.

The literature accepts a simulated stiffness within 10 %, which is the default. Drawings give load-deflection
tolerances as classes D1 to D3 of the handbook of the Rubber Manufacturers Association (RMA, today ARPM, MO-1, section
on molded products). The meaning of a class depends on the hardness of the rubber and the thickness of its wall, and
the table is not public: the percentage is given on the drawing or in the handbook, and the case has to state it.

A number may be "22.0 +- 0.1" in place of 22.0: a study varies it; other commands take the number.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from bushcli.case.finding import Keys, dotted_key

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_TOLERANCE = re.compile(rf"\s*({_NUMBER})\s*(?:\+-|\+/-|±)\s*({_NUMBER})\s*(%?)\s*\Z")
#: Longer texts are no numbers; the time to match one grows with the square of its length.
_LONGEST = 100
# Keys whose values are words: there such a text is not read as a number.
_WORDS = ("title", "name", "file")


@dataclass(frozen=True)
class Tolerance:
    """A tolerance on stiffness and force.

    Attributes
    ----------
    percent : float
        Percentage of the measured stiffness, and of the recorded force range.
    name : str
        The class on the drawing; empty where there is none.
    """

    percent: float = 10.0
    name: str = ""

    @property
    def band(self) -> float:
        """The tolerance as a share, 0.1 for 10 %."""
        return self.percent / 100.0

    @property
    def text(self) -> str:
        """The tolerance for use in a sentence: ``10 %``, ``D2 (15 %)``."""
        return f"{self.name} ({self.percent:g} %)" if self.name else f"{self.percent:g} %"


CLASSES = ("D1", "D2", "D3")
DEFAULT = Tolerance()


@dataclass(frozen=True)
class Toleranced:
    """A number with a tolerance.

    Attributes
    ----------
    nominal : float
        In the unit of its key.
    deviation : float
        Largest deviation to either side, positive, in the same unit.
    """

    nominal: float
    deviation: float

    @property
    def low(self) -> float:
        """Lower limit."""
        return self.nominal - self.deviation

    @property
    def high(self) -> float:
        """Upper limit."""
        return self.nominal + self.deviation


def toleranced_number(text: str) -> Toleranced | None:
    """Return a number with a tolerance, such as "22.0 +- 0.1" or "350 ± 15 %"; None for any other text."""
    match = _TOLERANCE.match(text) if len(text) <= _LONGEST else None
    if match is None:
        return None
    nominal, deviation = float(match[1]), float(match[2])
    if match[3]:
        deviation *= 0.01 * abs(nominal)
    return Toleranced(nominal, deviation) if deviation > 0.0 else None


def nominal_tables(data: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Toleranced]]:
    """Return a case's tables, changed in place, with plain numbers, and the tolerances by key."""
    tolerances = {}
    for table, key, keys, value in list(_texts(data)):
        tolerance = toleranced_number(value)
        if tolerance is not None:
            table[key] = tolerance.nominal
            tolerances[dotted_key(keys)] = tolerance
    return data, tolerances


def _texts(value: Any, keys: Keys = ()) -> Iterator[tuple[Any, Any, Keys, str]]:
    entries = value.items() if isinstance(value, dict) else enumerate(value)
    for key, item in entries:
        if isinstance(item, dict | list):
            yield from _texts(item, (*keys, key))
        elif isinstance(item, str) and key not in _WORDS:
            yield value, key, (*keys, key), item
