"""Units as people write them -> the measured quantity, and their factor to N, mm, MPa, s, rad.

One grammar reads a unit completely: words, each a prefix and a unit of the table below (or a force and a length written
together, ``Ncm``, ``ftlb``), joined by signs of multiplication and division, with powers. A text of which a part is
not understood is no unit. pint, which takes 0.5 s to import, is asked only what else such a text may be (a mass, a
voltage), and for units without a prefix that are in no table. Nothing is guessed.
"""

from __future__ import annotations

import functools
import math
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from bushcli.recording.source import UNITS

#: Stands for any quantity that a recording does not contain.
OTHER = "other"


class _Size(NamedTuple):
    """Powers of time, length, force and angle of a unit, and its factor to s, mm, N, rad."""

    powers: tuple[int, int, int, int]
    factor: float

    def times(self, other: _Size, power: int = 1) -> _Size:
        """Return the product with a power of another unit."""
        powers = tuple(a + power * b for a, b in zip(self.powers, other.powers, strict=True))
        return _Size(powers, self.factor * other.factor**power)  # type: ignore[arg-type]


_ONE = _Size((0, 0, 0, 0), 1.0)
_POWERS: Mapping[str, tuple[int, int, int, int]] = {
    "time": (1, 0, 0, 0), "length": (0, 1, 0, 0), "force": (0, 0, 1, 0), "angle": (0, 0, 0, 1), "moment": (0, 1, 1, 0),
    "stress": (0, -2, 1, 0), "strain": (0, 0, 0, 0),
}  # fmt: skip
_MEASURED = {powers: measured for measured, powers in _POWERS.items()}
#: International inch and pound (1959), and standard gravity, m/s2, by definition.
_INCH, _GRAVITY = 25.4, 9.80665
_POUND = 0.45359237 * _GRAVITY
#: Quantity, factor to the internal unit, prefixes in use, and spellings, without blanks, in their usual case. Nobody
#: records in megaseconds: a prefix that is not in use, as in "Ms", is a slip or has another meaning.
_TABLE: tuple[tuple[str, float, str, str], ...] = (
    ("time", 1.0, "m u n", "s sec secs Sec sek с сек 秒 초"),
    ("time", 1.0, "milli micro nano", "second seconds Sekunde Sekunden seconde secondes secondo secondi"),
    ("time", 1.0, "milli micro nano", "segundo segundos"),
    ("time", 60.0, "", "min mins minute minutes Minute Minuten minuto minuti minutos мин 分"),
    ("time", 3600.0, "", "h hr hrs hour hours Stunde Stunden heure heures ora ore hora horas ч 小时"),
    ("time", 86400.0, "", "day days Tag Tage jour jours"),
    ("time", 1e-3, "", "мс 毫秒 ミリ秒"),
    ("length", 1e3, "k d c m u n", "m"),
    ("length", 1e3, "kilo deci centi milli micro nano", "meter meters metre metres mètre mètres metro metri metros"),
    ("length", 1e3, "", "м 米"),
    ("length", 1.0, "", "毫米 мм ミリ ミリメートル milímetro milímetros"),
    ("length", 10.0, "", "см 厘米 centímetro centímetros"),
    ("length", 1e-3, "", "mikron micron microns мкм 微米"),
    ("length", _INCH, "u", "in inch inches Zoll \" '' ″ pollice pollici pouce pouces pulgada pulgadas дюйм дюймы 英寸"),
    ("length", _INCH, "milli micro", "inch inches"),
    ("length", 12.0 * _INCH, "", "ft foot feet Fuß Fuss ' ′ pied pieds"),
    ("length", 36.0 * _INCH, "", "yd yard yards"),
    ("length", _INCH / 1e3, "", "mil mils thou thous"),
    ("angle", math.pi / 180.0, "m milli", "deg degs Deg degree degrees"),
    ("angle", math.pi / 180.0, "", "° º Grad degré degrés grado gradi grados град 度"),
    ("angle", 1.0, "m u milli micro", "rad rads Rad radian radians Radiant Radianten"),
    ("angle", 1.0, "", "рад 弧度 ラジアン radianti radianes"),
    ("angle", math.pi / 200.0, "m", "gon"),
    ("angle", 2.0 * math.pi, "", "rev revs turn turns revolution revolutions Umdr Umdrehung Umdrehungen tr giri"),
    ("angle", math.pi / 10800.0, "", "arcmin arcmins arcminute arcminutes Winkelminute Winkelminuten"),
    ("angle", math.pi / 648000.0, "", "arcsec arcsecs arcsecond arcseconds Winkelsekunde Winkelsekunden"),
    ("force", 1.0, "da h k K M d c m u", "N"),
    ("force", 1.0, "deca hecto kilo mega deci centi milli micro", "newton newtons"),
    ("force", 1.0, "", "牛 牛顿 Н ニュートン 뉴턴"),
    ("force", 1e3, "", "千牛 кН キロニュートン"),
    ("force", 10.0, "", "даН"),
    ("force", _GRAVITY, "", "kgf kgF kp kpond kilopond kiloponds"),
    ("force", _GRAVITY, "", "kgforce kgsforce kilogramforce kilogramsforce kilogrammeforce кгс"),
    ("force", _GRAVITY / 1e3, "", "gf pond ponds gramforce gramsforce"),
    ("force", 1e3 * _GRAVITY, "", "tf tonneforce tonnesforce"),
    ("force", _POUND, "k", "lbf lbfs"),
    ("force", _POUND, "", "lbforce poundforce poundsforce"),
    ("force", 1e3 * _POUND, "", "kip kips"),
    ("force", _POUND / 16.0, "", "ozf ounceforce"),
    ("force", 1e-5, "", "dyn dyne dynes"),
    ("moment", 1e3, "", "newtonmeter newtonmeters newtonmetre newtonmetres Н·м Нм 牛米 牛顿米 牛·米"),
    ("moment", 1.0, "", "newtonmillimeter newtonmillimeters newtonmillimetre newtonmillimetres 牛毫米"),
    ("moment", 10.0, "", "newtoncentimeter newtoncentimeters newtoncentimetre"),
    ("moment", 1e6, "", "kilonewtonmeter kilonewtonmeters kilonewtonmetre"),
    ("stress", 1e-6, "h k K M G", "Pa"),
    ("stress", 1e-6, "hecto kilo mega giga", "pascal pascals"),
    ("stress", 1.0, "", "МПа 兆帕"),
    ("stress", 1e-3, "", "кПа 千帕"),
    ("stress", 0.1, "m k", "bar"),
    ("stress", 0.1, "milli", "bar bars"),
    ("stress", 0.0980665, "", "at"),
    ("stress", 0.101325, "", "atm atmosphere atmospheres"),
    ("stress", _POUND / _INCH**2, "", "psi"),
    ("stress", 1e3 * _POUND / _INCH**2, "", "ksi"),
    ("strain", 0.01, "", "% percent pct percentage Prozent pourcent percento percentuale por_ciento"),
    ("strain", 1e-3, "", "‰ permille permil Promille"),
    ("strain", 1e-6, "", "ppm"),
    ("strain", 1.0, "m u milli micro", "strain strains"),
    ("strain", 1.0, "m u", "ε"),
)  # fmt: skip
_PREFIXES = {
    "da": 10.0, "h": 100.0, "k": 1e3, "K": 1e3, "M": 1e6, "G": 1e9, "d": 0.1, "c": 0.01, "m": 1e-3, "u": 1e-6,
    "n": 1e-9, "deca": 10.0, "deka": 10.0, "hecto": 100.0, "hekto": 100.0,
    "kilo": 1e3, "mega": 1e6, "giga": 1e9, "deci": 0.1,
    "dezi": 0.1, "centi": 0.01, "zenti": 0.01, "milli": 1e-3, "micro": 1e-6, "mikro": 1e-6, "nano": 1e-9,
}  # fmt: skip
_ALSO = {"deca": "deka", "hecto": "hekto", "deci": "dezi", "centi": "zenti", "micro": "mikro"}
#: Numbers in words before a unit, "pi rad", "Mio N".
COUNTED = {
    "pi": math.pi,
    "π": math.pi,
    "mio": 1e6,
    "mio.": 1e6,
    "tsd": 1e3,
    "tsd.": 1e3,
    "mega": 1e6,
    "kilo": 1e3,
}
_COUNTED_UNIT = re.compile(r"(pi|π|mio\.?|tsd\.?|mega|kilo)[\s*·⋅×∙•-]*(?=\D)", re.IGNORECASE)
#: For a force, a pound or ounce is a pound-force or ounce-force: nobody measures a mass with a load cell. Kilograms are
#: refused, because many read-outs show them, and the file does not say whether they were converted.
_OF_FORCE = dict.fromkeys(("lb", "lbs", "pound", "pounds", "#"), _POUND)
_OF_FORCE |= dict.fromkeys(("klb", "klbs", "kilopound", "kilopounds"), 1e3 * _POUND)
_OF_FORCE |= dict.fromkeys(("oz", "ounce", "ounces"), _POUND / 16.0)
#: Units that are words of names as well, so that they are units only where units stand: "Turns", "Force at".
_LOOSE = frozenset([
    "rev", "revs", "turn", "turns", "revolution", "revolutions", "at", "bar", "bars", "tr", "ora", "ore", "hora",
    "foot", "feet", "tag", "day", "days", "mil", "mils", "yard", "yards", "yd", "pond", "ponds", "oz", "ounce",
    "ounces", "#", "klb", "klbs", "'", "′", "strains", "ε", "jour", "jours", "metro", "radiant", "us", "tf", "kip",
    "kips", "microstrain", "strain", "un", "hn", "dn", "cn", "nin", "km",
])  # fmt: skip
#: Units of other quantities that stand in the files of rigs; pint knows more of them, and takes half a second to load.
_FOREIGN = frozenset([
    "kg", "mg", "tonne", "tonnes", "kilogram", "kilograms", "mV", "volt", "volts", "mA", "°C", "°F", "Hz", "kHz", "kJ",
    "px",
])  # fmt: skip
_ELSEWHERE = _FOREIGN | {"to", "Tonne", "Tonnen", "ton", "tons", "tonf", "Volt", "Volts"}
#: Texts that mean "no unit".
NO_UNIT = ("-", "--", "1", "")
#: Texts that are used with two meanings, each with the unambiguous spellings.
AMBIGUOUS: Mapping[str, str] = {
    "grad": '"deg" for degrees, "gon" for 1/400 of a turn',
    "grads": '"deg" for degrees, "gon" for 1/400 of a turn',
    "ton": '"kgf", "kN" or "lbf": a ton has 1000 kg, 2000 lb or 2240 lb',
    "tons": '"kgf", "kN" or "lbf": a ton has 1000 kg, 2000 lb or 2240 lb',
    "tonf": '"kN" or "lbf": a ton has 1000 kg, 2000 lb or 2240 lb',
}
#: Names of `UNITS`, the last one of each size, and units that are shown by them.
_NAMES = {(kind, float(f"{size:.12g}")): name for kind, each in UNITS.items() for name, size in each.items()}
#: Surveyors' units of pint that name a part of a machine in the header of a rig: "Displacement (rod)".
_PARTS = frozenset(
    ["rod", "rods", "pole", "poles", "perch", "link", "links", "chain", "chains", "hand", "hands"]
)
#: Factors beyond these are slips: mPa for MPa, Mm for mm; or no units of a test: a year, "EN".
_SENSIBLE = {
    "stress": (1e-7, 1e7), "length": (1e-7, 1e7), "force": (1e-7, 1e7), "moment": (1e-7, 1e10), "time": (1e-10, 1e6),
}  # fmt: skip
#: SI base units, with pint's names of the dimensions, in internal units.
_DIMENSIONS: tuple[tuple[str, Mapping[str, int], float], ...] = (
    ("time", {"[time]": 1}, 1.0),
    ("length", {"[length]": 1}, 1e3),
    ("force", {"[mass]": 1, "[length]": 1, "[time]": -2}, 1.0),
    ("moment", {"[mass]": 1, "[length]": 2, "[time]": -2}, 1e3),
    ("stress", {"[mass]": 1, "[length]": -1, "[time]": -2}, 1e-6),
)
_PINT = r"[A-Za-zµμ°Å]+(?:\*\*[1-9])?"
_EXPRESSION = re.compile(rf"{_PINT}(?:[*/]{_PINT}){{0,3}}")
_LONGEST = 40
_SIGNS = r"*·⋅×∙•‧・.\-_"
_WORD = rf"[^\s\d/{_SIGNS}^()]+"
_FACTOR = re.compile(rf"({_WORD})(?:(?:\^|\*\*)?\(?(-[1-4]|[2-4])\)?)?")
_OPERATOR = re.compile(rf"[/{_SIGNS}]")
#: Square units in words: sqmm, qmm, sq.in.
_SQUARE = re.compile(r"(?i)(?<![^\W_])(?:sq[.\-_]?|q(?=[cm]?m(?![^\W\d_])))(mm|cm|m|in|ft)(?![^\W_])")
#: Between the words of "kilo-newton".
_HYPHEN = re.compile(
    r"(?i)(?<=kilo|mega|giga|deca|deka|deci|nano)-(?=[^\W\d_])|(?<=milli|micro|mikro|centi|hecto)-(?=[^\W\d_])"
)
_SUPERSCRIPTS = str.maketrans({"²": "2", "³": "3", "⁻": "-", "¹": "1", "⁴": "4", "µ": "u", "μ": "u"})
#: A number before a unit: "0.1 N", "x10 N", "10^3 N", "1/10 mm", "1e3 N".
_NUMBER = r"\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?"
_SCALED = re.compile(
    rf"\s*[x×*]?\s*(?:(?P<over>{_NUMBER})\s*/\s*(?P<under>{_NUMBER})|10\s*(?:\^|\*\*)\s*(?P<power>[-+]?\d{{1,2}})"
    rf"|(?P<plain>{_NUMBER}))\s*[x×*·]?\s*(?P<unit>[^\W\d_].*|[%°‰\"'].*)"
)

