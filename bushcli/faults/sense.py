"""Checks signs, zeros and magnitudes of force and displacement, and whether there is a signal above the noise.

References
----------
von Neumann (1941), Distribution of the ratio of the mean square successive difference to the variance, Ann. Math. Stat.
12:367-395, doi:10.1214/aoms/1177731677.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bushcli.faults.fault import DataFault, Mask
from bushcli.faults.signal import moving_samples, slope
from bushcli.recording import Recording
from bushcli.recording.source import dimension
from cases.mode import modes
from geometry.shape import Shape

# A force falls with the displacement where their correlation is below this; a loop of half the range has 0.8.
_FALLING = -0.5
# A force is a magnitude where its correlations with the displacement on either side of zero are beyond this, with
# opposite signs. A force with its sign has equal signs there: 0.7 to 0.4 where friction makes the loop a third to two
# thirds of the range wide (calculated for one slider).
_MAGNITUDE = 0.7
# A force is noise where its changes from sample to sample are as large as those of so much noise with so little signal:
# half the mean square change over the variance is 1 for noise, and beyond the first number where noise has more of the
# variance than the signal. A displacement is sampled finely enough to tell where its own ratio is below the second.
_NOISE, _SMOOTH = 0.5, 0.1
# Fewer samples do not determine that ratio to 0.1 (its standard deviation is 1/sqrt(n)).
_FEWEST = 100
# Share of the travel that a displacement must reach on its smaller side to be one to both sides: judgement.
_SIDE = 0.2
# Rubber thicknesses from zero beyond which a displacement is the position of the actuator: judgement, since rubber that
# is sheared by 3 is stretched more than threefold, and no bushing carries such a preload.
_FAR = 3.0


def reversed_sign(recording: Recording, bad: Mask) -> Iterator[DataFault]:
    """Yield a fault where the force falls while the displacement rises, or has the other sign in a hold from rest."""
    moved = moving_samples(recording)
    used = ~bad & (moved if moved.any() else True)
    q, force = recording.displacement[used], recording.force[used]
    reason = ""
    if not moved.any():
        held = len(q) > 0 and float(q.mean() * force.mean()) < 0.0
        reason = "the force at which the displacement is held has the other sign" if held else ""
    elif _moves(q, force):
        correlation = float(np.corrcoef(q, force)[0, 1])
        if correlation < _FALLING and slope(q, force) < 0:
            reason = f"the force falls while the displacement rises (correlation {correlation:.2f})"
    if reason:
        yield DataFault(
            recording.name,
            "sign",
            f"{reason}: one of them has the wrong sign",
            'reverse the sign of the force: reverse = ["force"] in the table of this recording',
            True,
        )


def magnitude(recording: Recording, bad: Mask) -> Iterator[DataFault]:
    """Yield a fault where the force lacks the sign that the displacement has."""
    q, force = recording.displacement[~bad], recording.force[~bad]
    if not _moves(q, force):
        return
    sides = min(float(q.max()), float(-q.min())) / max(float(np.abs(q).max()), 1e-300)
    halves = [(q[half], force[half]) for half in (q > 0, q < 0)]
    if sides < _SIDE or not all(_moves(x, y) for x, y in halves):
        return
    right, left = (float(np.corrcoef(x, y)[0, 1]) for x, y in halves)
    if right * left < 0 and min(abs(right), abs(left)) > _MAGNITUDE:
        yield DataFault(
            recording.name,
            "sign",
            "the force changes alike to both sides of zero displacement, as a magnitude does (correlations "
            f"{right:.2f} and {left:.2f})",
            "export the force with its sign, such as one component instead of a resultant",
            True,
        )


def no_signal(recording: Recording, bad: Mask) -> Iterator[DataFault]:
    """Yield a fault where the force is noise, as of a load cell that is not connected."""
    q, force = recording.displacement[~bad], recording.force[~bad]
    if len(q) < _FEWEST or not _moves(q, force):
        return
    # Half the mean square change from sample to sample over the variance: half the von Neumann ratio.
    rough, smooth = (
        0.5 * float(np.mean(np.diff(signal) ** 2)) / float(np.var(signal)) for signal in (force, q)
    )
    if rough > _NOISE and smooth < _SMOOTH:
        yield DataFault(
            recording.name,
            "no_signal",
            f"the force changes from sample to sample as noise does, by {np.sqrt(2.0 * rough):.2g} times its standard "
            f"deviation (rms; the displacement by {np.sqrt(2.0 * smooth):.2g} times its own)",
            "check that the load cell is connected and that its range suits the force; then record it again",
            True,
        )


def _moves(q: NDArray[np.float64], force: NDArray[np.float64]) -> bool:
    """Whether there are enough samples of a displacement and a force that both change."""
    return len(q) >= 3 and bool(np.ptp(q) > 0) and bool(np.ptp(force) > 0)


def positions(shape: Shape, recording: Recording, bad: Mask) -> Iterator[DataFault]:
    """Yield a fault where the displacement stays so far from zero that it is a position of the rig."""
    mode = modes()[recording.mode]
    kind = dimension("displacement", mode.specimen, mode.rotational)
    if kind != "length" or shape.annulus is None or bad.all():
        return
    q = recording.displacement[~bad]
    nearest = float(np.abs(q).min())
    if nearest > _FAR * shape.annulus.thickness:
        yield DataFault(
            recording.name,
            "position",
            f"the displacement goes from {q.min():.4g} to {q.max():.4g} mm, and the rubber is "
            f"{shape.annulus.thickness:.4g} mm thick: it is a position of the rig, and not counted from rest",
            "subtract the position at which the specimen is free of force, or choose another column",
            True,
        )


#: Fewest rows; share of rows at which the motion reverses; least median step between them as a share of the range.
#: Judgement: a sampled signal has such steps only where the noise hides the motion, and is then no recording either.
_FEWEST_ROWS, _REVERSALS, _STEP = 8, 0.9, 0.3


def extremes(recording: Recording) -> Iterator[DataFault]:
    """Yield a fault if a recording consists of the extremes of its cycles."""
    steps = np.diff(recording.displacement)
    if len(steps) + 1 < _FEWEST_ROWS or not np.ptp(recording.displacement) > 0.0:
        return
    reversals = float(np.mean(steps[1:] * steps[:-1] < 0.0))
    if reversals < _REVERSALS or np.median(np.abs(steps)) < _STEP * np.ptp(recording.displacement):
        return
    yield DataFault(
        recording.name,
        "extremes",
        f"the motion reverses at {'each' if reversals == 1.0 else f'{100 * reversals:.0f} % of the'} "
        f"sample{'' if reversals == 1.0 else 's'}: this is a table of peaks and valleys, or a signal that was "
        "sampled too slowly, and the curve between its points is unknown",
        "export the samples of some whole cycles, at least twenty in each, with their time",
        True,
    )
