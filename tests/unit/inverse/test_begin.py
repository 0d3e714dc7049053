"""The first point of a search: at the right scale, stable, solvable."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bushcli.inverse.bounds import Bounds
from bushcli.inverse.start_values import SOLVED, first_point, fit_scale, fit_sizes, is_stable, own_start
from forms.law import law

LOWER, UPPER = np.array([1e-6, -100.0, -100.0]), np.array([1e3, 100.0, 100.0])
TRUTH = np.array([0.5, -0.04, 0.007])


class Channel:
    """Yeoh's law in simple shear, nearly a bushing, or as a coupon: force = 2 C10 q + 4 C20 q^3 + 6 C30 q^5."""

    def __init__(self, coupon):
        self.coupon = coupon
        q = np.linspace(0.05, 1.0, 20)
        self.slope = np.column_stack([2 * q, 4 * q**3, 6 * q**5])
        self.scale = np.full(20, 0.01)
        self.measured = self.slope @ TRUTH


class Problem:
    """The parts of a problem that `first_point` uses; the solution fails where `unsolvable(x)` is true."""

    names = ("C10", "C20", "C30")

    def __init__(self, coupon=False, unsolvable=lambda x: False, fixed=None):
        self.law, self.unsolvable, self.fixed = law("yeoh"), unsolvable, fixed or {}
        self.channels, self.asked = [Channel(coupon)], []
        self.bounds = Bounds(LOWER, UPPER)
        stretch = np.linspace(0.6, 1.7, 12)
        self.states = np.column_stack([stretch, np.ones(12), 1 / stretch])

    def parameters(self, x):
        return {**self.fixed, **dict(zip(self.names, x, strict=True))}

    law_parameters = parameters

    def forces(self, x):
        self.asked.append(x)
        return None if self.unsolvable(x) else [(c.slope @ x, c.slope) for c in self.channels]

    def cost(self, x):
        found = self.forces(x)
        if found is None:
            return float("nan")
        return sum(
            float(np.mean((f - c.measured) ** 2)) for (f, _), c in zip(found, self.channels, strict=True)
        )


@pytest.mark.parametrize("factor", [1e-4, 0.1, 1.0, 10.0, 1e3])
def test_a_common_factor_is_taken_out_at_once(factor):
    problem = Problem()
    found, instead = first_point(problem, factor * TRUTH)
    assert found == pytest.approx(TRUTH, rel=1e-9)
    assert instead is None
    assert len(problem.asked) <= 3


def test_in_a_bushing_the_ratios_stay_in_a_coupon_they_are_found():
    start = np.array([5.0, -0.4, 0.5])
    shaped = fit_scale(Problem(), start)
    assert shaped / shaped[0] == pytest.approx(start / start[0])
    # Least squares of one factor, by hand.
    channel = Channel(False)
    force = channel.slope @ start
    assert shaped[0] / start[0] == pytest.approx(force @ channel.measured / (force @ force))
    assert fit_scale(Problem(coupon=True), start) == pytest.approx(TRUTH, rel=1e-6)


def test_an_unstable_start_is_not_solved_but_mixed_with_the_laws_own():
    problem = Problem()
    start = np.array([0.5, -0.4, 0.007])
    assert not is_stable(problem, start)
    found, instead = first_point(problem, start)
    assert is_stable(problem, found)
    assert not any(np.array_equal(x, start) for x in problem.asked)
    # Part of the given shape is kept: the point lies between the law's own start and the given one.
    own = own_start(problem, start)
    assert start[1] / start[0] < instead[1] / instead[0] <= own[1] / own[0]


def test_a_stable_start_that_cannot_be_solved_is_given_up_step_by_step():
    """Only small ratios C20 / C10 can be solved: the solvable point nearest to the start is taken."""
    start = np.array([0.5, 0.2, 0.0])
    problem = Problem(unsolvable=lambda x: x[1] > 0.1 * x[0])
    assert is_stable(problem, start)
    found, instead = first_point(problem, start)
    assert instead is not None
    assert np.array_equal(problem.asked[0], start)
    ratios = [x[1] / x[0] for x in problem.asked]
    assert ratios[0] > ratios[1]
    assert found[1] / found[0] <= 0.1


@pytest.mark.parametrize("corner", [(0, 0, 0), (0, 1, 0), (1, 0, 1), (1, 1, 1)], ids=str)
def test_from_the_bounds_there_is_a_stable_point_at_the_right_scale(corner):
    problem = Problem()
    found, _ = first_point(problem, np.where(corner, UPPER, LOWER))
    assert is_stable(problem, found)
    assert problem.cost(found) < np.mean(problem.channels[0].measured ** 2)


