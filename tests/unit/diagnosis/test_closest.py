"""The last fit of an answer: as close as an identification comes; what is held out is predicted as by a new fit."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bushcli.inverse.minimum_search import search
from bushcli.selection import closest
from bushcli.selection.closest import come_closest, held_out_misfits, on_default_mesh, predicts_better
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


@pytest.mark.parametrize(("share", "again"), [(0.1, True), (0.001, False)])
def test_the_answer_is_fitted_again_where_the_error_of_a_coarse_mesh_moves_it(fits, share, again):
    """The default mesh is stiffer by `share`, which the law's modulus makes up for."""
    made, _, found = fits
    coarse = State(made.problem, replace(found.fitted, model=replace(found.model, anchor=found.model.start)))
    asked = []

    def run(function, questions):
        ((case, *question),) = questions
        asked.append(function)
        if function is come_closest:
            return [come_closest(made.cache, case, *question)]
        ((fitted),) = question
        channels = made.cache.channels(replace(fitted.model, anchor=None).task(case))
        force = channels[0].at_samples(channels[0].solve(fitted.values, ()))[0]
        return [replace(fitted, simulated=(force * (1.0 + share),))]

    search = SimpleNamespace(problem=made.problem, workers=SimpleNamespace(run=run))
    fine = on_default_mesh(search, coarse)
    assert (come_closest in asked) == again
    assert rms(made, fine) < 1.03 * rms(made, coarse)
    assert (fine.model.start["C10"] < 0.95 * coarse.model.start["C10"]) == again
    assert on_default_mesh(search, found) is found


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
