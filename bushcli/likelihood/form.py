"""The error of form: formulas of a true effect are wrong by an unknown share of the misfit that they explain.

A formula that has the right physics leaves a share of about `PHI` of the misfit that it explains, smooth along the
path; a law leaves about `LAMBDA` of the force. Such a misfit has few degrees of freedom, however many samples show it;
their number grows with the features of all channels (`effective_features`), which share it. With a the feature along
the force, E the sum of squares of the others beyond the expectation of noise, D that of all features of the plain law's
misfit less what the model leaves of it, F that of the force, and m effective features, the likelihood of a model is

    log L = log of the mean over phi, lambda and s of prod_c v_c^(-(m_c - 1)/2) exp(-(m_c - 1 + E_c) / (2 v_c))
            (v_c + g_c)^(-1/2) exp(-a_c^2 / (2 (v_c + g_c))),
    v_c = s_c^2 + (phi^2 D_c + lambda^2 F_c) / m_c.

g_c is the variance of calibration, from the class of the load cell: the error of form does not widen it. s_c is the
noise over its estimate, log-normal about one (`Features.doubt`): if the estimate counted as exact, noise that is a
fifth larger would make sixty features call for physics that is not there. A negative E, of a fit closer than the
noise, is divided among the effective and the other features; the part of the others is multiplied by s_c^2, so that
without error of form it counts the same for every s_c.

If the misfit is small beside the noise, v is near 1, and this is the likelihood of the noise, exp(-E/2). If formulas
err by more than the noise, v is large, and the data are weighted only as sharply as the formulas deserve: with phi
free, a model that leaves twice the misfit of another loses m log 2, not the difference of two sums over hundreds of
samples. This is a coarsened likelihood whose scale is marginalised.

D_c is half the channel's own plus half its share, by the force, of the sum over all channels: the formula of an effect
that mostly changes one channel is as wrong in the others. The plain law explains nothing, so that its D is zero: what
it leaves has to be noise or the error of a law.

References
----------
Kennedy and O'Hagan (2001), Bayesian calibration of computer models, J. R. Stat. Soc. B 63:425-464,
doi:10.1111/1467-9868.00294.
Miller and Dunson (2019), Robust Bayesian inference via coarsening, J. Am. Stat. Assoc. 114:1113-1125,
doi:10.1080/01621459.2018.1469995.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bushcli.likelihood.features import Features

Array = NDArray[np.float64]


def _normal(nodes: Array) -> Array:
    """Return weights of equidistant nodes (in standard deviations) for an average over a normal variable."""
    density = np.exp(-0.5 * nodes**2)
    return np.asarray(density / density.sum())


# Share of the plain law's misfit that the right physics in another formula leaves: median, standard deviation of the
# logarithm, and limit above which it counts as other physics. Measured on 26 channels of 18 other formulas
# (`benchmarks/form`; 24 are below a half, with median 0.14 and standard deviation 0.67). On six recordings of other
# codes and of measured rubber it was 0.08 to 0.21.
PHI, PHI_SPREAD, PHI_MOST = 0.14, 0.65, 0.5
# The same for the share of the force that a law leaves, measured on twelve channels without effects: 0.00065 and 0.8.
LAMBDA, LAMBDA_SPREAD = 0.001, 0.7
# Effective number of features of an error of form in recordings of K features: FACTOR K^POWER. Of eleven such formulas,
# this is one of those that give the right answers the highest probability on 42 recordings of the development deck,
# with the same fits (`benchmarks/form/again.md`): 5 on loops (K = 12), 11 and 14 on programs of 50 and 85 features.
# The participation ratios of the misfit that the right physics leaves are 3, 10 and 14 there.
FACTOR, POWER = 1.5, 0.5
# Nodes of the quadrature over each, in standard deviations of the logarithm. 33 within ±4 change probabilities by up
# to 0.002 (`benchmarks/constants.md`).
_NODES = np.linspace(-3.0, 3.0, 13, dtype=np.float64)
_WEIGHTS = _normal(_NODES)
_PHIS = PHI * np.exp(PHI_SPREAD * _NODES[PHI * np.exp(PHI_SPREAD * _NODES) < PHI_MOST])
_PHI_WEIGHTS = _WEIGHTS[: len(_PHIS)] / _WEIGHTS[: len(_PHIS)].sum()
_LAMBDAS = LAMBDA * np.exp(LAMBDA_SPREAD * _NODES)
# The same for the noise's uncertainty, which is narrow. 17 within ±4 change probabilities by 0.003
# (`benchmarks/constants.md`).
_NOISE_NODES = np.linspace(-3.0, 3.0, 7, dtype=np.float64)
_NOISE_WEIGHTS = _normal(_NOISE_NODES)
# The unknown effect: limits of its size over the force, log-uniform. Other limits change probabilities by up to
# 0.004, 50 nodes by less (`benchmarks/constants.md`).
UNKNOWN = (0.002, 0.5)
_SIZES = np.geomspace(*UNKNOWN, 25)
# Probability that a channel has it, where it does not act in all alike: neither is more probable: judgement.
UNKNOWN_IN_CHANNEL = 0.5


def effective_features(count: int) -> float:
    """Return the effective number of features of an error of form in recordings with `count` features."""
    return float(min(FACTOR * count**POWER, count))


@dataclass(frozen=True)
class Left:
    """Remaining misfit of a model by channel, (channels,) each.

    Attributes
    ----------
    across : Array
        Sum of squares of all features except the one along the force, beyond the expectation of noise.
    along : Array
        Square of the feature along the force.
    excess : Array
        Sum of squares of all features beyond the expectation of noise and calibration.
    """

    across: Array
    along: Array
    excess: Array


@dataclass(frozen=True)
class Judged:
    """Likelihood of a model, with its form error.

    Attributes
    ----------
    log : float
        Natural logarithm of the likelihood, up to a constant that all models of a diagnosis share.
    scale : tuple of float
        By channel, the variance v of its features: harmonic mean over the posterior of phi and lambda.
    phi : float
        Posterior mean of the error of form.
    """

    log: float
    scale: tuple[float, ...]
    phi: float


@dataclass(frozen=True)
class _Variances:
    """Variances v for each size of the noise, error of form and channel, and what follows from them.

    Attributes
    ----------
    noise : shape (sizes, 1, ..., channels)
        s^2.
    precision, precision_along : shape (sizes, ..., channels)
        1 / v, and 1 / (v + g) of the feature along the force.
    at_zero : shape (sizes, ..., channels)
        Log likelihood of a misfit that is as large across the force as noise is expected to be, and zero along it, plus
        the logarithm of the weight of the noise's size.
    """

    noise: Array
    precision: Array
    precision_along: Array
    at_zero: Array


@dataclass(frozen=True)
class Likelihood:
    """The likelihood of all recordings of a diagnosis.

    Attributes
    ----------
    features : tuple of Features
        By channel.
    plain : tuple of float
        Sum of squares D of the plain law's misfit beyond noise, by channel.
    """

    features: tuple[Features, ...]
    plain: tuple[float, ...]

    @cached_property
    def effective(self) -> Array:
        """Effective number of features m by channel.

        The feature along the force is each channel's own. The others are shared: one formula is wrong in the same way
        in all recordings along a path, and one that is given in two files says no more about it than in one. Of a table
        it is a share of its features (`Features.independent`).
        """
        counts = np.array([float(feature.count) for feature in self.features])
        paths = np.array([not feature.independent for feature in self.features])
        total, whole = effective_features(int(counts[paths].sum())), max(float(counts[paths].sum()), 1.0)
        of_tables = counts * np.array([feature.independent for feature in self.features])
        effective = np.where(paths, 1.0 + (total - 1.0) * counts / whole, np.maximum(of_tables, 1.0))
        return np.asarray(np.minimum(effective, counts))

    @cached_property
    def count_across(self) -> Array:
        """Number of features without the one along the force, by channel; at least one."""
        return np.array([max(feature.count - 1.0, 1.0) for feature in self.features])

    @cached_property
    def signal(self) -> Array:
        """Sum of squares F of the force by channel."""
        return np.array([feature.signal for feature in self.features])

    @cached_property
    def explained_squares(self) -> Array:
        """Sum of squares D_c that effects may have to explain, by channel."""
        return self.explained_by(self.no_misfit)

    @cached_property
    def form(self) -> float:
        """Error of form over that in recordings along a path: a mean over what the channels leave to effects."""
        own = np.maximum(np.array(self.plain), 0.0) + 1e-300
        return float(
            np.sqrt(np.sum(own * np.array([feature.form for feature in self.features]) ** 2) / own.sum())
        )

    def explained_by(self, left: Left) -> Array:
        """Return the sum of squares D_c (channels,) that a model explains, given what it leaves.

        In a channel whose formulas err less than those of a path it counts as that much less.
        """
        own = np.maximum(np.maximum(np.array(self.plain), 0.0) - np.maximum(left.excess, 0.0), 0.0)
        own = own * np.array([feature.form for feature in self.features]) ** 2
        share = float(own.sum()) / max(float(self.signal.sum()), 1e-300)
        return np.asarray(0.5 * own + 0.5 * share * self.signal)

    def variances(self, phi: float = PHI, lam: float = LAMBDA) -> Array:
        """Variance v_c of the features of each channel for given errors of form.

        Parameters
        ----------
        phi : float
            Error of form of the effects, a share of the plain law's misfit.
        lam : float
            Error of form of the law, a share of the force.
        """
        return np.asarray(1.0 + (phi**2 * self.explained_squares + lam**2 * self.signal) / self.effective)

    @cached_property
    def doubt(self) -> Array:
        """Standard deviation of the logarithm of the noise over its estimate, by channel."""
        return np.array([feature.doubt for feature in self.features])

    @cached_property
    def most_noise(self) -> Array:
        """Largest factor on the noise's estimate, by channel."""
        return np.array([feature.most_noise for feature in self.features])

    @cached_property
    def calibration(self) -> Array:
        """Variance g that calibration adds to the feature along the force, by channel."""
        return np.array([feature.calibration for feature in self.features])

    def left(self, rows: Sequence[Array]) -> Left:
        """Return the remaining misfit, given its features (K,) by channel."""
        along = np.array(
            [float(feature.along @ z) ** 2 for feature, z in zip(self.features, rows, strict=True)]
        )
        across = np.array([float(z @ z) - len(z) + 1.0 for z in rows]) - along
        return Left(across, along, across + along / (1.0 + self.calibration) - 1.0)

    @property
    def no_misfit(self) -> Left:
        """Return the remaining misfit of a perfect model."""
        none = np.zeros(len(self.features))
        return Left(none, none, none)

    @cached_property
    def log_without_misfit(self) -> float:
        """Log likelihood of a model that leaves nothing but noise; none has more if that is estimated rightly."""
        return self.judge(self.no_misfit).log

    def _variances(self, form: Array, m: Array, channel: slice | int = slice(None)) -> _Variances:
        """Return the variances for sums of squares `form` (..., channels) of an error in m features."""
        m = m[channel]
        # The nodes of the noise come first.
        nodes = _NOISE_NODES.reshape(-1, *[1] * np.ndim(form))
        noise = np.minimum(np.exp(self.doubt[channel] * nodes), self.most_noise[channel]) ** 2
        v = noise + form / m
        wide = v + self.calibration[channel]
        at_zero = np.log(_NOISE_WEIGHTS).reshape(nodes.shape) - 0.5 * np.log(wide)
        at_zero = at_zero - 0.5 * (m - 1.0) * (np.log(v) + 1.0 / v)
        return _Variances(noise, np.asarray(1.0 / v), np.asarray(1.0 / wide), at_zero)

    def _log(
        self, left: Left, variances: _Variances, m: Array, channel: slice | int = slice(None)
    ) -> tuple[Array, Array]:
        """Log likelihood by channel, and v.

        Both are means over the size of the noise, v the harmonic one.
        """
        # A negative E is spread over all features; only the share of the m - 1 effective ones says how large v is.
        short = np.minimum(left.across[channel], 0.0)
        rest = short * (1.0 - (m[channel] - 1.0) / self.count_across[channel])
        squares = (left.across[channel] - rest + variances.noise * rest) * variances.precision
        log = variances.at_zero - 0.5 * (squares + left.along[channel] * variances.precision_along)
        top = log.max(axis=0)
        weight = np.exp(log - top)
        total = weight.sum(axis=0)
        return top + np.log(total), total / (weight * variances.precision).sum(axis=0)

    def judge(self, left: Left) -> Judged:
        """Return the likelihood of a model, given its remaining misfit."""
        return self._judge(left, self._variances_explained(self.explained_by(left)))

    def coarse(self, left: Left) -> float:
        """Log likelihood if formulas might err by a share of all that the plain law leaves, whatever a model explains.

        It measures how far first-order predictions reach. For the plain law it is bounded, whereas `judge` grants that
        law no error of an effect's formula and may put it hundreds of nats below all other models.
        """
        return self._judge(left, self._coarse_variances).log

    @cached_property
    def _coarse_variances(self) -> _Variances:
        return self._variances_explained(self.explained_squares)

    def _variances_explained(self, explained: Array) -> _Variances:
        """Return the variances where a model explains the sums of squares `explained` (channels,)."""
        form = _PHIS[:, None, None] ** 2 * explained + _LAMBDAS[None, :, None] ** 2 * self.signal
        return self._variances(form, self.effective)

    def _judge(self, left: Left, variances: _Variances) -> Judged:
        """Return the likelihood of a model for the variances of each error of form."""
        parts, v = self._log(left, variances, self.effective)
        log = parts.sum(axis=-1) + np.log(_PHI_WEIGHTS)[:, None] + np.log(_WEIGHTS)[None, :]
        total = float(np.logaddexp.reduce(log, axis=None))
        weight = np.exp(log - total)
        scale = 1.0 / np.einsum("ij,ijc->c", weight, 1.0 / v)
        return Judged(total, tuple(map(float, scale)), float(weight.sum(axis=1) @ _PHIS))

    def judge_unknown(self, left: Left) -> Judged:
        """Return the likelihood of a model with the unknown effect: its misfit may be of any size in each channel."""
        # Branches miss a table in a share of its features only (`Features.independent`); unknown physics may miss all.
        m = np.array(
            [
                float(feature.count) if feature.independent else own
                for feature, own in zip(self.features, self.effective, strict=True)
            ]
        )
        base = PHI**2 * self.explained_by(left)
        sizes = np.concatenate([[0.0], _SIZES])
        prior = np.full(len(sizes), UNKNOWN_IN_CHANNEL / len(_SIZES))
        prior[0] = 1.0 - UNKNOWN_IN_CHANNEL
        scales, by_size = [], []
        for c in range(len(m)):
            form = base[c] + (sizes[:, None] ** 2 + _LAMBDAS[None, :] ** 2) * self.signal[c]
            log, v = self._log(left, self._variances(form, m, c), m, c)
            log = log + np.log(_WEIGHTS)[None, :]
            by_size.append(np.logaddexp.reduce(log, axis=1))
            whole = log + np.log(prior)[:, None]
            weight = np.exp(whole - whole.max())
            scales.append(float(weight.sum() / np.sum(weight / v)))
        each = np.array(by_size)
        # Either it acts in all channels with one size, or in at least one with a size for each.
        alike = float(np.logaddexp.reduce(each[:, 1:].sum(axis=0))) - float(np.log(len(_SIZES)))
        apart = float(np.logaddexp.reduce(each + np.log(prior), axis=1).sum())
        nowhere = float((each[:, 0] + np.log(prior[0])).sum())
        anywhere = -np.expm1(min(nowhere - apart, -1e-12)) / (1.0 - (1.0 - UNKNOWN_IN_CHANNEL) ** len(m))
        total = float(np.logaddexp(alike, apart + np.log(anywhere))) - float(np.log(2.0))
        return Judged(total, tuple(scales), 1.0)
