"""The least-squares problem of a fit: features of the misfit and priors, in units of their standard deviations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.evidence.prior import ParameterPrior
from bushcli.inverse.channel import StepLimit
from bushcli.inverse.problem import LeastSquaresProblem, Progress, Stopping
from bushcli.inverse.table_channel import AnyChannel
from bushcli.likelihood.calibration import factor_of
from bushcli.likelihood.features import Features, features
from bushcli.likelihood.form import Judged, Likelihood
from bushcli.likelihood.noise import NoiseModel, noise_model

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Factor below which a variance counts as unchanged. Other values change probabilities by less than 0.002
# (`benchmarks/constants.md`).
SETTLED = 1.3


class Posterior(LeastSquaresProblem):
    """The least-squares problem whose sum of squares is twice the negative logarithm of the posterior density.

    Parameters
    ----------
    identification : LeastSquaresProblem
        The same channels and parameters, fitted as an identification fits them.
    likelihood : Likelihood
    variances : tuple of float
        Variance of the features of each channel, dimensionless, with which the fit begins.
    known : mapping of str to ParameterPrior
        Priors of the parameters that have one.
    stopping : Stopping
        When searches end.
    limits : sequence of StepLimit
        Failed steps after which marches are given up, by channel.
    progress : callable, optional
        Called after each evaluation.
    """

    def __init__(
        self,
        identification: LeastSquaresProblem,
        likelihood: Likelihood,
        variances: tuple[float, ...],
        known: Mapping[str, ParameterPrior],
        stopping: Stopping,
        limits: Sequence[StepLimit],
        progress: Progress | None = None,
    ) -> None:
        super().__init__(*identification.posed, stopping=stopping, limits=limits, progress=progress)
        self.likelihood, self.variances, self.known = likelihood, variances, known

    @property
    def features(self) -> tuple[Features, ...]:
        """Features of each channel."""
        return self.likelihood.features

    @property
    def samples(self) -> int:
        """Number of rows without those that penalise instability."""
        return sum(feature.count for feature in self.features) + len(self.names)

    @property
    def unit(self) -> float:
        """Factor that brings rows to the order of one, so that instability is penalised as in an identification."""
        return float(np.sqrt(len(self.channels) / sum(feature.count for feature in self.features)))

    def objective(self, x: Array) -> float:
        """Twice the negative logarithm of the posterior density, up to a constant; NaN where a march failed."""
        forces = self.forces(x)
        if forces is None:
            return float("nan")
        rows = self.misfit(forces)
        prior = sum(
            self.known[n].row(float(v))[0] ** 2 for n, v in zip(self.names, x, strict=True) if n in self.known
        )
        return prior - 2.0 * self.judge(rows).log

    def misfit(self, forces: Sequence[tuple[Array, Array]]) -> list[Array]:
        """Return the features (K,) of the misfit that forces, as `forces` returns them, leave in each channel."""
        return [
            feature.of(force - channel.measured)
            for feature, channel, (force, _) in zip(self.features, self.channels, forces, strict=True)
        ]

    def judge(self, rows: Sequence[Array]) -> Judged:
        """Return the likelihood of features (K,) of each channel."""
        return self.likelihood.judge(self.likelihood.left(rows))

    def rescale(self, x: Array) -> float:
        """Set the variances to those of the likelihood at a point; return the largest factor by which one changed."""
        factor, self.variances = self.variance_change(x)
        return factor

    def variance_change(self, x: Array) -> tuple[float, tuple[float, ...]]:
        """Return the variances of the likelihood at a solved point, and the largest factor by which one differs."""
        forces = self.forces(x)
        assert forces is not None
        now = self.judge(self.misfit(forces)).scale
        return max(max(a / b, b / a) for a, b in zip(self.variances, now, strict=True)), now

    def _rows(self, x: Array) -> tuple[Array, Array]:
        forces = self.forces(x)
        if forces is None:
            size = self.samples + len(self.states)
            return np.full(size, np.nan), np.full((size, len(x)), np.nan)
        values, slopes = [], []
        for channel, feature, variance, (force, slope) in zip(
            self.channels, self.features, self.variances, forces, strict=True
        ):
            values.append(self.unit * feature.whiten(feature.of(force - channel.measured), variance))
            slopes.append(self.unit * feature.whiten(feature.of(slope), variance))
        prior = [
            self.known[n].row(float(v)) if n in self.known else (0.0, 0.0)
            for n, v in zip(self.names, x, strict=True)
        ]
        values.append(self.unit * np.array([row for row, _ in prior]))
        slopes.append(self.unit * np.diag([slope for _, slope in prior]))
        value, slope = self._stability(x)
        return np.concatenate([*values, value]), np.concatenate([*slopes, slope])


def features_of(
    channels: Sequence[AnyChannel], used: Sequence[Mask], noises: Sequence[NoiseModel]
) -> tuple[Features, ...]:
    """Return the features of each channel.

    Parameters
    ----------
    channels : sequence of AnyChannel
    used : sequence of (n,) array of bool
        Samples that count.
    noises : sequence of NoiseModel
        If empty, the noise is estimated from each recording.
    """
    known = noises or [noise_model(c.recording, m) for c, m in zip(channels, used, strict=True)]
    rows = zip(channels, known, used, strict=True)
    return tuple(features(c.recording, noise, m, factor_of(c)) for c, noise, m in rows)