#: Factor to kelvins, and the value in degrees C of zero.
_TEMPERATURES = {
    "°c": (1.0, 0.0), "degc": (1.0, 0.0), "℃": (1.0, 0.0), "c": (1.0, 0.0), "celsius": (1.0, 0.0), "∑c": (1.0, 0.0),
    "k": (1.0, -273.15), "kelvin": (1.0, -273.15),
    "°f": (5 / 9, -160 / 9), "degf": (5 / 9, -160 / 9), "f": (5 / 9, -160 / 9), "fahrenheit": (5 / 9, -160 / 9),
}  # fmt: skip
#: Factor to Hz.
_FREQUENCIES = {
    "hz": 1.0, "hertz": 1.0, "khz": 1e3, "mhz": 1e-3, "rad/s": 0.5 / math.pi, "rads-1": 0.5 / math.pi,
    "rad/sec": 0.5 / math.pi, "rad·s-1": 0.5 / math.pi, "rad*s-1": 0.5 / math.pi, "rpm": 1 / 60, "cpm": 1 / 60,
    "cps": 1.0,
}  # fmt: skip
#: "Ns/mm", "kNs/m", "Nms/rad": a force, or a moment, times seconds, written together.
_IMPULSE = re.compile(r"(?<![^\W_])([kM]?N)(mm|m)?s(?![^\W_])")
#: Kinds of units by powers of time, length, force and angle: those of a recording, and of stiffness and damping.
_KINDS = _MEASURED | {
    (0, -1, 1, 0): "stiffness", (0, 1, 1, -1): "rotational stiffness", (1, -1, 1, 0): "damping",
    (1, 1, 1, -1): "rotational damping", (1, 1, 1, 0): "rotational damping",
}  # fmt: skip


