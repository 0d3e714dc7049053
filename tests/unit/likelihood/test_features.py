"""The smooth components of a misfit along the branches, in units of the noise, with calibration factors allowed for."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from bushcli.likelihood.features import features
from bushcli.likelihood.noise import NoiseModel, noise_model
from bushcli.recording import Recording, branches

SIGMA = 4.0
SEEDS = 200


def ramps(*points, samples=40):
    """Equally many samples between successive points, a second apart; two equal points make a hold."""
    q = [np.array([float(points[0])])]
    q += [np.linspace(a, b, samples + 1)[1:] for a, b in pairwise(points)]
    path = np.concatenate(q)
    return np.arange(float(len(path))), path


TIME, Q = ramps(0, 5, 0, 8, 8, 0, -8, 0)
FORCE = 100.0 * Q + 2.0 * Q**3
RECORDING = Recording("axial", Q, FORCE, TIME, name="axial")
ALL = np.ones(len(Q), dtype=bool)


def made(recording=RECORDING, used=ALL, factor=0.0, noise=None):
    return features(recording, noise or NoiseModel(SIGMA), used, factor)


def test_the_basis_is_orthonormal_and_every_feature_is_of_one_branch():
    one = made()
    np.testing.assert_allclose(one.basis.T @ one.basis, np.eye(one.count), atol=1e-12)
    inside = np.zeros_like(one.basis)
    found = branches(RECORDING)
    assert {branch.kind for branch in found} == {"loading", "unloading", "hold"}
    count = 0
    for branch in found:
        here = slice(branch.start, branch.stop)
        own = np.any(one.basis[here] != 0.0, axis=0)
        inside[here, own] = 1.0
        # Six features: degree 5 for some forty samples.
        assert own.sum() == 6
        count += int(own.sum())
    assert count == one.count
    assert not np.any(one.basis[inside == 0.0])


def test_white_noise_makes_features_of_unit_variance():
    one = made()
    rng = np.random.default_rng(1)
    z = np.array([one.of(SIGMA * rng.normal(size=len(Q))) for _ in range(SEEDS)])
    # The sampling error of the mean of chi squares is sqrt(2 / count); four times that fails in one test of 16,000.
    assert np.mean(z**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / z.size))
    correlation = np.corrcoef(z.T) - np.eye(one.count)
    assert np.abs(correlation).max() < 5.0 / np.sqrt(SEEDS)


def test_noise_with_a_memory_counts_no_more_than_white_noise():
    """An autoregression whose correlation of 0.6 is known: four samples count as one."""
    r = 0.6
    one = made(noise=NoiseModel(SIGMA, r))
    rng = np.random.default_rng(2)
    e = rng.normal(size=(SEEDS, len(Q)))
    for i in range(1, len(Q)):
        e[:, i] = r * e[:, i - 1] + np.sqrt(1.0 - r**2) * e[:, i]
    z = np.array([one.of(SIGMA * row) for row in e])
    # The spectrum is largest at zero frequency and lower at a branch's frequencies: `Features.spread` is that ratio.
    assert np.mean(z**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / z.size))
    assert one.spread.min() < 0.95 < one.spread.max() < 1.0


def test_a_common_factor_is_taken_out_as_far_as_calibration_allows():
    factor = 0.005
    one, free = made(factor=factor), made()
    # A cubic in displacement is a cubic in time on each ramp, so that all of it is smooth.
    size = np.linalg.norm(FORCE) / SIGMA
    assert np.linalg.norm(free.of(0.01 * FORCE)) == pytest.approx(0.01 * size, rel=1e-3)
    # A factor of one standard deviation counts for less than one unit, however many samples show it.
    taken = np.linalg.norm(one.whiten(one.of(factor * FORCE), 1.0))
    assert taken == pytest.approx(factor * size / np.sqrt(1.0 + (factor * size) ** 2), rel=1e-3)
    assert factor * size > 3.0
    assert taken < 1.0
    # An error of form adds to the variance of calibration, and does not multiply it.
    wide = np.linalg.norm(one.whiten(one.of(factor * FORCE), 100.0))
    assert wide == pytest.approx(factor * size / np.sqrt(100.0 + (factor * size) ** 2), rel=1e-3)


def test_whitening_can_be_undone():
    one = made(factor=0.005)
    z = one.of(FORCE + 20.0 * np.sin(TIME))
    np.testing.assert_allclose(one.colour(one.whiten(z, 7.0), 7.0), z, rtol=1e-12)


def test_what_is_no_common_factor_is_left_alone():
    one, free = made(factor=0.005), made()
    loop = 20.0 * np.sin(np.pi * TIME / 40.0) * np.sign(np.gradient(Q))
    other = loop - FORCE * (FORCE @ loop) / (FORCE @ FORCE)
    expected = free.of(other)
    np.testing.assert_allclose(one.whiten(one.of(other), 1.0), expected, atol=0.02 * np.linalg.norm(expected))


def test_derivatives_have_the_features_of_their_columns():
    one = made(factor=0.005)
    columns = np.column_stack([FORCE, Q, np.sign(Q)])
    np.testing.assert_allclose(one.of(columns), np.column_stack([one.of(c) for c in columns.T]), atol=1e-9)


def test_samples_that_are_masked_do_not_matter():
    used = ALL.copy()
    used[[10, 60, 61, 150]] = False
    one = made(used=used, factor=0.005)
    assert not one.basis[~used].any()
    misfit = SIGMA * np.random.default_rng(3).normal(size=len(Q))
    wild, unknown = np.where(used, misfit, 1e6), np.where(used, misfit, np.nan)
    for other in (wild, unknown):
        np.testing.assert_array_equal(one.of(other), one.of(misfit))
        np.testing.assert_array_equal(one.shrink(other), one.shrink(misfit))


def test_a_spike_that_is_masked_changes_no_feature():
    """Neither through the smoothed force, along which the common factor acts, nor through the signal."""
    used = ALL.copy()
    used[60] = False
    spiked = replace(RECORDING, force=np.where(used, FORCE, 2.0 * np.abs(FORCE).max()))
    clean, other = (made(one, used, 0.005) for one in (RECORDING, spiked))
    misfit = FORCE * 0.01
    np.testing.assert_allclose(other.of(misfit), clean.of(misfit), rtol=1e-9, atol=1e-9)
    assert other.signal == pytest.approx(clean.signal)


def test_a_hum_contributes_next_to_nothing():
    """Nine periods on each branch of forty samples: polynomials of degree 5 miss it, the noise model does not."""
    hum = 3.0 * SIGMA * np.sin(2.0 * np.pi * TIME / 4.3)
    z = made().of(hum)
    # White noise of the same power would contribute in the ratio of features to samples.
    white = made().count / len(Q) * float(np.sum((hum / SIGMA) ** 2))
    assert float(z @ z) < 0.2 * white
    noisy = replace(RECORDING, force=FORCE + hum + SIGMA * np.random.default_rng(5).normal(size=len(Q)))
    left = noisy.force - FORCE
    z = made(noisy, noise=noise_model(noisy)).of(left)
    # Noise and hum together contribute no more than noise alone should, within three standard errors.
    assert float(z @ z) < len(z) + 3.0 * np.sqrt(2.0 * len(z))


def test_smoothing_keeps_what_is_smooth_and_takes_noise_off():
    one = made()
    smooth = 3.0 * Q - 0.1 * Q**2
    np.testing.assert_allclose(one.shrink(smooth), smooth, atol=SIGMA)
    noise = SIGMA * np.random.default_rng(4).normal(size=len(Q))
    # Six coefficients for forty samples, and a factor of two.
    assert np.std(one.shrink(noise)) < 2.0 * SIGMA * np.sqrt(6.0 / 40.0)


def test_a_recording_without_time_and_with_short_branches_has_features_too():
    time, q = ramps(0, 5, 0, 8, 0, samples=7)
    recording = Recording("axial", q, 100.0 * q, None, name="axial")
    one = made(recording, np.ones(len(time), dtype=bool))
    # Three samples per coefficient leave constant and slope.
    assert 0 < one.count <= 2 * len(branches(recording))
    np.testing.assert_allclose(one.basis.T @ one.basis, np.eye(one.count), atol=1e-12)
