"""What an effect does beside a fitted model, and what a model with it is predicted to be worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.diagnosis.columns import Trial
from bushcli.diagnosis.model import Model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Addition:
    """An effect beside a model, at one point of its grid, with the features of what it does.

    Attributes
    ----------
    trial : Trial
    slopes : tuple of (K, k) array
        By channel.
    """

    trial: Trial
    slopes: tuple[Array, ...]


@dataclass(frozen=True)
class Prediction:
    """A model that might be fitted.

    Attributes
    ----------
    model : Model
        With the effects' first-order values.
    log_evidence : float
    gain : float
        Natural logarithm of the likelihood that the effects bring, at the best point of their grids.
    log_likelihood : float
        That of the model there.
    """

    model: Model
    log_evidence: float
    gain: float
    log_likelihood: float
