"""From the posterior to the result: named effects with their values, rivals, channels, doubts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case, Material
from bushcli.diagnosis.evidence import standard_errors
from bushcli.diagnosis.likelihood.noise import Compared
from bushcli.diagnosis.model import Model
from bushcli.diagnosis.posterior import SHOWN, Weighed
from bushcli.diagnosis.prior import Known
from bushcli.diagnosis.queue import Search
from bushcli.diagnosis.result import (
    DiagnosedChannel,
    FormError,
    Named,
    Quantity,
    RankedModel,
    Verdict,
)
from bushcli.diagnosis.searched import Searched
from bushcli.diagnosis.state import State
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import EffectParameter, spoken
from bushcli.recording import Recording, displacement_noise
from bushcli.runtime.condition import Condition
from bushcli.simulate.schedule import schedule
from forms.law import law

Array = NDArray[np.float64]

# Probability by the prior of a value as far out, below which it is not what bushings have.
IMPLAUSIBLE = 1e-3
# Standard normal quantile of 97.5 %.
QUANTILE = 1.959964
# Noise of so many percent of the force range hides what is usually asked for: the literature takes 10 % of misfit for a
# good agreement of simulation and rig.
LOUD = 5.0


def verdict(best: Weighed, plain: Model) -> Verdict:
    """Return the verdict that the most probable model implies."""
    if best.unknown:
        return "unexplained"
    if best.state.model.effects:
        return "missing_physics"
    model = best.state.model
    same = (model.law, model.terms, model.fixed) == (plain.law, plain.terms, plain.fixed)
    return "explained" if same else "law_too_poor"


def ranked(models: Sequence[Weighed], search: Search) -> tuple[RankedModel, ...]:
    """Return all models that the report shows."""
    base = search.plain.evidence.log
    return tuple(
        RankedModel(
            one.state.model.law,
            one.effects,
            one.probability,
            one.log_evidence - base,
            None if one.predicted else one.state.size,
            None if one.predicted else one.state.evidence.judged.phi,
        )
        for one in models
        if one.probability >= SHOWN
    )


# -- values --------------------------------------------------------------------------------------------------------


def quantities(state: State, material: Material) -> dict[str, Quantity]:
    """Every identified parameter of a model by its full name, with its 95 % interval and its prior.

    Parameters
    ----------
    state
    material
        The case's: an effect may add to what it has.
    """
    fitted = state.fitted
    errors = standard_errors(fitted.names, state.evidence)
    of_law = {p.name: p for p in law(fitted.model.law).parameters}
    of_effects: dict[str, tuple[ActiveEffect, EffectParameter]] = {
        one.full_name(p): (one, p) for one in fitted.model.effects for p in one.parameters
    }
    found = {}
    for name, value in zip(fitted.names, map(float, fitted.x), strict=True):
        std = errors[name]
        low, high = value - QUANTILE * std, value + QUANTILE * std
        if name in of_law:
            found[name] = Quantity(value, std, of_law[name].unit, of_law[name].meaning, low, high)
            continue
        active, parameter = of_effects[name]
        known = state.priors.get(name)
        if known is not None and known.prior.is_logarithmic and value != 0.0:
            # The posterior is Gaussian in the logarithm.
            ends = [value * math.exp(sign * QUANTILE * min(std / abs(value), 5.0)) for sign in (-1.0, 1.0)]
            low, high = min(ends), max(ends)
        found[name] = Quantity(
            value,
            std,
            parameter.unit,
            parameter.meaning,
            max(parameter.lower, low),
            min(parameter.upper, high),
            derived(parameter, value, material),
            active.channels,
            None if known is None else known.prior.range(known.scales),
            1.0 if known is None else known.prior.tail(value, known.scales),
            "" if known is None else known.prior.source,
        )
    return found


def derived(parameter: EffectParameter, value: float, material: Material) -> dict[str, tuple[float, str]]:
    """Return the value under its other names: its reciprocal, and the sum with the case's own dimension."""
    if parameter.reciprocal is None or not value:
        return {}
    name, unit = parameter.reciprocal
    found = {name: (1.0 / value, unit)}
    present = getattr(material, parameter.adds_to) if parameter.adds_to else math.inf
    if math.isfinite(present):
        found[f"total_{name}"] = (1.0 / (value + 1.0 / present), unit)
    return found


def held(active: ActiveEffect, parameter: EffectParameter, known: Known | None) -> Quantity:
    """Return a parameter that a fit keeps fixed: a dimension of the mesh, or a choice."""
    value = float(active.values[parameter.name])
    choices: Sequence[str] = getattr(parameter, "choices", ())
    word = choices[round(value)] if choices else ""
    scales = None if known is None else known.prior.range(known.scales)
    return Quantity(
        value,
        0.0,
        parameter.unit,
        parameter.meaning,
        value,
        value,
        {},
        active.channels,
        scales,
        1.0,
        "",
        word,
    )


