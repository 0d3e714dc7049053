"""When the searches of a least-squares problem end."""

from __future__ import annotations

from dataclasses import dataclass

# A relative change of the cost or of the parameters below this ends the search: far below what noise can resolve.
TOLERANCE = 1e-7
# A search ends on the floor of a valley when this many evaluations lower the cost by less than this share, a tenth of a
# unit of chi square. Nothing else ends it if the curves leave a combination of parameters open (Ogden, one recording).
VALLEY = 8, 3e-4
# Largest number of evaluations of one search.
MOST_EVALUATIONS = 200
# Largest number of times that states reached by a search are added to the problem: one is usual, three have occurred.
ROUNDS = 5


@dataclass(frozen=True)
class Stopping:
    """When the searches of a problem end.

    Attributes
    ----------
    tolerance : float
        Relative change of parameters and misfit that counts as none.
    valley : (int, float)
        Evaluations, and the share of the misfit that they have to gain together.
    rounds : int
        Searches after which the stability in the states reached is required once more.
    evaluations, failures : int
        Largest numbers of evaluations, and of those that fail.
    """

    tolerance: float = TOLERANCE
    valley: tuple[int, float] = VALLEY
    rounds: int = ROUNDS
    evaluations: int = MOST_EVALUATIONS
    failures: int = MOST_EVALUATIONS


STOPPING = Stopping()
