"""Limits of an answer, as ``--limits`` gives them."""

from __future__ import annotations

import math

from bushcli.case.tolerance import DEFAULT
from bushcli.case.toleranced import toleranced
from bushcli.errors import InputError, Problem
from bushcli.study.analysis import Limits


def limits_of(text: str, percent: float = DEFAULT.percent) -> tuple[str, Limits]:
    """Return answer and limits of ``ANSWER=LOW:HIGH``, ``ANSWER=VALUE +- DEVIATION`` (or percent), ``ANSWER=VALUE``.

    Parameters
    ----------
    text : str
    percent : float
        Deviation from a value that is given alone, %.

    Raises
    ------
    InputError
        The text has none of these forms.
    """
    name, equals, spec = text.rpartition("=")
    found = toleranced(spec)
    if equals and name.strip() and found is not None:
        return name.strip(), Limits(found.low, found.high)
    try:
        ends = [float(part) for part in spec.split(":")]
        width = 0.01 * percent * abs(ends[0])
        low, high = (ends[0] - width, ends[0] + width) if len(ends) == 1 else ends
    except ValueError:
        low = high = math.nan
    if not equals or not name.strip() or not low < high:
        wanted = 'e.g. "axial.initial=350 +- 15 %" or axial.initial=300:400'
        raise InputError(Problem(f"--limits {text}", "has no limits", "", wanted))
    return name.strip(), Limits(low, high)
