"""Measured tables of dynamic stiffness beside the simulation: preloads by travel and by force, misfits."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from bushcli.case import load_case
from bushcli.cli import main
from bushcli.recording.dynamic.read import read_dynamic
from bushcli.simulate.dynamic import vibrate
from bushcli.simulate.dynamic_tables import compare_tables

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
C10 = 0.5
[[effects]]
name = "viscoelasticity"
parameters = {g1 = 0.2, tau1 = 0.01}
"""
VIBRATION = """
[[load_cases]]
mode = "axial"
[load_cases.dynamic]
preload = 1.5
frequency = [1.0, 10.0, 50.0]
"""
TABLE = """
[[recordings]]
mode = "axial"
kind = "dynamic"
file = "table.csv"
"""


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """Return the curve about a travel of 1.5 mm, and the folder of the case."""
    folder = tmp_path_factory.mktemp("tables")
    (folder / "vibration.toml").write_text(CASE + VIBRATION)
    (curve,) = vibrate(load_case(folder / "vibration.toml")).curves
    return curve, folder


def written(folder, curve, preload, factor=1.0, turn=0.0):
    """Write a table of the curve, with another magnitude and loss angle (degrees), and return the case that has it."""
    rows = zip(
        curve.frequency, factor * np.abs(curve.stiffness), np.degrees(curve.loss_angle) + turn, strict=True
    )
    name, value = preload
    head = f"frequency_Hz,{name},stiffness_N_per_mm,loss_angle_deg\n"
    text = head + "".join(f"{f},{value:.8g},{size:.8g},{angle:.8g}\n" for f, size, angle in rows)
    (folder / "table.csv").write_text(text)
    (folder / "case.toml").write_text(CASE + TABLE)
    return load_case(folder / "case.toml")


@pytest.mark.parametrize("by", ["travel", "force"])
def test_the_simulation_agrees_with_a_table_of_its_own(simulated, by):
    curve, folder = simulated
    preload = ("preload_mm", 1.5) if by == "travel" else ("preload_N", curve.force)
    case = written(folder, curve, preload)
    (one,), conditions = compare_tables(case, case.material, [read_dynamic(case.dynamic[0])])
    assert not conditions
    assert one.stiffness_percent < 0.01
    assert one.loss_angle_deg < 0.001
    np.testing.assert_allclose(one.preload, 1.5, rtol=1e-4)


def test_misfits_are_those_that_were_put_in(simulated):
    curve, folder = simulated
    written(folder, curve, ("preload_mm", 1.5), 1 / 1.1, 2.0)
    done = CliRunner().invoke(main, ["direct", str(folder / "case.toml"), "--json"])
    assert done.exit_code == 0, done.output
    (found,) = json.loads(done.stdout)["dynamic"]
    assert found["misfit"]["stiffness_percent"] == pytest.approx(10.0, abs=0.01)
    assert found["misfit"]["loss_angle_deg"] == pytest.approx(2.0, abs=0.001)
    np.testing.assert_allclose(found["recorded"]["stiffness"], np.abs(curve.stiffness) / 1.1, rtol=1e-6)


@pytest.mark.parametrize(("factor", "code"), [(1 / 1.05, 0), (1 / 1.2, 1)])
def test_a_table_beyond_the_tolerance_is_not_accepted(simulated, factor, code):
    curve, folder = simulated
    written(folder, curve, ("preload_mm", 1.5), factor)
    done = CliRunner().invoke(main, ["direct", str(folder / "case.toml"), "--strict"])
    assert done.exit_code == code
    assert ("not within the accepted 10 %" in done.stdout) == bool(code)


def test_a_rubber_without_a_branch_is_refused_with_the_remedy(simulated):
    curve, folder = simulated
    written(folder, curve, ("preload_mm", 1.5))
    text = (folder / "case.toml").read_text().partition("[[effects]]")[0]
    (folder / "elastic.toml").write_text(text + TABLE)
    done = CliRunner().invoke(main, ["direct", str(folder / "elastic.toml")])
    assert done.exit_code == 2
    assert 'name = "viscoelasticity"' in done.output


def test_a_rig_of_a_table_is_in_the_comparison(simulated):
    """Series spring, late force, wrong gain and a zero that is off, by their formulas; another channel has none."""
    curve, folder = simulated
    written(folder, curve, ("preload_mm", 1.5))
    effects = """
[[effects]]
name = "rig_compliance"
parameters = {stiffness = 2000.0}
[[effects]]
name = "time_lag"
parameters = {lag = 0.0002}
[[effects]]
name = "gain"
channels = ["second"]
parameters = {error = 0.03}
[[effects]]
name = "offset"
channels = ["second"]
parameters = {displacement = 0.1, force = 3.0}
"""
    second = TABLE + 'name = "second"\n'
    (folder / "rig.toml").write_text(CASE + effects + TABLE + second)
    case = load_case(folder / "rig.toml")
    tables = [read_dynamic(one) for one in case.dynamic]
    found, conditions = compare_tables(case, case.material, tables)
    assert not conditions
    expected = np.exp(-2j * np.pi * curve.frequency * 2e-4) / (1.0 / curve.stiffness + 1.0 / 2000.0)
    np.testing.assert_allclose(found[0].simulated, expected, rtol=1e-5)
    np.testing.assert_allclose(found[1].simulated, 1.03 * expected, rtol=1e-5)


def test_a_stop_beside_the_bushing_carries_its_share_of_the_preload(simulated):
    curve, folder = simulated
    stop = '[[effects]]\nname = "bump_stop"\nparameters = {stiffness = 100.0, gap = 1.0}\n'
    case = written(folder, curve, ("preload_N", curve.force + 50.0))
    (folder / "stop.toml").write_text(CASE + stop + TABLE)
    case = load_case(folder / "stop.toml")
    (found,), _ = compare_tables(case, case.material, [read_dynamic(case.dynamic[0])])
    np.testing.assert_allclose(found.preload, 1.5, rtol=1e-4)
    np.testing.assert_allclose(found.simulated, curve.stiffness + 100.0, rtol=1e-4)


def test_free_play_has_no_stiffness_of_its_own_and_is_said_to_be_left_out(simulated):
    curve, folder = simulated
    written(folder, curve, ("preload_mm", 1.5))
    play = '[[effects]]\nname = "free_play"\nparameters = {half_width = 0.05}\n'
    (folder / "play.toml").write_text(CASE + play + TABLE)
    case = load_case(folder / "play.toml")
    (found,), (said,) = compare_tables(case, case.material, [read_dynamic(case.dynamic[0])])
    assert said.name == "effect_left_out"
    assert "free_play" in said.message
    np.testing.assert_allclose(found.simulated, curve.stiffness, rtol=1e-5)


@pytest.mark.parametrize(
    ("preload", "code", "says"),
    [(("preload_mm", 400.0), 2, "times the rubber's thickness"), (("preload_N", 1e9), 3, "is not reached")],
)
def test_a_preload_that_the_bushing_cannot_have_is_named(simulated, preload, code, says):
    curve, folder = simulated
    written(folder, curve, preload)
    done = CliRunner().invoke(main, ["direct", str(folder / "case.toml")])
    assert done.exit_code == code
    assert says in " ".join(done.output.split())
