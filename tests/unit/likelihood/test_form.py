"""The likelihood: limited by noise where the misfit is small, by the error of form where it is large."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.evidence.prior import UNKNOWN
from bushcli.likelihood.features import Features
from bushcli.likelihood.form import Left, Likelihood, effective_features

COUNT = 48


def likelihood(plain, signal, count=COUNT, doubt=0.0):
    """Likelihood of channels with these squared misfits of the plain law and squared forces, in units of the noise."""
    channels = tuple(
        Features(
            np.zeros((0, count)),
            np.zeros(0),
            np.zeros(count),
            0.0,
            float(one),
            np.zeros(count, dtype=int),
            np.ones(count),
            doubt,
        )
        for one in signal
    )
    return Likelihood(channels, tuple(map(float, plain)))


def left(*excess):
    """What a model leaves: this excess beyond the noise, in one unit of the feature along the force."""
    found = np.array(excess, dtype=float)
    return Left(found, np.ones(len(found)), found)


def log(one, *excess):
    return one.judge(left(*excess)).log


def unknown(one, *excess):
    return one.judge_unknown(left(*excess)).log


def test_small_misfits_are_judged_by_the_noise():
    """With the plain law at the noise, log likelihoods differ by half the difference of the sums of squares."""
    one = likelihood([2.0], [1e4])
    for a, b in ((0.0, 4.0), (-3.0, 2.0), (5.0, 25.0)):
        assert log(one, a) - log(one, b) == pytest.approx(0.5 * (b - a), rel=0.03)


# Squared misfit of the plain law in units of the noise, and its ratio to the squared force: a loop of 15 % on a rig
# with noise of 0.1 to 1 % of the range and a few hundred samples.
@pytest.mark.parametrize(("plain", "share"), [(1e4, 0.02), (1e6, 0.02), (1e6, 0.2)])
def test_two_formulas_of_one_physics_are_not_told_apart_and_another_physics_is(plain, share):
    """Misfits over the plain law's, from shared/diagnosis.md: friction 0.098, viscosity 0.086, friction for Mullins
    0.86."""
    one = likelihood([plain], [plain / share])
    viscosity, friction, wrong = (log(one, ratio**2 * plain) for ratio in (0.086, 0.098, 0.86))
    assert 0.5 < viscosity - friction < 2.0
    assert friction - wrong > 10.0
    # With noise alone the difference would be decisive.
    assert 0.5 * (0.098**2 - 0.086**2) * plain > 10.0


@pytest.mark.parametrize("plain", [0.0, 10.0, 1e3, 1e6])
def test_a_larger_misfit_is_never_more_probable(plain):
    one = likelihood([plain, plain], [1e6, 1e5])
    excess = np.concatenate([[-20.0, -5.0, 0.0], np.geomspace(1.0, 1e7, 60)])
    for judge in (log, unknown):
        both = np.array([judge(one, e, e) for e in excess])
        assert (np.diff(both) < 0.0).all()
        first = np.array([judge(one, e, 3.0) for e in excess])
        assert (np.diff(first) < 0.0).all()


def test_the_number_of_samples_does_not_matter_far_above_the_noise():
    """Ten times the samples give ten times all sums of squares, so that the ratios of misfits stay."""

    def apart(samples):
        one = likelihood([1e5 * samples], [1e7 * samples])
        return log(one, 1e3 * samples) - log(one, 4e3 * samples)

    # The variance is 1 plus the error of form, some 50 here; only the 1 does not scale.
    assert apart(10.0) == pytest.approx(apart(1.0), abs=0.1)
    assert apart(100.0) == pytest.approx(apart(10.0), abs=0.02)


def test_a_misfit_is_worth_its_effective_features():
    """Twice the misfit costs about m log 2 per channel, m being the number of effective features."""
    one = likelihood([1e6], [1e7])
    loss = log(one, 0.2**2 * 1e6) - log(one, 0.4**2 * 1e6)
    (m,) = one.effective
    assert 0.5 * m * np.log(2.0) < loss < 2.0 * m * np.log(2.0)
    few = likelihood([1e6], [1e7], count=3)
    assert few.effective.tolist() == [effective_features(3)]
    assert log(few, 4e4) - log(few, 16e4) < 0.5 * loss


def test_channels_without_a_misfit_share_the_error_of_form():
    """Half of the misfit to be explained is distributed among the channels in proportion to their force."""
    one = likelihood([1e4, 0.0], [1e5, 1e5])
    np.testing.assert_allclose(one.explained_squares, [0.5e4 + 0.25e4, 0.25e4])
    assert one.variances()[1] > 1.0
    assert likelihood([-30.0], [1e5]).explained_squares.tolist() == [0.0]


def test_an_effect_errs_by_a_share_of_what_it_explains():
    """One that explains nothing has no tolerance, nor has the plain law: both are judged by the errors of laws."""
    one = likelihood([1e4], [1e6])
    np.testing.assert_allclose(one.explained_by(left(3e3)), [7e3])
    assert one.explained_by(left(2e4)).tolist() == [0.0]
    # With the tolerance for all that the plain law leaves, a model that explains nothing would be hardly worse.
    assert one.judge(left(1e4)).log < one.coarse(left(1e4)) - 50.0
    assert one.judge(left(200.0)).log == pytest.approx(one.coarse(left(200.0)), abs=0.1)


def test_a_law_that_leaves_several_times_the_noise_is_not_called_right():
    """A bump stop in one loop (deck own 087): the law leaves 3 % of the force, 5 times the noise."""
    one = likelihood([1245.0], [138697.0], count=12)
    law = one.judge(left(1245.0)).log
    missing = one.judge_unknown(left(1245.0)).log
    assert missing + np.log(UNKNOWN) > law + 10.0
    # Where it leaves as much as laws usually do, 0.1 % of the force, nothing is missing.
    small = 0.001**2 * 138697.0
    few = likelihood([small], [138697.0], count=12)
    assert few.judge(left(small)).log > few.judge_unknown(left(small)).log + np.log(UNKNOWN) + 5.0


@pytest.mark.parametrize(
    ("channels", "left"),
    [
        (1, 0.84),
        (1, 0.78),
        (2, 0.84),
        (2, 0.78),
    ],
)
def test_the_unknown_effect_beats_a_poor_model(channels, left):
    """A model that leaves 60 to 70 % of the squared misfit (0.78 to 0.84 of its root), with the same odds."""
    plain = [1e5] * channels
    one = likelihood(plain, [5e6] * channels)
    assert unknown(one, *plain) > log(one, *(left**2 * p for p in plain))


@pytest.mark.parametrize("channels", [1, 2])
def test_the_unknown_effect_loses_to_a_good_model(channels):
    plain, force = [1e5] * channels, [5e6] * channels
    one = likelihood(plain, force)
    good = [0.1**2 * p for p in plain]
    assert log(one, *good) > unknown(one, *plain) + 10.0
    # In addition to a good model it costs more than it gains.
    assert log(one, *good) > unknown(one, *good) + np.log(UNKNOWN) + 3.0
    # Where there is only noise, it costs even more.
    still = likelihood([0.0] * channels, force)
    assert log(still, *[0.0] * channels) > unknown(still, *[0.0] * channels) + np.log(UNKNOWN) + 4.0


def test_the_unknown_effect_may_be_in_one_channel_only():
    one = likelihood([1e5, 0.0], [5e6, 5e6])
    assert unknown(one, 1e5, 0.0) - log(one, 1e5, 0.0) > 5.0
    scale = one.judge_unknown(left(1e5, 0.0)).scale
    assert scale[0] > 10.0 * scale[1]


def test_the_scale_is_that_of_what_is_left():
    """The variance by which features are divided grows with the misfit that a model leaves, and is 1 at the noise."""
    one = likelihood([1e6], [1e7])
    assert one.judge(left(0.3**2 * 1e6)).scale[0] > 3.0 * one.judge(left(0.05**2 * 1e6)).scale[0]
    assert one.judge(left(0.3**2 * 1e6)).phi > one.judge(left(0.05**2 * 1e6)).phi
    assert likelihood([0.0], [1e2]).judge(left(0.0)).scale[0] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(("count", "measured"), [(12, 3.1), (50, 9.3), (85, 14.0)])
def test_effective_features_agree_with_participation_ratios(count, measured):
    """Medians from benchmarks/form/results.jsonl of channels with more than noise left; scatter of the log 0.3.

    For a Gaussian sample of m equal features the ratio p is (m + 2) / 3 in the mean, hence m is up to 3 p - 2.
    """
    assert np.log(measured) - 0.3 < np.log(effective_features(count)) < np.log(3.0 * measured - 2.0)


def test_a_recording_in_two_files_says_little_more_than_in_one():
    """Two halves share the effective features of the whole; only the feature along the force is each one's own."""
    whole = likelihood([8e4], [1e6], 2 * COUNT)
    halves = likelihood([4e4, 4e4], [5e5, 5e5])
    assert float(halves.effective.sum()) == pytest.approx(float(whole.effective.sum()) + 1.0)
    for a, b in ((500.0, 2e3), (2e3, 8e3)):
        told = log(whole, 2 * a) - log(whole, 2 * b)
        assert log(halves, a, a) - log(halves, b, b) == pytest.approx(told, rel=0.1)


