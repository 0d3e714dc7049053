"""A fitted model as the calculation uses it: its features, priors and evidence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from bushcli.case import Case
from bushcli.evidence.laplace import Evidence
from bushcli.evidence.prior import ParameterPrior, known_parameters
from bushcli.inverse.bounds import Bounds
from bushcli.likelihood.form import Likelihood
from bushcli.likelihood.noise import Compared, NoiseModel
from bushcli.recording import Recording
from bushcli.selection.columns import shear_modulus
from bushcli.selection.model import Fitted, Model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CommonData:
    """Common data with which every model is compared.

    Attributes
    ----------
    case : Case
        Without effects.
    used : tuple of array of bool, shape (n,) each
        Samples that count.
    """

    case: Case
    recordings: tuple[Recording, ...]
    noises: tuple[NoiseModel, ...]
    used: tuple[NDArray[np.bool_], ...]
    likelihood: Likelihood

    @cached_property
    def sound_recordings(self) -> tuple[Recording, ...]:
        """The recordings without samples that do not count: a spike must not set the scale of a prior."""
        return tuple(
            recording.with_gaps_interpolated(used)
            for recording, used in zip(self.recordings, self.used, strict=True)
        )

    @property
    def variances(self) -> tuple[float, ...]:
        """Variance of the features of each channel with which a fit begins."""
        return tuple(map(float, self.likelihood.variances()))

    def compared_recordings(self, simulated: Sequence[Array]) -> tuple[Compared, ...]:
        """Each recording with its simulation, which is NaN at samples that do not count."""
        return tuple(
            Compared(recording, np.where(used, force, np.nan), noise)
            for recording, used, force, noise in zip(
                self.recordings, self.used, simulated, self.noises, strict=True
            )
        )


@dataclass(frozen=True)
class State:
    """A fitted model with its evidence."""

    problem: CommonData
    fitted: Fitted

    @property
    def model(self) -> Model:
        """The model with its best-fitting values."""
        return self.fitted.model

    @cached_property
    def misfit(self) -> tuple[Array, ...]:
        """Features (K,) of the misfit that the model leaves, by channel."""
        return tuple(
            feature.of(force - recording.force)
            for feature, force, recording in zip(
                self.problem.likelihood.features, self.fitted.simulated, self.problem.recordings, strict=True
            )
        )

    @cached_property
    def slopes(self) -> tuple[Array, ...]:
        """Derivatives (K, p) of the misfit's features by the parameters, by channel."""
        pairs = zip(self.problem.likelihood.features, self.fitted.jacobians, strict=True)
        return tuple(feature.of(slope) for feature, slope in pairs)

    @cached_property
    def priors(self) -> dict[str, ParameterPrior]:
        """Priors of the effects' parameters, by full name."""
        shear = shear_modulus(self.model, self.problem.case)
        return known_parameters(self.problem.case, self.model.effects, shear, self.problem.sound_recordings)

    @property
    def parameter_priors(self) -> list[ParameterPrior | None]:
        """Prior of each parameter; None for those of a law."""
        return [self.priors.get(name) for name in self.fitted.names]

    @property
    def off_values(self) -> list[float]:
        """Off value of each parameter, 0 where it has none."""
        return self.model.off_values(self.fitted.names)

    def held_parameters(self, misfit: Array, slopes: Array) -> tuple[NDArray[np.bool_], Array]:
        """Return which parameters bounds hold at the first-order optimum, shape (p,), and the parameters there.

        Where a bound holds a parameter, that is its value exactly; the others keep those of the fit.

        Parameters
        ----------
        misfit : array, shape (rows,)
            Weighted misfit and priors, in standard deviations.
        slopes : array, shape (rows, p)
            Their derivatives by the parameters, per unit of these.
        """
        lower, upper = self.bounds.lower, self.bounds.upper
        low, high = lower - self.fitted.x, upper - self.fitted.x
        size = np.linalg.norm(slopes, axis=0)
        size[size == 0.0] = 1.0
        free = np.linalg.lstsq(slopes / size, -misfit)[0] / size
        if np.all((low <= free) & (free <= high)):
            return np.zeros(len(free), dtype=bool), self.fitted.x
        limits = np.minimum(low * size, 0.0), np.maximum(high * size, 0.0)
        solution = lsq_linear(slopes / size, -misfit, limits, method="bvls")
        bounds = np.where(solution.active_mask < 0, lower, upper)
        held = solution.active_mask != 0
        return held, np.where(held, bounds, self.fitted.x)

    @cached_property
    def bounds(self) -> Bounds:
        """Bounds of the parameters (p,) in the order of the fit."""
        task = self.model.task(self.problem.case, self.problem.recordings)
        bounds = task.vectors()[1]
        order = [task.names.index(name) for name in self.fitted.names]
        return Bounds(bounds.lower[order], bounds.upper[order])

    @cached_property
    def evidence(self) -> Evidence:
        """Evidence of the model."""
        priors, off = self.parameter_priors, self.off_values
        return Evidence(self.problem.likelihood, self.misfit, self.slopes, self.fitted.x, priors, off)

    @property
    def leaves_misfit(self) -> bool:
        """Whether more is left than noise would leave in one recording of forty: two standard deviations."""
        noise = 2.0 * math.sqrt(2.0 * sum(feature.count for feature in self.problem.likelihood.features))
        return float(self.evidence.left.excess.sum()) > noise

    def without(self, removed: Sequence[str]) -> State:
        """The model without some of its effects, to first order: the curves change by the amplitudes' derivatives.

        The other parameters keep their values; `predict.Beside` adapts them.
        """
        remaining = tuple(active for active in self.model.effects if active.identity not in removed)
        leaving = [active for active in self.model.effects if active.identity in removed]
        amplitudes = {active.full_name(p) for active in leaving for p in active.effect.amplitudes}
        parameters = {active.full_name(p) for active in leaving for p in active.parameters}
        model = replace(self.model, effects=remaining)
        # An effect that was named with its channel may now be the only one of its name.
        renamed = {
            old.full_name(p): new.full_name(p)
            for old, new in zip(remaining, model.effects, strict=True)
            for p in old.parameters
        }
        names = self.fitted.names
        changes = zip(names, self.fitted.x, self.off_values, strict=True)
        change = np.array([off - x if name in amplitudes else 0.0 for name, x, off in changes])
        keep = [i for i, name in enumerate(names) if name not in parameters]
        fitted = replace(
            self.fitted,
            model=model,
            names=tuple(renamed.get(names[i], names[i]) for i in keep),
            x=self.fitted.x[keep],
            simulated=tuple(
                force + slope @ change
                for force, slope in zip(self.fitted.simulated, self.fitted.jacobians, strict=True)
            ),
            jacobians=tuple(slope[:, keep] for slope in self.fitted.jacobians),
        )
        return State(self.problem, fitted)

    def with_law(self, other: State, plain: State) -> State:
        """The model with another law, to first order: the curves change by the difference of the laws without effects.

        Parameters
        ----------
        other : State
            The fit of the other law without effects, or of the same law with free parameters.
        plain : State
            The model's own law without effects.
        """
        removed = [
            e.identity for e in self.model.effects if e.effect.needs_fixed_law and not other.model.fixed
        ]
        state = self.without(removed)
        old, new = state.fitted, other.fitted
        model = replace(
            state.model,
            law=new.model.law,
            start=dict(new.model.start),
            fixed=new.model.fixed,
            terms=new.model.terms,
            anchor=dict(new.model.start),
        )
        keep = [i for i, name in enumerate(old.names) if name not in state.model.start]
        change = zip(old.simulated, new.simulated, plain.fitted.simulated, strict=True)
        slopes = zip(old.jacobians, new.jacobians, strict=True)
        fitted = replace(
            old,
            model=model,
            names=(*new.names, *(old.names[i] for i in keep)),
            x=np.concatenate([new.x, old.x[keep]]),
            simulated=tuple(force + b - a for force, b, a in change),
            jacobians=tuple(np.hstack([b, a[:, keep]]) for a, b in slopes),
        )
        return State(self.problem, fitted)

    @property
    def objective(self) -> float:
        """Objective of the fit: twice the negative logarithm of the posterior density, up to a constant."""
        prior = sum(
            prior.row(float(value))[0] ** 2
            for value, prior in zip(self.fitted.x, self.parameter_priors, strict=True)
            if prior is not None
        )
        return prior - 2.0 * self.evidence.judgement.log

    @property
    def misfit_over_noise(self) -> float:
        """Root mean square misfit over the noise."""
        total = count = 0.0
        for channel in self.problem.compared_recordings(self.fitted.simulated):
            total += float(np.nansum((channel.misfit * channel.weights) ** 2))
            count += channel.effective_samples
        return float(np.sqrt(total / max(count, 1.0)))
