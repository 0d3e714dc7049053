"""Numbers beside a limit are shown with enough digits to see on which side of it they are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bushcli.recording import Recording
from bushcli.recording.source import Source, Specimen
from bushcli.report.quantity import number, percent
from bushcli.report.verdict import stiffer
from bushcli.report.views.study import share_percent
from bushcli.runtime.digits import with_decimals, with_digits
from bushcli.standards.observed import observe
from bushcli.standards.standard import speed_clause


@pytest.mark.parametrize(
    ("value", "limit", "shown"),
    [
        (10.3, 10.0, "10.3"),
        (10.04, 10.0, "10.04"),
        (9.96, 10.0, "9.96"),
        (10.0, 10.0, "10"),
        (12.4, 10.0, "12"),
    ],
)
def test_digits_show_the_side_of_the_limit(value: float, limit: float, shown: str) -> None:
    assert with_decimals(value, limit) == shown


@pytest.mark.parametrize("off", [10.001, 10.3, 10.49, 0.2003])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_what_is_outside_never_reads_as_the_limit(off: float, side: float) -> None:
    limit = 10.0 if off > 10.0 else 0.2
    text = stiffer(1.0 + side * off / 100.0, limit)
    assert float(text.split()[0]) > limit
    assert ("soft" in text) == (side < 0.0)
    assert float(percent(off, limit).split()[0]) > limit
    assert stiffer(1.001, 10.0) == "as stiff as measured"


def test_significant_digits_and_several_limits() -> None:
    """140.3 is a limit of a study, 0.1 % one of a design, 450 and 550 mm/min those of ISO 37."""
    shown = [number(value, 4, (103.7, 140.28)) for value in (140.29, 140.27, 120.0)]
    assert shown == ["140.3", "140.27", "120.0"]
    assert with_digits(550.3, 450.0, 550.0) == "550.3"
    assert with_digits(500.3, 450.0, 550.0) == "500"
    assert share_percent(0.9999) == "99.99 %"
    assert share_percent(1.0) == "100.0 %"
    assert share_percent(1e-4) == "0.01 %"


def test_the_speed_of_a_test_shows_why_it_is_none_of_the_standard() -> None:
    """0.3668 / s of a gauge length of 25 mm is 550.2 mm/min; 550 is allowed."""
    seen = replace(observe(Recording("uniaxial", [0.0, 1.0], [0.0, 1.0], time=[0.0, 2.726])), rates=(0.3668,))
    source = Source("uniaxial", Path("pull.csv"), specimen=Specimen(gauge_length=25.0))
    clause = speed_clause(seen, source, ((500.0, 50.0),))
    assert (clause.found, clause.met) == ("550.2 mm/min", False)
