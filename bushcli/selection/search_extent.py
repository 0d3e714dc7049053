"""How far a search went: the models that it fitted, and why it ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

# Reason why an effect has no probability: its derivatives could not be computed at any size.
NOT_SIMULATED = "the bushing cannot be simulated with it"

Ended = Literal["nothing left", "budget", "interrupted", "faulty data"]
"""Why a search ended; "faulty data": it never began."""


@dataclass(frozen=True)
class TriedModel:
    """A model that the search fitted, or could not solve.

    Attributes
    ----------
    predicted, log_evidence : float
        Natural logarithm of evidence times prior odds, predicted to first order and after the fit, less that of the
        plain law; NaN where there is none.
    misfit : float
        Root mean square misfit over the noise; NaN where the model could not be solved.
    text : str
        Remark on the fit, empty if there is none: "cannot be solved from any start".
    solves : int
        Number of simulations of one channel that the fit took; 0 where the model could not be solved.
    """

    law: str
    effects: tuple[str, ...]
    predicted: float
    log_evidence: float
    misfit: float
    text: str = ""
    solves: int = 0


@dataclass(frozen=True)
class SearchExtent:
    """Extent of the search.

    Attributes
    ----------
    complete : bool
        Whether the search ended because further fits could change at most `queue.LEFT` of the effects' probability.
    left : float
        Share of the effects' probability that fits of the models in the queue may change, by their predictions.
    lost : tuple of str
        Models that could not be solved from any start, in words.
    untestable : mapping of str to str
        Effects that these recordings cannot show, and why.
    """

    complete: bool
    left: float
    ended: Ended
    trials: tuple[TriedModel, ...]
    lost: tuple[str, ...]
    untestable: Mapping[str, str]

    @property
    def not_simulated(self) -> tuple[str, ...]:
        """Effects of which nothing is known, because the bushing cannot be simulated with them."""
        return tuple(name for name, why in self.untestable.items() if why == NOT_SIMULATED)
