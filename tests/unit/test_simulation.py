"""A channel with memory is marched anew only where the march itself changes."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli import simulation
from bushcli.active import ActiveEffect
from bushcli.effect import effects
from bushcli.simulation import Simulation
from cases.mode import modes
from cases.simulate import Rubber
from forms.law import law
from geometry.shape import Refinement
from geometry.shapes.plain import Plain

RING = Plain(inner_radius=9.0, outer_radius=18.0, length=34.0)
RUBBER = Rubber(law("yeoh"), {"C10": 0.5, "C20": -0.03, "C30": 0.006}, 2000.0)


@pytest.fixture
def marches(monkeypatch):
    """Names by which each march was differentiated."""
    seen = []

    def march(*args, **options):
        seen.append(options["sensitivity"])
        return real(*args, **options)

    real = simulation.march
    monkeypatch.setattr(simulation, "march", march)
    return seen


def test_what_stands_beside_the_bushing_does_not_change_its_march(marches):
    time = np.linspace(0.0, 12.0, 13)
    q = np.interp(time, [0, 4, 8, 12], [0, 3, 0, -2])
    active = [
        ActiveEffect(effects()["viscoelasticity"], {"g1": 0.3, "tau1": 4.0}),
        ActiveEffect(effects()["bump_stop"], {"stiffness": 50.0, "gap": 2.0}),
        ActiveEffect(effects()["free_play"], {"half_width": 0.1}),
    ]
    one = Simulation(RING, modes()["axial"], RUBBER, Refinement(2, 4), active, time, q, None)
    names = ("C10", "bump_stop.stiffness", "bump_stop.gap")
    near = one.solve({"bump_stop.gap": 2.0}, names)
    far = one.solve({"bump_stop.gap": 2.5}, names)
    assert marches == [("C10",)]
    # 50 N/mm from 2 or 2.5 mm on, of 3 mm less the play of 0.1 mm.
    assert (near.force - far.force).max() == pytest.approx(50.0 * 0.5)
    assert near.slope[:, 1].max() == pytest.approx(0.9)
    assert near.slope[:, 2].min() == pytest.approx(-50.0)
    # Differentiated by what changes the path, and marched along another one.
    one.solve({}, ("free_play.half_width",))
    one.solve({"free_play.half_width": 0.2}, names)
    one.solve({"C10": 0.6}, names)
    assert marches == [("C10",), ("free_play.half_width",), ("C10",), ("C10",)]
