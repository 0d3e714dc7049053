"""Unit of a column: as the case or the file gives it, or the default one where neither does."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from bushcli.recording.header.above import stated_system, stated_units, stated_unknown
from bushcli.recording.header.match import NamedColumn
from bushcli.recording.header.name import SYMBOLS, heading
from bushcli.recording.header.name_parts import FACTOR
from bushcli.recording.header.units import (
    NO_UNIT,
    Unit,
    certain_unit,
    find_unit,
    plain_unit,
    scaled_unit,
    slip,
    tabulated_unit,
)
from bushcli.recording.header.vocabulary import plain_name
from bushcli.recording.quantities import SPECIAL, STATIC
from bushcli.recording.source import UNITS
from bushcli.recording.text.table import SHOWN, TextTable

#: Longest unknown word beside the name of a quantity that may be a unit: "force_klb".
_LONGEST_UNIT = 4
#: Names of a column that holds the units of the one before it, and its largest number of different texts.
_UNIT_NAMES = frozenset({"unit", "units", "einheit", "unité", "unidad", "unità", "eenheid", "单位", "単位"})
_MOST_UNITS = 5
#: The beginning of a text that is no number.
_TEXT = re.compile(r"[^\W\d_]|[%‰°\[(\"'′″#]|[\d.,/]+\s*[^\W\d_%°]")
#: What a column without a name may say of each sample, and what is no unit.
_STATES = frozenset([
    "ok", "nok", "io", "nio", "i.o.", "n.i.o.", "pass", "passed", "fail", "failed", "yes", "no", "ja", "nein",
    "true", "false", "on", "off", "valid", "invalid", "load", "unload",
])  # fmt: skip


@dataclass(frozen=True)
class KnownUnit:
    """The unit of a column, remarks about where it is given, and whether it is only assumed."""

    unit: Unit
    remarks: tuple[str, ...] = ()
    assumed: bool = False


def unit_of(column: NamedColumn) -> KnownUnit:
    """Return the unit that the case or the file gives for a column, or the default one where neither does."""
    wanted = column.wanted
    if wanted.given:
        unit = scaled_unit(wanted.given, wanted.measured)
        if unit is None or unit.measured != wanted.measured:
            raise column.refusal(f': "{wanted.given}" is not a unit of {STATIC[wanted.measured].title}')
        return KnownUnit(unit)
    units = [*_written_units(column), *_units_beside(column)] or list(_doubtful(column))
    if any(abs(unit.factor - units[0].factor) > 1e-9 * units[0].factor for unit in units):
        raise column.refusal(f" is in {' and in '.join(dict.fromkeys(unit.name for unit in units))}")
    if not units:
        # The name says whether it is a strain or a stretch.
        measured, plain = column.wanted.measured, column.head.without(column.wanted.allowed)
        kinds = [kind for kind in ("shear", "volume strain") if kind in column.wanted.kinds]
        is_strain = column.wanted.mode.sheared or any(map(column.head.quality, kinds))
        is_strain |= not plain.quality("stretch") and plain.quality("strain") > 0
        name = "strain" if measured == "strain" and is_strain else STATIC[measured].unit
        unit = Unit(measured, name, UNITS[measured][name])
        return _unit_above(column) or KnownUnit(unit, assumed=measured != "strain")
    others = (
        f"{column.label}: line {line} states {unit.name}, the header {units[0].name}, which is used"
        for line, unit in stated_units(column.table, wanted, explicit=True)
        if unit.factor != units[0].factor
    )
    return KnownUnit(units[0], tuple(others)[:1])


def _written_units(column: NamedColumn) -> Iterator[Unit]:
    """Yield the units in the name of a column and in the row of units."""
    plain = column.head.without(column.wanted.allowed)
    is_stretch = plain.quality("stretch") > plain.quality("strain")
    for text in column.written_units:
        # The J of "Volume ratio (J)" is its symbol, and no joule.
        none = plain_unit(text) in SYMBOLS and column.wanted.is_special(column.head)
        if column.wanted.measured == "strain":
            # A ratio of lengths in the name of a stretch is no strain: "Stretch [mm/mm]".
            unit = tabulated_unit(text)
            none |= plain_unit(text) in NO_UNIT or (is_stretch and unit is not None and unit.name == "strain")
        if not none:
            yield _unit_of_text(column, text)


def _units_beside(column: NamedColumn) -> Iterator[Unit]:
    """Yield the unit in the column behind another one, ``12.5;N``, or in a column "Force unit" anywhere.

    A column of texts without a name of its own, or called "Unit", stands where units stand: what it holds is the unit,
    or the file is refused. In a column with another name, ``Phase``, a constant text counts if it is surely a unit.
    """
    table, measured = column.table, column.wanted.measured
    for index, name in enumerate(table.names if isinstance(table, TextTable) else ()):
        words = set(heading(name).words) or set(plain_name(name).split())
        rest = [word for word in plain_name(name).split() if word not in _UNIT_NAMES]
        is_unit_column = len(rest) < len(plain_name(name).split())
        is_named_after = is_unit_column and " ".join(rest) == plain_name(column.head.name)
        behind = index == column.index + 1 and not (is_unit_column and rest and not is_named_after)
        first = table.text(0, index)
        texts = _TEXT.match(first) is not None or certain_unit(first)
        if not (is_named_after or behind) or not texts or first.lower() in _STATES:
            continue
        fields = [table.text(row, index) for row in range(len(table))]
        written = list(dict.fromkeys(field for field in fields if field))
        stands = is_named_after or is_unit_column or not words
        sure = len(written) == 1 and len(plain_unit(written[0])) > 1 and certain_unit(written[0])
        known = [find_unit(text, measured) for text in written[: _MOST_UNITS + 1]]
        is_own = all(unit is not None and unit.measured == measured for unit in known)
        if not (stands or sure or (is_own and len(written) <= _MOST_UNITS)):
            continue  # "h" in a column "Phase" is no unit of the force before it
        if len(written) > 1 or "" in fields:
            row = next(i for i, field in enumerate(fields) if field != fields[0])
            units = f'"{fields[0][:SHOWN]}" at first and "{fields[row][:SHOWN]}" here'
            what = f"{column.label}: the unit behind it is {units}"
            key = f'units = {{{column.wanted.quantity} = "..."}}'
            expected = f"one unit; or {key} in the table of the case file"
            raise table.refusal(what, expected, row)
        yield _unit_of_text(column, written[0])


def _unit_above(column: NamedColumn) -> KnownUnit | None:
    """Return the unit that the lines above the table state for a column without one; None if they state none."""
    table, wanted = column.table, column.wanted
    stated = stated_units(table, wanted)
    system = None if wanted.measured in ("time", "angle", "strain") else stated_system(table)
    unknown = None if stated or system else stated_unknown(column)
    reason = ""
    if len({unit.factor for _, unit in stated}) > 1:
        several = " and ".join(dict.fromkeys(f"{unit.name} (line {line})" for line, unit in stated))
        reason = f"the lines above the table state {several}"
    elif system and not stated:
        reason = f"line {system[0]} states the system of units: {system[1]}"
    elif unknown:
        title = STATIC[wanted.measured].title
        reason = f'what line {unknown[0]} states is not a unit of {title}: "{unknown[1]}"'
    if reason:
        raise column.refusal(f" has no unit, and {reason}")
    if not stated:
        return None
    line, unit = stated[0]
    return KnownUnit(unit, (f"{column.label} is read in {unit.name}, which line {line} states",))


def _unit_of_text(column: NamedColumn, text: str) -> Unit:
    """Return the unit that a text names, or refuse the text."""
    measured = column.wanted.measured
    unit = find_unit(text, measured)
    if unit is None:
        shown = f': "{text}" is not a known unit'
        number = re.match(r"\d+(?:[.,]\d+)?k?\s*(?=\D)", text)
        is_bare = re.fullmatch(r"\d+(?:[.,]\d+)?", text) is not None
        if plain_unit(text) in NO_UNIT:
            shown = " says that it has no unit"
        elif text.startswith(FACTOR):
            shown = f': the factor "{text.removeprefix(FACTOR).strip()}" is not applied'
        elif is_bare and column.table.names[column.index].count(text):
            shown = f': "{text}" may be a factor, the range of the sensor, or the number of a channel'
        elif number and find_unit(text[number.end() :], measured) is not None:
            shown = f': "{text}" may be the range of the sensor, or a factor and the unit'
        raise column.refusal(shown, slip(text, measured))
    if unit.measured != measured:
        # As written: "Force [KG]" is in KG.
        bare = plain_unit(text)
        name = bare if bare.lower() == unit.name.lower() else unit.name
        what = f" is in {name}, but mode {column.wanted.mode.name} needs a {STATIC[measured].title}"
        size = STATIC[unit.measured].size if unit.measured == STATIC[measured].raw else ""
        raise column.refusal(what, instead=f"give {size}" if size else "")
    return unit


def _doubtful(column: NamedColumn) -> Iterator[Unit]:
    """Yield the units that unknown words of a name mean, or refuse a word that may be a unit.

    That is a short word, one that is a unit of another quantity, or one that stands where units stand.
    """
    wanted, head = column.wanted, column.head
    symbols = SYMBOLS | {name for kind in wanted.kinds if kind in SPECIAL for name in SPECIAL[kind].words}
    for word in head.doubtful:
        symbol = (word in SYMBOLS or word.lower() in symbols) and wanted.is_special(head)
        if symbol or word.lower() in wanted.allowed or (word == "in" and wanted.measured != "length"):
            continue
        # The unit, or the smallest value; the unit, or the preposition.
        either = word.lower() == "min" or word == "in"
        unit = None if either else find_unit(word, wanted.measured)
        if unit is not None and unit.measured == wanted.measured:
            yield unit
        elif either or word == head.at_end or unit or len(word) <= _LONGEST_UNIT or word[:1].isdigit():
            raise column.refusal(f': it is not clear whether "{word}" is a unit')
