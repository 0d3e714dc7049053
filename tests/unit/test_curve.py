"""Curve: interpolation and the two stiffnesses, on curves with known answers."""

import math
from itertools import pairwise

import numpy as np
import pytest

from bushcli.curve.curve import Curve, ExactCurve


def response(q):
    """Softening, then stiffening: initially 200, secant over 6 mm 200 - 3*36 + 0.08*1296 = 195.68."""
    return 200 * q - 3 * q**3 + 0.08 * q**5


def test_arrays_are_copied_and_read_only():
    q = np.array([0.0, 1.0])
    curve = Curve("axial", q, [0.0, 2.0])
    q[0] = 9.0
    assert curve.displacement[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        curve.force[0] = 1.0


@pytest.mark.parametrize(
    ("q", "force", "time", "message"),
    [
        ([0, 1], [0, 1, 2], None, "force has shape"),
        ([0, 1], [0, 1], [0], "time has shape"),
        ([0], [0], None, "displacement has shape"),
        ([[0, 1]], [[0, 1]], None, "displacement has shape"),
        ([0, np.nan], [0, 1], None, "displacement has values that are not finite"),
        ([0, 1], [0, np.inf], None, "force has values that are not finite"),
    ],
)
def test_impossible_curves_are_refused(q, force, time, message):
    with pytest.raises(ValueError, match=message):
        Curve("axial", np.array(q, float), np.array(force, float), None if time is None else np.array(time))


@pytest.mark.parametrize("direction", [1, -1])
def test_cubic_interpolation_reproduces_a_cubic(direction):
    q = np.array([0.0, 0.3, 1.0, 2.5, 4.0])[::direction]
    curve = Curve("axial", q, q**3 - q)
    wanted = np.linspace(0, 4, 17)
    np.testing.assert_allclose(curve.at(wanted), wanted**3 - wanted, atol=1e-12)
    assert curve.at(2.5) == pytest.approx(2.5**3 - 2.5)


def test_pchip_does_not_overshoot_a_knee():
    curve = Curve("axial", np.arange(6.0), np.array([0.0, 0, 0, 10, 20, 30]))
    assert curve.at(np.linspace(0, 2, 50), method="pchip").min() >= 0.0
    assert curve.at(np.linspace(0, 2, 50), method="cubic").min() < -0.1


@pytest.mark.parametrize("n", [2, 3, 4])
def test_few_points_are_interpolated(n):
    q = np.linspace(0, 1, n)
    assert Curve("axial", q, 2 * q).at(0.4) == pytest.approx(0.8)


def test_the_end_tangent_is_followed_a_little_and_no_further():
    q = np.linspace(0, 10, 11)
    curve = Curve("axial", q, 3 * q)
    np.testing.assert_allclose(curve.at(np.array([-0.05, 10.05])), [-0.15, 30.15])
    for beyond in (-0.11, 10.11, np.nan):
        with pytest.raises(ValueError, match=r"outside the curve \(0 to 10\)"):
            curve.at(beyond)
    with pytest.raises(ValueError, match="outside"):
        curve.at(10.05, tolerance=0.0)


def test_a_loop_is_not_interpolated_but_its_backbone_is():
    q = np.concatenate([np.linspace(0, 4, 9), np.linspace(4, -2, 13)[1:]])
    curve = Curve("axial", q, response(q), np.arange(len(q)))
    with pytest.raises(ValueError, match="back and forth"):
        curve.at(1.0)
    backbone = curve.backbone()
    assert len(backbone.displacement) == 13
    assert backbone.time is None
    # Spline through 13 exact points at a spacing of 0.5: the fourth derivative 9.6 q bounds the error by h^4.
    assert backbone.at(1.25) == pytest.approx(response(1.25), abs=5 / 384 * 9.6 * 4 * 0.5**4)
    assert curve.part(0, 9).at(1.0) == pytest.approx(response(1.0))


@pytest.mark.parametrize(
    "q",
    [
        np.linspace(0, 6, 21),
        np.linspace(0, -6, 21),
        np.concatenate([np.linspace(0, 6, 40), np.linspace(6, -6, 80)[1:], np.linspace(-6, 0, 40)[1:]]),
    ],
)
def test_stiffness_of_an_exact_curve(q):
    curve = Curve("axial", q, response(q))
    # The term 0.08 q^5, which a cubic lacks, is below 0.1 % of the slope within 15 % or five points of the range.
    assert curve.initial_stiffness() == pytest.approx(200, rel=1e-3)
    # Means over the last 1 % of the range move the chord by less than 1 % of its change, here 3 N/mm per mm.
    assert curve.secant_stiffness() == pytest.approx(195.68, rel=2e-3)


def test_the_initial_stiffness_ignores_an_offset():
    q = np.linspace(0, 6, 21)
    assert Curve("axial", q, response(q) + 50).initial_stiffness() == pytest.approx(200, rel=1e-3)


def test_initial_stiffness_is_of_the_first_loading():
    """The curve is softer in the second cycle; only the first counts."""
    leg = np.linspace(0, 4, 41)
    q = np.concatenate([leg, leg[::-1][1:], leg[1:], leg[::-1][1:]])
    force = np.where(np.arange(len(q)) < 41, 200 * q, 120 * q)
    assert Curve("axial", q, force).initial_stiffness() == pytest.approx(200, rel=1e-9)
    # The peak is met twice, at 800 and at 480 N: their mean over 4 mm.
    assert Curve("axial", q, force).secant_stiffness() == pytest.approx(640 / 4)


@pytest.mark.parametrize("mode", ["axial", "conical"])
def test_stiffness_of_noisy_cycles(mode):
    """Cycles of growing amplitude with noise of 0.3 % of the peak, as from a load cell, and an outlier."""
    corners = [0, 2, 0, 4, 0, 6, 0, -5, 0]
    q = np.concatenate([np.linspace(a, b, 40 * abs(b - a))[1:] for a, b in pairwise(corners)])
    initial, secant = [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        force = response(q) + 3.5 * rng.normal(size=len(q))
        force[10] += 200.0
        curve = Curve(mode, q + 3e-3 * rng.normal(size=len(q)), force)
        initial.append(curve.initial_stiffness())
        secant.append(curve.secant_stiffness())
    exact = (response(6.0) - response(-5.0)) / 11.0
    # The rule stops at a standard error of 1 % at most: four times that is allowed for each, a third of that for the
    # mean of twenty.
    np.testing.assert_allclose(initial, 200, rtol=0.04)
    assert np.mean(initial) == pytest.approx(200, rel=0.01)
    np.testing.assert_allclose(secant, exact, rtol=0.01)


def test_initial_stiffness_of_a_coupon_is_its_youngs_modulus():
    """Incompressible neo-Hookean rubber in tension, mu = 0.4 MPa: slope 3 mu at rest."""
    stretch = np.linspace(1.0, 1.5, 26)
    curve = Curve("uniaxial", stretch - 1, 0.4 * (stretch - stretch**-2))
    # The parabola leaves out the third derivative, -24 mu: at 20 % of the strain some per cent of the slope.
    assert curve.initial_stiffness() == pytest.approx(1.2, rel=0.03)


#: Responses of stiffness 200 at rest, over a travel of 1.
SHAPES = {
    "cubic": lambda q: 200 * q * (1 + q**2),
    "quintic": lambda q: 200 * q * (1 + 0.3 * q**2 + 2 * q**4),
    "stop": lambda q: 200 * q * (1 + 20 * q**6),
    "tangent": lambda q: 440 / np.pi * np.tan(np.pi * q / 2.2),
    "softening": lambda q: 120 * np.tanh(q / 0.6),
}


@pytest.mark.parametrize("kind", [Curve, ExactCurve])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("steps", [3, 4, 6, 10, 20, 40])
def test_a_coarse_curve_at_equal_forces_has_the_right_initial_stiffness_or_none(kind, shape, steps):
    """Equal steps of force begin with a large step of displacement where the response stiffens."""
    fine = np.linspace(0.0, 1.0, 20_001)
    force = SHAPES[shape](fine)
    at = np.linspace(0.0, force[-1], steps + 1)
    found = kind("axial", np.interp(at, force, fine), at).initial_stiffness()
    assert math.isnan(found) or found == pytest.approx(200, rel=0.03)
    if steps >= 10 and shape in ("cubic", "softening"):
        assert not math.isnan(found)


@pytest.mark.parametrize("points", [20, 40, 120])
@pytest.mark.parametrize("shape", SHAPES)
def test_noise_does_not_widen_the_window_into_what_the_polynomial_leaves_out(shape, points):
    """Cycles with noise of 0.3 % of the peak: windows up to 60 % of the travel were fitted by one cubic term."""
    corners = [0.0, 1.0, 0.0, 1.0, 0.0, -0.8, 0.0]
    legs = [np.linspace(a, b, int(points * abs(b - a)) + 1)[1:] for a, b in pairwise(corners)]
    q = np.concatenate([[0.0], *legs])
    exact = np.sign(q) * SHAPES[shape](np.abs(q))
    found = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        force = exact + 3e-3 * SHAPES[shape](1.0) * rng.normal(size=len(q))
        found.append(Curve("axial", q + 1e-3 * rng.normal(size=len(q)), force).initial_stiffness() / 200 - 1)
    known = np.array(found)[~np.isnan(found)]
    # The largest error that an initial stiffness may have by its own account is 10 %.
    assert len(known) == 0 or np.sqrt(np.mean(known**2)) < 0.1
    assert len(known) >= 6 or shape == "stop" or points < 40


def test_a_coarse_curve_of_an_elastic_stop_has_no_initial_stiffness():
    # Four equal steps of force: the first goes to 0.81 of the travel, and a cubic through it had -2880 N/mm at rest.
    q = np.array([0.0, 0.8077, 0.8962, 0.9539, 1.0])
    assert math.isnan(ExactCurve("axial", q, SHAPES["stop"](q)).initial_stiffness())


@pytest.mark.parametrize(
    ("mode", "slope", "power", "furthest"), [("planar", 3.2, 3, 1.5), ("uniaxial", 2.4, 2, -0.5)]
)
def test_ten_steps_of_a_coupon_have_the_slope_at_rest(mode, slope, power, furthest):
    """Gent rubber, mu = 0.8 MPa, Jm = 30."""
    q = np.linspace(0.0, furthest, 11)
    stretch = 1.0 + q
    first = stretch**2 + (1.0 + stretch**-2 if power == 3 else 2.0 / stretch) - 3.0
    force = 0.8 * 30.0 / (30.0 - first) * (stretch - stretch**-power)
    assert ExactCurve(mode, q, force).initial_stiffness() == pytest.approx(slope, rel=2e-3)


def test_stiffness_of_two_points():
    curve = Curve("axial", np.array([0.0, 2.0]), np.array([1.0, 7.0]))
    assert curve.initial_stiffness() == pytest.approx(3.0)
    assert curve.secant_stiffness() == pytest.approx(3.0)


def test_stiffness_of_a_standstill_is_nan():
    curve = Curve("axial", np.ones(6), np.arange(6.0))
    assert math.isnan(curve.initial_stiffness())
    assert math.isnan(curve.secant_stiffness())


def test_the_initial_stiffness_is_that_of_a_branch_that_comes_near_rest():
    # 100 N/mm; the record begins at 1.9 of 2 mm, so that its first loading branch is far from rest.
    angle = np.linspace(0.4 * np.pi, 6.5 * np.pi, 600)
    force = 200.0 * np.sin(angle) + 1.0 * np.sin(37.0 * angle)
    found = Curve("axial", 2.0 * np.sin(angle), force, np.linspace(0.0, 60.0, 600))
    assert found.initial_stiffness() == pytest.approx(100.0, rel=0.05)


def test_a_record_that_never_comes_near_rest_has_no_initial_stiffness():
    q = 8.0 + np.sin(np.linspace(0.0, 4.0 * np.pi, 200))
    assert np.isnan(Curve("axial", q, 100.0 * q, np.linspace(0.0, 4.0, 200)).initial_stiffness())
