"""What the unknown effect looks like: the smooth part of a model's misfit, along displacement, time, cycle and rate.

The misfit's features, shrunk by the contribution of noise, are the posterior mean of a Gaussian process over each
branch. Its averages along the path show what the missing physics does; sentences describe what it depends on.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.segment import per_sample
from bushcli.likelihood.calibration import UNREMARKABLE
from bushcli.likelihood.features import Features
from bushcli.likelihood.noise import Compared
from bushcli.mismatch.maps import Missing, MissingProfile
from bushcli.recording import Recording
from cases.mode import modes

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Along = Literal["displacement", "time", "cycle", "rate"]

# Missing force, as a share of the force range, below which nothing is said about it: it would be shown as 0.0 %.
TINY = 5e-4
# Points of a profile along displacement and along time. Words only: the picture's resolution.
POINTS, TIMES = 9, 12
# Least share of the missing force's square that a sentence has to describe. Words only: more than what is left
# unsaid.
SAYS = 0.5
# The same of one coefficient for each cycle, of which there are many. Words only: more than what is left unsaid.
BY_CYCLE = 0.8
# Half-waves over a recording of what varies slowly; moments at which something may jump, over its duration.
# Judgement.
WAVES = 6
JUMPS = np.linspace(0.0, 1.0, 42)[1:-1]
# Waves over the range of the displacement or the duration, from, to and step: fewer are a trend, as another law or a
# slow drift gives; more are sampled too coarsely by recordings of some hundred samples.
COUNTS = (3.0, 30.0, 0.1)
# Share that each further coefficient has to describe in addition; weight of a misfit that no sentence describes.
# Words only: with them the sentences of `tests/unit/mismatch/test_missing_force.py` are right.
PRICE, UNSAID = 0.05, 0.1


def describe_missing(
    channels: Sequence[Compared], features: Sequence[Features], probability: float, share: float
) -> Missing:
    """Describe the misfit that a model leaves.

    Parameters
    ----------
    channels : sequence of Compared
        Recorded and simulated.
    features : sequence of Features
    probability : float
        Probability of the unknown effect.
    share : float
        Share of the plain law's squared misfit above the noise that is left.
    """
    force, profiles, said = {}, [], []
    for channel, own in zip(channels, features, strict=True):
        mean = missing_force(channel, own)
        force[channel.name] = mean
        profiles += _profiles(channel, mean)
        said += _sentences(channel, mean, len(channels) > 1)
    said.sort(key=lambda pair: -pair[0])
    text = tuple(sentence for _, sentence in said[:4])
    return Missing(probability, share, force, tuple(profiles), text)


def constant_factor(share: float, mode: str) -> str:
    """Return a constant factor between simulation and recording in words, which blame nobody for what the mesh may do.

    Parameters
    ----------
    share : float
        Recorded less simulated force, as a share of the force.
    mode : str
        Mode of the channel.
    """
    said = f"a constant factor of {100 * share:+.1f} % between simulation and recording"
    coupon = modes()[mode].specimen == "coupon"
    what = "a load cell of class 1" if coupon else "the mesh"
    if abs(share) <= UNREMARKABLE:
        return f"{said}, within the error of {what} (about {100 * UNREMARKABLE:.0f} %)"
    causes = (
        "the dimensions or the calibration" if coupon else "the stiffness, the geometry or the calibration"
    )
    return f"{said}, more than the error of {what} (about {100 * UNREMARKABLE:.0f} %): {causes} may differ"


def missing_force(channel: Compared, own: Features) -> Array:
    """Return the posterior mean (n,) of recorded less simulated force: its smooth part, without noise.

    Parameters
    ----------
    channel : Compared
        n samples, N, N mm or MPa.
    own : Features
        Of the channel.
    """
    misfit = np.where(channel.known, -channel.misfit, 0.0)
    return own.shrink(misfit)


def _profiles(channel: Compared, mean: Array) -> list[MissingProfile]:
    recording = channel.recording
    unit = 100.0 / float(np.ptp(recording.force))
    noise = channel.noise.sigma * np.sqrt(channel.noise.correlation_time)

    def profile(along: Along, branch: str, groups: Sequence[tuple[float, Index]]) -> list[MissingProfile]:
        filled = [(x, index) for x, index in groups if len(index)]
        if len(filled) < 2:
            return []
        x = np.array([x for x, _ in filled])
        value = np.array([float(np.mean(mean[index])) for _, index in filled]) * unit
        std = np.array([noise / np.sqrt(len(index)) for _, index in filled]) * unit
        return [MissingProfile(channel.name, along, branch, x, value, std)]

    profiles: list[MissingProfile] = []
    kinds = per_sample(recording.branches, [branch.kind for branch in recording.branches])
    for kind in dict.fromkeys(branch.kind for branch in recording.branches if branch.kind != "hold"):
        bins = _bins(recording.displacement, np.flatnonzero(kinds == kind), POINTS)
        profiles += profile("displacement", kind, bins)
    everything = np.arange(len(recording.force))
    if recording.time is not None:
        profiles += profile("time", "", _bins(recording.time, everything, TIMES))
    cycles: dict[int, list[Index]] = {}
    rates: dict[float, list[Index]] = {}
    for branch in recording.branches:
        index = np.arange(branch.start, branch.stop)
        cycles.setdefault(branch.cycle, []).append(index)
        first, last = branch.start, branch.stop - 1
        if recording.time is None or branch.kind == "hold" or recording.time[last] <= recording.time[first]:
            continue
        way = abs(float(recording.displacement[last] - recording.displacement[first]))
        rate = way / float(recording.time[last] - recording.time[first])
        if rate > 0.0:
            near = next((r for r in rates if 0.7 < rate / r < 1.4), rate)
            rates.setdefault(near, []).append(index)
    profiles += profile("cycle", "", [(float(c), np.concatenate(i)) for c, i in sorted(cycles.items())])
    profiles += profile("rate", "", [(r, np.concatenate(i)) for r, i in sorted(rates.items())])
    return profiles


def _bins(x: Array, index: Index, count: int) -> list[tuple[float, Index]]:
    edges = np.linspace(float(x[index].min()), float(x[index].max()), count + 1)
    place = np.clip(np.searchsorted(edges, x[index], side="right") - 1, 0, count - 1)
    return [(0.5 * float(edges[i] + edges[i + 1]), index[place == i]) for i in range(count)]


# -- in words ------------------------------------------------------------------------------------------------------


def _sentences(channel: Compared, mean: Array, several: bool) -> list[tuple[float, str]]:
    """Sentences, each with the share of the missing force's square that it describes, weighted by its size."""
    recording = channel.recording
    power = float(mean @ mean)
    if power == 0.0:
        return []
    at = f"in the {channel.name} channel, " if several else ""
    span = float(np.ptp(recording.force))
    size = float(np.sqrt(power / len(mean))) / span
    if size < TINY:
        return []
    sentences, best = [], 0.0
    elastic, is_even = _elastic(recording, mean)
    for whole_share, share, text, timed in _descriptions(recording, mean):
        # Where it follows the displacement as well, nothing shows that it depends on time.
        if share > SAYS and not (timed and elastic >= share):
            sentences.append((share * size, at + text))
            best = max(best, whole_share)
    share, text = max(_variations(recording, mean))
    if share > max(BY_CYCLE, elastic, best + PRICE):
        return [(share * size, at + text)]
    # A wave has two coefficients and a period; a short one is smoothed away in the features of a branch.
    whole = np.where(channel.known, -channel.misfit, 0.0)
    share, text = max(described for rows in (mean, whole) for described in _waves(recording, rows))
    share -= 2 * PRICE
    if share > max(SAYS, elastic, best):
        return [(share * size, at + text)]
    if sentences:
        return sentences
    if elastic > SAYS:
        law = (
            ": it has one sign in both directions, which no law of a symmetric bushing gives"
            if is_even
            else ", as another law would"
        )
        text = f"the missing force depends on the displacement alone ({100 * size:.1f} % of the range){law}"
        return [(elastic * size, at + text)]
    text = (
        f"a force of {100 * size:.1f} % of the range is missing, for which no simple dependence on displacement, time "
        "or cycle was found"
    )
    return [(UNSAID * size, at + text)]


