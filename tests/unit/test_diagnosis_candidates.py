"""Derivatives of what an effect would do, where the fitted law does not bear the bushing with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bushcli.casefile import load_case
from bushcli.diagnosis import candidates
from bushcli.diagnosis.model import Model
from bushcli.diagnosis.noise_model import Compared, NoiseModel
from bushcli.effect import effects
from bushcli.recording import Recording
from cases.march import NotConverged

EXAMPLE = Path(__file__).parents[2] / "examples" / "concealed" / "case.toml"
# Bent far from any rubber's shape, initial shear modulus 2 C10 = 1.4 MPa.
BENT = {"C10": 0.7, "C20": 0.3, "C30": -0.5}


def test_another_point_is_tried_where_the_first_cannot_be_solved(monkeypatch):
    asked = []

    def derivative(channel, values, names, trial):
        asked.append(values["C10"])
        if values["C10"] < 0.5:
            raise NotConverged(None, 1.0, "beyond", 0.5)
        return np.ones((3, 1))

    monkeypatch.setattr(candidates, "_derivative", derivative)
    points = ({"C10": 0.4}, {"C10": 0.6}, {"C10": 0.7})
    assert candidates._solved(None, points, [], None).shape == (3, 1)
    assert asked == [0.4, 0.6]
    assert candidates._solved(None, points[:1], [], None) is None


def test_the_laws_own_shape_has_the_fitted_stiffness():
    case = load_case(EXAMPLE, ())
    own = candidates._at_own_shape(Model("yeoh", BENT), case)
    law = own.task(case).law
    assert law.shear_modulus(**own.start) == pytest.approx(1.4)
    starts = {p.name: p.start for p in law.parameters}
    assert own.start["C30"] / own.start["C10"] == pytest.approx(starts["C30"] / starts["C10"])


def compared(mode, name=""):
    curve = np.linspace(-1.0, 1.0, 9)
    return Compared(
        Recording(mode=mode, name=name or mode, displacement=curve, force=curve), curve, NoiseModel(1.0)
    )


def test_what_belongs_to_a_rig_is_tried_in_one_mode_at_a_time():
    slow, fast = compared("axial", "slow"), compared("axial", "fast")
    turned = compared("torsional")
    for name in ("bump_stop", "free_play", "offset"):
        assert candidates.rigs(effects()[name], [slow, turned, fast]) == [("slow", "fast"), ("torsional",)]
        # One rig: nothing to tell apart, and the effect stays with recordings that are added.
        assert candidates.rigs(effects()[name], [slow, fast]) == [None]
    assert candidates.rigs(effects()["mullins"], [slow, turned]) == [None]
    assert candidates.rigs(effects()["time_lag"], [slow, turned]) == [None]


def test_what_needs_time_is_tried_where_there_is_time():
    untimed, timed = compared("axial"), compared("radial")
    timed = replace(timed, recording=replace(timed.recording, time=np.arange(9.0)))
    for name in ("viscoelasticity", "time_lag"):
        assert candidates.rigs(effects()[name], [untimed, timed]) == [("radial",)]
        assert candidates.rigs(effects()[name], [timed]) == [None]
    assert candidates.rigs(effects()["mullins"], [untimed, timed]) == [None]