@dataclass(frozen=True)
class Unit:
    """A unit.

    Attributes
    ----------
    measured : str
        A key of `bushcli.recording.source.UNITS`, one of `_KINDS`, "frequency", "temperature", or `OTHER`.
    name : str
        As in `UNITS`, or as it was written.
    factor, zero : float
        ``value in the internal unit, Hz or degrees C = factor * number + zero``; both are 0 for `OTHER`.
    """

    measured: str
    name: str
    factor: float
    zero: float = 0.0


#: Each spelling of the table, with each prefix that is in use, and its size.
_EXACT = {
    prefix + spelling: _Size(_POWERS[measured], factor * _PREFIXES.get(prefix, 1.0))
    for measured, factor, prefixes, spellings in _TABLE
    for spelling in spellings.split()
    for prefix in ("", *prefixes.split(), *(_ALSO[key] for key in prefixes.split() if key in _ALSO))
}
_FOLDED: dict[str, set[_Size]] = {}
for _spelling, _one in _EXACT.items():
    _FOLDED.setdefault(_spelling.lower(), set()).add(_one)


def plain_unit(text: str) -> str:
    """Return a unit as written, but without blanks, enclosing brackets and a final full stop."""
    bare = re.sub(r"\s", "", text[: 4 * _LONGEST])
    bare = re.sub(r"^[\[({<]+|[\])}>]+$", "", bare)
    return bare.rstrip(".") if len(bare) > 1 else bare


