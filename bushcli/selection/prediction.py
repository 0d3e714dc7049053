"""An effect's change of the curves beside a fitted model, and the predicted evidence of the model that has it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.evidence.prior import ParameterPrior, known_parameters
from bushcli.likelihood.form import Left, Likelihood
from bushcli.recording import Recording
from bushcli.selection.columns import Candidate
from bushcli.selection.model import Model
from bushcli.selection.queued import SHARE_SLACK

Array = NDArray[np.float64]

# Least gain in log likelihood for an effect to count as visible: half a nat. If first order predicts less, a fit
# finds no more: its optimum is that of the model beside which the effect is tried, where first order is exact. It is
# a factor of 1.6 in the likelihood.
FAINT = 0.5
# Where an effect was tried at a finite size, its amplitude is predicted only within this factor of that size. Other
# values change probabilities by less than 0.002 (`benchmarks/constants.md`).
TRIED = 2.0
# Factor beyond the 95 % range of its prior up to which an amplitude is predicted: further out, curves do not follow
# their derivatives.
FAR = 3.0


@dataclass(frozen=True, eq=False)
class Addition:
    """An effect beside a model, at one point of its grid, with the features of its change of the curves.

    Compared by identity: predictions cache what they calculate for each one.

    Attributes
    ----------
    slopes : tuple of (K, k) array
        Features of the derivatives by the k amplitudes, by channel.
    """

    trial: Candidate
    slopes: tuple[Array, ...]


@dataclass(frozen=True)
class Prediction:
    """A model that may be fitted, with its predicted evidence.

    Attributes
    ----------
    model : Model
        With the effects' first-order values.
    gain : float
        Increase of the log likelihood by the effects, at the best point of their grids.
    log_likelihood : float
        Log likelihood of the model at that point.
    reach : float
        Increase of `Likelihood.coarse` by the effects: the larger it is, the less accurate is first order.
    hope : float
        Increase of the log likelihood that a fit may find in addition if the effect explains more than predicted
        (`reachable_likelihood`).
    """

    model: Model
    log_evidence: float
    gain: float
    log_likelihood: float
    reach: float
    hope: float = 0.0


def reachable_likelihood(likelihood: Likelihood, before: Left, after: Left) -> float:
    """Return the log likelihood of a model if its effect explains more than predicted, by `SHARE_SLACK` of that.

    If it is predicted to explain most of the misfit, a fit may find that it explains all: what first order leaves of a
    long lag is as large as other effects, but it is small beside what the lag does.
    """
    more = SHARE_SLACK * np.maximum(before.excess - after.excess, 0.0)
    excess = np.maximum(after.excess - more, np.minimum(after.excess, 0.0))
    return likelihood.judge(Left(after.across + excess - after.excess, after.along, excess)).log


@dataclass(frozen=True)
class KnownAmplitudes:
    """What is known of the k amplitudes of an addition, each in its parameter's unit.

    Attributes
    ----------
    known : list of ParameterPrior or None
        Priors.
    start, low, high : shape (k,)
        Off values, and bounds of the changes from these.
    """

    known: list[ParameterPrior | None]
    start: Array
    low: Array
    high: Array


def known_amplitudes(
    addition: Addition, case: Case, shear: float, recordings: Sequence[Recording]
) -> KnownAmplitudes:
    """Return what is known of the amplitudes of an addition.

    Their bounds are those of the effect and, if a finite size was tried, near that size.
    """
    trial = addition.trial
    priors = known_parameters(case, (trial.active,), shear, recordings)
    known = [priors.get(f"{trial.active.name}.{name}") for name in trial.amplitudes]
    start = np.array([float(trial.active.values[name]) for name in trial.amplitudes])
    bounds = []
    for k, (name, prior, off) in enumerate(zip(trial.amplitudes, known, start, strict=True)):
        _, lower, upper = trial.effect.parameter(name).fit_range(case.geometry)
        low, high = lower - off, upper - off
        if k == 0 and trial.size is not None:
            low, high = trial.size / TRIED, trial.size * TRIED
        if prior is not None:
            # Not far out in its tails, where the curves no longer follow their derivatives. A logarithmic
            # prior has a tail towards zero, too.
            least, most = prior.prior.range(prior.scales)
            low, high = max(low, -FAR * most), min(high, FAR * most)
            if prior.one_sided and prior.prior.is_logarithmic:
                low = max(low, least / FAR)
        bounds.append((low, high))
    low, high = np.array(bounds, dtype=float).reshape(-1, 2).T
    return KnownAmplitudes(known, start, low, high)
