"""Intervals in the table of parameters: digits by their width, and the reason for each end."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bushcli.cli.progress import progress_line
from bushcli.inverse import Evaluation
from bushcli.report.views.inverse import estimate_table


@pytest.mark.parametrize(
    ("interval", "limits", "shown", "flag"),
    [
        ((0.11754, 0.11828), ("misfit", "misfit"), "0.11754 to 0.11828", ""),
        ((0.000732, 0.00217), ("misfit", "misfit"), "0.000732 to 0.00217", ""),
        ((0.1, 0.4), ("stability", "misfit"), "0.100 to 0.400", "lower end: limited by the law's stability"),
        ((0.1, 0.4), ("misfit", "unsolvable"), "0.100 to 0.400", "upper end: limited by failed simulations"),
        ((float("-inf"), 0.4), ("open", "misfit"), "below 0.400", ""),
        ((0.1, float("inf")), ("misfit", "open"), "above 0.100", ""),
    ],
)
def test_interval_with_the_digits_of_its_width_and_what_ends_it(fit, interval, limits, shown, flag):
    estimates = dict(fit.parameters)
    estimates["C10"] = replace(estimates["C10"], interval=interval, limits=limits)
    row = estimate_table(replace(fit, parameters=estimates)).rows[0]
    assert row[4] == shown
    assert row[-1] == flag


def test_a_line_of_progress_has_misfit_iteration_and_parameters():
    found = Evaluation(4, {"C10": 0.11791, "C20": -0.0067}, 4.0, True, iteration=2)
    shown = "4 misfit 2 it 2 C10 0.11791 C20 -0.0067 best"
    assert " ".join(progress_line(found).split()) == shown
    failed = replace(found, number=5, cost=float("nan"), best=False)
    assert "no solution" in progress_line(failed)
    # The columns of the parameters are aligned.
    scaled = Evaluation(1, {"C10": 0.5, "C20": -0.05}, 248000.0, True)
    profiled = replace(found, stage="profile", start=0)
    assert len({progress_line(e).index("C10") for e in (found, failed, scaled, profiled)}) == 1
