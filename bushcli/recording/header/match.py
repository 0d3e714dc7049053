"""Find the columns of a table that can be a quantity, by the words of their names and by their units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bushcli.errors import RecordingError
from bushcli.recording.header.header import Heading, heading, is_unnamed, says_measured, without, word_quality
from bushcli.recording.header.quality import name_quality
from bushcli.recording.header.units import find_unit, plain_unit, tabulated_unit
from bushcli.recording.header.vocabulary import SPECIAL, is_foreign
from bushcli.recording.source import Quantity, Source
from bushcli.recording.text.table import Table
from cases.mode import Mode, modes

#: Words of a true stress, and of a true strain.
TRUE_STRESS = frozenset({"true", "wahre", "cauchy"})
TRUE_STRAIN = frozenset({"true", "wahre", "log", "logarithmic", "hencky", "logarithmische", "ln", "natural"})
#: What stands behind the name of a volume ratio, in place of a unit.
SYMBOLS = frozenset({"J", "j", "V0", "v0", "V_0", "γ", "τ"})
#: Modes of a coupon whose strain and stress along the load extensometers call axial.
_ALONG = ("uniaxial", "planar")
#: Words for a change of length that are a strain where they are in percent.
STRETCHING = frozenset(
    {"elongation", "extension", "deformation", "verformung", "verlängerung", "compression", "stauchung"}
)


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
        """Kinds of names (`WORDS`, `SPECIAL`) that the column can have."""
        if self.measured not in ("strain", "stress"):
            return (self.measured,)
        strain = self.measured == "strain"
        if self.mode.sheared:
            return ("shear", "strain") if strain else ("shear stress", "stress")
        if self.mode.needs_compressibility:
            return (
                ("volume ratio", "volume strain", "stretch", "strain") if strain else ("pressure", "stress")
            )
        return ("stretch", "strain") if strain else ("stress",)

    @staticmethod
    def of(source: Source, mode: Mode, quantity: Quantity) -> WantedColumn:
        """Return the column that a source and its mode need.

        Parameters
        ----------
        source : Source
        mode : Mode
        quantity : Quantity
        """
        measured = source.measured(quantity, mode.specimen, mode.rotational)
        allowed: frozenset[str] = frozenset()
        if measured == "stress" and source.specimen.stress == "true":
            allowed = TRUE_STRESS
        if measured == "strain" and source.specimen.strain == "true":
            allowed = TRUE_STRAIN
        if mode.sheared:
            allowed |= {"shear", "simple"}
        if mode.needs_compressibility:
            allowed |= {"hydrostatic"}
        return WantedColumn(mode, quantity, measured, allowed, source.units.get(quantity), source.accept)


def has_columns(table: Table, source: Source, mode: Mode, quantities: Sequence[Quantity]) -> bool:
    """Whether a table has, for each quantity, at least one column that may be meant.

    Parameters
    ----------
    table : Table
    source : Source
    mode : Mode
    quantities : sequence of Quantity
    """
    return all(_could_have(table, source, WantedColumn.of(source, mode, quantity)) for quantity in quantities)


def _could_have(table: Table, source: Source, wanted: WantedColumn) -> bool:
    chosen = source.columns.get(wanted.quantity)
    if isinstance(chosen, int):
        return chosen <= len(table.names)
    if chosen is not None:
        name = heading(chosen).name
        return any(heading(other).name == name for other in table.names)
    return bool(candidates(table, wanted) or by_unit(table, wanted))


def candidates(table: Table, wanted: WantedColumn) -> list[int]:
    """Return the columns whose names suit a quantity best.

    Parameters
    ----------
    table : Table
    wanted : WantedColumn
    """
    rank = [_rank(table, i, heading(name), wanted) for i, name in enumerate(table.names)]
    if not any(table.names):
        # A row of units alone identifies a column if it is unambiguous.
        units = [tabulated_unit(unit) for unit in table.units]
        rank = [int(unit is not None and unit.measured == wanted.measured) for unit in units]
    best = [i for i, q in enumerate(rank) if q == max(rank) > 0]
    # Beside "Force [N]", a column "Force [a.u.]" or "2*Force [N]" is not meant.
    if len(best) > 1 and any(_is_understood(table, i, wanted) for i in best):
        best = [i for i in best if _is_understood(table, i, wanted) or not _has_unit(table, i)]
    words = {i: set(heading(table.names[i]).words) & modes().keys() for i in best}
    # Beside "Axial Force", the mode decides which force is meant.
    own = [i for i in best if wanted.mode.name in words[i]]
    neutral = [i for i in best if not words[i]]
    return (own or neutral or best) if len(best) > 1 else best


def named_as(table: Table, wanted: WantedColumn) -> list[int]:
    """Return all columns, from 0, whose names may mean a quantity, however surely."""
    return [i for i, name in enumerate(table.names) if _rank(table, i, heading(name), wanted)]


def _is_understood(table: Table, index: int, wanted: WantedColumn) -> bool:
    """Whether a column has units, and all of them are known."""
    written = written_units(table, index, heading(table.names[index]))
    return bool(written) and all(find_unit(text, wanted.measured) is not None for text in written)


def _has_unit(table: Table, index: int) -> bool:
    return bool(written_units(table, index, heading(table.names[index])))


def by_unit(table: Table, wanted: WantedColumn) -> list[int]:
    """Return the columns in a unit of the quantity whose names do not describe it: ``Channel 3 [mm]``.

    A strain in percent must be called one of `STRETCHING`: ``Extension (%)``.

    Parameters
    ----------
    table : Table
    wanted : WantedColumn
    """
    if not any(table.names):
        return []
    found = []
    for i, name in enumerate(table.names):
        head = heading(name)
        units = [find_unit(text, wanted.measured) for text in written_units(table, i, head)]
        if wanted.measured == "strain":
            if (STRETCHING | ({"shear"} if wanted.mode.sheared else set())) & set(head.words) and [
                one and one.name for one in units
            ] == ["percent"]:
                found.append(i)
            continue
        if units and is_unnamed(head) and all(u is not None and u.measured == wanted.measured for u in units):
            found.append(i)
    return found


def identical(table: Table, columns: Sequence[int], wanted: WantedColumn) -> bool:
    """Whether several columns hold the same numbers in the same units."""
    if len({_units(table, i, wanted) for i in columns}) > 1:
        return False
    try:
        first = table.numbers(columns[0], wanted.accept)
        return all(np.array_equal(first, table.numbers(i, wanted.accept)) for i in columns[1:])
    except RecordingError:
        return False


def quality_of(head: Heading, wanted: WantedColumn) -> int:
    """Return how surely the words of a name mean a quantity, see `bushcli.recording.header.header.match_quality`."""
    plain = without(head, wanted.allowed)
    return max(
        special_quality(head, kind) if kind in SPECIAL else word_quality(plain, kind) for kind in wanted.kinds
    )


def special_quality(head: Heading, kind: str) -> int:
    """Return how surely a name means a quantity of one mode of coupons alone, a key of `SPECIAL`: as `word_quality`."""
    if any(is_foreign(word) for word in head.words if word not in ("shear", "hydrostatic")):
        return 0
    symbols = [text.lower() for text in head.written if text in SYMBOLS]
    return name_quality(" ".join([*head.words, *symbols]), kind)


def _rank(table: Table, index: int, head: Heading, wanted: WantedColumn) -> int:
    """Return how surely a column is the quantity; a name that says that the column was measured ranks higher."""
    quality = quality_of(head, wanted)
    if not quality:
        return 0
    for text in written_units(table, index, head):
        is_symbol = text in SYMBOLS and any(
            special_quality(head, kind) for kind in wanted.kinds if kind in SPECIAL
        )
        unit = None if is_symbol else find_unit(text, wanted.measured)
        if unit is not None and unit.measured != wanted.measured:
            return 0
    own = {wanted.mode.name} | ({"axial"} if wanted.mode.name in _ALONG else set())
    others = (set(head.words) & modes().keys()) - own
    if others and not own.intersection(head.words):
        # A volumetric strain is none of a uniaxial test; what a rig calls axial may be radial to the bushing.
        quality = 0 if wanted.mode.specimen == "coupon" else 1
    # If engineering and true strain are side by side, the one that the case file asks for ranks highest.
    asked = any(word in wanted.allowed for word in head.words)
    return quality and quality + (5 if says_measured(head) else 0) + (10 if asked else 0)


def written_units(table: Table, index: int, head: Heading) -> tuple[str, ...]:
    """Return the units of a column as written in its name and in the row of units."""
    row = table.units[index]
    if not plain_unit(row):
        return head.written
    return (*(heading(table.names[index], has_unit=True).written if head.written else ()), row)


def _units(table: Table, index: int, wanted: WantedColumn) -> tuple[tuple[str, float], ...]:
    """Return what the units of a column measure, with their factors; for an unknown unit its text and 0."""
    written = written_units(table, index, heading(table.names[index]))
    units = [(text, find_unit(text, wanted.measured)) for text in written]
    return tuple((text, 0.0) if unit is None else (unit.measured, unit.factor) for text, unit in units)
