"""Names of the columns of a dynamic table: ``E'' [MPa]``, ``Kdyn @ 0.1 mm (N/mm)`` -> quantity, unit, conditions."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import Literal

from bushcli.recording.dynamic.peaks import BEHIND, Peak, said_of_peak
from bushcli.recording.header.name import heading
from bushcli.recording.header.units import NO_UNIT, Unit, read_unit
from bushcli.recording.header.vocabulary import plain_name
from bushcli.recording.quantities import CONDITIONS, DYNAMIC, word_set
from bushcli.recording.text.fields import is_thousands

_ERRORS = re.compile(
    r"\b(stdev|std|sd|se|standard (error|deviation)|uncertainty|standardabweichung|err|error)\b"
)
#: K', E'' (with one sign, two, or an inch mark), E*, |G*|, |K|.
_MAGNITUDE = re.compile(r"\|\s*([KCEGkceg])\s*\*?\s*\|")
_PRIMED = re.compile(r"""(?<![^\W_])([KCEGkceg])(?:_?dyn)?\s*(\*|''|"|″|”|’’|´´|′′|``|'|′|’|´|`)(?![^\W_])""")
_SIGNED = {"*": "complex"} | dict.fromkeys(("''", '"', "″", "”", "’’", "´´", "′′", "``"), "loss")
#: The modulus of a coupon by its symbol or its words.
_SHEAR = re.compile(r"(?i)(?<![^\W_])G(?:(?![^\W_])|stor|loss|prime|doubleprime)|\bshear\b|schub")
_TENSILE = re.compile(r"(?i)(?<![^\W_])E(?:(?![^\W_])|stor|loss|prime|doubleprime)|young|tensile|elastizit")
#: A number with thousands separators or without.
DIGITS = (
    r"(?:(?:[1-9]\d{0,2}(?:(?:,\d{3})+(?:\.\d+)?|(?:\.\d{3})+(?:,\d+)?|(?:['’]\d{3})+(?:[.,]\d+)?)(?!\d)"
    r"|\d+(?:[.,]\d+)?|[.,]\d+)(?:[eE][-+]?\d+)?)"
)
#: A condition in a name: "@ 0.1 mm", "(500 N)", "A=±0.5mm", "23°C", "10 Hz".
_CONDITION = re.compile(
    r"(?P<key>[^\W\d_]+)?\s*[@=:]?\s*(?P<sign>±|\+/-|[-+]|minus\b)?\s*(?<![^\W_])(?<!\.)"
    rf"(?P<number>{DIGITS})"
    r"\s*_?(?P<unit>mm|µm|μm|um|kNm|Nmm|Nm|kN|N|°C|degC|°F|K|C|Hz|%|degrees|deg|°|mrad|rad|MPa)(?![\w/*·^])"
    rf"(?:\s*[(\[]?(?P<pp>{BEHIND})(?![^\W_])[)\]]?)?"
)
#: What stands beside a unit in its brackets: "(mm p-p)", "[±mm]".
_BESIDE = re.compile(rf"±|\+/-|(?<![^\W_]){BEHIND}(?![^\W_])")
#: A function of what follows it: log K*, 1/Kdyn, log10(Frequency); and the symbol of a stiffness in brackets: Re(K).
_FUNCTION = re.compile(
    r"(?i)(?<![^\W_])(?:log(?:10|2|e)?|lg|ln|sin|cos|sqrt|exp(?=\s*\()|inv|inverse|reciprocal)(?![^\W_])|^\W*1\s*/(?=\W*[^\W\d])"
)
#: Words that may stand between a function and the name of its quantity.
_BEFORE_QUANTITY = word_set("of the von der des shear tensile complex dynamic dyn abs magnitude")
#: Quantities that a unit names, whatever the name of the column.
_BY_UNIT = ("frequency", "temperature", "damping")
_SYMBOL = re.compile(r"[KCEGkc]")
#: The parts of a complex stiffness; "im" is a German word as well.
_PARTS = (
    ("storage", re.compile(r"\breal\b|\bre [kceg] complex\b|\bcomplex re$")),
    ("loss", re.compile(r"\bimag(?:inary)?\b|\bim [kceg] complex\b|\bcomplex im$")),
)
#: A quotient of units in words, "N_per_mm", and an impulse in two words before it, "N s/mm".
_PER = re.compile(r"(?<=[^\W_])[\s_]+per[\s_]+(?=[^\W_])")
_IMPULSE = re.compile(r"(?<=[\s_])([kM]?N(?:mm|m)?)[\s_]+(?=s/)")
#: The name of the contract for |K*|, in whatever unit.
_OWN = re.compile(r"stiffness_[A-Za-z]+_per_[A-Za-z]+")
#: Of a length or a strain in a name of a column: which condition it is, is not known.
ACROSS = "across"


