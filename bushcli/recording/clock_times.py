"""Times of day and dates -> seconds since the first: ``10:15:03.25``, ``2026-03-01T10:15:03``, ``3:04:05 PM``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date, datetime

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: An optional date, and a time of day with seconds: 12:34 could be hours and minutes, or minutes and seconds.
_STAMP = re.compile(
    r"(?:(?P<date>[\d./-]{6,10})[ T]\s*)?(?P<hours>\d{1,3}):(?P<minutes>[0-5]\d):(?P<seconds>[0-5]\d(?:[.,]\d{1,9})?)"
    r"(?:\s?(?P<half>[AaPp])\.?[Mm]\.?)?(?:Z|[+-]\d\d:?\d\d)?",
    re.ASCII,
)
_DATES = ("%Y-%m-%d", "%Y/%m/%d", "%Y.%m.%d", "%d.%m.%Y")
_DAY = 86400.0


def clock_times(fields: Sequence[str]) -> Array | None:
    """Return the seconds since the first of several stamps, shape (n,); None if any field is no stamp.

    Stamps without a date may pass midnight. A date whose order of day and month is not certain (03/04/2026) counts only
    where all stamps have the same one.

    Parameters
    ----------
    fields : sequence of str
        Texts of a column.
    """
    stamps = []
    for field in fields:
        stamp = _STAMP.fullmatch(field.strip())
        if stamp is None:
            return None
        stamps.append(stamp)
    if not stamps:
        return None
    seconds = np.array([_seconds(stamp) for stamp in stamps])
    days = _days([stamp["date"] or "" for stamp in stamps], seconds)
    return None if days is None else np.asarray(seconds - seconds[0] + _DAY * (days - days[0]))


def _seconds(stamp: re.Match[str]) -> float:
    """Return the seconds since midnight."""
    hours = int(stamp["hours"])
    if stamp["half"]:
        hours = hours % 12 + (12 if stamp["half"] in "Pp" else 0)
    return 3600.0 * hours + 60.0 * int(stamp["minutes"]) + float(stamp["seconds"].replace(",", "."))


def _days(dates: Sequence[str], seconds: Array) -> Array | None:
    """Return the number of the day of each stamp; None for dates that cannot be read."""
    if len(set(dates)) == 1:
        if dates[0]:
            return np.zeros(len(dates))
        # Without a date, a clock that goes back by most of a day has passed midnight.
        return np.concatenate([[0.0], np.cumsum(np.diff(seconds) < -0.5 * _DAY)])
    for form in _DATES:
        try:
            known = {text: _day(text, form) for text in set(dates)}
        except ValueError:
            continue
        return np.array([float(known[text].toordinal()) for text in dates])
    return None


def _day(text: str, form: str) -> date:
    return datetime.strptime(text, form).date()
