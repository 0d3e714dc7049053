"""Units that the lines above a table state: ``Force unit: lbf``, ``# units: s, in, lbf``, ``Kraft in daN``."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

from bushcli.recording.header import Heading, heading
from bushcli.recording.match import WantedColumn, quality_of
from bushcli.recording.source import UNITS
from bushcli.recording.table import LONGEST_LINE, SHOWN, Table
from bushcli.recording.units import Unit, find_unit, tabulated_unit

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
#: A statement ends at these, or after a unit in brackets.
_ENDS = re.compile(r"[,;\t|]|(?<=[\])])")
_BETWEEN = re.compile(r"[\s,;|/-]+")
#: Words between units; "in" before a unit is a preposition: "all values in mm".
_JOINING = re.compile(
    r"\b(?:and|und|et|all|alle|are|set|to|used|the|values?)\b|\bin\s+(?=[^\W\d_])|[.:=\"]", re.IGNORECASE
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
#: Words after "Values in" that may be units.
_MOST = 10
#: Words of a statement that belong to no name of a column.
_ABOUT = re.compile(r"\b(?:all|alle|toutes?|les|is|are|in|of|channel|kanal)\b\s*\d*|[:=]", re.IGNORECASE)
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

    Parameters
    ----------
    table : Table
    wanted : WantedColumn
    explicit : bool
        Consider only lines that speak of units or of all values, which takes a tenth of the time.
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
        listed = [find_unit(part, wanted.measured) for part in _ENDS.split(rest)]
        listed += [tabulated_unit(part, wanted.measured) for part in _BETWEEN.split(rest)]
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
    if label is None:
        return None
    rest = _JOINING.sub(" ", re.sub(rf"(?<![\w-]){_NAME}", " ", text[label.end() :]))
    if values and not all(map(_is_known, _parts(rest))):
        return None
    return rest


def _parts(text: str) -> list[str]:
    return [part for part in _BETWEEN.split(text) if part]


def _is_known(text: str) -> bool:
    """Whether a text is a unit of any quantity."""
    return tabulated_unit(text) is not None or any(
        unit is not None and unit.factor > 0.0 for unit in (find_unit(text, kind) for kind in UNITS)
    )


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
    singular = " ".join(word.removesuffix("s") if len(word) > 4 else word for word in words)
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


def stated_unknown(table: Table, wanted: WantedColumn) -> tuple[int, str] | None:
    """Return the line above a table, its number and words, that states an unknown unit; or None.

    Parameters
    ----------
    table : Table
    wanted : WantedColumn
        A quantity of which the lines state no known unit.
    """
    for number, text in table.preamble:
        plain = _plain(text)
        if any(form.search(plain) for form in _SYSTEMS):
            continue
        label = _LABEL.match(plain)
        if label:
            parts = _parts(_listing(plain) or "")
            unknown = [part for part in parts if not part.isdigit() and not _is_known(part)]
            if unknown:
                return number, " ".join(unknown)[:SHOWN]
            continue
        values = _VALUES.match(plain)
        parts = _parts(_JOINING.sub(" ", plain[values.end() :])) if values else []
        named = 0 < len(parts) <= _MOST and all(find_unit(part, wanted.measured) for part in parts)
        if named and not all(map(_is_known, parts)):
            return number, " ".join(parts)[:SHOWN]  # "Values in V"
        of_quantity = _OF_QUANTITY.fullmatch(plain.strip())
        if of_quantity and _UNITS.search(of_quantity[1]) and _names(of_quantity[1], wanted):
            return number, of_quantity[2].strip()[:SHOWN]
    return None


def _names(label: str, wanted: WantedColumn) -> bool:
    """Whether the label of a line is about the unit of a quantity."""
    return any(quality_of(head, wanted) >= 3 for head in _heads(label))
