"""Relaxation whose rate grows with a power of the overstress, against closed forms and a one-dimensional integration.

In small tension e the amount of local shear is sqrt(3) e, and the stress of a branch 3 g mu times what is left of e.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bushcli.effects.effect import effect
from cases.feature import Installed
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import prepare
from forms.branches.activated import STRAIN
from geometry.shape import Refinement, shapes

G, MU = 0.3, 1.0  # the latter of LAWS["yeoh"] in tests/conftest.py
# Ramp, hold, reversal to the other side at another rate, and back.
CORNERS = 0.01 * np.array([0.0, 1.0, 1.0, -0.8, 0.6])
AT = np.array([0.0, 5.0, 60.0, 64.0, 90.0])
# At 2 % the branch then relaxes in some seconds.
VALUES = {0.05: 4.0, 1.0: 0.4, 3.0: 4e-3}


@pytest.fixture(scope="module")
def coupon(rubber):
    values = {"g1": G, "tau1": 1.0, "exponent": 1.0}
    features = [Installed("v", effect("viscoelasticity").feature(), values)]
    return prepare(
        shapes()["coupon"](),
        modes()["uniaxial"],
        rubber("yeoh", np.inf),
        Refinement(2, 4, 8),
        features=features,
    )


def overstress(coupon, e, time, **values):
    """Shear of the branch's spring at small strains, (n,): the mean over +-e drops the squares."""
    coupon.set_parameters({f"v.{name}": value for name, value in values.items()})
    forces = []
    for g in (G, 0.0):
        coupon.set_parameters({"v.g1": g})
        up, down = (march(coupon, Program(sign * e, time), tolerance=1e-12).force for sign in (1, -1))
        forces.append((up - down) / 2)
    return (forces[0] - forces[1]) / (3 * G * MU) * np.sqrt(3)


@pytest.mark.parametrize("exponent", VALUES)
def test_loops_and_holds_converge_to_the_law_in_one_dimension_with_the_square_of_the_step(exponent, coupon):
    tau, exact = VALUES[exponent], [0.0]
    for (a, b), (begin, end) in zip(pairwise(CORNERS), pairwise(AT), strict=True):
        rate = np.sqrt(3) * (b - a) / (end - begin)

        def slope(_, f, rate=rate):
            return rate - f * (np.abs(f) / STRAIN) ** exponent / tau

        leg = solve_ivp(slope, (0.0, end - begin), exact[-1:], method="LSODA", rtol=1e-9, atol=1e-13)
        exact.append(leg.y[0, -1])
    errors = []
    for count in (4, 8, 16):
        e = np.concatenate([np.linspace(a, b, count + 1)[1:] for a, b in pairwise(CORNERS)])
        time = np.concatenate([np.linspace(a, b, count + 1)[1:] for a, b in pairwise(AT)])
        found = overstress(coupon, e, time, tau1=tau, exponent=exponent)[count - 1 :: count]
        errors.append(np.abs(found - exact[1:]).max() / np.abs(exact).max())
    assert errors[-1] < 2e-3
    assert errors[0] > 6.0 * errors[-1]


def test_a_hold_is_exact_at_any_step(coupon):
    """f = f0 (1 + n (t / tau) (f0 / STRAIN)^n)^(-1 / n), in one step and in many."""
    e, n, tau = 0.005, 3.0, 1e-4
    for times in ([100.0], np.geomspace(0.1, 100.0, 12)):
        times = np.asarray(times)
        found = overstress(coupon, np.full(len(times) + 1, e), np.append(1e-9, times), tau1=tau, exponent=n)
        f0 = np.sqrt(3) * e
        expected = f0 * (1 + n * times / tau * (f0 / STRAIN) ** n) ** (-1 / n)
        assert found[1:] == pytest.approx(expected, rel=2e-3)


def test_the_stress_of_steady_motion_grows_with_a_small_power_of_the_rate(coupon):
    """f' = 0: f^(1 + n) is proportional to the rate, over three decades of it."""
    n, end, steady = 3.0, 0.02, []
    for rate in (0.1, 3.0, 90.0):
        e = np.linspace(0.0, end, 129)[1:]
        steady.append(overstress(coupon, e, e / (rate * end), tau1=1e-7, exponent=n)[-1])
    assert np.diff(np.log(steady)) == pytest.approx(np.log(30.0) / (1 + n), rel=0.01)


@pytest.mark.parametrize("tau", [0.5, 5.0, 20.0])
def test_a_bushing_with_the_steps_of_a_fit_is_at_its_limit(tau, rubber):
    """Within 0.2 % of the force, about as with a Maxwell branch; without parts it was 1 %."""
    features = [Installed("v", effect("viscoelasticity").feature(), {"g1": G, "tau1": tau, "exponent": 3.0})]
    shape = shapes()["plain"](inner_radius=9.0, outer_radius=18.0, length=30.0)
    model = prepare(shape, modes()["axial"], rubber("yeoh", 500.0), Refinement(2, 4), features=features)
    corners, at = np.array([0.0, 2.5, -2.5, 5.0, 5.0, -5.0, 5.0]), np.array([0, 2, 6, 12, 32, 40, 40.8])

    def force(count):
        q, time = [], []
        for (a, b), (begin, end) in zip(pairwise(corners), pairwise(at), strict=True):
            share = np.linspace(0.0, 1.0, max(round(count * (abs(b - a) / 10.0 or 1.0)), 3) + 1)[1:]
            share = share**1.3 if a != b else (end - begin) ** (share - 1.0)
            q, time = [*q, *(a + (b - a) * share)], [*time, *(begin + (end - begin) * share)]
        return np.array(time), march(model, Program(np.array(q), np.array(time)), tolerance=1e-9).force

    (time, found), (fine, limit) = force(12), force(96)
    error = found - np.interp(time, fine, limit)
    assert np.abs(error).max() < 2e-3 * np.abs(limit).max()


def test_a_large_exponent_in_three_dimensions(rubber):
    """Nearly friction: the march converges, and its slopes are those of differences."""
    values = {"g1": G, "tau1": 1.0, "exponent": 9.0}
    features = [Installed("v", effect("viscoelasticity").feature(), values)]
    shape = shapes()["plain"](inner_radius=9.0, outer_radius=18.0, length=20.0)
    model = prepare(shape, modes()["radial"], rubber("yeoh", 500.0), Refinement(2, 4, 8), features=features)
    q, time = np.array([0.7, 1.5, 1.5, 0.4, -0.8]), np.array([1.0, 2.0, 9.0, 10.0, 12.0])

    def solved(exponent, names=()):
        model.set_parameters({"v.exponent": exponent})
        return march(model, Program(q, time), tolerance=1e-11, sensitivity=names)

    slope = solved(9.0, ("v.exponent",)).sensitivity[:, 0]
    two = (solved(9.001).force - solved(8.999).force) / 0.002
    np.testing.assert_allclose(slope, two, rtol=0, atol=1e-4 * np.abs(two).max())
