"""What the names and units over a column mean: ``Standardkraft [kN]`` is a force in kN."""

from __future__ import annotations

import re
from collections.abc import Sequence

#: Ways to write a unit (lower case, without blanks and brackets) -> (what it measures, its name in
#: `source.UNITS`).
_SPELLINGS = {
    "time": {
        "s": "s", "sec": "s", "sek": "s", "second": "s", "seconds": "s", "ms": "ms", "min": "min", "h": "h",
    },
    "length": {
        "mm": "mm", "m": "m", "cm": "cm", "um": "um", "µm": "um", "μm": "um", "in": "in", "inch": "in",
    },
    "angle": {
        "deg": "deg", "degree": "deg", "degrees": "deg", "°": "deg", "grad": "deg",
        "rad": "rad", "mrad": "mrad",
    },
    "force": {"n": "N", "kn": "kN", "lbf": "lbf", "lb": "lbf"},
    "moment": {
        "nmm": "Nmm", "n*mm": "Nmm", "n.mm": "Nmm", "n·mm": "Nmm", "n-mm": "Nmm",
        "nm": "Nm", "n*m": "Nm", "n.m": "Nm", "n·m": "Nm", "n-m": "Nm",
        "knm": "kNm", "ncm": "Ncm", "lbfin": "lbfin", "lbf*in": "lbfin", "lbf-in": "lbfin", "in-lbf": "lbfin",
    },
    "strain": {"%": "percent", "percent": "percent", "pct": "percent", "mm/mm": "strain", "m/m": "strain"},
    "stress": {
        "mpa": "MPa", "n/mm2": "MPa", "n/mm²": "MPa", "n/mm^2": "MPa", "n/mm**2": "MPa",
        "kpa": "kPa", "pa": "Pa", "gpa": "GPa", "psi": "psi",
    },
}  # fmt: skip
_NO_UNIT = ("-", "1", "")

#: Words for a column, the column names of this project first.
_WORDS = {
    "time": ("time", "t", "elapsed time", "total time", "running time", "zeit", "prüfzeit", "testzeit"),
    "length": (
        "displacement", "disp", "deflection", "travel", "stroke", "extension", "crosshead",
        "weg", "standardweg", "verschiebung", "auslenkung", "federweg",
    ),
    "angle": ("rotation", "angle", "twist", "winkel", "drehwinkel", "verdrehung", "phi"),
    "force": ("force", "load", "f", "kraft", "standardkraft", "last"),
    "moment": ("moment", "torque", "drehmoment"),
    "stretch": ("stretch", "lambda", "stretch ratio", "extension ratio", "streckung", "verstreckung"),
    "strain": (
        "strain", "nominal strain", "engineering strain", "dehnung", "nenndehnung", "technische dehnung",
    ),
    "stress": (
        "nominal stress", "stress", "engineering stress", "nennspannung", "spannung", "technische spannung",
    ),
}  # fmt: skip
#: German compounds end with the word that counts: Standardkraft, Traversenweg.
_ENDINGS = {
    "time": "zeit", "length": "weg", "angle": "winkel", "force": "kraft", "moment": "moment",
    "strain": "dehnung", "stress": "spannung",
}  # fmt: skip
#: Words that change the meaning: a true stress is no nominal one, a set value is not a measured one.
_FOREIGN = (
    "true",
    "wahre",
    "cauchy",
    "log",
    "logarithmic",
    "hencky",
    "set",
    "setpoint",
    "command",
    "soll",
    "sollwert",
)


def unit_of(text: str) -> tuple[str, str] | None:
    """Return (what it measures, unit as in `bushcli.recording.source.UNITS`) for ``[N/mm**2]``, None for no unit."""
    plain = re.sub(r"[\s\[\](){}]", "", text).lower()
    if plain.startswith("%"):
        plain = "%"  # "%-ext": percent by extensometer
    for measured, spellings in _SPELLINGS.items():
        if plain in spellings:
            return measured, spellings[plain]
    return None


def is_units_row(fields: Sequence[str]) -> bool:
    """Whether a line over a table holds units only, such as ``s;mm;N`` or ``[-] [MPa]``."""
    known = [unit_of(field) is not None for field in fields]
    blank = [re.sub(r"[\s\[\](){}]", "", field) in _NO_UNIT for field in fields]
    bracketed = [field.startswith(("[", "(")) or field.endswith(("]", ")")) for field in fields]
    # "t;F;s"? A row of units is all units; in brackets, unknown ones may be among them.
    plain = all(k or b for k, b in zip(known, blank, strict=True)) and any(known)
    return plain or (
        all(re.match(r"[\[(%]", f) or f in _NO_UNIT for f in fields) and all(bracketed) and any(known)
    )


def name_and_unit(text: str) -> tuple[str, tuple[str, str] | None]:
    """Split ``Force [kN]``, ``force_kN``, ``Kraft in N``, ``F / N`` into the plain name and its unit."""
    bracket = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]\s*", text)
    if bracket:
        return _plain(bracket[1]), unit_of(bracket[2])
    for pattern in (r"(.+?)\s+in\s+(\S+)", r"(.+?)\s*/\s*(\S+)", r"(.+)[_,\s]\s*([^\s_,]+)"):
        match = re.fullmatch(pattern, text.strip())
        if match and (unit := unit_of(match[2])):
            return _plain(match[1]), unit
    return _plain(text), None


def match_quality(text: str, kind: str) -> int:
    """Return how surely a column name means ``kind``, a key of the words above.

    0 no; 1 a German compound; 2 the word among others; 3 a word for it; 4 this project's own name.
    """
    name, unit = name_and_unit(text)
    words = name.split()
    if any(word in _FOREIGN for word in words):
        return 0
    if unit and unit[0] != _MEASURED.get(kind, kind):
        return 0
    known = _WORDS[kind]
    if name == known[0]:
        return 4
    if name in known:
        return 3
    if any(len(word) > 1 and word in words for word in known):
        # "extension ratio" holds a word for a length but is a stretch.
        return 0 if any(name in _WORDS[other] for other in _WORDS if other != kind) else 2
    return 1 if kind in _ENDINGS and name.endswith(_ENDINGS[kind]) else 0


_MEASURED = {"stretch": "strain"}


def _plain(name: str) -> str:
    """Return a name in lower case, with single blanks between its words."""
    return " ".join(re.sub(r"[\W_]+", " ", name.lower()).split())
