"""Units as people write them -> the measured quantity, and their factor to N, mm, MPa, s, rad.

A unit in the table below takes no time. Any other unit is converted by pint, which is imported only then (0.5 s
with its definitions). A text that is not a unit is not converted: nothing is guessed.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from bushcli.recording.source import UNITS

#: Stands for any quantity that a recording does not contain.
OTHER = "other"
#: Spellings of the units of `UNITS`, without blanks, in their usual upper or lower case.
_SPELLINGS: Mapping[str, Mapping[str, str]] = {
    "time": {
        "s": "s sec secs sek second seconds Sekunde Sekunden seconde secondes secondi segundos 秒 с сек",
        "ms": "ms msec msecs millisecond milliseconds мс",
        "min": "min mins minute minutes Minute Minuten мин",
        "h": "h hr hrs hour hours Stunde Stunden ч",
    },
    "length": {
        "mm": "mm millimeter millimeters millimetre millimetres millimètre millimètres millimetri milímetros 毫米 мм",
        "m": "m meter meters metre metres м",
        "cm": "cm centimeter centimeters centimetre centimetres см",
        "um": "um µm μm micron microns micrometer micrometers micrometre micrometres",
        "in": "in inch inches Zoll \" '' ″",
    },
    "angle": {
        "deg": "deg degs degree degrees ° Grad degrés gradi grados 度",
        "rad": "rad rads radian radians",
        "mrad": "mrad milliradian milliradians",
    },
    "force": {
        "N": "N newton newtons 牛 牛顿 Н",
        "kN": "kN kilonewton kilonewtons 千牛 кН",
        "lbf": "lbf lb lbs lbfs pound pounds",
    },
    "moment": {
        "Nmm": "Nmm N*mm N.mm N·mm N⋅mm N-mm N_mm",
        "Nm": "Nm N*m N.m N·m N⋅m N-m N_m Нм Н·м Н*м",
        "kNm": "kNm kN*m kN.m kN·m kN⋅m kN-m kN_m",
        "Ncm": "Ncm N*cm N.cm N·cm N⋅cm N-cm",
        "lbfin": "lbfin lbf*in lbf-in lbf·in lbf.in in-lbf in*lbf in·lbf in.lbf inlbf"
        " lb-in lb*in lb·in in-lb in-lbs in*lb in·lb lbin inlb",
    },
    "strain": {"percent": "% percent pct percentage Prozent", "strain": "mm/mm m/m in/in"},
    "stress": {
        "MPa": "MPa N/mm2 N/mm² N/mm^2 N/mm**2 МПа",
        "kPa": "kPa",
        "Pa": "Pa N/m2 N/m² N/m^2 N/m**2",
        "GPa": "GPa",
        "psi": "psi lbf/in2 lbf/in² lbf/in^2",
    },
}
_EXACT = {
    spelling: (measured, name)
    for measured, units in _SPELLINGS.items()
    for name, spellings in units.items()
    for spelling in spellings.split()
}
_FOLDED = {spelling.lower(): unit for spelling, unit in _EXACT.items()}
#: Texts that mean "no unit".
NO_UNIT = ("-", "--", "1", "")
#: Texts that are used with two meanings, each with the unambiguous spellings.
AMBIGUOUS: Mapping[str, str] = {
    "grad": '"deg" for degrees, "gon" for 1/400 of a turn',
    "ton": '"kgf", "kN" or "lbf": a ton has 1000 kg, 2000 lb or 2240 lb',
    "tons": '"kgf", "kN" or "lbf": a ton has 1000 kg, 2000 lb or 2240 lb',
    "tonf": '"kN" or "lbf": a ton has 1000 kg, 2000 lb or 2240 lb',
}
#: Names that pint does not know or misunderstands: it reads a kilopond as 1000 kgf, a mil as an angle.
_RENAMED = {
    "kp": "kgf", "kpond": "kgf", "kilopond": "kgf", "kiloponds": "kgf", "pond": "gf", "ponds": "gf",
    "rev": "turn", "revs": "turn", "'": "ft", "microstrain": "ppm",
}  # fmt: skip
#: Surveyors' units of pint that name a part of a machine in the header of a rig: "Displacement (rod)".
_PARTS = frozenset(
    ["rod", "rods", "pole", "poles", "perch", "link", "links", "chain", "chains", "hand", "hands"]
)
#: Units that take no prefix: "hh" is not a hundred hours, nor "din" a tenth of an inch. A microinch is in use.
_WITHOUT_PREFIX = frozenset(
    ["minute", "hour", "day", "week", "month", "year", "inch", "foot", "yard", "mile", "thou"]
)
_OF_LENGTH = {"mil": "thou", "mils": "thou"}
#: For a force, a pound or ounce is a pound-force or ounce-force: nobody measures a mass with a load cell. Kilograms are
#: refused, because many read-outs show them, and the file does not say whether they were converted.
_OF_FORCE = {
    "lb": "lbf", "lbs": "lbf", "pound": "lbf", "pounds": "lbf", "#": "lbf",
    "oz": "ozf", "ounce": "ozf", "ounces": "ozf", "klb": "kip", "klbs": "kip",
}  # fmt: skip
#: Internal units in SI base units, with pint's names of the dimensions.
_DIMENSIONS: tuple[tuple[str, Mapping[str, int], float], ...] = (
    ("time", {"[time]": 1}, 1.0),
    ("length", {"[length]": 1}, 1e3),
    ("force", {"[mass]": 1, "[length]": 1, "[time]": -2}, 1.0),
    ("moment", {"[mass]": 1, "[length]": 2, "[time]": -2}, 1e3),
    ("stress", {"[mass]": 1, "[length]": -1, "[time]": -2}, 1e-6),
)
#: Factors beyond these are slips: mPa for MPa, Mm for mm; or no units of a test: a year, "EN".
_PREFIX = {
    "stress": (1e-7, 1e7), "length": (1e-7, 1e7), "force": (1e-7, 1e7), "moment": (1e-7, 1e10), "time": (1e-10, 1e6),
}  # fmt: skip
_FACTOR = r"[A-Za-zµμ°Å]+(?:\*\*[1-9])?"
_EXPRESSION = re.compile(rf"{_FACTOR}(?:[*/]{_FACTOR}){{0,3}}")
_LONGEST = 40


@dataclass(frozen=True)
class Unit:
    """A unit.

    Attributes
    ----------
    measured : str
        A key of `bushcli.recording.source.UNITS`, or `OTHER`.
    name : str
        As in `UNITS`, or as it was written.
    factor : float
        Factor to the internal unit; 0 for `OTHER`.
    """

    measured: str
    name: str
    factor: float


def plain_unit(text: str) -> str:
    """Return a unit as written, but without blanks, enclosing brackets and a final full stop."""
    bare = re.sub(r"\s", "", text[: 4 * _LONGEST])
    bare = re.sub(r"^[\[({<]+|[\])}>]+$", "", bare)
    return bare.rstrip(".") if len(bare) > 1 else bare


def tabulated_unit(text: str, measured: str = "") -> Unit | None:
    """Return a unit of the project's own table, without pint; None for any other text.

    Parameters
    ----------
    text : str
    measured : str, optional
        Quantity of the column, if known: ``nm`` is N m in lower case or a nanometre.
    """
    bare = plain_unit(text)
    if bare.startswith("%"):
        bare = "%"  # "%-ext": percent by extensometer
    found = _EXACT.get(bare)
    # MPA, SEC, KN; force_kn, stress_mpa; Sec. In other mixtures of cases a prefix matters: mPa is not MPa.
    # "In" is the only short unit that rigs write like a title.
    plain_case = bare.isupper() or bare.islower() or (bare.istitle() and (len(bare) > 2 or bare == "In"))
    if found is None and plain_case and bare not in AMBIGUOUS and not (bare == "nm" and measured == "length"):
        found = _FOLDED.get(bare.lower())
    if found is None:
        return None
    return Unit(found[0], found[1], UNITS[found[0]][found[1]])


def find_unit(text: str, measured: str) -> Unit | None:
    """Return the unit that a text names, for a column of the quantity ``measured``; None if it names no unit.

    Parameters
    ----------
    text : str
        As written: ``kgf``, ``[ft-lb]``.
    measured : str
        A key of `bushcli.recording.source.UNITS`.
    """
    if measured != "time" and re.search(r"\w[\s*·.]s\W*$", text):
        return None  # "N s" is an impulse; without its blank it would be a plural
    usual = tabulated_unit(text, measured)
    if usual is not None:
        return usual
    bare = plain_unit(text)
    if bare in UNITS[measured]:
        return Unit(measured, bare, UNITS[measured][bare])
    if bare.lower() in AMBIGUOUS:
        return None
    found = _converted(bare, measured)
    if found is None and bare.isupper():
        found = _converted(bare.lower(), measured)
    return None if found is None else replace(found, name=bare)


def slip(text: str, measured: str) -> str:
    """Return the unit that differs from a text by upper and lower case only, or an empty text.

    Parameters
    ----------
    text : str
        Name of a column.
    measured : str
        What the unit measures, such as "force" or "length".
    """
    found = _FOLDED.get(plain_unit(text).lower())
    return found[1] if found and found[0] == measured else ""


def _converted(text: str, measured: str) -> Unit | None:
    """Return the unit that pint reads from a text."""
    renamed = _RENAMED | (_OF_FORCE if measured in ("force", "moment", "stress") else {})
    renamed |= _OF_LENGTH if measured == "length" else {}
    expression = re.sub(r"[·⋅×∙•.\-_]", "*", text).replace("^", "**").replace("²", "**2").replace("³", "**3")
    expression = re.sub(r"^((?:da|k|M|m|c)?N|kgf|kp|lbf|ozf)(mm|cm|m|in|ft)$", r"\1*\2", expression)
    expression = re.sub(r"(?<=[A-Za-zµμ])([2-4])(?!\d)", r"**\1", expression)
    parts = re.split(r"([*/]+)", expression)
    expression = "".join(renamed.get(part, part) for part in parts)
    if len(expression) > _LONGEST or not _EXPRESSION.fullmatch(expression):
        return None
    if "pond" in expression or not _PARTS.isdisjoint(parts):
        return None
    import pint  # here, because importing it takes longer than checking a case

    try:
        if any(_is_no_unit(part) for part in re.findall(r"[^\W\d_]+", expression)):
            return None
        quantity = _registry().Quantity(1.0, _registry().parse_units(expression)).to_base_units()
    except (pint.PintError, ArithmeticError, AttributeError, TypeError, ValueError):
        return None
    return _judged(text, str(_registry().parse_units(expression)), quantity)


def _is_no_unit(word: str) -> bool:
    """Whether pint reads a word as a unit with a prefix that nobody writes before it, or a symbol in the plural."""
    prefix, unit, suffix = next(iter(_registry().parse_unit_name(word)), ("", "", ""))
    is_plural = suffix == "s" and (len(word) < 3 or not word.islower())
    return is_plural or (prefix not in ("", "micro") and unit in _WITHOUT_PREFIX)


def _judged(text: str, known: str, quantity: Any) -> Unit | None:
    """Return the unit for a quantity in base units."""
    base = str(quantity.units)
    dimensions = {name: int(power) for name, power in quantity.dimensionality.items()}
    size = float(f"{float(quantity.magnitude):.14g}")  # 0.1, not 0.09999999999999999
    if base == "radian":
        return Unit("angle", text, size)
    if base == "dimensionless":
        return Unit("strain", text, size)
    # An energy has the dimensions of a moment, and so has a moment per angle.
    # pint's pixels and points are lengths on a printed page.
    foreign = re.search(
        r"pixel|point|pica|dot|joule|calor|thermal|watt|volt|erg|hartree|radian|bit|count", f"{known} {base}"
    )
    for measured, wanted, scale in _DIMENSIONS:
        if dimensions == wanted and not foreign:
            low, high = _PREFIX.get(measured, (0.0, float("inf")))
            return (
                Unit(measured, text, float(f"{size * scale:.14g}")) if low <= size * scale <= high else None
            )
    return Unit(OTHER, text, 0.0)


@functools.cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()
