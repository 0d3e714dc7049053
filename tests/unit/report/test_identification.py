"""Identified laws in JSON, text, pictures and files; their ranking."""

import io
import json
import math
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from bushcli import report
from bushcli.case import Material
from bushcli.curve.curve import Curve
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect
from bushcli.faults import DataFault
from bushcli.inverse import Combination, EndPoint, Estimate, Evaluation, Fit, FittedCurve, Profile
from bushcli.recording import Recording
from bushcli.report.drawing.results import pictures_of
from bushcli.report.plots.fit import inverse_panels
from bushcli.report.ranking import effective_samples, information_criterion, rank
from bushcli.report.results import InverseResult
from bushcli.report.views.inverse import answer, bulk_modulus_line, with_error
from bushcli.report.writers.files import write
from bushcli.report.writers.terminal import terminal_text
from bushcli.runtime.condition import Condition

NOISE = 0.5  # percent of the force range


def recorded(mode="axial", samples=400, reach=6.0, seed=0, wave=0.0):
    """A straight line of 100 N/mm there and back, with white noise of 0.5 % of its range."""
    q = reach * np.sin(np.linspace(0.0, 2 * np.pi, samples))
    force = 100.0 * q
    noise = np.random.default_rng(seed).normal(size=samples) * NOISE / 100 * np.ptp(force)
    # A loop: the sign of the velocity, which is not a function of displacement.
    loop = wave * np.sign(np.cos(np.linspace(0.0, 2 * np.pi, samples))) * np.ptp(force)
    return Recording(mode, q, force + noise + loop, None, name=mode)


def curve(mode="axial", rms=NOISE, held_out=False, before=80.0, **changes):
    """A fitted curve with this nominal rms misfit (percent); its points are those of the line without noise."""
    recording = recorded(mode, **changes)
    q = recording.displacement
    after = Curve(mode, q, 100.0 * q)
    started = None if held_out else Curve(mode, q, 500.0 * q)
    smooth = Curve(mode, np.linspace(-6.0, 6.0, 13), np.linspace(-600.0, 600.0, 13))
    start = float("nan") if held_out else before
    return FittedCurve(mode, recording, after, rms, started, start, NOISE, held_out, smooth)


def identified(law="yeoh", curves=None, names=("C10", "C20"), **changes):
    """An identified law whose last parameter is poorly determined: value -0.02, standard error 0.01."""
    values = [0.25, *(-0.02 for _ in names[1:])]
    errors = [0.0012, *(0.01 for _ in names[1:])]
    bounds = (-100.0, 100.0)
    estimates = {n: Estimate(v, e, *bounds, False) for n, v, e in zip(names, values, errors, strict=True)}
    if len(names) > 1:
        estimates[names[-1]] = replace(estimates[names[-1]], interval=(float("-inf"), 0.001))
    start = dict.fromkeys(names, 1.0)
    end = dict(zip(names, values, strict=True))
    count = len(names)
    given = {
        "material": Material(law, 2000.0, {n: v for n, v in end.items() if n != "compliance"}),
        "parameters": estimates,
        "correlation": np.eye(count) - 0.9 * (1 - np.eye(count)),
        "curves": tuple(curves or (curve("axial"), curve("radial"))),
        "stability": {},
        "weighting": "relative",
        "forward_solves": 8,
        "sweeps": 4,
        "failed_solves": 1,
        "iterations": 3,
        "converged": True,
        "singular_values": np.geomspace(1.0, 1e-4, count),
        "undetermined": (
            Combination({names[-1]: 1.0}, 1e-4, f"{names[-1]} is not determined by these curves"),
        ),
        "seconds": 2.0,
        "conditions": (Condition("undetermined", "C20 is open", "record larger displacements"),),
        "message": "`ftol` termination condition is satisfied.",
        "cost": 1.0,
        "evaluations": (
            Evaluation(1, start, 1e4, True),
            Evaluation(2, start, float("nan"), False),
            Evaluation(3, end, 1.0, True),
            Evaluation(4, end, 1.1, False, "profile"),
        ),
        "end_points": (EndPoint(start, end, 1.0, "done"), EndPoint(start, start, float("nan"), "stuck")),
        "profiles": (
            Profile(names[-1], np.array([-0.04, -0.02, 0.0, 0.005]), np.array([np.nan, 0.0, 3.0, 5.0])),
        ),
        "profile_sweeps": 1,
        "leverage": {"axial": dict.fromkeys(names, 0.02)},
    }
    return Fit(**(given | changes))


