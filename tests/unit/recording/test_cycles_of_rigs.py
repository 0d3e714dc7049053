"""What rigs do to a program: recordings that begin at a turning point, and overshoots of zero."""

from itertools import pairwise

import numpy as np
import pytest

from bushcli.curve.curve import Curve
from bushcli.curve.cycles import cycles
from bushcli.curve.segment import segment


def ramps(*corners, step=0.05):
    pieces = [np.array([corners[0]], dtype=float)]
    for a, b in pairwise(corners):
        pieces.append(np.linspace(a, b, max(1, round(abs(b - a) / step)) + 1)[1:])
    return np.concatenate(pieces)


def loops(q, friction=20.0):
    """A spring of 100 N/mm with friction, whose loop from -a to a takes 4 friction a."""
    return cycles(Curve("axial", q, 100.0 * q + friction * np.sign(np.gradient(q))))


def code(q):
    return " ".join(f"{b.kind[0].upper()}{b.cycle}" for b in segment(q))


@pytest.mark.parametrize("corners", [(4, -4, 4), (-4, 4, -4)])
@pytest.mark.parametrize("sigma", [0.0, 2e-3])
def test_a_loop_cut_at_its_turning_points_is_one_cycle(corners, sigma):
    q = ramps(*corners)
    q = q + sigma * np.random.default_rng(1).normal(size=len(q))
    (found,) = loops(q)
    assert code(q) == "U1 L1 U1 L1"
    assert found.closed
    # 4 x 20 N x 4 mm, less 0.5 N mm where friction reverses within a step, and the effect of noise.
    assert found.energy.value == pytest.approx(320.0, abs=1.5 + 400 * sigma)
    # Work done while loading: twice 1/2 100 4^2 + 20 * 4.
    assert found.loss.value == pytest.approx(320.0 / (2 * (800 + 80)), rel=0.03)


def test_several_loops_cut_at_their_turning_points():
    assert code(ramps(4, -4, 4, -4, 4)) == "U1 L1 U1 L1 U2 L2 U2 L2"
    assert code(ramps(4, 1, 4, 1, 4)) == "U1 L1 U2 L2"
    # The way back to rest is no cycle.
    assert code(ramps(4, -4, 4, 0)) == "U1 L1 U1 L1 U1"


@pytest.mark.parametrize("start", [0.2, -0.2, 0.0])
def test_a_recording_that_begins_near_rest_is_counted_in_full_reversals(start):
    assert code(ramps(start, -4, 4, -4, 0)) == "L1 U1 L1 U1 L2 U2"


@pytest.mark.parametrize("beyond", [0.05, 0.1, 0.19])
def test_an_overshoot_of_zero_is_no_cycle(beyond):
    q = ramps(0, 4, -beyond, 4, -beyond, 4, 0)
    assert code(q) == "L1 U1 L2 U2 L3 U3"
    found = loops(q)
    assert [cycle.number for cycle in found] == [1, 2, 3]
    assert [cycle.closed for cycle in found[:2]] == [True, True]
    assert [cycle.loss.value for cycle in found] == pytest.approx([0.18] * 3, abs=0.01)


def test_an_overshoot_after_the_last_cycle_is_no_cycle():
    assert code(ramps(0, 4, 0, 4, -0.1)) == "L1 U1 L2 U2"


def test_small_cycles_before_large_ones_are_cycles():
    assert code(ramps(0, 0.1, -0.1, 4, -4, 0, step=0.01)) == "L1 U1 L1 U1 L2 U2 L2 U2"


def test_a_small_excursion_to_the_other_side_ends_a_cycle():
    assert code(ramps(0, 4, -0.3, 4, 0)) == "L1 U1 L1 U1 L2 U2"


def count(q):
    return segment(q)[-1].cycle


@pytest.mark.parametrize(
    ("corners", "number"),
    [
        ((0, 4, -4, 4, -4, 0), 2),
        ((0, -4, 4, -4, 4, 0), 2),
        ((0, 4, 0, 4, 0, 4, 0), 3),
        # Blocks of different amplitudes, also such that begin to the other side.
        ((0, 1, -1, 1, -1, 2, -2, 2, -2, 0), 4),
        ((0, 1, -1, 0, -2, 2, 0), 2),
        ((0, 2, 0, 2, 0, 3, -3, 3, -3, 0), 4),
        # A ramp before the cycles is one to one side, not half of the first of them.
        ((0, 4, 0, -2, 2, -2, 2, -2, 2, 0), 4),
        # Half a cycle more.
        ((0, 4, -4, 4), 2),
        # About a preload: the ways to it and back to rest are no cycles, with or without zero within the motion.
        ((0, 3, 1, 3, 1, 3, 1, 2), 3),
        ((0, 3, 1, 3, 1, 3, 1, 2, 0), 3),
        ((2, 3, 1, 3, 1, 2), 2),
        ((0, -3, -1, -3, -1, -2, 0), 2),
        ((0, 3, -1, 3, -1, 1), 2),
        ((0, 3, -1, 3, -1, 1, 0), 2),
        ((0, 3, 1, 3, 1, 2.5, 1.5, 2.5, 1.5, 2, 0), 4),
    ],
)
@pytest.mark.parametrize("sigma", [0.0, 2e-3])
def test_full_reversals_are_counted(corners, number, sigma):
    q = ramps(*corners)
    assert count(q + sigma * np.random.default_rng(2).normal(size=len(q))) == number


@pytest.mark.parametrize("preload", [0.0, 0.5, -1.0, 1.0, 2.4, 3.0])
@pytest.mark.parametrize("number", [1, 3, 10])
@pytest.mark.parametrize("sense", [1, -1])
def test_sines_about_a_preload_are_counted(preload, number, sense):
    phase = np.linspace(0.0, 2 * np.pi * number, 100 * number + 1)
    sine = preload + 2.0 * sense * np.sin(phase)
    way = np.linspace(0.0, preload, 41)[:-1]
    noise = 2e-3 * np.random.default_rng(3).normal(size=100 * number + 81)
    assert count(sine + noise[: len(sine)]) == number
    assert count(np.concatenate([way, sine, way[::-1]]) + noise) == number


def test_a_cycle_closes_though_the_way_to_rest_follows_it():
    found = loops(ramps(0, 3, 1, 3, 1, 2, 0))
    assert [cycle.closed for cycle in found] == [False, True]
    # From 1 to 3 mm and back against 20 N, less 1 N mm where it reverses within a step of 0.05 mm.
    assert found[1].energy.value == pytest.approx(80.0, abs=2.0)
