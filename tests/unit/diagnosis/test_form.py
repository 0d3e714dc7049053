"""The likelihood: the noise's where the misfit is small, and as sharp as formulas deserve where it is large."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.diagnosis.likelihood.features import Features
from bushcli.diagnosis.likelihood.form import Left, Likelihood, effective_features
from bushcli.diagnosis.prior import UNKNOWN

COUNT = 48


def likelihood(plain, signal, count=COUNT):
    """Of channels that have so much misfit of the plain law, and so much force, in units of the noise squared."""
    channels = tuple(
        Features(
            np.zeros((0, count)), np.zeros(0), np.zeros(count), 0.0, float(one), np.zeros(count, dtype=int)
        )
        for one in signal
    )
    return Likelihood(channels, tuple(map(float, plain)))


def left(*excess):
    """So much beyond noise, which makes one unit of the feature along the force."""
    found = np.array(excess, dtype=float)
    return Left(found, np.ones(len(found)), found)


def log(one, *excess):
    return one.judge(left(*excess)).log


def unknown(one, *excess):
    return one.judge_unknown(left(*excess)).log


def test_small_misfits_are_judged_by_the_noise():
    """The plain law is at the noise, formulas err by a tenth of it: half the difference of the sums of squares."""
    one = likelihood([2.0], [1e4])
    for a, b in ((0.0, 4.0), (-3.0, 2.0), (5.0, 25.0)):
        assert log(one, a) - log(one, b) == pytest.approx(0.5 * (b - a), rel=0.03)


# Squared misfit of the plain law in units of the noise, and over that of the force: a loop of 15 % on a rig with noise
# of 0.1 to 1 % of the range and a few hundred samples.
@pytest.mark.parametrize(("plain", "share"), [(1e4, 0.02), (1e6, 0.02), (1e6, 0.2)])
def test_two_formulas_of_one_physics_are_not_told_apart_and_another_physics_is(plain, share):
    """Misfit over that of the plain law, of shared/diagnosis.md: friction 0.098 and viscosity 0.086 on one rate, and
    friction in place of Mullins softening 0.86."""
    one = likelihood([plain], [plain / share])
    viscosity, friction, wrong = (log(one, ratio**2 * plain) for ratio in (0.086, 0.098, 0.86))
    assert 0.5 < viscosity - friction < 2.0
    assert friction - wrong > 10.0
    # Noise alone would be sure.
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
    """Ten times the samples, ten times all sums of squares: misfits keep their ratios."""

    def apart(samples):
        one = likelihood([1e5 * samples], [1e7 * samples])
        return log(one, 1e3 * samples) - log(one, 4e3 * samples)

    # v is 1 + what formulas err by, some 50 here: the 1 is left over.
    assert apart(10.0) == pytest.approx(apart(1.0), abs=0.1)
    assert apart(100.0) == pytest.approx(apart(10.0), abs=0.02)


def test_a_misfit_is_worth_its_effective_features():
    """Twice the misfit costs at most m log 2 per channel, and most of that where phi is known to be smaller."""
    one = likelihood([1e6], [1e7])
    loss = log(one, 0.2**2 * 1e6) - log(one, 0.4**2 * 1e6)
    (m,) = one.effective
    assert 0.5 * m * np.log(2.0) < loss < 2.0 * m * np.log(2.0)
    few = likelihood([1e6], [1e7], count=3)
    assert few.effective.tolist() == [effective_features(3)]
    assert log(few, 4e4) - log(few, 16e4) < 0.5 * loss


def test_channels_without_a_misfit_share_the_error_of_form():
    """An effect that changes one channel most is as wrong in another one as in that: half by the force."""
    one = likelihood([1e4, 0.0], [1e5, 1e5])
    np.testing.assert_allclose(one.explained, [0.5e4 + 0.25e4, 0.25e4])
    assert one.variances()[1] > 1.0
    assert likelihood([-30.0], [1e5]).explained.tolist() == [0.0]


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
    """One that leaves 60 to 70 % of the squared misfit (0.78 to 0.84 of its root), with the same odds."""
    plain = [1e5] * channels
    one = likelihood(plain, [5e6] * channels)
    assert unknown(one, *plain) > log(one, *(left**2 * p for p in plain))


@pytest.mark.parametrize("channels", [1, 2])
def test_the_unknown_effect_loses_to_a_good_model(channels):
    plain, force = [1e5] * channels, [5e6] * channels
    one = likelihood(plain, force)
    good = [0.1**2 * p for p in plain]
    assert log(one, *good) > unknown(one, *plain) + 10.0
    # Beside a model that is good already it does not pay.
    assert log(one, *good) > unknown(one, *good) + np.log(UNKNOWN) + 3.0
    # And where there is nothing but noise, even less.
    still = likelihood([0.0] * channels, force)
    assert log(still, *[0.0] * channels) > unknown(still, *[0.0] * channels) + np.log(UNKNOWN) + 4.0


def test_the_unknown_effect_may_be_in_one_channel_only():
    one = likelihood([1e5, 0.0], [5e6, 5e6])
    assert unknown(one, 1e5, 0.0) - log(one, 1e5, 0.0) > 5.0
    scale = one.judge_unknown(left(1e5, 0.0)).scale
    assert scale[0] > 10.0 * scale[1]


def test_the_scale_is_that_of_what_is_left():
    """The variance by which features are divided grows with what the best model leaves, and is 1 at the noise."""
    one = likelihood([1e6], [1e7])
    assert one.judge(left(0.3**2 * 1e6)).scale[0] > 3.0 * one.judge(left(0.05**2 * 1e6)).scale[0]
    assert one.judge(left(0.3**2 * 1e6)).phi > one.judge(left(0.05**2 * 1e6)).phi
    assert likelihood([0.0], [1e2]).judge(left(0.0)).scale[0] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(("count", "measured"), [(12, 3.1), (50, 9.3), (85, 14.0)])
def test_effective_features_agree_with_participation_ratios(count, measured):
    """Medians in benchmarks/form/results.jsonl of the channels where more than noise is left; scatter of the log 0.3.

    The ratio p of one Gaussian sample of m equal features is (m + 2) / 3 in the mean, and m where one is all.
    """
    assert np.log(measured) - 0.3 < np.log(effective_features(count)) < np.log(3.0 * measured - 2.0)