def shown(case, fits):
    stream = io.StringIO()
    Console(width=160, no_color=True, file=stream).print(
        terminal_text(report.as_document(InverseResult(case, fits)))
    )
    return stream.getvalue()


def test_json_is_what_scripts_rely_on(case):
    document = report.as_json(InverseResult(case(), [identified()]))
    json.dumps(document, allow_nan=False)
    assert document["command"] == "inverse"
    assert document["law"] == "yeoh"
    assert document["parameters"]["C20"] == {
        "value": -0.02,
        "std": 0.01,
        "lower": -100.0,
        "upper": 100.0,
        "at_bound": False,
        "interval": [None, 0.001],
        "unit": "MPa",
    }
    # 1.96 standard errors to each side.
    assert document["parameters"]["C10"]["interval"] == pytest.approx(
        [0.25 - 1.96 * 0.0012, 0.25 + 1.96 * 0.0012]
    )
    assert document["correlation"]["C10"]["C20"] == -0.9
    assert document["misfit"]["radial"] == {
        "rms_percent": NOISE,
        "before_percent": 80.0,
        "noise_percent": NOISE,
        "held_out": False,
    }
    assert document["identifiability"]["undetermined"][0]["weights"] == {"C20": 1.0}
    assert document["end_points"][1]["cost"] is None
    assert document["evaluations"][1]["cost"] is None
    assert document["evaluations"][3]["stage"] == "profile"
    assert document["profiles"][0]["rise"] == [None, 0.0, 3.0, 5.0]
    assert (document["forward_solves"], document["sweeps"], document["failed_solves"]) == (8, 4, 1)
    assert "models" not in document


def test_loops_that_the_best_law_leaves_are_a_problem(case):
    looping = curve("axial", wave=0.05)
    found = report.as_json(InverseResult(case(), [identified(curves=(looping, curve("radial")))]))
    assert [problem["name"] for problem in found["problems"]] == ["undetermined", "unexplained_hysteresis"]
    assert found["channels"].keys() == {"axial", "radial"}
    (first,) = found["channels"]["axial"]["cycles"]
    # 60 N up on loading, 60 N down on unloading, over 6 mm on either side.
    assert first["recorded"]["energy"] == pytest.approx(4 * 60.0 * 6.0, rel=0.02)
    assert first["simulated"]["energy"] == pytest.approx(0.0, abs=1.0)
    assert first["displacement"] == pytest.approx([-6.0, 6.0], abs=0.05)
    text = shown(case(), [identified(curves=(looping,))])
    assert "axial: cycles, recorded" in text
    assert "problem unexplained_hysteresis" in text


def test_json_of_several_laws_ranks_them(case):
    other = identified("neo_hookean", (curve("axial", 2.0), curve("radial", 3.0)), ("C10",), profiles=())
    document = report.as_json(InverseResult(case(), sorted([other, identified()], key=rank)))
    assert document["law"] == "yeoh"
    assert [model["law"] for model in document["models"]] == ["yeoh", "neo_hookean"]
    assert document["models"][1]["misfit"] == {"axial": 2.0, "radial": 3.0}
    assert document["models"][1]["number_of_parameters"] == 1


def test_values_of_a_rig_that_turns_are_shown_in_degrees(case):
    # A stop of a million N mm/rad at 0.1 rad, in the case file's units: 1e6/57.29578 N mm/degree at 5.729578 degrees.
    stop = ActiveEffect(effect("bump_stop"), {"stiffness": 1e6, "gap": 0.1}, ("torsional",))
    names = ("C10", "bump_stop.stiffness", "bump_stop.gap")
    found = identified(names=names, curves=(curve("axial"), curve("torsional", reach=0.2)), effects=(stop,))
    inside = {"C10": 0.25, "bump_stop.stiffness": 1e6, "bump_stop.gap": 0.1}
    values = (Estimate(inside[n], 0.01 * inside[n], 0.0, 100.0, False) for n in names)
    found = replace(
        found,
        parameters=dict(zip(names, values, strict=True)),
        evaluations=(Evaluation(1, inside, 1.0, True),),
        end_points=(EndPoint(inside, inside, 1.0, "done"),),
        profiles=(Profile("bump_stop.gap", np.array([0.1, 0.2]), np.array([0.0, 5.0])),),
    )
    document = report.as_json(InverseResult(case(), [found]))
    shown_values = document["parameters"]
    assert shown_values["bump_stop.stiffness"]["value"] == pytest.approx(1e6 / 57.29578)
    assert shown_values["bump_stop.stiffness"]["std"] == pytest.approx(1e4 / 57.29578)
    assert shown_values["bump_stop.stiffness"]["unit"] == "N mm/degree"
    assert shown_values["bump_stop.gap"]["value"] == pytest.approx(5.729578)
    assert shown_values["bump_stop.gap"]["unit"] == "degrees"
    assert shown_values["C10"] == shown_values["C10"] | {"value": 0.25, "unit": "MPa"}
    assert document["evaluations"][0]["parameters"]["bump_stop.gap"] == pytest.approx(5.729578)
    assert document["end_points"][0]["start"]["bump_stop.gap"] == pytest.approx(5.729578)
    assert document["profiles"][0]["values"] == pytest.approx([5.729578, 2 * 5.729578])
    assert "5.730" in shown(case(), [found])
    assert "degrees" in shown(case(), [found])
    # The same stop on the channel that does not turn.
    straight = replace(found, effects=(replace(stop, channels=("axial",)),))
    gap = report.as_json(InverseResult(case(), [straight]))["parameters"]["bump_stop.gap"]
    assert (gap["value"], gap["unit"]) == (0.1, "mm")


