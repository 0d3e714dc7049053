"""The features of a finite-element model that follow from the effects of its channel."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bushcli.effects.active import ActiveEffect
from cases.feature import Installed


def features_of(active: Sequence[ActiveEffect]) -> list[Installed]:
    """Return the features of the effects that act on the finite-element model, with their values.

    Parameters
    ----------
    active
        Effects of one channel; parameters without a value get their start value.
    """
    features = []
    for effect in active:
        if effect.effect.feature is not None:
            values = effect.with_start_values().values
            words = {p.name: p.choice(values[p.name]) for p in effect.effect.parameters if p.choices}
            numbers = {name: value for name, value in values.items() if name not in words}
            temperature = math.nan if effect.temperature is None else effect.temperature
            features.append(Installed(effect.name, effect.effect.feature(**words), numbers, temperature))
    return features
