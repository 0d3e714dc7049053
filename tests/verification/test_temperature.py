"""Temperature: a shift of all times and factors on moduli, in marches, vibrations, tables and fits."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from bushcli.case import load_case
from bushcli.cli import main
from bushcli.effects.active import ActiveEffect
from bushcli.effects.assembly import features_of
from bushcli.effects.effect import effect
from bushcli.inverse import Task
from bushcli.inverse.contained import removable_parts
from bushcli.simulate.dynamic import vibrate
from bushcli.simulate.predict import predict
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import Rubber, prepare
from forms.law import law
from geometry.shape import shapes

YEOH = {"C10": 0.5, "C20": -0.05, "C30": 0.01}
BRANCH = {"g1": 0.5, "tau1": 3.0}
WLF = {"C1": 5.0, "C2": 80.0, "exponent": 1.0, "network": 12.0}
# Closed forms at 50 degrees C, from 20: factors on all times, on moduli, and on those of branches.
SLOWER = 10.0 ** (-5.0 * 30.0 / (80.0 + 30.0))
STIFFER = 323.15 / 293.15
BONDED = np.exp(12.0 / 8.314462618e-3 * (1.0 / 323.15 - 1.0 / 293.15))


def coupon(branch, warm=None, stiffer=1.0):
    active = [ActiveEffect(effect("viscoelasticity"), branch)]
    if warm is not None:
        active.append(ActiveEffect(effect("temperature"), warm).with_start_values().at(50.0))
    rubber = Rubber(law("yeoh"), {name: stiffer * value for name, value in YEOH.items()})
    return prepare(shapes()["coupon"](), modes()["uniaxial"], rubber, features=features_of(active))


def pulled(model, **given):
    q = np.linspace(0.0, 1.0, 11)[1:]
    return march(model, Program(q, q / 0.1), **given)


def test_warm_rubber_is_rubber_of_other_times_and_moduli():
    shifted = {"g1": BONDED * 0.5, "tau1": SLOWER * 3.0}
    warm, same = coupon(BRANCH, WLF), coupon(shifted, stiffer=STIFFER)
    np.testing.assert_allclose(pulled(warm).force, pulled(same).force, rtol=1e-6)
    # At the reference there is no effect.
    warm.set_parameters({"temperature": 20.0})
    np.testing.assert_allclose(pulled(warm).force, pulled(coupon(BRANCH)).force, rtol=1e-6)


def test_arrhenius_is_wlf_with_the_absolute_reference():
    """C2 = Tr and C1 = E / (R Tr ln 10), in kelvins."""
    by_energy = {"shift": 1.0, "E": 60.0, "exponent": 0.0}
    C1 = 60.0 / (8.314462618e-3 * 293.15 * np.log(10.0))
    by_wlf = {"C1": C1, "C2": 293.15, "exponent": 0.0}
    forces = [pulled(coupon(BRANCH, values)).force for values in (by_energy, by_wlf)]
    np.testing.assert_allclose(*forces, rtol=1e-7)


def test_derivatives_by_its_constants():
    model = coupon(BRANCH, WLF)
    names = [f"temperature.{name}" for name in WLF]
    exact = pulled(model, sensitivity=names).sensitivity
    for i, name in enumerate(names):
        value = float(model.constants[name].value)
        ends = []
        for sign in (1.0, -1.0):
            model.set_parameters({name: value * (1.0 + 1e-4 * sign)})
            ends.append(pulled(model).force)
        model.set_parameters({name: value})
        difference = (ends[0] - ends[1]) / (2e-4 * value)
        np.testing.assert_allclose(exact[:, i], difference, atol=1e-6 * np.abs(difference).max())


BUSHING = """
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
parameters = {g1 = 0.15, tau1 = 0.05, g2 = 0.25, tau2 = 0.004}
"""
WARM = """
[[effects]]
name = "temperature"
parameters = {C1 = 5.0, C2 = 80.0, exponent = 1.0}
"""
VIBRATION = """
[[load_cases]]
mode = "axial"
temperature = 50.0
[load_cases.dynamic]
preload = 2.0
frequency = [1.0, 5.0, 25.0]
"""


def written(folder, text, name="case.toml"):
    (folder / name).write_text(text)
    return folder / name


def test_a_frequency_counts_as_another_one(tmp_path):
    warm = vibrate(load_case(written(tmp_path, BUSHING + WARM + VIBRATION))).curves[0]
    shifted = ", ".join(f"{SLOWER * f:.12g}" for f in (1.0, 5.0, 25.0))
    other = BUSHING + VIBRATION.replace("1.0, 5.0, 25.0", shifted)
    # The mass acts at the true frequency, and the bulk modulus does not follow: both are small here.
    plain = vibrate(load_case(written(tmp_path, other))).curves[0]
    np.testing.assert_allclose(np.abs(warm.stiffness), STIFFER * np.abs(plain.stiffness), rtol=1e-3)
    np.testing.assert_allclose(warm.loss_angle, plain.loss_angle, atol=np.radians(0.02))


TABLE = """
[[recordings]]
mode = "axial"
kind = "dynamic"
name = "rig"
file = "table.csv"
"""


@pytest.fixture
def table(tmp_path):
    """A table of the bushing at 20 and 50 degrees C, and a recording at 20."""
    rows = ["frequency_Hz,temperature_C,storage_N_per_mm,loss_N_per_mm"]
    for degrees in (20.0, 50.0):
        text = BUSHING + WARM + VIBRATION.replace("preload = 2.0\n", "").replace("50.0", str(degrees))
        curve = vibrate(load_case(written(tmp_path, text))).curves[0]
        for f, K in zip(curve.frequency, curve.stiffness, strict=True):
            rows.append(f"{f},{degrees},{K.real:.9g},{K.imag:.9g}")
    (tmp_path / "table.csv").write_text("\n".join(rows) + "\n")
    time = np.linspace(0.0, 4.0, 41)
    q = 2.0 * np.sin(np.pi * time / 2.0)
    drive = "".join(f"{t:.9g},{x:.9g}\n" for t, x in zip(time, q, strict=True))
    (tmp_path / "drive.csv").write_text("time_s,displacement_mm\n" + drive)
    load = BUSHING + '[[load_cases]]\nmode = "axial"\nfile = "drive.csv"\n'
    curve = predict(load_case(written(tmp_path, load))).channels[0].curve
    rows = [f"{t},{x},{F}\n" for t, x, F in zip(curve.time, curve.displacement, curve.force, strict=True)]
    (tmp_path / "loop.csv").write_text("time_s,displacement_mm,force_N\n" + "".join(rows))
    return tmp_path


def test_rows_of_several_temperatures_are_compared_each_at_its_own(table):
    case = written(table, BUSHING + WARM + TABLE)
    result = CliRunner().invoke(main, ["direct", str(case), "--json", "-q"])
    found = json.loads(result.stdout)
    assert [len(one["frequency"]) for one in found["dynamic"]] == [3, 3]
    for one in found["dynamic"]:
        assert one["misfit"]["stiffness_percent"] < 0.01
        assert one["misfit"]["loss_angle_deg"] < 0.01
    lacking = written(table, BUSHING + WARM + TABLE.replace("table.csv", "bare.csv"))
    lines = (table / "table.csv").read_text().splitlines()
    bare = [",".join(cell for i, cell in enumerate(line.split(",")) if i != 1) for line in lines[:4]]
    (table / "bare.csv").write_text("\n".join(bare) + "\n")
    result = CliRunner().invoke(main, ["direct", str(lacking)])
    assert result.exit_code == 2
    assert "has no temperature, which the effect temperature needs" in result.output


def test_derivatives_of_a_table_by_the_constants_of_the_temperature(table):
    recording = '[[recordings]]\nmode = "axial"\nfile = "loop.csv"\ntemperature = 20.0\n'
    task = Task(load_case(written(table, BUSHING + WARM + recording + TABLE)), "neo_hookean")
    problem, *_ = task.problem()
    warm = next(one for one in problem.channels if "50" in one.name)
    names = ("temperature.C1", "temperature.C2", "temperature.exponent", "C10")
    values = {**task.material.parameters, **task.effect_values}
    exact = warm.solve(values, names).slope
    for i, name in enumerate(names):
        step = 1e-3 * values[name]
        ends = [warm.solve(values | {name: values[name] + d}, ()).force for d in (step, -step)]
        difference = (ends[0] - ends[1]) / (2.0 * step)
        np.testing.assert_allclose(exact[:, i], difference, atol=1e-4 * np.abs(difference).max())


COUPONS = """
temperature = 20.0
[geometry]
shape = "coupon"
[material]
law = "neo_hookean"
[[effects]]
name = "viscoelasticity"
parameters = {g1 = 1.0, tau1 = 1.0, g2 = 1.0, tau2 = 30.0}
[[effects]]
name = "temperature"
parameters = {C1 = 8.0, C2 = 120.0, exponent = 0.5}
"""
TRUE = {"C10": 0.3, "viscoelasticity.g1": 0.6, "viscoelasticity.g2": 0.3}


def pulled_at(degrees, rate):
    """Time, stretch and stress of the true coupon: the closed shift of `WLF` without a network, from 20 degrees C."""
    slower = 10.0 ** (-5.0 * (degrees - 20.0) / (60.0 + degrees))
    branches = {"g1": 0.6, "tau1": slower * 1.0, "g2": 0.3, "tau2": slower * 30.0}
    active = [ActiveEffect(effect("viscoelasticity"), branches)]
    C10 = 0.3 * (degrees + 273.15) / 293.15
    rubber = Rubber(law("neo_hookean"), {"C10": C10})
    model = prepare(shapes()["coupon"](), modes()["uniaxial"], rubber, features=features_of(active))
    q = np.linspace(0.0, 1.0, 41)
    return q / rate, 1.0 + q, march(model, Program(q, q / rate)).force


@pytest.fixture
def coupons(tmp_path):
    """Coupons at three temperatures and two rates, and a colder one."""
    entries = []
    for degrees in (-10.0, 0.0, 20.0, 50.0):
        for rate in (0.02, 0.5) if degrees > -10.0 else (0.5,):
            name = f"at{degrees:g}_{rate:g}"
            rows = zip(*pulled_at(degrees, rate), strict=True)
            text = "".join(f"{t:.9g},{stretch:.9g},{stress:.9g}\n" for t, stretch, stress in rows)
            (tmp_path / f"{name}.csv").write_text("time_s,stretch,nominal_stress_MPa\n" + text)
            warm = "" if degrees == 20.0 else f"temperature = {degrees}\n"
            entries.append(f'[[coupons]]\nmode = "uniaxial"\nfile = "{name}.csv"\nname = "{name}"\n{warm}')
    written(tmp_path, COUPONS + "".join(entries))
    return tmp_path


def test_fit_finds_law_branches_and_shift_of_coupons_at_several_temperatures(coupons):
    arguments = ["fit", str(coupons / "case.toml"), "--hold-out", "at-10_0.5", "--fix", "viscoelasticity.tau"]
    result = CliRunner().invoke(main, [*arguments, "--json", "-q"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    values = {name: one["value"] for name, one in found["parameters"].items()}
    expected = TRUE | {"temperature.C1": 5.0, "temperature.C2": 80.0, "temperature.exponent": 1.0}
    assert values == pytest.approx(expected, rel=5e-3)
    assert found["misfit"]["at-10_0.5"]["rms_percent"] < 1.0
    (said,) = [one for one in found["problems"] if one["name"] == "outside_measured"]
    assert said["message"].startswith("at-10_0.5 is predicted outside of what was measured: -10 degrees C")


def test_one_temperature_tells_nothing(coupons):
    others = ",".join(file.stem for file in coupons.glob("at*.csv") if not file.stem.startswith("at50"))
    result = CliRunner().invoke(main, ["fit", str(coupons / "case.toml"), "--hold-out", others])
    assert result.exit_code == 2
    assert "cannot be identified: all that is fitted was measured at 50 degrees C" in result.output
    # Followed, the remedy leads to a fit.
    arguments = ["fit", str(coupons / "case.toml"), "--hold-out", others, "--fix", "temperature"]
    assert CliRunner().invoke(main, arguments).exit_code == 0


def test_effects_of_the_bushing_are_not_the_coupons(coupons):
    text = (coupons / "case.toml").read_text().replace('shape = "coupon"', BUSHING.split("[mesh]")[0][12:])
    case = written(
        coupons, text + '[[load_cases]]\nmode = "axial"\namplitude = 2.0\nrate = 1.0\n', "other.toml"
    )
    found = json.loads(CliRunner().invoke(main, ["fit", str(case), "--json", "-q"]).stdout)
    assert list(found["parameters"]) == ["C10"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("temperature = 20.0", ""), "needs a temperature, which at20_0.02, at20_0.5 have not"),
        (("temperature = 20.0", "temperature = 293.0"), "temperature = 293"),
        (("temperature = 20.0", 'temperature = "warm"'), "temperature = "),
        (("C1 = 8.0", "E = 50.0"), "effects[1].parameters.E has no meaning with this shift"),
        (("C1 = 8.0", 'shift = "wfl"'), 'did you mean "wlf"'),
    ],
)
def test_what_is_refused(coupons, change, said):
    case = written(coupons, (coupons / "case.toml").read_text().replace(*change))
    result = CliRunner().invoke(main, ["check", str(case)])
    assert result.exit_code == 2
    assert said in result.output


def test_the_page_on_temperature(tmp_path):
    """Its case gives the numbers beside its commands."""
    page = (Path(__file__).parents[2] / "docs" / "temperature.md").read_text(encoding="utf-8")
    case = written(tmp_path, page.partition("```toml\n")[2].partition("```")[0])
    shown = page.partition("```\nbushcli direct")[2].partition("```")[0]
    static, vibrating = (
        json.loads(CliRunner().invoke(main, [command, str(case), "--json", "-q"]).stdout)["load_cases"]
        for command in ("direct", "dynamic")
    )
    secant = [one["stiffness"]["secant"] for one in static]
    assert "{:.0f} N/mm at 23, {:.0f} N/mm at -20 degrees C".format(*secant) in shown
    said = "; ".join(
        f"{one['stiffness'][1]:.0f} N/mm and {one['loss_angle_deg'][1]:.2f} degrees" for one in vibrating
    )
    assert f"|K*| at 10 Hz: {said}" in shown
    assert [one["temperature"] for one in vibrating] == [23.0, -20.0]


def test_prediction_outside_of_what_was_measured(tmp_path):
    """A load case and a vibration in the cold, beside a coupon in the warmth."""
    (tmp_path / "coupon.csv").write_text("stretch,nominal_stress_MPa\n1.0,0.0\n1.2,0.5\n1.5,1.1\n2.0,1.75\n")
    tests = '[[coupons]]\nmode = "uniaxial"\nfile = "coupon.csv"\ntemperature = 23.0\n'
    load = '[[load_cases]]\nmode = "axial"\namplitude = 2.0\nrate = 1.0\ntemperature = {}\n'
    for degrees, cold in ((22.0, False), (-30.0, True)):
        vibration = VIBRATION.replace("50.0", str(degrees))
        case = written(tmp_path, BUSHING + WARM + tests + load.format(degrees) + vibration)
        for command in ("direct", "dynamic"):
            found = json.loads(CliRunner().invoke(main, [command, str(case), "--json", "-q"]).stdout)
            said = [one["message"] for one in found["problems"] if one["name"] == "outside_measured"]
            assert len(said) == cold
            assert all("-30 degrees C (measured: 23)" in one for one in said)


def test_master_curve_of_a_table_at_three_temperatures(tmp_path):
    """A Maxwell element of 2 s and 1 MPa beside 1 MPa, shifted by WLF: the shift, its formula and the file."""
    rows = ["frequency_Hz,temperature_C,storage_MPa,loss_MPa"]
    for degrees in (0.0, 10.0, 20.0, 35.0, 50.0):
        slower = 10.0 ** (-6.0 * (degrees - 20.0) / (100.0 + degrees - 20.0))
        for f in np.geomspace(0.05, 5.0, 9):
            x = 2j * np.pi * f * 0.3 * slower
            G = 1.0 + x / (1.0 + x)
            rows.append(f"{f:.9g},{degrees},{G.real:.9g},{G.imag:.9g}")
    (tmp_path / "sweeps.csv").write_text("\n".join(rows) + "\n")
    table = '[[coupons]]\nkind = "dynamic"\nmode = "simple_shear"\nfile = "sweeps.csv"\n'
    case = written(tmp_path, '[geometry]\nshape = "coupon"\n[material]\nlaw = "neo_hookean"\n' + table)
    out = tmp_path / "out"
    assert CliRunner().invoke(main, ["fit", str(case), "-o", str(out)]).exit_code == 0
    (found,) = json.loads((out / "result.json").read_text())["dynamic"]
    wlf = found["shift_laws"]["wlf"]
    assert wlf["rms_decades"] < 0.02 < found["shift_laws"]["arrhenius"]["rms_decades"]
    assert (wlf["C1"], wlf["C2"]) == pytest.approx((6.0, 100.0), rel=0.1)
    columns = np.genfromtxt(out / "simple_shear-master.csv", delimiter=",", names=True)
    x = 2j * np.pi * columns["reduced_frequency_Hz"] * 0.3
    np.testing.assert_allclose(columns["storage_MPa"], (1.0 + x / (1.0 + x)).real, rtol=0.03)
    assert "Master curve" in (out / "report.html").read_text(encoding="utf-8")


def test_a_temperature_that_changes_along_a_recording(tmp_path):
    """Pulled while it warms from 20 to 50 degrees C: the force at constant temperature on the clock dt / a_T."""
    time = np.linspace(0.0, 20.0, 2001)
    degrees = 20.0 + 1.5 * time
    slower = 10.0 ** (-5.0 * (degrees - 20.0) / (60.0 + degrees))
    reduced = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (1.0 / slower[1:] + 1.0 / slower[:-1]))])
    q = 0.05 * time
    nodes = slice(0, None, 20)
    plain = march(coupon(BRANCH), Program(q[nodes][1:], reduced[nodes][1:]))
    # The first target of a program is reached in no time: both begin at rest.
    force = np.concatenate([[0.0], plain.force])
    rows = zip(time[nodes], 1.0 + q[nodes], force, degrees[nodes] + 273.15, strict=True)
    text = "".join(f"{t:.9g},{x:.9g},{s:.9g},{T:.9g}\n" for t, x, s, T in rows)
    (tmp_path / "warming.csv").write_text("time_s,stretch,nominal_stress_MPa,chamber_K\n" + text)
    law_of = ", ".join(f"{name} = {value}" for name, value in YEOH.items())
    case = written(
        tmp_path,
        f"""
