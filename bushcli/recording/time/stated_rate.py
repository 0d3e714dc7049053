"""Sampling rates that the lines above a table state: ``Sample rate: 100 Hz``, ``dt = 0.01 s``, ``Abtastrate;1 kHz``.

A rate above a table need not be that of its rows: rigs sample faster than they save. It is proposed, and never used
unless the case gives it as ``sample_rate``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from bushcli.recording.header.units import find_unit
from bushcli.recording.text.table import LONGEST_LINE, SHOWN, Table

_RATE = (
    r"(?:(?:sampl(?:e|ing)|scan(?:ning)?|acquisition|data|logg(?:er|ing)|daq|storage)[\s_-]*(?:rate|freq(?:uency|\.)?)"
    r"|(?:abtast|mess|speicher|aufzeichnungs)[\s_-]*(?:rate|frequenz)|fréquence d.échantillonnage|f_?s)"
)
_STEP = (
    r"(?:(?:sampl(?:e|ing)|scan(?:ning)?|acquisition|logg(?:er|ing)|storage)[\s_-]*(?:interval|period|time|step)"
    r"|(?:abtast|mess|speicher)[\s_-]*(?:intervall|zeit)|pas d.échantillonnage|time[\s_-]*step|delta[\s_-]*t|[dΔ]t)"
)
#: A label, a unit in brackets, a number, a unit: "Sampling rate [Hz] = 100", "dt: 0.01 s".
_STATEMENT = re.compile(
    rf"(?:^|[;,\t|])\W*(?:(?P<rate>{_RATE})|(?P<step>{_STEP}))\W*?"
    r"(?:[\[(]\s*(?P<inside>[^\])]{1,20})[\])])?\s*[:=;,\t|\s]+"
    r"(?P<value>\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)[ \t;|]*(?P<behind>[^\s;,|]*(?: per s\w*)?)",
    re.IGNORECASE,
)
#: Units of a rate, in lower case, and their factor to Hz.
_HERTZ = {
    "hz": 1.0, "khz": 1e3, "1/s": 1.0, "s-1": 1.0, "s^-1": 1.0, "s/s": 1.0, "ks/s": 1e3, "sps": 1.0, "samples/s": 1.0,
    "samples/sec": 1.0, "samples/second": 1.0, "pts/s": 1.0, "points/s": 1.0, "samples per second": 1.0,
    "samples per s": 1.0, "samples per sec": 1.0,
}  # fmt: skip
#: Largest relative difference of a rate and an interval that say the same: both are rounded to three digits.
_SAME = 5e-3


@dataclass(frozen=True)
class StatedRate:
    """Samples per second (Hz) that a line of a file states, with its number and its text."""

    hertz: float
    line: int
    text: str


def stated_rate(table: Table) -> StatedRate | None:
    """Return the sampling rate that the lines above a table state; None without one, or if they contradict."""
    found = list(_statements(table))
    if not found or any(abs(one.hertz / found[0].hertz - 1.0) > _SAME for one in found):
        return None
    return found[0]


def rate_remarks(table: Table) -> list[str]:
    """Return a remark about the sampling rates that the lines above a table without a time state."""
    found = list(_statements(table))
    one = stated_rate(table)
    if one is not None:
        return [
            f'line {one.line} states a sampling rate ("{one.text}"), which is not used: '
            f"give sample_rate = {one.hertz:g} if the rows of the table have it"
        ]
    if found:
        texts = ", ".join(f'line {one.line} "{one.text}"' for one in found)
        return [f"sampling rates that contradict are stated above the table, and not used ({texts})"]
    return []


def _statements(table: Table) -> Iterator[StatedRate]:
    for number, text in table.preamble:
        for match in _STATEMENT.finditer(text[:LONGEST_LINE]):
            value = float(match["value"].replace(",", "."))
            hertz = _hertz(value, (match["inside"] or match["behind"]).strip(), match["step"] is not None)
            if hertz is not None:
                yield StatedRate(hertz, number, text.strip()[:SHOWN])


def _hertz(value: float, unit: str, is_step: bool) -> float | None:
    """Return samples per second, or None where the unit is not that of a rate or of a time, or the value is 0."""
    if value <= 0.0:
        return None
    if not is_step:
        factor = _HERTZ.get(unit.lower())
        return None if factor is None else value * factor
    found = find_unit(unit, "time") if unit else None
    return None if found is None or found.measured != "time" else 1.0 / (value * found.factor)
