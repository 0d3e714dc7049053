"""Find the columns of a table that can be a quantity, by the words of their names and by their units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bushcli.errors import Problem, RecordingError
from bushcli.recording.header.name import SYMBOLS, Heading, heading
from bushcli.recording.header.units import Unit, find_unit, plain_unit, tabulated_unit
from bushcli.recording.header.vocabulary import MEASURED_WORDS
from bushcli.recording.quantities import SPECIAL, STATIC, word_set
from bushcli.recording.source import Quantity, Source
from bushcli.recording.text.table import Table
from cases.mode import Mode, modes

#: Words of a true stress or a true strain.
EITHER_TRUE = STATIC["stress"].true | STATIC["strain"].true
#: Modes of a coupon whose strain and stress along the load extensometers call axial.
_ALONG = ("uniaxial", "planar")
#: Beginnings of German compounds, and the modes that they mean: Axialweg, Torsionsmoment, Kardanwinkel.
_COMPOUNDS = {"axial": "axial", "radial": "radial", "torsion": "torsional", "kardan": "conical"}
#: Words for a change of length that are a strain where they are in percent.
_STRETCHING = word_set("elongation extension deformation verformung verlängerung compression stauchung")


@dataclass(frozen=True)
class WantedColumn:
    """A column to be found: a quantity of a mode, its key of `UNITS`, and words of the name that are ignored."""

    mode: Mode
    quantity: Quantity
    measured: str
    allowed: frozenset[str] = frozenset()
    given: str | None = None
    accept: tuple[float, ...] = ()

    @property
    def kinds(self) -> tuple[str, ...]:
        """Quantities of `STATIC` and `SPECIAL` whose names the column can have."""
        test = self.mode.name, self.measured
        special = (kind for kind, each in SPECIAL.items() if (each.test, each.measured) == test)
        stretch = ("stretch",) if self.measured == "strain" and not self.mode.sheared else ()
        return (*special, *stretch, self.measured)

    @staticmethod
    def of(source: Source, quantity: Quantity) -> WantedColumn:
        """Return the column that a source and its mode need.

        Parameters
        ----------
        source : Source
        quantity : Quantity
        """
        mode, measured = source.deformation, source.dimension(quantity)
        form = {"stress": source.specimen.stress, "strain": source.specimen.strain}.get(measured)
        allowed = STATIC[measured].true if form == "true" else frozenset[str]()
        allowed |= {"shear", "simple"} if mode.sheared else set()
        allowed |= {"hydrostatic"} if mode.needs_compressibility else set()
        return WantedColumn(mode, quantity, measured, allowed, source.units.get(quantity), source.accept)

    def quality(self, head: Heading) -> int:
        """Return how surely the words of a name mean it, see `bushcli.recording.header.name.match_quality`."""
        plain = head.without(self.allowed)
        return max((head if kind in SPECIAL else plain).quality(kind) for kind in self.kinds)

    def is_special(self, head: Heading) -> bool:
        """Whether a name means it in the test of its own mode alone."""
        return any(head.quality(kind) for kind in self.kinds if kind in SPECIAL)


@dataclass(frozen=True)
class NamedColumn:
    """A column of a table, its index from 0, as what it may be: what its name means, and its units."""

    table: Table
    index: int
    wanted: WantedColumn

    @property
    def head(self) -> Heading:
        """The parts of its name."""
        return heading(self.table.names[self.index])

    @property
    def label(self) -> str:
        """Its name in messages."""
        return self.table.label(self.index)

    @property
    def written_units(self) -> tuple[str, ...]:
        """Its units as written in its name and in the row of units."""
        row = self.table.units[self.index]
        has_row = plain_unit(row) != ""
        texts = self.head.written and heading(self.table.names[self.index], has_row).written
        return (*texts, row) if has_row else texts

    @property
    def units(self) -> list[Unit | None]:
        """What these mean; None for an unknown one."""
        return [find_unit(text, self.wanted.measured) for text in self.written_units]

    @property
    def is_understood(self) -> bool:
        """Whether it has units, and all of them are known."""
        return bool(self.written_units) and None not in self.units

    @property
    def rank(self) -> int:
        """How surely it is the quantity by its name; one that says that it was measured ranks higher."""
        wanted, words = self.wanted, set(self.head.words)
        special = wanted.is_special(self.head)
        pairs = zip(self.written_units, self.units, strict=True)
        units = [unit for text, unit in pairs if not (special and text in SYMBOLS)]
        directions = {wanted.mode.name} | ({"axial"} if wanted.mode.name in _ALONG else set())
        quality = wanted.quality(self.head)
        if words & modes().keys() and directions.isdisjoint(words):
            # A volumetric strain is none of a uniaxial test; what a rig calls axial may be radial to the bushing.
            quality = min(quality, 0 if wanted.mode.specimen == "coupon" else 1)
        foreign = any(unit is not None and unit.measured != wanted.measured for unit in units)
        # If engineering and true strain are side by side, the one that the case file asks for ranks highest.
        more = 5 * (not MEASURED_WORDS.isdisjoint(words)) + 10 * (not wanted.allowed.isdisjoint(words))
        return quality + more if quality and not foreign else 0

    def refusal(self, what: str, near: str = "", instead: str = "") -> RecordingError:
        """Return the error about its unit; the remedy is to give the unit, or what stands `instead`."""
        table = self.table
        where = f"{table.path}:{table.header_line}" if table.header_line else table.where
        expected = f'give the unit in the table of the case file: units = {{{self.wanted.quantity} = "..."}}'
        return RecordingError(Problem(where, f"{self.label}{what}", near, instead or expected))


def columns_as(table: Table, wanted: WantedColumn) -> list[NamedColumn]:
    """Return all columns of a table as what they may be."""
    return [NamedColumn(table, index, wanted) for index in range(len(table.names))]


def has_columns(table: Table, source: Source, quantities: Sequence[Quantity]) -> bool:
    """Whether a table has, for each quantity, at least one column that may be meant.

    Parameters
    ----------
    table : Table
    source : Source
    quantities : sequence of Quantity
    """
    for quantity in quantities:
        wanted, chosen = WantedColumn.of(source, quantity), source.columns.get(quantity)
        if chosen is None:
            is_there = bool(candidates(table, wanted) or columns_by_unit(table, wanted))
        elif isinstance(chosen, int):
            is_there = chosen <= len(table.names)
        else:
            is_there = heading(chosen).name in {heading(name).name for name in table.names}
        if not is_there:
            return False
    return True


def candidates(table: Table, wanted: WantedColumn) -> list[int]:
    """Return the columns whose names suit a quantity best.

    Parameters
    ----------
    table : Table
    wanted : WantedColumn
    """
    columns = columns_as(table, wanted)
    rank = [column.rank for column in columns]
    if not any(table.names):
        # A row of units alone identifies a column if it is unambiguous.
        units = map(tabulated_unit, table.units)
        rank = [int(unit is not None and unit.measured == wanted.measured) for unit in units]
    best = [column for column, quality in zip(columns, rank, strict=True) if quality == max(rank) > 0]
    # Beside "Force [N]", a column "Force [a.u.]" or "2*Force [N]" is not meant.
    if any(column.is_understood for column in best):
        best = [c for c in best if c.is_understood or not c.written_units or len(best) == 1]
    # Beside "Axial Force", the mode decides which force is meant.
    of_mode = [column.index for column in best if wanted.mode.name in named_modes(column.head)]
    neutral = [column.index for column in best if not named_modes(column.head)]
    every_best = [column.index for column in best]
    return (of_mode or neutral or every_best) if len(best) > 1 else every_best


def named_modes(head: Heading) -> set[str]:
    """Return the modes that the words of a name mean, alone or as the beginning of a German compound: Radialkraft."""
    named = modes().keys() & set(head.words)
    return named | {
        mode for start, mode in _COMPOUNDS.items() if any(word.startswith(start) for word in head.words)
    }


def columns_by_unit(table: Table, wanted: WantedColumn) -> list[int]:
    """Return the columns in a unit of the quantity whose names do not describe it: ``Channel 3 [mm]``.

    A strain in percent must be called a change of length: ``Extension (%)``.

    Parameters
    ----------
    table : Table
    wanted : WantedColumn
    """
    stretching = _STRETCHING | ({"shear"} if wanted.mode.sheared else set())

    def fits(column: NamedColumn) -> bool:
        names = [unit and unit.name for unit in column.units]
        if wanted.measured == "strain":
            return names == ["percent"] and not stretching.isdisjoint(column.head.words)
        are_suited = all(unit is not None and unit.measured == wanted.measured for unit in column.units)
        return bool(names) and are_suited and column.head.is_unnamed

    return [column.index for column in columns_as(table, wanted) if fits(column)] if any(table.names) else []


def are_identical(table: Table, columns: Sequence[int], wanted: WantedColumn) -> bool:
    """Whether several columns hold the same numbers in the same units."""

    def units(index: int) -> tuple[object, ...]:
        column = NamedColumn(table, index, wanted)
        pairs = zip(column.written_units, column.units, strict=True)
        return tuple((unit.measured, unit.factor) if unit else text for text, unit in pairs)

    try:
        numbers = [table.numbers(index, wanted.accept) for index in columns]
    except RecordingError:
        return False
    return len(set(map(units, columns))) == 1 and all(np.array_equal(numbers[0], v) for v in numbers[1:])
