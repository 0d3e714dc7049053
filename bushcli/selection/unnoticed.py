"""Effects that may be present but undetected: at any usual size they change these recordings too little.

An effect is found if it raises the evidence by more than its prior odds take away. To first order an effect of a given
size raises the logarithm of the evidence by half the sum of squares of its change of the features, as far as the fitted
parameters cannot make that change, in units of noise and error of form.
"""

from __future__ import annotations

from itertools import chain

import numpy as np

from bushcli.selection.columns import shear_modulus
from bushcli.selection.prediction import known_amplitudes
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
    beside, problem = search.beside(state), state.problem
    shear = shear_modulus(state.model, problem.case)
    seen: dict[str, bool] = {}
    for addition in chain(*beside.grouped.values()):
        name = addition.trial.effect.name
        model = addition.trial.add_to(state.model)
        needed = search.odds(state.model) - search.odds(model)
        amplitudes = known_amplitudes(addition, problem.case, shear, problem.sound_recordings)
        # Each amplitude at the end of the 95 % range of its prior; what it gains, to first order, in nats.
        largest = [
            high if prior is None else min(high, prior.prior.range(prior.scales)[1])
            for prior, high in zip(amplitudes.known, amplitudes.high, strict=True)
        ]
        own = beside.changes(addition)[1] * np.array(largest)
        seen[name] = seen.get(name, False) or 0.5 * float(np.max(own**2, initial=0.0)) > needed
    present = {active.effect.name for active in state.model.effects}
    return {name: WHY for name, noticed in seen.items() if not noticed and name not in present}
