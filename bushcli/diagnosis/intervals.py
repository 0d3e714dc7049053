"""Intervals of identified values over all models that have them, not only the most probable one.

Models that explain a recording equally well may have different values of a common parameter: a debonded length beside
a compliant rig is shorter than one by itself. The posterior of a value is the mean of its posteriors in the models,
weighted with the probabilities of the models. One of three branches has another meaning than one of two: the values of
an effect with several branches are averaged only over models with the same number of them, matched in the order of
their times or slips.

References
----------
Hoeting, Madigan, Raftery and Volinsky (1999), Bayesian model averaging: a tutorial, Stat. Sci. 14:382-417,
doi:10.1214/ss/1009212519.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from scipy.optimize import brentq
from scipy.special import ndtr

from bushcli.diagnosis.posterior import WeighedModel
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import EffectParameter
from bushcli.evidence.laplace import standard_errors

# Probability on either side of a 95 % interval.
TAIL = 0.025
# Models with a smaller share of a value's probability do not move its interval.
SEEN = 1e-3
# Standard deviations beyond which a Gaussian counts as zero, and the largest standard deviation of a logarithm. A
# Gaussian's tail is 1e-15 there; a factor of 150 tells nothing of a value.
FAR, WIDEST = 8.0, 5.0


@dataclass(frozen=True)
class Component:
    """The posterior of a value in one model: a Gaussian, of the value or of its logarithm.

    Attributes
    ----------
    weight : float
        Probability of the model.
    value, std : float
        In the unit of the parameter.
    """

    weight: float
    value: float
    std: float
    is_logarithmic: bool

    def at(self, deviations: float) -> float:
        """Return the value that is `deviations` standard deviations above the median, in the unit of the parameter."""
        if not self._in_logarithm:
            return self.value + deviations * self.std
        return self.value * math.exp(math.copysign(deviations, self.value * deviations) * self._relative)

    def below(self, value: float) -> float:
        """Return the probability of values below `value`, which is in the unit of the parameter."""
        if not self._in_logarithm:
            return float(ndtr((value - self.value) / self.std)) if self.std else float(value >= self.value)
        if value * self.value <= 0.0:
            return float(value > self.value)
        probability = float(ndtr(math.log(value / self.value) / self._relative))
        return probability if self.value > 0.0 else 1.0 - probability

    @property
    def _in_logarithm(self) -> bool:
        return self.is_logarithmic and self.value != 0.0 and self.std > 0.0

    @property
    def _relative(self) -> float:
        return min(self.std / abs(self.value), WIDEST)


def interval(components: Sequence[Component]) -> tuple[float, float]:
    """Return the 95 % interval of the mean of several posteriors; their weights need not add up to one."""
    total = sum(component.weight for component in components)
    seen = [component for component in components if component.weight > SEEN * total] or list(components)
    total = sum(component.weight for component in seen)
    low = min(component.at(-FAR) for component in seen)
    high = max(component.at(FAR) for component in seen)
    if not high > low:
        return low, high

    def below(value: float) -> float:
        return sum(component.weight * component.below(value) for component in seen) / total

    lower, upper = (
        float(brentq(lambda value, tail=tail: below(value) - tail, low, high)) for tail in (TAIL, 1.0 - TAIL)
    )
    return lower, upper


def components(
    parameter: str, models: Sequence[WeighedModel], law: str = "", effect: str = ""
) -> list[Component]:
    """Return the posterior of a fitted parameter in every model that has it; the most probable model is the first.

    The parameter has its name in the law `law`, or in the effect of identity `effect`: the gain error of one channel is
    not that of another.
    """
    posterior = []
    active = next((own for own in models[0].state.fitted.model.effects if own.identity == effect), None)
    for model in models:
        fitted, name = model.state.fitted, parameter
        if not law:
            same = next((own for own in fitted.model.effects if own.identity == effect), None)
            name = "" if active is None or same is None else _counterpart(parameter, active, same)
        if model.predicted is not None or name not in fitted.names or law not in ("", fitted.model.law):
            continue
        known = model.state.priors.get(name)
        i = fitted.names.index(name)
        std = standard_errors(fitted.names, model.state.evidence)[name]
        logarithmic = not law and known is not None and known.prior.is_logarithmic
        posterior.append(Component(model.probability, float(fitted.x[i]), std, logarithmic))
    return posterior


def _counterpart(parameter: str, active: ActiveEffect, other: ActiveEffect) -> str:
    """Return the full name of a parameter of `active` in the same effect of another model; "" if there is none."""
    ours, theirs = _branches(active), _branches(other)
    if len(ours) != len(theirs):
        return ""
    stem = active.effect.parameter(parameter).stem
    number = parameter[len(stem) :]
    if number in ours:
        number = theirs[ours.index(number)]
    return f"{other.name}.{stem}{number}"


def _branches(active: ActiveEffect) -> list[str]:
    """Numbers at the ends of the names of an effect's branches, in the order of times or slips; [] without branches."""
    stem = next((p.stem for p in active.effect.parameters if p.off is None and p.name != p.stem), None)
    same = [p.name for p in active.effect.parameters if p.stem == stem and p.name in active.values]
    values = {name[len(stem or "") :]: active.values[name] for name in same}
    return sorted(values, key=lambda number: values[number])


def scanned_interval(
    active: ActiveEffect, parameter: EffectParameter, models: Sequence[WeighedModel]
) -> tuple[float, float]:
    """Return the 95 % interval of a value that is scanned because it changes the mesh.

    Each value of the scan represents the range up to the geometric means with its neighbours; `active` has the value of
    the most probable model.
    """
    name, share = active.full_name(parameter), dict[float, float]()
    for model in models:
        value = model.model.values.get(name)
        if value is not None:
            share[float(value)] = share.get(float(value), 0.0) + model.probability
    points = sorted({*map(float, parameter.scan), *share, float(active.values[parameter.name])})
    if len(points) < 2:
        return points[0], points[0]
    edges = [math.sqrt(a * b) for a, b in pairwise(points)]
    edges = [points[0] ** 2 / edges[0], *edges, points[-1] ** 2 / edges[-1]]
    total = sum(share.values())
    if not total > 0.0:
        raise ValueError(f"no model has {name}")

    def quantile(probability: float) -> float:
        below = 0.0
        for point, (low, high) in zip(points, pairwise(edges), strict=True):
            part = share.get(point, 0.0) / total
            if below + part >= probability and part > 0.0:
                return float(low * (high / low) ** ((probability - below) / part))
            below += part
        return float(edges[-1])

    return quantile(TAIL), quantile(1.0 - TAIL)