def tabulated_unit(text: str, measured: str = "") -> Unit | None:
    """Return a unit that a text means wherever it stands, without pint; None for any other text."""
    bare = plain_unit(text)
    bare = "%" if bare.startswith("%") else bare  # "%-ext": percent by extensometer
    is_listed = bare.lower() not in _LOOSE and bare not in AMBIGUOUS
    unit = _parse_unit(bare, measured) if is_listed else None
    return None if unit is None or unit.measured == OTHER else unit


def find_unit(text: str, measured: str) -> Unit | None:
    """Return the unit that a text names, for a column of the quantity ``measured``; None if it names no unit.

    Parameters
    ----------
    text : str
        As written: ``kgf``, ``[ft-lb]``.
    measured : str
        A key of `bushcli.recording.source.UNITS`.
    """
    bare = plain_unit(text)
    bare = "%" if bare.startswith("%") else bare
    unit = None
    if measured != "time" and re.search(r"\w[\s*·.]s\W*$", text):
        pass  # "N s" is an impulse; without its blank it would be a plural
    elif bare in UNITS[measured]:
        unit = Unit(measured, bare, UNITS[measured][bare])
    elif bare not in AMBIGUOUS:
        unit = _parse_unit(bare, measured)
        counted = _COUNTED_UNIT.match(bare) if measured in ("force", "angle", "moment") else None
        if unit is None and counted:
            base = find_unit(bare[counted.end() :], measured)
            unit = base and replace(base, name=bare, factor=COUNTED[counted[1].lower()] * base.factor)
        elif unit is None and bare in _FOREIGN:
            unit = Unit(OTHER, bare, 0.0)
        elif unit is None and bare.lower() not in AMBIGUOUS:
            unit = _unit_by_pint(bare) or (_unit_by_pint(bare.lower()) if bare.isupper() else None)
    return unit


