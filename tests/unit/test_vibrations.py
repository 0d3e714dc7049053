"""Dynamic tests of a case: what the file may say, what becomes of it, and what `vibrate` answers."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose

from bushcli.case import Case, case_json, load_case
from bushcli.case.rebuild import rebuilt_case
from bushcli.cli import main
from bushcli.effects.effect import effect
from bushcli.errors import InputError
from bushcli.report.json.dynamic import dynamic_json
from bushcli.report.plots.dynamic import dynamic_panels
from bushcli.report.results import DynamicResult
from bushcli.report.views.dynamic import dynamic_document
from bushcli.report.writers.files import dynamic_files
from bushcli.simulate.dynamic import DynamicInterrupted, DynamicResponse, vibrate
from cases.dynamic.model import DynamicModel, modulus

CASE = """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 20.0
[mesh]
elements_across = 2
elements_along = 3
elements_around = 6
[material]
law = "yeoh"
bulk_modulus = 200.0
density = 1200
[material.parameters]
C10 = 0.5
C20 = -0.02
C30 = 0.003
[[effects]]
name = "viscoelasticity"
parameters = {g1 = 0.3, tau1 = 0.01, g2 = 0.1, tau2 = 0.002}
"""
AXIAL = """
[[load_cases]]
mode = "axial"
steps = 4
[load_cases.dynamic]
frequency = [1, 20, 200]
"""


def case(tmp_path: Path, loads: str = AXIAL, *overrides: str, text: str = CASE) -> Case:
    file = tmp_path / "case.toml"
    file.write_text(text + loads)
    return load_case(file, overrides)


def one(mode: str, dynamic: str, tmp_path: Path, *overrides: str, **other: Any) -> Case:
    load = f'[[load_cases]]\nmode = "{mode}"\nsteps = 4\n[load_cases.dynamic]\n{dynamic}\n'
    return case(tmp_path, load, *overrides, **other)


# -- the case file --------------------------------------------------------------------------------------------------


def test_angles_and_density_are_converted_and_shown_as_written(tmp_path: Path) -> None:
    found = one(
        "torsional", 'preload = [5, -5]\namplitude = 0.5\nfrequency = 10\npoint = "driving"', tmp_path
    )
    (test,) = found.vibrations
    assert_allclose(test.preload, np.radians([5, -5]))
    assert_allclose(test.amplitude, [math.radians(0.5)])
    assert not test.transfer
    assert found.load_cases == ()
    assert found.material.density == pytest.approx(1.2e-9)  # t/mm^3
    shown = case_json(found)
    assert shown["material"]["density"] == 1200
    assert shown["load_cases"] == [
        {
            "mode": "torsional",
            "steps": 4,
            "dynamic": {"amplitude": [0.5], "frequency": [10], "point": "driving", "preload": [5, -5]},
        }
    ]
    again = rebuilt_case(json.loads(json.dumps(shown)), tmp_path)
    assert again.vibrations == found.vibrations


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("from = 10, to = 40, points = 4", (10, 20, 30, 40)),
        ("from = 1, to = 100, points = 3", (1, 10, 100)),
        ('from = 1, to = 101, points = 3, spacing = "linear"', (1, 51, 101)),
        ('from = 1, to = 4, points = 3, spacing = "logarithmic"', (1, 2, 4)),
    ],
)
def test_frequencies_in_a_range(tmp_path: Path, given: str, expected: tuple[float, ...]) -> None:
    """Over more than a decade they are spaced evenly in the logarithm, unless said otherwise."""
    assert one("axial", f"frequency = {{{given}}}", tmp_path).vibrations[0].frequency == expected


def test_the_motion_of_a_pose_that_goes_furthest_vibrates(tmp_path: Path) -> None:
    path = """
