"""A table of dynamic stiffness in internal units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError, count_of
from bushcli.recording.quantities import CONDITIONS
from bushcli.recording.source import FaultKind

if TYPE_CHECKING:
    # Its tables of spellings serve recordings alone.
    from bushcli.recording.header.units import Unit

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: A text, or what gives it by the index of a row.
Text = str | Callable[[int], str]
Quantity = Literal["stiffness", "E", "G"]


@dataclass(frozen=True, eq=False)
class DynamicTable:
    """Complex stiffness at conditions, one row each, in internal units; nan where a condition is not given.

    Attributes
    ----------
    name : str
        Name of the channel.
    mode : str
    quantity : {"stiffness", "E", "G"}
        Stiffness of a bushing, or modulus of a coupon.
    frequency : shape (n,)
        Hz.
    storage, loss : shape (n,)
        K' and K'' in N/mm or N mm/rad; E', E'' or G', G'' in MPa.
    amplitude : shape (n,)
        Peak, in mm, rad or strain; nan if it is small or unknown.
    preload : shape (n,)
        mm, rad or strain.
    preload_force : shape (n,)
        N, N mm or MPa.
    temperature : shape (n,)
        Degrees C.
    storage_error, loss_error : shape (n,)
        Standard errors, in the units of storage and loss; nan where they are not known.
    third_harmonic : shape (n,)
        Third harmonic of the force as a share of the first; nan where it was not measured.
    files : tuple of Path
    places : tuple of str
        File and line, or file and times, of each row.
    remarks : tuple of str
        How the files were read, and what was understood from them.
    accepted_faults : tuple of FaultKind
        Kinds of faults that the case file says are none.
    amplitude_is : {"peak", "double", ""}
        What the amplitudes of its files were taken for; empty where they were computed, or differ between the files.
    units : mapping of str to Unit
        Units of the measured columns, by their key in ``units`` of the case file.
    """

    name: str
    mode: str
    quantity: Quantity
    frequency: Array
    storage: Array
    loss: Array
    amplitude: Array
    preload: Array
    preload_force: Array
    temperature: Array
    storage_error: Array
    loss_error: Array
    third_harmonic: Array
    files: tuple[Path, ...] = ()
    places: tuple[str, ...] = field(default=(), repr=False)
    remarks: tuple[str, ...] = ()
    accepted_faults: tuple[FaultKind, ...] = ()
    amplitude_is: Literal["peak", "double", ""] = ""
    units: Mapping[str, Unit] = field(default_factory=dict)

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.frequency)

    @property
    def stiffness(self) -> Array:
        """|K*| (n,), in N/mm, N mm/rad or MPa."""
        return np.hypot(self.storage, self.loss)

    @property
    def loss_angle(self) -> Array:
        """Loss angle (n,), rad."""
        return np.arctan2(self.loss, self.storage)

    def rows(self, index: NDArray[np.bool_] | NDArray[np.intp]) -> DynamicTable:
        """Return a table of some of the rows.

        Parameters
        ----------
        index : (n,) array of bool, or array of int
            Mask or indices of the rows.
        """
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        values |= {key: value[index] for key, value in values.items() if isinstance(value, np.ndarray)}
        values["places"] = tuple(np.array(self.places, dtype=object)[index]) if self.places else ()
        return DynamicTable(**values)

    def conditions(self) -> list[NDArray[np.intp]]:
        """Return the rows of each curve: those of equal amplitude, preload and temperature, or of equal frequency.

        A frequency sweep is a curve over frequency at one amplitude, an amplitude sweep one over amplitude at one
        frequency; the rows of either are in the order of the file.
        """
        return self._curves("frequency" if self.over_frequency else "amplitude")

    def sweeps(self) -> list[NDArray[np.intp]]:
        """Return the rows of each sweep over amplitude in the order of the file; none if a row has no amplitude."""
        return [] if np.isnan(self.amplitude).any() else self._curves("amplitude")

    def _curves(self, abscissa: str) -> list[NDArray[np.intp]]:
        """Return the rows that agree in all conditions but one, in the order of the file."""
        keys = np.column_stack([self.levels(key) for key in CONDITIONS if key != abscissa])
        _, number = np.unique(keys, axis=0, return_inverse=True)
        number = number.ravel()
        first = sorted(range(number.max(initial=-1) + 1), key=lambda k: int(np.argmax(number == k)))
        return [np.flatnonzero(number == k) for k in first]

    def levels(self, key: str) -> NDArray[np.intp]:
        """Return the number (n,) of the level of a condition that each row belongs to, rising; -1 if it is unknown.

        A level begins where a value differs from the next smaller one by more than rigs scatter.

        Parameters
        ----------
        key : {"frequency", "amplitude", "preload", "preload_force", "temperature"}
        """
        values = getattr(self, key)
        steps, size = steps_of_levels(key, values), np.abs(values)
        if key == "frequency":
            # A dense sweep has no gaps: from the smallest of the level on.
            return level_numbers(values, 0.0, steps)
        if key == "amplitude":
            return level_numbers(values, steps, _UNEVEN * size)
        if key in ("preload", "preload_force") and _is_measured(values):
            # What the vibration itself adds to the preload and takes from it.
            passed = self.amplitude * (self.stiffness if key == "preload_force" else 1.0)
            known = passed[~np.isnan(passed)]
            gap = float(np.median(np.diff(np.sort(values[~np.isnan(values)]))))
            most = _PASSED * float(np.median(known)) if len(known) else 0.0
            steps = np.maximum(steps, np.clip(most, _APART * gap, _FAR * gap))
        return level_numbers(values, steps)

    def levelled(self, key: Literal["preload", "preload_force"]) -> Array:
        """Return the preload (n,) in which all rows of a level have its mean; zero if that is within their scatter.

        Parameters
        ----------
        key : {"preload", "preload_force"}
            mm or rad, or N or N mm.
        """
        values, number = getattr(self, key).copy(), self.levels(key)
        step = _OF_LARGEST * np.nan_to_num(np.abs(values)).max(initial=0.0)
        for k in range(number.max(initial=-1) + 1):
            own, mean = values[number == k], float(values[number == k].mean())
            about_zero = abs(mean) < step or own.min() < 0.0 < own.max()
            values[number == k] = 0.0 if about_zero else mean
        return values

    @property
    def over_frequency(self) -> bool:
        """Whether the table has at least as many frequencies as amplitudes, so that its curves are over frequency."""
        count = {key: len(np.unique(self.levels(key))) for key in ("frequency", "amplitude")}
        return count["frequency"] >= count["amplitude"]

    @property
    def along(self) -> Array:
        """Place (n,) of each row along its curve: the logarithm of its frequency, or of its amplitude."""
        return np.log(self.frequency if self.over_frequency else self.amplitude)


#: Values of a condition that differ by less are one level: the share of a frequency, an amplitude or a preload, and of
#: the table's largest preload (rigs scatter by a per cent about what is asked); kelvins, because temperatures scatter
#: by some tenths of a degree within one step of a climatic chamber (judgement).
_SHARE, _OF_LARGEST, _KELVINS = 0.03, 0.02, 1.5
#: Values of one level lie within this share of an amplitude, of which filled rubber softens by some 1 % (judgement).
_UNEVEN = 0.07
#: Of preloads that were measured a level begins at a gap of this share of the vibration, which passes through so much
#: in each cycle, but of no less and no more than so many times the median gap (judgement). Of 300 drawn tables with a
#: mean force that scatters by 2 N in a vibration of 20 N, 298 have one level about zero; by shares of the values each
#: row was a level, and no wrong row was found. Of 300 with 0, 50 and 100 N in a vibration of 200 N all have three.
_PASSED, _APART, _FAR = 0.2, 10.0, 50.0


def _is_measured(values: Array) -> bool:
    """Whether most values (n,) occur once, as measured ones do; what a file states is repeated."""
    known = values[~np.isnan(values)]
    _, counts = np.unique(known, return_counts=True)
    return len(known) > 1 and 2 * int(counts[counts > 1].sum()) < len(known)


def steps_of_levels(key: str, values: Array) -> Array:
    """Return by how much (n,) values of a condition differ at least from the next smaller ones, if they are two levels.

    Parameters
    ----------
    key : str
        A condition.
    values : shape (n,)
        In internal units.
    """
    if key == "temperature":
        return np.full(len(values), _KELVINS)
    size = np.abs(values)
    least = _OF_LARGEST * np.nan_to_num(size).max(initial=0.0) if key in ("preload", "preload_force") else 0.0
    return np.maximum(_SHARE * size, least)


def level_numbers(values: Array, step: Array | float, span: Array | float = 0.0) -> NDArray[np.intp]:
    """Return the number (n,) of the level of each value, rising; -1 where it is nan.

    Parameters
    ----------
    values : shape (n,)
    step, span : float or (n,) array
        A value begins a level where it is larger than the one before it by more than a step, and than the smallest of
        its level by more than a span.
    """
    steps, spans = np.broadcast_to(step, values.shape), np.broadcast_to(span, values.shape)
    numbers = np.full(len(values), -1)
    number, first, before = -1, -np.inf, -np.inf
    for row in np.argsort(values, kind="stable")[: np.count_nonzero(~np.isnan(values))]:
        if values[row] - before > steps[row] and values[row] - first > spans[row]:
            number, first = number + 1, values[row]
        numbers[row], before = number, values[row]
    return numbers


def temperature_levels(degrees: Array) -> list[NDArray[np.intp]]:
    """Return the rows of each temperature, rising, of temperatures (n,) in degrees C."""
    numbers = level_numbers(degrees, _KELVINS)
    return [np.flatnonzero(numbers == k) for k in range(numbers.max() + 1)]


def refuse_rows(bad: Mask, places: Sequence[str], what: Text, remedy: str, more: bool = False) -> None:
    """Refuse the first of the rows (n,) that are bad, and say how many more are, if that is wanted."""
    if bad.any():
        row, count = int(np.argmax(bad)), int(np.count_nonzero(bad)) - 1
        rest = f", and likewise in {count_of(count, 'more row')}" if more and count else ""
        text = what if isinstance(what, str) else what(row)
        raise RecordingError(Problem(places[row], text + rest, "", remedy))


@dataclass(frozen=True)
class TablePart:
    """Rows of one file, or of a group of its columns: arrays (n,) by name, in internal units."""

    arrays: Mapping[str, Array]
    places: tuple[str, ...]
    remarks: tuple[str, ...] = ()
    modulus: Literal["E", "G", ""] = ""
    amplitude_is: Literal["peak", "double", ""] = ""
    units: Mapping[str, Unit | None] = field(default_factory=dict)
