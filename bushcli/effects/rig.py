"""The curve that a rig logs: the changes by all effects of a channel, combined, with exact derivatives.

The displacement that the rig records passes through offset, free play and permanent set, then is shared between the
bushing and the springs in series with it. The bushing's force is scaled, joined by that of stops beside it, carried by
the springs, logged late and read with an offset. If the rig was set to zero under a preload, both count from there: the
force at recorded zero is subtracted (`is_zeroed`). Every input may depend on parameters: derivatives by all ``columns``
(names such as "C10" and "rig_compliance.compliance") are carried along, those of the law included.

In all functions ``active`` are the effects of one channel, all parameters given, and ``columns`` the full names of the
P parameters by which derivatives are wanted, in the order of the derivatives.

`elastic_response` does everything for a force that is a function of the displacement. A force with a history is
marched elsewhere: `bushing_path` gives the displacement that drives it, `extension` and `parallel` the springs in
series and the forces beside it, and `force_reading` the logged force. `measured_stiffness` gives the stiffness of small
vibrations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bushcli.effects.active import ActiveEffect
from bushcli.effects.change import Given, RigChange, Signal

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Response = Callable[[Array], tuple[Array, Array, Array]]
"""Displacement (n,) -> force (n,), stiffness dF/dq (n,), derivative by each column at fixed displacement (n, P)."""

# A Newton step from here squares the error, to below the rounding of the force.
_CLOSE = 1e-12
# Bisection alone, if no Newton step helps, needs 60 steps from the whole travel to its rounding error.
_MOST_STEPS = 200
# Step, as a share of the recording, of the central difference for a marched force's rate (for derivatives by a lag).
_LAG_DIFFERENCE = 1e-6


# A column of derivatives that is none by a parameter: that by the displacement or by the force.
_SLOPE = "slope"
# Step of the central difference of a slope by the force or the displacement, relative, or in N, mm or rad: springs and
# stops are linear or quadratic in them, where it is exact to rounding.
_NEAR = 1e-4


class NoEquilibrium(ArithmeticError):
    """No displacement of the bushing was found at which it and the spring in series carry the same force."""


def bushing_path(active: Sequence[ActiveEffect], recorded: Array, columns: Sequence[str]) -> Signal:
    """Return the displacement (n,) of the bushing together with the springs in series, with derivatives (n, P).

    Parameters
    ----------
    active : sequence of ActiveEffect
    recorded : shape (n,)
        Displacement of the rig, mm or rad, in the order of the recording.
    columns : sequence of str
    """
    changes = _changes(active, columns)
    q = Signal(recorded, np.zeros((len(recorded), len(columns))))
    for change, parameters in changes:
        if change.zero in parameters:
            q = q + parameters[change.zero]
    for change, parameters in changes:
        if change.drive is not None:
            q = change.drive(q, parameters)
    return q


def is_zeroed(active: Sequence[ActiveEffect]) -> bool:
    """Whether the rig was set to zero under a preload, which the path then has to begin with."""
    return any(change.zero in parameters for change, parameters in _changes(active, ()))


def extension(active: Sequence[ActiveEffect], force: Signal, columns: Sequence[str]) -> Signal:
    """Return the extension (n,) of all springs in series, mm or rad, with its derivatives (n, P).

    Parameters
    ----------
    active : sequence of ActiveEffect
    force : Signal
        Force that they carry (n,), N or N mm, with derivatives (n, P).
    columns : sequence of str
    """
    total = Signal(np.zeros_like(force.value), np.zeros_like(force.slope))
    for change, parameters in _changes(active, columns):
        if change.spring is not None:
            total = total + change.spring(force, parameters)
    return total


def has_springs(active: Sequence[ActiveEffect], columns: Sequence[str]) -> bool:
    """Whether springs in series give way, or derivatives by their compliance are wanted.

    Parameters
    ----------
    active : sequence of ActiveEffect
    columns : sequence of str
    """
    elongation = extension(active, Signal(np.ones(1), np.zeros((1, len(columns)))), columns)
    return bool(np.any(elongation.value) or np.any(elongation.slope))


def parallel(
    active: Sequence[ActiveEffect],
    q: Signal,
    force: Signal,
    columns: Sequence[str],
    time: Array | None = None,
) -> Signal:
    """Add the forces of everything that stands beside the bushing, sample by sample.

    Parameters
    ----------
    active : sequence of ActiveEffect
    q : Signal
        Displacement of the bushing (n,), mm or rad, with derivatives (n, P).
    force : Signal
        Force of the bushing alone (n,), N or N mm, with derivatives (n, P). For the stiffness add a column of any other
        name, in which the slope of q is 1 and that of the force dF/dq.
    columns : sequence of str
    time : (n,) array or None
        Seconds since the start of the recording.
    """
    for change, parameters in _changes(active, columns):
        if change.parallel is not None:
            force = change.parallel(q, force, time, parameters)
    return force


def force_reading(
    active: Sequence[ActiveEffect],
    time: Array | None,
    force: Signal,
    columns: Sequence[str],
    at: Array | None = None,
    corners: Sequence[int] = (),
) -> Signal:
    """Return the force as it is logged, with derivatives.

    Between the times the force is a cubic with parabolic slopes: continuous with its rate, and linear in the forces.
    Before the first time and after the last it is constant. Where the rate is discontinuous (at the ends, at
    ``corners``) the derivative by a lag is the mean of both sides.

    Parameters
    ----------
    active : sequence of ActiveEffect
    time : (n,) array or None
        Times of the forces, s; needed for a lag or for other times.
    force : Signal
        Force that the rig carries (n,), N or N mm, with derivatives (n, P).
    columns : sequence of str
    at : (m,) array or None
        Times of the samples that are logged, s; None for the times of the forces.
    corners : sequence of int
        Indices of times at which the program turns sharply.

    Raises
    ------
    ValueError
        A lag, or other times, where there is no time.
    """
    lag = _lag(active, columns)
    lagging = lag.value != 0.0 or np.any(lag.slope)
    if lagging or at is not None:
        if time is None:
            raise ValueError("a force without time cannot be logged late or at other times")
        force = _delayed_force(time, force, lag, time if at is None else at, corners)
    logged_at = time if at is None else at
    elapsed = None if time is None or logged_at is None else logged_at - time[0]
    return _read(active, columns, force, elapsed)


def _lag(active: Sequence[ActiveEffect], columns: Sequence[str]) -> Signal:
    """Return the time by which the force is logged late, s."""
    lag = Signal(np.zeros(()), np.zeros(len(columns)))
    for change, parameters in _changes(active, columns):
        if change.clock is not None:
            lag = lag + parameters[change.clock]
    return lag


def _read(
    active: Sequence[ActiveEffect], columns: Sequence[str], force: Signal, elapsed: Array | None
) -> Signal:
    """Return what the load cell reads of a force, at times since the recording began (s)."""
    for change, parameters in _changes(active, columns):
        if change.read is not None:
            force = change.read(force, elapsed, parameters)
    return force


def reading_at_samples(
    active: Sequence[ActiveEffect],
    interpolation: Callable[[Array], Array],
    times: Array,
    force: Signal,
    columns: Sequence[str],
) -> Signal:
    """Return the force as it is logged at sample times, from forces at the nodes of a march.

    Parameters
    ----------
    active : sequence of ActiveEffect
    interpolation : callable
        Function of times (m,), s, that returns the matrix (m, nodes) from values at the nodes to values at these times.
    times : (m,) array
        Times of the samples, s; the recording begins with the first.
    force : Signal
        Force that the rig carries at the nodes, N or N mm, with derivatives (nodes, P).
    columns : sequence of str
    """
    lag = _lag(active, columns)
    matrix = interpolation(times - float(lag.value))
    slope = matrix @ force.slope
    if np.any(lag.slope):
        # Mean of both sides: the rate is discontinuous at the nodes of the march that are corners of the path.
        apart = _LAG_DIFFERENCE * float(np.ptp(times))
        ahead, behind = (interpolation(times - float(lag.value) + sign * apart) for sign in (1.0, -1.0))
        rate = (ahead - behind) @ force.value / (2.0 * apart)
        slope = slope - rate[:, None] * lag.slope
    return _read(active, columns, Signal(matrix @ force.value, slope), times - times[0])


def has_slope(active: ActiveEffect) -> bool:
    """Whether an effect of the rig is smooth about any preload: with free play the force depends on the amplitude."""
    ((change, parameters),) = _changes((active,), (_SLOPE,))
    at_rest = Signal(np.zeros(1), np.ones((1, 1)))
    return change.drive is None or bool(change.drive(at_rest, parameters).slope[0, 0] == 1.0)


@dataclass(frozen=True)
class RigStiffness:
    """Dynamic stiffness that a rig measures about one preload.

    Attributes
    ----------
    value : shape (n,)
        K*, N/mm or N mm/rad.
    by_part : shape (n,)
        Its derivative by K* of the bushing alone.
    slope : shape (n, P)
        Its derivatives by the parameters, K* of the bushing and the preload held.
    """

    value: Complex
    by_part: Complex
    slope: Complex

    def times(self, factor: Signal) -> RigStiffness:
        """Return the stiffness times a factor (n,), real or complex."""
        slope = factor.value[:, None] * self.slope + self.value[:, None] * factor.slope
        return RigStiffness(factor.value * self.value, factor.value * self.by_part, slope)


def measured_stiffness(
    active: Sequence[ActiveEffect],
    stiffness: Complex,
    frequency: Array,
    q: float,
    force: float,
    columns: Sequence[str] = (),
    force_slope: Array | None = None,
) -> RigStiffness:
    """Return the dynamic stiffness that the rig measures about a preload: its changes of the curve, linearised.

    What stands beside the bushing adds its stiffness, springs in series their compliance at the force that they carry;
    inertia and resonances of the rig follow; a force that is logged late by a time t turns by exp(-i omega t), and is
    scaled as it is read.

    Parameters
    ----------
    active : sequence of ActiveEffect
        Effects of the rig (`has_slope`), all parameters given.
    stiffness : shape (n,)
        K* of the bushing, N/mm or N mm/rad.
    frequency : shape (n,)
        Hz.
    q, force : float
        Displacement and static force of the bushing under the preload: mm or rad, N or N mm.
    columns : sequence of str
    force_slope : shape (P,) or None
        Derivatives of the static force; None = zero.
    """
    local, no_slopes = (_SLOPE, *columns), np.zeros(len(columns))
    changes, omega = _changes(active, local), 2.0 * np.pi * frequency
    slope = np.zeros((3, len(local)))
    slope[:, 1:] = 0.0 if force_slope is None else force_slope
    bare = Signal(np.full(3, force), slope)

    def beside(displacement: Signal) -> Signal:
        return parallel(active, displacement, bare, local, np.zeros(3))

    at_rest = Signal(np.full(3, q), np.zeros((3, len(local))))
    stop, carried = _rate(beside, q, no_slopes), beside(at_rest).at_samples(np.array([1]))
    spring = _rate(lambda load: extension(active, load, local), float(carried.value[0]), carried.slope[0, 1:])
    parallel_stiffness = stiffness + stop.value
    soft = 1.0 / (1.0 + spring.value * parallel_stiffness)
    measured = RigStiffness(
        soft * parallel_stiffness,
        soft**2,
        np.outer(soft**2, stop.slope) - np.outer((soft * parallel_stiffness) ** 2, spring.slope),
    )
    for change, parameters in changes:
        if change.vibrate is not None:
            factor, added_stiffness = change.vibrate(omega, parameters)
            measured = measured.times(Signal(factor.value, factor.slope[:, 1:]))
            measured = replace(
                measured,
                value=measured.value + added_stiffness.value,
                slope=measured.slope + added_stiffness.slope[:, 1:],
            )
    for change, parameters in changes:
        if change.clock is not None:
            late = np.exp(-1j * omega * parameters[change.clock].value)
            measured = measured.times(
                Signal(late, (-1j * omega * late)[:, None] * parameters[change.clock].slope[1:])
            )
    gain = _rate(lambda load: _read(active, local, load, np.zeros(3)), float(carried.value[0]), no_slopes)
    ones = np.ones(len(omega))
    return measured.times(Signal(gain.value * ones, np.tile(gain.slope, (len(ones), 1))))


def _rate(change: Callable[[Signal], Signal], point: float, slopes_by_parameter: Array) -> Signal:
    """Return the slope of a change of a signal at a value, and its derivatives (P,) by the parameters."""
    step = _NEAR * max(abs(point), 1.0)
    columns = np.column_stack([np.ones(3), np.tile(slopes_by_parameter, (3, 1))])
    slopes = change(Signal(point + step * np.array([-1.0, 0.0, 1.0]), columns)).slope
    return Signal(slopes[1, 0], np.asarray((slopes[2, 1:] - slopes[0, 1:]) / (2.0 * step), dtype=np.float64))


def elastic_response(
    active: Sequence[ActiveEffect],
    recorded: Array,
    time: Array | None,
    response: Response,
    columns: Sequence[str],
) -> Signal:
    """Return the logged force (n,) of a bushing without history, with its total derivatives (n, P).

    Parameters
    ----------
    active : sequence of ActiveEffect
    recorded : shape (n,)
        Displacement of the rig, mm or rad, in the order of the recording.
    time : shape (n,) or None
        s, strictly increasing.
    response : Response
        Returns force (n,), stiffness (n,) and derivatives (n, P) of the plain bushing at displacements (n,).
        It must be smooth. While the force has the sign of the displacement, no displacement beyond the rig's (apart
        from offsets) is passed to it.
    columns : sequence of str

    Raises
    ------
    NoEquilibrium
        The displacement cannot be shared with the spring, for example because the response is not finite.
    ValueError
        A lag without time.
    """
    zeroed = is_zeroed(active)
    q = np.concatenate([[0.0], recorded]) if zeroed else recorded
    displacement = bushing_path(active, q, columns)
    # The stiffness is carried as the derivative by one more column, which has no parameter's name.
    local = ("", *columns)
    elapsed = None if time is None else time - time[0]
    if elapsed is not None and zeroed:
        elapsed = np.concatenate([[0.0], elapsed])

    def rig_force(q: Array) -> Signal:
        force, stiffness, slope = response(q)
        itself = np.zeros((len(q), len(local)))
        itself[:, 0] = 1.0
        bare = Signal(force, np.column_stack([stiffness, slope]))
        return parallel(active, Signal(q, itself), bare, local, elapsed)

    def series_extension(q: Array) -> Signal:
        return extension(active, rig_force(q), local)

    q = (
        _share_of_bushing(displacement.value, series_extension)
        if has_springs(active, columns)
        else displacement.value
    )
    force, springs = rig_force(q), series_extension(q)
    # From q + u(q, p) = d(p): (1 + du/dq) dq = dd - du at fixed q.
    path_slope = (displacement.slope - springs.slope[:, 1:]) / (1.0 + springs.slope[:, 0])[:, None]
    carried_force = Signal(force.value, force.slope[:, 1:] + force.slope[:, :1] * path_slope)
    if zeroed:
        carried_force = from_recorded_zero(carried_force)
    return force_reading(active, time, carried_force, columns)


def from_recorded_zero(force: Signal) -> Signal:
    """Return a force (n,) from the second sample on, counted from the first, at which the rig was set to zero."""
    return force.at_samples(np.arange(1, len(force.value))) - force.at_samples(np.array([0]))


def _changes(active: Sequence[ActiveEffect], columns: Sequence[str]) -> list[tuple[RigChange, Given]]:
    """Return the changes of the rig in their order, each with its parameters."""
    ordered = sorted(
        active, key=lambda effect: (0 if effect.effect.rig is None else effect.effect.rig.order, effect.name)
    )
    return [
        (effect.effect.rig, _parameter_signals(effect, columns))
        for effect in ordered
        if effect.effect.rig is not None
    ]


def _parameter_signals(active: ActiveEffect, columns: Sequence[str]) -> Given:
    lacking = [
        active.full_name(p) for p in active.parameters if p.name not in active.values and not p.choices
    ]
    if lacking:
        raise ValueError(f"no value for {', '.join(lacking)}")
    return {
        p.name: Signal(
            np.array(float(active.values[p.name])),
            np.array([float(column == active.full_name(p)) for column in columns]),
        )
        for p in active.parameters
        if p.name in active.values
    }


def _share_of_bushing(target: Array, series_extension: Callable[[Array], Signal]) -> Array:
    """Return q with q + u(q) = target, by Newton's method kept within a shrinking bracket; u is what springs take.

    If the force has the sign of q, the solution is between 0 and the target. If it is not there, as with a force at
    rest, the bracket is widened by what is missing, which is enough if the force does not fall.
    """

    def excess(q: Array) -> tuple[Array, Array]:
        springs = series_extension(q)
        return q + springs.value - target, 1.0 + springs.slope[:, 0]

    low, high = np.minimum(target, 0.0), np.maximum(target, 0.0)
    low = low - np.maximum(excess(low)[0], 0.0)
    high = high - np.minimum(excess(high)[0], 0.0)
    q = target
    scale = float(np.max(np.abs(target) + np.abs(excess(target)[0])))
    for _ in range(_MOST_STEPS):
        over, rate = excess(q)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = q - over / rate
        if np.all(np.abs(over) <= _CLOSE * scale):
            return np.where(np.isfinite(newton), newton, q)
        low, high = np.where(over < 0.0, q, low), np.where(over > 0.0, q, high)
        q = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
    raise NoEquilibrium(f"bushing and series spring do not reach the same force within {_MOST_STEPS} steps")


def _delayed_force(
    time: Array, force: Signal, lag: Signal, sample_times: Array, corners: Sequence[int]
) -> Signal:
    """Return the force at ``at - lag``."""
    from scipy.interpolate import CubicHermiteSpline  # 0.1 s: only where it is needed

    when = sample_times - lag.value
    data = np.column_stack([force.value, force.slope])
    result = np.where((when < time[0])[:, None], data[0], data[-1])
    rate = np.zeros((len(when), 2))  # towards earlier and towards later times: they differ at corners
    edges = sorted({0, len(time) - 1, *corners})
    for first_sample, last in pairwise(edges):
        x, y = time[first_sample : last + 1], data[first_sample : last + 1]
        slopes = np.gradient(y, x, axis=0, edge_order=2 if len(x) > 2 else 1)
        piece = CubicHermiteSpline(x, y, slopes)
        rates = piece.derivative()
        inside = (when >= x[0]) & (when <= x[-1])
        result[inside] = piece(when[inside])
        for side, samples in enumerate([inside & (when > x[0]), inside & (when < x[-1])]):
            rate[samples, side] = rates(when[samples])[:, 0]
    if sample_times is time and lag.value == 0.0:
        result = data  # to the last digit
    slope = result[:, 1:] - rate.mean(axis=1)[:, None] * lag.slope
    return Signal(result[:, 0], slope)