def named(
    best: Weighed, search: Search, probability: Mapping[str, float], material: Material
) -> tuple[Named, ...]:
    """The effects of the most probable model, the most probable first."""
    state, made = best.state, []
    values = quantities(state, material)
    for one in state.model.effects:
        own = {}
        for p in one.parameters:
            name = one.full_name(p)
            own[p.name] = values[name] if name in values else held(one, p, state.priors.get(name))
        less = Model(
            state.model.law,
            state.model.start,
            state.model.fixed,
            tuple(other for other in state.model.effects if other is not one),
            state.model.terms,
        )
        without = search.states.get(less.structure)
        bayes = float("nan") if without is None else 2.0 * (state.evidence.log - without.evidence.log)
        far = [name for name, quantity in own.items() if quantity.prior_tail < IMPLAUSIBLE]
        remark = f"few bushings have such a value of {' and '.join(far)}" if far else ""
        made.append(
            Named(
                one.name,
                one.effect.title or one.effect.name,
                one.effect.summary,
                own,
                probability.get(one.effect.name, 0.0),
                bayes,
                not far,
                remark,
                one.channels,
            )
        )
    return tuple(sorted(made, key=lambda item: -item.probability))


# -- channels ------------------------------------------------------------------------------------------------------


def channel(
    recording: Recording, before: Array, after: Array, sigma: float, used: NDArray[np.bool_], held_out: bool
) -> DiagnosedChannel:
    """A recording beside its simulation, before and after."""
    span = float(np.ptp(recording.force[used]))

    def percent(force: Array) -> float:
        return 100.0 * float(np.sqrt(np.mean((force - recording.force)[used] ** 2))) / span

    steps = schedule(recording.time, recording.displacement, displacement_noise(recording))
    clock = np.arange(len(recording.displacement), dtype=float) if recording.time is None else recording.time
    return DiagnosedChannel(
        recording.name or recording.mode,
        recording.mode,
        recording,
        before,
        after,
        percent(before),
        percent(after),
        100.0 * sigma / span,
        held_out,
        steps.path(clock),
        ~used,
    )


def form_error(best: Weighed, plain: State, compared: Sequence[Compared]) -> FormError:
    """Return the form error assumed for the most probable model."""
    likelihood, found = plain.problem.likelihood, best.state.evidence
    judged = found.judged_unknown if best.unknown else found.judged
    scale = np.array(judged.scale) - 1.0
    percent = {}
    for one, excess, m, features in zip(
        compared, scale, likelihood.effective, likelihood.features, strict=True
    ):
        samples = float(np.count_nonzero(features.weights))
        unit = one.noise.sigma * np.sqrt(one.noise.correlation_time)
        size = float(np.sqrt(max(excess, 0.0) * m / max(samples, 1.0))) * unit
        percent[one.name] = float(100.0 * size / np.ptp(one.recording.force))
    left = float(np.sum(np.maximum(best.state.evidence.left.excess, 0.0)))
    allowed = float(np.sum(np.maximum(scale, 0.0) * likelihood.effective))
    return FormError(judged.phi, percent, 1.0 if left <= allowed else allowed / left)


# -- doubts --------------------------------------------------------------------------------------------------------


def searched(search: Search) -> Searched:
    """Return the extent of the search."""
    return Searched(
        search.ended == "nothing left",
        search.left,
        search.ended,  # type: ignore[arg-type]
        tuple(search.rows),
        tuple(search.lost),
        dict(search.untestable),
    )


def doubts(
    case: Case, channels: Sequence[DiagnosedChannel], best: Weighed, search: Search
) -> list[Condition]:
    """What is doubtful about a diagnosis, as conditions with a remedy."""
    made = []
    if case.effects:
        names = ", ".join(spoken(one.name) for one in case.effects)
        made.append(
            Condition(
                "effects_of_the_case",
                f"the effects in the case file ({names}) are not used: a diagnosis begins with the law alone and "
                "looks for these like for all others",
                "nothing, if the diagnosis finds them; bushcli inverse identifies the law together with them",
            )
        )
    loud = [one for one in channels if one.noise_percent > LOUD]
    if loud:
        sizes = ", ".join(f"{one.name} {one.noise_percent:.0f} %" for one in loud)
        made.append(
            Condition(
                "loud_noise",
                f"the noise is large compared with the force range ({sizes}): smaller deviations cannot be detected",
                "record more samples on every branch, or with less noise; the noise is taken from neighbouring samples",
            )
        )
    if not best.state.fitted.converged:
        made.append(
            Condition(
                "not_converged",
                "the fit of the most probable model ended before it had converged",
                "begin with other start values in [material.parameters]",
            )
        )
    if search.lost:
        made.append(
            Condition(
                "models_lost",
                f"{len(search.lost)} models could not be solved from any start and have no probability: "
                + "; ".join(search.lost),
                "the recordings exclude none of them",
            )
        )
    if search.ended == "budget":
        made.append(
            Condition(
                "budget",
                f"the time limit was reached: further fits could shift up to {100 * search.left:.0f} % of the "
                "probability",
                "a larger --budget, or --resume with it",
            )
        )
    return made
