"""The next recording: is the loop of a spring a Maxwell element or friction, is its gap an offset or free play?"""

from dataclasses import replace

import numpy as np
import pytest

from bushcli.diagnosis.discriminate import Prediction, Separation, distance, next_test, separate
from bushcli.diagnosis.menu import Proposal, menu

SIGMA = 2.0
K, G, TAU = 100.0, 20.0, 3.0
NOTHING = np.zeros((2, 2))


def maxwell(time, q):
    """Exact for a displacement that is linear between samples."""
    h = np.zeros_like(q)
    for i in range(1, len(q)):
        dt = time[i] - time[i - 1]
        decay = np.exp(-dt / TAU)
        h[i] = h[i - 1] * decay + G * TAU * (q[i] - q[i - 1]) / dt * (1 - decay)
    return h


def slider(q, stiffness=200.0, limit=G * TAU):
    """Spring in series with a slider."""
    h = np.zeros_like(q)
    for i in range(1, len(q)):
        h[i] = np.clip(h[i - 1] + stiffness * (q[i] - q[i - 1]), -limit, limit)
    return h


def prediction(q, loop, information=NOTHING):
    """A spring and a loop of free size."""
    return Prediction(K * q + loop, np.column_stack([q, loop]), information)


def proposal(name, points, rates, holds=None, cost=10.0):
    return Proposal(name, "axial", points, rates, holds or (0.0,) * len(points), cost)


ONE_RATE = proposal("one rate", (0, 4, 0, 4, 0), (1.0,) * 4, cost=5.0)
TWO_RATES = proposal("two rates", (0, 4, 0, 4, 0), (1.0, 1.0, 20.0, 20.0), cost=6.0)
HOLD = proposal("hold", (0, 4, 0), (1.0, 1.0), (0.0, 60.0, 0.0), cost=15.0)


def separated(test, information=NOTHING):
    time, q = test.program()
    rivals = {
        "maxwell": prediction(q, maxwell(time, q), information),
        "friction": prediction(q, slider(q), information),
    }
    return separate(test, rivals, SIGMA)


def test_a_program_goes_through_its_points_at_its_rates():
    time, q = HOLD.program(samples=40)
    assert (time[0], q[0], q[-1]) == (0.0, 0.0, 0.0)
    assert time[-1] == pytest.approx(4 + 60 + 4)
    assert (np.diff(time) > 0).all()
    assert np.count_nonzero(q == 4.0) == 41
    moving = np.abs(np.diff(q)) > 0
    assert np.abs(np.diff(q)[moving] / np.diff(time)[moving]) == pytest.approx(1.0)


def test_the_distance_is_what_a_refit_leaves():
    """Least squares of the difference by the rival's derivatives, nothing being known before."""
    time, q = TWO_RATES.program()
    right, other = prediction(q, maxwell(time, q)), prediction(q, slider(q))
    gap = right.force - other.force
    x = np.linalg.lstsq(other.jacobian, gap, rcond=None)[0]
    assert distance(right, other, SIGMA) == pytest.approx(np.linalg.norm(gap - other.jacobian @ x) / SIGMA)


def test_the_average_rise_of_the_misfit_is_the_distance_squared():
    """By simulation: the wrong rival refitted to noisy recordings of the right one, against the right one refitted."""
    time, q = TWO_RATES.program()
    right, other = prediction(q, 0.1 * maxwell(time, q)), prediction(q, 0.1 * slider(q))
    rng = np.random.default_rng(1)
    rises = []
    for _ in range(400):
        force = right.force + SIGMA * rng.normal(size=len(q))
        left = []
        for one in (right, other):
            x = np.linalg.lstsq(one.jacobian, force - one.force, rcond=None)[0]
            left.append(np.sum((force - one.force - one.jacobian @ x) ** 2) / SIGMA**2)
        rises.append(left[1] - left[0])
    d = distance(right, other, SIGMA)
    assert np.mean(rises) == pytest.approx(d**2, abs=4 * 2 * d / np.sqrt(400) + 0.3)
    assert np.std(rises) == pytest.approx(2 * d, rel=0.25)


def test_what_is_known_before_keeps_a_rival_from_moving():
    """Parameters that cannot move leave the whole difference; those that are free leave the least."""
    time, q = ONE_RATE.program()
    right, other = prediction(q, maxwell(time, q)), prediction(q, slider(q))
    free = distance(right, other, SIGMA)
    held = distance(right, replace(other, information=1e12 * np.eye(2)), SIGMA)
    between = distance(right, replace(other, information=np.diag([1e3, 1.0])), SIGMA)
    assert held == pytest.approx(np.linalg.norm(right.force - other.force) / SIGMA, rel=1e-6)
    assert free < between < held


