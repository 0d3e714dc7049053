"""Models that a diagnosis keeps: a known model is not made again, and other data make another model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bushcli.case import load_case
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect
from bushcli.inverse.task import Task
from bushcli.selection.model import Model
from bushcli.selection.model_cache import COMPARED, ESTIMATED, ModelCache
from cases.kernels import Call

CASE = """\
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0
[material]
law = "neo_hookean"
[[recordings]]
mode = "axial"
file = "axial.csv"
"""


def record(folder: Path, stiffness: float) -> None:
    rows = [f"{0.1 * i:g},{0.1 * stiffness * i:g}" for i in range(8)]
    (folder / "axial.csv").write_text("\n".join(["displacement_mm,force_N", *rows]) + "\n")


@pytest.fixture
def task(tmp_path: Path) -> Task:
    (tmp_path / "case.toml").write_text(CASE)
    record(tmp_path, 300.0)
    return Model("neo_hookean", {"C10": 0.5}).task(load_case(tmp_path / "case.toml"))


def test_channels_are_kept_until_their_recording_is_another_one(tmp_path: Path, task: Task) -> None:
    cache = ModelCache()

    def channel():
        return cache.channels(task)[0]

    first = channel()
    assert channel() is first
    record(tmp_path, 400.0)
    second = channel()
    assert second is not first
    assert second.recording.force[-1] / first.recording.force[-1] == pytest.approx(400.0 / 300.0)
    # The body is the same.
    assert second.model is first.model


def test_caches_are_independent(task: Task) -> None:
    one, other = ModelCache(), ModelCache()
    (mine,), (theirs,) = one.channels(task), other.channels(task)
    assert mine is not theirs
    assert mine.model is not theirs.model
    theirs.model.set_parameters({"C10": 5.0}, 2000.0)
    assert mine.model.parameters != theirs.model.parameters


@pytest.fixture
def viscous(tmp_path: Path) -> tuple[Task, Model]:
    """A recording of two cycles, and a model whose rubber is viscous."""
    path = 4.0 * np.sin(np.linspace(0.0, 4.0 * np.pi, 80))
    rows = [f"{0.1 * i:.6g},{q:.6g},{300.0 * q:.6g}" for i, q in enumerate(path)]
    (tmp_path / "axial.csv").write_text("\n".join(["time_s,displacement_mm,force_N", *rows]) + "\n")
    (tmp_path / "case.toml").write_text(CASE)
    active = ActiveEffect(effect("viscoelasticity"), {"g1": 0.2, "tau1": 1.0})
    model = Model("neo_hookean", {"C10": 0.5}, effects=(active,))
    return model.task(load_case(tmp_path / "case.toml")), model


def test_a_branch_is_evaluated_only_while_it_has_an_amplitude(viscous, monkeypatch) -> None:
    task, model = viscous
    channel, called, plain_call = ModelCache().channels(task)[0], [], Call.__call__
    monkeypatch.setattr(Call, "__call__", lambda call: called.append(call) or plain_call(call))
    (branch,) = (entry[1] for entry in channel.model.body.material._without_moduli.adding)
    channel.simulation.solve(model.values | {"viscoelasticity.g1": 0.0})
    assert branch not in called
    channel.simulation.solve(model.values)
    assert branch in called


def test_marches_that_compare_models_take_fewer_corrections_for_the_same_force(viscous) -> None:
    task, model = viscous
    cache, names = ModelCache(), ("C10", "viscoelasticity.g1", "viscoelasticity.tau1")
    usual, compared, estimated = (
        cache.channels(task, **given)[0].simulation.solve(model.values, names)
        for given in ({}, {"tolerance": COMPARED}, {"tolerance": ESTIMATED})
    )
    counts = [sum(attempt.newton for attempt in one.history.attempts) for one in (usual, compared, estimated)]
    assert counts[0] > counts[1] > counts[2]
    for one, error in ((compared, 2e-6), (estimated, 2e-5)):
        assert np.abs(one.force - usual.force).max() < error * np.ptp(usual.force)
        assert (np.abs(one.slope - usual.slope).max(axis=0) < 3e-3 * np.abs(usual.slope).max(axis=0)).all()


def test_a_coarse_mesh_is_corrected_beside_a_bond_that_may_end_anywhere(viscous, tmp_path: Path) -> None:
    """The correction is that between its own meshes, which differ from those of a bushing bonded to its ends."""
    task, model = viscous
    rows = [
        f"{i},{q:.6g},{1500.0 * q:.6g}" for i, q in enumerate(0.5 * np.sin(np.linspace(0.0, 2.0 * np.pi, 20)))
    ]
    (tmp_path / "axial.csv").write_text("\n".join(["time_s,displacement_mm,force_N", *rows]) + "\n")
    radial = replace(task.case.recordings[0], mode="radial")
    bond = ActiveEffect(effect("debonding"), {"length": 0.0, "bond": 2.0})
    both = replace(model, effects=(*model.effects, bond))
    task = both.task(replace(task.case, recordings=(radial,)))
    values = both.values | {"viscoelasticity.g1": 0.0}
    cache = ModelCache()

    def force(**given):
        (channel,) = cache.channels(task, **given)
        return channel.at_samples(channel.solve(values, ()))[0]

    exact, corrected = force(), force(coarse="memory", anchor=model.start)
    assert np.abs(corrected - exact).max() < 1e-4 * np.ptp(exact)
    assert np.abs(force(coarse="memory") - exact).max() > 1e-3 * np.ptp(exact)
