"""Effects identified together with the law, from recordings made with other steps; and simulated by `direct`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bushcli.case import load_case
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effects
from bushcli.inverse import Task, identify
from bushcli.simulate.misfit import misfits
from bushcli.simulate.predict import predict
from bushcli.simulate.simulation import Simulation
from cases.mode import modes
from cases.simulate import Rubber
from forms.law import law

YEOH = {"C10": 0.5, "C20": -0.03, "C30": 0.006}
CASE = """
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0
[mesh]
elements_across = 2
elements_along = 5
[material]
law = "yeoh"
bulk_modulus = 2000.0
[material.parameters]
C10 = 0.45
C20 = -0.02
C30 = 0.005
[[recordings]]
mode = "axial"
file = "axial.csv"
"""


@pytest.fixture
def recorded(tmp_path):
    """Write a case whose recording has an effect, with 0.2 % noise (seed 5); every sample is a step of the truth."""

    def make(name, values, tail=""):
        (tmp_path / "case.toml").write_text(CASE)
        time = np.arange(61.0)
        corners = [0, 8, 16, 28, 40, 46, 56, 60], [0, 2, 0, 4, 0, 3, 3, 2]
        q = np.interp(time, *corners)
        (tmp_path / "axial.csv").write_text(_csv(time, q, np.sin(time)))
        case = load_case(tmp_path / "case.toml")
        active = ActiveEffect(effects()[name], values)
        rubber = Rubber(law("yeoh"), YEOH, 2000.0)
        truth = Simulation(
            case.geometry, modes()["axial"], rubber, case.mesh.refinement, [active], time, q, None
        )
        force = truth.solve({}).force
        noisy = force + 0.002 * np.ptp(force) * np.random.default_rng(5).standard_normal(len(force))
        (tmp_path / "axial.csv").write_text(_csv(time, q, noisy))
        (tmp_path / "case.toml").write_text(CASE + f'[[effects]]\nname = "{name}"\n' + tail)
        return load_case(tmp_path / "case.toml")

    return make


def _csv(*columns):
    rows = zip(*columns, strict=True)
    return "time_s,displacement_mm,force_N\n" + "\n".join(",".join(f"{v:.6f}" for v in row) for row in rows)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("mullins", {"inverse_r": 0.35, "m": 0.03, "beta": 0.1}),
        ("viscoelasticity", {"g1": 0.3, "tau1": 6.0}),
        ("free_play", {"half_width": 0.2}),
    ],
)
def test_an_effect_is_identified_together_with_the_law(recorded, name, values):
    fit = identify(Task(recorded(name, values), "yeoh"))
    (curve,) = fit.curves
    assert curve.rms_percent < 1.3 * 0.2
    (found,) = fit.effects
    for key, value in values.items():
        estimate = fit.parameters[f"{name}.{key}"]
        assert found.values[key] == estimate.value
        # Four standard errors; for the amplitude no more than 10 % either.
        assert abs(estimate.value - value) < max(4 * estimate.std, 0.02 * value)
    amplitude = next(iter(values))
    assert fit.parameters[f"{name}.{amplitude}"].value == pytest.approx(values[amplitude], rel=0.1)


@pytest.mark.slow
def test_parameters_of_an_effect_may_be_fixed(recorded):
    case = recorded("viscoelasticity", {"g1": 0.3, "tau1": 6.0}, "parameters = { g1 = 0.2, tau1 = 6.0 }\n")
    task = Task(case, "yeoh", fixed=("viscoelasticity.tau1",))
    assert task.names == ("C10", "C20", "C30", "viscoelasticity.g1")
    assert Task(case, "yeoh", fixed=("viscoelasticity",)).names == ("C10", "C20", "C30")
    fit = identify(task)
    assert fit.effects[0].values["tau1"] == 6.0
    assert fit.parameters["viscoelasticity.g1"].value == pytest.approx(0.3, rel=0.1)


def test_direct_follows_the_recorded_path_with_the_effect(recorded):
    case = recorded(
        "mullins",
        {"inverse_r": 0.35, "m": 0.03, "beta": 0.1},
        "parameters = { inverse_r = 0.35, m = 0.03, beta = 0.1 }\n",
    )
    true = replace(case, material=replace(case.material, parameters=YEOH))
    response = predict(true)
    assert misfits(response)["axial"].rms_percent < 1.2 * 0.2
    (channel,) = response.channels
    assert channel.along
    assert channel.step_error < 0.3
    plain = predict(replace(true, effects=()))
    assert misfits(plain)["axial"].rms_percent > 2.0
