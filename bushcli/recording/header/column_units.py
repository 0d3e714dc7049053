"""Unit of a column: as the case or the file gives it, or the default one where neither does."""

from __future__ import annotations

import re
from dataclasses import dataclass

from bushcli.errors import Problem, RecordingError
from bushcli.recording.header.factors import FACTOR
from bushcli.recording.header.header import Heading, heading, without, word_quality
from bushcli.recording.header.hints import KIND
from bushcli.recording.header.match import SYMBOLS, WantedColumn, special_quality, written_units
from bushcli.recording.header.quality import plain_name
from bushcli.recording.header.stated import stated_system, stated_units, stated_unknown
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
from bushcli.recording.header.vocabulary import SPECIAL
from bushcli.recording.source import UNITS, Quantity
from bushcli.recording.text.table import SHOWN, Table, TextTable

_DEFAULT_UNIT = {
    "time": "s", "length": "mm", "angle": "deg", "force": "N", "moment": "Nmm",
    "strain": "stretch", "stress": "MPa",
}  # fmt: skip
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


def given_unit(table: Table, wanted: WantedColumn, index: int, text: str) -> KnownUnit:
    """Return the unit that the case gives for a column."""
    unit = scaled_unit(text, wanted.measured)
    if unit is None or unit.measured != wanted.measured:
        what = f'{table.label(index)}: "{text}" is not a unit of {KIND[wanted.measured]}'
        raise _refused(table, wanted.quantity, index, what)
    return KnownUnit(unit)


def unit_of(table: Table, wanted: WantedColumn, index: int) -> KnownUnit:
    """Return the unit that the file gives for a column, or the default one where it gives none."""
    measured, quantity = wanted.measured, wanted.quantity
    head = heading(table.names[index])
    # The J of "Volume ratio (J)" is its symbol, and no joule.
    special = {name for kind in wanted.kinds for name in SPECIAL.get(kind, ())}
    is_special = any(special_quality(head, kind) for kind in wanted.kinds if kind in SPECIAL)
    units = [
        _read(table, wanted, index, text)
        for text in written_units(table, index, head)
        if not (measured == "strain" and (plain_unit(text) in NO_UNIT or _says_stretch(head, wanted, text)))
        and not (plain_unit(text) in SYMBOLS and is_special)
    ]
    units += _units_beside(table, wanted, index)
    if not units:
        units = [
            unit
            for word in head.doubtful
            if not (is_special and (word in SYMBOLS or word.lower() in special))
            and word.lower() not in wanted.allowed
            and (unit := _doubtful(table, wanted, index, word, word == head.at_end))
        ]
    if not units and (above := _unit_above(table, wanted, index)):
        return above
    if not units:
        plain = without(head, wanted.allowed)
        strains = (special_quality(head, kind) for kind in ("shear", "volume strain") if kind in wanted.kinds)
        is_strain = wanted.mode.sheared or any(strains)
        is_strain |= not word_quality(plain, "stretch") and word_quality(plain, "strain") > 0
        name = "strain" if measured == "strain" and is_strain else _DEFAULT_UNIT[measured]
        # The name says whether it is a strain or a stretch.
        return KnownUnit(Unit(measured, name, UNITS[measured][name]), assumed=measured != "strain")
    if any(abs(unit.factor - units[0].factor) > 1e-9 * units[0].factor for unit in units):
        what = f"{table.label(index)} is in {' and in '.join(dict.fromkeys(unit.name for unit in units))}"
        raise _refused(table, quantity, index, what)
    other = next(
        ((line, u) for line, u in stated_units(table, wanted, explicit=True) if u.factor != units[0].factor),
        None,
    )
    if other is None:
        return KnownUnit(units[0])
    said = f"line {other[0]} states {other[1].name}, the header {units[0].name}, which is used"
    return KnownUnit(units[0], (f"{table.label(index)}: {said}",))


def _units_beside(table: Table, wanted: WantedColumn, index: int) -> list[Unit]:
    """Return the unit in the column behind another one, ``12.5;N``, or in a column "Force unit" anywhere.

    A column of texts without a name of its own, or called "Unit", stands where units stand: what it holds is the unit,
    or the file is refused. In a column with another name, ``Phase``, a constant text counts if it is surely a unit.
    """
    if not isinstance(table, TextTable):
        return []
    found = []
    for at, name in enumerate(table.names):
        words = set(heading(name).words) or set(plain_name(name).split())
        rest = [word for word in plain_name(name).split() if word not in _UNIT_NAMES]
        named = len(rest) < len(plain_name(name).split())
        own = named and " ".join(rest) == plain_name(" ".join(heading(table.names[index]).words))
        behind = at == index + 1 and not (named and rest and not own)
        first = table.text(0, at)
        texts = _TEXT.match(first) is not None or certain_unit(first)
        if not (own or behind) or not texts or first.lower() in _STATES:
            continue
        fields = [table.text(row, at) for row in range(len(table))]
        written = list(dict.fromkeys(field for field in fields if field))
        stands = own or named or not words
        sure = len(written) == 1 and len(plain_unit(written[0])) > 1 and certain_unit(written[0])
        known = [find_unit(text, wanted.measured) for text in written[: _MOST_UNITS + 1]]
        is_own = all(unit is not None and unit.measured == wanted.measured for unit in known)
        if not (stands or sure or (is_own and len(written) <= _MOST_UNITS)):
            continue  # "h" in a column "Phase" is no unit of the force before it
        if len(written) > 1 or "" in fields:
            row = next(i for i, field in enumerate(fields) if field != fields[0])
            what = (
                f'{table.label(index)}: the unit behind it is "{fields[0][:SHOWN]}" at first and '
                f'"{fields[row][:SHOWN]}" here'
            )
            expected = f'one unit; or units = {{{wanted.quantity} = "..."}} in the table of the case file'
            raise RecordingError(Problem(table.place(row), what, "", expected))
        found.append(_read(table, wanted, index, written[0]))
    return found


