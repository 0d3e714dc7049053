"""Steps through recorded paths: as few as the noise allows, cut at knees of the response, interpolated at samples."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.simulate.schedule import RESOLUTION, WITHIN, Leg, prescribed_schedule, schedule
from cases.feature import Feature, Installed
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import prepare
from forms.branch import branches
from forms.potential import Attached
from geometry.shape import Refinement

NOISE = 0.003


def noisy(time, corner_times, corners, seed=1):
    q = np.interp(time, corner_times, corners)
    return q + NOISE * np.random.default_rng(seed).standard_normal(len(time))


def triangle(count=1321):
    """Return eight cycles of growing amplitude, 3 to 5 mm, 1 mm/s, a sample each 0.1 s: the corners are samples."""
    peaks = np.repeat(np.array([3.0, 4.0, 4.5, 5.0]), 2)
    corners = np.concatenate([[0.0], *[[a, -a] for a in peaks], [0.0]])
    at = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(corners)))])
    time = np.linspace(0.0, at[-1], count)
    return time, at, corners


def sinusoid(count=300):
    time = np.linspace(0.0, 30.0, count)
    return time, 4.0 * np.sin(2 * np.pi * time / 10.0)


HOLD_TIMES = np.array([0.0, 5.0, 65.0, 70.0, 130.0])
HOLD_CORNERS = np.array([0.0, 5.0, 5.0, 2.0, 2.0])


def turns(q):
    return int(np.sum(np.diff(np.sign(np.diff(q))) != 0))


# -- the path -------------------------------------------------------------------------------------------------------


def test_triangle_is_followed_within_the_noise_and_cut_at_its_corners():
    time, at, corners = triangle()
    steps = schedule(time, noisy(time, at, corners), NOISE)
    np.testing.assert_allclose(steps.path(time), np.interp(time, at, corners), atol=WITHIN * NOISE)
    assert turns(steps.displacement) == len(corners) - 2
    ends = np.array([steps.time[leg.first] for leg in steps.legs])
    for corner in at[1:-1]:
        assert np.abs(ends - corner).min() < 0.11
    assert not any(leg.hold for leg in steps.legs)
    assert steps.timed
    assert steps.displacement[0] == 0.0


def test_fitted_corners_are_better_than_any_sample():
    """The chain is fitted to all samples: its mean error is far below the noise of one."""
    time, at, corners = triangle()
    steps = schedule(time, noisy(time, at, corners), NOISE)
    away = np.min(np.abs(time[:, None] - at[None, 1:-1]), axis=1) > 0.5
    errors = (steps.path(time) - np.interp(time, at, corners))[away]
    assert np.sqrt(np.mean(errors**2)) < 0.7 * NOISE


@pytest.mark.parametrize("seed", range(3))
def test_sinusoid_is_followed_within_the_noise(seed):
    time, q = sinusoid()
    recorded = q + NOISE * np.random.default_rng(seed).standard_normal(len(q))
    steps = schedule(time, recorded, NOISE)
    errors = steps.path(time) - q
    # The tolerance of the chain of lines at the samples, plus the noise of the samples.
    assert np.abs(errors).max() < (WITHIN + 3.0) * NOISE
    assert np.sqrt(np.mean(errors**2)) < 2.0 * NOISE
    assert turns(steps.displacement) == 6
    assert len(steps.time) < 0.6 * len(time)


def test_without_noise_the_path_is_followed_to_its_resolution():
    time, q = sinusoid()
    steps = schedule(time, q, 0.0)
    np.testing.assert_allclose(steps.path(time), q, atol=2 * RESOLUTION * np.ptp(q))


def test_hold_is_a_leg_with_steps_even_in_the_logarithm_of_time():
    time = np.linspace(0.0, 130.0, 651)
    steps = schedule(time, noisy(time, HOLD_TIMES, HOLD_CORNERS), NOISE)
    holds = [leg for leg in steps.legs if leg.hold]
    assert len(holds) == 2
    for leg, begin, end in zip(holds, HOLD_TIMES[1::2], HOLD_TIMES[2::2], strict=True):
        inside = slice(leg.first, leg.last + 1)
        assert steps.time[leg.first] == pytest.approx(begin, abs=0.4)
        assert steps.time[leg.last] == pytest.approx(end, abs=0.4)
        lengths = np.diff(steps.time[inside])
        ratios = lengths[1:] / lengths[:-1]
        assert lengths[0] < 0.01 * (end - begin)
        np.testing.assert_allclose(ratios, ratios[0], rtol=1e-6)
        assert np.ptp(steps.displacement[inside]) < 2 * WITHIN * NOISE


def test_nodes_are_in_order_and_legs_join():
    time, at, corners = triangle()
    steps = schedule(time, noisy(time, at, corners), NOISE)
    assert np.all(np.diff(steps.time) > 0)
    assert (steps.time[0], steps.time[-1]) == (time[0], time[-1])
    assert steps.legs[0].first == 0
    assert steps.legs[-1].last == len(steps.time) - 1
    assert [leg.last for leg in steps.legs[:-1]] == [leg.first for leg in steps.legs[1:]]


def test_a_leg_is_cut_where_it_passes_the_former_peak():
    """Softened rubber is virgin again beyond it: a knee in the curve."""
    time, at, corners = triangle()
    steps = schedule(time, noisy(time, at, corners), NOISE)
    inner = [leg.first for leg in steps.legs if np.abs(at - steps.time[leg.first]).min() > 0.2]
    # Each amplitude, driven twice, is passed once on the way up: 3 mm to 4, 4 mm to 4.5, 4.5 mm to 5.
    np.testing.assert_allclose(steps.displacement[inner], [3.0, 4.0, 4.5], atol=WITHIN * NOISE)
    for node in inner:
        before, here, after = steps.displacement[node - 1 : node + 2]
        assert before < here < after


def test_a_change_of_rate_begins_a_leg():
    """A ramp that goes on at a tenth of the rate, without a turn: viscous stress has a knee there."""
    time = np.linspace(0.0, 50.0, 501)
    corner_times, corners = [0.0, 5.0, 50.0], [0.0, 2.5, 5.0]
    steps = schedule(time, noisy(time, corner_times, corners), NOISE)
    assert len(steps.legs) == 2
    assert steps.time[steps.legs[1].first] == pytest.approx(5.0, abs=0.3)
    # Half the rate is no such change: one leg, with a node at the corner.
    gentle = schedule(time, noisy(time, [0.0, 20.0, 50.0], [0.0, 2.8, 5.0]), NOISE)
    assert len(gentle.legs) == 1
    assert np.abs(gentle.time - 20.0).min() < 1.5


def test_fineness_doubles_the_steps():
    time, at, corners = triangle()
    recorded = noisy(time, at, corners)
    usual, double = (schedule(time, recorded, NOISE, fineness) for fineness in (1.0, 2.0))
    assert len(double.time) - 1 == pytest.approx(2 * (len(usual.time) - 1), rel=0.05)
    assert len(usual.time) < 0.2 * len(time)
    # The first steps after a turn are the finest.
    leg = usual.legs[3]
    lengths = np.abs(np.diff(usual.displacement[leg.first : leg.last + 1]))
    assert lengths[0] < 0.7 * lengths[-1]


def test_corners_between_samples_are_rounded_in_few_steps():
    """No sample is at a turning point, which therefore becomes a short line or a hold of one or two steps."""
    time, at, corners = triangle(400)
    steps = schedule(time, noisy(time, at, corners), NOISE)
    short = [leg for leg in steps.legs if steps.time[leg.last] - steps.time[leg.first] < 0.5]
    assert any(leg.hold for leg in short)
    assert all(leg.last - leg.first <= 2 for leg in short if leg.hold)
    np.testing.assert_allclose(steps.path(time), np.interp(time, at, corners), atol=WITHIN * NOISE)


# -- back to the samples --------------------------------------------------------------------------------------------


def cubic(steps, leg, clock):
    """An arbitrary cubic of the position within a leg, different for each leg."""
    a, b, c = 1.0 + leg.first % 7, -0.3 * (leg.first % 5), 0.05
    return a * clock + b * clock**2 + c * clock**3


def test_interpolation_is_exact_for_cubics_within_each_leg():
    """Cubics in the displacement since the turn; continuous from leg to leg."""
    time, at, corners = triangle()
    steps = schedule(time, noisy(time, at, corners), NOISE)

    def function(times):
        value, found = 0.0, np.zeros(len(times))
        for leg in steps.legs:
            t = steps.time
            here = (times >= t[leg.first]) & (times <= t[leg.last])
            clock = np.abs(steps.path(times[here]) - steps.displacement[leg.first])
            found[here] = value + cubic(steps, leg, clock)
            value += cubic(steps, leg, abs(steps.displacement[leg.last] - steps.displacement[leg.first]))
        return found

    matrix = steps.interpolation(time)
    assert matrix.shape == (len(time), len(steps.time))
    np.testing.assert_allclose(matrix @ function(steps.time), function(time), atol=1e-10)
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0, atol=1e-12)


def test_interpolation_at_the_nodes_returns_their_values():
    time = np.linspace(0.0, 130.0, 651)
    steps = schedule(time, noisy(time, HOLD_TIMES, HOLD_CORNERS), NOISE)
    np.testing.assert_allclose(steps.interpolation(steps.time), np.eye(len(steps.time)), atol=1e-12)


def test_relaxation_in_a_hold_is_interpolated():
    """An exponential of 12 s in a hold of 60 s with ten steps: within 1 % of its height."""
    time = np.linspace(0.0, 130.0, 651)
    steps = schedule(time, noisy(time, HOLD_TIMES, HOLD_CORNERS), NOISE)
    leg = next(leg for leg in steps.legs if leg.hold)
    begin, end = steps.time[leg.first], steps.time[leg.last]

    def relaxing(t):
        return np.exp(-np.clip(t - begin, 0.0, end - begin) / 12.0)

    here = (time >= begin) & (time <= end)
    found = steps.interpolation(time[here]) @ relaxing(steps.time)
    np.testing.assert_allclose(found, relaxing(time[here]), atol=1e-2)


# -- without time, and without noise --------------------------------------------------------------------------


def test_without_time_the_sample_numbers_stand_for_it():
    time, at, corners = triangle()
    recorded = noisy(time, at, corners)
    steps, timed = schedule(None, recorded, NOISE), schedule(time, recorded, NOISE)
    assert not steps.timed
    assert steps.time[-1] == len(time) - 1
    # Samples are equidistant in time here, so that the nodes are the same.
    np.testing.assert_allclose(steps.displacement, timed.displacement, atol=1e-9)


def test_a_prescribed_program_keeps_its_points_and_is_cut_where_it_turns_or_stands():
    q = np.array([0.0, 1.0, 3.0, 3.0, 3.0, 1.0, -1.0, -2.0, 0.0])
    time = np.array([0.0, 1.0, 2.0, 3.0, 9.0, 10.0, 11.0, 12.0, 13.0])
    steps = prescribed_schedule(time, q)
    np.testing.assert_array_equal(steps.time, time)
    np.testing.assert_array_equal(steps.displacement, q)
    assert steps.legs == (Leg(0, 2, False), Leg(2, 4, True), Leg(4, 7, False), Leg(7, 8, False))
    np.testing.assert_allclose(steps.interpolation(time), np.eye(9), atol=1e-12)
    assert not prescribed_schedule(None, q).timed


@pytest.mark.parametrize("count", [5, 12])
def test_few_samples_are_enough(count):
    time = np.linspace(0.0, 10.0, count)
    q = 3.0 * np.sin(2 * np.pi * time / 10.0) + 0.5 * time
    steps = schedule(time, q, NOISE)
    np.testing.assert_allclose(steps.path(time), q, atol=1e-2)
    assert steps.interpolation(time).shape == (count, len(steps.time))


# -- the error of the response --------------------------------------------------------------------------------------


def recorded_cycles():
    time, at, corners = triangle()
    return time, noisy(time, at, corners)


def recorded_holds():
    time = np.linspace(0.0, 130.0, 651)
    return time, noisy(time, HOLD_TIMES, HOLD_CORNERS)


def recorded_sinusoid():
    time, q = sinusoid()
    return time, q + NOISE * np.random.default_rng(1).standard_normal(len(q))


@pytest.mark.parametrize("recorded", [recorded_cycles, recorded_holds, recorded_sinusoid])
def test_the_usual_steps_serve_a_viscoelastic_bushing_to_0_3_percent(recorded, reference_bushing, rubber):
    """Against steps four times as fine, at the samples, over the peak force."""
    feature = Feature(branches=lambda values: [Attached(branches()["maxwell"], values)])
    model = prepare(
        reference_bushing,
        modes()["axial"],
        rubber("yeoh"),
        Refinement(across=2, along=4),
        features=[Installed("maxwell", feature, {"g": 0.2, "tau": 4.0})],
    )
    time, q = recorded()
    curves = []
    for fineness in (1.0, 4.0):
        steps = schedule(time, q, NOISE, fineness)
        force = march(model, Program(steps.displacement, steps.time)).force
        curves.append(steps.interpolation(time) @ force)
    error = np.abs(curves[0] - curves[1]).max() / np.abs(curves[1]).max()
    assert error < 3e-3
