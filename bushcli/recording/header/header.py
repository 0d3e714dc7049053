"""Meaning of the names and units in a header: ``Standardkraft [kN]`` is a force in kN."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from bushcli.recording.header.factors import FACTOR, factor_in
from bushcli.recording.header.formulas import is_formula
from bushcli.recording.header.loose_numbers import (
    loose_numbers,
    number_and_unit,
    ranges_in,
    without_range_words,
    without_ranges,
)
from bushcli.recording.header.quality import name_quality, plain_name
from bushcli.recording.header.remarks import is_remark, is_unknown_word
from bushcli.recording.header.unit_in_name import (
    is_inner_unit,
    is_range,
    prefix_apart,
    unit_within,
    with_second_unit,
)
from bushcli.recording.header.units import NO_UNIT, certain_unit, find_unit, plain_unit, tabulated_unit
from bushcli.recording.header.vocabulary import (
    EXCLUDING,
    FOREIGN_BEGINNINGS,
    HARMLESS,
    MEASURED_WORDS,
    WORDS,
    is_foreign,
    known_word,
    names_quantity,
)

#: Full-width brackets are in use between Chinese characters. A bracket that is not closed ends with the name.
_BRACKETS = re.compile(
    r"\[([^\[\]]*)(?:\]|$)|\(([^()]*)(?:\)|$)|\{([^{}]*)\}|<([^<>]*)>|（([^（）]*)）|［([^［］]*)］|【([^【】]*)】"
    r"|«([^«»]*)»|[“„]([^“”„]*)[“”]"
)
#: The address of a controller in a remark of WaveMatrix: "Load(8800 (0,1):Load) (kN)".
_INNER = re.compile(r"(\([^()]*)\(\d+(?:,\d+)*\)([^()]*\))")
#: An inch in quotation marks, after a sign, or as a sign: 'Travel "in"', "Travel:in", 'Travel"'; and before the name.
_INCH = re.compile(r"""\s*(?:"in"|'in'|[:@\\*]\s*in\*?|[\s:;,@_]*["″])\s*$""", re.IGNORECASE)
_INCH_FIRST = re.compile(r"\s*in[\s_](?!phase|plane)", re.IGNORECASE)
_INSIDE = re.compile(r"^\s*in\s+(?!lb|#|oz|kip)", re.IGNORECASE)
#: Between the words of "axialForce" and "LoadCell".
_CAMEL = re.compile(r"(?<=[a-zäöüß]{2})(?=[A-ZÄÖÜ][a-zäöüß]{2})")
#: A word before the number of a channel: "Force1".
_NUMBERED = re.compile(r"(?<![^\W_])[^\W\d_]{3,}(?=\d{1,2}(?![^\W_]))")
#: The last word after a blank or a sign that separates a name from its unit: "Force zoink", "force_klx", "Force, klx".
_AFTER_SIGN = re.compile(r"(?:_|\.|\s|[^\w\s.]\s*)([^\W_]+)\W*$")
#: A time is named with the rate of its samples by catman: "Time  1 - default sample rate [s]".
_SAMPLE_RATE = re.compile(r"\d*\s*(?:\w+ )?(?:sample|sampling|mess) ?rate\b")
#: Longer texts are not names of columns and are ignored.
_LONGEST_NAME = 200


@dataclass(frozen=True)
class Heading:
    """The parts of the name of a column.

    Attributes
    ----------
    words : tuple of str
        The name without unit, in lower case.
    written : tuple of str
        The units as written; several different ones contradict each other.
    doubtful : tuple of str
        Unknown words, as written, that could be units.
    at_end : str
        The one of them that stands where units stand, after ``_`` or a comma, or an empty text.
    formula : bool
        Whether the name is a formula, such as ``abs(Force)``.
    ranges : tuple of str
        Ranges as written, with a sign and without a unit: ``±25``.
    """

    words: tuple[str, ...]
    written: tuple[str, ...]
    doubtful: tuple[str, ...]
    at_end: str = ""
    formula: bool = False
    ranges: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The name without unit, in lower case."""
        return " ".join(self.words)


def heading(text: str, has_unit: bool = False) -> Heading:
    """Split ``Force [kN]``, ``force_kN``, ``Kraft in N``, ``F / N``, ``Axial Force (Max)`` into words and units."""
    text = text.strip()
    if len(text) > _LONGEST_NAME:
        return Heading((), (), ())
    text = text.replace("∆", "Δ")  # the sign for a difference, and the Greek letter
    text = _INNER.sub(r"\1\2", _CAMEL.sub(" ", text))
    text = _NUMBERED.sub(lambda found: f"{found[0]} " if names_quantity(found[0]) else found[0], text)
    bracketed = [next(group for group in m.groups() if group is not None) for m in _BRACKETS.finditer(text)]
    # "[in kN]"; "[in lbf]" may also be a moment.
    bracketed = [_INSIDE.sub("", one) if tabulated_unit(_INSIDE.sub("", one)) else one for one in bracketed]
    rest = _BRACKETS.sub(" ", text)
    timed = any(word in WORDS["time"] for word in plain_name(rest).split())
    has_unit = has_unit or _has_unit(bracketed, rest, timed)
    # [1] is no remark, but the unit of a number without one.
    remarks = [] if "[1]" in text else _remarks(bracketed, rest, timed, has_unit)
    written = [inside for inside in bracketed if inside.strip() and inside not in remarks]
    inch = None if bracketed else _INCH.search(rest)
    if inch:
        rest, written = rest[: inch.start()], ["in"]
    if not written:
        named, unit = unit_within(rest.rstrip(" ?"), timed)
        if unit:
            doubt = "?" if rest.rstrip().endswith("?") else ""
            rest, written = re.sub(r"\s+in\s*$", "", named), [unit + doubt]
    rest, written = with_second_unit(rest, written, timed)
    scaled = factor_in(without_ranges(rest)) or _prefix(rest, written, bool(bracketed))
    written += [f"{FACTOR} {scaled}"] if scaled else []
    ranges = [one for part in (rest, *bracketed) for one in ranges_in(part)]
    shown = [word for part in (without_ranges(rest), *remarks) for word in re.split(r"[\W_]+", part) if word]
    if not written:
        shown, written = _inner_units(shown, rest)
    doubtful = [] if written else _doubtful(shown, rest)
    if not written:
        written, doubtful = _with_number(shown, rest, doubtful, has_unit)
    if ranges or any(re.match(r"\d", text) for text in written):
        shown = without_range_words(shown)
    if timed and not written:  # minutes or the smallest value, Stunden or a standard deviation
        doubtful += [word for word in shown if word.lower() in ("min", "std")]
        shown = [word for word in shown if word.lower() not in ("min", "std")]
    end = _AFTER_SIGN.search(rest) if doubtful else None
    at_end = end[1] if end and end[1] in doubtful else ""
    lower, formula = tuple(word.lower() for word in shown), is_formula(text, rest)
    return Heading(lower, tuple(written), tuple(doubtful), at_end, formula, tuple(ranges))


def _prefix(rest: str, written: list[str], bracketed: bool) -> str:
    """Return the prefix that stands apart from the unit of a name, "Force k N"; an upper "Kraft K [N]" is a symbol."""
    words = re.findall(r"[^\W_]+", rest)
    if bracketed and words and words[-1].isupper():
        return ""
    return prefix_apart(words, written[0]) if len(written) == 1 else ""


def _inner_units(shown: list[str], rest: str) -> tuple[list[str], list[str]]:
    """Return the words of a name without the units between them, and these units; the "5 kN" of "5 kN cell" is one."""
    units = [i for i, word in enumerate(shown[1:-1], start=1) if is_inner_unit(word)]
    ranges = [i for i in units if is_range(shown[:i], rest)]
    written = [f"{shown[i - 1]} {shown[i]}" if i in ranges else shown[i] for i in units]
    for i in units:
        apart = prefix_apart(shown[:i], shown[i]) or prefix_apart(shown[i + 1 :][:1], shown[i])
        written += [f"{FACTOR} {apart}"] if apart else []
    gone = {*units, *(i - 1 for i in ranges)}
    return [word for i, word in enumerate(shown) if i not in gone], written


def _with_number(
    shown: list[str], rest: str, doubtful: list[str], has_unit: bool
) -> tuple[list[str], list[str]]:
    """Return the number in a name that may be a range or a factor, with its unit if any, and the doubtful words."""
    for word in doubtful:
        i = shown.index(word) if word in shown else 0
        if is_range(shown[:i], rest) and any(find_unit(word, kind) for kind in ("force", "length")):
            return [f"{shown[i - 1]} {word}"], []
        if number_and_unit(word) and not has_unit:
            return [word], []
    if has_unit or not all(word.isdigit() for word in doubtful):
        return [], doubtful
    loose = loose_numbers(rest)
    return loose[:1], []


def _has_unit(bracketed: Sequence[str], rest: str, timed: bool) -> bool:
    """Whether one of the texts in the brackets of a name is a known unit, or one stands in the rest of the name."""
    known = any(tabulated_unit(inside) is not None for inside in bracketed)
    return known or (bool(bracketed) and unit_within(rest, timed)[1] != "")


def _remarks(bracketed: Sequence[str], rest: str, timed: bool, has_unit: bool) -> list[str]:
    """Return the texts in brackets that are remarks; the arguments are those of `is_remark`."""
    # "Load (Dynacell) [kN]" has a remark; "Load [kN] [klx]" may have two units.
    known = [tabulated_unit(inside) is not None for inside in bracketed]
    return [
        inside
        for i, inside in enumerate(bracketed)
        if is_remark(inside, rest, timed, has_unit) and not (any(known[:i]) and is_unknown_word(inside))
    ]


def _doubtful(words: Sequence[str], rest: str) -> list[str]:
    """Return the words of a name that may be units."""
    found = [word for word in words if not known_word(word)]
    # "t" is a time at the beginning of a name and may be tonnes at its end; V is a direction or volts, "at" a pressure.
    found += [word for word in words[1:][-1:] if word in ("t", "V", "at", "At", "AT")]
    # "Load #" is in pounds or counts loads.
    found += ["#"] * (re.search(r"[\s,;_]#\s*$", rest) is not None)
    # "disp_in_raw" may be in inches.
    return found + ["in"] * ("_in_" in rest.lower() or _INCH_FIRST.match(rest) is not None)


def is_units_row(fields: Sequence[str]) -> bool:
    """Whether a line above a table holds units only, such as ``s;mm;N`` or ``[-] [MPa]``."""
    known = [certain_unit(field) for field in fields]
    blank = [plain_unit(field) in NO_UNIT for field in fields]
    bracketed = [field.startswith(("[", "(")) or field.endswith(("]", ")")) for field in fields]
    # To exclude "t;F;s", all fields must be known units; in brackets, unknown units are permitted.
    plain = all(k or b for k, b in zip(known, blank, strict=True)) and any(known)
    return plain or (
        all(re.match(r"[\[(%]", f) or f in NO_UNIT for f in fields) and all(bracketed) and any(known)
    )


def named_columns(fields: Sequence[str]) -> int:
    """Return the number of fields in a line that contain a word for a quantity, so that they are names of columns."""
    heads = [heading(field) for field in fields]
    return sum(any(word_quality(head, kind) for kind in WORDS) for head in heads)


def match_quality(text: str, kind: str) -> int:
    """Return how surely a column name means ``kind``, a key of `bushcli.recording.header.vocabulary.WORDS`.

    0 not at all; 1 a German compound; 2 a word for it among others; 3 a word for it; 4 this project's own name. A unit
    of another quantity in the table of `units` gives 0.
    """
    head = heading(text)
    for written in head.written:
        unit = tabulated_unit(written)
        if unit is not None and unit.measured != _MEASURED.get(kind, kind):
            return 0
    return word_quality(head, kind)


def word_quality(head: Heading, kind: str) -> int:
    """Return `match_quality` of the words alone, without the unit."""
    name = _SAMPLE_RATE.sub(" ", head.name) if kind == "time" else head.name
    # A planar coupon test is called pure shear; its stress and strain are nominal, unlike those of simple shear.
    name = name.replace("pure shear", " ")
    # The first stress of Piola and Kirchhoff is the nominal one.
    name = re.sub(r"\b(?:1st|first) (?:pk|piola(?: kirchhoff)?)\b", " ", name)
    words = HARMLESS.sub(" ", name).split()
    if (
        head.formula
        or any(is_foreign(word) for word in words)
        or EXCLUDING.get(kind, frozenset()) & set(words)
    ):
        return 0
    return name_quality(" ".join(name.split()), kind)


def without(head: Heading, words: Collection[str]) -> Heading:
    """Return a heading without some of its words, such as "true" where a case asks for the true stress."""
    return replace(head, words=tuple(word for word in head.words if word not in words))


def is_unnamed(head: Heading) -> bool:
    """Whether the words of a name neither name a quantity nor exclude one: ``Channel 3``, ``AI 0``."""
    if (
        head.formula
        or any(is_foreign(word) for word in head.words)
        or head.name.startswith(FOREIGN_BEGINNINGS)
    ):
        return False
    return not any(name_quality(head.name, kind) for kind in WORDS)


def says_measured(head: Heading) -> bool:
    """Whether a name says that the column was measured, unlike columns of set values."""
    return any(word in MEASURED_WORDS for word in head.words)


_MEASURED = {"stretch": "strain"}
