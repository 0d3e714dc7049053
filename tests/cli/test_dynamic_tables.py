"""Tables of dynamic stiffness on the command line: check shows them, fit gives the spectrum of a coupon's."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from bushcli.cli import main

CASE = """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[material]
law = "neo_hookean"
[[recordings]]
mode = "radial"
kind = "dynamic"
file = "radial.csv"
amplitude_is = "double"
[[coupons]]
mode = "uniaxial"
kind = "dynamic"
name = "sweep"
file = "sweep.csv"
"""


@pytest.fixture
def case(tmp_path):
    """Write a bushing's table, and a coupon's sweep of a rubber with two branches."""
    text = "Temperature: 23 °C\nfrequency_Hz,amplitude_mm,stiffness_N_per_mm,loss_angle_deg\n"
    text += "1,0.2,900,5\n10,0.2,950,6\n"
    (tmp_path / "radial.csv").write_text(text, encoding="utf-8")
    frequency = np.geomspace(0.1, 100.0, 13)
    x = 2j * np.pi * frequency[:, None] * np.array([0.01, 0.3])
    modulus = 3.0 + (x / (1.0 + x)) @ np.array([0.9, 0.6])
    rows = "".join(f"{f:.6g},{m.real:.8g},{m.imag:.8g}\n" for f, m in zip(frequency, modulus, strict=True))
    (tmp_path / "sweep.csv").write_text("f [Hz],E' [MPa],E'' [MPa]\n" + rows)
    (tmp_path / "case.toml").write_text(CASE)
    return tmp_path / "case.toml"


def run(*arguments):
    return CliRunner().invoke(main, [str(one) for one in arguments])


def test_check_shows_tables_and_resolves_their_keys(case):
    done = run("check", case, "--json")
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    radial, sweep = result["dynamic"]
    assert (radial["rows"], radial["amplitude"], radial["temperature"]) == (2, [0.1, 0.1], [23.0, 23.0])
    assert (sweep["quantity"], sweep["units"]["stiffness"]) == ("E", "MPa")
    assert result["case"]["recordings"][0]["amplitude_is"] == "double"
    assert "900 to 950" in run("check", case).output


def test_fit_gives_the_spectrum_of_a_coupon(case):
    done = run("fit", case, "--json")
    assert done.exit_code == 0, done.output
    (found,) = json.loads(done.stdout)["dynamic"]
    assert found["name"] == "sweep"
    assert max(found["misfit"].values()) < 1.0
    assert found["equilibrium"] == pytest.approx(3.0, rel=0.01)
    # The sum of the branches is what the modulus rises by, however it is shared among neighbouring times.
    assert found["equilibrium"] * sum(one["g"] for one in found["terms"]) == pytest.approx(1.5, rel=0.03)


def test_fit_leaves_out_rows_of_a_coupon_that_dissipate_nothing(case):
    """A negative loss, of a force that is logged late, has no place in a spectrum."""
    expected = json.loads(run("fit", case, "--json").stdout)["dynamic"][0]
    sweep = case.parent / "sweep.csv"
    sweep.write_text(sweep.read_text() + "300,4.5,-0.2\n")
    done = run("fit", case, "--json")
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert result["dynamic"][0]["terms"] == expected["terms"]
    assert any("loss is not positive in 1 row" in problem["message"] for problem in result["problems"])


def test_angles_that_a_rig_shows_as_zero_are_left_out_unless_the_case_accepts_them(case):
    frequency = np.geomspace(1.0, 200.0, 20)
    shown = np.maximum(6.0 - 0.08 * frequency, 0.0)
    rows = "".join(f"{f:.4g},0.2,{900 + f:.5g},{d:.2f}\n" for f, d in zip(frequency, shown, strict=True))
    head = "frequency_Hz,amplitude_mm,stiffness_N_per_mm,loss_angle_deg\n"
    (case.parent / "radial.csv").write_text(head + rows)
    assert "loss angle is exactly 0 in 4 rows" in " ".join(run("check", case).output.split())
    case.write_text(CASE.replace('"double"', '"double"\naccept = ["clipped"]'))
    done = run("check", case)
    assert done.exit_code == 0
    assert "exactly 0" not in done.output


@pytest.mark.parametrize("command", ["diagnose", "inverse"])
def test_a_command_without_use_for_moduli_of_a_coupon_names_the_one_that_has(case, command):
    bushing = CASE[CASE.index("[[recordings]]") : CASE.index("[[coupons]]")]
    case.write_text(CASE.replace(bushing, ""))
    done = run(command, case)
    assert done.exit_code == 2
    assert "dynamic moduli of a coupon are for `bushcli fit`" in " ".join(done.output.split())


def test_what_is_asked_ends_with_exit_code_2_and_the_key(case):
    case.write_text(CASE.replace('amplitude_is = "double"\n', ""))
    done = run("check", case)
    assert done.exit_code == 2
    assert 'amplitude_is = "peak", "double" or "rms"' in done.output


def test_fit_says_why_a_sweep_has_no_spectrum(case):
    sweep = case.parent / "sweep.csv"
    sweep.write_text("".join(sweep.read_text().splitlines(keepends=True)[:4]))
    done = run("fit", case)
    assert done.exit_code == 2
    assert "3 frequencies" in done.output
    assert "at least 4 frequencies" in done.output


def test_a_table_far_from_the_static_stiffness_is_asked_for_its_unit(tmp_path):
    """418 N/mm of a static curve (C10 = 0.5 MPa), beside a table that is ten times as stiff."""
    rows = "".join(f"{i},{0.2 * i:.1f},{83.6 * i + (-1) ** i:.1f}\n" for i in range(12))
    (tmp_path / "axial.csv").write_text("time_s,displacement_mm,force_N\n" + rows)
    static = '[[recordings]]\nmode = "axial"\nfile = "axial.csv"\nname = "loop"\n'
    table = '[[recordings]]\nmode = "axial"\nkind = "dynamic"\nfile = "table.csv"\nname = "table"\n'
    effect = '[[effects]]\nname = "viscoelasticity"\nparameters = { g1 = 0.1, tau1 = 0.05 }\n'
    effect += "[mesh]\nelements_across = 3\n"
    head = CASE.split("[[recordings]]", maxsplit=1)[0]
    (tmp_path / "case.toml").write_text(head + effect + static + table)
    rows = "".join(f"{f},{4100 + 20 * f},{d}\n" for f, d in ((1, 2.0), (3, 2.2), (10, 2.1), (30, 1.9)))
    (tmp_path / "table.csv").write_text("frequency_Hz,stiffness_N_per_mm,loss_angle_deg\n" + rows)
    held = ("--fix", "viscoelasticity.g1", "--fix", "viscoelasticity.tau1")
    done = run("inverse", tmp_path / "case.toml", "--json", "-q", *held)
    found = [one for one in json.loads(done.stdout)["problems"] if one["name"] == "table_above_errors"]
    assert found, done.stdout
    assert "times the simulated one: check the units" in found[0]["remedy"]
