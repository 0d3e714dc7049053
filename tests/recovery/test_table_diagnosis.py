"""A diagnosis of a table of dynamic stiffness: what the rig adds is named, with its size, beside the rubber's loss."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from bushcli.case import load_case
from bushcli.cli import main
from bushcli.simulate.dynamic import vibrate

RUBBER = """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[mesh]
elements_across = 2
[material]
law = "neo_hookean"
bulk_modulus = 2000.0
[material.parameters]
C10 = {}
"""
TRUE = """
[[effects]]
name = "viscoelasticity"
parameters = { g1 = 0.3, tau1 = 0.004 }
[[load_cases]]
mode = "axial"
[load_cases.dynamic]
preload = [0.0, 3.0]
frequency = { from = 1, to = 200, points = 12 }
"""
TABLE = """
[[recordings]]
mode = "axial"
kind = "dynamic"
name = "rig"
file = "rig.csv"
amplitude_is = "peak"
"""
MASS = 0.06


def made(folder, rubber, rest, table, mass, noise):
    """Write a case and its table, of a rig with a mass (kg) and with noise (share of |K*|, degrees)."""
    (folder / "true.toml").write_text(rubber.format(0.55) + rest)
    rng, rows = (
        np.random.default_rng(3),
        ["frequency_Hz,preload_mm,stiffness_N_per_mm,loss_angle_deg,amplitude_mm"],
    )
    for curve in vibrate(load_case(folder / "true.toml")).curves:
        K = curve.stiffness - 1e-3 * mass * (2 * np.pi * curve.frequency) ** 2
        size = np.abs(K) * (1 + noise[0] * rng.standard_normal(len(K)))
        angle = np.degrees(np.angle(K)) + noise[1] * rng.standard_normal(len(K))
        rows += [
            f"{f:.4g},{curve.preload},{s:.5g},{a:.3f},{curve.amplitude or 0.01}"
            for f, s, a in zip(curve.frequency, size, angle, strict=True)
        ]
    (folder / "rig.csv").write_text("\n".join(rows) + "\n")
    (folder / "case.toml").write_text(rubber.format(0.4) + table)
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return made(tmp_path_factory.mktemp("rig"), RUBBER, TRUE, TABLE, MASS, (0.004, 0.15))


@pytest.fixture(scope="module")
def document(folder):
    asked = ["diagnose", str(folder / "case.toml"), "--json", "-q", "-o", str(folder / "out")]
    answer = CliRunner().invoke(main, asked, catch_exceptions=False)
    assert answer.exit_code == 0
    return json.loads(answer.stdout)


def test_rubber_and_rig_are_named_with_their_values(document):
    assert document["verdict"] == "missing_physics"
    named = {one["name"]: one["parameters"] for one in document["effects"]}
    assert set(named) == {"viscoelasticity", "fixture_mass"}
    for one, truth in (
        (named["fixture_mass"]["mass"], MASS),
        (named["viscoelasticity"]["g1"], 0.3),
        (named["viscoelasticity"]["tau1"], 0.004),
    ):
        assert one["value"] == pytest.approx(truth, rel=0.1)
        assert one["lower"] < one["value"] < one["upper"]
    assert document["probability"]["fixture_mass"] > 0.9
    assert document["probability"]["time_lag"] < 0.1


def test_the_table_is_shown_before_and_after(document, folder):
    (table,) = document["dynamic"]
    assert table["name"] == "rig"
    assert (
        len(table["stiffness"]) == len(table["recorded"]["stiffness"]) == len(table["plain"]["storage"]) == 24
    )
    assert document["misfit"]["before"]["rig"] > 5.0
    assert document["misfit"]["after"]["rig"] < 1.5 * document["misfit"]["noise"]["rig"] < 1.5
    assert any("loss angle is off" in place for place in table["places"])
    assert not table["remaining"]
    page = (folder / "out" / "report.html").read_text()
    assert "Dynamic stiffness: simulated and measured" in page
    assert "Recorded and simulated curves" not in page
    assert {"rig-table.csv", "identified.toml"} <= {file.name for file in (folder / "out").iterdir()}


def test_effects_without_dynamic_stiffness_are_not_detectable(folder):
    asked = ["diagnose", str(folder / "case.toml"), "--json", "-q", "--effects", "viscoelasticity,mullins"]
    answer = CliRunner().invoke(main, asked, catch_exceptions=False)
    said = json.loads(answer.stdout)
    assert said["searched"]["untestable"]["mullins"] == "these recordings do not respond to it"
    assert said["probability"]["mullins"] == 0.0


def test_a_single_table_cannot_be_held_out(folder):
    answer = CliRunner().invoke(main, ["diagnose", str(folder / "case.toml"), "--hold-out", "rig"])
    assert answer.exit_code == 2
    assert "leaves no channel to diagnose" in answer.output


RADIAL = """
[[effects]]
name = "viscoelasticity"
parameters = { g1 = 0.18, tau1 = 0.0072, g2 = 0.3, tau2 = 0.0145 }
[[load_cases]]
mode = "radial"
[load_cases.dynamic]
preload = [0.0, 1.0, 2.0]
frequency = { from = 3, to = 82, points = 20 }
"""


def test_a_known_effect_is_fitted_before_an_unknown_one_is_stated(tmp_path):
    # Beside branches that leave ten times the noise, first order finds half of what the mass explains.
    rubber = RUBBER.replace(
        "elements_across = 2", "elements_across = 2\nelements_along = 3\nelements_around = 6"
    )
    made(tmp_path, rubber, RADIAL, TABLE.replace("axial", "radial"), 6.0, (0.01, 0.1))
    answer = CliRunner().invoke(main, ["diagnose", str(tmp_path / "case.toml"), "--json", "-q", "--no-maps"])
    said = json.loads(answer.stdout)["probability"]
    assert said["fixture_mass"] > 0.9
    assert said["unknown"] < 0.1


FILLED = """
[[effects]]
name = "payne"
parameters = { g = 0.9, tau = 5.0, decades = 5.0, slope = 0.0, path = 400.0, exponent = 1.6 }
[[load_cases]]
mode = "axial"
[load_cases.dynamic]
frequency = { from = 1, to = 150, points = 6 }
amplitude = [0.02, 0.1, 0.5]
"""


def test_how_the_payne_effect_depends_on_the_amplitude_is_identified(tmp_path):
    made(tmp_path, RUBBER, FILLED, TABLE, 0.0, (0.005, 0.15))
    answer = CliRunner().invoke(main, ["diagnose", str(tmp_path / "case.toml"), "--json", "-q", "--no-maps"])
    said = json.loads(answer.stdout)
    (payne,) = said["effects"]
    assert payne["name"] == "payne"
    assert payne["parameters"]["exponent"]["value"] == pytest.approx(1.6, abs=0.2)
    assert said["misfit"]["after"]["rig"] < 1.5 * said["misfit"]["noise"]["rig"]


def written(folder, rubber, stiffness, amplitudes, noise):
    """Write a case and a table of a stiffness over frequency (Hz) and amplitude (mm), with noise as in `made`."""
    rng, f = np.random.default_rng(5), np.geomspace(1.2, 136.0, 8)
    frequency, amplitude = (a.ravel() for a in np.meshgrid(f, amplitudes))
    K = stiffness(frequency, amplitude)
    size = np.abs(K) * (1 + noise[0] * rng.standard_normal(len(K)))
    angle = np.degrees(np.angle(K)) + noise[1] * rng.standard_normal(len(K))
    columns = np.column_stack([frequency, amplitude, size, angle])
    head = "frequency_Hz,amplitude_mm,stiffness_N_per_mm,loss_angle_deg"
    np.savetxt(folder / "rig.csv", columns, delimiter=",", header=head, comments="", fmt="%.6g")
    (folder / "case.toml").write_text(rubber.format(0.4) + TABLE)
    asked = ["diagnose", str(folder / "case.toml"), "--json", "-q", "--no-maps"]
    return json.loads(CliRunner().invoke(main, asked, catch_exceptions=False).stdout)


def test_a_spring_pot_that_no_amplitude_thins_is_viscoelasticity(tmp_path):
    """A search for its spectrum that begins without a slope ends at a minimum with 1.25 times the noise."""

    def stiffness(frequency, amplitude):
        return 400.0 * (1.0 + 0.386 * (2j * np.pi * frequency * 0.00997) ** 0.342)

    said = written(tmp_path, RUBBER, stiffness, [0.0173, 0.0866, 0.4331], (0.008, 0.157))
    assert said["probability"]["viscoelasticity"] > 0.95
    assert said["probability"]["payne"] < 0.05
    assert said["misfit"]["after"]["rig"] < 0.9


def test_a_cole_cole_element_that_amplitude_thins_is_the_payne_effect_alone(tmp_path):
    """In a thin layer of rubber, where the local amplitude is that of the sleeve over the thickness."""
    layer = RUBBER.replace("inner_radius = 12.0", "inner_radius = 20.0")

    def stiffness(frequency, amplitude):
        times = 0.05 / (1.0 + (amplitude / 2.0 / 0.008) ** 2.3)
        w = (2j * np.pi * frequency * times) ** 0.3
        return 2100.0 * (1.0 + 0.9 * w / (1.0 + w))

    said = written(tmp_path, layer, stiffness, [0.004, 0.02, 0.1], (0.006, 0.25))
    assert said["probability"]["payne"] > 0.95
    assert said["probability"]["viscoelasticity"] < 0.1
    (payne,) = said["effects"]
    assert payne["parameters"]["pace"]["value"] > 0.0


@pytest.mark.parametrize(("accept", "doubted"), [("[]", ["double"]), ('["amplitude"]', [])])
def test_double_amplitudes_of_one_table_contradict_the_other_table(tmp_path, accept, doubted):
    # Every second row as another laboratory wrote it: from peak to peak, which it does not say.
    made(tmp_path, RUBBER, FILLED, TABLE, 0.0, (0.005, 0.15))
    head, *rows = (tmp_path / "rig.csv").read_text().splitlines()
    split = [row.rpartition(",") for row in rows[1::2]]
    for name, own in (("rig", rows[::2]), ("double", [f"{row},{2 * float(a)}" for row, _, a in split])):
        (tmp_path / f"{name}.csv").write_text("\n".join([head, *own]) + "\n")
    other = TABLE.replace("rig", "double") + f"accept = {accept}\n"
    (tmp_path / "case.toml").write_text(RUBBER.format(0.4) + TABLE + other)
    asked = ["diagnose", str(tmp_path / "case.toml"), "--json", "-q", "--no-maps", "--effects", "payne"]
    said = json.loads(CliRunner().invoke(main, asked, catch_exceptions=False).stdout)
    assert [fault["channel"] for fault in said["data_faults"] if fault["kind"] == "amplitude"] == doubted
    assert all(fault["probability"] > 0.95 and not fault["fatal"] for fault in said["data_faults"])
