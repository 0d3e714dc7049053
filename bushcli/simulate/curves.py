"""The simulated curve of a channel: the steps of its march, or the force at the samples of its recording."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.curve.curve import Curve, ExactCurve
from bushcli.curve.symmetry import both_halves
from bushcli.simulate.channels import SimulatedChannel
from bushcli.simulate.response import SixCurve
from bushcli.simulate.simulation import Answer
from cases.march import History
from cases.mode import modes
from cases.simulate import is_odd
from cases.six import SixPath

Array = NDArray[np.float64]


def curve_of(
    case: Case, channel: SimulatedChannel, history: History, answer: Answer | None
) -> tuple[Curve, SixCurve | None]:
    """Return the curve of a channel; on a prescribed path of six motions that of the leading one, and all of them."""
    recording, mode = channel.recording, channel.mode
    if channel.path is not None and recording is None:
        all_six = six_curve(history, channel.path)
        return all_six.curve, all_six
    if answer is not None and recording is None:
        return ExactCurve(mode, channel.displacement, answer.force, channel.time), None
    if answer is not None and recording is not None:
        return Curve(mode, recording.displacement, answer.force[recording.places], recording.time), None
    # The part that was reached, with at least two points even if the first step failed.
    q, force = history.displacement, history.force
    if len(q) < 2:
        return Curve(mode, np.array([0.0, 1e-9]), np.zeros(2)), None
    if recording is None:
        return ExactCurve(mode, q, force, history.time), None
    low, high = float(recording.displacement.min()), float(recording.displacement.max())
    if low < 0.0 < high and is_odd(case.geometry, modes()[mode]):
        q, force = both_halves(q, force)
        # The curve ends one step beyond the recorded range: plot and stiffness belong to the recorded range.
        step = float(np.diff(q).max())
        in_range = (q >= low - step) & (q <= high + step)
        q, force = q[in_range], force[in_range]
    return Curve(mode, q, force), None


def six_curve(history: History, six: SixPath) -> SixCurve:
    """Return the motions and reactions of a march along a path."""
    motion = np.zeros((0, 6)) if history.motion is None else history.motion
    force = np.zeros((0, 6)) if history.reactions is None else history.reactions
    work = np.zeros(6)
    if len(motion) > 1:
        work = np.abs(0.5 * (force[1:] + force[:-1]) * np.diff(motion, axis=0)).sum(axis=0)
    return SixCurve(history.displacement, motion, force, six.free, int(np.argmax(work)), six.loaded)


def force_change(force: Array, fine: Array) -> float:
    """Return the largest change of a force (n,) over its range."""
    return float(np.max(np.abs(force - fine)) / np.ptp(fine))


def history_change(history: History, fine: History) -> float:
    """Return the largest change of the force over its range; for six reactions, the larger of forces and moments."""
    if history.reactions is None or fine.reactions is None:
        return force_change(history.force, fine.force)
    groups = [(history.reactions[:, part], fine.reactions[:, part]) for part in (slice(0, 3), slice(3, 6))]
    # A group that vanishes is the other's rounding error.
    ranges = [float(np.ptp(ours, axis=0).max()) for _, ours in groups]
    real = [i for i in (0, 1) if ranges[i] > 1e-6 * max(ranges)]
    return max(float(np.abs(groups[i][0] - groups[i][1]).max()) / ranges[i] for i in real)
