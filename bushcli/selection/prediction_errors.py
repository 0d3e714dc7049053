"""Errors of first-order predictions, learned from the fits of one search.

First-order predictions of similar models are wrong in a similar way: where the fit of a debonded bond found 18 nats
less than predicted, the fits of pairs that contain it find as much less; and where the first ten predictions were right
within a nat, so are the others. The error of a prediction, in units of its slack, is a sum of one that all predictions
of a search share, one of each change between the two models (an effect more, an effect less, another law), and one of
its own. All are Gaussian of one unknown scale: a Student-t process. Its constants were measured
(`benchmarks/search.py`).

References
----------
Shah, Wilson and Ghahramani (2014), Student-t processes as alternatives to Gaussian processes, PMLR 33:877-885: the
conditional mean and scale.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bushcli.selection.model import Model

Array = NDArray[np.float64]
Changes = frozenset[str]
"""Names of the changes between two models, in which their predictions may err."""

# Scales of the errors, in slacks: those of all predictions of a search, of a change, of a prediction; and degrees
# of freedom. Those with the highest likelihood of 311 errors in 22 recordings of the
# development deck (`benchmarks/search.py`).
COMMON, OF_CHANGE, OWN = 0.1, 0.1, 0.2
# Degrees of freedom of the errors' scale: the highest likelihood, as above.
FREEDOM = 2.0
# Largest error of one fit that counts, in slacks: a fit that ended in another optimum says no more of the others.
MOST = 2.0


def changes(base: Model, model: Model) -> Changes:
    """Return the changes from one model to another."""
    before, after = _effect_names(base), _effect_names(model)
    differences = {f"with {name}" for name in after - before} | {f"without {name}" for name in before - after}
    if (base.law, base.terms, base.fixed) != (model.law, model.terms, model.fixed):
        differences.add(f"law {model.structure[0]}")
    return frozenset(differences)


def _effect_names(model: Model) -> set[str]:
    """Names of a model's effects; of each also with its number of parameters and the dimensions of its mesh."""
    names = set()
    for active in model.effects:
        dimensions = (f"{p.name}={active.values[p.name]:g}" for p in active.parameters if p.of_mesh)
        names |= {active.identity, " ".join([active.identity, str(len(active.parameters)), *dimensions])}
    return names


@dataclass(frozen=True)
class ExpectedError:
    """Error that is expected of a prediction.

    Attributes
    ----------
    mean : float
        In slacks of the prediction.
    spread : float
        Its scale as a share of that before any fit, 1 at most: no slack grows, since it was chosen as a bound.
    """

    mean: float
    spread: float


NONE = ExpectedError(0.0, 1.0)
"""Before any fit."""


class PredictionErrors:
    """Errors that fits have shown."""

    def __init__(self) -> None:
        self._changes: list[Changes] = []
        self._sizes: Array = np.zeros(0)
        # Inverse of the covariance of the errors, of scale one: hundreds of predictions are corrected after each fit.
        self._precision: Array = np.zeros((0, 0))

    def add(self, changed: Changes, error: float, slack: float) -> None:
        """Note the error of a prediction whose model has been fitted: found minus predicted log evidence.

        Nothing has `changed` where it was only a bound; error and slack are in nats.
        """
        if changed and slack > 0.0 and math.isfinite(error):
            self._changes.append(changed)
            self._sizes = np.append(self._sizes, np.clip(error / slack, -MOST, MOST))
            known = np.array([[_covariance(a, b) for b in self._changes] for a in self._changes])
            self._precision = np.asarray(np.linalg.inv(known + OWN**2 * np.eye(len(known))), dtype=np.float64)

    def expected_error(self, changed: Changes) -> ExpectedError:
        """Return the error that is expected of a prediction, from its changes to the model beside which it was made."""
        whole = COMMON**2 + OF_CHANGE**2 * len(changed) + OWN**2
        if not self._changes:
            return NONE
        beside = np.array([_covariance(other, changed) for other in self._changes])
        weights = self._precision @ beside
        variance = max(whole - float(beside @ weights), 0.0) / whole
        square = float(self._sizes @ self._precision @ self._sizes)
        scale = (FREEDOM + square) / (FREEDOM + len(self._sizes))
        return ExpectedError(float(weights @ self._sizes), min(math.sqrt(variance * scale), 1.0))


def _covariance(a: Changes, b: Changes) -> float:
    """Covariance of the errors of two predictions."""
    return COMMON**2 + OF_CHANGE**2 * len(a & b)
