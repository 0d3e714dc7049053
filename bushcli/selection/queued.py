"""Queue of models to be fitted, with their predicted weights and the uncertainty of these."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bushcli.selection.model import Model
from bushcli.selection.state import State

# Tolerance (slack) of a first-order prediction, in nats: a constant, plus a share of the change of log likelihood from
# the fitted to the predicted model, without a limit: where the plain law is far from the recordings (practice p04),
# predictions beside it were 5, 15, 16 and 21 % of their gains of 360 to 390 nats too low, the last that of the right
# model (docs/diagnosis-details.md).
SLACK, SHARE_SLACK = 0.5, 0.25
# Predictions with no more slack than this are reliable: they count until the model is fitted.
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
        Predicted logarithm of the evidence.
    predicted : float
        Predicted logarithm of the weight.
    optimistic : float
        The same plus the slack, as far as the likelihood can increase.
    slack : float
        Possible error of the first-order prediction, in nats.
    is_bound : bool
        Whether the prediction is only an upper bound.
    is_silent : bool
        Whether its further effects improve on `base` too little to be visible.
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
        # A fit may find up to the optimistic weight (the exponential overflows at 709), or one smaller by the slack.
        larger = math.expm1(min(self.optimistic - self.predicted, 700.0))
        smaller = -math.expm1(-self.slack)
        return self.predicted + math.log(max(larger, smaller, 1e-12))


def slack_of(reach: float) -> float:
    """Return the slack of a prediction whose log likelihood is `reach` nats away from that of the fitted model."""
    return SLACK + SHARE_SLACK * abs(reach)
