"""Names of the columns of a dynamic table: ``E'' [MPa]``, ``Kdyn @ 0.1 mm (N/mm)`` -> quantity, unit, conditions."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal

from bushcli.recording.header.units import Unit, read_unit
from bushcli.recording.header.vocabulary import plain_name
from bushcli.recording.text.fields import is_thousands

Peak = Literal["peak", "double", ""]

#: Kinds of units that a quantity has, of a coupon, of a rotation and of a translation; and of any of these.
KINDS_OF_MODES: Mapping[str, tuple[frozenset[str], ...]] = {
    quantity: tuple(frozenset(kinds.split(", ")) for kinds in by_mode)
    for quantities, by_mode in (
        ("amplitude preload", ("strain", "angle", "length")),
        ("preload_force", ("stress", "moment", "force")),
        ("damping", ("damping", "rotational damping", "damping")),
        ("frequency", ("frequency",) * 3),
        ("temperature", ("temperature",) * 3),
        ("loss_angle", ("angle",) * 3),
        ("tan_delta", ("strain",) * 3),
        (
            "stiffness modulus storage loss storage_error loss_error",
            ("stress", "rotational stiffness, moment", "stiffness"),
        ),
    )
    for quantity in quantities.split()
}
KINDS = {quantity: frozenset[str]().union(*kinds) for quantity, kinds in KINDS_OF_MODES.items()}
#: Words for a column, in lower case with single blanks; the longest that a name contains decides. "modulus" is one of
#: |K*| and K', as a rig's "stiffness" is: the file or the user has to say which.
_WORDS: Mapping[str, tuple[str, ...]] = {
    "frequency": (
        "frequency", "freq", "frequenz", "fréquence", "frequence", "frecuencia", "frequenza", "频率", "周波数",
        "частота", "omega", "ω", "kreisfrequenz", "pulsation", "f",
    ),
    "amplitude": (
        "amplitude", "amplitudes", "ampl", "amp", "amplitud", "ampiezza", "振幅", "dynamic strain", "dyn strain",
        "strain amplitude", "dynamic displacement", "dyn displacement", "dehnungsamplitude", "wegamplitude",
        "schwingweg", "doppelamplitude", "schwingbreite", "oscillation strain", "oscillatory strain", "strain",
        "shear strain", "dehnung", "gamma", "γ", "dsa", "dda", "dynamic travel", "displacement amplitude", "a",
        "dyn disp", "dynamic disp", "dynamic stroke",
    ),
    "preload": (
        "preload", "pre load", "vorlast", "vorkraft", "vorspannung", "vorweg", "mittellast", "mittelkraft", "mean",
        "mean load", "mean force", "mean displacement", "mean strain", "mean position", "static load",
        "static force", "static displacement", "static strain", "static deflection", "prestrain", "pre strain",
        "vordehnung", "précharge", "precharge", "precarico", "precarga", "offset", "static offset", "mean stress",
        "static stress", "prestress",
    ),
    "temperature": (
        "temperature", "temp", "temperatur", "température", "temperatura", "温度", "температура", "t",
    ),
    "stiffness": (
        "complex", "kd", "dynamic stiffness", "dyn stiffness", "dynamic rate", "dynamic spring rate", "kdyn", "k dyn",
        "cdyn", "c dyn", "dynamische steifigkeit", "dyn steifigkeit", "dynamische federrate", "complex stiffness",
        "complex modulus", "komplexer modul", "complex shear modulus", "raideur dynamique", "动刚度", "動ばね定数",
    ),
    "modulus": (
        "stiffness", "spring rate", "steifigkeit", "drehsteifigkeit",
        "federrate", "rate", "modulus", "modul", "e modulus", "e modul",
        "g modulus", "g modul", "k", "dynamic modulus", "raideur", "rigidezza", "刚度", "e", "g",
    ),
    "storage": (
        "storage", "storage stiffness", "storage modulus", "elastic stiffness", "elastic modulus",
        "storage shear modulus", "speichermodul", "speichersteifigkeit", "real", "real part", "in phase",
        "in phase stiffness", "stor", "k1", "re", "module de conservation", "储能模量", "貯蔵弾性率", "eprime",
        "gprime", "kprime", "prime", "estor", "gstor",
    ),
    "loss": (
        "loss", "loss stiffness", "loss modulus", "loss shear modulus", "verlustmodul", "verluststeifigkeit",
        "imaginary", "imag", "imaginary part", "out of phase", "quadrature", "viscous modulus", "viscous stiffness",
        "k2", "im", "module de perte", "损耗模量", "損失弾性率", "double prime", "dprime", "edoubleprime",
        "gdoubleprime", "eloss", "gloss",
    ),
    "loss_angle": (
        "loss angle", "phase", "phase angle", "phase lag", "phase shift", "phase delay", "delta", "δ",
        "verlustwinkel", "phasenwinkel", "phase difference", "angle de perte", "angle", "phi", "φ", "损耗角",
        "位相角", "phasenverschiebung",
    ),
    "tan_delta": (
        "tan delta", "tan d", "tand", "tandelta", "tan δ", "tanδ", "tan", "loss factor", "loss tangent", "tan phi",
        "tangent delta", "verlustfaktor", "facteur de perte", "damping factor", "损耗因子", "損失係数",
        "tan loss angle",
    ),
    "damping": (
        "damping", "damping coefficient", "damping constant", "damping rate", "dämpfung", "dämpfungskonstante",
        "dämpfungskoeffizient", "viscous damping", "c damping", "amortissement", "阻尼", "damping value",
    ),
    # Of columns that a rig's table has too, and that are not these: a force is no preload.
    "": (
        "force amplitude", "dynamic force", "dyn force", "kraftamplitude", "dynamic load", "stress amplitude",
        "dynamic stress", "force", "kraft", "stress", "energy", "energie", "compliance", "static stiffness",
        "statische steifigkeit", "static rate", "tan delta ref", "time", "zeit", "damping ratio", "viscosity",
        "complex viscosity", "complex compliance", "set", "index", "nr", "no", "cycles", "damping energy",
    ),
}  # fmt: skip
_ERRORS = re.compile(
    r"\b(std|stdev|sd|se|standard error|standard deviation|uncertainty|standardabweichung|err|error)\b"
)
_PEAK = re.compile(r"\b(peak|0 p|0 pk|zero to peak|half|single|einfach|scheitel|ampl zero peak)\b|±|\+/-")
_DOUBLE = re.compile(
    r"\b(double|p p|pp|pk pk|peak to peak|peak peak|pkpk|ptp|spitze (?:zu )?spitze|doppel\w*|schwingbreite|range|dda"
    r"|total|crête à crête)\b"
)
CONDITIONS = ("frequency", "amplitude", "preload", "preload_force", "temperature")
#: K', E'' (with one sign, two, or an inch mark), E*, |G*|, |K|.
_MAGNITUDE = re.compile(r"\|\s*([KCEGkceg])\s*\*?\s*\|")
_PRIMED = re.compile(
    r"""(?<![^\W_])([KCEGkceg])(?:_?dyn)?\s*(\*|''|"|″|”|’’|´´|′′|``|'|′|’|´|`)(?!\w)""",
)
_SIGNED = {"*": "complex"} | dict.fromkeys(("''", '"', "″", "”", "’’", "´´", "′′", "``"), "loss")
#: The modulus of a coupon by its symbol or its words.
_SHEAR = re.compile(
    r"(?<![^\W_])G(?![^\W_])|(?<![^\W_])G(?:stor|loss|prime|doubleprime)|\bshear\b|schub", re.IGNORECASE
)
_TENSILE = re.compile(
    r"(?<![^\W_])E(?![^\W_])|(?<![^\W_])E(?:stor|loss|prime|doubleprime)|young|tensile|elastizit",
    re.IGNORECASE,
)
#: A condition in a name: "@ 0.1 mm", "(500 N)", "A=±0.5mm", "23°C", "10 Hz".
_CONDITION = re.compile(
    r"(?P<key>[^\W\d_]+)?\s*[@=:]?\s*(?P<sign>±|\+/-|[-+])?\s*(?<![\w.])(?P<number>\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)"
    r"\s*_?(?P<unit>mm|µm|μm|um|kNm|Nmm|Nm|kN|N|°C|degC|°F|K|C|Hz|%|degrees|deg|°|mrad|rad|MPa)(?![\w/*·^])"
    r"\s*(?P<pp>p-?p|pk-?pk|peak[- ]to[- ]peak|0-p|peak|pk)?"
)
#: A condition in a line: its name, its number, its unit, and what follows them, "(peak)".
_STATED = re.compile(
    r"\s*[#%/]*\s*(?P<key>[^:=;\t\d]*?[^:=;\t\d\s])\s*[:=;,\t]+"
    r"\s*(?P<number>(?:±|\+/-|[-+])?\s?(?:\d{1,3}(?:,\d{3})+(?:\.\d+)?|\d{1,3}(?:\.\d{3})+(?:,\d+)?|\d+(?:[.,]\d+)?)"
    r"(?![.,]?\d)(?:[eE][-+]?\d+)?)\s*[;,\t]?\s*\[?(?P<unit>[^\s;,\t\]]*)(?P<rest>.*)"
)
#: What stands beside a unit in its brackets: "(mm p-p)", "[±mm]".
_BESIDE = re.compile(r"±|\+/-|\b(?:p-?p|pk-?pk|peak[- ]to[- ]peak|0-p|0-pk|peak|pk|double|zero-peak)\b")
#: The name of the contract for |K*|, in whatever unit.
_OWN = re.compile(r"stiffness_[A-Za-z]+_per_[A-Za-z]+")
#: Of a length or a strain in a name of a column: which condition it is, is not known.
ACROSS = "across"


