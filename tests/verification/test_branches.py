"""Path-dependent branches against closed forms and an independently integrated ordinary differential equation.

All in a coupon in tension at stretch x, incompressible: C = diag(x^2, 1/x, 1/x), C' = C. With a slider or dashpot
Ci = diag(c, c^(-1/2), c^(-1/2)) the spring g mu / 2 (tr(C' Ci^-1) - 3) adds the nominal stress
g mu (x / c - c^(1/2) / x^2).
"""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import erf

from cases.feature import Feature, Installed
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import prepare
from forms.branch import branches
from forms.potential import Attached
from geometry.shape import shapes

MU, G, TAU, SLIP = 1.0, 0.5, 4.0, 0.08
SHARP = 1e-12


@pytest.fixture(scope="module")
def coupon(rubber):
    """Return a function from branch and law to a coupon in tension with and without the branch."""

    @cache
    def make(name, law="neo_hookean"):
        feature = Feature(branches=lambda values: [Attached(branches()[name], values)])
        parts = [Installed("b", feature, branches()[name].typical)] if name else []
        return prepare(shapes()["coupon"](), modes()["uniaxial"], rubber(law, np.inf), features=parts)

    return make


def stress(model, q, time=None, **values):
    """Nominal stress (MPa) along a path, and the part that the branch adds to the neo-Hookean law."""
    model.set_parameters({f"b.{key}": value for key, value in values.items()})
    history = march(model, Program(np.asarray(q, dtype=float), time), tolerance=SHARP)
    x = 1 + history.displacement
    return history.force, history.force - MU * (x - x**-2)


# -- Ogden and Roxburgh ---------------------------------------------------------------------------------------------


def test_softened_tension_is_the_formula_of_ogden_and_roxburgh(coupon):
    """Load, unload, reload beyond the first peak, unload into compression, with Yeoh's law written out here."""
    inverse_r, m, beta = 0.4, 0.07, 0.2
    legs = [(0, 0.6), (0.6, 0.0), (0.0, 1.0), (1.0, -0.3), (-0.3, 1.2)]
    q = np.concatenate([np.linspace(a, b, 14)[1:] for a, b in legs])
    found, _ = stress(coupon("ogden_roxburgh", "yeoh"), q, inverse_r=inverse_r, m=m, beta=beta)
    x, (C10, C20, C30) = 1 + q, (0.5, -0.05, 0.01)
    I1 = x**2 + 2 / x - 3  # less 3
    W = C10 * I1 + C20 * I1**2 + C30 * I1**3
    virgin = 2 * (C10 + 2 * C20 * I1 + 3 * C30 * I1**2) * (x - x**-2)
    peak = np.maximum.accumulate(W)
    eta = 1 - inverse_r * erf((peak - W) / (m + beta * peak))
    assert eta.min() < 0.65
    np.testing.assert_allclose(found, eta * virgin, rtol=1e-7, atol=1e-8)


# -- Maxwell --------------------------------------------------------------------------------------------------------

# Ramp to 60 %, hold, unload to -10 %, hold; s.
CORNERS = np.array([0.0, 0.6, 0.6, -0.1, -0.1])
TIMES = np.array([0.0, 3.0, 9.0, 11.0, 20.0])


@cache
def integrated(count):
    """Branch stress from the evolution equation of the dashpot, at `count` points per leg."""

    def stretch(t):
        return 1 + np.interp(t, TIMES, CORNERS)

    def rate(t, y):
        (c,), x = y, stretch(t)
        trace = x**2 / c + 2 * np.sqrt(c) / x
        return [(x**2 - trace * c / 3) / TAU]

    c, found = 1.0, []
    for begin, end in itertools.pairwise(TIMES):
        at = np.linspace(begin, end, count + 1)[1:]
        solution = solve_ivp(rate, (begin, end), [c], "DOP853", at, rtol=1e-12, atol=1e-13)
        x = stretch(at)
        found.append(G * MU * (x / solution.y[0] - np.sqrt(solution.y[0]) / x**2))
        c = solution.y[0, -1]
    return np.concatenate(found)


def maxwell_error(model, steps, compared=4):
    """Largest error at the same points of each leg, relative to the largest branch stress."""
    time = np.concatenate([np.linspace(a, b, steps + 1)[1:] for a, b in itertools.pairwise(TIMES)])
    _, found = stress(model, np.interp(time, TIMES, CORNERS), time, g=G, tau=TAU)
    each = steps // compared
    exact = integrated(compared)
    return np.abs(found[each - 1 :: each] - exact).max() / np.abs(exact).max()


def test_maxwell_stress_converges_to_the_integrated_one_with_the_square_of_the_step(coupon):
    steps = np.array([8, 16, 32, 64])
    errors = np.array([maxwell_error(coupon("maxwell"), n) for n in steps])
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.all((orders > 1.9) & (orders < 2.1))
    assert errors[0] < 0.01


@pytest.mark.parametrize("share", [0.003, 0.3, 1.0, 3.0, 15.0])
def test_small_strain_relaxes_exponentially_at_any_step(share, coupon):
    """A sudden strain of +-1e-4, averaged so that the square drops out; steps of 0.003 to 15 relaxation times."""
    since = share * TAU * np.arange(6)
    added = {}
    for sign in (1, -1):
        _, added[sign] = stress(coupon("maxwell"), np.full(6, sign * 1e-4), 5.0 + since, g=G, tau=TAU)
    found = (added[1] - added[-1]) / 2
    np.testing.assert_allclose(found, 3 * G * MU * 1e-4 * np.exp(-since / TAU), rtol=1e-6, atol=3e-10 * G)


