"""Name of a column -> its words, units as written, and doubts: ``Standardkraft [kN]`` is a force in kN.

A text in brackets is a unit, known or not, unless it is one of a closed list of remarks, ``Force (filtered)``. Outside
of brackets a unit stands at the end, ``force_kN``, or is certainly one. Factors, ``Force x 10``, are never applied; a
number without a unit is a range, ``Force ±25``, a factor, or the number of a channel.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from bushcli.recording.header.numbers import (
    RANGE,
    RANGE_WORDS,
    factor_in,
    in_groups,
    loose_numbers,
    ranges_in,
)
from bushcli.recording.header.units import (
    AMBIGUOUS,
    COUNTED,
    NO_UNIT,
    certain_unit,
    find_unit,
    plain_unit,
    tabulated_unit,
)
from bushcli.recording.header.vocabulary import (
    ACROSS,
    ALL_ENDINGS,
    ENDINGS,
    EXCLUDING,
    FILLING,
    FOREIGN_BEGINNINGS,
    HARMLESS,
    MEASURED_WORDS,
    NUMBERED_WORDS,
    POWER,
    REMARKS,
    SPECIAL,
    WEAK,
    WORDS,
    is_code,
    is_foreign,
    known_word,
    names_quantity,
)
from bushcli.recording.header.vocabulary import (
    COUNTED as COUNTED_WORDS,
)
from cases.mode import modes

#: Before a factor among the units of a column.
FACTOR = "factor"
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
#: The first stress of Piola and Kirchhoff is the nominal one. A planar coupon test is called pure shear; its stress and
#: strain are nominal, unlike those of simple shear.
_PLAIN = re.compile(r"\b(?:1st|first) (?:pk|piola(?: kirchhoff)?)\b|pure shear")
#: Longer texts are not names of columns and are ignored.
_LONGEST_NAME = 200

#: A function of something in brackets, or something between bars. "Force|N" has a single bar.
_FUNCTION = re.compile(
    r"(?<![^\W_])(?:abs|absolute|absolut|betrag|sqrt|sqr|sq|log|log10|log2|ln|exp|sum|cumsum|diff|int|integral|d|der|norm"
    r"|rms|sign|neg|var|std|fft)[(\[{](?=([^()\[\]{}]*))|(?:^|[\s(\[=+])[|‖∥]+\s*([^|‖∥]+?)\s*[|‖∥]",
    re.IGNORECASE,
)
#: A negative or an inverse; a power of something else than a number: "10^3" is a factor.
_SIGNED = re.compile(r"\s*[-−–—]\s*[^\W\d_]|\W*1\s*/\s*[^\W\d_]")
_POWER = re.compile(r"(?<![\d\s])\s*(?:\^|\*\*)\s*[-+−(]?\d|(?<=[^\W\d_])[²³](?![^\W_])")
#: Quantities by which others are divided: a force over a travel is a stiffness.
_DIVISORS = ("length", "angle", "time", "strain", "stretch")

#: A product or quotient of units after a name: the "N/s" of "Force_N/s", the "kN·m" of "Moment kN·m filtered".
_COMPOUND = re.compile(r"(?<=[\s_,;:|=./-])[^\W\d_]+[²³]?(?:[·⋅×*/^][^\W_]+)+")
#: Units at the end: "ft-lb", a foot, and none.
_HYPHENED = re.compile(r"(?<=[\s_,;:|=])[^\W\d_]+-[^\W\d_]+$")
_FOOT = re.compile(r"^(.*\w)[\s_,;:.=-]*['′]$")
_ABSENT = re.compile(r"(?<![^\W_])n\s*/\s*a\.?$", re.IGNORECASE)
#: A number before a unit, such as the range of a sensor.
_NUMBER = re.compile(r"\d+(?:[.,/]\d+)?k?")

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
_ABOUT_UNITS = frozenset(
    ["kilo", "mega", "milli", "micro", "si", "imperial", "metric", "metrisch", "english", "british", "us"]
)
#: A mark, a date, or a serial number.
_MARK = re.compile(
    r"[+*]+|\d{4}-\d\d-\d\d|\d\d?\.\d\d?\.\d{4}|\b(?:s/?n|ser(?:ial)?\.?(?: ?no)?)\b\W*\w+", re.IGNORECASE
)


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
    def is_measured(self) -> bool:
        """Whether the name says that the column was measured, unlike columns of set values."""
        return not MEASURED_WORDS.isdisjoint(self.words)

    @property
    def is_unnamed(self) -> bool:
        """Whether the words neither name a quantity nor exclude one: ``Channel 3``, ``AI 0``."""
        excluded = (
            self.formula or any(map(is_foreign, self.words)) or self.name.startswith(FOREIGN_BEGINNINGS)
        )
        return not (excluded or any(name_quality(self.name, kind) for kind in WORDS))

    def without(self, words: Collection[str]) -> Heading:
        """Return it without some words, such as "true" where a case asks for the true stress."""
        return replace(self, words=tuple(word for word in self.words if word not in words))

    def quality(self, kind: str) -> int:
        """Return how surely the words alone, without the unit, mean a quantity; see `match_quality`."""
        if kind in SPECIAL:
            symbols = [text.lower() for text in self.written if text in SYMBOLS]
            excluded = any(is_foreign(word) for word in self.words if word not in ("shear", "hydrostatic"))
            name = " ".join([*self.words, *symbols])
        else:
            name = _SAMPLE_RATE.sub(" ", self.name) if kind == "time" else self.name
            name = _PLAIN.sub(" ", name)
            words = HARMLESS.sub(" ", name).split()
            excluded = self.formula or any(map(is_foreign, words))
            excluded |= not EXCLUDING.get(kind, frozenset()).isdisjoint(words)
        return 0 if excluded else name_quality(" ".join(name.split()), kind)


def match_quality(text: str, kind: str) -> int:
    """Return how surely a column name means ``kind``, a key of `bushcli.recording.header.vocabulary.WORDS`.

    0 not at all; 1 a German compound; 2 a word for it among others; 3 a word for it; 4 this project's own name. A unit
    of another quantity in the table of `units` gives 0.
    """
    head = heading(text)
    units = [unit for written in head.written if (unit := tabulated_unit(written)) is not None]
    measured = "strain" if kind == "stretch" else kind
    return head.quality(kind) if all(unit.measured == measured for unit in units) else 0


def named_columns(fields: Sequence[str]) -> int:
    """Return the number of fields in a line that contain a word for a quantity, so that they are names of columns."""
    return sum(any(heading(field).quality(kind) for kind in WORDS) for field in fields)


def is_units_row(fields: Sequence[str]) -> bool:
    """Whether a line above a table holds units only, such as ``s;mm;N`` or ``[-] [MPa]``."""
    known = any(map(certain_unit, fields))
    # To exclude "t;F;s", all fields must be known units; in brackets, unknown units are permitted.
    plain = all(certain_unit(field) or plain_unit(field) in NO_UNIT for field in fields)
    bracketed = all(
        (re.match(r"[\[(%]", field) or field in NO_UNIT)
        and (field.startswith(("[", "(")) or field.endswith(("]", ")")))
        for field in fields
    )
    return known and (plain or bracketed)


def plain_name(name: str) -> str:
    """Return a name in lower case, with single blanks between its words."""
    return " ".join(re.sub(r"[\W_]+", " ", name.lower()).split())


@lru_cache(maxsize=8192)
def name_quality(name: str, kind: str) -> int:
    """Return how surely a name means a quantity, a key of `WORDS` or `SPECIAL`; see `match_quality`.

    The name of a mode does not count: "axial displacement" means as surely a length as "displacement".
    """
    if kind in SPECIAL:
        # "Volume ratio J", "Pressure p": the name and its symbol.
        known = SPECIAL[kind]
        plain = " ".join(word for word in name.split() if len(word) > 1 or word not in known)
        within = any(len(word) > 1 and f" {word} " in f" {name} " for word in known)
        rules: tuple[tuple[object, int], ...] = (
            (known[0] in (name, plain), 4),
            (name in known or plain in known, 3),
            (within, 2),
        )
    else:
        words, known = [word for word in name.split() if word not in modes()], WORDS[kind]
        name = " ".join(words)
        # "extension ratio" contains a word for a length but is a stretch; any other ratio is none.
        phrase = any(" " in word and f" {word} " in f" {name} " for word in known)
        other = ("ratio" in words and not phrase) or any(name in WORDS[one] for one in WORDS if one != kind)
        longest = max((end for end in ALL_ENDINGS if name.endswith(end)), key=len, default="")
        compound = longest in ENDINGS.get(kind, ()) and not name.startswith(FOREIGN_BEGINNINGS)
        rules = (
            (kind in ("strain", "stretch") and ACROSS & set(words), 0),
            (
                len(words) > 1 and words[-1] in ("no", "nr"),
                0,
            ),  # it counts something; "Force no 2" is a channel
            (name == known[0], 4),
            (name in known, 3),
            (any(len(word) > 1 and word in words for word in known), 0 if other else 2),
            (any(word in words for word in WEAK.get(kind, ())) or compound, 1),
        )
    return next((quality for holds, quality in rules if holds), 0)


@lru_cache(maxsize=8192)
def heading(text: str, has_unit: bool = False) -> Heading:
    """Split ``Force [kN]``, ``force_kN``, ``Kraft in N``, ``F / N``, ``Axial Force (Max)`` into words and units."""
    text = text.strip() if len(text.strip()) <= _LONGEST_NAME else ""
    text = text.replace("∆", "Δ")  # the sign for a difference, and the Greek letter
    text = _INNER.sub(r"\1\2", _CAMEL.sub(" ", text))
    text = _NUMBERED.sub(lambda found: f"{found[0]} " if names_quantity(found[0]) else found[0], text)
    bracketed = [in_groups(found) for found in _BRACKETS.finditer(text)]
    # "[in kN]"; "[in lbf]" may also be a moment.
    bracketed = [_INSIDE.sub("", one) if tabulated_unit(_INSIDE.sub("", one)) else one for one in bracketed]
    rest = _BRACKETS.sub(" ", text)
    timed = any(word in WORDS["time"] for word in plain_name(rest).split())
    known = [tabulated_unit(inside) is not None for inside in bracketed]
    has_unit = has_unit or any(known) or (bool(bracketed) and next(_units_within(rest, timed))[1] != "")
    # [1] is no remark, but the unit of a number without one. "Load (Dynacell) [kN]" has a remark; "Load [kN] [klx]" may
    # have two units.
    remarks = [
        inside
        for i, inside in enumerate(bracketed)
        if "[1]" not in text
        and _is_remark(inside, rest, timed, has_unit)
        and not (any(known[:i]) and _is_unknown_word(inside))
    ]
    written = [inside for inside in bracketed if inside.strip() and inside not in remarks]
    inch = None if bracketed else _INCH.search(rest)
    if inch:
        rest, written = rest[: inch.start()], ["in"]
    if not written:
        named, unit = next(_units_within(rest.rstrip(" ?"), timed))
        if unit:
            doubt = "?" if rest.rstrip().endswith("?") else ""
            rest, written = re.sub(r"\s+in\s*$", "", named), [unit + doubt]
    rest, written = _with_second_unit(rest, written, timed)
    bare = RANGE.sub(" ", rest)
    scaled = factor_in(bare) or _prefix_of(rest, written, bool(bracketed))
    written += [f"{FACTOR} {scaled}"] if scaled else []
    ranges = [one for part in (rest, *bracketed) for one in ranges_in(part)]
    shown = [word for part in (bare, *remarks) for word in re.split(r"[\W_]+", part) if word]
    doubtful: list[str] = []
    if not written:
        shown, written = _inner_units(shown, rest)
    if not written:
        written, doubtful = _with_number(shown, rest, has_unit)
    if ranges or any(re.match(r"\d", text) for text in written):
        shown = [word for word in shown if word.lower() not in RANGE_WORDS]
    if timed and not written:  # minutes or the smallest value, Stunden or a standard deviation
        doubtful += [word for word in shown if word.lower() in ("min", "std")]
        shown = [word for word in shown if word.lower() not in ("min", "std")]
    end = _AFTER_SIGN.search(rest)
    return Heading(
        words=tuple(word.lower() for word in shown),
        written=tuple(written),
        doubtful=tuple(doubtful),
        at_end=end[1] if end and end[1] in doubtful else "",
        formula=_is_formula(text, rest),
        ranges=tuple(ranges),
    )


def _is_formula(text: str, rest: str) -> bool:
    """Whether a name is a formula of a quantity: ``abs(Force)``, ``-Force``, ``Force^2``, ``1/Displacement``."""
    over, _, under = rest.partition("/")
    first, second = _kinds(over), _kinds(under)
    return bool(
        any(_kinds(in_groups(found)) for found in _FUNCTION.finditer(text))
        or _SIGNED.match(text)
        or _POWER.search(rest)
        or (first and second.intersection(_DIVISORS) and not first & second)
    )


def _kinds(text: str) -> set[str]:
    """Return the quantities that a text may name."""
    return {kind for kind in WORDS if name_quality(plain_name(text), kind)}


def _prefix_of(rest: str, written: Sequence[str], bracketed: bool) -> str:
    """Return the prefix that stands apart from the unit of a name, "Force k N"; an upper "Kraft K [N]" is a symbol."""
    words = re.findall(r"[^\W_]+", rest)
    symbol = bracketed and words and words[-1].isupper()
    return _prefix_apart(words, written[0]) if len(written) == 1 and not symbol else ""


def _prefix_apart(words: Sequence[str], unit: str) -> str:
    """Return the prefix that a blank or a sign separates from its unit, ``Force k N``, or an empty text."""
    last, found = words[-1] if words else "", tabulated_unit(unit)
    joined = tabulated_unit(last + unit) if last and found else None
    scaled = found and joined and joined.measured == found.measured and joined.factor != found.factor
    # M is the symbol of a moment.
    short = found and len(last) <= 2 and not (last == "M" and found.measured == "moment")
    return last if last.lower() in COUNTED or (short and (last == "k" or scaled)) else ""


def _inner_units(shown: list[str], rest: str) -> tuple[list[str], list[str]]:
    """Return the words of a name without the units between them, ``force_kN_filtered``, and these units.

    The "5 kN" of "5 kN cell" is one.
    """
    units = [
        i
        for i, word in enumerate(shown[1:-1], start=1)
        if (len(word) > 1 or word == "N") and not known_word(word) and tabulated_unit(word) is not None
    ]
    ranges = [i for i in units if _is_range(shown[:i], rest)]
    written = [f"{shown[i - 1]} {shown[i]}" if i in ranges else shown[i] for i in units]
    for i in units:
        apart = _prefix_apart(shown[:i], shown[i]) or _prefix_apart(shown[i + 1 :][:1], shown[i])
        written += [f"{FACTOR} {apart}"] if apart else []
    gone = {*units, *(i - 1 for i in ranges)}
    return [word for i, word in enumerate(shown) if i not in gone], written


def _with_number(shown: Sequence[str], rest: str, has_unit: bool) -> tuple[list[str], list[str]]:
    """Return the number in a name that may be a range or a factor, with its unit, or else the doubtful words."""
    doubtful = [word for word in shown if not known_word(word)]
    # "t" is a time at the beginning of a name and may be tonnes at its end; V is a direction or volts, "at" a pressure.
    doubtful += [word for word in shown[1:][-1:] if word in ("t", "V", "at", "At", "AT")]
    # "Load #" is in pounds or counts loads; "disp_in_raw" may be in inches.
    doubtful += ["#"] * (re.search(r"[\s,;_]#\s*$", rest) is not None)
    doubtful += ["in"] * ("_in_" in rest.lower() or _INCH_FIRST.match(rest) is not None)
    numbers: list[str] = []
    for word in doubtful:
        at = shown.index(word) if word in shown else 0
        glued = re.fullmatch(r"\d+(?:[.,]\d+)?([^\W\d_]+)", word)
        if _is_range(shown[:at], rest) and any(find_unit(word, kind) for kind in ("force", "length")):
            numbers.append(f"{shown[at - 1]} {word}")
        elif glued and tabulated_unit(glued[1]) is not None and not has_unit:
            numbers.append(word)
    alone = not has_unit and all(word.isdigit() for word in doubtful)
    numbers += loose_numbers(rest) if alone and not numbers else []
    return numbers[:1], [] if numbers or alone else doubtful


def _units_within(text: str, timed: bool) -> Iterator[tuple[str, str]]:
    """Yield the ways to split a name without brackets into the name and its unit, wherever that is, the surest first.

    The last one has an empty text in place of a unit.
    """
    for match in _COMPOUND.finditer(text):
        if _are_units(re.split(r"[·⋅×*/^]", match[0])):
            yield text[: match.start()] + " " + text[match.end() :], match[0]
    for match in _HYPHENED.finditer(text):
        if _are_units(match[0].split("-")):
            yield text[: match.start()], match[0]
    yield from ((match[1], "'") for match in _FOOT.finditer(text))
    yield from ((text.replace(sign, " "), sign) for sign in "%‰" if sign in text)
    yield from ((text[: match.start()], match[0]) for match in _ABSENT.finditer(text))
    yield from _units_at_end(text, timed)


def _units_at_end(text: str, timed: bool) -> Iterator[tuple[str, str]]:
    """Yield the same for units at the end: ``force_kN``, ``Kraft in N``, ``F / N``, ``Moment N mm``."""
    slash = re.fullmatch(r"\s*([^\s_/]+|\S.*?\s)/\s*(\S.*)", text)
    if slash and (_is_unit(slash[2]) or not _names_something(slash[2])):
        yield slash[1].strip(), slash[2]
    tokens = [token for token in re.split(r"[_\s,;|=]+", text) if token]
    for count in (2, 1):
        unit, before = "".join(tokens[-count:]), tokens[:-count]
        found = tabulated_unit(unit) if before else None
        if found is None or (count == 2 and found.measured != "moment"):
            continue
        # "Force in lbf" is no moment; "min" is the smallest value, or doubtful.
        force = count == 2 and tokens[-2] == "in" and "force" in _kinds(" ".join(before))
        if force or (unit.lower() == "min" and not (timed and unit == "min")):
            continue
        if POWER.fullmatch(before[-1]) or _is_range(before, text):
            # "Force x10 N" is not in N, and "Load Cell 500 N" gives the range of a sensor.
            yield " ".join(before[:-1]), " ".join(tokens[-count - 1 :])
        yield " ".join(token for token in before if token.lower() not in ("in", "/")), unit
    joined = re.fullmatch(r"(\S.*?)\s+in\s+(\S+)", text.strip())
    if joined and not _names_something(joined[2]):
        yield joined[1], joined[2]
    apart = re.fullmatch(r"(.+)[-.]([^-.\s]+)", text.strip())
    if apart and _is_unit(apart[2]):
        yield apart[1], apart[2]
    yield text, ""


def _with_second_unit(rest: str, written: list[str], timed: bool) -> tuple[str, list[str]]:
    """Return a name without the second unit that stands before a first one, and both: ``Travel mm (in)``."""
    first = tabulated_unit(written[0]) if len(written) == 1 else None
    # The first m of "Travel m m" is a prefix.
    apart = first and _prefix_apart(re.findall(r"[^\W_]+", rest), written[0])
    before, unit = next(_units_at_end(rest, timed)) if first and not apart else (rest, "")
    second = tabulated_unit(unit) if unit and unit.lower() != "in" else None
    two = first and second and second.measured == first.measured
    return (re.sub(r"\s+in\s*$", "", before), [*written, unit]) if two else (rest, written)


def _is_range(words: Sequence[str], text: str) -> bool:
    """Whether the last of the words before a unit in a text is a number, and a range: not that of a channel.

    A name in which underscores stand around the number, force_2_N, numbers the channels.
    """
    numbered = bool(words) and _NUMBER.fullmatch(words[-1]) is not None and f"_{words[-1]}_" not in text
    return numbered and (len(words) == 1 or words[-2].lower() not in NUMBERED_WORDS)


def _are_units(parts: Sequence[str]) -> bool:
    """Whether the parts of a text are factors of a unit: one of them is known, and none is a word of a name."""
    known = [tabulated_unit(part.rstrip("²³")) is not None for part in parts]
    words = (part for part, unit in zip(parts, known, strict=True) if not unit and not part.isdigit())
    return any(known) and not any(map(known_word, words))


def _is_unit(text: str) -> bool:
    """Whether a text is a unit of the table that is not also a word for the smallest value."""
    return tabulated_unit(text) is not None and text.lower() != "min"


def _names_something(text: str) -> bool:
    """Whether a text contains a word of a name, so that it is not a unit: the "unload force" of "load/unload force"."""
    return any(known_word(word) and len(word) > 1 for word in re.findall(r"[^\W\d_]+", text))


def _is_remark(inside: str, rest: str, timed: bool, has_unit: bool) -> bool:
    """Whether the text in brackets of a name is a remark, such as ``(Max)`` or ``(Ch. 2)``, and not a unit."""
    bare, words = inside.strip(), plain_name(inside).split()
    single = words[0] if len(words) == 1 else ""
    letter = single if len(single) == 1 and single.isalpha() else ""
    # A name that stands in brackets as a whole, as Simulink writes: "<Force>".
    kinds = _kinds(plain_name(rest) or ("" if len(bare) == 1 else inside))
    own = {word for kind in kinds for known in WORDS[kind] for word in known.split()}
    own |= {"eng", "nom"} if kinds & {"stress", "strain"} else set()
    told = [word for i, word in enumerate(words) if not _fills(word) and _tells(words, i, own, timed)]
    has_units = any(tabulated_unit(word) is not None for word in words)
    rules: tuple[tuple[object, object], ...] = (
        # (Min) beside (Max) is the smallest value; of a time it may be minutes, which `heading` lists as doubtful.
        (words == ["min"], not timed or bare != "min"),
        (ranges_in(inside) == [bare] and not bare[:1].isdigit(), True),
        (is_code(bare) or _PORT.fullmatch(bare) or (has_unit and _is_beside_unit(inside)), True),
        (
            not words or tabulated_unit(inside) is not None or factor_in(inside) or _VALUE.search(inside),
            False,
        ),
        (timed and words == ["std"] and "Std" in inside, False),  # Stunden: hours
        (has_units and any(word.isdigit() for word in words), False),  # "001 in"
        # "Force (F)" gives the symbol; "Force (t)" may be in tonnes.
        (letter, letter in "xyz" or any(letter in WORDS[kind] for kind in kinds)),
        (any(kind in kinds and form.fullmatch(inside) for kind, form in _RATIOS.items()), True),
        (single.isdigit(), _CHANNEL.fullmatch(single) and not POWER.fullmatch(single)),
        (True, told and all(word in told or _fills(word) for word in words)),
    )
    return next(bool(answer) for holds, answer in rules if holds)


def _is_unknown_word(inside: str) -> bool:
    """Whether a text in brackets is a single word that is not known from names of columns."""
    return re.fullmatch(r"\W*[^\W_]+\W*", inside) is not None and not known_word(re.sub(r"\W", "", inside))


def _is_beside_unit(inside: str) -> bool:
    """Whether a text in brackets is a remark beside a known unit: it is no unit itself, has none, and is no factor.

    A number with a unit is a range or a rate: "Load cell (25 kN) [kN]", "Force (LP 100 Hz) [N]".
    """
    ranged = _WITH_UNIT.sub(" ", inside)
    named = [word for word in re.split(r"[\s,;:=]+", ranged) if len(re.sub(r"[\W\d_]", "", word)) > 1]
    says = named or (ranged != inside and re.search(r"[^\W\d_]", inside))
    unit = tabulated_unit(inside) is not None or factor_in(inside) or any(map(_may_be_unit, named))
    return _MARK.fullmatch(inside.strip()) is not None or bool(says and not unit)


def _may_be_unit(word: str) -> bool:
    """Whether a word is a unit of any quantity, or says something about one; the fs of "fs = 1 kHz" is none."""
    found = [find_unit(word, kind) for kind in ("force", "length")]
    about = tabulated_unit(word) is not None or word.lower() in AMBIGUOUS or word.lower() in _ABOUT_UNITS
    return about or (not known_word(word) and any(unit and unit.measured != "time" for unit in found))


def _fills(word: str) -> bool:
    """Whether a word may stand in a remark beside others."""
    return word in FILLING or _CHANNEL.fullmatch(word) is not None


def _tells(words: Sequence[str], i: int, own: Collection[str], timed: bool) -> bool:
    """Whether one of the words in brackets is a remark: one of the closed list, of the quantity, or of a channel."""
    word = words[i].rstrip("0123456789")
    known = word in REMARKS or word in own or (is_foreign(word) and word not in COUNTED_WORDS)
    # "Strain 1" is the name of a channel; Time [sample] counts samples.
    numbered = word != words[i] or (i + 1 < len(words) and words[i + 1].isdigit())
    named = numbered and any(word in names for names in WORDS.values())
    return (known or named) and not (timed and word == "sample")
