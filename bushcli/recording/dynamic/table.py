"""A table of dynamic stiffness in internal units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem, RecordingError, count_of
from bushcli.recording.header.units import Unit
from bushcli.recording.quantities import CONDITIONS
from bushcli.recording.source import FaultKind

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
        conditions = [key for key in CONDITIONS if key != abscissa]
        keys = np.column_stack([levels(key, getattr(self, key)) for key in conditions])
        _, number = np.unique(keys, axis=0, return_inverse=True)
        number = number.ravel()
        first = sorted(range(number.max() + 1), key=lambda k: int(np.argmax(number == k)))
        return [np.flatnonzero(number == k) for k in first]

    @property
    def over_frequency(self) -> bool:
        """Whether the table has at least as many frequencies as amplitudes, so that its curves are over frequency."""
        count = {key: len(np.unique(levels(key, getattr(self, key)))) for key in ("frequency", "amplitude")}
        return count["frequency"] >= count["amplitude"]

    @property
    def along(self) -> Array:
        """Place (n,) of each row along its curve: the logarithm of its frequency, or of its amplitude."""
        return np.log(self.frequency if self.over_frequency else self.amplitude)


#: Values of a condition that differ by less are the same: the share of a frequency, an amplitude or a preload; kelvins,
#: because temperatures scatter by some tenths of a degree within one step of a climatic chamber (judgement).
_SHARE, _KELVINS = 0.03, 1.5


def levels(key: str, values: Array) -> Array:
    """Return the number (n,) of the level that each value belongs to: sorted values closer together than a step.

    Parameters
    ----------
    key : str
        A condition.
    values : shape (n,)
        In internal units; those that are nan belong to level -1.
    """
    unknown = np.isnan(values)
    order = np.argsort(values[~unknown], kind="stable")
    known = values[~unknown][order]
    wide = np.diff(known) > (_KELVINS if key == "temperature" else _SHARE * np.abs(known[1:]))
    number = np.full(len(values), -1.0)
    number[np.flatnonzero(~unknown)[order]] = np.concatenate([[0.0], np.cumsum(wide)])[: len(known)]
    return number


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
