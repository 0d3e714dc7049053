"""Name of a column -> its words, units as written, and doubts: ``Standardkraft [kN]`` is a force in kN.

A text in brackets is a unit, known or not, unless it is one of a closed list of remarks, ``Force (filtered)``. Outside
of brackets a unit stands at the end, ``force_kN``, or is certainly one (`name_parts`). Factors, ``Force x 10``, are
never applied. Names in a table of dynamic stiffness have further units, conditions and signs
(`bushcli.recording.dynamic.names`).
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from bushcli.recording.header.name_parts import (
    FACTOR,
    RANGE,
    RANGE_WORDS,
    UnitReader,
    factor_in,
    in_groups,
    inner_units,
    numbers_or_doubts,
    prefix_of,
    ranges_in,
    units_within,
    with_second_unit,
)
from bushcli.recording.header.units import (
    AMBIGUOUS,
    NO_UNIT,
    certain_unit,
    find_unit,
    plain_unit,
    tabulated_unit,
)
from bushcli.recording.header.vocabulary import (
    COUNTED_WORDS,
    FILLING,
    FOREIGN_BEGINNINGS,
    HARMLESS,
    POWER,
    QUANTITY_WORDS,
    REMARKS,
    is_code,
    is_foreign,
    kinds_of,
    known_word,
    name_quality,
    plain_name,
)
from bushcli.recording.quantities import SPECIAL, STATIC, word_set

#: What stands behind the name of a volume ratio, in place of a unit.
SYMBOLS = frozenset({"J", "j", "V0", "v0", "V_0", "γ", "τ"})
#: Full-width brackets are in use between Chinese characters. A bracket that is not closed ends with the name.
_BRACKETS = re.compile(
    r"\[([^\[\]]*)(?:\]|$)|\(([^()]*)(?:\)|$)|\{([^{}]*)\}|<([^<>]*)>|（([^（）]*)）|［([^［］]*)］|【([^【】]*)】"
    r"|«([^«»]*)»|[“„]([^“”„]*)[“”]"
)
#: The address of a controller in a remark of WaveMatrix: "Load(8800 (0,1):Load) (kN)".
_INNER = re.compile(r"(\([^()]*)\(\d+(?:,\d+)*\)([^()]*\))")
#: An inch in quotation marks, after a sign, or as a sign: 'Travel "in"', "Travel:in", 'Travel"'; and before the name.
_INCH = re.compile(r"""\s*(?:"in"|'in'|[:@\\*]\s*in\*?|[\s:;,@_]*["″])\s*$""", re.IGNORECASE)
_INSIDE = re.compile(r"^\s*in\s+(?!lb|#|oz|kip)", re.IGNORECASE)
#: Between the words of "axialForce" and "LoadCell".
_CAMEL = re.compile(r"(?<=[a-zäöüß]{2})(?=[A-ZÄÖÜ][a-zäöüß]{2})")
#: A word before the number of a channel: "Force1".
_NUMBERED = re.compile(r"(?<![^\W_])[^\W\d_]{3,}(?=\d{1,2}(?![^\W_]))")
#: The last word after a blank or a sign that separates a name from its unit: "Force zoink", "force_klx", "Force, klx".
_AFTER_SIGN = re.compile(r"(?:_|\.|\s|[^\w\s.]\s*)([^\W_]+)\W*$")
#: A time is named with the rate of its samples by catman: "Time  1 - default sample rate [s]".
_SAMPLE_RATE = re.compile(r"\d*\s*(?:\w+ )?(?:sample|sampling|mess) ?rate\b")
#: The first stress of Piola and Kirchhoff is the nominal one. A planar coupon test is called pure shear; its stress and
#: strain are nominal, unlike those of simple shear.
_PLAIN = re.compile(r"\b(?:1st|first) (?:pk|piola(?: kirchhoff)?)\b|pure shear")
_ONE_WORD = re.compile(r"\W*[^\W_]+\W*")
#: Longer texts are not names of columns and are ignored.
_LONGEST_NAME = 200

#: A function of something in brackets, or something between bars. "Force|N" has a single bar.
_FUNCTION = re.compile(
    r"(?i)(?<![^\W_])(?:abs|absolute|absolut|betrag|sqrt|sqr|sq|log|log10|log2|ln|exp|sum|cumsum|diff|int|integral|d|der|norm"
    r"|rms|sign|neg|var|std|fft)[(\[{](?=([^()\[\]{}]*))|(?:^|[\s(\[=+])[|‖∥]+\s*([^|‖∥]+?)\s*[|‖∥]"
)
#: A negative or an inverse; a power of something else than a number: "10^3" is a factor.
_SIGNED = re.compile(r"\s*[-−–—]\s*[^\W\d_]|\W*1\s*/\s*[^\W\d_]")
_POWER = re.compile(r"(?<![\d\s])\s*(?:\^|\*\*)\s*[-+−(]?\d|(?<=[^\W\d_])[²³](?![^\W_])")
#: Quantities by which others are divided: a force over a travel is a stiffness.
_DIVISORS = ("length", "angle", "time", "strain", "stretch")

#: The number of a channel.
_CHANNEL = re.compile(r"\d{1,2}")
#: Numbers that are no channels: 0.1, 1,0, 0-5, 0..10; x2 may be a factor.
_VALUE = re.compile(r"\d\s*(?:[.,]+|[-–]|to|bis)\s*\d|(?<![^\W_])[xX](?:[02-9]|\d\d)", re.IGNORECASE)
#: What a nominal stress, a strain and a stretch are, behind their names: "Stress (F/A0)", "Strain (dL/L0)".
_RATIOS = {
    "stress": re.compile(r"\s*(?:force|load|kraft|f)\s*/\s*a_?[0o]?\s*", re.IGNORECASE),
    "strain": re.compile(r"\s*[dΔδ]\s*l\s*/\s*l_?[0o]?\s*", re.IGNORECASE),
    "stretch": re.compile(r"\s*l\s*/\s*l_?[0o]\s*", re.IGNORECASE),
}
#: Numbers with units: the range of a sensor, the rate of samples, the speed of a test.
_WITH_UNIT = re.compile(r"(?:[±<>=~]|\+/?-|-)?\d+(?:[.,]\d+)?\s?k?(?:[^\W\d_]|[°%/])*")
#: An input of a device: "Dev1/ai0".
_PORT = re.compile(r"\w*\d[\w.]*[/_]a?[io]\d{1,3}", re.IGNORECASE)
#: Prefixes and systems of units.
_ABOUT_UNITS = word_set("kilo mega milli micro si imperial metric metrisch english british us")
#: A mark, a date, or a serial number.
_MARK = re.compile(
    r"(?i)[+*]+|\d{4}-\d\d-\d\d|\d\d?\.\d\d?\.\d{4}|\b(?:s/?n|ser(?:ial)?\.?(?: ?no)?)\b\W*\w+"
)


@dataclass(frozen=True)
class Heading:
    """The parts of the name of a column.

    Attributes
    ----------
    words, written : tuple of str
        The name without unit, in lower case; the units as written, of which several different ones contradict.
    doubtful, at_end : tuple of str, str
        Unknown words, as written, that could be units; the one that stands where units stand, after ``_`` or a comma.
    formula : bool
        Whether the name is a formula, such as ``abs(Force)``.
    ranges : tuple of str
        Ranges as written, with a sign and without a unit: ``±25``.
    """

    words: tuple[str, ...] = ()
    written: tuple[str, ...] = ()
    doubtful: tuple[str, ...] = ()
    at_end: str = ""
    formula: bool = False
    ranges: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The name without unit, in lower case."""
        return " ".join(self.words)

    @property
    def is_unnamed(self) -> bool:
        """Whether the words neither name a quantity nor exclude one: ``Channel 3``, ``AI 0``."""
        foreign = any(map(is_foreign, self.words)) or self.name.startswith(FOREIGN_BEGINNINGS)
        return not (self.formula or foreign or any(name_quality(self.name, kind) for kind in STATIC))

    def without(self, words: Collection[str]) -> Heading:
        """Return it without some words, such as "true" where a case asks for the true stress."""
        return replace(self, words=tuple(word for word in self.words if word not in words))

    def quality(self, kind: str) -> int:
        """Return how surely the words alone, without the unit, mean a quantity, from 0 to 4 (`name_quality`)."""
        if kind in SPECIAL:
            symbols = [text.lower() for text in self.written if text in SYMBOLS]
            excluded = any(is_foreign(word) for word in self.words if word not in ("shear", "hydrostatic"))
            name = " ".join([*self.words, *symbols])
        else:
            name = _SAMPLE_RATE.sub(" ", self.name) if kind == "time" else self.name
            name = _PLAIN.sub(" ", name)
            words = HARMLESS.sub(" ", name).split()
            excluded = self.formula or any(map(is_foreign, words))
            excluded |= not STATIC[kind].excluding.isdisjoint(words)
        return 0 if excluded else name_quality(" ".join(name.split()), kind)


def match_quality(text: str, kind: str) -> int:
    """Return how surely a column name means ``kind``, as `bushcli.recording.header.vocabulary.name_quality`.

    A unit of another quantity in the table of `units` gives 0.
    """
    head = heading(text)
    units = [unit for written in head.written if (unit := tabulated_unit(written)) is not None]
    measured = "strain" if kind == "stretch" else kind
    return head.quality(kind) if all(unit.measured == measured for unit in units) else 0


def named_columns(fields: Sequence[str]) -> int:
    """Return the number of fields in a line that contain a word for a quantity, so that they are names of columns."""
    return sum(any(heading(field).quality(kind) for kind in STATIC) for field in fields)


def is_units_row(fields: Sequence[str]) -> bool:
    """Whether a line above a table holds units only, such as ``s;mm;N`` or ``[-] [MPa]``."""
    has_unit = any(map(certain_unit, fields))
    # To exclude "t;F;s", all fields must be known units; in brackets, unknown units are permitted.
    plain = all(certain_unit(field) or plain_unit(field) in NO_UNIT for field in fields)
    bracketed = all(
        (re.match(r"[\[(%]", field) or field in NO_UNIT)
        and (field.startswith(("[", "(")) or field.endswith(("]", ")")))
        for field in fields
    )
    return has_unit and (plain or bracketed)


@lru_cache(maxsize=8192)
def heading(text: str, has_unit: bool = False, known: UnitReader = tabulated_unit) -> Heading:
    """Split ``Force [kN]``, ``force_kN``, ``Kraft in N``, ``F / N``, ``Axial Force (Max)`` into words and units.

    The column may have a unit elsewhere; a table of dynamic stiffness knows more units than a recording.
    """
    text = text.strip() if len(text.strip()) <= _LONGEST_NAME else ""
    text = text.replace("∆", "Δ")  # the sign for a difference, and the Greek letter
    text = _INNER.sub(r"\1\2", _CAMEL.sub(" ", text))
    text = _NUMBERED.sub(lambda m: f"{m[0]} " if m[0].lower() in QUANTITY_WORDS else m[0], text)
    bracketed = [in_groups(match) for match in _BRACKETS.finditer(text)]
    # "[in kN]"; "[in lbf]" may also be a moment.
    bracketed = [_INSIDE.sub("", t) if tabulated_unit(_INSIDE.sub("", t)) else t for t in bracketed]
    rest = _BRACKETS.sub(" ", text)
    timed = any(word in STATIC["time"].words for word in plain_name(rest).split())
    are_units = [known(inside) is not None for inside in bracketed]
    has_unit |= any(are_units) or (bool(bracketed) and next(units_within(rest, timed, known))[1] != "")
    # [1] is no remark, but the unit of a number without one. "Load (Dynacell) [kN]" has a remark; "Load [kN] [klx]" may
    # have two units.
    remarks = [
        inside
        for i, inside in enumerate(bracketed)
        if "[1]" not in text
        and _is_remark(inside, rest, timed, has_unit, known)
        and not (
            any(are_units[:i]) and _ONE_WORD.fullmatch(inside) and not known_word(re.sub(r"\W", "", inside))
        )
    ]
    written = [inside for inside in bracketed if inside.strip() and inside not in remarks]
    inch = None if bracketed else _INCH.search(rest)
    if inch:
        rest, written = rest[: inch.start()], ["in"]
    if not written:
        name, unit = next(units_within(rest.rstrip(" ?"), timed, known))
        if unit:
            doubt = "?" if rest.rstrip().endswith("?") else ""
            rest, written = re.sub(r"\s+in\s*$", "", name), [unit + doubt]
    rest, written = with_second_unit(rest, written, timed, known)
    bare = RANGE.sub(" ", rest)
    scaled = factor_in(bare) or prefix_of(rest, written, bool(bracketed))
    written += [f"{FACTOR} {scaled}"] if scaled else []
    ranges = [text for part in (rest, *bracketed) for text in ranges_in(part)]
    shown = [word for part in (bare, *remarks) for word in re.split(r"[\W_]+", part) if word]
    doubtful: list[str] = []
    if not written:
        shown, written = inner_units(shown, rest)
    if not written:
        written, doubtful = numbers_or_doubts(shown, rest, has_unit)
    if ranges or any(re.match(r"\d", text) for text in written):
        shown = [word for word in shown if word.lower() not in RANGE_WORDS]
    if timed and not written:  # minutes or the smallest value, Stunden or a standard deviation
        doubtful += [word for word in shown if word.lower() in ("min", "std")]
        shown = [word for word in shown if word.lower() not in ("min", "std")]
    end = _AFTER_SIGN.search(rest)
    # A formula of a quantity: ``abs(Force)``, ``-Force``, ``Force^2``, ``1/Displacement``.
    numerator, _, denominator = rest.partition("/")
    first, second = kinds_of(numerator), kinds_of(denominator)
    formula = (
        any(kinds_of(in_groups(match)) for match in _FUNCTION.finditer(text))
        or _SIGNED.match(text)
        or _POWER.search(rest)
        or (first and second.intersection(_DIVISORS) and not first & second)
    )
    at_end, words = end[1] if end and end[1] in doubtful else "", tuple(word.lower() for word in shown)
    return Heading(words, tuple(written), tuple(doubtful), at_end, bool(formula), tuple(ranges))


def _is_remark(inside: str, rest: str, timed: bool, has_unit: bool, known: UnitReader) -> bool:
    """Whether the text in brackets of a name is a remark, such as ``(Max)`` or ``(Ch. 2)``, and not a unit."""
    bare, words = inside.strip(), plain_name(inside).split()
    single = words[0] if len(words) == 1 else ""
    letter = single if len(single) == 1 and single.isalpha() else ""
    # A name that stands in brackets as a whole, as Simulink writes: "<Force>".
    kinds = kinds_of(plain_name(rest) or ("" if len(bare) == 1 else inside))
    vocabulary = {word for kind in kinds for name in STATIC[kind].words for word in name.split()}
    vocabulary |= {"eng", "nom"} if kinds & {"stress", "strain"} else set()
    known_words = []
    for i, numbered in enumerate(words):
        word = numbered.rstrip("0123456789")
        is_known = word in REMARKS or word in vocabulary or (is_foreign(word) and word not in COUNTED_WORDS)
        # "Strain 1" is the name of a channel; Time [sample] counts samples.
        channel = word != numbered or (i + 1 < len(words) and words[i + 1].isdigit())
        is_quantity = channel and any(word in each.words for each in STATIC.values())
        if not _fills(numbered) and (is_known or is_quantity) and not (timed and word == "sample"):
            known_words.append(numbered)
    # Beside a known unit a text is a remark if it is no unit itself, has none, and is no factor. A number with a unit
    # is a range or a rate: "Load cell (25 kN) [kN]", "Force (LP 100 Hz) [N]"; the fs of "fs = 1 kHz" is no unit.
    ranged = _WITH_UNIT.sub(" ", inside)
    spoken = [word for word in re.split(r"[\s,;:=]+", ranged) if len(re.sub(r"[\W\d_]", "", word)) > 1]
    says = spoken or (ranged != inside and re.search(r"[^\W\d_]", inside))
    units = (find_unit(word, kind) for word in spoken if not known_word(word) for kind in ("force", "length"))
    is_unit = has_unit and (
        not says
        or known(inside) is not None
        or factor_in(inside)
        or any(known(word) or {word.lower()} & {*AMBIGUOUS, *_ABOUT_UNITS} for word in spoken)
        or any(unit is not None and unit.measured != "time" for unit in units)
    )
    beside = has_unit and (_MARK.fullmatch(bare) or not is_unit)
    has_units = any(known(word) is not None for word in words)
    rules: tuple[tuple[object, object], ...] = (
        # (Min) beside (Max) is the smallest value; of a time it may be minutes, which `heading` lists as doubtful.
        (words == ["min"], not timed or bare != "min"),
        (ranges_in(inside) == [bare] and not bare[:1].isdigit(), True),
        (is_code(bare) or _PORT.fullmatch(bare) or beside, True),
        (not words or known(inside) is not None or factor_in(inside) or _VALUE.search(inside), False),
        (timed and words == ["std"] and "Std" in inside, False),  # Stunden: hours
        (has_units and any(word.isdigit() for word in words), False),  # "001 in"
        # "Force (F)" gives the symbol; "Force (t)" may be in tonnes.
        (letter, letter in "xyz" or any(letter in STATIC[kind].words for kind in kinds)),
        (any(kind in kinds and form.fullmatch(inside) for kind, form in _RATIOS.items()), True),
        (single.isdigit(), _CHANNEL.fullmatch(single) and not POWER.fullmatch(single)),
        (True, known_words and all(word in known_words or _fills(word) for word in words)),
    )
    return next(bool(answer) for holds, answer in rules if holds)


def _fills(word: str) -> bool:
    """Whether a word may stand in a remark beside others."""
    return word in FILLING or _CHANNEL.fullmatch(word) is not None
