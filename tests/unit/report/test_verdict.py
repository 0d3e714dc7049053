"""The verdict on curves of known stiffness."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from bushcli.curve.curve import Curve
from bushcli.faults import DataFault
from bushcli.recording.source import FaultKind
from bushcli.report.verdict import fault_kind, judge, single_factor, stiffer


def test_too_stiff_says_how_much_and_what_factor_would_help(answer, channel):
    # The literature's case: 645 N/mm from coupon data, 363 N/mm measured; 645 / 363 = 1.777, 363 / 645 = 0.563.
    verdict = answer(channel("radial", 645.0, 363.0)).verdict
    assert verdict.within is False
    assert verdict.tone == "bad"
    assert [word in verdict.channels[0].text for word in ("645 N/mm", "363 N/mm", "78 % too stiff")] == [
        True
    ] * 3
    assert "Too stiff" in verdict.headline
    assert "single factor of 0.56" in verdict.text


def test_too_soft(answer, channel):
    verdict = answer(channel("axial", 80.0, 100.0)).verdict
    assert "Too soft" in verdict.headline
    assert "20 % too soft" in verdict.text


def test_within_the_band_there_is_no_gap_to_explain(answer, channel):
    verdict = answer(channel("axial", 104.0, 100.0)).verdict
    assert verdict.within is True
    assert "4 % too stiff; within the accepted 10 %" in verdict.text
    assert "factor" not in verdict.text


def test_rotations_are_judged_in_degrees(answer, channel):
    # 18000 N mm/rad are 314.16 N mm/degree.
    verdict = answer(channel("torsional", 18000.0, 18000.0)).verdict
    assert "simulated 314 N mm/deg, measured 314 N mm/deg: as stiff as measured" in verdict.text


def test_one_channel_outside_makes_the_whole_negative(answer, channel):
    verdict = answer(channel("axial", 100.0, 100.0), channel("radial", 200.0, 100.0)).verdict
    assert verdict.within is False
    assert [c.within for c in verdict.channels] == [True, False]
    assert verdict.headline == "Too stiff: radial outside the accepted 10 %"
    assert "No single factor" in verdict.text


def test_the_factor_is_the_least_squares_one(answer, channel):
    found = answer(channel("axial", 150.0, 100.0), channel("radial", 1500.0, 1000.0))
    factor = single_factor(list(found.misfits.values()))
    assert factor is not None
    assert factor.factor == pytest.approx(2 / 3)
    assert factor.explains
    assert max(factor.rms_after.values()) < 1e-9
    # For a symmetric straight line rms / range is half of 1/sqrt(3) times the relative error, about 14 %, here a little
    # more because 41 evenly spaced samples include both ends: sqrt(sum(k^2) / n) / range, k = -20..20.
    k = np.arange(-20, 21)
    assert factor.rms_before["axial"] == pytest.approx(100 * 0.5 * np.sqrt(np.mean(k**2)) / 40)


def test_channels_that_ask_for_different_factors_are_not_explained_by_one(answer, channel):
    found = answer(channel("axial", 150.0, 100.0), channel("radial", 1200.0, 1000.0))
    factor = single_factor(list(found.misfits.values()))
    assert factor is not None
    assert factor.by_channel == pytest.approx({"axial": 2 / 3, "radial": 5 / 6})
    assert not factor.explains


def test_a_curve_of_another_shape_is_outside_though_its_secant_agrees(answer, channel):
    q = np.linspace(-4.0, 4.0, 41)
    # The secant stiffness is 100 N/mm, but the curve is off by 400 N ((q/4)^3 - q/4), which is largest at q =
    # 4/sqrt(3).
    bent = Curve("axial", q, 400.0 * (q / 4.0) ** 3)
    verdict = answer(channel("axial", measured=100.0, curve=bent)).verdict
    assert verdict.within is False
    assert "19 %" in verdict.text  # 2 / (3 sqrt(3)) * 400 N over 800 N
    assert not verdict.single_factor.explains


def test_without_a_recording_there_is_no_judgement(answer, channel):
    verdict = answer(channel("axial", 100.0)).verdict
    assert verdict.within is None
    assert verdict.single_factor is None
    assert verdict.tone == "plain"
    assert verdict.lines[0].endswith("100 N/mm (secant) from -4.00 to 4.00 mm.")


def test_a_march_that_stopped_is_not_within_the_band(answer, channel):
    verdict = answer(channel("axial", 100.0, 100.0, reach=2.0, stopped="DIVERGED_MAX_IT")).verdict
    assert verdict.within is False
    assert "51 % of the recording" in verdict.text  # 21 of 41 samples lie within 2 mm


def test_a_march_that_failed_at_once_is_no_misfit(answer, channel):
    at_rest = Curve("axial", [0.0, 1e-9], [0.0, 0.0])
    verdict = answer(channel("axial", measured=100.0, curve=at_rest, stopped="DIVERGED_MAX_IT")).verdict
    assert verdict.within is False
    assert "ended too early" in verdict.headline


def test_a_faulty_recording_makes_no_bushing_too_soft(answer, channel):
    found = answer(channel("axial", 300.0, -360.0), channel("radial", 120.0, 100.0))
    fault = DataFault("axial", "sign", "the force falls", "reverse it", True, np.zeros(41, dtype=bool))
    verdict = judge(replace(found.response, faults=(fault,)), found.misfits)
    assert verdict.headline == "Faulty data: wrong sign in the axial channel, to be corrected first"
    assert verdict.within is False
    axial, radial = verdict.lines
    assert axial.endswith("to be compared when its recording is corrected.")
    assert "too" not in axial
    assert "20 % too stiff" in radial


def test_a_ratio_that_is_no_number_has_words():
    assert stiffer(float("nan"), 10.0) == "no stiffness to compare"


def test_each_kind_of_fault_has_words():
    words = {kind: fault_kind(DataFault("axial", kind, "", "", False)) for kind in get_args(FaultKind)}
    assert not [kind for kind, text in words.items() if text == kind]


def test_a_probable_fault_stands_above_what_follows_from_the_recording(answer, channel):
    """Nothing contradicts a rubber a thousand times as soft; the force may be in kN."""
    doubt = DataFault("axial", "unit", "soft", "units", False, probability=0.98)
    found = answer(channel("axial", 100.0, 0.1))
    verdict = judge(replace(found.response, faults=(doubt,)), found.misfits)
    assert verdict.lines[0].startswith("Doubtful data: wrong unit in the axial channel (98 %)")
    assert "1000 times as stiff as measured" in verdict.lines[1]
    assert "factor of 0.00100 on the stiffness" in verdict.lines[2]
    assert "another rubber or unit?" in verdict.lines[2]
