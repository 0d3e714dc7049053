"""Weights of the misfit when models are compared: noise of the samples, and uncertainty of calibration and mesh.

A load cell is calibrated to about a percent, and a mesh is too stiff by a fraction of a percent: either makes all
forces of a channel wrong by one factor. This factor has a known standard deviation s, so that it acts as noise that
all samples share: the covariance is that of the samples plus s^2 F F'. Misfit and derivatives are multiplied by its
inverse square root, so that sums of squares allow for the factor, and no effect is needed that only scales one channel
by a percent. F is the recorded force without its noise: with the noise, a fit would tend to forces that are too small,
because a recording scaled down has less noise (D'Agostini).

References
----------
Kennedy and O'Hagan (2001), J. R. Stat. Soc. B 63:425-464, doi:10.1111/1467-9868.00294 (a model's discrepancy as
noise).
D'Agostini (1994), On the use of the covariance matrix to fit correlated data, Nucl. Instrum. Methods A 346:306-311,
doi:10.1016/0168-9002(94)90719-6 (the bias).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bushcli.inverse.table_channel import AnyChannel
from bushcli.likelihood.linearisation import Linearised, linearise, weigh
from bushcli.likelihood.noise import Compared

Array = NDArray[np.float64]

# Standard deviation of the common factor of a channel's forces: class 0.5 of ISO 7500-1 and a converged half-plane
# model, or a default mesh in three dimensions, whose forces are 0.2 to 0.8 % off converged ones (measured).
SECTION, SOLID = 0.005, 0.01
# Most standard deviations that are attributed to calibration where the misfit is located: convention: three standard
# deviations; words only.
SURE = 3.0
# Constant factor between simulation and recording up to which no cause is named. The default mesh is within 1 % of
# converged curves in every mode and law (docs/method.md, "Accuracy": 0.81 % at most, 1 % is what the tests require). A
# coupon's single element is exact, but class 1 of ISO 7500-1 allows a load cell 1 % as well. The probabilities do not
# depend on it.
UNREMARKABLE = 0.01


def factor_of(channel: AnyChannel) -> float:
    """Standard deviation of the common factor of a channel's forces."""
    return SECTION if channel.coupon or channel.model.mesh.dimension == 2 else SOLID


def whiten(rows: Array, channel: Compared, factor: float) -> Array:
    """Multiply misfit (n,) or derivatives (n, k) of a channel by the inverse square root of its covariance.

    Parameters
    ----------
    rows : (n,) or (n, k) array
        N or N mm, derivatives per unit of the parameter.
    channel : Compared
    factor : float
        Standard deviation of the common factor of the forces, a share of the force.
    """
    weights = channel.weights
    scaled = np.where(channel.known, rows.T, 0.0).T * (weights if rows.ndim == 1 else weights[:, None])
    return _with_common_factor(scaled, channel, factor)


def _with_common_factor(rows: Array, channel: Compared, factor: float) -> Array:
    # The common factor multiplies the recorded force without its noise.
    force = channel.smoothed_force * channel.weights
    size = float(np.linalg.norm(force))
    if size == 0.0 or factor == 0.0:
        return rows
    unit = force / size
    taken = 1.0 - 1.0 / np.sqrt(1.0 + (factor * size) ** 2)
    along = unit @ rows
    return np.asarray(rows - taken * (unit * along if rows.ndim == 1 else np.outer(unit, along)))


def linear_fit(
    channels: Sequence[Compared], factors: Sequence[float], jacobians: Sequence[Array]
) -> Linearised:
    """The fit to first order, weighted.

    Parameters
    ----------
    channels : sequence of Compared
    factors : sequence of float
        Standard deviation of the common factor of each channel, a share of the force.
    jacobians : sequence of (n, p) array
        Derivatives of each force by the fitted parameters.
    """
    plain = linearise(channels, jacobians)
    misfit = [whiten(np.where(c.known, c.misfit, 0.0), c, f) for c, f in zip(channels, factors, strict=True)]
    slopes = [whiten(j, c, f) for c, f, j in zip(channels, factors, jacobians, strict=True)]
    return replace(plain, misfit=np.concatenate(misfit), jacobian=np.concatenate(slopes))


def columns(channels: Sequence[Compared], factors: Sequence[float], jacobians: Sequence[Array]) -> Array:
    """Derivatives (n, k) of each channel's force, weighted and stacked: shape (all samples, k).

    Parameters
    ----------
    channels : sequence of Compared
    factors : sequence of float
        Standard deviation of the common factor of each channel, a share of the force.
    jacobians : sequence of (n, k) array
        Derivatives of each force.
    """
    ends = np.cumsum([0, *(len(c.recording.force) for c in channels)])
    stacked = weigh(channels, jacobians)
    parts = [
        _with_common_factor(stacked[a:b], channel, factor)
        for a, b, channel, factor in zip(ends[:-1], ends[1:], channels, factors, strict=True)
    ]
    return np.concatenate(parts)


def calibrate(channel: Compared, factor: float) -> Compared:
    """The channel with its simulated force corrected by the most probable common factor.

    The correction is at most SURE standard deviations of the factor; the rest remains misfit.

    Parameters
    ----------
    channel : Compared
    factor : float
        Standard deviation of the common factor, a share of the force.
    """
    shape = channel.smoothed_force
    force = np.where(channel.known, shape, 0.0) * channel.weights
    misfit = np.where(channel.known, channel.misfit, 0.0) * channel.weights
    power = float(force @ force) + (np.inf if factor == 0.0 else factor**-2)
    share = float(np.clip(float(force @ misfit) / power, -SURE * factor, SURE * factor))
    return replace(channel, simulated=channel.simulated - share * shape)
