"""Which samples to keep from the fit, so that an effect has to predict what it has not seen.

What is held out must not be the only one of its kind: a law is not asked to extrapolate, nor a time constant to be
guessed without the hold that shows it. So the last cycle is held out whose range, rates and holds the others have too;
where there is none such, every fourth block of samples along the recording. The program itself is always simulated as a
whole, since what comes later depends on what came before.

References
----------
Racine (2000), Consistent cross-validatory model-selection for dependent data: hv-block cross-validation, J. Econom.
99:39-61, doi:10.1016/S0304-4076(00)00030-0 (blocks, because neighbours err together).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.recording import Recording, branches, departure
from bushcli.segment import Branch

# A cycle may exceed the others by this share of their range, and their rates by that factor.
_BEYOND = 0.02
_RATE = 1.6
_BLOCKS = 16
_EVERY = 4
_SHORTEST = 5
# Cycles need a fit from at least as many.
_FEWEST_LEFT = 2


@dataclass(frozen=True)
class HeldOut:
    """What is kept from the fit of one channel.

    Attributes
    ----------
    samples : (n,) array of bool
        True for what is held out; none where the recording is too short.
    cycle : int or None
        The cycle, where it is one.
    text : str
        "cycle 4", "every fourth block of 25 samples", "nothing".
    """

    samples: NDArray[np.bool_]
    cycle: int | None
    text: str


def held_out(recording: Recording) -> HeldOut:
    """Choose what to hold out of a recording; always the same for the same recording."""
    found = branches(recording)
    cycles = sorted({branch.cycle for branch in found})
    for cycle in reversed(cycles[1:]):
        if len(cycles) > _FEWEST_LEFT and _has_its_like(recording, found, cycle):
            samples = np.zeros(len(recording.displacement), dtype=bool)
            for branch in found:
                samples[branch.start : branch.stop] = branch.cycle == cycle
            return HeldOut(samples, cycle, f"cycle {cycle}")
    return _blocks(len(recording.displacement))


def _has_its_like(recording: Recording, found: tuple[Branch, ...], cycle: int) -> bool:
    q = recording.displacement
    inside, others = [b for b in found if b.cycle == cycle], [b for b in found if b.cycle != cycle]
    ranges = [np.concatenate([q[b.start : b.stop] for b in part]) for part in (inside, others)]
    slack = _BEYOND * float(np.ptp(ranges[1]))
    within = ranges[0].max() <= ranges[1].max() + slack and ranges[0].min() >= ranges[1].min() - slack
    held = any(b.kind == "hold" for b in inside) and not any(b.kind == "hold" for b in others)
    return bool(within and not held and _rates_known(recording, inside, others))


def _rates_known(recording: Recording, inside: list[Branch], others: list[Branch]) -> bool:
    found = branches(recording)
    rates = {branch: _rate(recording, found, i) for i, branch in enumerate(found) if branch.kind != "hold"}
    known, asked = ([rates[branch] for branch in part if branch in rates] for part in (others, inside))
    return all(any(v / _RATE <= other <= v * _RATE for other in known) for v in asked)


def _rate(recording: Recording, found: tuple[Branch, ...], i: int) -> float:
    if recording.time is None:
        return 1.0
    first, last = departure(found, i), found[i].stop - 1
    seconds = float(recording.time[last] - recording.time[first])
    way = abs(float(recording.displacement[last] - recording.displacement[first]))
    return way / seconds if seconds > 0 else 0.0


def _blocks(n: int) -> HeldOut:
    length = max(_SHORTEST, round(n / _BLOCKS))
    block = np.arange(n) // length
    # Neither the first block nor what is left over at the end: both would be extrapolation.
    samples = (block % _EVERY == _EVERY - 2) & (block < n // length - 1)
    if not samples.any():
        return HeldOut(np.zeros(n, dtype=bool), None, "nothing")
    return HeldOut(samples, None, f"every fourth block of {length} samples")