def test_compliance_is_shown_with_unit_and_bulk_modulus(case):
    found = identified(names=("C10", "compliance"))
    document = report.as_json(InverseResult(case(), [found]))
    assert document["parameters"]["compliance"]["unit"] == "1/MPa"
    assert document["bulk_modulus"] == 2000.0
    # -0.02 ± 0.01 per MPa cannot be distinguished from zero, so that the bulk modulus has no value.
    assert "Bulk modulus: not determined" in shown(case(), [found])


@pytest.mark.parametrize(
    ("compliance", "std", "expected"),
    # 1 / 5e-4; 1 / (0 + 2 * 1e-3): two standard errors are the 95 % limit.
    [(5e-4, 1e-5, "2000"), (0.0, 1e-3, "above 500")],
)
def test_bulk_modulus_is_the_compliance_in_other_words(compliance, std, expected):
    found = identified(names=("C10", "compliance"))
    estimate = Estimate(compliance, std, 0.0, 0.1, False)
    assert bulk_modulus_line(replace(found, parameters={"compliance": estimate})) == expected


def test_what_was_held_out_ranks_laws():
    # The worse fit ranks first because it predicts better.
    overfitted = identified(curves=(curve("axial", 0.5), curve("radial", 8.0, held_out=True)))
    honest = identified("neo_hookean", (curve("axial", 2.0), curve("radial", 3.0, held_out=True)), ("C10",))
    unsolved = identified("gent", (curve("axial", 0.4),))
    assert sorted([unsolved, overfitted, honest], key=rank) == [honest, overfitted, unsolved]


def test_unconverged_laws_come_last():
    good = identified(curves=(curve("axial", 5.0),))
    assert sorted([identified(converged=False), good], key=rank)[0] is good


def test_a_parameter_that_brings_nothing_costs_a_rank():
    two = identified(curves=(curve("axial", NOISE),))
    one = identified("neo_hookean", (curve("axial", NOISE),), ("C10",))
    assert rank(one) < rank(two)
    # 400 samples of white noise: 2 % less rms is worth 400 ln(1.02^2) = 15.8, a parameter ln 400 = 6.0.
    better = identified(curves=(curve("axial", NOISE / 1.02),))
    gain = information_criterion(one) - information_criterion(better)
    count = effective_samples(one.curves[0])
    assert gain == pytest.approx(count * math.log(1.02**2) - math.log(count))
    assert gain > 0


def test_misfits_below_what_a_recording_is_trusted_to_are_equal():
    found = [identified(curves=(replace(curve("axial", rms), noise_percent=0.0),)) for rms in (1e-3, 1e-5)]
    assert information_criterion(found[0]) == information_criterion(found[1])


def test_white_noise_leaves_all_samples_a_loop_few():
    # Sokal's window slightly overestimates the correlation time of white noise.
    assert 300 < effective_samples(curve()) <= 400
    assert effective_samples(curve(wave=0.1)) < 30


@pytest.mark.parametrize(
    ("rms", "tone", "says"),
    [
        (
            0.5,
            "good",
            "The curve is reproduced to within its noise (axial 0.50 %): C10 = 0.2500 ± 0.0012 MPa and "
            "C20 = -0.020 ± 0.010",
        ),
        (1.2, "plain", "reproduced closely, not to within its noise (axial 1.2 %, noise 0.50 %)"),
        (12.0, "bad", "not reproduced (axial 12 %, noise 0.50 %)"),
    ],
)
def test_verdict_is_one_clear_sentence(rms, tone, says):
    found = answer(identified(curves=(curve("axial", rms),)))
    assert found.tone == tone
    assert says in found.headline
    assert found.lines[0].startswith("C20 is poorly determined")


