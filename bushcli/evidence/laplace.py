"""The evidence of a fitted model: its likelihood averaged over the priors of its parameters, by Laplace's method.

The posterior is approximated by a Gaussian about the maximum a posteriori. Every parameter is measured in standard
deviations of its prior there, or of the prior of its logarithm. If an amplitude cannot be negative, only the part of
the Gaussian above zero counts; at an optimum on that bound, the slope that holds it there is taken into account.

References
----------
Kass and Raftery (1995), Bayes factors, J. Am. Stat. Assoc. 90:773-795, doi:10.1080/01621459.1995.10476572, section 4.1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from bushcli.evidence.prior import LAW_SHARE, ParameterPrior
from bushcli.likelihood.features import Features
from bushcli.likelihood.form import Judged, Left, Likelihood

Array = NDArray[np.float64]

# Precision, in units of the prior's standard deviation, with which a uniform prior or a Student's t enters a
# Gaussian: a parameter about which the data say nothing then contributes nothing to the evidence.
UNIFORM, STUDENT = 2.0 * math.pi / 12.0, 2.0 / math.pi
# Share of the forces below which their change by a law's whole parameter is rounding.
NO_INFLUENCE = 1e-9
# An amplitude nearer to its off value than this share of its posterior standard deviation counts as being on the bound:
# a search comes nearer to a bound by a factor of 200 in each iteration, and may end after two.
AT_OFF = 0.1


@dataclass(frozen=True, eq=False)
class Evidence:
    """The evidence of a model at its maximum a posteriori. Each quantity is calculated once, when first used.

    Parameters
    ----------
    likelihood : Likelihood
    misfit : sequence of (K,) array
        Features of the misfit that the model leaves, by channel.
    slopes : sequence of (K, p) array
        Their derivatives by the parameters.
    values : shape (p,)
    known : sequence of ParameterPrior or None
        Priors; None for a parameter of a law.
    off : sequence of float
        Off value of a one-sided amplitude, any number for other parameters.
    same_law : Evidence, optional
        Of another model with these derivatives by the law's parameters: what it loses to their priors is the same, and
        calculated once.
    """

    likelihood: Likelihood
    misfit: Sequence[Array]
    slopes: Sequence[Array]
    values: Array
    known: Sequence[ParameterPrior | None]
    off: Sequence[float]
    same_law: Evidence | None = None

    @cached_property
    def left(self) -> Left:
        """The misfit that the model leaves."""
        return self.likelihood.left(self.misfit)

    @cached_property
    def judgement(self) -> Judged:
        """Likelihood of the model."""
        return self.likelihood.judge(self.left)

    @cached_property
    def coarse(self) -> float:
        """Log likelihood by which the reach of predictions is measured (`Likelihood.coarse`)."""
        return self.likelihood.coarse(self.left)

    @cached_property
    def unknown_judgement(self) -> Judged:
        """Likelihood of the model with the unknown effect beside it."""
        return self.likelihood.judge_unknown(self.left)

    @cached_property
    def log(self) -> float:
        """Natural logarithm of the evidence, up to a constant that all models of a diagnosis share."""
        return self.judgement.log + self._laplace(self.judgement.scale)[0]

    @cached_property
    def log_unknown(self) -> float:
        """The same for the model with the unknown effect beside it."""
        return self.unknown_judgement.log + self._laplace(self.unknown_judgement.scale)[0]

    @cached_property
    def covariance(self) -> Array:
        """Covariance (p, p) of the posterior of the parameters, in their own units, without the unknown effect.

        The error of form is at least the median one: errors of a formula along the derivatives by its own parameters
        are absorbed by their values, and the remaining misfit does not show them.
        """
        least = self.likelihood.variances()
        wide = [max(a, float(b)) for a, b in zip(self.judgement.scale, least, strict=True)]
        units = self._priors[0]
        return self._laplace(wide)[1] * np.outer(units, units)

    @cached_property
    def _priors(self) -> tuple[Array, Array, Array]:
        return _prior(self.slopes, self.values, self.known, float(self.likelihood.signal.sum()))

    def _laplace(self, scale: Sequence[float]) -> tuple[float, Array]:
        """Logarithm of the average likelihood over the maximum, and covariance, for variances of the features."""
        gram, slope = _gram(self.likelihood.features, self.misfit, self.slopes, scale)
        log, covariance = _laplace(gram, slope, *self._priors, self.values, self.known, self.off)
        return log - self._shared_influence, covariance

    @cached_property
    def _shared_influence(self) -> float:
        """Log evidence (nats) lost to the priors of a law's parameters, redundant ones included.

        Otherwise laws with superfluous parameters would win over laws with the few that are needed. This compares
        laws: so that it is the same for all models with one law, it is taken for the same variances.
        """
        if self.same_law is not None:
            return self.same_law._shared_influence
        law = [i for i, prior in enumerate(self.known) if prior is None]
        if not law:
            return 0.0
        slopes = [J[:, law] for J in self.slopes]
        scale = tuple(map(float, self.likelihood.variances()))
        gram, _ = _gram(self.likelihood.features, self.misfit, slopes, scale)
        units, _, precision = (column[law] for column in self._priors)
        block = gram * np.outer(units, units) + np.diag(precision)
        return 0.5 * float(np.sum(np.log(np.diag(block)))) - 0.5 * float(np.linalg.slogdet(block)[1])


def _gram(
    features: Sequence[Features], misfit: Sequence[Array], slopes: Sequence[Array], scale: Sequence[float]
) -> tuple[Array, Array]:
    """Return second derivative (p, p) and gradient (p,) of half the weighted sum of squares."""
    J = np.vstack([feature.whiten(part, v) for feature, part, v in zip(features, slopes, scale, strict=True)])
    z = np.concatenate(
        [feature.whiten(part, v) for feature, part, v in zip(features, misfit, scale, strict=True)]
    )
    return J.T @ J, J.T @ z


def _prior(
    slopes: Sequence[Array], values: Array, known: Sequence[ParameterPrior | None], signal: float
) -> tuple[Array, Array, Array]:
    """Return each parameter's prior: standard deviation, log density (in that unit) at the value, and precision."""
    units, density, precision = np.ones(len(values)), np.zeros(len(values)), np.ones(len(values))
    for i, (value, parameter) in enumerate(zip(values, known, strict=True)):
        if parameter is None:
            size = math.sqrt(sum(float(J[:, i] @ J[:, i]) for J in slopes))
            # Of a value that changes nothing, such as a law's stiffening in a table about rest, the width is finite.
            widest = max(abs(float(value)), 1.0) / NO_INFLUENCE
            units[i] = min(LAW_SHARE * math.sqrt(signal) / max(size, 1e-300), widest)
            density[i] = -0.5 * math.log(2.0 * math.pi)
            continue
        prior, scales = parameter.prior, parameter.scales
        units[i] = 1.0 / math.sqrt(max(prior.curvature(float(value), scales), 1e-300))
        if prior.shape == "log_uniform" and value != 0.0:
            precision[i] = UNIFORM
        elif not prior.is_logarithmic:
            precision[i] = STUDENT
        if value == 0.0 and prior.is_logarithmic:
            # Switched off, where a logarithm has no density: taken as a parameter about which the data say nothing.
            units[i], density[i] = prior.median(scales), -0.5 * math.log(2.0 * math.pi)
            continue
        density[i] = prior.log_density(float(value), scales) + math.log(units[i])
    return units, density, precision


