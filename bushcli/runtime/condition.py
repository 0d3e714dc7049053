"""Named conditions of a result: what is doubtful about it, and what can be done."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Condition:
    """Something about a result that its user should know.

    Attributes
    ----------
    name : str
        Short and stable, for scripts: "not_converged", "unstable_law", "coarse_mesh".
    message : str
        What was seen, with numbers.
    remedy : str
        What can be done about it.
    """

    name: str
    message: str
    remedy: str
