"""Steps taken by a viscous flow to equilibrium."""

from __future__ import annotations

import numpy as np
import pytest

from cases.drag import Drag
from cases.equilibrium import Equilibrium
from cases.march import TOLERANCE, march
from cases.mode import modes
from cases.program import ramp
from cases.settling import settle
from cases.simulate import prepare
from geometry.shape import Refinement, shapes

COARSE = Refinement(across=2, along=6, around=8)
PLAIN = {"inner_radius": 12.0, "outer_radius": 22.0, "length": 40.0}


@pytest.fixture(params=["axial", "radial"])
def model(request, rubber):
    return prepare(shapes()["plain"](**PLAIN), modes()[request.param], rubber("yeoh"), COARSE)


def test_a_flow_ends_where_newton_s_method_does(model):
    """With a single equilibrium nearby; afterwards the model's tangent and residual contain no drag."""
    known = march(model, ramp(2.0, 2))
    solver = Equilibrium(model, TOLERANCE)
    try:
        model.state.x.array[:] = 0.0
        assert solver.solve(1.0, solver.unknowns()).found
        outcome = settle(solver, 2.0, solver.unknowns())
        assert outcome.found
        assert outcome.iterations > 0
        assert solver.force == pytest.approx(known.force[-1], rel=1e-6)
        assert solver.solve(2.0, solver.unknowns()).newton == 0
    finally:
        solver.destroy()


def test_a_drag_is_a_force_against_change_alone(model):
    """The drag is zero at its origin, on pressures and on sleeves, and opposes every other change."""
    drag = Drag(model, 8)
    origin, x, force = (model.system.create_vector() for _ in range(3))
    rng = np.random.default_rng(3)
    origin.array_w[:] = rng.standard_normal(origin.local_size)
    drag.begin(origin, 2.0)
    force.set(0.0)
    drag.add_forces(origin, force)
    assert force.norm() == 0.0
    change = rng.standard_normal(origin.local_size)
    x.array_w[:] = origin.array_r + change
    drag.add_forces(x, force)
    idle = np.concatenate([model.system.owned_pressures, model.system.owned_constrained])
    np.testing.assert_array_equal(force.array_r[idle], 0.0)
    assert force.array_r @ change > 0.0
    drag.destroy()