def certain_unit(text: str) -> bool:
    """Whether a text is surely a unit, also of another quantity, ``N/s``, or with a number before it, ``0.1 N``."""
    bare = plain_unit(text)
    match = _SCALED.fullmatch(text)
    return bool(
        tabulated_unit(text)
        or bare in _ELSEWHERE
        or (len(bare) > 1 and bare.lower() not in _LOOSE and _parse_unit(bare, ""))
        or (match and tabulated_unit(match["unit"]))
    )


def is_unit(text: str) -> bool:
    """Whether a text is completely understood as a unit of any quantity, also of one that no recording contains."""
    return tabulated_unit(text) is not None or any(
        unit is not None and (unit.factor > 0.0 or len(plain_unit(text)) > 1)
        for unit in (find_unit(text, kind) for kind in UNITS)
    )


def scaled_unit(text: str, measured: str) -> Unit | None:
    """Return the unit that the case file gives, which may have a number before it, ``0.1 N``, ``1/10 mm``; or None.

    In a recording such a number may also be the range of a sensor.

    Parameters
    ----------
    text : str
    measured : str
        A key of `bushcli.recording.source.UNITS`.
    """
    match = _SCALED.fullmatch(text)
    unit = find_unit(match["unit"] if match else text, measured)
    if match is None or unit is None or not unit.factor:
        return unit
    over, under, power, plain = (match[key] for key in ("over", "under", "power", "plain"))
    number = 10.0 ** int(power) if power else float((plain or over).replace(",", "."))
    number /= float(under.replace(",", ".")) if under else 1.0
    return replace(unit, name=text.strip(), factor=number * unit.factor) if 0.0 < number < math.inf else None


