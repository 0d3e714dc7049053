"""Meaning of the names and units in a header: ``Standardkraft [kN]`` is a force in kN."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from bushcli.recording.quality import name_quality
from bushcli.recording.units import NO_UNIT, find_unit, plain_unit, tabulated_unit
from bushcli.recording.vocabulary import (
    FOREIGN_BEGINNINGS,
    MEASURED_WORDS,
    NUMBERED_WORDS,
    POWER,
    WORDS,
    is_foreign,
    known_word,
)

#: Full-width brackets are in use between Chinese characters. A bracket that is not closed ends with the name.
_BRACKETS = re.compile(
    r"\[([^\[\]]*)(?:\]|$)|\(([^()]*)(?:\)|$)|\{([^{}]*)\}|<([^<>]*)>|（([^（）]*)）|［([^［］]*)］|【([^【】]*)】"
)
#: A factor anywhere in a name: "Force [N] x10", "Force/10 [N]", "Force 10^3 N".
_FACTOR = re.compile(
    r"^\s*10+\s*[x×*·](?=\s)|[x×*·/]\s*10+(?![\d.])|(?<![\d.])10\s*\^\s*[-+−]?\d+|(?<![\w.])1[eE][-+]?\d+"
    r"|(?<![^\W_])(?:ten|hundred|thousand|million)(?:th)?s?(?![^\W_])",
    re.IGNORECASE,
)
#: An inch in quotation marks, after a sign, or as a sign: 'Travel "in"', "Travel:in", 'Travel"'; and before the name.
_INCH = re.compile(r"""\s*(?:"in"|'in'|[:@\\*]\s*in\*?|[\s:;,@_]*["″])\s*$""", re.IGNORECASE)
_INCH_FIRST = re.compile(r"\s*in[\s_](?!phase|plane)", re.IGNORECASE)
#: A product or quotient of units after a name: the "N/s" of "Force_N/s", the "kN·m" of "Moment kN·m filtered".
_COMPOUND = re.compile(r"(?<=[\s_,;:|=.-])[^\W\d_]+[²³]?(?:[·⋅×*/^][^\W_]+)+")
#: The last word after a blank or a sign that separates a name from its unit: "Force zoink", "force_klx", "Force, klx".
_AFTER_SIGN = re.compile(r"(?:_|\.|\s|[^\w\s.]\s*)([^\W_]+)\W*$")
#: A time is named with the rate of its samples by catman: "Time  1 - default sample rate [s]".
_SAMPLE_RATE = re.compile(r"\d*\s*(?:\w+ )?(?:sample|sampling|mess) ?rate\b")
#: A number before a unit, such as the range of a sensor.
_NUMBER = re.compile(r"\d+(?:[.,]\d+)?k?")
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
    """

    words: tuple[str, ...]
    written: tuple[str, ...]
    doubtful: tuple[str, ...]
    at_end: str = ""

    @property
    def name(self) -> str:
        """The name without unit, in lower case."""
        return " ".join(self.words)


def heading(text: str) -> Heading:
    """Split ``Force [kN]``, ``force_kN``, ``Kraft in N``, ``F / N``, ``Axial Force (Max)`` into words and units."""
    text = text.strip()
    if len(text) > _LONGEST_NAME:
        return Heading((), (), ())
    bracketed = [next(group for group in m.groups() if group is not None) for m in _BRACKETS.finditer(text)]
    rest = _BRACKETS.sub(" ", text)
    timed = any(word in WORDS["time"] for word in _plain(rest).split())
    # [1] is no remark, but the unit of a number without one.
    remarks = [inside for inside in bracketed if _is_remark(inside, rest, timed) and "[1]" not in text]
    written = [inside for inside in bracketed if inside.strip() and inside not in remarks]
    inch = None if bracketed else _INCH.search(rest)
    if inch:
        rest, written = rest[: inch.start()], ["in"]
    if not written:
        rest, unit = _unit_within(rest, timed)
        if unit:
            rest, written = re.sub(r"\s+in\s*$", "", rest), [unit]
    rest, written = _with_second_unit(rest, written, timed)
    scaled = _FACTOR.search(rest)
    written += [scaled[0]] if scaled else []
    shown = [word for part in (rest, *remarks) for word in re.split(r"[\W_]+", part) if word]
    units = [] if written else [i for i, word in enumerate(shown[1:-1], start=1) if _inner_unit(word)]
    if units:
        # The "5 kN" of "5 kN load cell" is its range.
        ranges = [i for i in units if _is_range(shown[:i], rest)]
        written = [f"{shown[i - 1]} {shown[i]}" if i in ranges else shown[i] for i in units]
        gone = {*units, *(i - 1 for i in ranges)}
        shown = [word for i, word in enumerate(shown) if i not in gone]
    doubtful = [] if written else _doubtful(shown, rest)
    for word in doubtful:
        i = shown.index(word) if word in shown else 0
        if _is_range(shown[:i], rest) and any(find_unit(word, kind) for kind in ("force", "length")):
            written, doubtful = [f"{shown[i - 1]} {word}"], []
            break
    if timed and not written and any(word.lower() == "min" for word in shown):
        doubtful += [word for word in shown if word.lower() == "min"]
        shown = [word for word in shown if word.lower() != "min"]
    end = _AFTER_SIGN.search(rest) if doubtful else None
    at_end = end[1] if end and end[1] in doubtful else ""
    return Heading(tuple(word.lower() for word in shown), tuple(written), tuple(doubtful), at_end)


def _with_second_unit(rest: str, written: list[str], timed: bool) -> tuple[str, list[str]]:
    """Return a name without the second unit that stands before a first one, and both: ``Travel mm (in)``.

    Parameters
    ----------
    rest : str
        The name without its first unit.
    written : list of str
        The first unit, if there is one.
    timed : bool
        Whether it names a time.
    """
    first = tabulated_unit(written[0]) if len(written) == 1 else None
    before, unit = _unit_at_end(rest, timed) if first is not None else (rest, "")
    second = tabulated_unit(unit) if unit and unit.lower() != "in" else None
    if first is None or second is None or second.measured != first.measured:
        return rest, written
    return re.sub(r"\s+in\s*$", "", before), [*written, unit]


def _doubtful(words: Sequence[str], rest: str) -> list[str]:
    """Return the words of a name that may be units.

    Parameters
    ----------
    words : sequence of str
        The words of the name, as written.
    rest : str
        The name without brackets.
    """
    found = [word for word in words if not known_word(word)]
    # "t" is a time at the beginning of a name and may be tonnes at its end; V is a direction or volts.
    found += [word for word in words[1:][-1:] if word in ("t", "V")]
    # "Load #" is in pounds or counts loads.
    found += ["#"] * (re.search(r"[\s,;_]#\s*$", rest) is not None)
    # "disp_in_raw" may be in inches.
    return found + ["in"] * ("_in_" in rest.lower() or _INCH_FIRST.match(rest) is not None)


def _is_remark(inside: str, rest: str, timed: bool) -> bool:
    """Whether the text in brackets consists of words, such as ``(Max)``, and is not a unit."""
    words = _plain(inside).split()
    if words == ["min"]:
        # (Min) beside (Max) is the smallest value; of a time it may be minutes, which `heading` lists as doubtful.
        return not timed or inside.strip() != "min"
    if tabulated_unit(inside) is not None:
        return False
    if timed and words == ["std"] and "Std" in inside:
        return False  # Stunden: hours
    if any(word.isdigit() for word in words) and any(tabulated_unit(word) is not None for word in words):
        return False  # "0.001 in"
    if len(words) == 1 and len(words[0]) == 1 and words[0].isalpha():
        # "Force (F)" gives the symbol; "Force (t)" may be in tonnes.
        kinds = [kind for kind, known in WORDS.items() if words[0] in known]
        return any(name_quality(_plain(rest), kind) for kind in kinds) or words[0] in "xyz"
    return bool(words) and all(known_word(word) for word in words)


def _unit_within(text: str, timed: bool) -> tuple[str, str]:
    """Split a name without brackets into the name and its unit, wherever that is, or an empty text.

    Parameters
    ----------
    text : str
        Name without brackets.
    timed : bool
        Whether it names a time.
    """
    for match in _COMPOUND.finditer(text):
        if _are_units(re.split(r"[·⋅×*/^]", match[0])):
            return text[: match.start()] + " " + text[match.end() :], match[0]
    last = re.search(r"(?<=[\s_,;:|=])[^\W\d_]+-[^\W\d_]+$", text)
    if last and _are_units(last[0].split("-")):  # ft-lb
        return text[: last.start()], last[0]
    foot = re.fullmatch(r"(.*\w)[\s_]*['′]", text)
    if foot:
        return foot[1], "'"
    if "%" in text:
        return text.replace("%", " "), "%"
    return _unit_at_end(text, timed)


def _are_units(parts: Sequence[str]) -> bool:
    """Whether the parts of a text are factors of a unit: one of them is known, and none is a word of a name."""
    known = [tabulated_unit(part.rstrip("²³")) is not None for part in parts]
    return any(known) and not any(
        known_word(part) and not unit and not part.isdigit() for part, unit in zip(parts, known, strict=True)
    )


def _unit_at_end(text: str, timed: bool) -> tuple[str, str]:
    """Split ``force_kN``, ``Kraft in N``, ``F / N``, ``Moment N mm`` into the name and its unit, or an empty text."""
    slash = re.fullmatch(r"\s*([^\s_/]+|\S.*?\s)/\s*(\S.*)", text)
    if slash and (_is_unit(slash[2]) or not _names_something(slash[2])):
        return slash[1].strip(), slash[2]
    tokens = [token for token in re.split(r"[_\s,;|=]+", text) if token]
    for count in (2, 1):
        unit = "".join(tokens[-count:])
        found = tabulated_unit(unit) if len(tokens) > count else None
        if found is None or (count == 2 and found.measured != "moment"):
            continue
        if count == 2 and tokens[-2] == "in" and name_quality(_plain(" ".join(tokens[:-2])), "force"):
            continue  # "Force in lbf" is no moment
        if unit.lower() == "min" and not (timed and unit == "min"):
            continue  # the smallest value, or doubtful
        if POWER.fullmatch(tokens[-count - 1]) or _is_range(tokens[: len(tokens) - count], text):
            # "Force x10 N" is not in N, and "Load Cell 500 N" gives the range of a sensor.
            return " ".join(tokens[: -count - 1]), " ".join(tokens[-count - 1 :])
        return " ".join(token for token in tokens[:-count] if token not in ("in", "/")), unit
    match = re.fullmatch(r"(\S.*?)\s+in\s+(\S+)", text.strip())
    if match and not _names_something(match[2]):
        return match[1], match[2]
    match = re.fullmatch(r"(.+)[-.]([^-.\s]+)", text.strip())
    if match and _is_unit(match[2]):
        return match[1], match[2]
    return text, ""


def _is_range(words: Sequence[str], text: str) -> bool:
    """Whether the last of the words before a unit in a text is a number, and a range: not that of a channel.

    A name in which underscores stand around the number, force_2_N, numbers the channels.
    """
    if not words or not _NUMBER.fullmatch(words[-1]) or f"_{words[-1]}_" in text:
        return False
    before = words[-2].lower() if len(words) > 1 else ""
    return before not in NUMBERED_WORDS


def _is_unit(text: str) -> bool:
    """Whether a text is a unit of the table that is not also a word for the smallest value."""
    return tabulated_unit(text) is not None and text.lower() != "min"


def _names_something(text: str) -> bool:
    """Whether a text contains a word of a name, so that it is not a unit: the "unload force" of "load/unload force"."""
    return any(known_word(word) and len(word) > 1 for word in re.findall(r"[^\W\d_]+", text))


def _inner_unit(word: str) -> bool:
    """Whether a word between others is certainly a unit: the kN of ``force_kN_filtered``."""
    return (len(word) > 1 or word == "N") and not known_word(word) and tabulated_unit(word) is not None


def is_units_row(fields: Sequence[str]) -> bool:
    """Whether a line above a table holds units only, such as ``s;mm;N`` or ``[-] [MPa]``."""
    known = [tabulated_unit(field) is not None for field in fields]
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
    """Return how surely a column name means ``kind``, a key of `bushcli.recording.vocabulary.WORDS`.

    0 not at all; 1 a German compound; 2 a word for it among others; 3 a word for it; 4 this project's own name. A unit
    of another quantity in the table of `units` gives 0.

    Parameters
    ----------
    text : str
        Name of a column.
    kind : str
        Quantity that is searched for, a key of `bushcli.recording.vocabulary.WORDS`.
    """
    head = heading(text)
    for written in head.written:
        unit = tabulated_unit(written)
        if unit is not None and unit.measured != _MEASURED.get(kind, kind):
            return 0
    return word_quality(head, kind)


def word_quality(head: Heading, kind: str) -> int:
    """Return `match_quality` of the words alone, without the unit.

    Parameters
    ----------
    head : Heading
        Heading, cut into words.
    kind : str
        Quantity that is searched for, a key of `bushcli.recording.vocabulary.WORDS`.
    """
    name = _SAMPLE_RATE.sub(" ", head.name) if kind == "time" else head.name
    # A planar coupon test is called pure shear; its stress and strain are nominal, unlike those of simple shear.
    name = name.replace("pure shear", " ")
    if any(is_foreign(word) for word in name.split()):
        return 0
    return name_quality(" ".join(name.split()), kind)


def without(head: Heading, words: Collection[str]) -> Heading:
    """Return a heading without some of its words, such as "true" where a case asks for the true stress.

    Parameters
    ----------
    head : Heading
    words : collection of str
        In lower case.
    """
    return replace(head, words=tuple(word for word in head.words if word not in words))


def is_unnamed(head: Heading) -> bool:
    """Whether the words of a name neither name a quantity nor exclude one: ``Channel 3``, ``AI 0``."""
    if any(is_foreign(word) for word in head.words) or head.name.startswith(FOREIGN_BEGINNINGS):
        return False
    return not any(name_quality(head.name, kind) for kind in WORDS)


def says_measured(head: Heading) -> bool:
    """Whether a name says that the column was measured, unlike columns of set values."""
    return any(word in MEASURED_WORDS for word in head.words)


_MEASURED = {"stretch": "strain"}


def _plain(name: str) -> str:
    """Return a name in lower case, with single blanks between its words."""
    return " ".join(re.sub(r"[\W_]+", " ", name.lower()).split())
