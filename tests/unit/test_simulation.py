"""A channel with memory is marched anew only where the march itself changes."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effects
from bushcli.simulate import simulation
from bushcli.simulate.simulation import Simulation
from cases.mode import modes
from cases.simulate import Rubber
from forms.law import law
from geometry.shape import Refinement
from geometry.shapes.plain import Plain

RING = Plain(inner_radius=9.0, outer_radius=18.0, length=34.0)
RUBBER = Rubber(law("yeoh"), {"C10": 0.5, "C20": -0.03, "C30": 0.006}, 2000.0)


@pytest.fixture
def marches(monkeypatch):
    """Record the parameters by which each march is differentiated."""
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
    # The stop adds 50 N/mm beyond 2 or 2.5 mm; the bushing reaches 3 mm less the play of 0.1 mm.
    assert (near.force - far.force).max() == pytest.approx(50.0 * 0.5)
    assert near.slope[:, 1].max() == pytest.approx(0.9)
    assert near.slope[:, 2].min() == pytest.approx(-50.0)
    # Derivatives by a parameter that changes the path, and another path, need new marches.
    one.solve({}, ("free_play.half_width",))
    one.solve({"free_play.half_width": 0.2}, names)
    one.solve({"C10": 0.6}, names)
    assert marches == [("C10",), ("free_play.half_width",), ("C10",), ("C10",)]


@pytest.mark.parametrize(
    ("name", "off"),
    [("viscoelasticity", {"g1": 0.0, "tau1": 4.0}), ("mullins", {"inverse_r": 0.0}), ("payne", {"g": 0.0})],
)
@pytest.mark.parametrize("rig", [{}, {"compliance": 3e-4}])
def test_derivatives_by_an_amplitude_that_is_off_need_no_march(marches, monkeypatch, name, off, rig):
    time = np.linspace(0.0, 12.0, 37)
    q = np.interp(time, [0, 4, 8, 12], [0, 3, 0, -2])
    active = [ActiveEffect(effects()[name], off)]
    if rig:
        active.append(ActiveEffect(effects()["rig_compliance"], rig))
    one = Simulation(RING, modes()["axial"], RUBBER, Refinement(2, 4), active, time, q, None)
    names = (f"{name}.{next(iter(off))}",)
    slope = one.solve({}, names).slope
    assert not marches
    monkeypatch.setattr(simulation, "acts_through_branches_off", lambda *_: False)
    marched = one.solve({}, names).slope
    assert marches == [names]
    # Interpolated in 8 steps.
    np.testing.assert_allclose(slope, marched, rtol=0.0, atol=5e-4 * np.abs(marched).max())


def test_derivatives_of_warm_rubber_behind_a_spring_are_exact():
    """Warming's factor depends on the time of each step, at which bushing and spring share the displacement."""
    time = 50.0 + np.linspace(0.0, 12.0, 13)
    q = np.interp(time - 50.0, [0, 4, 8, 12], [0, 3, 0, -2])
    values = {
        "viscoelasticity": {"g1": 0.3, "tau1": 4.0},
        "warming": {"amount": 0.2, "tau": 5.0},
        "rig_compliance": {"compliance": 3e-4},
        "drift": {"rate": 2.0},
    }
    active = [ActiveEffect(effects()[name], given) for name, given in values.items()]
    one = Simulation(RING, modes()["axial"], RUBBER, Refinement(2, 4), active, time, q, None)
    given = {f"{name}.{key}": value for name, own in values.items() for key, value in own.items()}
    exact = one.solve({}, tuple(given))
    # Warm rubber carries less; warming and drift count time from the start of the recording.
    cold = one.solve({"warming.amount": 0.0, "drift.rate": 0.0}).force
    assert exact.force[0] == pytest.approx(0.0, abs=1e-9)
    assert exact.force[4] < 0.95 * cold[4]
    for column, (name, value) in enumerate(given.items()):
        step = 1e-3 * value
        found = (one.solve({name: value + step}).force - one.solve({name: value - step}).force) / (2 * step)
        scale = np.abs(exact.slope[:, column]).max()
        # The shared displacement is found to 1e-7 of the travel.
        np.testing.assert_allclose(found, exact.slope[:, column], atol=2e-3 * scale, rtol=0, err_msg=name)


MEMORIES = {
    "none": {"rig_compliance": {"compliance": 2e-4}},
    "viscoelasticity": {"viscoelasticity": {"g1": 0.3, "tau1": 4.0}, "rig_compliance": {"compliance": 2e-4}},
}


@pytest.mark.parametrize("memory", MEMORIES)
def test_a_rig_zeroed_under_a_preload_logs_the_rest_of_the_curve(memory):
    """Against the path from rest through a preload that has relaxed; its derivative against a difference."""
    time = np.linspace(0.0, 12.0, 25)
    q = np.interp(time, [0, 4, 8, 12], [0, 3, -3, 0])
    present = [ActiveEffect(effects()[name], values) for name, values in MEMORIES[memory].items()]
    zeroed = ActiveEffect(effects()["offset"], {"zeroed": 1.0, "preload": 1.5})
    logged = Simulation(RING, modes()["axial"], RUBBER, Refinement(2, 4), [*present, zeroed], time, q, None)
    names = ("offset.preload", "C10")
    found = logged.solve({}, names)
    before = np.array([-1e5, -9e4, -1e-3])
    path = np.concatenate([[0.0, 1.5, 1.5], 1.5 + q])
    whole = Simulation(
        RING, modes()["axial"], RUBBER, Refinement(2, 4), present, np.append(before, time), path, None
    )
    force = whole.solve({}).force
    assert found.force[0] == pytest.approx(0.0, abs=1e-6 * np.ptp(force))
    assert found.force == pytest.approx(force[3:] - force[2], abs=2e-4 * np.ptp(force))
    for name, at, step in (("offset.preload", 1.5, 1e-3), ("C10", 0.5, 1e-4)):
        near = [logged.solve({"offset.preload": 1.5, "C10": 0.5, name: at + h}).force for h in (-step, step)]
        by = found.slope[:, names.index(name)]
        assert by == pytest.approx((near[1] - near[0]) / (2.0 * step), abs=1e-3 * np.abs(by).max())
