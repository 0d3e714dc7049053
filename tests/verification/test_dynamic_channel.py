"""Tables of dynamic stiffness as channels of an identification: derivatives, and concealed branches found again."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from click.testing import CliRunner

from bushcli.case import load_case
from bushcli.cli import main
from bushcli.inverse import Task, identify
from bushcli.simulate.dynamic import vibrate
from bushcli.simulate.predict import predict

RUBBER = """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[mesh]
elements_across = 2
elements_along = 6
[material]
law = "neo_hookean"
bulk_modulus = 2000.0
[material.parameters]
C10 = {C10}
[[effects]]
name = "viscoelasticity"
parameters = {{g1 = {g1}, tau1 = {tau1}, g2 = {g2}, tau2 = {tau2}}}
"""
TRUE = {"C10": 0.5, "g1": 0.15, "tau1": 0.05, "g2": 0.25, "tau2": 0.004}
START = {"C10": 0.4, "g1": 0.25, "tau1": 0.1, "g2": 0.1, "tau2": 0.008}
LOADS = """
[[load_cases]]
mode = "axial"
file = "drive.csv"
[[load_cases]]
mode = "axial"
[load_cases.dynamic]
preload = [0.0, 3.0]
frequency = { from = 0.5, to = 200, points = 12 }
"""
STATIC = """
[[recordings]]
mode = "axial"
file = "loop.csv"
"""
TABLE = """
[[recordings]]
mode = "axial"
kind = "dynamic"
name = "rig"
file = "table.csv"
"""
MULLINS = """
[[effects]]
name = "mullins"
"""
EFFECT = """
[[effects]]
name = "{}"
channels = ["rig"]
"""
# What a rig makes of K* (N/mm) at omega (rad/s), by effect: parameter, its value, and the formula.
RIG = {
    "time_lag": ("lag", -1e-4, lambda K, omega, lag: K * np.exp(-1j * omega * lag)),
    "fixture_mass": ("mass", 0.08, lambda K, omega, mass: K - 1e-3 * mass * omega**2),
    "rig_resonance": ("period", 1 / 500.0, lambda K, omega, T: K / (1 - (omega * T / (2 * np.pi)) ** 2)),
    "rig_compliance": ("compliance", 1 / 3000.0, lambda K, omega, u: 1 / (1 / K + u)),
    "gain": ("error", 0.1, lambda K, omega, error: (1 + error) * K),
}
# Standard errors of a table: of the stiffness, and of the loss angle in degrees.
NOISE = 0.01, 0.3


class Specimen:
    """A simulated bushing, and noisy recordings of it."""

    def __init__(self, folder):
        self.folder = folder
        time = np.linspace(0.0, 4.0, 41)
        travel = 5.0 * np.sin(0.5 * np.pi * time)
        (folder / "drive.csv").write_text(columns(time_s=time, displacement_mm=travel))
        (folder / "true.toml").write_text(RUBBER.format(**TRUE) + LOADS)
        case = load_case(folder / "true.toml")
        (loop,) = predict(case).channels
        self.loop, self.curves = loop.curve, vibrate(case).curves

    def measured(self, seed=None, by_force=False, errors=False, rig=()):
        """Write recordings with the noise of a seed, none without, on a rig, and return the case that has them."""
        rng = np.random.default_rng(seed)
        size, angle = NOISE if seed is not None else (0.0, 0.0)
        rows = len(self.curves[0].frequency)
        stiffness = np.concatenate([c.stiffness for c in self.curves])
        omega = 2 * np.pi * np.concatenate([c.frequency for c in self.curves])
        for name in rig:
            _, value, change = RIG[name]
            stiffness = change(stiffness, omega, value)
        turned = np.radians(angle) * rng.standard_normal(len(stiffness))
        stiffness = stiffness * (1.0 + size * rng.standard_normal(len(stiffness))) * np.exp(1j * turned)
        preload = np.repeat([c.force if by_force else c.preload for c in self.curves], rows)
        table = {
            "frequency_Hz": np.concatenate([c.frequency for c in self.curves]),
            "preload_N" if by_force else "preload_mm": preload,
            "storage_N_per_mm": stiffness.real,
            "loss_N_per_mm": stiffness.imag,
        }
        if errors:
            table |= {f"{k}_error_N_per_mm": 0.02 * np.abs(stiffness) for k in ("storage", "loss")}
        (self.folder / "table.csv").write_text(columns(**table))
        force = self.loop.force
        noise = 0.002 * np.ptp(force) * rng.standard_normal(len(force)) * (seed is not None)
        (self.folder / "loop.csv").write_text(
            columns(time_s=self.loop.time, displacement_mm=self.loop.displacement, force_N=force + noise)
        )
        path = self.folder / "case.toml"
        path.write_text(RUBBER.format(**START) + STATIC + TABLE + "".join(map(EFFECT.format, rig)))
        return load_case(path)


def columns(**named):
    """Return the text of a table."""
    rows = zip(*named.values(), strict=True)
    return ",".join(named) + "\n" + "".join(",".join(f"{float(v):.9g}" for v in row) + "\n" for row in rows)


def estimates(fit):
    """Return the estimates by the names of `TRUE`, whose first branch is the slow one; a fit may end the other way."""
    known = {name.removeprefix("viscoelasticity."): one for name, one in fit.parameters.items()}
    if known["tau1"].value < known["tau2"].value:
        swapped = {"g1": "g2", "g2": "g1", "tau1": "tau2", "tau2": "tau1"}
        known = {swapped.get(name, name): one for name, one in known.items()}
    return known


@pytest.fixture(scope="module")
def specimen(tmp_path_factory):
    return Specimen(tmp_path_factory.mktemp("dynamic_channel"))


@pytest.mark.parametrize("by_force", [False, True])
def test_derivatives_are_those_of_finite_differences(specimen, by_force):
    case = specimen.measured(by_force=by_force, rig=RIG)
    task = Task(case, "gent", bulk_modulus=True, density=True)
    assert len(task.names) == 2 + 4 + len(RIG) + 2
    problem, *_ = task.problem()
    (channel,) = [one for one in problem.channels if one.name == "rig"]
    x = task.vectors()[0]
    slope = channel.solve(problem.parameters(x), task.names).slope
    for i, name in enumerate(task.names):
        ends = []
        for share in (0.01, -0.01, 0.005, -0.005):
            moved = x.copy()
            moved[i] *= 1.0 + share
            ends.append(channel.solve(problem.parameters(moved), task.names).force)
        coarse, fine = (ends[0] - ends[1]) / (0.02 * x[i]), (ends[2] - ends[3]) / (0.01 * x[i])
        expected = (4.0 * fine - coarse) / 3.0
        # By the compressibility 3e-5, which the reduction leaves; by the others 1e-7.
        np.testing.assert_allclose(slope[:, i], expected, atol=5e-5 * np.abs(expected).max(), err_msg=name)


def test_branches_take_no_further_march(specimen, monkeypatch):
    task = Task(specimen.measured(), "neo_hookean")
    problem, *_ = task.problem()
    channel = problem.channels[1]
    known = problem.parameters(task.vectors()[0])
    before = channel.solve(known, ()).force
    monkeypatch.setattr("bushcli.inverse.dynamic_simulation.march", None)
    after = channel.solve(known | {"viscoelasticity.g1": 0.5, "viscoelasticity.tau1": 0.02}, ()).force
    assert not np.allclose(after, before, rtol=1e-2)
    with pytest.raises(TypeError):
        channel.solve(known | {"C10": 0.41}, ())


@pytest.mark.parametrize("seed", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_concealed_branches_are_within_their_intervals(specimen, seed):
    fit = identify(Task(specimen.measured(seed, by_force=seed == 2), "neo_hookean"))
    assert fit.converged
    for name, value in TRUE.items():
        found = estimates(fit)[name]
        low, high = found.range95
        assert low < value < high, name
        assert found.std < 0.06 * value, name
    (compared,) = fit.tables
    assert compared.stiffness_percent < 1.3
    assert compared.loss_angle_deg < 0.4


@pytest.mark.parametrize(
    ("name", "static"),
    [
        ("time_lag", ""),
        ("rig_resonance", ""),
        # A table alone cannot tell a compliant rig from softer rubber.
        pytest.param("rig_compliance", STATIC, marks=pytest.mark.slow),
    ],
)
def test_a_concealed_effect_of_the_rig_is_found_with_it(specimen, name, static):
    path = specimen.measured(4, rig=[name]).path
    path.write_text(path.read_text().replace(STATIC, static))
    fit = identify(Task(load_case(path), "neo_hookean"))
    parameter, value, _ = RIG[name]
    found = fit.parameters[f"{name}.{parameter}"]
    assert fit.converged
    assert abs(found.value - value) < 3 * found.std < 0.3 * abs(value)
    (compared,) = fit.tables
    assert compared.stiffness_percent < 1.3
    assert compared.loss_angle_deg < 0.4


def test_tables_alone_determine_law_branches_and_density(specimen):
    """Of branches without start values, beginning at the frequencies of the table."""
    path = specimen.measured(5).path
    text = path.read_text().replace(STATIC, "")
    path.write_text(re.sub("parameters = {g1.*", "parameters = {g2 = 0.1}", text))
    fit = identify(Task(load_case(path), "neo_hookean", density=True))
    assert fit.converged
    for name, value in TRUE.items():
        found = estimates(fit)[name]
        assert abs(found.value - value) < 3 * found.std < 0.3 * value, name
    assert abs(fit.parameters["density"].value - 1100.0) < 3 * fit.parameters["density"].std
    assert fit.parameters["viscoelasticity.tau1"].lower < 1e-4


def test_the_command_gives_the_tables_beside_their_simulation(specimen):
    path = specimen.measured().path
    text, found = path.read_text(), []
    for number, (branches, options) in enumerate([(TRUE, ()), (START, ("--hold-out", "rig"))]):
        path.write_text(
            text.replace(RUBBER.format(**START), RUBBER.format(**(branches | {"C10": START["C10"]})))
        )
        where = ("-o", str(path.parent / f"out{number}"), "--fix", "viscoelasticity")
        done = CliRunner().invoke(main, ["inverse", str(path), "--json", "-q", *where, *options])
        assert done.exit_code == 0, done.output
        found.append(json.loads(done.stdout)["dynamic"])
    (table,), (predicted,) = found
    assert table["name"] == table["recorded"]["name"] == "rig"
    assert table["misfit"]["stiffness_percent"] < 0.1
    assert table["misfit"]["loss_angle_deg"] < 0.05
    np.testing.assert_allclose(table["preload"]["displacement"], np.repeat([0.0, 3.0], 12))
    assert "24 of 24 rows have no standard errors" in " ".join(table["recorded"]["remarks"])
    # With the branches of the start the table is missed.
    assert predicted["misfit"]["loss_angle_deg"] > 1.0


def test_stated_errors_and_rows_that_do_not_count(specimen):
    (channel,) = Task(specimen.measured(errors=True), "neo_hookean").problem()[0].channels[1:]
    np.testing.assert_allclose(channel.scale, 0.02 * np.tile(channel.table.stiffness, 2), rtol=1e-6)
    assert not any("standard errors" in remark for remark in channel.table.remarks)
    table = specimen.folder / "table.csv"
    head, *rows = table.read_text().splitlines()
    large = [f"{row},{0.1 if i < 12 else 0.5}" for i, row in enumerate(rows)]
    table.write_text("\n".join([f"{head},amplitude_peak_mm", *large]) + "\n")
    (channel,) = Task(load_case(specimen.folder / "case.toml"), "neo_hookean").problem()[0].channels[1:]
    np.testing.assert_array_equal(channel.used_rows, np.arange(24) < 12)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (lambda text: text.partition("[[effects]]")[0] + STATIC + TABLE, 'name = "viscoelasticity"'),
        (lambda text: text + MULLINS, "changes the force along a path"),
        (lambda text: text.replace("tau1 =", "exponent = 3.0, tau1 ="), "has no dynamic stiffness"),
        (lambda text: text + EFFECT.format("free_play"), "the stiffness depends on the amplitude"),
        (
            lambda text: text + EFFECT.format("bump_stop"),
            "carries an unknown share of a preload in N",
        ),
    ],
)
def test_what_cannot_be_fitted_is_refused_with_the_remedy(specimen, changed, said):
    path = specimen.measured(by_force=True).path
    path.write_text(changed(path.read_text()))
    done = CliRunner().invoke(main, ["inverse", str(path)])
    assert done.exit_code == 2
    assert said in " ".join(done.output.split())


def test_an_offset_of_the_rig_leaves_a_table_as_it_is(specimen):
    path = specimen.measured().path
    path.write_text(path.read_text() + EFFECT.format("offset"))
    problem, *_ = Task(load_case(path), "neo_hookean").problem()
    assert [one.name for one in problem.channels] == ["axial", "rig"]


def test_a_preload_that_no_bushing_of_this_shape_has_is_refused(specimen):
    case = specimen.measured()
    table = specimen.folder / "table.csv"
    table.write_text(table.read_text().replace(",3,", ",3000,"))
    done = CliRunner().invoke(main, ["inverse", str(case.path)])
    assert done.exit_code == 2
    assert "units = {preload = ...}" in " ".join(done.output.split())