def test_where_nothing_can_be_solved_the_start_comes_back():
    problem = Problem(unsolvable=lambda x: True)
    found, instead = first_point(problem, TRUTH)
    assert found == pytest.approx(TRUTH)
    assert instead is None
    assert len(problem.asked) <= SOLVED + 1


def test_with_a_fixed_coefficient_there_is_no_scale_to_take_out():
    class Two(Problem):
        names = ("C10", "C20")

        def forces(self, x):
            return super().forces(np.append(x, self.fixed["C30"]))

    problem = Two(fixed={"C30": 0.007})
    start = np.array([5.0, -0.4])
    assert fit_scale(problem, start) == pytest.approx(start)


def test_locking_laws_get_room_to_stretch():
    """Gent's Jm shapes the curve and is no scale: it is enlarged until there is a solution."""

    class Gent(Problem):
        names = ("mu", "Jm")

        def forces(self, x):
            self.asked.append(x)
            return None if x[1] < 5.0 else [(c.slope[:, 0] * x[0], c.slope[:, :2]) for c in self.channels]

    problem = Gent()
    problem.law, problem.bounds = law("gent"), Bounds(np.array([1e-6, 0.1]), np.array([1e3, 1e3]))
    found, instead = first_point(problem, np.array([1.0, 0.9]))
    assert found[1] >= 5.0
    assert instead is not None


class WithEffect(Problem):
    """The same bushing on a rig that takes a share k q of each force."""

    names = ("C10", "C20", "C30", "rig.k")
    stopping = SimpleNamespace(tolerance=1e-9)
    truth = np.array([0.8, -0.08, 0.016, 0.3])

    def __init__(self, **given):
        super().__init__(**given)
        self.bounds = Bounds(np.append(LOWER, 0.0), np.append(UPPER, 1.0))

    def _parts(self, x):
        (channel,) = self.channels
        q = channel.slope[:, 0] / 2
        return channel.slope, q, channel.slope @ x[:3]

    def law_parameters(self, x):
        return dict(zip(self.names[:3], x[:3], strict=True))

    def residual(self, x):
        self.asked.append(x)
        _, q, force = self._parts(x)
        _, _, wanted = self._parts(self.truth)
        found = force * (1 - x[3] * q) - wanted * (1 - self.truth[3] * q)
        return np.full(20, np.nan) if self.unsolvable(x) else found

    def jacobian(self, x):
        slope, q, force = self._parts(x)
        return np.column_stack([slope * (1 - x[3] * q)[:, None], -force * q])

    def cost(self, x):
        return float(np.mean(self.residual(x) ** 2))


def test_an_effect_finds_its_size_while_the_law_keeps_its_shape():
    start = np.append(0.5 * WithEffect.truth[:3], 0.01)
    problem = WithEffect()
    assert fit_sizes(problem, start, 1e-3) == pytest.approx(problem.truth, rel=1e-4)
    # The shape is kept where another would fit better, too.
    shaped = np.array([0.5, -0.01, 0.03, 0.01])
    found = fit_sizes(problem, shaped)
    assert found[:3] / found[0] == pytest.approx(shaped[:3] / shaped[0])
    assert problem.cost(found) < 0.1 * problem.cost(shaped)


def test_what_cannot_be_solved_is_not_returned():
    start = np.append(WithEffect.truth[:3], 0.01)
    problem = WithEffect(unsolvable=lambda x: x[3] > 0.2)
    found = fit_sizes(problem, start)
    assert 0.01 < found[3] <= 0.2
    assert problem.cost(found) < problem.cost(start)
    nowhere = WithEffect(unsolvable=lambda x: x[3] > 0.0101)
    assert fit_sizes(nowhere, start) == pytest.approx(start)


def test_a_shortened_step_that_gains_little_is_the_last():
    """Full steps overshoot: a quarter of each lowers the misfit by a few per cent, although much more was promised."""

    class Overshoots(WithEffect):
        def jacobian(self, x):
            return np.array([0.0, 0.0, 0.0, 0.05]) * super().jacobian(x)

        def cost(self, x):
            return 1.0 - 0.2 * x[3] if x[3] < 0.9 else 2.0

    problem = Overshoots()
    start = np.append(WithEffect.truth[:3], 0.01)
    found = fit_sizes(problem, start)
    assert found[3] == pytest.approx(0.01 + 0.25 * 0.99)
    assert len(problem.asked) == 1


def test_a_best_size_stays():
    problem = WithEffect()
    assert fit_sizes(problem, problem.truth) == pytest.approx(problem.truth, rel=1e-12)
    assert len(problem.asked) == 1
