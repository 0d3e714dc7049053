"""Autocorrelation, intervals and leverage, against closed forms."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bushcli.inverse.certainty import autocorrelation_time, directions, invert_information, leverage
from bushcli.inverse.result import NORMAL, Estimate


def test_white_noise_has_no_memory():
    error = np.random.default_rng(0).standard_normal(20_000)
    # The standard error of the time of n samples within a window w is sqrt(2 (2 w + 1) / n), here 3 %.
    assert autocorrelation_time(error) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("rho", [0.3, 0.6, 0.9])
def test_first_order_autoregression_in_closed_form(rho):
    """The sum over all lags of rho^|k| is (1 + rho) / (1 - rho)."""
    rng = np.random.default_rng(1)
    error = np.zeros(40_000)
    for i, shock in enumerate(rng.standard_normal(len(error) - 1)):
        error[i + 1] = rho * error[i] + shock
    # rho = 0.9: window 95, standard error sqrt(2 * 191 / 40000) = 10 %; Sokal's window leaves exp(-5) out.
    assert autocorrelation_time(error) == pytest.approx((1 + rho) / (1 - rho), rel=0.2)


@pytest.mark.parametrize(
    "error", [np.zeros(50), np.ones(50), np.arange(5.0)], ids=["zero", "constant", "short"]
)
def test_nothing_to_correlate(error):
    assert autocorrelation_time(error) == 1.0


def test_autocorrelation_is_limited_by_the_recording():
    assert autocorrelation_time(np.linspace(-1, 1, 100)) <= 25.0


class Linear:
    """Two channels whose forces are linear in two parameters."""

    names = ("a", "b")

    def __init__(self):
        q = np.linspace(0.1, 1.0, 20)
        self.slopes = [np.column_stack([q, q**3]), np.column_stack([2 * q, 0.5 * q**2])]
        self.channels = [
            SimpleNamespace(name=name, scale=np.full(20, scale), measured=np.zeros(20))
            for name, scale in (("one", 0.1), ("two", 0.3))
        ]

    def forces(self, x):
        return [(slope @ x, slope) for slope in self.slopes]

    def solve(self, targets):
        weights = [1 / (c.scale * np.sqrt(20)) for c in self.channels]
        rows = np.vstack([s * w[:, None] for s, w in zip(self.slopes, weights, strict=True)])
        wanted = np.concatenate([t * w for t, w in zip(targets, weights, strict=True)])
        return np.linalg.lstsq(rows, wanted, rcond=None)[0]


def test_leverage_against_a_finite_change_of_a_force():
    """Raise the force of a channel by 1 % and fit again: for a linear model the first order is exact."""
    problem, x = Linear(), np.array([2.0, -0.5])
    found = leverage(problem, x)
    clean = [force for force, _ in problem.forces(x)]
    for i, name in enumerate(("one", "two")):
        moved = problem.solve([force * (1.01 if k == i else 1.0) for k, force in enumerate(clean)])
        assert list(found[name].values()) == pytest.approx(list(moved / x - 1), rel=1e-9)
    # Raising all channels together only scales the law.
    for parameter in problem.names:
        assert sum(changes[parameter] for changes in found.values()) == pytest.approx(0.01, rel=1e-9)


def test_parameters_in_very_different_units_are_inverted_as_well_as_equal_ones():
    """A force offset in N beside a compliance in mm/N: information from 1e-6 to 1e12, correlated by 0.99."""
    correlation = np.array([[1.0, 0.99, 0.1], [0.99, 1.0, 0.1], [0.1, 0.1, 1.0]])
    size = np.array([1e-3, 1.0, 1e6])
    found, is_open = invert_information(correlation * np.outer(size, size))
    np.testing.assert_allclose(found * np.outer(size, size), np.linalg.inv(correlation), rtol=1e-9)
    assert not is_open.any()


def test_parameters_without_information_are_open_and_the_others_are_not():
    information = np.diag([4.0, 0.0, 9e12])
    found, is_open = invert_information(information)
    assert list(is_open) == [False, True, False]
    assert np.diag(found)[[0, 2]] == pytest.approx([1 / 4, 1 / 9e12])
    # Two parameters with one and the same influence.
    _, is_open = invert_information(np.array([[1.0, 1e3, 0.0], [1e3, 1e6, 0.0], [0.0, 0.0, 1.0]]))
    assert list(is_open) == [True, True, False]


def test_the_interval_of_a_time_is_that_of_its_logarithm_and_of_an_amplitude_that_of_its_size():
    time, amplitude, law = (
        Estimate(2.0, 1.0, 0.0, 100.0, False, scale=scale) for scale in ("logarithm", "effect", "straight")
    )
    factor = np.exp(0.5 * NORMAL)
    assert time.range95 == pytest.approx((2.0 / factor, 2.0 * factor))
    assert amplitude.range95 == pytest.approx((2.0 - NORMAL, 2.0 + NORMAL))
    assert law.range95 is None


def left_open(*columns, names=("C10", "C20", "C30", "g1")):
    """What curves with these derivatives, per relative change of four parameters, leave open."""
    jacobian = np.column_stack(columns)
    problem = SimpleNamespace(names=names, samples=len(jacobian), jacobian=lambda x: jacobian)
    return directions(problem, np.ones(4))[1]


def test_parameters_of_which_all_combinations_are_open_are_named_once():
    """Two orthogonal combinations of C20 and C30 were both said to be the only one that is open."""
    q = np.linspace(-1.0, 1.0, 40)
    determined, other = q, 0.3 * np.sign(q)
    (both,) = left_open(determined, 1e-4 * q**3, 1e-5 * q**5, other)
    assert both.text == "C20 and C30 are not determined by these curves, alone or jointly"
    assert both.weights == {"C20": 1.0, "C30": 1.0}
    assert both.singular_value < 1e-3
    (one,) = left_open(determined, 0.3 * q**3, 1e-5 * q**5, other)
    assert one.text == "C30 is not determined by these curves"
    (joint,) = left_open(determined, q**3, -(q**3) + 1e-5 * q**2, other)
    assert joint.text.startswith(
        "C20 and C30 can only be determined jointly: changing C20 by +71 %, C30 by +71 %"
    )
    alone, joint = left_open(determined, q**3, -(q**3), 1e-5 * q**2)
    assert alone.text == "g1 is not determined by these curves"
    assert set(joint.weights) == {"C20", "C30"}
    assert left_open(determined, q**3, q**5, other) == ()
