"""How an effect changes the curve of a rig, as functions of signals that carry their derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Signal:
    """Samples (or one number) with their derivatives by all parameters of interest: forward differentiation.

    Attributes
    ----------
    value : (n,) array, or a number
    slope : (n, P) array, or (P,) of a number
        Derivative by each parameter, in an order that all signals of a computation share.
    """

    value: Array
    slope: Array

    def __add__(self, other: Signal) -> Signal:
        return Signal(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: Signal) -> Signal:
        return Signal(self.value - other.value, self.slope - other.slope)

    def __mul__(self, other: Signal) -> Signal:
        a, b = np.asarray(self.value)[..., None], np.asarray(other.value)[..., None]
        return Signal(self.value * other.value, self.slope * b + a * other.slope)

    def where(self, condition: NDArray[np.bool_]) -> Signal:
        """Return the samples at which the condition (n,) holds, zeros elsewhere."""
        return Signal(np.where(condition, self.value, 0.0), np.where(condition[:, None], self.slope, 0.0))

    def at_samples(self, index: NDArray[np.intp]) -> Signal:
        """Return the samples ``index``, any number of them in any order."""
        return Signal(self.value[index], self.slope[index])


Given = Mapping[str, Signal]
"""Values of an effect's parameters by name, each one number with its derivatives."""


@dataclass(frozen=True)
class RigChange:
    """Change that an effect makes to the curve; `bushcli.effects.rig` combines the changes of all effects.

    The displacement of the rig goes through every ``drive``, then is shared between the bushing and the springs in
    series; the bushing's force goes through every ``parallel``, is logged late by every ``clock`` and goes through
    every ``read``. Effects of lower ``order`` come first.

    Attributes
    ----------
    zero : str
        Name of the parameter that is the displacement at which the rig was set to zero, where it is used: both signals
        count from there.
    drive : callable, optional
        ``drive(q, given) -> Signal``: displacement (n,) behind the effect, from that in front of it, along the path.
    parallel : callable, optional
        ``parallel(q, force, time, given) -> Signal``: force that moves the bushing by q, from the force without the
        effect. It acts on each sample by itself.
    spring : callable, optional
        ``spring(force, given) -> Signal``: extension of a spring in series, mm or rad, that carries the force (n,). It
        is zero without force and never falls as the force grows.
    clock : str, optional
        Name of the parameter that is the time by which the force is logged late.
    read : callable, optional
        ``read(force, time, given) -> Signal``: force as it is logged.
    vibrate : callable, optional
        ``vibrate(omega, given) -> (factor, added)``: in a table of dynamic stiffness K* becomes factor K* + added, real
        signals (n,) at angular frequencies (n,) in rad/s; added in N/mm or N mm/rad.
    order : int

    Notes
    -----
    ``time`` (n,) is that of the samples, s since the recording started; None if the recording has no time, which does
    not occur for an effect that ``needs_time``.
    """

    zero: str = ""
    drive: Callable[[Signal, Given], Signal] | None = None
    parallel: Callable[[Signal, Signal, Array | None, Given], Signal] | None = None
    spring: Callable[[Signal, Given], Signal] | None = None
    clock: str | None = None
    read: Callable[[Signal, Array | None, Given], Signal] | None = None
    vibrate: Callable[[Array, Given], tuple[Signal, Signal]] | None = None
    order: int = 0

    @property
    def moves(self) -> bool:
        """Whether the bushing's own displacement, or the time of its force, is another than the recorded one."""
        return self.zero != "" or self.drive is not None or self.spring is not None or self.clock is not None
