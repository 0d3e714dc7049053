"""Queue of models to be fitted, with their predicted weights and the uncertainty of these."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bushcli.diagnosis.model import Model
from bushcli.diagnosis.state import State

# What first order may underestimate, in nats: so many, a share of the log likelihood between the fitted model and the
# predicted one, and that no more than a limit. Measured on the development deck (docs/diagnosis.md).
SLACK, SHARE_SLACK, MOST_SLACK = 0.5, 0.15, 30.0
# A prediction that may underestimate by no more than so many nats counts until the model is fitted.
SURE = 1.5


@dataclass(frozen=True)
class Queued:
    """A model that is not fitted, with its predicted posterior weight: logarithm of evidence times prior odds.

    Attributes
    ----------
    model : Model
    base : State
        The fitted model beside which it was predicted.
    log_evidence : float
        Predicted.
    predicted : float
        Weight.
    optimistic : float
        The same with what first order may underestimate.
    slack : float
        What first order may be wrong by, in nats.
    is_bound : bool
        Whether the prediction is no more than an upper bound.
    is_silent : bool
        Whether its further effects bring nothing beside `base`.
    """

    model: Model
    base: State
    log_evidence: float
    predicted: float
    optimistic: float
    slack: float
    is_bound: bool = False
    is_silent: bool = False

    @property
    def is_sure(self) -> bool:
        """Whether the prediction counts until the model is fitted."""
        return not self.is_bound and self.slack <= SURE

    @property
    def rank(self) -> tuple[bool, bool, float]:
        """Order among predictions of one model."""
        return not self.is_bound, self.is_sure, -self.slack if self.is_sure else self.predicted

    @property
    def uncertain(self) -> float:
        """Logarithm of the weight by which a fit may change the posterior."""
        if not self.is_sure:
            return self.optimistic
        # It may turn out larger, as far as there is room for it, or smaller by as much as first order may be wrong.
        larger = math.expm1(self.optimistic - self.predicted)
        smaller = -math.expm1(-self.slack)
        return self.predicted + math.log(max(larger, smaller, 1e-12))


def slack_of(reach: float) -> float:
    """What first order may underestimate of a model so many nats of log likelihood away from the fitted one."""
    return SLACK + min(SHARE_SLACK * abs(reach), MOST_SLACK)
