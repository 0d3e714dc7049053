"""Effects that may be present but undetected: at any usual size they change these recordings too little.

An effect is found if it raises the evidence by more than its prior odds take away. To first order an effect of a given
size raises the logarithm of the evidence by half the sum of squares of its change of the features, as far as the fitted
parameters cannot make that change, in units of noise and error of form.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain

import numpy as np

from bushcli.selection.columns import shear_modulus
from bushcli.selection.neighbourhood import BORROWED
from bushcli.selection.predict import Beside
from bushcli.selection.prediction import Addition, known_amplitudes
from bushcli.selection.queue import Search
from bushcli.selection.state import State

WHY = (
    "even in its largest usual size it would be hidden by the noise and the errors of the formulas, once the other "
    "parameters have adapted themselves"
)


def unnoticed_effects(search: Search, state: State) -> dict[str, str]:
    """Return the effects that would stay unnoticed beside a model, and why.

    Parameters
    ----------
    search : Search
    state : State
        A fitted model.
    """
    beside = search.neighbourhood.beside(state)
    gains = _largest_gains(search, beside, chain(*beside.grouped.values()))
    # Derivatives beside the plain law are a fair estimate: where they leave it open, the effect is solved anew.
    doubtful = {name for name, gain in gains.items() if 1.0 / BORROWED < gain < BORROWED}
    among = [effect for effect in search.catalogue if effect.name in doubtful]
    gains |= _largest_gains(search, beside, search.derivatives.additions_beside(state, among=among))
    return {name: WHY for name, gain in gains.items() if gain < 1.0}


def _largest_gains(search: Search, beside: Beside, additions: Iterable[Addition]) -> dict[str, float]:
    """Return what each further effect would gain in its largest usual size, over what its prior odds take away."""
    state = beside.state
    problem, shear = state.problem, shear_modulus(state.model, state.problem.case)
    gains: dict[str, float] = {}
    present = {active.effect.name for active in state.model.effects}
    for addition in additions:
        name = addition.trial.effect.name
        if name in present:
            continue
        needed = search.odds(state.model) - search.odds(addition.trial.add_to(state.model))
        amplitudes = known_amplitudes(addition, problem.case, shear, problem.sound_recordings)
        # Each amplitude at the end of the 95 % range of its prior; what it gains, to first order, in nats.
        largest = [
            high if prior is None else min(high, prior.prior.range(prior.scales)[1])
            for prior, high in zip(amplitudes.known, amplitudes.high, strict=True)
        ]
        own = beside.changes(addition)[1] * np.array(largest)
        gains[name] = max(gains.get(name, 0.0), 0.5 * float(np.max(own**2, initial=0.0)) / needed)
    return gains
