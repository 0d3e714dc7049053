"""Units of case files and reports, and significant digits."""

import math

import numpy as np
import pytest

from bushcli.report.quantity import join_names, number, percent, quantities


def test_rotation_is_shown_in_degrees():
    shown = quantities("torsional")
    assert shown.at(math.pi / 6) == pytest.approx(30.0)
    # 180 N mm/rad are pi N mm/degree.
    assert shown.stiffness(180.0) == pytest.approx(math.pi)
    assert shown.stiffness_unit == "N mm/deg"


def test_translation_is_left_as_it_is():
    shown = quantities("radial")
    assert shown.shown_displacement(np.array([1.0, 2.0])).tolist() == [1.0, 2.0]
    assert (shown.displacement_unit, shown.force_unit, shown.stiffness(5.0)) == ("mm", "N", 5.0)


def test_coupon_is_shown_as_stretch():
    shown = quantities("uniaxial")
    assert shown.shown_displacement(np.array([0.0, 1.5])).tolist() == [1.0, 2.5]
    assert shown.displacement_label == "stretch"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (645.4, "645"),
        (66.13, "66.1"),
        (1834.2, "1834"),
        (0.001234, "0.00123"),
        (9.996, "10.0"),
        (-0.05, "-0.0500"),
        (0.0, "0"),
        (4.4e-05, "4.40e-05"),
        (1e9, "1.00e+09"),
        (float("inf"), "inf"),
        (float("nan"), "-"),
        (None, "-"),
    ],
)
def test_numbers_have_three_significant_digits(value, text):
    assert number(value) == text


def test_percentages_are_as_fine_as_they_are_small():
    assert [percent(v) for v in (0.163, 3.24, 77.7, float("nan"))] == ["0.16 %", "3.2 %", "78 %", "-"]


def test_names_are_joined_as_in_a_sentence():
    assert [join_names(n) for n in ([], ["a"], ["a", "b"], ["a", "b", "c"])] == [
        "",
        "a",
        "a and b",
        "a, b and c",
    ]