@dataclass(frozen=True)
class Stated:
    """A number with a unit in a name or above the table: ``amplitude`` 0.1, length; nan if it has two readings."""

    quantity: str
    number: float
    unit: Unit
    peak: Peak = ""
    written: str = ""

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
        A key of `DYNAMIC`, or empty.
    unit : Unit, optional
        None where the name has no unit.
    written : str
        The unit as written.
    peak : {"peak", "double", "rms", ""}
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


def meaning(name: str, unit: str = "", decimal: str = "") -> ColumnName:
    """Return the meaning of the name of a column, of a table with a decimal sign, if that is known."""
    # Many blanks take the expression for conditions long.
    name = re.sub(r"\s+", " ", name)
    conditions = tuple(_condition(match, decimal) for match in _CONDITION.finditer(name))

    def condition_word(match: re.Match[str]) -> str:
        # Of a condition its word is kept if it is the column's, "Kdyn 500 N", not the number's, "preload 5 N".
        key = (match["key"] or "").lower()
        own = _quantity(key, None) in CONDITIONS or key in ("a", "at", "bei")
        return " " if own else f" {match['key'] or ''} "

    plain = _IMPULSE.sub(r"\1", _PER.sub("/", _CONDITION.sub(condition_word, name)))
    text = _MAGNITUDE.sub(r" \1 complex ", re.sub(r"±|\+/-", " peak ", plain))
    text = _PRIMED.sub(lambda m: f" {m[1]} {_SIGNED.get(m[2], 'storage')} ", text)
    head = heading(text, known=_unit_of)
    # What stands in brackets is a unit, with or without a word about an amplitude, or names the quantity.
    read, written, words = None, "", [head.name]
    for inside in head.written:
        if len(head.written) > 1 and _SYMBOL.fullmatch(inside):
            words.append(inside)
            continue
        bare = _BESIDE.sub(" ", inside).strip(" ,;")
        known = read_unit(bare) if bare in NO_UNIT else _unit_of(bare)
        words += _BESIDE.findall(inside) if known else [inside]
        read, written = (known, bare) if known and read is None else (read, written)
    if unit.strip() and (row := read_unit(unit)) is not None:
        read, written = row, unit
    text = plain.replace("_", " ")
    modulus: Literal["E", "G", ""] = "G" if _SHEAR.search(text) else "E" if _TENSILE.search(text) else ""
    phrase = _words(" ".join(words))
    quantity = "stiffness" if _OWN.fullmatch(name.strip()) else _quantity(phrase, read)
    quantity = quantity or _quantity(_words(said_of_peak(phrase)[1]), read)
    if not quantity and read is not None:
        quantity = next((key for key in _BY_UNIT if read.measured in DYNAMIC[key].every_kind), "")
    if _is_function(name, read):
        quantity = ""
    if _ERRORS.search(phrase):
        quantity = f"{quantity}_error" if quantity in ("storage", "loss") else ""
    if read is not None and quantity and read.measured not in DYNAMIC[quantity].every_kind:
        # A preload in N is one of force.
        if read.measured in DYNAMIC["preload_force"].every_kind:
            quantity = {"preload": "preload_force", "amplitude": ""}.get(quantity, quantity)
        elif quantity == "modulus" and read.measured in DYNAMIC["damping"].every_kind:
            quantity = "damping"
    # The words of the phrase have no signs, such as that of "(p-p)/2".
    peak = said_of_peak(plain)[0] if quantity == "amplitude" else ""
    return ColumnName(quantity, read, written, peak, modulus, conditions)


