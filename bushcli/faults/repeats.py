"""Samples that repeat their neighbours although the signal moves on: a clipped load cell, a stuck channel.

Equal neighbours alone are not a fault: a coarse converter repeats itself where the signal is flat, a rig holds
still, a bushing with free play carries no force. They are a fault if the signal must have changed meanwhile.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bushcli.faults.signal import SAME, quantum, repetitions, slope

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Shortest run that counts as stuck if noise makes a repetition unlikely, and if only a jump is evidence.
_RUN_IN_NOISE, _RUN = 5, 4
# Repetitions are no accident if fewer than this are expected by chance in the whole recording.
_CHANCE = 1e-3
# Samples on each side from which the typical step is taken.
_BESIDE = 5
# A jump out of a run is at least this many times the largest step beside it, this many steps of the converter, and
# this share of the range.
_JUMP, _STEPS, _SHARE = 3.0, 4.0, 5e-3
# A jump makes up for the run if the change that the steps beside it predict is between these multiples of the jump.
_MADE_UP = (0.5, 2.0)
# Fewest samples at the limit of a clipped load cell; least change that was cut off, over noise, converter steps, range.
_AT_LIMIT, _CUT_NOISE, _CUT_STEPS, _CUT_SHARE = 3, 5.0, 3.0, 0.01
# A limit within this share of the largest force means no force at all: free play, or a rope that hangs slack.
_NO_FORCE = 0.05


def clipped_samples(force: Array, displacement: Array, noise: float) -> Mask:
    """Return which samples (n,) repeat the largest or the least force while the displacement goes on.

    Parameters
    ----------
    force : (n,) array
        N, N mm or MPa.
    displacement : (n,) array
        mm, rad or stretch - 1.
    noise : float
        Standard deviation of the force's noise, in the unit of the force: N, N mm or MPa.

    Notes
    -----
    A plateau that is not exact to the last digit may be slip or a soft law: it is not called clipped.
    """
    bad = np.zeros(len(force), dtype=bool)
    step, span = quantum(force), float(np.ptp(force))
    least = max(_CUT_NOISE * noise, _CUT_STEPS * step, _CUT_SHARE * span)
    noisy = step < 0.5 * noise
    for extreme in (float(force.max()), float(force.min())):
        if abs(extreme) < _NO_FORCE * float(np.abs(force).max()) and not noisy:
            continue
        near = np.abs(force - extreme) <= SAME * span
        for start, stop in repetitions(np.where(near, 0.0, 1.0)):
            if not near[start] or stop - start < _AT_LIMIT:
                continue
            moved = float(np.ptp(displacement[start:stop]))
            sides = (slice(max(start - _BESIDE, 0), start + 1), slice(stop - 1, stop + _BESIDE))
            slopes = [
                abs(slope(displacement[side], force[side]))
                for side in sides
                if side.stop - side.start > 2 and np.ptp(displacement[side]) > 0
            ]
            if slopes and min(slopes) * moved >= least:
                bad |= near
    return bad


def stuck_force(force: Array, displacement: Array, stiffness: float, noise: float, clip: Mask) -> Mask:
    """Return which samples (n,) only repeat an earlier force while the displacement goes on."""
    bad = np.zeros(len(force), dtype=bool)
    step, chance, smallest = quantum(force), _chance(force, noise), _smallest_jump(force)
    for start, stop in repetitions(force):
        length = stop - start
        if clip[start:stop].any():
            continue
        worth = abs(stiffness) * float(np.ptp(displacement[start:stop]))
        unlikely = (
            length >= _RUN_IN_NOISE
            and len(force) * chance ** (length - 1) < _CHANCE
            and worth >= max(_BESIDE * noise, 2.0 * step)
        )
        if unlikely or (length >= _RUN and _catches_up(force, displacement, start, stop, smallest)):
            bad[start + 1 : stop] = True
    return bad


def stuck_rows(force: Array, displacement: Array, noise: float, displacement_noise: float) -> Mask:
    """Return which samples (n,) repeat force and displacement exactly, although both are noisy even in a hold."""
    bad = np.zeros(len(force), dtype=bool)
    chances = _chance(force, noise), _chance(displacement, displacement_noise)
    for start, stop in repetitions(force):
        length = stop - start
        if length < _RUN_IN_NOISE or np.ptp(displacement[start:stop]) > SAME * np.ptp(displacement):
            continue
        if all(len(force) * chance ** (length - 1) < _CHANCE for chance in chances):
            bad[start + 1 : stop] = True
    return bad


def _chance(values: Array, noise: float) -> float:
    """Return the probability that neighbours of noisy values (n,) fall on the same step of the converter.

    It is 1 for noise that is smaller than a step: that is the converter's own.
    """
    step = quantum(values)
    return step / (2.0 * float(np.sqrt(np.pi)) * noise) if noise > step else 1.0


def stuck_displacement(displacement: Array, force: Array, x: Array) -> Mask:
    """Return which samples (n,) only repeat an earlier displacement, before a jump that makes up for them.

    A hold repeats the displacement too, but the motion after it begins where it ended.
    """
    bad = np.zeros(len(displacement), dtype=bool)
    span, smallest = float(np.ptp(force)), _smallest_jump(displacement)
    for start, stop in repetitions(displacement):
        if stop - start < _RUN or not _catches_up(displacement, x, start, stop, smallest):
            continue
        # The force has gone on, or the logger repeated whole rows.
        went_on = float(np.ptp(force[start:stop])) > 0.5 * abs(force[stop] - force[start])
        rows = float(np.ptp(force[start:stop])) <= SAME * span
        if went_on or rows:
            bad[start + 1 : stop] = True
    return bad


def _smallest_jump(values: Array) -> float:
    """Return the smallest jump that can make up for a run of values (n,)."""
    return max(_STEPS * quantum(values), _SHARE * float(np.ptp(values)))


def _catches_up(values: Array, x: Array, start: int, stop: int, smallest: float) -> bool:
    """Whether a run of equal samples ends with a jump to where the signal should have been, while x steps as usual."""
    if start < 2 or stop + 2 >= len(values):
        return False
    before = slice(max(start - _BESIDE, 0), start + 1)
    after = slice(stop, stop + _BESIDE + 1)
    steps = np.concatenate([np.diff(values[before]), np.diff(values[after])])
    strides = np.concatenate([np.diff(x[before]), np.diff(x[after])])
    jump, stride = values[stop] - values[stop - 1], x[stop] - x[stop - 1]
    least = max(_JUMP * float(np.abs(steps).max()), smallest)
    if abs(jump) < least or abs(stride) > 2.0 * float(np.abs(strides).max()):
        return False
    expected = 0.5 * (slope(x[before], values[before]) + slope(x[after], values[after]))
    expected *= x[stop] - x[start]
    return bool(_MADE_UP[0] * jump**2 <= jump * expected <= _MADE_UP[1] * jump**2)