[geometry]
shape = "coupon"
[material]
law = "yeoh"
parameters = {{ {law_of} }}
[[effects]]
name = "viscoelasticity"
parameters = {{ g1 = 0.5, tau1 = 3.0 }}
[[effects]]
name = "temperature"
parameters = {{ C1 = 5.0, C2 = 80.0, exponent = 0.0 }}
[[recordings]]
mode = "uniaxial"
file = "warming.csv"
columns = {{ temperature = "chamber_K" }}
""",
    )
    result = CliRunner().invoke(main, ["direct", str(case), "--json", "-q"])
    found = json.loads(result.stdout)
    assert found["load_cases"][0]["recording"]["rms_percent"] < 0.1
    # Its mean for all of it misses by much more.
    constant = written(
        tmp_path, case.read_text().replace('columns = { temperature = "chamber_K" }', "temperature = 35.0")
    )
    found = json.loads(CliRunner().invoke(main, ["direct", str(constant), "--json", "-q"]).stdout)
    assert found["load_cases"][0]["recording"]["rms_percent"] > 1.0


def test_a_column_of_temperatures_in_another_unit_is_refused(tmp_path):
    rows = "".join(f"{0.1 * i},{1.0 + 0.01 * i},{0.01 * i},{293.0 + i}\n" for i in range(20))
    (tmp_path / "warming.csv").write_text("time_s,stretch,nominal_stress_MPa,chamber\n" + rows)
    recording = '[[recordings]]\nmode = "uniaxial"\nfile = "warming.csv"\ncolumns = {{ temperature = 4 }}\n{}'
    head = '[geometry]\nshape = "coupon"\n[material]\nlaw = "neo_hookean"\nparameters = {C10 = 0.5}\n'
    for units, code in (
        ("", 2),
        ('units = { temperature = "K" }\n', 0),
        ('units = { temperature = "Nm" }\n', 2),
    ):
        result = CliRunner().invoke(main, ["direct", str(written(tmp_path, head + recording.format(units)))])
        assert result.exit_code == code
        said = "Nm is no unit of a temperature" if "Nm" in units else "293 degrees C: no test of rubber"
        assert (said in result.output) == (code == 2)


@pytest.mark.parametrize(("fixed", "left"), [((), ["viscoelasticity"] * 2), (("viscoelasticity.tau",), [])])
def test_a_search_does_not_add_branches_one_by_one_where_their_times_are_held(coupons, fixed, left):
    """Nor the temperature, which promises nothing before there are branches."""
    task = Task(load_case(coupons / "case.toml"), "neo_hookean", "coupons", fixed=fixed)
    assert [one.after for one in removable_parts(task, [])] == left
