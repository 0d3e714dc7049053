"""Effects that all channels may share or that one may have by itself: what a diagnosis tries, and derivatives."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bushcli.curve.recording import RecordedPath
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect
from bushcli.evidence.prior import scales_of
from bushcli.runtime.workers import Workers
from bushcli.selection import derivatives
from bushcli.selection.columns import columns, trials
from bushcli.selection.derivatives import Derivatives
from bushcli.selection.model_cache import ModelCache
from geometry.shape import shapes

LAG = effect("time_lag")


@pytest.fixture(scope="module")
def made(coupon):
    return coupon("yeoh")


@pytest.fixture
def recordings(made):
    (one,) = made.recordings
    return one, replace(one, name="planar", mode="planar")


def having(made, *rigs):
    effects = tuple(ActiveEffect(LAG, {"lag": 0.1}, rig) for rig in rigs)
    return replace(made.state.model, effects=effects)


def tried(made, model, recordings):
    return [one.active.identity for one in trials(made.case, model, LAG, recordings, 1.0)[0]]


def test_all_channels_share_it_or_one_has_its_own(made, recordings):
    expected = ["time_lag", "time_lag@uniaxial", "time_lag@planar"]
    assert tried(made, having(made), recordings) == expected


def test_a_model_has_one_of_a_channel_only(made, recordings):
    assert tried(made, having(made, None), recordings) == []
    assert tried(made, having(made, ("planar",)), recordings) == ["time_lag@uniaxial"]
    assert tried(made, having(made, ("planar",), ("uniaxial",)), recordings) == []


def test_a_channel_without_time_shares_none(made, recordings):
    first, second = recordings
    assert tried(made, having(made), (replace(first, time=None), second)) == ["time_lag@planar"]
    third = replace(second, name="equibiaxial", mode="equibiaxial")
    without = (replace(first, time=None), second, third)
    assert tried(made, having(made), without) == ["time_lag@planar", "time_lag@equibiaxial"]


def test_an_offset_across_the_load_is_tried_where_its_reaction_was_recorded(made):
    """A radial curve changes with its square only: no derivative predicts it, and it takes a model without symmetry."""
    plain = shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0)
    case, (one,) = replace(made.case, geometry=plain), made.recordings
    radial, amplitudes = replace(one, name="radial", mode="radial"), []
    for number in (None, 0, 1):
        motion = np.zeros((len(one.displacement), 6))
        path = None if number is None else RecordedPath(one.time, motion, (), number, "path")
        model, effects = made.state.model, effect("misalignment")
        amplitudes += [
            t.amplitudes for t in trials(case, model, effects, [replace(radial, six=path)], 1.0)[0]
        ]
    assert amplitudes == [("offset",), ("offset",), ("offset", "offset_across")]
    conical = replace(one, name="conical", mode="conical")
    assert trials(case, model, effects, [conical], 1.0)[0][0].amplitudes == ("offset", "tilt")
    assert effect("misalignment").branches == 1


def test_two_on_a_common_channel_are_the_same(made):
    shared, one, other = (ActiveEffect(LAG, {}, rig) for rig in (None, ("uniaxial",), ("planar",)))
    assert shared.is_among([one])
    assert one.is_among([shared])
    assert one.is_among([other, one])
    assert not one.is_among([other])
    assert not one.is_among([ActiveEffect(effect("friction"))])


@pytest.fixture
def twice(made, recordings):
    """The fitted model of one recording on two channels."""
    problem = replace(
        made.problem,
        recordings=recordings,
        noises=made.problem.noises * 2,
        used=made.problem.used * 2,
        likelihood=replace(
            made.problem.likelihood,
            features=made.problem.likelihood.features * 2,
            plain=made.problem.likelihood.plain * 2,
        ),
    )
    fitted = made.state.fitted
    fitted = replace(fitted, simulated=fitted.simulated * 2, jacobians=fitted.jacobians * 2)
    return replace(made.state, problem=problem, fitted=fitted)


@pytest.fixture
def column(made):
    return np.sin(np.arange(len(made.strain)))[:, None] * made.strain[:, None]


def test_the_derivative_by_one_of_a_channel_is_a_part_of_that_by_one_in_all(twice, column, monkeypatch):
    asked = []

    def solved(case, base, candidates, known):
        (trial,) = candidates
        asked.append(trial.active.identity)
        return column[None], 2.0 * column[None]

    monkeypatch.setattr(derivatives, "columns", solved)
    found = Derivatives(twice.problem, Workers(1), [LAG], lambda *text: None, 1.0).additions_beside(
        twice, True
    )
    assert asked == ["time_lag"]
    slopes = {one.trial.active.identity: one.slopes for one in found}
    both, nothing = slopes["time_lag"], np.zeros_like(slopes["time_lag"][0])
    np.testing.assert_array_equal(slopes["time_lag@uniaxial"], (both[0], nothing))
    np.testing.assert_array_equal(slopes["time_lag@planar"], (nothing, both[1]))


def test_derivatives_beside_a_stiffer_law_are_those_beside_the_first(coupon):
    """The grid of an energy, of Mullins' softening, is that of the first law: nothing is marched for the second."""
    made, asked = coupon("yeoh"), []
    found = Derivatives(
        made.problem, Workers(1, cache=made.cache), [effect("mullins")], lambda *t: asked.append(t), 1.0
    )
    start = {name: 1.1 * value for name, value in made.state.model.start.items()}
    stiffer = replace(
        made.state, fitted=replace(made.state.fitted, model=replace(made.state.model, start=start))
    )
    first, second = found.additions_beside(made.state), found.additions_beside(stiffer)
    assert len(asked) == len(first) > 1
    assert [one.trial for one in first] == [one.trial for one in second]