def _unit_above(table: Table, wanted: WantedColumn, index: int) -> KnownUnit | None:
    """Return the unit that the lines above the table state for a column without one; None if they state none."""
    stated = stated_units(table, wanted)
    several = " and ".join(dict.fromkeys(f"{unit.name} (line {line})" for line, unit in stated))
    if len({unit.factor for _, unit in stated}) > 1:
        what = f"{table.label(index)} has no unit, and the lines above the table state {several}"
        raise _refused(table, wanted.quantity, index, what)
    if stated:
        line, unit = stated[0]
        return KnownUnit(unit, (f"{table.label(index)} is read in {unit.name}, which line {line} states",))
    system = stated_system(table) if wanted.measured not in ("time", "angle", "strain") else None
    if system:
        said = f"line {system[0]} states the system of units: {system[1]}"
        raise _refused(table, wanted.quantity, index, f"{table.label(index)} has no unit, and {said}")
    unknown = stated_unknown(table, wanted, index)
    if unknown:
        said = f'what line {unknown[0]} states is not a unit of {KIND[wanted.measured]}: "{unknown[1]}"'
        raise _refused(table, wanted.quantity, index, f"{table.label(index)} has no unit, and {said}")
    return None


def _says_stretch(head: Heading, wanted: WantedColumn, text: str) -> bool:
    """Whether a unit is a ratio of lengths and the name says that the column is a stretch: ``Stretch [mm/mm]``."""
    unit = tabulated_unit(text)
    plain = without(head, wanted.allowed)
    is_ratio = unit is not None and unit.name == "strain"
    return is_ratio and word_quality(plain, "stretch") > word_quality(plain, "strain")


def _read(table: Table, wanted: WantedColumn, index: int, text: str) -> Unit:
    """Return the unit that a text names, or refuse the text."""
    measured, quantity = wanted.measured, wanted.quantity
    unit = find_unit(text, measured)
    if unit is None:
        shown = f': "{text}" is not a known unit'
        number = re.match(r"\d+(?:[.,]\d+)?k?\s*(?=\D)", text)
        is_bare = re.fullmatch(r"\d+(?:[.,]\d+)?", text) is not None
        if plain_unit(text) in NO_UNIT:
            shown = " says that it has no unit"
        elif text.startswith(FACTOR):
            shown = f': the factor "{text.removeprefix(FACTOR).strip()}" is not applied'
        elif is_bare and table.names[index].count(text):
            shown = f': "{text}" may be a factor, the range of the sensor, or the number of a channel'
        elif number and find_unit(text[number.end() :], measured) is not None:
            shown = f': "{text}" may be the range of the sensor, or a factor and the unit'
        raise _refused(table, quantity, index, f"{table.label(index)}{shown}", slip(text, measured))
    if unit.measured != measured:
        # As written: "Force [KG]" is in KG.
        bare = plain_unit(text)
        name = bare if bare.lower() == unit.name.lower() else unit.name
        what = f"{table.label(index)} is in {name}, but mode {wanted.mode.name} needs a {KIND[measured]}"
        size = {
            ("strain", "length"): "gauge_length of the specimen, mm",
            ("stress", "force"): "area of the specimen, mm2",
        }
        own = size.get((measured, unit.measured), "")
        raise _refused(table, quantity, index, what, instead=f"give {own}" if own else "")
    return unit


def _doubtful(table: Table, wanted: WantedColumn, index: int, word: str, at_end: bool) -> Unit | None:
    """Return the unit that an unknown word of a name means, or refuse a word that may be a unit.

    That is a short word, one that is a unit of another quantity, or one that stands where units stand.
    """
    measured, quantity = wanted.measured, wanted.quantity
    if word == "in" and measured != "length":
        return None
    # The unit, or the smallest value; the unit, or the preposition.
    either = word.lower() == "min" or word == "in"
    unit = None if either else find_unit(word, measured)
    if unit is not None and unit.measured == measured:
        return unit
    if either or at_end or unit is not None or len(word) <= _LONGEST_UNIT or word[:1].isdigit():
        raise _refused(
            table, quantity, index, f'{table.label(index)}: it is not clear whether "{word}" is a unit'
        )
    return None


def _refused(
    table: Table, quantity: Quantity, index: int, what: str, near: str = "", instead: str = ""
) -> RecordingError:
    where = f"{table.path}:{table.header_line}" if table.header_line else table.where
    expected = instead or f'give the unit in the table of the case file: units = {{{quantity} = "..."}}'
    return RecordingError(Problem(where, what, near, expected))
