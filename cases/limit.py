"""Limit of Newton's method, which gives up after too many iterations, or earlier if the residual does not decrease."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

MAX_NEWTON = 25
# Largest number of Newton iterations for a step of a march whose failed steps are limited. Beyond a fold of the free
# surface, solutions with up to 25 were seen to converge; with a step half as long the march gets there sooner.
LIMITED_NEWTON = 15
# Such a march gives a step up after SOON iterations, too, if no residual was below this share of the first. In two
# diagnoses (practice p04 and one of the development deck, 480 marches), thirteen of fourteen solutions that ended well
# were at 1e-3 or less by then, and the march of the other one failed at the next step; of 52 that failed, 43 were not.
SOON, SHARE = 6, 0.1


@dataclass
class Limit:
    """Iterations that one solution by Newton's method may take.

    Parameters
    ----------
    most : int
        Largest number of iterations.
    soon : int, optional
        Iteration by which the residual must have fallen to a tenth; None if it need not.
    """

    most: int = MAX_NEWTON
    soon: int | None = None
    _first: float = field(default=np.inf, init=False)
    _least: float = field(default=np.inf, init=False)

    def ends(self, iteration: int, norm: float) -> bool:
        """Whether Newton's method gives up at this iteration.

        Parameters
        ----------
        iteration : int
            From 0, which begins a new solution.
        norm : float
            Norm of the residual there, N.
        """
        if iteration == 0:
            self._first = self._least = norm
        self._least = min(self._least, norm)
        return iteration >= self.most or (iteration == self.soon and self._least > SHARE * self._first)


def limit(failure_limit: int | None) -> Limit:
    """Return the limit of a march.

    Parameters
    ----------
    failure_limit : int, optional
        Largest number of failed steps of the march; None where it is given up only when no shorter step is possible.
    """
    return Limit() if failure_limit is None else Limit(LIMITED_NEWTON, SOON)