@pytest.mark.parametrize("share", [0.01, 0.1, 1.0, 10.0, 100.0, 1000.0])
def test_no_step_is_too_long_for_a_maxwell_branch(share, coupon):
    """Cycles in steps of 0.01 to 1000 relaxation times: the branch is a spring if fast, a thin fluid if slow."""
    q = np.array([0.5, 1.0, 0.3, -0.4, 0.2, 1.0, 0.0])
    q, time = np.append(0.0, q), share * TAU * np.arange(8.0)
    _, added = stress(coupon("maxwell"), q, time, g=G, tau=TAU)
    x = 1 + q
    elastic = G * MU * (x - x**-2)
    assert np.abs(added).max() < 2.5 * np.abs(elastic).max()
    if share == 0.01:
        np.testing.assert_allclose(added, elastic, atol=0.06 * np.abs(elastic).max())
    if share == 1000.0:
        np.testing.assert_allclose(added, 0.0, atol=0.004 * np.abs(elastic).max())


def test_steady_stretching_meets_viscous_stress(coupon):
    """When stretched far slower than it relaxes, the branch is a fluid: a true stress of 3 g mu tau times the rate."""
    rate = 1e-4 / TAU
    time = 200 * TAU * np.arange(26.0)
    q = np.expm1(rate * time)
    _, added = stress(coupon("maxwell"), q, time, g=G, tau=TAU)
    # Each step of 2 % takes 200 relaxation times: first order in the rate times tau and the step, at most 2 %.
    np.testing.assert_allclose(added[1:] * (1 + q[1:]), 3 * G * MU * TAU * rate, rtol=2e-2)


# -- elastoplastic --------------------------------------------------------------------------------------------------


def test_below_the_slip_strain_the_slider_is_a_spring(coupon):
    """In tension it yields at a true stress of sqrt(3) g mu slip; up to 98 % of that nothing slips."""
    q = np.array([0.3, 0.6, 0.98, 0.2, -0.5, -0.98, 0.0]) * SLIP / np.sqrt(3)
    _, added = stress(coupon("elastoplastic"), q, g=G, slip=SLIP)
    x = 1 + q
    np.testing.assert_allclose(added, G * MU * (x - x**-2), rtol=1e-8, atol=1e-11)


def test_slipping_stress_converges_with_the_step(coupon):
    """Beyond yield the true stress stays at +-sqrt(3) g mu slip, at any strain."""
    steps, errors = np.array([16, 32, 64, 128]), []
    for n in steps:
        q = np.concatenate([np.linspace(0, 0.6, n + 1)[1:], np.linspace(0.6, 0.0, n + 1)[1:]])
        _, added = stress(coupon("elastoplastic"), q, g=G, slip=SLIP)
        bound = np.sqrt(3) * G * MU * SLIP
        errors.append([added[n - 1] * 1.6 / bound - 1, -added[-1] / bound - 1])
    errors = np.abs(errors)
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.all((orders > 0.9) & (orders < 1.1))
    assert np.all(errors[-1] < 2e-3)


def test_small_strain_cycles_are_those_of_a_spring_behind_a_slider(coupon):
    """The return map of one-dimensional elastoplasticity, over the mean of +- the path, slip strain 1e-4."""
    slip = 1e-4
    path = (
        np.array([0.8, 1.7, 2.6, 1.9, 0.7, -0.4, -1.5, -2.6, -1.8, -0.7, 0.5, 2.6, 3.5, 3.5])
        * slip
        / np.sqrt(3)
    )
    limit, elastic, expected, last = np.sqrt(3) * G * MU * slip, 0.0, [], 0.0
    for e in path:
        elastic = np.clip(elastic + 3 * G * MU * (e - last), -limit, limit)
        last = e
        expected.append(elastic)
    added = {s: stress(coupon("elastoplastic"), s * path, g=G, slip=slip)[1] for s in (1, -1)}
    found = (added[1] - added[-1]) / 2
    # The last step ends exactly at the knee, which is rounded over 1 % of the slip strain: a quarter of that slips.
    np.testing.assert_allclose(found[:-1], expected[:-1], rtol=0, atol=1e-6 * limit)
    assert found[-1] == pytest.approx(expected[-1], rel=3e-3)


def test_the_loop_is_that_of_a_slider_at_every_rate(coupon):
    """Area per volume 4 s (e - s / (3 g mu)), s = sqrt(3) g mu slip, for cycles of small strain to +-e."""
    slip, e = 1e-3, 4e-3
    corners = [0, e, -e, e]
    q = np.concatenate([np.linspace(a, b, 161)[1:] for a, b in itertools.pairwise(corners)])
    model = coupon("elastoplastic")
    areas = []
    for rate in (1e-6, 1e3):
        time = np.cumsum(np.abs(np.diff(q, prepend=0.0))) / rate
        _, added = stress(model, q, time, g=G, slip=slip)
        loop = slice(159, None)
        areas.append(np.trapezoid(added[loop], q[loop]))
    s = np.sqrt(3) * G * MU * slip
    assert areas[0] == pytest.approx(areas[1], rel=1e-12)
    # Steps of a tenth of the slip strain: the trapezoid cuts corners, the knee is rounded.
    assert areas[0] == pytest.approx(4 * s * (e - s / (3 * G * MU)), rel=1e-2)
