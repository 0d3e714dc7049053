"""A model begins from the optimum of each model that it contains, and never ends above it."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from bushcli.inverse.bounds import Bounds
from bushcli.inverse.channel import ChannelForces, StepLimit
from bushcli.inverse.contained import Contained, ContainedPart, from_contained
from bushcli.inverse.minimum_search import search
from bushcli.inverse.problem import LeastSquaresProblem, coupon_states
from forms.law import law

TIMES = np.geomspace(0.1, 100.0, 120)


class Relaxation:
    """A stress that relaxes after a step: C10 (1 + sum of g exp(-t / tau))."""

    name, coupon, comm = "relaxation", True, MPI.COMM_SELF

    def __init__(self, branches, noise=1e-3):
        self.measured = 0.3 * (1.0 + sum(g * np.exp(-TIMES / tau) for g, tau in branches))
        self.measured += noise * np.random.default_rng(2).standard_normal(len(TIMES))
        self.scale = np.full(len(TIMES), noise)

    def solve(self, parameters, names, limit=None):
        c = parameters["C10"]
        force, slopes = np.full(len(TIMES), c), {"C10": np.ones(len(TIMES))}
        for i in (n.removeprefix("g") for n in parameters if n.startswith("g")):
            g, tau = parameters[f"g{i}"], parameters[f"tau{i}"]
            gone = np.exp(-TIMES / tau)
            force += c * g * gone
            slopes[f"g{i}"], slopes[f"tau{i}"] = c * gone, c * g * gone * TIMES / tau**2
            slopes["C10"] += g * gone
        return ChannelForces(TIMES, force, np.column_stack([slopes[name] for name in names]))

    def at_samples(self, answer):
        return answer.force, answer.slope

    def reached_stretches(self, parameters, answer, limit):
        return np.zeros((0, 3))


def posed(count, branches):
    names = ["C10", *(f"{stem}{i}" for i in range(1, count + 1) for stem in ("g", "tau"))]
    bounds = Bounds(
        np.array([1e-6 if n == "C10" else 0.0 if n.startswith("g") else 1e-3 for n in names]),
        np.array([1e3 if n == "C10" else 10.0 if n.startswith("g") else 1e6 for n in names]),
        np.array([n.startswith("tau") for n in names]),
    )
    states = coupon_states((0.8, 1.2))
    problem = LeastSquaresProblem(
        [Relaxation(branches)], law("neo_hookean"), names, {}, bounds, states, limits=[StepLimit()]
    )
    every = [
        ContainedPart(
            (f"g{i}", f"tau{i}"),
            {f"g{i}": 0.0},
            {f"tau{i}": (0.3, 3.0, 30.0)},
            "viscoelasticity",
            {f"{stem}{i}": f"{stem}{i - 1}" for stem in ("g", "tau")} if i > 1 else {},
        )
        for i in range(1, count + 1)
    ]
    start = np.array([0.5, *[0.1, 1.0] * count])
    return problem, every, start


def test_a_part_of_a_problem_has_the_rows_and_derivatives_of_the_whole():
    problem, _, start = posed(2, [(0.5, 1.0), (0.4, 30.0)])
    x = start * 1.1
    part = Contained(problem, x, ["C10", "tau2"])
    y = x[part.free]
    assert part.names == ("C10", "tau2")
    assert part.residual(y) == pytest.approx(problem.residual(x))
    assert part.jacobian(y) == pytest.approx(problem.jacobian(x)[:, part.free])
    assert part.parameters(y) == problem.parameters(x)
    assert part.cost(y + np.array([0.1, 0.0])) == problem.cost(
        x + part.all_of(np.array([0.1, 0.0])) * part.free
    )


@pytest.mark.parametrize(
    "branches", [[(0.5, 1.0)], [(0.5, 1.0), (0.4, 30.0)], [(0.3, 0.5), (0.3, 4.0), (0.3, 40.0)]]
)
def test_a_branch_more_never_fits_worse(branches):
    """From equal branches a search from one start does not find what tells them apart."""
    reached = []
    for count in (1, 2, 3):
        problem, every, start = posed(count, branches)
        found = from_contained(problem, start, every=every)
        assert found.converged
        reached.append(found.cost)
    assert reached == sorted(reached, reverse=True)
    # The true number of branches leaves the noise.
    assert reached[len(branches) - 1] == pytest.approx(1.0, abs=0.25)


def test_no_start_of_ten_is_better():
    branches = [(0.5, 1.0), (0.4, 30.0)]
    problem, every, start = posed(2, branches)
    found = from_contained(problem, start, every=every)
    rng = np.random.default_rng(7)
    for _ in range(10):
        other = np.array(
            [0.5, *np.ravel([(rng.uniform(0.05, 1.0), 10 ** rng.uniform(-1, 2)) for _ in range(2)])]
        )
        assert found.cost <= search(posed(2, branches)[0], other).cost * (1 + 1e-6)


def test_an_addition_that_promises_nothing_where_it_is_absent_begins_at_its_start_value():
    problem, _, start = posed(1, [(0.5, 1.0)])
    # A grid whose only time is spent before the first sample.
    every = [ContainedPart(("g1", "tau1"), {"g1": 0.0}, {"tau1": (1e-3,)}, "viscoelasticity", {})]
    found = from_contained(problem, start, every=every)
    assert found.cost == pytest.approx(1.0, abs=0.25)


def test_branches_have_the_order_of_their_start_values():
    for times in ((0.7, 50.0), (50.0, 0.7)):
        problem, every, _ = posed(2, [(0.5, 1.0), (0.4, 30.0)])
        found = from_contained(problem, np.array([0.5, 0.2, times[0], 0.2, times[1]]), every=every)
        values = problem.parameters(found.x)
        shorter, longer = ("1", "2") if times[0] < times[1] else ("2", "1")
        assert [values[f"tau{shorter}"], values[f"tau{longer}"]] == pytest.approx([1.0, 30.0], rel=0.05)
        assert [values[f"g{shorter}"], values[f"g{longer}"]] == pytest.approx([0.5, 0.4], rel=0.05)
        assert found.cost == problem.cost(found.x)


class Spectrum(Relaxation):
    """A relaxation whose first branch alone has two times, the second a tenth of the first."""

    def __init__(self, branches):
        super().__init__([])
        (g1, tau1), (g2, tau2) = branches
        slow = 0.5 * (np.exp(-TIMES / tau1) + np.exp(-10.0 * TIMES / tau1))
        self.measured = 0.3 * (1.0 + g1 * slow + g2 * np.exp(-TIMES / tau2)) + (self.measured - 0.3)

    def solve(self, parameters, names, limit=None):
        c, tau = parameters["C10"], parameters["tau1"]
        waves = {
            "1": 0.5 * (np.exp(-TIMES / tau) + np.exp(-10.0 * TIMES / tau)),
            "2": np.exp(-TIMES / parameters["tau2"]),
        }
        whole = 1.0 + sum(parameters[f"g{i}"] * wave for i, wave in waves.items())
        slopes = {"C10": whole, **{f"g{i}": c * wave for i, wave in waves.items()}}
        late = 0.5 * (np.exp(-TIMES / tau) + 10.0 * np.exp(-10.0 * TIMES / tau)) * TIMES / tau**2
        slopes["tau1"] = c * parameters["g1"] * late
        slopes["tau2"] = c * parameters["g2"] * waves["2"] * TIMES / parameters["tau2"] ** 2
        return ChannelForces(TIMES, c * whole, np.column_stack([slopes[name] for name in names]))


def test_branches_that_are_not_equal_keep_their_places():
    problem, every, _ = posed(2, [(0.5, 1.0), (0.4, 30.0)])
    problem = LeastSquaresProblem(
        [Spectrum([(0.5, 20.0), (0.4, 0.5)])],
        law("neo_hookean"),
        problem.names,
        {},
        problem.bounds,
        problem.states,
    )
    # The start has the slower branch second.
    found = from_contained(problem, np.array([0.5, 0.2, 0.5, 0.2, 20.0]), every=every)
    values = problem.parameters(found.x)
    assert found.cost == pytest.approx(1.0, abs=0.25)
    assert [values["tau1"], values["tau2"]] == pytest.approx([20.0, 0.5], rel=0.1)


class Vibration(Relaxation):
    """A stress that oscillates: C10 (1 + sum of g sin(tau t)), in which a search finds the nearest frequency only."""

    def __init__(self):
        self.times = np.linspace(0.0, 20.0, 200)
        self.measured = 0.3 * (1.0 + np.sin(2.2 * self.times) + 0.6 * np.sin(3.0 * self.times))
        self.scale = np.full(len(self.times), 1e-3)

    def solve(self, parameters, names, limit=None):
        c, t = parameters["C10"], self.times
        waves = {i: np.sin(parameters[f"tau{i}"] * t) for i in "12"}
        whole = 1.0 + sum(parameters[f"g{i}"] * wave for i, wave in waves.items())
        slopes = {"C10": whole, **{f"g{i}": c * wave for i, wave in waves.items()}}
        slopes["tau1"] = c * parameters["g1"] * t * np.cos(parameters["tau1"] * t)
        return ChannelForces(t, c * whole, np.column_stack([slopes[name] for name in names]))


def test_a_part_that_took_the_place_of_another_effect_is_tried_again_beside_it():
    """The first effect ends at the frequency that the second one has by itself, beside which it has another."""
    names, bounds = ["C10", "g1", "tau1", "g2"], Bounds(np.full(4, 1e-6), np.full(4, 10.0))
    states = coupon_states((0.8, 1.2))
    problem = LeastSquaresProblem([Vibration()], law("neo_hookean"), names, {"tau2": 2.2}, bounds, states)
    every = [
        ContainedPart(("g1", "tau1"), {"g1": 1e-6}, {"tau1": (2.21, 3.05)}, "first", {}),
        ContainedPart(("g2",), {"g2": 1e-6}, {}, "second", {}),
    ]
    found = from_contained(problem, np.array([0.3, 0.1, 2.21, 0.1]), every=every)
    assert problem.parameters(found.x) == pytest.approx(
        {"C10": 0.3, "g1": 0.6, "tau1": 3.0, "g2": 1.0, "tau2": 2.2}, rel=1e-4
    )


class Tension(Relaxation):
    """Uniaxial stress of incompressible rubber of Ogden's law with one term, mu = 0.4 MPa and alpha = 1.2."""

    coupon, name = True, "tension"

    def __init__(self):
        self.stretch = np.linspace(0.8, 1.5, 80)
        self.scale = np.full(80, 2e-3)
        self.measured = 0.4 * self.term(1.2)[0] + self.scale * np.random.default_rng(4).standard_normal(80)

    def term(self, alpha):
        """Stress of mu = 1, and its derivative by alpha."""
        log, a, b = np.log(self.stretch), self.stretch ** (alpha - 1.0), self.stretch ** (-0.5 * alpha - 1.0)
        return a - b, log * (a + 0.5 * b)

    def solve(self, parameters, names, limit=None):
        value, slope = self.term(parameters["alpha1"])
        mu = parameters["mu1"]
        return ChannelForces(self.stretch, mu * value, np.column_stack([value, mu * slope]))


@pytest.mark.parametrize("start", [(0.35, 1.3), (0.04, 8.0), (-0.3, -3.0)])
def test_a_modulus_and_its_exponent_are_found_in_few_evaluations(start):
    """In mu and alpha themselves there were 6, 21 and 193, the last without passing alpha = 0."""
    bounds = Bounds(np.array([-1e3, -25.0]), np.array([1e3, 25.0]))
    problem = LeastSquaresProblem(
        [Tension()], law("ogden"), ["mu1", "alpha1"], {}, bounds, coupon_states((0.8, 1.5))
    )
    found = search(problem, np.array(start))
    assert found.converged
    assert found.x[0] * found.x[1] == pytest.approx(0.48, rel=5e-3)
    assert problem.sweeps < 10
