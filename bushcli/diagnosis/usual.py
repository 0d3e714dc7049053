"""How large an effect's parameters usually are: what is offset or stopped in a rig goes by what the rig does.

A stop of 100 N/mm is much beside a bushing pushed along its axis and nothing beside the same one pushed across; a lag
of a second is much in a test of a minute that is sampled a hundred times a second, and nothing in one of an hour.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bushcli.casefile.unit import outside, unit
from bushcli.effect import Effect, EffectParameter
from bushcli.recording import Recording
from cases.mode import modes


def usual_value(effect: Effect, parameter: EffectParameter, recordings: Sequence[Recording]) -> float:
    """A typical value of a parameter, in N, mm, MPa, s, rad.

    Parameters
    ----------
    recordings
        Of a parameter of a channel, and of a time that goes by the samples, the largest value of those that the effect
        acts on.
    """
    acting = [one for one in recordings if effect.acts_on(one.mode)]
    if parameter.samples:
        intervals = [float(np.median(np.diff(one.time))) for one in acting if one.time is not None]
        return max(parameter.start, parameter.samples * max(intervals, default=0.0))
    if not parameter.share or not acting:
        return parameter.start
    return max(parameter.share * _largest(one, parameter.unit) for one in acting)


def usual_size(effect: Effect, parameter: EffectParameter, recordings: Sequence[Recording]) -> float:
    """Difference of an amplitude's typical value from the one at which the effect is absent; more than 0."""
    return abs(usual_value(effect, parameter, recordings) - float(parameter.off or 0.0))


def admitted(
    effect: Effect, parameter: EffectParameter, recordings: Sequence[Recording]
) -> tuple[float, float]:
    """Lowest and highest value that a diagnosis considers, in N, mm, MPa, s, rad."""
    acting = [one for one in recordings if effect.acts_on(one.mode)]
    if not math.isfinite(parameter.most) or not acting:
        return parameter.lower, parameter.upper
    size = max(parameter.most * _largest(one, parameter.unit) for one in acting)
    off = float(parameter.off or 0.0)
    return max(parameter.lower, off - size), min(parameter.upper, off + size)


def in_words(parameter: EffectParameter, value: float, recordings: Sequence[Recording]) -> str:
    """Name, value and unit as the case file has them on these channels: "displacement = 0.3 degrees"."""
    rotational = any(modes()[one.mode].rotational for one in recordings)
    of = unit(parameter, rotational)
    return f"{parameter.name} = {outside(parameter, value, rotational):.3g}{'' if of == '1' else f' {of}'}"


def _largest(recording: Recording, unit: str) -> float:
    displacement, force = (float(np.abs(v).max()) for v in (recording.displacement, recording.force))
    return {"mm": displacement, "N": force, "N/mm": force / max(displacement, 1e-300)}[unit]
