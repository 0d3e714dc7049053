"""Units that the lines above a table state: ``Force unit: lbf``, ``# units: s, in, lbf``, ``Kraft in daN``."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

from bushcli.recording.header.header import Heading, heading, word_quality
from bushcli.recording.header.match import WantedColumn, quality_of
from bushcli.recording.header.units import Unit, certain_unit, find_unit, is_unit, tabulated_unit
from bushcli.recording.header.vocabulary import WORDS
from bushcli.recording.source import Quantity, dimension
from bushcli.recording.text.table import LONGEST_LINE, SHOWN, Table

_UNITS = re.compile(
    r"(?:\b|(?<=[a-zé])(?=U))(?:units?(?:\s+(?:set|system))?|einheit(?:en)?|unités?)\b\W*", re.IGNORECASE
)
#: The label of units of all columns. "Unit: 3" may count the parts under test; "Units: 3" has no unit either.
_LABEL = re.compile(
    r"\W*(?:units|einheiten|unités|units?\s+(?:set|system)|einheitensystem|system\s+of\s+units)"
    r"(?:\s+(?:set\s+to|are|used))?"
    r"(?:\s*[:=;,\t|]|\s+in(?=\s+[^\W\d_])|(?<=to)\s|(?<=are)\s)\W*",
    re.IGNORECASE,
)
#: "All values in kN and mm" states units; "Data in file 3" does not.
_IN = (
    r"\W*(?i:(?:(?:all|alle|toutes?|les)\s+)*(?:values?|data|results?|measurements?|channels|columns|werte|messwerte"
    r"|daten|valeurs)\s+(?:(?:are|is|sind|sont|given|recorded|angegeben)\s+)*in\s+)"
)
_VALUES = re.compile(_IN)
_ALL = re.compile(r"\W*(?:all|alle|toutes)\b", re.IGNORECASE)
#: A statement ends at these, or after a unit in brackets.
_ENDS = re.compile(r"[,;\t|]|(?<=[\])])")
#: Words between units; "in" before a unit is a preposition: "all values in mm".
_JOINING = re.compile(
    r"\b(?:and|und|et|all|alle|are|set|to|used|the|values?)\b|\bin\s+(?=[^\W\d_])|[:=]|\.(?=\s|$)",
    re.IGNORECASE,
)
#: Systems of units, which do not say in which unit a column is, and where their names stand. "US" is no unit there,
#: and "us" no system.
_NAME = (
    r"(?:(?:US|U\.S\.|SI|MKS|CGS|FPS|cgs|mks|USCS)(?![\w-])(?:[ -][Cc]ustomary)?"
    r"|(?i:(?:us|u\.s\.)[ -]customary|imperial|english|british|metric|metrisch|customary|inch[ -]pound)(?![\w-]))"
)
_SYSTEMS = (
    # "Units" anywhere; "unit" and "system" at the beginning, for "Business unit: US" is none.
    re.compile(
        r"(?i:\b(?:units|einheiten|unités)(?:[ -]?(?:set|system))?|^\W*unit(?:[ -]?(?:set|system))?|^\W*einheitensystem"
        rf"|^\W*system(?:[ ]of[ ]units)?)\W{{0,9}}(?i:(?:set to|are|is|in|used)?)[\W_]{{0,9}}({_NAME})"
    ),
    re.compile(rf"(?<![\w-])({_NAME}[ -](?i:units?|einheiten|unit system))\b"),
    re.compile(rf"^{_IN}({_NAME})"),
    re.compile(r"\b(imperial|(?:us|u\.s\.)[ -]customary|inch[ -]pound)\b", re.IGNORECASE),
)
#: "Force in 0.1 N", "Kraft in Skalenteilen".
_IS_UNIT = re.compile(r"\s*([^\W\d_][^:=]*?)(?:\s*[:=]\s*|\s+in\s+)(\S.*?)\s*")
_IN_UNIT = re.compile(r"\s*([^\W\d_].*?)\s+in\s+(\S+(?:\s+\S+){0,2})\s*")
_QUANTITIES: tuple[Quantity, ...] = ("time", "displacement", "force")
#: Longest unknown word after "Values in" that may be a unit, and number of words that may be.
_SHORT = 4
_MOST = 10
#: Words of a statement that belong to no name of a column.
_ABOUT = re.compile(
    r"\b(?:all|alle|toutes?|les|is|are|in|of|(?:channel|kanal)\b\s*\d*)(?!\w)|[:=]", re.IGNORECASE
)
#: "Length unit: inch" is about the column of a length; "Gauge length unit: mm" is not.
_LENGTH = re.compile(
    r"^\W*(?:(?:lengths?|distances?|längen?)(?=[\s_-]*(?:units?|einheit))|units?\s+(?:of|for)\s+(?:lengths?|distances?)\b)",
    re.IGNORECASE,
)
#: "Force unit: foo", "Unit of force = foo": the label without its colon, and what it says.
_OF_QUANTITY = re.compile(r"([^:=;,\t|]*)[:=;,\t|]+\s*(\S.*)")


def stated_units(table: Table, wanted: WantedColumn, explicit: bool = False) -> tuple[tuple[int, Unit], ...]:
    """Return the units of a quantity that the lines above a table state, each with the number of the line.

    A number before a unit makes it a value, such as the range of a sensor, and no statement.
    """
    lines = [
        (number, text)
        for number, text in table.preamble
        if not explicit or _UNITS.search(text[:LONGEST_LINE]) or _VALUES.match(text)
    ]
    return tuple((number, unit) for number, text in lines for unit in _stated(_plain(text), wanted))


def _plain(text: str) -> str:
    """Return a line with "Krafteinheit" in two words, and "displacement" where it states the unit of a length.

    Longer lines are cut: they are no statements, and the search for units in them takes long.
    """
    # A quotation mark alone is an inch.
    text = re.sub(r'"([^"]*)"', r"\1", text[:LONGEST_LINE])
    text = re.sub(r"(?<=[a-zäöüß])(einheit(?:en)?)(?=\W|$)", r" \1", text)
    return _LENGTH.sub("displacement ", text)


def _stated(text: str, wanted: WantedColumn) -> list[Unit]:
    """Return the units of a quantity that one line states."""
    rest = _listing(text)
    if rest is not None:
        listed = [find_unit(part, wanted.measured) for part in _parts(rest)]
        units = [unit for unit in listed if unit is not None and unit.measured == wanted.measured]
        if units:
            return list(dict.fromkeys(units))
    parts = _ENDS.split(text)
    # "Travel;in;Force;lbf" has each unit behind its name.
    pairs = [f"{name} [{unit.strip()}]" for name, unit in pairwise(parts) if tabulated_unit(unit) is not None]
    for split in (pairs, [text], re.split(r"[;\t|]", text), parts):
        units = [unit for part in split if (unit := _said(part, wanted)) is not None]
        if units:
            return units
    return []


def _listing(text: str) -> str | None:
    """Return the units, as written, that a line lists without names of columns: "Units: mm, kN"; None for other lines.

    Names of systems of units, and words between the units, are left out.
    """
    text = text.strip()
    values = _VALUES.match(text)
    label = values or _LABEL.match(text) or _UNITS.match(text)
    if label is None or (not values and any(_is_named(part) for part in _ENDS.split(text[label.end() :]))):
        return None
    rest = _without_words(re.sub(rf"(?<![\w-]){_NAME}", " ", text[label.end() :]))
    if values and not all(map(is_unit, _parts(rest))):
        return None
    return rest


def _without_words(text: str) -> str:
    """Return a list of units without the words between them."""
    return _JOINING.sub(" ", re.sub(r"\s(?:and|und|et)\s", ", ", text))


def _parts(text: str) -> list[str]:
    """Return the units of a list: "mm, N/mm and 0.1 N" has three; "mm / kN", with blanks, has two."""
    parts = []
    for part in (part.strip() for part in _ENDS.split(text)):
        several = re.split(r"[-/]", part)
        if len(several) > 2 and all(map(tabulated_unit, several)):
            parts += several  # mm-kN-s
            continue
        whole = not part or certain_unit(part) or _joined(part)
        parts += [part] if whole else re.split(r"\s+(?:[/-]\s+)?|(?<=\w)/(?=\w+/\w)|(?<=/\w)/", part)
    return [part for part in parts if part]


def _joined(text: str) -> bool:
    """Whether blanks within a text belong to one unit: a prefix apart, "Mio N", or a product, "N m"."""
    words = text.split()
    units = [tabulated_unit(word) for word in words]
    product = [unit.measured for unit in units if unit is not None] == ["force", "length"]
    alone = product and max(map(len, words)) <= 2
    return len(words) > 1 and is_unit(text) and (alone or None in units)


def _said(part: str, wanted: WantedColumn) -> Unit | None:
    """Return the unit of a quantity that a part of a line states, such as "Kraft in daN" or "forces are in kN"."""
    for head in _heads(part):
        said = head.written or head.doubtful
        if quality_of(head, wanted) and len(said) == 1:
            unit = find_unit(said[0], wanted.measured)
            if unit is not None and unit.measured == wanted.measured:
                return unit
    return None


def _heads(part: str) -> list[Heading]:
    """Return a part of a line as a heading, without the word for units; then also in the singular, without "are in"."""
    plain = _UNITS.sub(" ", part)
    # "in" is a unit at the end, and a preposition before one.
    words = _ABOUT.sub(" ", plain).split()
    singular = " ".join(
        word.removesuffix("s") if len(word) > 4 and word.isalpha() and word[-2] != "s" else word
        for word in words
    )
    # "- Force in kN" is an item of a list, not the negative force.
    return [replace(heading(text), formula=False) for text in (plain, singular)]


def stated_system(table: Table) -> tuple[int, str] | None:
    """Return the line above a table, its number and words, that names a system of units: "Units: Imperial"; or None."""
    for number, text in table.preamble:
        for form in _SYSTEMS:
            found = form.search(text[:LONGEST_LINE])
            if found:
                return number, found[1]
    return None


def stated_unknown(table: Table, wanted: WantedColumn, index: int) -> tuple[int, str] | None:
    """Return the line above a table, its number and words, that states an unknown or unsuitable unit; or None."""
    of_mode = {
        wanted.measured,
        *(dimension(q, wanted.mode.specimen, wanted.mode.rotational) for q in _QUANTITIES),
    }
    for number, text in table.preamble:
        plain = _plain(text)
        if any(form.search(plain) for form in _SYSTEMS):
            continue
        said = _unknown_of(plain, wanted)
        label, values = _LABEL.match(plain), _VALUES.match(plain)
        if not said and label and not any(_is_named(part) for part in _ENDS.split(plain[label.end() :])):
            parts = [part for part in _parts(_listing(plain) or "") if not part.isdigit()]
            unknown = [part for part in parts if not is_unit(part)]
            foreign = [part for part in parts if not any(_is_of(part, kind) for kind in of_mode)]
            if len(parts) == len(table.names) > 1:
                said = parts[
                    index
                ]  # no unit in the list is one of the quantity: it is the column's own that is wrong
            elif unknown or (foreign and wanted.quantity != "time"):
                said = " ".join(unknown or foreign)
        elif not said and values:
            parts = _parts(_without_words(plain[values.end() :]))
            short = (
                len(parts) == 1 and len(parts[0]) <= _SHORT and parts[0].isalpha() and not is_unit(parts[0])
            )
            named = 0 < len(parts) <= _MOST and all(find_unit(part, wanted.measured) for part in parts)
            if (
                short
                or (len(parts) == 1 and _ALL.match(plain) and not is_unit(parts[0]))
                or (named and not any(_is_of(part, kind) for part in parts for kind in of_mode))
            ):
                said = " ".join(parts)  # "Values in V"
        if said:
            return number, said[:SHOWN]
    return None


def _unknown_of(plain: str, wanted: WantedColumn) -> str:
    """Return what a line states as the unit of a quantity by name and what is none: "Force unit: foo"."""
    of_quantity = _OF_QUANTITY.fullmatch(plain.strip())
    if of_quantity and _UNITS.search(of_quantity[1]) and _names(of_quantity[1], wanted):
        return of_quantity[2].strip()
    label = _LABEL.match(plain)
    for part in _ENDS.split(plain[label.end() :] if label else plain):
        pair = (_IS_UNIT if label else _IN_UNIT).fullmatch(part)
        if (
            pair
            and _names(pair[1], wanted)
            and (label or " " not in pair[2] or any(map(tabulated_unit, pair[2].split())))
        ):
            return pair[2]
        for head in _heads(part):
            # "Force: 25 kN" is a value, and a name with words beside it is a sentence.
            said = [text for text in head.written if label or not text[:1].isdigit() or certain_unit(text)]
            if said and quality_of(head, wanted) >= 3 and ":" not in part:
                return said[0]
    return ""


def _is_named(part: str) -> bool:
    """Whether a part of a list has the name of a quantity: "Force=N" in "units: Time=s, Force=N"."""
    return (
        any(word_quality(head, kind) for head in _heads(part) for kind in WORDS)
        and len(part) > 1
        and not is_unit(part)
    )


def _is_of(text: str, measured: str) -> bool:
    unit = find_unit(text, measured)
    return unit is not None and unit.measured == measured


def _names(label: str, wanted: WantedColumn) -> bool:
    """Whether the label of a line is about the unit of a quantity."""
    return any(quality_of(head, wanted) >= 3 for head in _heads(label))
