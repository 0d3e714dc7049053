"""A curve whose derivatives are no numbers counts as one that could not be solved."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from mpi4py import MPI

from bushcli.inverse.bounds import Bounds
from bushcli.inverse.channel import ChannelForces
from bushcli.inverse.problem import LeastSquaresProblem, coupon_states
from forms.law import law

Q = np.linspace(0.0, 1.0, 5)
BOUNDS = Bounds(np.zeros(1), np.ones(1))


@pytest.mark.parametrize("spoiled", ["force", "slope"])
def test_numbers_that_are_not_finite_end_the_trial_and_not_the_run(spoiled):
    values = {"force": Q.copy(), "slope": Q[:, None].copy()}
    values[spoiled][-1] = np.inf
    channel = SimpleNamespace(
        coupon=True,
        comm=MPI.COMM_SELF,
        measured=Q,
        solve=lambda parameters, names, limit: ChannelForces(Q, **values),
    )
    problem = LeastSquaresProblem(
        [channel], law("neo_hookean"), ["C10"], {}, BOUNDS, coupon_states((0.8, 1.2))
    )
    assert problem.answers(np.array([0.5])) is None
    assert np.isnan(problem.residual(np.array([0.5]))).all()
    assert problem.failed_solves == 1