def read_unit(text: str) -> Unit | None:
    """Return the unit that a text names: to Hz, degrees C, and the internal units of a recording; None for others."""
    inside = text.strip().strip("[](){}")
    bare = re.sub(r"\s+", "", inside)
    size, low = None, bare.lower()
    if bare and not bare[0].isdigit():
        spaced = _IMPULSE.sub(lambda m: f"{m[1]}*{m[2] + '*' if m[2] else ''}s", inside)
        size = _size(plain_unit(re.sub(r"(?<=[^\W_])\s+(?=[^\W_])", "*", spaced)), "")
    unit = Unit(_KINDS[size.powers], bare, size.factor) if size and size.powers in _KINDS else None
    if low in _FREQUENCIES:
        unit = Unit("frequency", bare, _FREQUENCIES[low])
    elif low in _TEMPERATURES:
        unit = Unit("temperature", bare, *_TEMPERATURES[low])
    elif bare in ("1", "-", "--"):
        unit = Unit("strain", bare, 1.0)
    return unit


def slip(text: str, measured: str) -> str:
    """Return the unit that differs from a text by upper and lower case only, or an empty text."""
    near = [size for size in _FOLDED.get(plain_unit(text).lower(), ()) if size.powers == _POWERS[measured]]
    names = [_NAMES.get((measured, float(f"{size.factor:.12g}")), "") for size in near]
    return names[0] if len(names) == 1 else ""


@functools.lru_cache(maxsize=4096)
def _parse_unit(bare: str, measured: str) -> Unit | None:
    """Return the unit that a text without blanks means by the grammar; None if a part of it is not understood."""
    size = _size(bare, measured)
    of = _MEASURED.get(size.powers, OTHER) if size else ""
    factor = float(f"{size.factor:.14g}") if size else 0.0  # 0.1, not 0.09999999999999999
    low, high = _SENSIBLE.get(of, (0.0, math.inf))
    bare_ratio = size and of == "strain" and size.factor == 1.0
    ratio = bare_ratio and "/" in bare and not re.fullmatch(r"(\w+)/\1", bare)
    name = _NAMES.get((of, float(f"{factor:.12g}")))
    unit = Unit(of, bare, 0.0 if of == OTHER else factor) if name is None else Unit(of, name, UNITS[of][name])
    return unit if size and low <= size.factor <= high and not ratio else None


def _size(bare: str, measured: str) -> _Size | None:
    """Return the product of the words of a unit without blanks, or None."""
    text = unicodedata.normalize("NFKC", bare.translate(_SUPERSCRIPTS)).translate(_SUPERSCRIPTS)
    text = re.sub(r"(?:-?\(|[-_])(f|force)$", r"\1", text, flags=re.IGNORECASE)  # kg-f, kg(f), pound-force
    text = _SQUARE.sub(r"\g<1>2", _HYPHEN.sub("", text))
    size: _Size | None = _ONE
    position, power, goes_on = 0, 1, True
    while size is not None and goes_on:
        factor = _FACTOR.match(text, position)
        word = _word(factor[1], measured) if factor else None
        size = size.times(word, power * int(factor[2] or 1)) if factor and word else None
        position = factor.end() if factor else position
        sign = _OPERATOR.match(text, position)
        goes_on = sign is not None
        power, position = (-1 if sign[0] == "/" else 1, sign.end()) if sign else (power, position)
    return _word(bare, measured) or (size if position == len(text) else None)


