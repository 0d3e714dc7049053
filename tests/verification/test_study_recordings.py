"""A study with recordings reads each file once, marches each path once per design, and agrees with `direct`."""

from __future__ import annotations

import os

import numpy as np
import pytest

from bushcli import recording
from bushcli.case import load_case
from bushcli.simulate.predict import predict
from bushcli.simulate.recording_cache import RecordingCache
from bushcli.simulate.simulation import Simulation
from bushcli.study.answers import default_answers
from bushcli.study.task import DesignCache, StudyTask, evaluate, with_fineness

CASE = """
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0
[mesh]
elements_across = 2
elements_along = 4
elements_around = 8
[material]
law = "neo_hookean"
bulk_modulus = 2000.0
[material.parameters]
C10 = 0.3
[[recordings]]
mode = "axial"
file = "axial.csv"
"""
MEMORY = """
[[effects]]
name = "viscoelasticity"
parameters = { g1 = 0.3, tau1 = 2.0 }
"""


@pytest.fixture
def recorded(tmp_path):
    """Return the case file of two cycles with a hold."""
    time = np.linspace(0.0, 20.0, 201)
    q = np.interp(time, [0.0, 4.0, 8.0, 14.0, 20.0], [0.0, 3.0, 3.0, -3.0, 0.0])
    rows = "".join(f"{t:.2f},{a:.4f},{150.0 * a:.3f}\n" for t, a in zip(time, q, strict=True))
    (tmp_path / "axial.csv").write_text("time_s,displacement_mm,force_N\n" + rows)
    return tmp_path / "case.toml"


@pytest.mark.parametrize("effects", ["", MEMORY], ids=["none", "memory"])
def test_designs_are_what_direct_makes_of_them_and_cost_one_march(recorded, monkeypatch, effects):
    recorded.write_text(CASE + effects)
    reads, solved = [], []
    read, solve = recording.read_recording, Simulation.solve
    monkeypatch.setattr(recording, "read_recording", lambda *a: reads.append(a) or read(*a))
    monkeypatch.setattr(Simulation, "solve", lambda *a, **k: solved.append(a) or solve(*a, **k))
    cache = DesignCache()
    case = load_case(recorded)
    radii = [(17.9,), (18.0,), (18.1,)]
    task = with_fineness(
        cache, StudyTask(recorded, (), ("geometry.outer_radius",), default_answers(case)), radii[0]
    )
    assert set(task.fineness) == ({"axial"} if effects else set())
    solved.clear()
    rows = evaluate(cache, task, 0, radii)
    assert [row["status"] for row in rows] == ["ok"] * 3
    assert len(reads) == 1
    assert len(solved) == (3 if effects else 0)
    response = predict(load_case(recorded, ["geometry.outer_radius=18.1"]))
    (channel,) = response.channels
    assert rows[2]["axial.initial"] == pytest.approx(channel.curve.initial_stiffness(), rel=1e-6)
    np.testing.assert_allclose(rows[2]["axial.force"], channel.curve.force, rtol=1e-6, atol=1e-4)


def test_a_design_that_cannot_be_simulated_ends_in_its_row_and_not_the_study(recorded):
    """The recorded radial travel of 3 mm is more than a rubber thickness of 2 mm allows."""
    recorded.write_text((CASE + MEMORY).replace('mode = "axial"', 'mode = "radial"\nname = "radial"'))
    cache = DesignCache()
    keys, answers = ("geometry.outer_radius",), default_answers(load_case(recorded))
    task = with_fineness(cache, StudyTask(recorded, (), keys, answers), (11.0,))
    assert task.fineness == {}
    (row,) = evaluate(cache, task, 0, [(11.0,)])
    assert (row["status"], row["failure"]) == ("failed", "input")


def test_a_file_that_was_written_anew_is_read_anew(recorded):
    recorded.write_text(CASE)
    measured, file = RecordingCache(), recorded.parent / "axial.csv"
    first = measured(load_case(recorded))[0][0]
    assert measured(load_case(recorded))[0][0] is first
    file.write_text(file.read_text().replace("450.000", "440.000"))
    os.utime(file, ns=(1, 1))
    assert measured(load_case(recorded))[0][0].force.max() < first.force.max()