@dataclass(frozen=True)
class Stated:
    """A number with a unit in a name or above the table: ``amplitude`` 0.1, length."""

    quantity: str
    number: float
    unit: Unit
    peak: Peak = ""

    @property
    def value(self) -> float:
        """The number in internal units."""
        return self.unit.factor * self.number + self.unit.zero


@dataclass(frozen=True)
class ColumnName:
    """The meaning of a column's name.

    Attributes
    ----------
    quantity : str
        A key of `KINDS`, or empty.
    unit : Unit, optional
        None where the name has no unit.
    written : str
        The unit as written.
    peak : {"peak", "double", ""}
        What the name says of an amplitude.
    modulus : {"E", "G", ""}
    conditions : tuple of Stated
        Of all rows of this column.
    """

    quantity: str
    unit: Unit | None = None
    written: str = ""
    peak: Peak = ""
    modulus: Literal["E", "G", ""] = ""
    conditions: tuple[Stated, ...] = field(default=())


def meaning(name: str, unit: str = "") -> ColumnName:
    """Return the meaning of the name of a column."""
    conditions = tuple(map(_condition, _CONDITION.finditer(name)))

    def condition_word(match: re.Match[str]) -> str:
        # Of a condition its word is kept if it is the column's, "Kdyn 500 N", not the number's, "preload 5 N".
        key = (match["key"] or "").lower()
        own = _quantity(key, None) in CONDITIONS or key in ("a", "at", "bei")
        return " " if own else f" {match['key'] or ''} "

    text, written, unit_of_name = next(_apart(_CONDITION.sub(condition_word, name)))
    if unit.strip() and (row := read_unit(unit)) is not None:
        written, unit_of_name = unit, row
    plain = text.replace("_", " ")
    modulus: Literal["E", "G", ""] = "G" if _SHEAR.search(plain) else "E" if _TENSILE.search(plain) else ""
    text = _MAGNITUDE.sub(r" \1 complex ", text)
    text = _PRIMED.sub(lambda m: f" {m[1]} {_SIGNED.get(m[2], 'storage')} ", text)
    words = _words(text)
    quantity = "stiffness" if _OWN.fullmatch(name.strip()) else _quantity(words, unit_of_name)
    quantity = quantity or _quantity(" ".join(_DOUBLE.sub(" ", _PEAK.sub(" ", words)).split()), unit_of_name)
    if not quantity and unit_of_name is not None:
        # The unit of these is enough, whatever the name of the column.
        sure = ("frequency", "temperature", "damping")
        quantity = next((candidate for candidate in sure if unit_of_name.measured in KINDS[candidate]), "")
    if quantity in ("storage", "loss") and _ERRORS.search(words):
        quantity += "_error"
    elif quantity and _ERRORS.search(words):
        quantity = ""
    if unit_of_name is not None and quantity and unit_of_name.measured not in KINDS[quantity]:
        # A preload in N is one of force.
        if unit_of_name.measured in KINDS["preload_force"]:
            quantity = {"preload": "preload_force", "amplitude": ""}.get(quantity, quantity)
        elif quantity == "modulus" and unit_of_name.measured in KINDS["damping"]:
            quantity = "damping"
    peak = _peak(words) if quantity == "amplitude" else ""
    return ColumnName(quantity, unit_of_name, written, peak, modulus, conditions)