[[load_cases]]
mode = "path"
[load_cases.path]
time = [0, 1]
ux = [0, 1]
rz = [0, 4]
[load_cases.dynamic]
frequency = [1]
amplitude = 2
"""
    (test,) = case(tmp_path, path).vibrations
    assert test.motion == 5
    assert_allclose(test.amplitude, [math.radians(2)])
    (test,) = case(tmp_path, path + 'motion = "uy"\n').vibrations
    assert (test.motion, test.amplitude) == (1, (2,))


@pytest.mark.parametrize(
    ("override", "says"),
    [
        ("frequency=[0]", "0 Hz"),
        ("frequency=[-3, 1]", "above 0"),
        ("frequency=[]", "list of at least one number"),
        ("frequency=[2, 2]", "a frequency twice"),
        ("frequency={from = 1}", "frequency.to is missing"),
        ("frequency={from = 0, to = 3, points = 3}", "greater than 0"),
        ("amplitude=0", "peaks above 0"),
        ("preload=[1, 1]", "a value twice"),
        ("preload=300", "times the rubber's thickness"),
        ("point=middle", "transfer"),
        ("preload_force=5", "has preload and preload_force"),
        ("motion=ux", "only mode path"),
    ],
)
def test_wrong_keys_are_named_with_a_remedy(tmp_path: Path, override: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        one("axial", "frequency = 1\npreload = 1", tmp_path, f"load_cases.0.dynamic.{override}")


def test_a_vibration_has_no_program_of_its_own(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"load_cases\[0\].amplitude has no meaning in a dynamic test"):
        case(tmp_path, AXIAL, "load_cases.0.amplitude=2")


def test_a_density_in_other_units_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="g/cm3 is multiplied by 1000"):
        case(tmp_path, AXIAL, "material.density=1.2")


# -- the answer -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def response(tmp_path_factory: pytest.TempPathFactory) -> DynamicResponse:
    folder = tmp_path_factory.mktemp("case")
    return vibrate(one("axial", "frequency = [1, 20, 200]\npreload = [-1, 0, 2]", folder))


def test_every_preload_has_its_curve_in_the_order_of_the_case(response: DynamicResponse) -> None:
    assert [curve.preload for curve in response.curves] == [-1, 0, 2]
    assert response.complete
    assert response.conditions == ()
    # The curve of a symmetric bushing is odd, its stiffness even.
    down, rest, up = response.curves
    assert down.force < rest.force < up.force
    assert rest.force == pytest.approx(0, abs=1e-6)
    assert rest.static < down.static < up.static  # yeoh stiffens


def test_derivatives_are_those_of_differences(response: DynamicResponse) -> None:
    curve = response.curves[2]
    f, density, branches = curve.frequency, 1.2e-9, list(curve.branches)
    for model in (curve.model, replace(curve.model, transfer=False)):
        by_g, by_tau, by_density = model.slopes(f, branches)
        for i, (g, tau) in enumerate(branches):
            for slope, step, moved in (
                (
                    by_g[i],
                    1e-5,
                    lambda h, i=i, g=g, tau=tau: [*branches[:i], (g + h, tau), *branches[i + 1 :]],
                ),
                (
                    by_tau[i],
                    1e-7,
                    lambda h, i=i, g=g, tau=tau: [*branches[:i], (g, tau + h), *branches[i + 1 :]],
                ),
            ):
                difference = model.stiffness(f, moved(step)) - model.stiffness(f, moved(-step))
                assert_allclose(slope, difference / (2 * step), rtol=1e-5)
        step = 1e-13
        difference = model.stiffness(f, branches, density + step) - model.stiffness(
            f, branches, density - step
        )
        assert_allclose(by_density, difference / (2 * step), rtol=1e-5)


def test_one_model_serves_other_branches_and_densities(tmp_path: Path, response: DynamicResponse) -> None:
    curve = response.curves[2]
    others = [(0.5, 0.05), (0.2, 0.001)]
    elsewhere = vibrate(
        one(
            "axial",
            "frequency = [1, 20, 200]\npreload = 2",
            tmp_path,
            "material.density=900",
            "effects.0.parameters={g1 = 0.5, tau1 = 0.05, g2 = 0.2, tau2 = 0.001}",
        )
    ).curves[0]
    model: DynamicModel = curve.model
    found = model.stiffness(curve.frequency, others, 9e-10)
    error = model.error(curve.frequency, others, 9e-10)
    assert error < 1e-4
    assert np.abs(found / elsewhere.stiffness - 1).max() < error + elsewhere.reduction_error


def test_result_as_json_document_plots_and_file(response: DynamicResponse, tmp_path: Path) -> None:
    document = dynamic_json(DynamicResult(response))
    entry = document["load_cases"][2]
    assert entry["mode"] == "axial"
    assert entry["preload"]["displacement"] == 2
    assert entry["point"] == "transfer"
    assert entry["amplitude"] is None
    size, angle = np.array(entry["stiffness"]), np.radians(entry["loss_angle_deg"])
    assert_allclose(size * np.cos(angle), entry["storage"])
    assert_allclose(size * np.sin(angle), entry["loss"])
    assert entry["reduction_error"] < 1e-4
    assert json.loads(json.dumps(document)) == document
    sections = {one.heading: one for one in dynamic_document(DynamicResult(response)).sections}
    (summary,) = sections["Preloads"].blocks
    assert [row[1] for row in summary.rows] == [
        "-1.000 mm, -190.8 N",
        "0 mm, 0 N",
        "2.000 mm, 381.2 N",
    ] or all("mm" in row[1] for row in summary.rows)
    (panels,) = dynamic_panels(response.curves, {"axial": "axial"})
    (stiffness,), (angles,) = panels.rows
    assert len([one for one in stiffness.series if one.label]) == 3
    dots = [one for one in angles.series if one.mark == "dots"]
    assert_allclose(dots[0].y, document["load_cases"][0]["loss_angle_deg"])
    files = dynamic_files(DynamicResult(response))
    table = np.genfromtxt(files.contents["axial-dynamic.csv"].splitlines(), delimiter=",", names=True)  # type: ignore[union-attr]
    assert table.dtype.names == (
        *("frequency_Hz", "preload_mm", "preload_N"),
        *("stiffness_N_per_mm", "storage_N_per_mm", "loss_N_per_mm", "loss_angle_deg"),
    )
    assert len(table) == 9


COUPON = """
[geometry]
shape = "coupon"
[material]
law = "neo_hookean"
[material.parameters]
C10 = 0.5
[[effects]]
name = "viscoelasticity"
parameters = {g1 = 0.3, tau1 = 0.01}
"""


def test_modulus_of_a_coupon(tmp_path: Path) -> None:
    """At rest E* = 3 mu (1 + s), whatever the density."""
    found = vibrate(one("uniaxial", "frequency = [10]\npreload = [0, 0.5]", tmp_path, text=COUPON))
    turned = 2j * math.pi * 10 * 0.01
    assert_allclose(found.curves[0].stiffness, 3 * (1 + 0.3 * turned / (1 + turned)), rtol=1e-6)
    (first, *_) = dynamic_document(DynamicResult(found)).sections[2].blocks
    assert first.title.startswith("uniaxial: modulus, preload 1.000, 0 MPa")
    text = dynamic_files(DynamicResult(found)).contents["uniaxial-dynamic.csv"]
    table = np.genfromtxt(text.splitlines(), delimiter=",", names=True)  # type: ignore[union-attr]
    assert_allclose(table["preload_stretch"], [1, 1.5])
    assert "stiffness_MPa" in table.dtype.names


def test_preload_by_force_is_the_travel_that_carries_it(tmp_path: Path, response: DynamicResponse) -> None:
    rest, up = response.curves[1:]
    dynamic = f"frequency = [1, 20, 200]\npreload_force = [{up.force}, 0]"
    loaded, free = vibrate(one("axial", dynamic, tmp_path)).curves
    assert loaded.preload == pytest.approx(2.0, rel=1e-6)
    assert free.preload == pytest.approx(0.0, abs=1e-6)
    assert_allclose(loaded.stiffness, up.stiffness, rtol=1e-5)
    assert_allclose(free.stiffness, rest.stiffness, rtol=1e-5)
    assert case_json(one("axial", dynamic, tmp_path))["load_cases"][0]["dynamic"]["preload_force"] == [
        up.force,
        0,
    ]


def test_no_branch_no_loss_angle(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"axial: no viscoelastic branch.*g1 = 0 says that"):
        vibrate(case(tmp_path, AXIAL, "effects=[]"))
    silent = vibrate(case(tmp_path, AXIAL, "effects.0.parameters={g1 = 0, tau1 = 1}"))
    assert np.all(silent.curves[0].stiffness.imag == 0)


def test_without_a_vibration_there_is_nothing_to_do(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"add a table \[load_cases.dynamic\]"):
        vibrate(case(tmp_path, '[[load_cases]]\nmode = "axial"\namplitude = 1\nrate = 1\n'))


def test_effects_without_dynamic_stiffness_are_said_or_refused(tmp_path: Path) -> None:
    more = '[[effects]]\nname = "{}"\nparameters = {{{}}}\n'
    friction = more.format("friction", "g = 0.2, slip = 0.05") + more.format(
        "offset", "displacement = 0.1, force = 0"
    )
    found = vibrate(case(tmp_path, friction + AXIAL))
    assert [one.name for one in found.conditions] == ["effect_left_out", "effect_left_out"]
    plain = vibrate(case(tmp_path))
    assert_allclose(found.curves[0].stiffness, plain.curves[0].stiffness)
    for refused in (
        more.format("mullins", "r = 2, m = 0.5, beta = 0.1"),
        more.format("batch_stiffness", "log_factor = 0.1"),
    ):
        with pytest.raises(InputError, match=r"changes the force along a path.*channels"):
            vibrate(case(tmp_path, refused + AXIAL))


def test_contact_that_stays_is_said(tmp_path: Path) -> None:
    found = vibrate(
        one("axial", "frequency = [10]\npreload = [0.2, 1.5]", tmp_path, "geometry.snubber.gap=0.5")
    )
    # A rigid plate is no surface of the mesh, but its force is that of the held sleeve.
    free, pressed = found.curves
    assert pressed.static > 1.5 * free.static
    driving = replace(pressed.model, transfer=False)
    quiet = np.array([1e-3])
    assert_allclose(pressed.model.stiffness(quiet, ()), driving.stiffness(quiet, ()))
    assert (free.touching, pressed.touching) == ((), (("free end", "snubber"),))
    (said,) = found.conditions
    assert said.name == "contact_frozen"
    assert "axial at 1.5 mm: free end and snubber touch" in said.message


def test_voids_that_close_are_said(tmp_path: Path) -> None:
    void = {"void_inner_radius": 14.0, "void_outer_radius": 18.0, "void_angle": 80.0}
    keys = ["geometry.shape=voided", "mesh.elements_around=12"]
    keys += [f"geometry.{name}={value}" for name, value in void.items()]
    found = vibrate(one("radial", "frequency = [10]\npreload = [0, 6]", tmp_path, *keys))
    assert [curve.touching for curve in found.curves] == [(), (("void", "void"),)]
    assert [one.name for one in found.conditions] == ["contact_frozen"]


def test_a_drawn_section_has_the_stiffness_of_the_same_plain_bushing(tmp_path: Path) -> None:
    """Axial and radial about a preload; the section is meshed freely, and both meshes converge to one stiffness."""
    drawn = """shape = "section"
