"""Tables of a rubber that amplitude thins, in `inverse`: derivatives, and concealed constants found again."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.case import load_case
from bushcli.inverse import Task, identify
from bushcli.simulate.dynamic import vibrate

CASE = """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[mesh]
elements_across = 3
[material]
law = "neo_hookean"
bulk_modulus = 2000.0
[material.parameters]
C10 = {C10}
[[effects]]
name = "payne"
parameters = {{g = {g}, tau = 1000.0, decades = 5.0, slope = -0.1, path = 1e4, offset = {offset}, exponent = 2.0}}
"""
VIBRATIONS = """
[[load_cases]]
mode = "axial"
[load_cases.dynamic]
preload = [0.0, 2.0]
amplitude = [0.02, 0.2, 1.0]
frequency = [1.0, 10.0, 100.0]
"""
TABLE = """
[[recordings]]
mode = "axial"
kind = "dynamic"
name = "rig"
file = "table.csv"
amplitude_is = "peak"
"""
TRUE = {"C10": 0.5, "g": 0.2, "offset": 0.03}
START = {"C10": 0.4, "g": 0.12, "offset": 0.05}
FIXED = tuple(f"payne.{name}" for name in ("tau", "decades", "slope", "path", "exponent"))


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """Return a case with a noisy table of a thinned rubber."""
    folder = tmp_path_factory.mktemp("thinned")
    (folder / "true.toml").write_text(CASE.format(**TRUE) + VIBRATIONS)
    rng = np.random.default_rng(7)
    rows = ["frequency_Hz,amplitude_mm,preload_mm,stiffness_N_per_mm,loss_angle_deg"]
    for curve in vibrate(load_case(folder / "true.toml")).curves:
        for f, K in zip(curve.frequency, curve.stiffness, strict=True):
            size, angle = abs(K) * (1 + 0.01 * rng.normal()), np.degrees(np.angle(K)) + 0.3 * rng.normal()
            rows.append(f"{f},{curve.amplitude},{curve.preload},{size},{angle}")
    (folder / "table.csv").write_text("\n".join(rows) + "\n")
    (folder / "case.toml").write_text(CASE.format(**START) + TABLE)
    return load_case(folder / "case.toml")


def test_derivatives_follow_the_balance(case):
    """Within what the moving of amplitudes within the body changes: up to 1 %."""
    task = Task(case, "neo_hookean")
    problem, *_ = task.problem()
    (channel,) = problem.channels
    x = task.vectors()[0]
    slope = channel.solve(problem.parameters(x), task.names).slope
    for i, name in enumerate(task.names):
        moved = np.eye(len(x))[i] * 0.02 * x
        ends = [channel.solve(problem.parameters(x + d), task.names).force for d in (moved, -moved)]
        expected = (ends[0] - ends[1]) / (0.04 * x[i])
        np.testing.assert_allclose(slope[:, i], expected, atol=0.01 * np.abs(expected).max(), err_msg=name)


def test_concealed_constants_are_found_from_all_amplitudes(case):
    fit = identify(Task(case, "neo_hookean", fixed=FIXED))
    assert fit.converged
    for name, value in TRUE.items():
        found = fit.parameters[name if name == "C10" else f"payne.{name}"]
        assert abs(found.value - value) < 3 * found.std < 0.3 * value, name
    (table,) = fit.tables
    assert len(table.table) == 18
    assert table.over_errors < 1.3
