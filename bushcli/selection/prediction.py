"""An effect's change of the curves beside a fitted model, and the predicted evidence of the model that has it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.selection.columns import Trial
from bushcli.selection.model import Model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Addition:
    """An effect beside a model, at one point of its grid, with the features of its change of the curves.

    Attributes
    ----------
    trial : Trial
    slopes : tuple of (K, k) array
        Features of the derivatives by the k amplitudes, by channel.
    """

    trial: Trial
    slopes: tuple[Array, ...]


@dataclass(frozen=True)
class Prediction:
    """A model that may be fitted, with its predicted evidence.

    Attributes
    ----------
    model : Model
        With the effects' first-order values.
    log_evidence : float
    gain : float
        Increase of the log likelihood by the effects, at the best point of their grids.
    log_likelihood : float
        Log likelihood of the model at that point.
    reach : float
        The same increase of `Likelihood.coarse`: the larger it is, the less accurate is first order.
    """

    model: Model
    log_evidence: float
    gain: float
    log_likelihood: float
    reach: float