def _laplace(
    gram: Array,
    slope: Array,
    units: Array,
    density: Array,
    precision: Array,
    values: Array,
    known: Sequence[ParameterPrior | None],
    off: Sequence[float],
) -> tuple[float, Array]:
    """Return log(integral of likelihood times prior / maximum likelihood), and the covariance in the priors' units."""
    p = len(values)
    if p == 0:
        return 0.0, np.zeros((0, 0))
    hessian = gram * np.outer(units, units) + np.diag(precision)
    inverse = np.linalg.inv(hessian)
    _, log_det = np.linalg.slogdet(hessian)
    total = float(density.sum()) + 0.5 * p * math.log(2.0 * math.pi) - 0.5 * float(log_det)
    for i, prior in enumerate(known):
        if prior is None or not prior.one_sided:
            continue
        std = math.sqrt(inverse[i, i])
        above = (values[i] - off[i]) / units[i]
        # At the bound the slope of the misfit holds the amplitude there; elsewhere the slope vanishes.
        held = max(0.0, slope[i] * units[i]) if above < AT_OFF * std else 0.0
        t = above / std - held * std
        total += float(log_ndtr(t)) + 0.5 * (held * std) ** 2
    return total, inverse


def standard_errors(names: Sequence[str], evidence: Evidence) -> Mapping[str, float]:
    """Standard deviation of the posterior of each parameter.

    Parameters
    ----------
    names : sequence of str
    evidence : Evidence
    """
    return dict(zip(names, map(float, np.sqrt(np.maximum(np.diag(evidence.covariance), 0.0))), strict=True))
