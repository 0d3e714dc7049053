"""Conditions of a result: named doubts about it, and their remedies."""

from __future__ import annotations

from dataclasses import dataclass

#: Remedy of a run that was interrupted, whose work is saved in the folder of -o.
CONTINUE = "run the same command again: with the same -o it continues, without -o it begins anew"


@dataclass(frozen=True)
class Condition:
    """A doubt about a result that its user should know of.

    Attributes
    ----------
    name : str
        Short and stable, for scripts: "not_converged", "unstable_law", "coarse_mesh".
    message : str
        The observation, with numbers.
    remedy : str
        What the user can do about it.
    """

    name: str
    message: str
    remedy: str


def history_damaged(count: int) -> Condition:
    """Return the condition that saved results were damaged and calculated again."""
    message = f"{count} saved result{'s were' if count > 1 else ' was'} damaged and calculated again"
    return Condition("history_damaged", message, "nothing to do; check the disk if this happens again")