def _least_squares(basis: Array, mean: Array) -> tuple[float, Array]:
    """Return the share of the missing force's sum of squares that columns (n, k) describe, and coefficients (k,)."""
    size = np.asarray(np.linalg.lstsq(basis, mean, rcond=None)[0], dtype=np.float64)
    rest = mean - basis @ size
    return 1.0 - float(rest @ rest) / float(mean @ mean), size


def _descriptions(recording: Recording, mean: Array) -> Iterator[tuple[float, float, str, bool]]:
    """Yield shapes of a missing force: its described share, that less a price, in words, whether it depends on time."""
    force, span, n = recording.force, float(np.ptp(recording.force)), len(recording.force)
    seconds = np.arange(float(n)) if recording.time is None else recording.time
    clock: Array = np.asarray((seconds - seconds[0]) / np.ptp(seconds))
    loading, cycle = _passes(recording)
    share, (a,) = _least_squares(force[:, None], mean)
    yield share, share, constant_factor(float(a), recording.mode), False
    share, (a,) = _least_squares((clock * force)[:, None], mean)
    sense = f"{'grows' if a > 0 else 'falls'} with time, whatever the displacement"
    yield share, share, f"the force {sense}: by {abs(100 * a):.1f} % until the end", True
    share, (a,) = _least_squares(clock[:, None], mean)
    yield share, share, f"the zero of the force drifts by {100 * a / span:+.1f} % of the range", True
    share, (a,) = _least_squares(loading[:, None], mean)
    size = f"{abs(200 * a / span):.1f} % of the range"
    text = f"the recorded loop is wider than the simulated one by {size}"
    if not a > 0:
        text = (
            f"the force is larger on unloading than on loading, by {size}, compared with the simulation: a delay or "
            "play in the rig, or a simulated loop that is too wide"
        )
    yield share, share, text, False
    whole, _ = _least_squares(force[:, None], mean)
    for first in sorted(set(cycle))[1:]:
        share, (_, a) = _least_squares(np.column_stack([force, np.where(cycle >= first, force, 0.0)]), mean)
        # A sentence says something about the last coefficient, which has to describe more than that before it.
        if share >= whole + PRICE:
            sense = f"{'larger' if a > 0 else 'smaller'} by {abs(100 * a):.1f} %"
            yield share, share - PRICE, f"from cycle {first:.0f} on the recorded force is {sense}", True