def stated_condition(line: str, decimal: str = "") -> Stated | None:
    """Return the condition that a line above a table states, ``Preload: 500 N``, ``Frequency;10;Hz``; or None."""
    match = _STATED.match(line)
    if match is None:
        return None
    column = meaning(match["key"], match["unit"])
    if column.quantity not in CONDITIONS or column.unit is None:
        return None
    # "(peak)" behind the number is said of it, unless there is more, such as another range.
    behind = _words(re.split(r"[:=;\t]", match["rest"])[0])
    peak = column.peak if _PEAK.sub(" ", _DOUBLE.sub(" ", behind)).split() else _peak(behind) or column.peak
    if "±" in match["number"] or "/" in match["number"]:
        peak = "peak"
    return Stated(column.quantity, _number(match["number"], decimal), column.unit, peak)


def condition_of(text: str) -> Stated | None:
    """Return the condition that a whole text is, ``0.1 mm``, ``Preload 500 N``; None for other texts."""
    match = _CONDITION.fullmatch(text.strip())
    return None if match is None else _condition(match)


def _words(text: str) -> str:
    """Return a text in lower case with single blanks; a sign of a peak is its word."""
    return plain_name(re.sub(r"±|\+/-", " peak ", text))


def _peak(text: str) -> Peak:
    """Return what a text says of an amplitude."""
    words = _words(text)
    return "double" if _DOUBLE.search(words) else "peak" if _PEAK.search(words) else ""


