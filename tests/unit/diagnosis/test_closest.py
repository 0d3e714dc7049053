"""The last fit of an answer: as close as an identification comes; what is held out is predicted as by a new fit."""

import numpy as np
import pytest

from bushcli.inverse.minimum_search import search
from bushcli.selection import closest
from bushcli.selection.closest import come_closest, held_out_misfits, predicts_better
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
    made, searched, found = fits
    task = searched.model.task(made.case)
    channels = made.cache.channels(task)
    for channel in channels:
        channel.scale = np.full(len(channel.scale), np.ptp(channel.measured))
    problem = task.pose(channels)
    best = min(
        float(np.sqrt(search(problem, problem.bounds.inside(np.array(x))).cost))
        for x in ([0.3, 0.01], [0.5, 0.1], [0.9, 0.02])
    )
    assert rms(made, found) <= rms(made, searched)
    assert rms(made, found) / np.ptp(made.recordings[0].force) <= 1.01 * best


def test_what_is_held_out_is_predicted_as_by_a_fit_to_the_rest(fits):
    made, _, state = fits
    found = held_out_misfits(state)
    assert len(found) == 4
    second = np.repeat([False, True, False, False], [41, 40, 40, 40])
    refitted = come_closest(made.cache, made.case, state.model, (~second,))
    force = made.recordings[0].force
    misfit = (refitted.simulated[0] - force)[second]
    unit = max(made.recordings[0].force_noise, 1e-3 * np.ptp(force))
    assert found[1] == pytest.approx(float(misfit @ misfit) / unit**2 / len(force), rel=0.05)


@pytest.mark.parametrize(
    ("left", "better"),
    [
        ([0.5, 0.6, 0.5, 0.4], True),
        ([0.1, 1.0, 1.01, 1.0], False),
        ([1.0, 1.0, 1.0, 1.0], False),
        ([0.5, 0.9], True),
        ([0.1, 1.1], False),
        ([0.1], False),
    ],
)
def test_one_part_alone_does_not_make_a_model_predict_better(monkeypatch, left, better):
    monkeypatch.setattr(closest, "held_out_misfits", np.array)
    assert predicts_better(left, [1.0] * len(left)) is better