def _is_function(name: str, unit: Unit | None) -> bool:
    """Whether a name is that of a function of a quantity, which stands directly behind it: ``1/Kdyn``, ``log10(f)``.

    ``log freq [Hz]`` is none: a logarithm has no Hz, and the word may mean what is logged. The logarithm of a stiffness
    is often written with the unit of the stiffness.
    """
    functions = list(_FUNCTION.finditer(name))
    rest = name[functions[-1].end() :] if functions else ""
    quantity = meaning(rest).quantity if rest else ""
    words = [
        word for word in re.split(r"[\s_()\[\]/]+", rest) if word and word.lower() not in _BEFORE_QUANTITY
    ]
    if not quantity or not words:
        return False
    begins = {phrase.split()[0] for phrase in DYNAMIC[quantity].words}
    if not (words[0].lower() in begins or meaning(words[0]).quantity):
        return False
    logged = functions[-1][0].lower() == "log" and not rest.lstrip().startswith("(") and quantity in _BY_UNIT
    return not (logged and unit is not None and unit.measured in DYNAMIC[quantity].every_kind)


def _unit_of(text: str) -> Unit | None:
    """Return the unit that a text means; the dash of "E - modulus", the 1 of "K 1", "dyn" and "strain" are none."""
    named = text == "dyn" or (len(text) > 1 and any(text.lower() in each.words for each in DYNAMIC.values()))
    return None if named or text in NO_UNIT else read_unit(text)


def condition_of(text: str, decimal: str = "") -> Stated | None:
    """Return the condition that a whole text is, ``0.1 mm``, ``Preload 500 N``; None for other texts."""
    match = _CONDITION.fullmatch(re.sub(r"\s+", " ", text.strip()))
    return None if match is None else _condition(match, decimal)


def _words(text: str) -> str:
    """Return a text in lower case with single blanks; a sign of a peak is its word."""
    return plain_name(re.sub(r"±|\+/-", " peak ", text))


def read_number(text: str, decimal: str) -> float:
    """Return the value of a number with a decimal sign of either kind, and thousands separators.

    A single sign before three digits, as in ``1,000``, separates thousands if the table has the other decimal sign;
    if its decimal sign is not known, the number is nan.
    """
    digits = re.sub(r"±|\+/-|['’\s]", "", text.replace("minus", "-"))
    signs = re.findall(r"[.,]", digits)
    last = signs[-1] if signs else "."
    single = len(signs) == 1 and is_thousands(digits, last)
    if single and not decimal:
        return math.nan
    grouped = signs.count(last) > 1 or (single and decimal != last)
    whole, part = digits.rsplit(last, 1) if signs and not grouped else (digits, "")
    return float(re.sub(r"[.,]", "", whole) + (f".{part}" if part else ""))


def _condition(match: re.Match[str], decimal: str) -> Stated:
    unit = read_unit(match["unit"])
    assert unit is not None  # the pattern has known units only
    key = (match["key"] or "").lower()
    peak: Peak = "peak" if match["sign"] in ("±", "+/-") else ""
    if match["pp"]:
        said, _ = said_of_peak(match["pp"])
        peak = said if peak in ("", said) else ""
    number = read_number(match["number"], decimal) * (-1.0 if match["sign"] in ("-", "minus") else 1.0)
    word = _quantity(key, unit) if len(key) > 2 else ""
    quantity = "preload" if word == "preload" else ACROSS
    if peak or word == "amplitude" or key == "a":
        quantity = "amplitude"
    # The unit of these is enough.
    enough = ("frequency", "temperature", "preload_force")
    sure = [key for key in enough if unit.measured in DYNAMIC[key].every_kind]
    if sure:
        quantity, peak = sure[0], ""
    return Stated(quantity, number, unit, peak, match["number"])


def _quantity(words: str, unit: Unit | None) -> str:
    """Return the quantity of the longest phrase found in a name; between equally long ones the unit decides."""
    parts = [part for part, form in _PARTS if "complex" in words.split() and form.search(words)]
    if len(parts) == 1:
        return parts[0]
    best, longest = "", (0, False)
    for quantity, each in DYNAMIC.items():
        for phrase in each.words:
            whole = phrase == words
            if not whole and (len(phrase) == 1 or f" {phrase} " not in f" {words} "):
                continue
            fits = unit is None or not quantity or unit.measured in each.every_kind
            # "T" and "K" are quantities if they are all of a name, and "f" in Hz is no force.
            score = (len(phrase), fits)
            if score > longest:
                best, longest = quantity, score
    dynamic = (f" {phrase} " in f" {words} " for phrase in DYNAMIC["stiffness"].words)
    return "stiffness" if best == "modulus" and any(dynamic) else best