def test_a_special_case_is_told_from_what_contains_it_by_that_one_alone():
    """A loop may vanish, and its absence is then no news; where it is there, nothing without it can follow."""
    time, q = ONE_RATE.program()
    none = Prediction(K * q, q[:, None], np.zeros((1, 1)))
    loop = prediction(q, maxwell(time, q))
    both = {"no effect": none, "loop": loop}
    found = separate(ONE_RATE, both, SIGMA)
    assert found.worst == pytest.approx(0.0, abs=1e-6)
    assert (found.decides, found.told_apart) == (False, ())
    found = separate(ONE_RATE, both, SIGMA, {("no effect", "loop")})
    assert found.decides
    assert found.told_apart == (("loop", "no effect"),)


def test_noise_shrinks_the_distance():
    time, q = ONE_RATE.program()
    right, other = prediction(q, maxwell(time, q)), prediction(q, slider(q))
    assert distance(right, other, 2 * SIGMA) == pytest.approx(distance(right, other, SIGMA) / 2)


def test_the_cheapest_that_decides_is_chosen_not_the_best():
    found = [separated(one) for one in (HOLD, TWO_RATES)]
    assert all(one.decides for one in found)
    chosen = next_test(found)
    assert chosen.proposal.name == "two rates"


def test_a_recording_that_rivals_can_both_follow_is_not_chosen():
    """Offset of the displacement, or free play: for a linear spring the same on one side, not on both."""

    def answers(test):
        _, q = test.program()
        free_play = K * np.sign(q) * np.maximum(np.abs(q) - 0.2, 0.0)
        return {
            "free_play": Prediction(free_play, np.column_stack([q, -K * np.sign(q)]), NOTHING),
            "offset": Prediction(K * q - 20.0, np.column_stack([q, np.full_like(q, -K)]), NOTHING),
        }

    pulled = proposal("pulled", (1.0, 4.0, 1.0), (1.0, 1.0), cost=1.0)
    both = proposal("both sides", (0.0, 4.0, -4.0, 0.0), (1.0,) * 3, cost=8.0)
    found = [separate(one, answers(one), SIGMA) for one in (pulled, both)]
    assert found[0].worst == pytest.approx(0.0, abs=1e-6)
    assert next_test(found).proposal.name == "both sides"
    assert next_test(found[:1]) is None


def test_when_none_decides_the_nearest_to_it():
    weak = [Separation(ONE_RATE, 2.0, ("a", "b"), {}), Separation(HOLD, 3.0, ("a", "b"), {})]
    assert next_test(weak).proposal.name == "hold"
    assert not next_test(weak).decides
    assert next_test([]) is None


def test_the_worst_pair_counts():
    time, q = TWO_RATES.program()
    rivals = {
        "maxwell": prediction(q, maxwell(time, q)),
        "friction": prediction(q, slider(q)),
        "friction again": prediction(q, 1.1 * slider(q)),
    }
    found = separate(TWO_RATES, rivals, SIGMA)
    assert set(found.pair) == {"friction", "friction again"}
    assert found.worst == pytest.approx(0.0, abs=1e-6)
    assert len(found.distances) == 6


def test_coupons_are_not_pushed():
    offered = menu({"uniaxial": 1.5, "axial": 1.5}, {"uniaxial": 0.1, "axial": 0.1}, mounted=())
    assert {one.channel for one in offered if min(one.points) < 0} == {"axial"}
    assert sum(one.channel == "uniaxial" for one in offered) >= 4


def test_the_menu_is_complete_and_its_costs_make_sense():
    offered = menu({"axial": 8.0, "radial": 3.0}, {"axial": 0.5, "radial": 0.5}, mounted=("axial",))
    assert [one.cost for one in offered] == sorted(one.cost for one in offered)
    by_name = {one.name: one for one in offered}
    assert len(by_name) == len(offered)
    for one in offered:
        assert len(one.points) == len(one.rates) + 1 == len(one.holds)
        time, q = one.program()
        assert np.abs(q).max() <= {"axial": 8.0, "radial": 3.0}[one.channel] + 1e-12
        # The duration is part of the cost.
        assert one.cost >= time[-1] / 60
    axial = by_name["axial, once to the largest amplitude and back"]
    assert axial.cost < by_name["axial, with a hold at the peak"].cost
    assert axial.cost < by_name["radial, once to the largest amplitude and back"].cost
    assert any(min(one.points) < 0 for one in offered)
