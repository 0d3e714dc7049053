"""Models that a diagnosis keeps: a known model is not made again, and other data make another model."""

from __future__ import annotations

from pathlib import Path

import pytest

from bushcli.case import load_case
from bushcli.inverse.task import Task
from bushcli.selection.model import Model
from bushcli.selection.model_cache import ModelCache

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