[[geometry.outline]]
from = [12.0, -10.0]
to = [22.0, -10.0]
[[geometry.outline]]
to = [22.0, 10.0]
name = "outer"
[[geometry.outline]]
to = [12.0, 10.0]
[[geometry.outline]]
to = [12.0, -10.0]
name = "inner"
"""
    begin, end = CASE.index('shape = "plain"'), CASE.index("[mesh]")
    section = (CASE[:begin] + drawn + CASE[end:]).replace("elements_across = 2", "elements_across = 3")
    plain = CASE.replace("elements_across = 2", "elements_across = 3")
    dynamic = "frequency = [1, 200]\npreload = [0, 1]"
    for mode in ("axial", "radial"):
        found, expected = (vibrate(one(mode, dynamic, tmp_path, text=text)) for text in (section, plain))
        for a, b in zip(found.curves, expected.curves, strict=True):
            assert_allclose(np.abs(a.stiffness), np.abs(b.stiffness), rtol=0.01)
            assert_allclose(a.loss_angle, b.loss_angle, atol=math.radians(0.05))


SOFTENING = "material.parameters={C10 = 0.5, C20 = -0.1, C30 = 0.0}"


def test_unstable_preload_and_one_out_of_reach(tmp_path: Path) -> None:
    """A law that softens without end: some degrees are stable, more are not, and still more have no equilibrium."""
    text = CASE.replace("elements_across = 2", "elements_across = 3")
    dynamic = "frequency = [10]\npreload = [5, 17.2, 40]"
    found = vibrate(one("torsional", dynamic, tmp_path, SOFTENING, "load_cases.0.steps=12", text=text))
    assert [round(math.degrees(curve.preload), 6) for curve in found.curves] == [5]
    assert not found.complete
    assert {one.name for one in found.conditions} == {"unstable_preload", "preload_not_reached"}


def test_an_interruption_keeps_the_preloads_so_far(tmp_path: Path) -> None:
    def interrupt(name: str, step: int, steps: int, newton: int, q: float) -> None:
        if q > 1.5:
            raise KeyboardInterrupt

    with pytest.raises(DynamicInterrupted) as stopped:
        vibrate(one("axial", "frequency = [10]\npreload = [0, 1, 3]", tmp_path), progress=interrupt)
    found = stopped.value.response
    assert [curve.preload for curve in found.curves] == [0, 1]
    assert not found.complete
    # By this name an unfinished result is kept from replacing a finished one.
    assert [one.name for one in found.conditions] == ["interrupted"]
    assert "2 of 3 preloads" in found.conditions[0].message


def test_command(tmp_path: Path) -> None:
    case(tmp_path)
    file, out = tmp_path / "case.toml", tmp_path / "out"
    good = CliRunner().invoke(main, ["dynamic", str(file), "-o", str(out), "--json", "-q"])
    assert good.exit_code == 0
    result = json.loads(good.stdout)
    assert result["command"] == "dynamic"
    assert (
        result == json.loads((out / "result.json").read_text()) | {"timings_s": result["timings_s"]}
        or result["load_cases"] == json.loads((out / "result.json").read_text())["load_cases"]
    )
    assert {"axial-dynamic.csv", "axial-dynamic.png", "report.html"} <= {one.name for one in out.iterdir()}
    wrong = CliRunner().invoke(main, ["dynamic", str(file), "--set", "load_cases.0.dynamic.frequency=0"])
    assert wrong.exit_code == 2
    far = ["--set", "load_cases.0.dynamic.preload=[1, 60]", "--set", SOFTENING, "--json", "-q"]
    stopped = CliRunner().invoke(main, ["dynamic", str(file), *far])
    assert stopped.exit_code == 3
    assert len(json.loads(stopped.stdout)["load_cases"]) == 1


def test_without_amplitude_a_thinned_spectrum_counts_once(tmp_path: Path) -> None:
    constants = {
        "g": 0.65,
        "tau": 30.0,
        "decades": 3.0,
        "slope": 0.1,
        "path": 1e3,
        "offset": 0.01,
        "exponent": 1.0,
    }
    given = ", ".join(f"{name} = {value}" for name, value in constants.items())
    payne = f'[[effects]]\nname = "payne"\nparameters = {{{given}}}\n'
    text = CASE[: CASE.index("[[effects]]")] + payne
    (curve,) = vibrate(case(tmp_path, text=text)).curves
    thinned = effect("payne").feature().thinned(constants)
    still = 1.0 + modulus(curve.frequency, thinned.branches())
    # At rest all of the rubber has one complex modulus, but for its volume's.
    assert_allclose(curve.stiffness, curve.static * still, rtol=0.02)
    small, large = vibrate(case(tmp_path, AXIAL + "amplitude = [1e-5, 1]\n", text=text)).curves
    assert_allclose(small.stiffness, curve.stiffness, rtol=5e-3)
    assert (abs(large.stiffness) < 0.8 * abs(small.stiffness)).all()
    assert (large.third_harmonic > small.third_harmonic).all()
