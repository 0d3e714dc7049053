"""Meaning of the names and units in a header: ``Standardkraft [kN]`` is a force in kN."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from bushcli.recording.units import NO_UNIT, plain_unit, tabulated_unit


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


#: Words for a column, the column names of this project first.
_WORDS = {
    "time": ("time", "t", "elapsed time", "total time", "running time", "zeit", "prüfzeit", "testzeit",
        "时间",
    ),
    "length": (
        "displacement", "disp", "deflection", "travel", "stroke", "extension", "crosshead",
        "weg", "standardweg", "verschiebung", "auslenkung", "federweg", "位移",
    ),
    "angle": ("rotation", "angle", "twist", "winkel", "drehwinkel", "verdrehung", "phi", "角度"),
    "force": ("force", "load", "f", "kraft", "standardkraft", "last", "力", "载荷"),
    "moment": ("moment", "torque", "drehmoment", "扭矩"),
    "stretch": ("stretch", "lambda", "stretch ratio", "extension ratio", "streckung", "verstreckung"),
    "strain": (
        "strain", "nominal strain", "engineering strain", "dehnung", "nenndehnung", "technische dehnung", "应变",
    ),
    "stress": (
        "nominal stress", "stress", "engineering stress", "nennspannung", "spannung", "technische spannung",
        "应力",
    ),
}  # fmt: skip
#: The last part of a compound determines its meaning: Standardkraft, Traversenweg, 试验力. The longest ending decides.
_ENDINGS: Mapping[str, tuple[str, ...]] = {
    "time": ("zeit", "时间"), "length": ("weg", "位移", "行程"), "angle": ("winkel", "角度", "转角"),
    "force": ("kraft", "力", "载荷", "负荷"), "moment": ("moment", "扭矩", "力矩"),
    "strain": ("dehnung", "应变"), "stress": ("spannung", "应力"),
}  # fmt: skip
#: Words that mean a quantity where no column has a better name.
_WEAK: Mapping[str, tuple[str, ...]] = {
    "length": ("position", "traverse", "hub", "einfederung"),
}  # fmt: skip
#: Words that change the meaning: a true stress is not a nominal stress; a set value, a rate, an error, an extreme or a
#: counter is not a measured value.
_FOREIGN = _set(
    "true wahre cauchy log logarithmic hencky set setpoint command cmd soll sollwert demand target reference ref "
    "desired rate speed velocity acceleration error err deviation fehler abweichung step steps schritt count counts "
    "counter number index id cycle cycles zyklus segment limit status mode min max minimum maximum minimal maximal "
    "mean avg average mittelwert peak valley rms std range amplitude frequency temperature temp work energy power "
    "stiffness integral derivative offset remaining date noise geschwindigkeit delta tolerance"
)
_FOREIGN_BEGINNINGS = ("soll", "max", "min", "grenz", "rest", "höchst", "bruch")
#: Words for measured values.
_MEASURED_WORDS = _set("measured actual feedback fbk ist istwert gemessen messwert response")
#: Words beside that for a quantity that are not units and do not change the meaning.
_BESIDE = _MEASURED_WORDS | _set(
    "axial radial torsional conical x y z r a b c u v w i ii l q ch chan channel kanal raw filt corr cell dose sensor "
    "lvdt mts hbm pcb ni daq dic cam cyl rig test part dut mess main top bot left right up down vert hor lin rot rad "
    "ax tor abs rel total net eng nom of the on at from in for data wert value ai ao adc sig no nr mid low high "
    "probe prüf inner outer sleeve filtered corrected calibrated smoothed"
)
#: Full-width brackets are in use between Chinese characters.
_BRACKETS = re.compile(
    r"\[([^\[\]]*)\]|\(([^()]*)\)|\{([^{}]*)\}|<([^<>]*)>|（([^（）]*)）|［([^［］]*)］|【([^【】]*)】"
)
#: A factor beside a unit: "x10 N", "1000 N".
_POWER = re.compile(r"[x×*]?10+|1[eE]\d")
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
    """

    words: tuple[str, ...]
    written: tuple[str, ...]
    doubtful: tuple[str, ...]

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
    timed = any(word in _WORDS["time"] for word in _plain(rest).split())
    remarks = [inside for inside in bracketed if _is_remark(inside, rest, timed)]
    written = [inside for inside in bracketed if inside.strip() and inside not in remarks]
    if not written:
        rest, unit = _unit_at_end(rest, timed)
        written = [unit] if unit else []
    shown = [word for part in (rest, *remarks) for word in re.split(r"[\W_]+", part) if word]
    units = [] if written else [word for word in shown[1:-1] if _inner_unit(word)]
    if units:
        shown, written = [word for word in shown if word not in units], units
    doubtful = [] if written else [word for word in shown if not _known_word(word)]
    if timed and not written and any(word.lower() == "min" for word in shown):
        doubtful += [word for word in shown if word.lower() == "min"]
        shown = [word for word in shown if word.lower() != "min"]
    return Heading(tuple(word.lower() for word in shown), tuple(written), tuple(doubtful))


