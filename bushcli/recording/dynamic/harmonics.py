"""Sine bursts in a record, and the harmonics of displacement and force in each of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.segment import turning_points

Array = NDArray[np.float64]
#: Begin and end, s, and frequency, Hz.
Burst = tuple[float, float, float]

#: Half cycles of a burst agree in duration and range within this share: a rig needs some periods to reach its
#: amplitude, and what it does on the way is no burst (judgement).
_ALIKE = 0.25
#: Periods of a burst, and periods that are left out at its beginning: its start-up, in which the amplitude and the
#: transient of the branches still change, at least one of them.
_FEWEST_PERIODS, _START_UP = 3.0, 0.2
#: A reversal counts if it is this many times the noise of the displacement.
_REVERSAL = 8.0
#: Of the standard deviation over the median of absolute deviations of normal noise.
_MAD = 1.4826
_HARMONICS = 5
#: A motion whose third harmonic is larger is no sine: a triangle has 11 %.
LARGEST_THIRD = 0.05


@dataclass(frozen=True)
class Harmonics:
    """First harmonics of a burst, in internal units.

    Attributes
    ----------
    frequency, amplitude : float
        Hz; peak of the first harmonic of the displacement.
    stiffness, error : complex, float
        K* = K' + i K''; standard error of K', and of K''.
    third, third_motion : float
        Third harmonics of the force and of the displacement, as shares of their first.
    mean, span : (float, float)
        Means of displacement and force; times of the first and last sample, s.
    """

    frequency: float
    amplitude: float
    stiffness: complex
    error: float
    third: float
    third_motion: float
    mean: tuple[float, float]
    span: tuple[float, float]


def bursts(time: Array, displacement: Array) -> list[Burst]:
    """Return begin and end (s) and frequency (Hz) of each stretch in which the motion is periodic."""
    # The reversals that are larger than the noise.
    steps = np.abs(np.diff(displacement))
    noise = _MAD * float(np.median(np.abs(np.diff(displacement, 2)))) / math.sqrt(6.0)
    # A fast sine of few samples per period has second differences of its own, far above any noise.
    share = 0.01 * float(np.ptp(displacement))
    resolution = float(steps[steps > 0.0].min()) if steps.any() else 0.0
    least = max(_REVERSAL * min(noise, share), min(2.0 * resolution, share), 1e-12)
    turns = [0, *turning_points(displacement, least), len(displacement) - 1]
    if len(turns) < 2 * _FEWEST_PERIODS:
        return []
    middle = 0.5 * (displacement[turns[1:]] + displacement[turns[:-1]])
    levels = zip(pairwise(turns), middle, strict=True)
    crossings = np.array([_crossing(time, displacement, *ends, level) for ends, level in levels])
    ranges = np.abs(np.diff(displacement[turns]))
    halves = np.diff(crossings)
    stretches, first = [], 0
    for last in range(1, len(halves) + 1):
        is_periodic = last < len(halves) and (
            abs(halves[last] / np.median(halves[first:last]) - 1.0) < _ALIKE
            and abs(ranges[last + 1] / np.median(ranges[first : last + 1]) - 1.0) < _ALIKE
        )
        if is_periodic:
            continue
        count = last - first
        if count >= 2 * _FEWEST_PERIODS - 1:
            start, end = crossings[first], crossings[last]
            stretches.append((float(start), float(end), 0.5 * count / float(end - start)))
        first = last
    return stretches


def _crossing(time: Array, values: Array, a: int, b: int, level: float) -> float:
    """Return the time at which a monotonic stretch a to b crosses a level."""
    part = values[a : b + 1]
    rising = part[-1] > part[0]
    beyond = np.flatnonzero(part >= level if rising else part <= level)
    i = a + max(int(beyond[0]) if len(beyond) else b - a, 1)
    step = values[i] - values[i - 1]
    share = (level - values[i - 1]) / step if step else 0.5
    return float(time[i - 1] + min(max(share, 0.0), 1.0) * (time[i] - time[i - 1]))


def harmonics(time: Array, displacement: Array, force: Array, burst: Burst) -> Harmonics | None:
    """Return the harmonics of a burst, fitted to whole periods without the start-up; None if too few are left."""
    begin, end, frequency = burst
    left_out = math.ceil(max(1.0, _START_UP * (end - begin) * frequency))
    inside = (time >= begin + left_out / frequency) & (time <= end)
    if np.count_nonzero(inside) < 8:
        return None
    frequency = _refine_frequency(time[inside], displacement[inside], frequency)
    start = begin + left_out / frequency
    periods = math.floor((end - start) * frequency + 1e-6)
    if periods < 1:
        return None
    used = (time >= start) & (time < start + periods / frequency)
    t, q, forces = time[used], displacement[used], force[used]
    most = int(min(_HARMONICS, 0.4 * len(t) / periods))
    if most < 1 or len(t) < 2 * most + 6:
        return None
    design = _design(t, frequency, most, 3 if periods >= 4 else 1)
    motion, moved_error = _fit_harmonics(design, q)
    response, force_error = _fit_harmonics(design, forces)
    fundamental = [complex(c[0], -c[1]) for c in (motion, response)]
    stiffness = fundamental[1] / fundamental[0]
    error = math.hypot(force_error, abs(stiffness) * moved_error) / abs(fundamental[0])
    fits = zip((motion, response), fundamental, strict=True)
    third = [math.hypot(*c[4:6]) / abs(f) if most >= 3 else math.nan for c, f in fits]
    waves = design[:, : 2 * most]
    means = [float(np.mean(s - waves @ c[: 2 * most])) for s, c in ((q, motion), (forces, response))]
    mean, span = (means[0], means[1]), (float(t[0]), float(t[-1]))
    return Harmonics(frequency, abs(fundamental[0]), stiffness, error, third[1], third[0], mean, span)


def _design(time: Array, frequency: float, most: int, drift: int) -> Array:
    """Return the columns of harmonics 1 to ``most`` (cosine, sine) and of a polynomial drift."""
    phase = 2.0 * np.pi * frequency * (time - time[0])
    waves = [wave(k * phase) for k in range(1, most + 1) for wave in (np.cos, np.sin)]
    scaled = 2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0
    return np.column_stack([*waves, *(scaled**k for k in range(drift + 1))])


def _fit_harmonics(design: Array, values: Array) -> tuple[Array, float]:
    """Return the coefficients, and the standard error of the first harmonic's parts from the residual.

    Neighbouring residuals of a fast logger are correlated: the error counts as many independent samples as an
    autoregression of first order has.
    """
    coefficients = np.asarray(np.linalg.lstsq(design, values, rcond=None)[0], dtype=np.float64)
    residual = values - design @ coefficients
    free = max(len(values) - design.shape[1], 1)
    variance = float(residual @ residual) / free
    lag = float(residual[1:] @ residual[:-1]) / max(float(residual @ residual), 1e-300)
    inflation = (1.0 + min(max(lag, 0.0), 0.999)) / (1.0 - min(max(lag, 0.0), 0.999))
    return coefficients, math.sqrt(variance * inflation * 2.0 / len(values))


def _refine_frequency(time: Array, values: Array, frequency: float) -> float:
    """Return the frequency whose harmonics fit the displacement best, by Gauss-Newton's method."""
    most = int(min(3, max(1, 0.4 * len(time) / max((time[-1] - time[0]) * frequency, 1.0))))
    length = float(time[-1] - time[0])
    for _ in range(20):
        design = _design(time, frequency, most, 1)
        coefficients, *_ = np.linalg.lstsq(design, values, rcond=None)
        phase = 2.0 * np.pi * frequency * (time - time[0])
        slope = np.zeros_like(time)
        for k in range(1, most + 1):
            a, b = coefficients[2 * k - 2 : 2 * k]
            slope += k * 2.0 * np.pi * (time - time[0]) * (b * np.cos(k * phase) - a * np.sin(k * phase))
        both, *_ = np.linalg.lstsq(np.column_stack([design, slope]), values, rcond=None)
        step = float(both[-1])
        # A step of more than a quarter of a period over the burst has left the minimum.
        step = min(max(step, -0.25 / length), 0.25 / length)
        frequency += step
        if abs(step) * length < 1e-9:
            break
    return frequency