def _word(word: str, measured: str) -> _Size | None:
    """Return the size of one word: a unit with or without prefix, or a force and a length, ``ftlb``."""
    whole = _single(word, measured)
    for cut in range(1, len(word) if whole is None else 0):
        first, second = _single(word[:cut], measured), _single(word[cut:], measured)
        kinds = [_MEASURED.get(size.powers) if size else None for size in (first, second)]
        # "mN" is a millinewton; a length comes first before pounds, ounces and kiloponds only.
        before = word[cut:].lower() in ("lb", "lbs", "lbf", "oz", "ozf", "kp", "kgf", "kip", "kips")
        if first and second and (kinds == ["force", "length"] or (before and kinds == ["length", "force"])):
            return first.times(second)
    return whole


def _single(word: str, measured: str) -> _Size | None:
    """Return the size of a unit with or without prefix; None for other words."""
    titled = word.isupper() or word.istitle()
    pounds = _OF_FORCE.get(word) or (_OF_FORCE.get(word.lower()) if titled else None)
    word = word.replace("µ", "u").replace("μ", "u")
    # MPA, SEC, KN; force_kn, stress_mpa; Sec. In other mixtures of cases a prefix matters: mPa is not MPa. "In" is the
    # only short unit that rigs write like a title.
    plain = word.isupper() or word.islower() or (word.istitle() and (len(word) > 2 or word == "In"))
    folded = _FOLDED.get(word.lower(), set()) if plain else set()
    if pounds is not None:
        size: _Size | None = _Size(_POWERS["force"], pounds)
    elif word in ("nm", "NM") and measured != "length":
        size = _Size(_POWERS["moment"], 1e3)
    else:
        size = _EXACT.get(word) or (next(iter(folded)) if len(folded) == 1 else None)
    return size


def _unit_by_pint(bare: str) -> Unit | None:
    """Return what pint takes a text for: a unit of another quantity, or one without a prefix; None for other texts.

    The grammar has the prefixes that are in use: pint's "Ms" and "EN" are slips.
    """
    expression = re.sub(r"[·⋅×∙•.\-_]", "*", bare).replace("^", "**").replace("²", "**2").replace("³", "**3")
    expression = re.sub(r"(?<=[A-Za-zµμ])([2-4])(?!\d)", r"**\1", expression)
    if len(expression) > _LONGEST or not _EXPRESSION.fullmatch(expression):
        return None
    words = re.findall(r"[^\W\d_]+", expression)
    if "pond" in expression or not _PARTS.isdisjoint(words):
        return None
    import pint  # here, because importing it takes longer than checking a case

    try:
        parsed = [next(iter(_registry().parse_unit_name(word)), ("", "", "")) for word in words]
        plural = [w for w, (_, _, end) in zip(words, parsed, strict=True) if end == "s"]
        if any(len(w) < 3 or not w.islower() for w in plural):
            return None
        known = str(_registry().parse_units(expression))
        quantity = _registry().Quantity(1.0, known).to_base_units()
    except (pint.PintError, ArithmeticError, AttributeError, TypeError, ValueError):
        return None
    size = float(f"{float(quantity.magnitude):.14g}")
    dimensions = {name: int(power) for name, power in quantity.dimensionality.items()}
    # An energy has the dimensions of a moment, and so has a moment per angle; pint's pixels and points are lengths on a
    # printed page. The numbers mV/V and the angle "mil" of gunners are no strains and angles.
    names = "pixel|point|pica|dot|joule|calor|thermal|watt|volt|erg|hartree|radian|bit|count"
    foreign = re.search(names, f"{known} {quantity.units}")
    for of, wanted, scale in () if foreign else _DIMENSIONS:
        if dimensions == wanted:
            low, high = _SENSIBLE[of]
            factor = float(f"{size * scale:.14g}")
            prefixed = any(prefix for prefix, _, _ in parsed)
            return Unit(of, bare, factor) if low <= factor <= high and not prefixed else None
    return Unit(OTHER, bare, 0.0)


@functools.cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()
