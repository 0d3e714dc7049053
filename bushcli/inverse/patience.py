"""How many failed steps a march is allowed before it is given up."""

from __future__ import annotations

from dataclasses import dataclass

from cases.march import History

# Failed steps that every march is allowed if no limit is given.
ALLOWED = 3


@dataclass
class Patience:
    """Failed steps after which marches of one channel are given up; it belongs to one fit, and learns from its marches.

    Once a march has reached its end, a march with far more failed steps belongs to a trial that is too far off; to cut
    its steps down to the smallest takes a hundred times as long as to solve a good trial.

    Attributes
    ----------
    given : int or None
        Limit of every march. None: unlimited at first, then derived from the marches that have reached their end.
    hardest : int or None
        Largest number of failed steps of a march that reached its end; None before the first one.
    """

    given: int | None = None
    hardest: int | None = None

    @property
    def limit(self) -> int | None:
        """Failed steps after which the next march is given up; None: `cases.march` decides."""
        if self.given is not None or self.hardest is None:
            return self.given
        return ALLOWED + 2 * self.hardest

    def learn(self, history: History) -> None:
        """Take note of a march that has reached its end."""
        failed = sum(not one.accepted for one in history.attempts)
        self.hardest = failed if self.hardest is None else max(self.hardest, failed)
