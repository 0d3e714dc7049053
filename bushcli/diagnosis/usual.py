"""How large an effect's parameters usually are: what is offset or stopped in a rig goes by what the rig does.

A stop of 100 N/mm is much beside a bushing pushed along its axis and nothing beside the same one pushed across.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bushcli.effect import Effect, EffectParameter
from bushcli.recording import Recording


def usual_value(effect: Effect, parameter: EffectParameter, recordings: Sequence[Recording]) -> float:
    """A typical value of a parameter, in N, mm, MPa, s, rad.

    Parameters
    ----------
    recordings
        Of a parameter of a channel, the largest value of those that the effect acts on.
    """
    acting = [one for one in recordings if effect.acts_on(one.mode)]
    if not parameter.share or not acting:
        return parameter.start
    return max(parameter.share * _largest(one, parameter.unit) for one in acting)


def usual_size(effect: Effect, parameter: EffectParameter, recordings: Sequence[Recording]) -> float:
    """Difference of an amplitude's typical value from the one at which the effect is absent; more than 0."""
    return abs(usual_value(effect, parameter, recordings) - float(parameter.off or 0.0))


def _largest(recording: Recording, unit: str) -> float:
    displacement, force = (float(np.abs(v).max()) for v in (recording.displacement, recording.force))
    return {"mm": displacement, "N": force, "N/mm": force / max(displacement, 1e-300)}[unit]
