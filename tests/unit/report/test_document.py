"""The JSON contract: its keys, its units, and only values that JSON can represent."""

import json

import numpy as np
import pytest

from bushcli.recording import read_recording
from bushcli.report.json.check import check_json
from bushcli.report.json.direct import direct_json
from bushcli.report.json.fit import fit_json
from bushcli.report.results import CheckResult, FitResult
from bushcli.simulate.strains import Strains
from bushcli.standards.protocol import protocol
from bushcli.study.answers import RESULT_KEYS

EVERY_RESULT = {"command", "case", "versions", "timings_s", "problems"}


def strict(document):
    """The document as a script reads it; nan, infinity and NumPy's types raise an error."""
    return json.loads(json.dumps(document, allow_nan=False))


@pytest.fixture
def direct(answer, channel):
    def make(*channels, fit=None):
        found = answer(*(channels or (channel("axial", 104.0, 100.0),)), fit=fit)
        return strict(direct_json(found))

    return make


def test_a_direct_result_has_the_keys_that_scripts_rely_on(direct):
    result = direct()
    assert result.keys() >= EVERY_RESULT | {"load_cases", "verdict"}
    assert result["versions"].keys() == {"bushcli", "dolfinx", "petsc", "gmsh", "numpy", "scipy", "python"}
    (axial,) = result["load_cases"]
    assert axial.keys() >= {"name", "mode", "displacement", "force", "stiffness", "recording", "units"}
    assert axial["stiffness"] == pytest.approx({"initial": 104.0, "secant": 104.0})
    recording = axial["recording"]
    assert recording["stiffness_measured"] == pytest.approx(100.0)
    assert recording["stiffness_simulated"] == pytest.approx(104.0)
    assert recording["stiffness_ratio"] == pytest.approx(1.04)
    assert recording["within_10_percent"] is True
    # The force is off by 4 % at the ends, where it is half of its range.
    assert recording["peak_percent"] == pytest.approx(2.0)
    assert recording.keys() >= {"rms_percent", "noise_percent", "compared", "initial_stiffness_measured"}
    assert result["verdict"]["within_10_percent"] is True
    assert result["verdict"]["channels"]["axial"]["stiffness_ratio"] == pytest.approx(1.04)


def test_a_study_can_ask_for_every_key_of_a_direct_result(direct):
    assert set(RESULT_KEYS) == set(direct())


def test_rotations_are_in_degrees(direct, channel):
    (torsional,) = direct(channel("torsional", 18000.0))["load_cases"]
    assert max(torsional["displacement"]) == pytest.approx(np.degrees(4.0))
    assert torsional["stiffness"]["secant"] == pytest.approx(np.radians(18000.0))
    units = {"displacement": "deg", "force": "N mm", "stiffness": "N mm/deg", "energy": "N mm"}
    assert torsional["units"] == units
    assert "recording" not in torsional


def test_steps_tried_count_the_rejected_too(direct):
    (axial,) = direct()["load_cases"]
    assert (axial["newton_iterations"], axial["steps_tried"], axial["steps_rejected"]) == (28, 2, 1)


def test_a_march_that_stopped_says_so(direct, channel):
    result = direct(channel("axial", 100.0, 100.0, reach=2.0, stopped="DIVERGED_MAX_IT"))
    (axial,) = result["load_cases"]
    assert (result["complete"], axial["complete"], axial["stopped"]) == (False, False, "DIVERGED_MAX_IT")
    assert axial["recording"]["compared"] == pytest.approx(21 / 41)


def test_a_recording_that_was_not_reached_is_a_problem(direct, channel):
    from bushcli.curve.curve import Curve

    at_rest = Curve("axial", [0.0, 1e-9], [0.0, 0.0])
    result = direct(channel("axial", measured=100.0, curve=at_rest, stopped="DIVERGED_MAX_IT"))
    assert "recording" not in result["load_cases"][0]
    assert [problem["name"] for problem in result["problems"]] == ["not_compared"]


def test_what_is_not_finite_is_written_in_words(direct, channel):
    result = direct(channel("axial", 100.0, mesh_error=float("inf"), strained=Strains((1.0, float("nan")))))
    (axial,) = result["load_cases"]
    assert axial["mesh_error_percent"] == "inf"
    assert axial["principal_stretches"] == [1.0, None]
    assert result["case"]["material"]["bulk_modulus"] == "inf"


def test_a_fit_has_the_keys_that_scripts_rely_on(case, fit):
    result = strict(fit_json(FitResult(case(), fit)))
    assert result.keys() >= EVERY_RESULT | {
        *("law", "parameters", "correlation", "misfit", "forward_solves", "sweeps", "iterations"),
        *("converged", "identifiability", "stability", "weighting"),
    }
    assert result["parameters"]["C10"].keys() >= {"value", "std", "lower", "upper", "at_bound", "unit"}
    assert result["parameters"]["C10"]["upper"] == "inf"
    assert result["parameters"]["C20"]["std"] is None
    assert result["correlation"]["C10"] == {"C10": 1.0, "C20": None}
    assert result["stability"]["planar"] == {"lower": 0.0, "upper": "inf"}
    assert result["identifiability"]["undetermined"][0]["weights"] == {"C20": 1.0}
    assert result["problems"][0] == {
        "name": "at_bound",
        "message": "C20 lies on its bound",
        "remedy": "choose another law",
    }


def test_a_mode_tested_twice_goes_by_the_names_of_its_tests(case, fit):
    result = strict(fit_json(FitResult(case(), fit)))
    assert result["misfit"].keys() == {"uniaxial", "second", "planar"}
    assert result["misfit"]["planar"]["rms_percent"] == pytest.approx(20.0)


def test_a_law_fitted_on_the_way_is_in_the_direct_result(direct, fit):
    result = direct(fit=fit)
    assert result["fit"]["law"] == "yeoh"
    assert result["problems"][0]["name"] == "at_bound"


def test_a_checked_case_says_what_its_recordings_hold(case):
    used = case()
    curves = [read_recording(source) for source in used.recordings]
    result = strict(check_json(CheckResult(used, curves, [], protocol(used, curves, []))))
    (measured,) = result["recordings"]
    assert (measured["name"], measured["samples"], measured["cycles"]) == ("measured", 6, 1)
    assert measured["displacement"] == [0.0, 5.0]
    assert measured["duration_s"] is None
