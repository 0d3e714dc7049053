"""Errors of predictions that a search learns from its fits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect
from bushcli.selection import prediction_errors
from bushcli.selection.model import Model
from bushcli.selection.prediction_errors import NONE, PredictionErrors
from bushcli.selection.queued import Queued

A, B, C = frozenset({"with a"}), frozenset({"with b"}), frozenset({"with c", "without a"})


def test_before_any_fit_no_error_is_expected() -> None:
    assert PredictionErrors().expected_error(A) == NONE


def test_alike_predictions_err_alike() -> None:
    """The fits of one effect found less than predicted; another effect is hardly affected."""
    errors = PredictionErrors()
    for _ in range(3):
        errors.add(A, -18.0, 20.0)
    same, other = errors.expected_error(A), errors.expected_error(B)
    assert same.mean == pytest.approx(-0.9, abs=0.4)
    assert same.mean < 1.5 * other.mean < 0.0


def test_accurate_predictions_make_all_slacks_small() -> None:
    errors, spreads = PredictionErrors(), []
    for i in range(8):
        errors.add(frozenset({f"with {i}"}), 0.2 * (-1.0) ** i, 10.0)
        spreads.append(errors.expected_error(A).spread)
    assert spreads == sorted(spreads, reverse=True)
    assert spreads[-1] < 0.5


def test_no_slack_grows() -> None:
    errors = PredictionErrors()
    errors.add(A, 60.0, 10.0)
    assert errors.expected_error(B).spread == 1.0
    # Errors beyond `MOST` count as `MOST`.
    other = PredictionErrors()
    other.add(A, 10.0 * prediction_errors.MOST, 10.0)
    assert errors.expected_error(A) == other.expected_error(A)


def test_bounds_and_exact_predictions_say_nothing() -> None:
    errors = PredictionErrors()
    errors.add(frozenset(), -50.0, 10.0)
    errors.add(A, 0.1, 0.0)
    errors.add(A, math.nan, 1.0)
    assert errors.expected_error(A) == NONE


def test_it_is_the_conditional_distribution_of_the_stated_one() -> None:
    """Against the joint normal density, whose maximum over the next error is its conditional mean."""
    errors = PredictionErrors()
    sizes = (0.5, -0.2, 0.4)
    for changes, size in zip((A, B, C), sizes, strict=True):
        errors.add(changes, 2.0 * size, 2.0)
    every = (A, B, C, C)
    covariance = np.array(
        [
            [prediction_errors.COMMON**2 + prediction_errors.OF_CHANGE**2 * len(a & b) for b in every]
            for a in every
        ]
    )
    covariance += prediction_errors.OWN**2 * np.eye(4)
    joint = multivariate_normal(np.zeros(4), covariance)
    grid = np.linspace(-1.0, 1.0, 20001)
    density = joint.logpdf(np.column_stack([np.tile(sizes, (len(grid), 1)), grid]))
    assert errors.expected_error(C).mean == pytest.approx(grid[np.argmax(density)], abs=2e-4)
    # The scale: from the curvature of the density, and the share of the squares of the errors per degree of freedom.
    variance = -1.0 / np.polyfit(grid, density, 2)[0] / 2.0
    square = np.array(sizes) @ np.linalg.solve(covariance[:3, :3], sizes)
    scale = (prediction_errors.FREEDOM + square) / (prediction_errors.FREEDOM + 3)
    expected = math.sqrt(variance / covariance[3, 3] * scale)
    assert errors.expected_error(C).spread == pytest.approx(min(expected, 1.0), rel=1e-3)


@pytest.mark.parametrize(
    ("slack", "names", "learns"),
    [(20.0, ["drift"], True), (60.0, ["drift"], False), (60.0, ["drift", "mullins"], True)],
)
def test_fits_of_others_say_nothing_of_a_single_effect_far_from_the_plain_law(slack, names, learns) -> None:
    errors = PredictionErrors()
    errors.add(B, -5.0, 20.0)
    model = Model("neo_hookean", {}, effects=tuple(ActiveEffect(effect(name), {}) for name in names))
    one = Queued(model, None, 0.0, slack=slack, changes=A)
    assert (one.with_expected_error(errors).error != NONE) is learns
