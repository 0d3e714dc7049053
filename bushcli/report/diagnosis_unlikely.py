"""Effects that a diagnosis does not find: those that it rules out, and those that its recordings cannot show."""

from __future__ import annotations

from bushcli.diagnosis.result import Diagnosis


def unlikely(found: Diagnosis, limit: float) -> list[str]:
    """Return the effects that are less probable than a limit and that these recordings could show.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.
    limit : float
        Probability, from 0 to 1.

    Returns
    -------
    list of str
        Names, the most probable first; unknown physics and `nothing` are among them.
    """
    ranked = sorted(found.probability.items(), key=lambda one: -one[1])
    return [name for name, p in ranked if p < limit and name not in found.searched.untestable]


def undetectable(found: Diagnosis, limit: float) -> list[str]:
    """Return the effects that these recordings cannot show; they count as absent, which nothing in the data says.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.
    limit : float
        Probability, from 0 to 1; an effect that reaches it beside another effect is left out.

    Returns
    -------
    list of str
        Names, in the order of the search.
    """
    return [name for name in found.searched.untestable if found.probability.get(name, 0.0) < limit]