def test_verdict_without_convergence_says_so():
    assert answer(identified(converged=False)).headline.startswith("The search did not converge")


def test_verdict_on_faulty_data_is_that_they_are_faulty():
    fault = DataFault("axial", "sign", "the force falls", "reverse it", True, np.zeros(3, dtype=bool))
    found = answer(identified(faults=(fault,)))
    assert found.headline == "Faulty data: wrong sign in the axial channel, to be corrected first"
    assert found.tone == "bad"
    assert "do not describe the rubber" in " ".join(found.lines)
    assert "poorly determined" not in " ".join(found.lines)


def test_verdict_names_what_was_held_out():
    found = answer(identified(curves=(curve("axial"), curve("radial", 14.0, held_out=True))))
    assert "radial, held out, is not predicted: 14 % rms (noise 0.50 %)." in found.lines


@pytest.mark.parametrize(
    ("value", "std", "expected"),
    [
        (0.117906, 0.000193, "0.11791 ± 0.00019 MPa"),
        (1234.5, 12.0, "1234 ± 12 MPa"),
        (0.02, 0.3, "0.02 ± 0.30 MPa"),
        (0.25, float("nan"), "0.2500 MPa"),
        (0.25, 0.00999, "0.250 ± 0.010 MPa"),
    ],
)
def test_digits_are_those_that_the_error_leaves(value, std, expected):
    found = identified(names=("C10",))
    found = replace(found, parameters={"C10": Estimate(value, std, 0.0, 1e4, False)})
    assert with_error(found, "C10") == expected


def test_one_parameter_is_not_called_determined_by_its_relative_singular_value(case):
    poor = replace(identified(names=("C10",)), singular_values=np.ones(1))
    poor = replace(poor, parameters={"C10": Estimate(0.25, 0.1, 0.0, 1e4, False)})
    text = shown(case(), [poor])
    assert "C10 is poorly determined" in text
    assert "singular values" not in text


def test_text_says_everything(case):
    text = shown(
        case(),
        [identified(), identified("neo_hookean", (curve("axial", 2.0), curve("radial", 3.0)), ("C10",))],
    )
    for said in (
        "below 0.00100",
        "poorly determined",
        "-0.90",
        "1 of the 2 combinations of the parameters is left open",
        "4 evaluations (1 failed), 8 simulations of one channel, 2.0 s",
        "Laws, best first by BIC",
        "problem undetermined",
        "remedy: record larger displacements",
    ):
        assert said in text


@pytest.mark.slow
def test_every_picture_is_sound():
    fits = [identified(curves=(curve("axial"), curve("radial", 4.0, held_out=True))), identified("gent")]
    pictures = pictures_of(inverse_panels(InverseResult(None, fits), {"axial": "axial", "radial": "radial"}))
    names = {picture.name for picture in pictures}
    expected = {"axial-identified", "radial-identified", "ranking", "profiles", "correlation", "convergence"}
    assert expected | {"starts"} <= names
    for picture in pictures:
        assert picture.png.startswith(b"\x89PNG\r\n\x1a\n")
        assert ET.fromstring(picture.svg).tag.endswith("svg")


def test_pictures_of_one_parameter_and_no_search():
    found = identified(names=("C10",), profiles=(), evaluations=(), end_points=())
    panels = inverse_panels(InverseResult(None, [found]), {"axial": "axial", "radial": "radial"})
    names = {picture.name for picture in panels}
    assert names & {"axial-identified", "ranking", "profiles", "correlation", "convergence"} == {
        "axial-identified"
    }


@pytest.mark.slow
def test_files_of_an_identification(case, tmp_path):
    used, fits = case(), [identified()]
    found = InverseResult(used, fits)
    result, files = report.as_json(found), report.as_files(found)
    written = write(tmp_path / "out", result, files, lambda: report.as_document(found))
    names = {path.name for path in written}
    assert {"result.json", "report.html", "axial-identified.csv", "convergence.png"} <= names
    rows = (tmp_path / "out" / "axial-identified.csv").read_text().splitlines()
    assert rows[0] == "displacement_mm,recorded_force_N,fitted_force_N,started_force_N"
    assert len(rows) == 401
    page = (tmp_path / "out" / "report.html").read_text()
    assert "reproduced to within their noise" in page
    assert "identified from the recordings" in page
    # Both channels are loaded and unloaded, so that each has a picture of its loops.
    assert page.count('<div class="panels cycles">') == 2
