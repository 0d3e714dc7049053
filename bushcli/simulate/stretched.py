"""How far a march stretches the rubber, and in how many of its states the law is unstable."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from cases.march import History
from cases.model import Model
from cases.simulate import Rubber
from cases.stability import stable
from cases.stretches import stretch_points, stretches_at

# States of the march in which the law's stability is checked, evenly chosen.
STABILITY_STATES = 6


def stretched(model: Model, history: History, rubber: Rubber) -> tuple[tuple[float, float], float]:
    """Return the range of principal stretches over the march, and the share of states in which the law is unstable.

    Parameters
    ----------
    model : Model
    history : History
        With its states.
    rubber : Rubber
        Law and parameters.
    """
    assert history.states is not None
    low, high, bad, total = 1.0, 1.0, 0, 0
    count = len(history.states)
    points = stretch_points(model)
    for i in np.unique(np.linspace(0, count - 1, min(STABILITY_STATES, count)).round().astype(int)):
        values = stretches_at(points, history.states[i]).reshape(-1, 3)
        if len(values):
            low, high = min(low, float(values.min())), max(high, float(values.max()))
            bad += int(np.count_nonzero(~stable(rubber.law, rubber.parameters, values)))
            total += len(values)
    low, high = model.comm.allreduce(low, MPI.MIN), model.comm.allreduce(high, MPI.MAX)
    bad, total = model.comm.allreduce(bad), model.comm.allreduce(total)
    return (low, high), bad / max(total, 1)
