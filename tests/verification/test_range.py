"""How far the march must get with default settings: the loads of durability tests on a bushing of 9/18 mm."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import simpson

from cases.march import march
from cases.mode import modes
from cases.program import ramp
from cases.simulate import prepare
from geometry.shape import shapes

THICKNESS = 9.0
# Default number of steps of a load case.
STEPS = 20
REACH = {
    "axial": 0.8 * THICKNESS,
    "radial": 0.6 * THICKNESS,
    "torsional": np.radians(30.0),
    "conical": np.radians(10.0),
}
# A soft rubber as identified for the bundled example, and the stiff one of the reference curves (MPa).
YEOH = {
    "soft": ({"C10": 0.2096, "C20": -0.01054, "C30": 0.000713}, np.inf),
    "stiff": ({"C10": 0.5, "C20": -0.05, "C30": 0.01}, 2000.0),
}


@pytest.mark.slow
@pytest.mark.parametrize("mode", REACH)
@pytest.mark.parametrize("kind", YEOH)
def test_default_settings_reach_large_loads(kind, mode, rubber):
    parameters, kappa = YEOH[kind]
    shape = shapes()["plain"](inner_radius=9.0, outer_radius=9.0 + THICKNESS, length=34.0)
    model = prepare(shape, modes()[mode], rubber("yeoh", kappa, **parameters))
    history = march(model, ramp(REACH[mode], STEPS))
    assert history.displacement[-1] == REACH[mode]
    # The curve is smooth: a jump to another equilibrium would show in the slope.
    slope = np.diff(history.force)
    assert np.all(slope > 0)
    assert np.all(slope[1:] < 1.5 * slope[:-1])
    # The work of the force is the stored energy, to the accuracy of Simpson's rule with these steps. Under large radial
    # load the free ends fold over the bond edge in small jumps, which release energy (0.2 % in all).
    work = simpson(history.force, x=history.displacement)
    assert work == pytest.approx(history.energy[-1], rel=5e-3 if mode == "radial" else 1e-4)
