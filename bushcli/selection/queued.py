"""Queue of models to be fitted, with their predicted weights and the uncertainty of these."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from bushcli.selection.model import Key, Model
from bushcli.selection.state import State

# Tolerance (slack) of a first-order prediction, in nats: a constant, plus a share of the change of log likelihood
# from the fitted to the predicted model, without a limit: where the plain law is far from the recordings (practice
# p04), predictions beside it were 5, 15, 16 and 21 % of their gains of 360 to 390 nats too low, the last that of the
# right model (docs/diagnosis-details.md). Of 60 fits of development and practice recordings four found more than
# that, by 1.9 at most; 5 to 21 % were seen where the plain law is 430 from the best model.
SLACK, SHARE_SLACK = 0.5, 0.25
# Beside a plain law that is so many nats from an effect's prediction, first order says little of that effect:
# predictions of p04 beside it were wrong by 16 to 160 nats, on both sides.
FAR = 100.0
# Predictions with no more slack than this are reliable: they count until the model is fitted. The slack of a gain of
# 4 nats.
SURE = 1.5
# Least factor on the uncertain weight of a model with the same effects as probable models (with other branches, in
# another place, with another law): its fit hardly changes how probable the effects are. With a tenth it is still fitted
# where its weight may be off by half of all, since its values may then be those reported. Judgement; second 062
# (`benchmarks/decks`) takes 198 in place of 273 s, with the same probabilities within 0.01.
SAME_EFFECTS = 0.1


@dataclass(frozen=True)
class Queued:
    """A model that is not fitted, with its predicted posterior weight: logarithm of evidence times prior odds.

    Attributes
    ----------
    base : State
        The fitted model beside which it was predicted.
    log_evidence : float
        Logarithm of the evidence, to first order.
    odds : float
        Logarithm of the prior odds.
    slack : float
        Possible error of the first-order prediction, in nats.
    hope : float
        Nats by which a fit may find more in addition.
    limit : float
        Logarithm of the largest possible weight.
    is_bound : bool
        Whether the prediction is only an upper bound.
    is_silent : bool
        Whether its further effects improve on `base` too little to be visible.
    """

    model: Model
    base: State
    log_evidence: float
    odds: float = 0.0
    slack: float = 0.0
    hope: float = 0.0
    limit: float = math.inf
    is_bound: bool = False
    is_silent: bool = False

    @property
    def predicted_weight(self) -> float:
        """Predicted logarithm of the weight."""
        return self.log_evidence + self.odds

    @property
    def optimistic_weight(self) -> float:
        """The predicted weight plus its possible error, as far as the likelihood can increase."""
        most = self.predicted_weight + self.slack + self.hope
        return max(self.predicted_weight, min(most, self.limit))

    @property
    def is_sure(self) -> bool:
        """Whether the prediction counts until the model is fitted."""
        return not self.is_bound and self.slack <= SURE

    @property
    def rank(self) -> tuple[bool, float]:
        """Order among predictions of one model."""
        return not self.is_bound, -self.slack

    @property
    def uncertain_weight(self) -> float:
        """Logarithm of the weight by which a fit may change the posterior."""
        if not self.is_sure:
            return self.optimistic_weight
        # A fit may find up to the optimistic weight (the exponential overflows at 709), or one smaller by the slack.
        larger = math.expm1(min(self.optimistic_weight - self.predicted_weight, 700.0))
        smaller = -math.expm1(-self.slack)
        return self.predicted_weight + math.log(max(larger, smaller, 1e-12))


def slack_of(reach: float) -> float:
    """Return the slack of a prediction whose log likelihood is `reach` nats away from that of the fitted model."""
    return SLACK + SHARE_SLACK * abs(reach)


@dataclass(frozen=True)
class OtherShares:
    """Logarithms of the shares of the posterior that models with other effects have, `SAME_EFFECTS` at least.

    Attributes
    ----------
    shares : mapping
        By the effects of models and whether the law is fixed.
    """

    shares: Mapping[tuple[tuple[str, ...], bool], float]

    @classmethod
    def of(cls, weights: Iterable[tuple[Model, float]], total: float) -> OtherShares:
        """Return them for models, each with the logarithm of its weight, and that of the sum of all weights."""
        own: dict[tuple[tuple[str, ...], bool], float] = {}
        for model, weight in weights:
            key = model.identities, model.fixed
            own[key] = own.get(key, 0.0) + math.exp(min(weight - total, 0.0))
        return cls({key: math.log(max(1.0 - share, SAME_EFFECTS)) for key, share in own.items()})

    def uncertain_weight(self, queued: Queued) -> float:
        """Return the logarithm of the weight by which a fit may change the posterior of the effects.

        A further model with effects that are probable already changes it by the share of the others alone.

        Parameters
        ----------
        queued : Queued
        """
        return queued.uncertain_weight + self.shares.get((queued.model.identities, queued.model.fixed), 0.0)


class Waiting(dict[Key, Queued]):
    """Models that are not fitted."""

    def uncertain_weight(self, others: OtherShares) -> float:
        """Return the logarithm of the weight by which the fits of all may change the posterior of the effects.

        The errors of predictions are independent, so that their squares add. Bounds of other laws rest on the same
        splines, and add as they are.

        Parameters
        ----------
        others : OtherShares
        """
        predicted = [2.0 * others.uncertain_weight(queued) for queued in self.values() if not queued.is_bound]
        bounds = [others.uncertain_weight(queued) for queued in self.values() if queued.is_bound]
        return float(logsumexp([0.5 * logsumexp([-np.inf, *predicted]), *bounds]))

    def ordered_models(self, others: OtherShares) -> list[Key]:
        """Return the models, the one whose fit may change the posterior of the effects most first.

        Parameters
        ----------
        others : OtherShares
        """
        return sorted(self, key=lambda key: (-others.uncertain_weight(self[key]), key))

    def put(self, new: Queued) -> None:
        """Add a prediction. Of several for one model the most reliable counts."""
        key = new.model.structure
        known = self.get(key)
        if math.isfinite(new.predicted_weight) and (known is None or new.rank > known.rank):
            self[key] = new
