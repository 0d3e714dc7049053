"""The path of the generalised displacement, in time where time matters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cases.six import SixPath

Array = NDArray[np.float64]

# Steps of a segment of a path of six motions, at least.
FEWEST_OF_SEGMENT = 2


@dataclass(frozen=True)
class Program:
    """Targets of the march, in order.

    Attributes
    ----------
    displacement
        Generalised displacement q, shape (n,), mm or rad; the march starts from q = 0, unloaded.
    time
        Seconds, shape (n,), or None where rate does not matter.
    temperature
        Degrees C at the targets, shape (n,), where it changes along the path; None where it does not.
    corners
        Numbers of targets at which a path of six motions turns.
    """

    displacement: Array
    time: Array | None = None
    corners: frozenset[int] = frozenset()
    temperature: Array | None = None

    def __post_init__(self) -> None:
        if self.displacement.ndim != 1 or len(self.displacement) < 1:
            raise ValueError("a program needs at least one displacement")
        if self.time is not None and self.time.shape != self.displacement.shape:
            raise ValueError("a program needs a time for each displacement")
        if self.temperature is not None and self.time is None:
            raise ValueError("a temperature that changes needs times")

    def temperature_at(self, time: float) -> float | None:
        """Return the temperature (degrees C) at a time (s); None where it does not change."""
        if self.temperature is None or self.time is None:
            return None
        return float(np.interp(time, self.time, self.temperature))

    @property
    def from_rest(self) -> Program:
        """The program with rest before its first target, unless it begins there; corners are not kept."""
        q, time = self.displacement, self.time
        if q[0] == 0.0:
            return Program(q, time)
        return Program(np.concatenate([[0.0], q]), None if time is None else np.concatenate([time[:1], time]))

    def turns(self, number: int) -> bool:
        """Whether a path of six motions turns at a target, given by its number."""
        return number in self.corners


def ramp(amplitude: float, steps: int) -> Program:
    """Equal steps from zero to the amplitude (mm or rad), zero included.

    Parameters
    ----------
    amplitude : float
        End of the path, mm or rad.
    steps : int
        Number of steps.
    """
    return Program(np.linspace(0.0, amplitude, steps + 1, dtype=np.float64))


def path(points: Sequence[float], steps: int, rate: float | None = None) -> Program:
    """Straight segments through the points (mm or rad): cycles, signs, holds (a repeated point).

    Parameters
    ----------
    points : Sequence[float]
        Corners of the path, mm or rad; a leading zero is added where it is missing.
    steps : int
        Steps on the longest segment; the others get their share, at least two.
    rate : float | None
        mm/s or rad/s, which gives the times; a hold (a repeated point) has no duration then and is refused.
    """
    corners = Program(np.asarray(points, dtype=float)).from_rest.displacement
    lengths = np.abs(np.diff(corners))
    if rate is not None and not lengths.all():
        raise ValueError(
            "a hold (repeated point) has no duration at a constant rate: give the path as a file with times"
        )
    counts = np.maximum(2, np.ceil(steps * lengths / lengths.max())).astype(int)
    segments = [np.linspace(a, b, n + 1)[1:] for a, b, n in zip(corners, corners[1:], counts, strict=False)]
    q = np.concatenate([[corners[0]], *segments])
    time = None if rate is None else np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q)))]) / rate
    return Program(q, time)


def steps_along(six: SixPath, steps: int) -> Program:
    """Steps of a path of six motions: `steps` on its longest segment, proportionally fewer on the others.

    The length of a segment is the largest change on it, each motion and load as a share of its range.

    Parameters
    ----------
    six : SixPath
        The path.
    steps : int
        Number of steps on the longest segment.
    """
    knots = np.hstack([six.motion, six.loads])
    span = np.ptp(knots, axis=0)
    lengths = np.abs(np.diff(knots, axis=0) / np.where(span > 0.0, span, 1.0)).max(axis=1)
    shares = lengths / max(float(lengths.max()), 1e-300)
    counts = np.maximum(FEWEST_OF_SEGMENT, np.ceil(steps * shares)).astype(int)
    parts = [np.linspace(a, b, n + 1)[1:] for a, b, n in zip(six.time, six.time[1:], counts, strict=False)]
    times = np.unique(np.concatenate([six.time[:1], *parts]))
    corners = frozenset(int(i) for i in np.flatnonzero(np.isin(times, six.time[1:-1])))
    return Program(times, times, corners)
