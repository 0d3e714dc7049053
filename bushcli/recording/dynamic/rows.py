"""A table of dynamic stiffness as a recording: rows of magnitude and loss angle in units of their standard errors.

Everything that judges a misfit takes it like a recorded curve. With K* turned back by the measured loss angle, the real
part is the magnitude, and the imaginary part the magnitude times the deviation of the angle, to first order; each is
divided by the standard error of its row. Where a table states none, the scatter of the rows about the smooth curves
that they belong to gives it, beside what is usual for a rig.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.recording import Recording
from bushcli.recording.dynamic.table import DynamicTable

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Standard errors of rows for which a table states none: usual for a servo-hydraulic rig (judgement).
MAGNITUDE, ANGLE = 0.01, np.radians(0.3)
# Least standard errors that are estimated: no rig repeats a stiffness or a phase more closely (judgement).
_LEAST = (1e-3, np.radians(0.03))
# Largest standard errors: five times the usual ones, with which a table would say nothing about rubber (judgement).
_MOST = (5.0 * MAGNITUDE, 5.0 * ANGLE)
# Neighbouring rows of a curve that lie on a cubic but for their noise; degrees of freedom of its size for each further
# row, because differences that overlap say less (0.6 for third differences: Hall, Kay and Titterington 1990,
# doi:10.1093/biomet/77.3.521).
_ROWS, _FREEDOM = 5, 0.6
# Degrees of freedom of what is usual (standard deviation of the logarithm of 1: a factor of e), and of stated errors.
_USUAL, _STATED = 0.5, 25.0
#: Ratio of the largest to the smallest amplitude of a table from which its rows are not all small.
SPREAD = 1.5
# Time between samples of a dynamic rig over the shortest period (judgement).
SAMPLED = 0.01
# Rows of a part that is held out: a fifth of a decade to a half, as rigs space frequencies.
_PART = 4


@dataclass(frozen=True)
class RecordedTable(Recording):
    """A table of n rows as a recording of 2 n samples, which has no path and no time.

    ``force`` is the magnitudes over their standard errors, and zeros for the loss angles; ``displacement`` the preload,
    in mm or rad, about that where it is a force.

    Attributes
    ----------
    table : DynamicTable
    errors : shape (2, n)
        Standard errors of ln |K*| and of the loss angle, rad.
    freedom : float
        Degrees of freedom of their variance.
    """

    table: DynamicTable = field(kw_only=True)
    errors: Array = field(kw_only=True)
    freedom: float = field(kw_only=True)

    @property
    def kind(self) -> Literal["static", "dynamic"]:
        """Kind of the channel."""
        return "dynamic"

    @property
    def has_time(self) -> bool:
        """Whether rates are known: a frequency is one."""
        return True

    @property
    def largest(self) -> tuple[float, float]:
        """Largest preload or amplitude, mm or rad, and the force that the largest stiffness has there, N or N mm."""
        stiffness = float(self.table.stiffness.max())
        largest = [float(np.nan_to_num(np.abs(v)).max()) for v in (self.displacement, self.table.amplitude)]
        travel = max(largest) or 1.0
        return travel, stiffness * travel

    @property
    def span(self) -> tuple[float, float]:
        """A hundredth of the shortest period, as rigs sample it, and the longest period, s."""
        return SAMPLED / float(self.table.frequency.max()), 1.0 / float(self.table.frequency.min())

    @property
    def has_amplitudes(self) -> bool:
        """Whether rows of different amplitudes can be compared."""
        amplitudes = self.table.amplitude[~np.isnan(self.table.amplitude)]
        return bool(len(amplitudes) and amplitudes.max() > SPREAD * amplitudes.min())

    @property
    def most_noise(self) -> float:
        """Largest factor, one at least, on the standard errors of all rows with which a rig may still scatter."""
        return max(1.0, float((np.array(_MOST) / np.median(self.errors, axis=1)).min()))

    @property
    def times(self) -> tuple[float, float]:
        """Relaxation times between which the rows show them best, s: the reciprocal angular frequencies."""
        turn, frequency = 0.5 / np.pi, self.table.frequency
        return turn / float(frequency.max()), turn / float(frequency.min())

    def with_gaps_interpolated(self, used: NDArray[np.bool_]) -> RecordedTable:
        """Return the recording as it is: rows do not follow one another.

        Parameters
        ----------
        used : (2 n,) array of bool
        """
        return self

    def rows(self, stiffness: Complex) -> Array:
        """Return the samples (2 n, ...) of simulated stiffness (n, ...), or of its derivatives.

        Parameters
        ----------
        stiffness : shape (n, ...)
            N/mm or N mm/rad.
        """
        turn = np.exp(-1j * self.table.loss_angle) / self.table.stiffness
        turned = (stiffness.T * turn).T
        return np.concatenate([(turned.real.T / self.errors[0]).T, (turned.imag.T / self.errors[1]).T])

    def stiffness(self, samples: Array) -> Complex:
        """Return the stiffness (n,), N/mm or N mm/rad, that has these samples (2 n,)."""
        along, across = samples.reshape(2, -1) * self.errors
        turned = (along + 1j * across) * self.table.stiffness
        return np.asarray(turned * np.exp(1j * self.table.loss_angle), dtype=np.complex128)

    def parts(self) -> list[int]:
        """Return the number of the part of each sample (2 n,): neighbouring rows of a curve, of which a few have many.

        One can be held out and predicted from the others.
        """
        number, count = np.zeros(len(self.table), dtype=int), 0
        for rows, place in self.curves():
            pieces = max(1, len(rows) // _PART)
            order = rows[np.argsort(place, kind="stable")]
            number[order] = count + np.arange(len(rows)) * pieces // len(rows)
            count += pieces
        return [int(piece) for piece in np.tile(number, 2)]

    def curves(self) -> list[tuple[NDArray[np.intp], Array]]:
        """Return the rows of each curve, and their places along it: logarithms of frequency or amplitude."""
        along = self.table.along
        return [(rows, along[rows]) for rows in self.table.conditions()]


def recorded_table(table: DynamicTable, faulty: NDArray[np.bool_] | None = None) -> RecordedTable:
    """Return a table as a recording.

    Parameters
    ----------
    table : DynamicTable
        n rows.
    faulty : (n,) array of bool, optional
        Rows that do not count.
    """
    scatter, count = _scatter(table, np.ones(len(table), dtype=bool) if faulty is None else ~faulty)
    usual, least = np.array([MAGNITUDE, ANGLE]), np.array(_LEAST)
    measured = scatter > 0.0
    # Both are estimates of a logarithm.
    logs = np.where(measured, np.log(np.where(measured, scatter, 1.0)), 0.0) * count + np.log(usual) * _USUAL
    size = np.maximum(np.exp(logs / (np.where(measured, count, 0.0) + _USUAL)), least)
    errors = np.repeat(size[:, None], len(table), axis=1)
    cosine, sine = np.cos(table.loss_angle), np.sin(table.loss_angle)
    along = np.hypot(cosine * table.storage_error, sine * table.loss_error)
    across = np.hypot(sine * table.storage_error, cosine * table.loss_error)
    stated = (along > 0.0) & (across > 0.0)
    errors[:, stated] = np.array([along, across])[:, stated] / table.stiffness[stated]
    force = np.concatenate([1.0 / errors[0], np.zeros(len(table))])
    by_force = np.nan_to_num(table.preload_force) / table.stiffness.max()
    return RecordedTable(
        table.mode,
        np.tile(np.where(np.isnan(table.preload), by_force, table.preload), 2),
        force,
        name=table.name,
        source=table.files[0] if table.files else None,
        accepted_faults=table.accepted_faults,
        table=table,
        errors=errors,
        freedom=_STATED if stated.all() else float(count) + _USUAL,
    )


def _scatter(table: DynamicTable, used: NDArray[np.bool_]) -> tuple[Array, float]:
    """Return the scatter (2,) of ln |K*| and loss angle about smooth curves, zero if unknown; degrees of freedom."""
    place = table.along
    values = np.column_stack([np.log(table.stiffness), table.loss_angle])
    squares: list[Array] = []
    for rows in table.conditions():
        rows = rows[used[rows] & np.isfinite(place[rows])]
        rows = rows[np.argsort(place[rows], kind="stable")]
        for i in range(len(rows) - _ROWS + 1):
            near = rows[i : i + _ROWS]
            x = place[near] - place[near].mean()
            if np.diff(x).min() <= 1e-9:
                continue
            # The combination of these rows that a cubic does not change, of unit noise.
            weights = np.linalg.svd(np.vander(x / np.abs(x).max(), _ROWS - 1))[0][:, -1]
            squares.append((weights @ values[near]) ** 2)
    if not squares:
        return np.zeros(2), 0.0
    return np.sqrt(np.mean(squares, axis=0)), _FREEDOM * len(squares)
