"""Correlated errors of neighbouring samples, from a fit's residuals: closed forms, intervals of drawn recordings."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import toeplitz

from benchmarks.coverage import correlated_errors
from bushcli.curve.misfit import correlation_time
from bushcli.inverse.autoregression import apply_correlation, errors_of
from bushcli.inverse.certainty import uncertainty


def rows_of(n: int) -> np.ndarray:
    """Derivatives of k1 q + k3 q^3 + k5 q^5 along one cycle."""
    q = np.interp(np.linspace(0.0, 1.0, n), [0.0, 0.25, 0.75, 1.0], [0.0, 1.0, -1.0, 0.0])
    return np.column_stack([q, q**3, q**5])


@pytest.mark.parametrize("rho", [0.0, 0.3, 0.95])
def test_product_with_the_correlation_matrix_in_closed_form(rho):
    rows = rows_of(40)
    np.testing.assert_allclose(
        apply_correlation(rho, rows), toeplitz(rho ** np.arange(40)) @ rows, atol=1e-12
    )


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8])
def test_correlation_of_the_errors_not_of_the_residuals(rho):
    """The residuals' own correlation time is far too short, because the fit takes up what varies slowly."""
    rng, rows, found = np.random.default_rng(3), rows_of(61), []
    remove = np.eye(61) - rows @ np.linalg.pinv(rows)
    for _ in range(400):
        residual = remove @ correlated_errors(rng, 61, rho)
        one = errors_of(residual, rows, 3.0)
        found.append((one.correlation, one.variance, correlation_time(residual - residual.mean())))
    # Of 400 recordings, the standard error of the median is 0.01; a ratio of means is not the mean of a ratio (0.03).
    # That of the variance is 4 % for 0.8, whose distribution has a long upper tail (mean 1.2).
    correlation, variance, time = np.median(found, axis=0)
    assert correlation == pytest.approx(rho, abs=0.05)
    assert variance == pytest.approx(1.0, abs=0.1)
    if rho == 0.8:
        assert time < 0.4 * (1 + rho) / (1 - rho)


def test_what_several_recordings_disagree_on_is_no_correlation():
    """A joint fit leaves a part along the rows of each recording; it enlarges the variance alone."""
    rows, error = rows_of(200), correlated_errors(np.random.default_rng(5), 200, 0.4)
    alone, off = (
        errors_of(error + rows @ part, rows, 1.5) for part in (np.zeros(3), np.array([4.0, -2.0, 1.0]))
    )
    assert off.correlation == pytest.approx(alone.correlation, abs=1e-9)
    assert off.variance > 2.0 * alone.variance


@pytest.mark.parametrize(
    "residual", [np.zeros(50), np.full(50, 2.0), np.arange(8.0)], ids=["zero", "constant", "short"]
)
def test_nothing_to_correlate(residual):
    one = errors_of(residual, rows_of(len(residual)), 3.0)
    assert (one.correlation, one.time) == (0.0, 1.0)


def test_intervals_of_short_correlated_recordings_hold_the_truth():
    """All errors of 61 samples correlate by 0.8: 95 % of the intervals of k1 hold 0, the parameter of drawn noise.

    The standard error of 400 draws is 1.1 %. benchmarks/coverage.py has more; before, 83 % of those of k1 did.
    """
    rng, rows, count = np.random.default_rng(7), rows_of(61), 0
    for _ in range(400):
        force = correlated_errors(rng, 61, 0.8)
        x = np.linalg.lstsq(rows, force, rcond=None)[0]
        channel = SimpleNamespace(scale=np.ones(61), measured=force)
        found = uncertainty(SimpleNamespace(channels=[channel], forces=lambda x: [(rows @ x, rows)]), x)
        count += bool(abs(x[0]) < found.quantile * np.sqrt(found.covariance[0, 0]))
    assert 0.92 <= count / 400 <= 0.99