def test_a_spike_sets_no_scale_of_a_prior(coupon):
    problem = coupon("yeoh").problem
    (recording,), (used,) = problem.recordings, problem.used
    force, mask = recording.force.copy(), used.copy()
    force[7], mask[7] = 20.0 * np.abs(force).max(), False
    spiked = replace(problem, recordings=(replace(recording, force=force),), used=(mask,))
    clean, found = (scales_of(one.case, 1.0, one.sound_recordings) for one in (problem, spiked))
    assert found["compliance"] == pytest.approx(clean["compliance"], rel=0.02)
    assert found["force"] == pytest.approx(clean["force"], rel=0.02)


def test_the_derivative_is_solved_anew_in_the_channels_that_a_rig_moves(twice, column, monkeypatch):
    asked, size = [], [1.0]

    def solved(case, base, candidates, known):
        asked.append(known)
        own = np.array([size[0] * column for _ in candidates])
        return own, np.zeros_like(own) if "planar" in known else own

    monkeypatch.setattr(derivatives, "columns", solved)
    known = Derivatives(twice.problem, Workers(1), [effect("mullins")], lambda *text: None, 1.0)
    (alone, *_) = known.additions_beside(twice, True)
    assert set(asked) == {()}
    asked.clear()
    size[0] = 3.0
    moved = ActiveEffect(LAG, {"lag": 0.1}, ("uniaxial",))
    model = replace(twice.model, effects=(moved,))
    beside = replace(twice, fitted=replace(twice.fitted, model=model))
    (anew, *_) = known.additions_beside(beside)
    assert set(asked) == {("planar",)}
    np.testing.assert_allclose(anew.slopes[0], 3.0 * alone.slopes[0])
    np.testing.assert_array_equal(anew.slopes[1], alone.slopes[1])


def test_a_channel_whose_derivative_is_known_is_not_solved(made):
    (candidate, *_), _ = trials(made.case, made.state.model, effect("mullins"), made.recordings, 1.0)
    question = ModelCache(), made.case, made.state.model, (candidate,)
    (solved,), (known,) = (columns(*question, names) for names in ((), [one.name for one in made.recordings]))
    assert np.any(solved)
    assert known.shape == solved.shape
    assert not np.any(known)


def test_the_lag_of_a_rig_is_measured_by_its_fastest_channel(coupon):
    """Beside a table a slow curve is sampled every half second, and says nothing about microseconds."""
    one = coupon()
    (recording,) = one.recordings
    table = SimpleNamespace(span=(1e-4, 1.0), has_time=True, largest=recording.largest, mode=recording.mode)
    alone, both = (scales_of(one.case, 1.0, group) for group in ((recording,), (recording, table)))
    assert alone["interval"] == pytest.approx(recording.span[0])
    assert both["interval"] == 1e-4
    assert both["duration"] == pytest.approx(recording.span[1])