def _number(text: str, decimal: str = "") -> float:
    """Return the value of a number with a decimal sign of either kind, and thousands separators.

    A single sign before three digits, as in ``1,000``, separates thousands if the table has the other decimal sign.
    """
    digits = re.sub(r"±|\+/-|\s", "", text)
    signs = re.findall(r"[.,]", digits)
    last = signs[-1] if signs else "."
    grouped = signs.count(last) > 1 or (decimal not in ("", last) and is_thousands(digits, last))
    whole, part = digits.rsplit(last, 1) if signs and not grouped else (digits, "")
    return float(re.sub(r"[.,]", "", whole) + (f".{part}" if part else ""))


def _condition(match: re.Match[str]) -> Stated:
    unit = read_unit(match["unit"])
    assert unit is not None  # the pattern has known units only
    key = (match["key"] or "").lower()
    peak: Peak = "peak" if match["sign"] in ("±", "+/-") else ""
    if match["pp"]:
        peak = "double" if _peak(match["pp"]) == "double" else "peak"
    number = _number(match["number"]) * (-1.0 if match["sign"] == "-" else 1.0)
    word = _quantity(key, unit) if len(key) > 2 else ""
    quantity = "preload" if word == "preload" else ACROSS
    if peak or word == "amplitude" or key == "a":
        quantity = "amplitude"
    # The unit of these is enough.
    sure = [
        candidate
        for candidate in ("frequency", "temperature", "preload_force")
        if unit.measured in KINDS[candidate]
    ]
    return Stated(sure[0], number, unit) if sure else Stated(quantity, number, unit, peak)


def _apart(text: str) -> Iterator[tuple[str, str, Unit | None]]:
    """Yield the ways to split a name into what is no unit, the unit as written, and the unit, the surest first.

    The last one has no unit.
    """
    brackets = re.compile(r"[\[({<]([^\[\](){}<>]*)[\])}>]")
    for match in reversed(list(brackets.finditer(text))):
        inside = _BESIDE.sub(" ", match[1]).strip(" ,;")
        if (unit := read_unit(inside)) is not None:
            sign = " ".join(_BESIDE.findall(match[1]))
            yield f"{text[: match.start()]} {sign} {text[match.end() :]}", inside, unit
    bare = brackets.sub(r" \1 ", text)
    per = re.sub(r"(?<=[^\W_])[\s_]+per[\s_]+(?=[^\W_])", "/", bare)
    for match in re.finditer(r"[\s_,;/]+(?:in\s+)?(±|\+/-)?", per):
        tail = per[match.end() :].strip(" _,;/")
        unit = read_unit(tail) if tail and match.start() else None
        # The dash of "E - modulus" is no unit, and neither is the number of "K 1".
        if unit is not None and tail not in ("1", "-", "--"):
            yield per[: match.start()] + " " + (match[1] or ""), tail, unit
    yield bare, "", None


def _quantity(words: str, unit: Unit | None) -> str:
    """Return the quantity of the longest phrase found in a name; between equally long ones the unit decides."""
    best, longest = "", (0, False)
    for quantity, phrases in _WORDS.items():
        for phrase in phrases:
            whole = phrase == words
            if not whole and (len(phrase) == 1 or f" {phrase} " not in f" {words} "):
                continue
            fits = unit is None or not quantity or unit.measured in KINDS[quantity]
            # "T" and "K" are quantities if they are all of a name, and "f" in Hz is no force.
            score = (len(phrase), fits)
            if score > longest:
                best, longest = quantity, score
    dynamic = (f" {phrase} " in f" {words} " for phrase in _WORDS["stiffness"])
    return "stiffness" if best == "modulus" and any(dynamic) else best
