"""Outliers of like parts: published examples, the stated probability of a false alarm, and few parts."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.study.outliers import FALSE_ALARM, FEWEST, find_outliers, foreign, tolerance_factor

# Rosner (1983), example of the generalised test: three outliers at a false-alarm probability of 5 %.
ROSNER = np.fromstring(
    """
    -0.25 0.68 0.94 1.15 1.20 1.26 1.26 1.34 1.38 1.43 1.49 1.49 1.55 1.56 1.58 1.65 1.69 1.70
    1.76 1.77 1.81 1.91 1.94 1.96 1.99 2.06 2.09 2.10 2.14 2.15 2.23 2.24 2.26 2.35 2.37 2.40
    2.47 2.54 2.62 2.64 2.90 2.92 2.92 2.93 3.21 3.26 3.30 3.59 3.68 4.30 4.64 5.34 5.42 6.01
    """,
    sep=" ",
)


def test_rosners_example_has_three_outliers() -> None:
    found, deviation = find_outliers(ROSNER)
    assert sorted(ROSNER[found]) == [5.34, 5.42, 6.01]
    like = ROSNER[~found]
    assert deviation[-1] == pytest.approx((6.01 - like.mean()) / like.std(ddof=1))


@pytest.mark.parametrize("count", [6, 10, 15, 20, 30])
def test_batches_without_outliers_have_one_as_often_as_stated(count: int) -> None:
    draw, runs = np.random.default_rng(11), 2000
    alarms = sum(find_outliers(draw.standard_normal(count))[0].any() for _ in range(runs))
    # Three standard deviations of a binomial count.
    assert abs(alarms / runs - FALSE_ALARM) < 3.0 * np.sqrt(FALSE_ALARM / runs)


def test_a_further_value_is_foreign_as_often_as_stated() -> None:
    draw, runs = np.random.default_rng(12), 2000
    alarms = sum(foreign(draw.standard_normal(), draw.standard_normal(15), 1) for _ in range(runs))
    assert abs(alarms / runs - FALSE_ALARM) < 3.0 * np.sqrt(FALSE_ALARM / runs)


def test_several_outliers_do_not_mask_each_other() -> None:
    values = np.concatenate([np.random.default_rng(1).standard_normal(17), [9.0, 9.1, 9.2]])
    assert list(np.flatnonzero(find_outliers(values)[0])) == [17, 18, 19]


@pytest.mark.parametrize("values", [[1.0, 1.0, 1.0, 1.0, 1.0, 1.0], [1.0, 2.0, 90.0][:FEWEST]])
def test_equal_or_few_values_have_no_outliers(values: list[float]) -> None:
    assert not find_outliers(np.array(values))[0].any()


def test_the_factor_of_the_tolerance_band_is_the_published_one() -> None:
    # NIST/SEMATECH e-Handbook of Statistical Methods, section 7.2.6.3: 43 parts, 90 % of all with 99 % confidence.
    assert tolerance_factor(43, 0.90, 0.99) == pytest.approx(2.217, abs=1e-3)
    assert np.isnan(tolerance_factor(1))
