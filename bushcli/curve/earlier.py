"""What is assumed to have happened before a recording that does not begin at rest.

Rubber with memory remembers the path to the first sample. A recording may begin in the middle of a test: a rig logs
the third cycle only, or one loop has been cut out of a longer file. Either the first displacement is far from zero; or
the first cycle closes, although its two branches pass through the first displacement with different forces. Rubber that
is loaded from rest returns with a force that differs from its first one, unless the second half of the cycle is smaller
than the first: the zero of the force must then lie well between the two branches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.recording import Recording
from bushcli.runtime.condition import Condition

Array = NDArray[np.float64]

# A first displacement beyond this share of the largest is no zero offset: the prior of one has a scale of 3 % of the
# travel (`effects/library/offset.py`).
OFF = 0.1
# Share of the range that a path has to go for a motion: more than noise and overshoot. Judgement.
MOTION = 0.1
# A cycle is closed if its ends differ by less than this share of its width where it began. From rest the second half of
# a first cycle changes the force there as much as the first half does (friction), or in proportion to its way.
CLOSED = 0.25
# It counts as no smaller if it goes at least this many times as far.
FURTHER = 2.0
# Where it began at a turning point, without a width: by less than this share of the range of the force. Judgement.
AT_TURN = 0.05
# Least distance of both forces from zero, as a share of the width: a cycle from rest begins at zero, one cut out of a
# symmetric test in the middle, at 0.5.
AMID = 0.25
# Standard deviations of the force's noise that a width must exceed: those of a difference of two samples are 1.4.
SURE = 6.0


# Of a hold without a motion: duration of its loading over the first interval of samples, because nobody samples a
# relaxation more slowly than the specimen was loaded; and most intervals between the loading and the first sample of a
# clock that counts from it. Judgement.
_RAMP, _SINCE = 0.1, 2.0


@dataclass(frozen=True, eq=False)
class Earlier:
    """The path that is assumed before the first sample.

    Attributes
    ----------
    time : shape (m,)
        Before the first sample, s (negative, increasing); without recorded times in samples.
    displacement : shape (m,)
        mm or rad.
    repeats : bool
        Whether it has the first cycle of the recording once more; else it goes straight to the first displacement.
    """

    time: Array
    displacement: Array
    repeats: bool


def earlier(recording: Recording) -> Earlier | None:
    """Return the path before a recording that does not begin at rest; None if it begins at rest.

    The assumed path goes from zero to the first displacement at the mean rate of the recording without its holds, and
    then through the recording's first cycle if that is closed. A hold that begins at the first sample, with nothing
    else, was loaded within a tenth of an interval of samples when its clock began, if that is at most two intervals
    before, or else just before its first sample. Where only some cycles are compared, the whole record counts.
    """
    recording = recording.record
    q, n = recording.displacement, len(recording.displacement)
    clock = np.arange(float(n)) if recording.time is None else recording.time
    first, reach = float(q[0]), float(np.abs(q).max())
    off = abs(first) > OFF * reach
    last = _first_cycle(recording)
    if last is None and not off:
        return None
    end = n - 1 if last is None else last
    held = np.zeros(n, dtype=bool)
    for branch in recording.branches:
        held[branch.start : branch.stop - 1] = branch.kind == "hold"
    steps, seconds = (np.diff(signal[: end + 1])[~held[:end]] for signal in (q, clock))
    travel = float(np.sum(np.abs(steps)))
    time, path = [], []
    if last is not None:
        time.append(clock[:last] - clock[last])
        path.append(q[:last])
    start = time[0][0] if time else 0.0
    if travel > 0.0:
        ramp = abs(first) / travel * float(np.sum(seconds))
    else:
        # A hold from the first sample on, of a clock that begins at the loading, or else after it.
        interval = float(clock[1] - clock[0])
        ramp, since = _RAMP * interval, float(clock[0])
        if recording.time is not None and 0.0 < since <= _SINCE * interval:
            time.append(np.array([-since]))
            path.append(q[:1])
            start = -since
    if ramp > 0.0:
        time.insert(0, np.array([start - ramp]))
        path.insert(0, np.zeros(1))
    return Earlier(np.concatenate(time), np.concatenate(path), last is not None)


def not_from_rest(name: str, before: Earlier) -> Condition:
    """Return what is said of a recording that does not begin at rest.

    Parameters
    ----------
    name : str
        Of the channel.
    before : Earlier
        What is assumed.
    """
    through = "the first cycle, once more"
    if not before.repeats:
        ramp = float(np.diff(before.time, append=0.0)[0])
        through = f"a ramp from zero in {ramp:.3g} s"
        through += f", {-before.time[1]:.4g} s before the first sample" if len(before.time) > 1 else ""
    return Condition(
        "not_from_rest",
        f"{name}: the recording does not begin at rest. The rubber remembers what went before; this is assumed to be "
        f"{through}",
        "record from rest; or keep the earlier cycles in the file, with conditioning = their number",
    )


def _first_cycle(recording: Recording) -> int | None:
    """Return the sample at which the first cycle ends, if it shows that the recording does not begin at rest."""
    q, force = recording.displacement, recording.force
    motion, reach = MOTION * float(np.ptp(q)), float(np.abs(q).max())
    away = np.flatnonzero(np.abs(q - q[0]) > motion)
    if not len(away):
        return None
    # Distance from the beginning, in the sense of the first motion.
    x = np.sign(q[away[0]] - q[0]) * (q - q[0])
    # The last sample of a loop may lie one step before the first one of the next.
    near = max(3.0 * recording.displacement_noise, 1.5 * float(np.median(np.abs(np.diff(q)))))
    back = _next(x <= near, int(away[0]))
    if back is None:
        return None
    beyond, again = _next(x < -motion, back), _next(x > motion, back)
    if beyond is None or (again is not None and again < beyond):
        # It turns where it began.
        visit = slice(back, len(x) if again is None else again)
        if visit.start >= visit.stop:
            return None
        end = back + int(np.argmin(np.abs(x[visit])))
        closed = abs(force[end] - force[0]) <= AT_TURN * float(np.ptp(force))
        return end if closed and abs(q[0]) > OFF * reach else None
    rising = _next(x >= -near, beyond)
    if rising is None:
        return None
    # The force where the falling distance passes zero.
    inside = slice(max(back - 1, 0), beyond + 1)
    other = float(np.interp(0.0, -x[inside], force[inside]))
    width = abs(other - force[0])
    end = rising + int(np.argmin(np.abs(x[rising : rising + 3])))
    closed = abs(force[end] - force[0]) <= CLOSED * width and width > SURE * recording.force_noise
    amid = force[0] * other < 0.0 and min(abs(force[0]), abs(other)) >= AMID * width
    further = -float(x[beyond:rising].min()) >= FURTHER * float(x[:back].max())
    return end if closed and (amid or further or abs(q[0]) > OFF * reach) else None


def _next(marked: NDArray[np.bool_], start: int) -> int | None:
    """Return the first marked sample from `start` on."""
    samples = np.flatnonzero(marked[start:])
    return start + int(samples[0]) if len(samples) else None
