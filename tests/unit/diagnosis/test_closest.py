"""The last fit of an answer: as close as an identification comes; what is held out is predicted as by a new fit."""

from dataclasses import replace

import numpy as np
import pytest

from bushcli.inverse.minimum_search import search
from bushcli.selection.closest import come_closest, held_out, predicts_better
from bushcli.selection.state import State


@pytest.fixture(scope="module")
def fits(coupon):
    """A neo-Hookean coupon with permanent set, whose rubber is Yeoh's: as the search fits it, and at its closest."""
    made = coupon(set_=0.05)
    searched = made.fit(made.model(permanent_set={"set": 0.03}))
    return made, searched, State(made.problem, come_closest(made.cache, made.case, searched.model, made.used))


def rms(made, state):
    return float(np.sqrt(np.mean((state.fitted.simulated[0] - made.recordings[0].force) ** 2)))


def test_the_answer_is_as_close_as_least_squares_from_any_start(fits):
    made, searched, closest = fits
    task = searched.model.task(made.case)
    channels = made.cache.channels(task)
    for channel in channels:
        channel.scale = np.full(len(channel.scale), np.ptp(channel.measured))
    problem = task.pose(channels)
    best = min(
        float(np.sqrt(search(problem, problem.bounds.inside(np.array(x))).cost))
        for x in ([0.3, 0.01], [0.5, 0.1], [0.9, 0.02])
    )
    assert rms(made, closest) <= rms(made, searched)
    assert rms(made, closest) / np.ptp(made.recordings[0].force) <= 1.01 * best


def test_what_is_held_out_is_predicted_as_by_a_fit_to_the_rest(fits):
    made, _, closest = fits
    found = held_out(closest)
    assert len(found) == 4
    second = np.repeat([False, True, False, False], [41, 40, 40, 40])
    refitted = come_closest(made.cache, made.case, closest.model, (~second,))
    force = made.recordings[0].force
    misfit = (refitted.simulated[0] - force)[second]
    unit = max(made.recordings[0].force_noise, 1e-3 * np.ptp(force))
    assert found[1] == pytest.approx(float(misfit @ misfit) / unit**2 / len(force), rel=0.05)


def test_a_model_that_leaves_less_predicts_better_unless_only_one_part_says_so(fits):
    made, _, closest = fits
    plain = made.state
    assert predicts_better(closest, plain)
    assert not predicts_better(plain, closest)
    measured = made.recordings[0].force
    force = measured + 1.01 * (closest.fitted.simulated[0] - measured)
    force[:41] = measured[:41]
    one_part = State(made.problem, replace(closest.fitted, simulated=(force,)))
    assert not predicts_better(one_part, closest)