def _passes(recording: Recording) -> tuple[Array, Array]:
    """Sense of the motion (n,): the sign of q away from zero, its opposite towards zero, 0 in holds; and the cycle."""
    branches = recording.branches
    signs = [{"loading": 1.0, "unloading": -1.0}.get(branch.kind, 0.0) for branch in branches]
    loading = per_sample(branches, signs) * np.sign(recording.displacement)
    return loading, per_sample(branches, [float(branch.cycle) for branch in branches])


def _variations(recording: Recording, mean: Array) -> list[tuple[float, str]]:
    """Return the share of the missing force's square that a changing zero or stiffness explains, with a sentence each.

    It has a value of its own in each cycle; or it varies slowly, as cosines of up to `WAVES` half-waves over the
    recording; or it jumps once.
    """
    _, cycle = _passes(recording)
    numbers, time, sentences = sorted(set(cycle)), recording.time, [(0.0, "")]
    for factor, what, unit, of in (
        (np.ones(len(mean)), "zero of the force", float(np.ptp(recording.force)), " of the range"),
        (recording.force, "stiffness", 1.0, ""),
    ):
        if len(numbers) >= 3:
            share, size = _least_squares((cycle[:, None] == numbers) * factor[:, None], mean)
            low, high = 100 * size.min() / unit, 100 * size.max() / unit
            text = f"the {what} differs from cycle to cycle, by {low:+.1f} to {high:+.1f} %{of}"
            sentences.append((share, text))
        if time is None:
            continue
        clock = (time - time[0]) / float(np.ptp(time))
        cosines = np.cos(np.pi * np.outer(clock, np.arange(WAVES + 1)))
        share, size = _least_squares(cosines * factor[:, None], mean)
        low, high = 100 * (cosines @ size).min() / unit, 100 * (cosines @ size).max() / unit
        text = f"the {what} varies with time, by {low:+.1f} to {high:+.1f} %{of}"
        sentences.append((share - PRICE, text))
        jumps = [
            (*_least_squares(np.column_stack([factor, factor * (clock >= at)]), mean), at) for at in JUMPS
        ]
        share, size, at = max(jumps, key=lambda jump: jump[0])
        text = f"the {what} jumps by {100 * size[1] / unit:+.1f} %{of} at about "
        sentences.append((share, f"{text}{time[0] + at * np.ptp(time):.3g} s"))
    return sentences


def _waves(recording: Recording, mean: Array) -> list[tuple[float, str]]:
    """Return how much of the missing force's square one wave over displacement or time explains, with a sentence."""
    mode = modes()[recording.mode]
    unit, factor = (" degrees", 180.0 / np.pi) if mode.rotational else (" mm", 1.0)
    if mode.specimen == "coupon":
        unit = " of strain"
    sentences = []
    for x, along, by, unit_of_x in (
        (recording.displacement, "along the displacement", factor, unit),
        (recording.time, "with time", 1.0, " s"),
    ):
        if x is None or np.ptp(x) == 0.0:  # in a hold alone nothing moves
            continue
        waves = []
        for count in np.arange(*COUNTS):
            phase = 2.0 * np.pi * count * (x - x[0]) / float(np.ptp(x))
            share, size = _least_squares(
                np.column_stack([np.ones_like(x), np.cos(phase), np.sin(phase)]), mean
            )
            waves.append((share, by * float(np.ptp(x)) / count, float(np.hypot(size[1], size[2]))))
        share, period, amplitude = max(waves)
        text = f"the force rises and falls {along} every {period:.2g}{unit_of_x}, by "
        text += f"{100 * amplitude / float(np.ptp(recording.force)):.1f} % of the range to either side"
        sentences.append((share, text))
    return sentences


def _elastic(recording: Recording, mean: Array) -> tuple[float, bool]:
    """Return how much of the missing force's square depends on displacement alone, and whether that is mostly even."""
    place = _bins(recording.displacement, np.arange(len(mean)), 12)
    smooth = np.zeros(len(mean))
    for _, index in place:
        if len(index):
            smooth[index] = np.mean(mean[index])
    share = 1.0 - float(np.sum((mean - smooth) ** 2)) / float(mean @ mean)
    x, value = (
        np.array(each) for each in zip(*((q, np.mean(mean[i])) for q, i in place if len(i)), strict=True)
    )
    both = np.linspace(0.0, min(max(x[-1], 0.0), max(-x[0], 0.0)), POINTS)
    there, back = np.interp(both, x, value), np.interp(-both, x, value)
    return share, bool(np.sum((there + back) ** 2) > np.sum((there - back) ** 2))
