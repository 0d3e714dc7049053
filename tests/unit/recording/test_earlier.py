"""Recordings that do not begin at rest: recognised by their first cycle, and simulated with a path before it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bushcli.case import load_case
from bushcli.curve.earlier import earlier
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effects
from bushcli.inverse import Task, identify
from bushcli.recording import Recording
from bushcli.simulate.predict import predict
from bushcli.simulate.simulation import Simulation
from cases.mode import modes
from cases.simulate import Rubber
from forms.law import law
from geometry.shape import Refinement
from geometry.shapes.plain import Plain

EFFECTS = {
    "viscoelasticity": 'name = "viscoelasticity"\nparameters = { g1 = 0.4, tau1 = 8.0 }',
    "friction": 'name = "friction"\nparameters = { g = 0.4, slip = 0.05 }',
}
CASE = """
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0

[mesh]
elements_across = 2
elements_along = 4

[material]
law = "neo_hookean"
bulk_modulus = 2000.0
parameters = {{ C10 = 0.4 }}

[[recordings]]
mode = "axial"
file = "axial.csv"

[[effects]]
{effect}
"""
RUBBER = Rubber(law("neo_hookean"), {"C10": 0.5}, 2000.0)
PERIOD = 40.0
# Three cycles from rest, to 4 mm and -4 mm.
TIME = np.arange(0.0, 3 * PERIOD + 0.5, 0.5)
Q = 4.0 * np.interp(TIME % PERIOD, [0.0, 10.0, 30.0, 40.0], [0.0, 1.0, -1.0, 0.0])


def simulated(time, q, name, before=None):
    """The force of a bushing with an effect of the rubber."""
    given = {"viscoelasticity": {"g1": 0.4, "tau1": 8.0}, "friction": {"g": 0.4, "slip": 0.05}}[name]
    active = [ActiveEffect(effects()[name], given)]
    ring = Plain(inner_radius=9.0, outer_radius=18.0, length=34.0)
    one = Simulation(ring, modes()["axial"], RUBBER, Refinement(2, 4), active, time, q, 0.0, before=before)
    return one.solve({}).force


def cut(force, first, last):
    """A part of the recording, with its own zero of time."""
    time = TIME[first:last] - TIME[first]
    noise = 1e-3 * np.ptp(force) * np.random.default_rng(5).normal(size=last - first)
    return Recording("axial", Q[first:last], force[first:last] + noise, time, name="axial")


@pytest.fixture(scope="module", params=["viscoelasticity", "friction"])
def known(request):
    return request.param, simulated(TIME, Q, request.param)


def test_a_recording_from_rest_has_nothing_before_it(known):
    _, force = known
    for last in (41, 61, 81, 161, 241):
        assert earlier(cut(force, 0, last)) is None
    # With a zero error of the load cell, and without times.
    shifted = cut(force, 0, 161)
    shifted = replace(shifted, force=shifted.force + 0.05 * np.ptp(force))
    assert earlier(shifted) is None
    assert earlier(replace(shifted, time=None)) is None


def test_an_elastic_recording_from_rest_has_nothing_before_it():
    noise = np.random.default_rng(5).normal(size=len(Q))
    for zero in (0.0, 60.0):
        assert earlier(Recording("axial", Q, 300.0 * Q + 2.0 * Q**3 + zero + noise, TIME)) is None


# From zero on the way up, from the peak, from the middle of unloading, from the trough; one cycle and more.
@pytest.mark.parametrize("first", [80, 100, 110, 140])
@pytest.mark.parametrize("length", [81, 101])
def test_a_loop_that_was_cut_out_has_a_cycle_before_it(known, first, length):
    name, force = known
    recording = cut(force, first, first + length)
    before = earlier(recording)
    assert before is not None
    assert before.repeats
    # From zero, by a ramp at the rate of the loop (0.4 mm/s), through the loop to the first sample.
    assert before.displacement[0] == 0.0
    assert before.time[-1] == pytest.approx(-0.5)
    assert before.time[0] == pytest.approx(-PERIOD - abs(recording.displacement[0]) / 0.4, abs=0.6)
    truth = force[first : first + length]
    found = simulated(recording.time, recording.displacement, name, before)
    bare = simulated(recording.time, recording.displacement, name)
    error, without = (np.sqrt(np.mean((one - truth) ** 2)) / np.ptp(truth) for one in (found, bare))
    # The cycles before the assumed one have faded to exp(-40 / 8) = 0.7 %; friction knows its last reversals only.
    assert error < 5e-4
    # Without it the error is that of a loop that begins from rest. At a turning point, friction begins anew.
    assert without > {"viscoelasticity": 0.01, "friction": 0.002 if first in (80, 110) else 0.0}[name]


def test_inverse_and_direct_say_that_the_rubber_remembers(known, tmp_path):
    name, force = known
    recording = cut(force, 100, 181)
    rows = zip(recording.time, recording.displacement, recording.force, strict=True)
    table = "\n".join(["time_s,displacement_mm,force_N", *(f"{t},{q},{f}" for t, q, f in rows)])
    (tmp_path / "axial.csv").write_text(table + "\n")
    (tmp_path / "case.toml").write_text(CASE.format(effect=EFFECTS[name]))
    case = load_case(tmp_path / "case.toml")
    fit = identify(Task(case, "neo_hookean"))
    assert "not_from_rest" in [one.name for one in fit.conditions]
    assert "the first cycle, once more" in next(
        one.message for one in fit.conditions if one.name == "not_from_rest"
    )
    assert fit.curves[0].rms_percent < 0.3
    response = predict(case, case.material)
    assert [one.name for one in response.conditions].count("not_from_rest") == 1
    # The elastic law alone remembers nothing.
    alone = replace(case, effects=())
    assert "not_from_rest" not in [one.name for one in predict(alone, case.material).conditions]


def test_a_ramp_leads_to_where_an_open_recording_begins(known):
    name, force = known
    # From the first peak to the trough: no cycle closes.
    recording = cut(force, 20, 61)
    before = earlier(recording)
    assert before is not None
    assert not before.repeats
    assert before.displacement == pytest.approx([0.0])
    assert before.time == pytest.approx([-10.0])
    found = simulated(recording.time, recording.displacement, name, before)
    assert np.sqrt(np.mean((found - force[20:61]) ** 2)) < 0.005 * np.ptp(force)


def test_without_times_the_path_is_counted_in_samples():
    force = simulated(TIME, Q, "friction")
    recording = replace(cut(force, 110, 191), time=None)
    before = earlier(recording)
    assert before is not None
    assert np.all(np.diff(before.time) > 0)
    found = simulated(None, recording.displacement, "friction", before)
    assert np.sqrt(np.mean((found - force[110:191]) ** 2)) < 0.005 * np.ptp(force)


@pytest.mark.parametrize(
    ("begins", "time", "path"),
    [
        # A clock that counts from the loading; one that begins with the record, and one of a longer test.
        (10.0, [-11.0, -10.0], [0.0, 2.0]),
        (0.0, [-1.0], [0.0]),
        (500.0, [-1.0], [0.0]),
    ],
)
def test_a_hold_without_its_ramp_was_loaded_when_its_clock_began(begins, time, path):
    seconds = begins + 10.0 * np.arange(30.0)
    before = earlier(Recording("axial", np.full(30, 2.0), np.linspace(500.0, 400.0, 30), seconds))
    assert before is not None
    assert not before.repeats
    np.testing.assert_allclose(before.time, time)
    np.testing.assert_allclose(before.displacement, path)


def test_the_rate_of_the_ramp_is_that_of_the_motion_without_holds():
    # 2 mm held for 100 s, then to 4 mm within 10 s: loaded at 0.2 mm/s.
    seconds = np.arange(0.0, 111.0, 1.0)
    q = np.interp(seconds, [0.0, 100.0, 110.0], [2.0, 2.0, 4.0])
    before = earlier(Recording("axial", q, 100.0 * q, seconds))
    assert before is not None
    assert before.time == pytest.approx([-10.0], rel=0.02)


def test_a_hold_without_its_ramp_is_simulated_as_with_it():
    # Loaded in half a second; the record begins 10 s later, and its clock counts from the end of the loading.
    seconds = np.concatenate([[-0.5, 0.0], np.arange(10.0, 200.0, 5.0)])
    q = np.where(seconds >= 0.0, 2.0, 0.0)
    whole = simulated(seconds, q, "viscoelasticity")
    hold = Recording("axial", q[2:], whole[2:], seconds[2:])
    found = simulated(hold.time, hold.displacement, "viscoelasticity", earlier(hold))
    np.testing.assert_allclose(found, whole[2:], rtol=2e-3)