def test_a_channel_has_no_more_effective_features_than_features():
    counts = (1, 2, 60)
    channels = tuple(likelihood([1e3], [1e5], count).features[0] for count in counts)
    effective = Likelihood(channels, (1e3,) * 3).effective
    assert np.all(effective >= 1.0)
    assert np.all(effective <= counts)


def test_doubt_about_the_noise_takes_part():
    """Noise two fifths larger than estimated: one too much in each of 48 features calls for the unknown effect."""
    too_much = left(1.0 * COUNT)
    known, doubted = (likelihood([0.0], [1e5], doubt=one) for one in (0.0, 0.3))
    gain = [one.judge_unknown(too_much).log - one.judge(too_much).log for one in (known, doubted)]
    assert gain[1] < gain[0] - 2.0
    assert doubted.judge(too_much).scale[0] > 1.5 * known.judge(too_much).scale[0]
    # Without doubt the mean over the noise is the value at its estimate.
    m = known.effective[0]
    log, v = known._log(too_much, known._variances(np.zeros(1), known.effective), known.effective)
    assert v == pytest.approx(1.0)
    assert log == pytest.approx(-0.5 * (m - 1.0 + COUNT) - 0.5 * too_much.along[0])


@pytest.mark.parametrize("doubt", [0.0, 0.2, 0.5])
def test_a_fit_closer_than_noise_earns_no_more_than_under_noise_of_the_estimated_size(doubt):
    """Twelve features of a loop, all but one unit of their sum of squares fitted away, and half of it."""
    few = likelihood([0.0], [1e5], count=12, doubt=doubt)
    exact = likelihood([0.0], [1e5], count=12)
    for short in (-10.0, -5.0):
        gain = few.judge(left(short)).log - few.judge(left(0.0)).log
        known = exact.judge(left(short)).log - exact.judge(left(0.0)).log
        assert 0.5 * known < gain < known + 2.5
