"""Numbers beside a limit are shown with enough digits to see on which side of it they are."""

from __future__ import annotations

import pytest

from bushcli.report.quantity import beside, percent
from bushcli.report.verdict import stiffer


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
    assert beside(value, limit) == shown


@pytest.mark.parametrize("off", [10.001, 10.3, 10.49, 0.2003])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_what_is_outside_never_reads_as_the_limit(off: float, side: float) -> None:
    limit = 10.0 if off > 10.0 else 0.2
    text = stiffer(1.0 + side * off / 100.0, limit)
    assert float(text.split()[0]) > limit
    assert ("soft" in text) == (side < 0.0)
    assert float(percent(off, limit).split()[0]) > limit
    assert stiffer(1.001, 10.0) == "as stiff as measured"
