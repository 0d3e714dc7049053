"""What is doubtful about a diagnosis, as conditions with a remedy."""

from __future__ import annotations

import numpy as np

from bushcli.casefile import Case
from bushcli.condition import Condition
from bushcli.diagnosis.locate import Location
from bushcli.diagnosis.result import DiagnosedChannel
from bushcli.diagnosis.selected import Selection, at_noise
from bushcli.effect import spoken

# Noise of so many percent of the force range hides what is usually asked for: the literature takes 10 % of misfit for a
# good agreement of simulation and rig.
LOUD = 5.0


def doubts_of_the_data(case: Case, channels: tuple[DiagnosedChannel, ...]) -> list[Condition]:
    """What is doubtful about the case and its recordings, whatever the answer."""
    made = []
    if case.effects:
        names = ", ".join(spoken(one.name) for one in case.effects)
        made.append(
            Condition(
                "effects_of_the_case",
                f"what the case says of effects ({names}) is not used: the plain law is without any, and they are "
                "looked for like all others",
                "nothing, if they are found again; bushcli inverse identifies the law with them",
            )
        )
    loud = [one for one in channels if one.noise_percent > LOUD]
    if loud:
        sizes = ", ".join(f"{one.name} {one.noise_percent:.0f} %" for one in loud)
        made.append(
            Condition(
                "loud_noise",
                f"what passes for noise is large against the force range ({sizes}): nothing smaller can be seen",
                "record more samples on every branch, or with less noise; the noise is taken from neighbouring samples",
            )
        )
    return made


def doubts_of_the_model(
    found: Selection, remaining: Location, before: float, after: float
) -> list[Condition]:
    """What is doubtful about the final model, given the prediction without and with its effects."""
    made = []
    changed = bool(found.best.model.effects) or found.best.model.law != found.plain.model.law
    if changed and at_noise(found.best) is None:
        made.append(
            Condition(
                "misfit_above_noise",
                f"the final model still misses the recordings by {found.best.size:.2g} times the noise",
                "what is left is not in the catalogue, or the mesh or the calibration is worse than assumed: see where "
                "it remains",
            )
        )
    if np.isfinite(before) and np.isfinite(after) and found.best.model.effects and after >= before:
        made.append(
            Condition(
                "no_better_prediction",
                "what was held out is predicted no better with the effects "
                f"({after:.2g} against {before:.2g} of the noise)",
                "record another cycle, or another channel, and diagnose again",
            )
        )
    if not found.best.converged:
        made.append(
            Condition(
                "not_converged",
                "the search for the final model's parameters ended before it had converged",
                "begin with other start values in [material.parameters]",
            )
        )
    return made