def _is_remark(inside: str, rest: str, timed: bool) -> bool:
    """Whether the text in brackets consists of words, such as ``(Max)``, and is not a unit."""
    words = _plain(inside).split()
    if words == ["min"]:
        # (Min) beside (Max) is the smallest value; of a time it may be minutes, which `heading` lists as doubtful.
        return not timed or inside.strip() != "min"
    if tabulated_unit(inside) is not None:
        return False
    if len(words) == 1 and len(words[0]) == 1 and words[0].isalpha():
        # "Force (F)" gives the symbol; "Force (t)" may be in tonnes.
        kinds = [kind for kind, known in _WORDS.items() if words[0] in known]
        return any(_quality(_plain(rest), kind) for kind in kinds) or words[0] in "xyz"
    return bool(words) and all(_known_word(word) for word in words)


def _unit_at_end(text: str, timed: bool) -> tuple[str, str]:
    """Split ``force_kN``, ``Kraft in N``, ``F / N``, ``Moment N mm`` into the name and its unit, or an empty text."""
    slash = re.fullmatch(r"\s*([^\s_/]+|\S.*?\s)/\s*(\S.*)", text)
    if slash and not _names_something(slash[2]):
        return slash[1].strip(), slash[2]
    tokens = [token for token in re.split(r"[_\s,;|]+", text) if token]
    for count in (2, 1):
        unit = "".join(tokens[-count:])
        found = tabulated_unit(unit) if len(tokens) > count else None
        if found is None or (count == 2 and found.measured != "moment"):
            continue
        if unit.lower() == "min" and not (timed and unit == "min"):
            continue  # the smallest value, or doubtful
        if _POWER.fullmatch(tokens[-count - 1]):
            return " ".join(tokens[: -count - 1]), " ".join(tokens[-count - 1 :])  # "Force x10 N" is not in N
        return " ".join(token for token in tokens[:-count] if token not in ("in", "/")), unit
    match = re.fullmatch(r"(\S.*?)\s+in\s+(\S+)", text.strip())
    if match and not _names_something(match[2]):
        return match[1], match[2]
    match = re.fullmatch(r"(.+)[-.]([^-.\s]+)", text.strip())
    if match and tabulated_unit(match[2]) is not None and match[2].lower() != "min":
        return match[1], match[2]
    return text, ""


def _names_something(text: str) -> bool:
    """Whether a text contains a word of a name, so that it is not a unit: the "unload force" of "load/unload force"."""
    return any(_known_word(word) and len(word) > 1 for word in re.findall(r"[^\W\d_]+", text))


def _inner_unit(word: str) -> bool:
    """Whether a word between others is certainly a unit: the kN of ``force_kN_filtered``."""
    return (len(word) > 1 or word == "N") and not _known_word(word) and tabulated_unit(word) is not None


def _known_word(word: str) -> bool:
    if _POWER.fullmatch(word):
        return False
    plain = word.lower().strip("0123456789")
    return (
        not plain
        or plain in _ALL_WORDS
        or plain in _FOREIGN
        or plain in _BESIDE
        or any(len(plain) > len(end) and plain.endswith(end) for end in _ALL_ENDINGS)
    )


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
    return sum(any(word_quality(head, kind) for kind in _WORDS) for head in heads)


def match_quality(text: str, kind: str) -> int:
    """Return how surely a column name means ``kind``, a key of the table of words.

    0 not at all; 1 a German compound; 2 a word for it among others; 3 a word for it; 4 this project's own name. A unit
    of another quantity in the table of `units` gives 0.

    Parameters
    ----------
    text : str
        Name of a column.
    kind : str
        Quantity that is searched for, a key of the table of words.
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
        Quantity that is searched for, a key of the table of words.
    """
    if any(word in _FOREIGN for word in head.words):
        return 0
    return _quality(head.name, kind)


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
    if any(word in _FOREIGN for word in head.words) or head.name.startswith(_FOREIGN_BEGINNINGS):
        return False
    return not any(_quality(head.name, kind) for kind in _WORDS)


def says_measured(head: Heading) -> bool:
    """Whether a name says that the column was measured, unlike columns of set values."""
    return any(word in _MEASURED_WORDS for word in head.words)


def _quality(name: str, kind: str) -> int:
    words, known = name.split(), _WORDS[kind]
    if name == known[0]:
        return 4
    if name in known:
        return 3
    if any(len(word) > 1 and word in words for word in known):
        # "extension ratio" contains a word for a length but is a stretch.
        return 0 if any(name in _WORDS[other] for other in _WORDS if other != kind) else 2
    if any(word in words for word in _WEAK.get(kind, ())):
        return 1
    if kind not in _ENDINGS or name.startswith(_FOREIGN_BEGINNINGS):
        return 0
    longest = max((end for end in _ALL_ENDINGS if name.endswith(end)), key=len, default="")
    return 1 if longest in _ENDINGS[kind] else 0


_MEASURED = {"stretch": "strain"}
_ALL_ENDINGS = tuple(end for ends in _ENDINGS.values() for end in ends)
_ALL_WORDS = frozenset(
    word for names in (*_WORDS.values(), *_WEAK.values()) for name in names for word in name.split()
)


def _plain(name: str) -> str:
    """Return a name in lower case, with single blanks between its words."""
    return " ".join(re.sub(r"[\W_]+", " ", name.lower()).split())
