"""Where no start of an identification can be solved: what was tried, and what to do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import Problem
from bushcli.faults import DataFault
from bushcli.inverse.file_units import values_in_file_units
from bushcli.inverse.task import Task


def tried(task: Task, x: NDArray[np.float64]) -> dict[str, float]:
    """Return the values of the parameters by name, in the units of the case file.

    Parameters
    ----------
    task : Task
    x : (parameters,) array
        In N, mm, MPa, s, rad.
    """
    return values_in_file_units(dict(zip(task.names, map(float, x), strict=True)), task.turned)


def unsolvable(task: Task, initial: NDArray[np.float64], faults: Sequence[DataFault]) -> Problem:
    """Return why nothing can be fitted; the likely cause is a fatal fault of the data, if there is one.

    Parameters
    ----------
    task : Task
    initial : (parameters,) array
        Where the search should have begun, in N, mm, MPa, s, rad.
    faults : sequence of DataFault
        Of the recordings.
    """
    fatal = next((one for one in faults if one.fatal), None)
    values = ", ".join(f"{name} = {value:g}" for name, value in tried(task, initial).items())
    what = (
        f"the curves cannot be simulated with {task.model}, from {values} or from the law's own start values"
    )
    if fatal is not None:
        return Problem(task.case.path.name, f"{what}; {fatal.channel}: {fatal.where}", "", fatal.remedy)
    return Problem(task.case.path.name, what, "", "give other start values in [material.parameters]")
