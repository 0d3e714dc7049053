"""Times of day and durations -> seconds since the first: ``2026-03-01T10:15:03``, ``3:04:05 PM``, ``02:07.5``.

The instant of the first is kept, so that the stamps of two columns, or of two groups of a file, can be compared.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: An optional date, and a time of day with seconds: 12:34 could be hours and minutes, or minutes and seconds.
_STAMP = re.compile(
    r"(?:(?P<date>[\d./-]{6,10})[ T]\s*)?(?P<hours>\d{1,3}):(?P<minutes>[0-5]\d):(?P<seconds>[0-5]\d(?:[.,]\d{1,9})?)"
    r"(?:\s?(?P<half>[AaPp])\.?[Mm]\.?)?(?P<zone>Z|[+-]\d\d:?\d\d)?",
    re.ASCII,
)
#: Minutes and seconds; without a fraction they may be hours and minutes, unless the column or the case file says which.
_SHORT = re.compile(r"(?P<first>\d{1,4}):(?P<second>[0-5]\d(?P<fraction>[.,]\d{1,9})?)", re.ASCII)
_SHORT_FORMS = (
    (re.compile(r"(?<![a-z:])m(?:m|in)?\s?:\s?s(?:s|ec)?", re.IGNORECASE), 1.0),
    (re.compile(r"(?<![a-z:])hh?\s?:\s?m(?:m|in)?(?!\w|\s?:)", re.IGNORECASE), 60.0),
)
_DATES = ("%Y-%m-%d", "%Y/%m/%d", "%Y.%m.%d", "%d.%m.%Y")
_DAY = 86400.0
#: Unit that readers give to dates in that zone, and what these count from.
UTC = "UTC"
_EPOCH = date(1970, 1, 1).toordinal()
#: Seconds in an hour, and minutes in a day, by the seconds of the unit.
_ROUND = {1.0: 3600.0, 60.0: 1440.0}


class Instant(NamedTuple):
    """A point in time: what it counts from (``UTC``, ``date``, ``time of day``, or as a format says), and ns since."""

    reference: str
    nanoseconds: int

    @staticmethod
    def of(moment: datetime, reference: str) -> Instant:
        """Return a date and time of day as a point in time since the beginning of 1970."""
        return Instant(reference, (moment - datetime(1970, 1, 1)) // timedelta(microseconds=1) * 1000)


@dataclass(frozen=True)
class ClockTimes:
    """Stamps of a column: s since the first, (n,), and the instant of the first, None where it is not stated."""

    seconds: Array
    begin: Instant | None = None


def times_of(values: NDArray[Any], reference: str = "date") -> ClockTimes | None:
    """Return dates or durations that a file holds as such; None for other values."""
    if values.dtype.kind == "m":
        return ClockTimes(np.asarray(values / np.timedelta64(1, "s"), dtype=np.float64))
    if values.dtype.kind != "M":
        return None
    begin = Instant(reference, int(values[0].astype("M8[ns]").astype(np.int64))) if len(values) else None
    return ClockTimes(np.asarray((values - values[:1]) / np.timedelta64(1, "s"), dtype=np.float64), begin)


def clock_times(fields: Sequence[str], form: str = "") -> ClockTimes | None:
    """Return the seconds since the first of several stamps, shape (n,); None if any field is no stamp.

    Zones, as in ``10:15:03+01:00``, count where all stamps have one. Stamps without a date may pass midnight. A date
    whose order of day and month is not certain (03/04/2026) counts only where all stamps have the same one.
    """
    if fields and is_short(fields[0]):
        short = _short(fields, form)
        return None if short is None else ClockTimes(short)
    stamps = [stamp for field in fields if (stamp := _STAMP.fullmatch(field.strip())) is not None]
    zoned = {stamp["zone"] is not None for stamp in stamps}
    if len(stamps) < len(fields) or len(zoned) != 1:
        return None
    since_midnight, shifts = [], []
    for stamp in stamps:
        hours = int(stamp["hours"])
        if stamp["half"]:
            hours = hours % 12 + (12 if stamp["half"] in "Pp" else 0)
        seconds_of = float(stamp["seconds"].replace(",", "."))
        since_midnight.append(3600.0 * hours + 60.0 * int(stamp["minutes"]) + seconds_of)
        # The difference of the zone to UTC, s.
        zone = (stamp["zone"] or "Z").replace("Z", "+0000").replace(":", "")
        shift = 60.0 * (60 * int(zone[1:3]) + int(zone[3:]))
        shifts.append(-shift if zone[0] == "-" else shift)
    seconds = np.array(since_midnight)
    dates = [stamp["date"] or "" for stamp in stamps]
    days, reference = _days(dates, seconds)
    if days is None:
        return None
    if zoned.pop():
        seconds = seconds - shifts
        reference = UTC if reference == "date" else f"{reference} {UTC}"
    whole = round(float(seconds[0]) * 1e9) + int(days[0]) * int(_DAY) * 10**9
    return ClockTimes(seconds - seconds[0] + _DAY * (days - days[0]), Instant(reference, whole))


def is_short(field: str) -> bool:
    """Whether a field has two numbers, ``12:34`` or ``02:07.5``: minutes and seconds, or hours and minutes."""
    return _SHORT.fullmatch(field.strip()) is not None


def is_form(text: str) -> bool:
    """Whether a text says which numbers such a field has: "mm:ss", "hh:mm"."""
    return any(pattern.fullmatch(text.strip()) for pattern, _ in _SHORT_FORMS)


def _short(fields: Sequence[str], form: str) -> Array | None:
    """Return the seconds since the first of stamps with two numbers, (n,); None where it is not certain which."""
    stamps = [stamp for field in fields if (stamp := _SHORT.fullmatch(field.strip())) is not None]
    unit = next((unit for pattern, unit in _SHORT_FORMS if pattern.search(form)), None)
    # A fraction is one of a second: no program writes fractions of minutes.
    if unit is None and any(stamp["fraction"] for stamp in stamps):
        unit = 1.0
    if unit is None or len(stamps) < len(fields):
        return None
    numbers = np.array([60.0 * int(m["first"]) + float(m["second"].replace(",", ".")) for m in stamps])
    # Two digits of minutes begin again after an hour, those of hours after a day.
    rounds = np.concatenate([[0.0], np.cumsum(np.diff(numbers) < -0.5 * _ROUND[unit])])
    return np.asarray(unit * (numbers - numbers[0] + _ROUND[unit] * rounds))


def _days(dates: Sequence[str], seconds: Array) -> tuple[Array | None, str]:
    """Return the number of the day of each stamp, None for dates that cannot be read, and what the days count from."""
    if not any(dates):
        # Without a date, a clock that goes back by most of a day has passed midnight.
        return np.concatenate([[0.0], np.cumsum(np.diff(seconds) < -0.5 * _DAY)]), "time of day"
    for form in _DATES:
        try:
            days = {text: datetime.strptime(text, form).date() for text in set(dates)}
        except ValueError:
            continue
        return np.array([float(days[text].toordinal() - _EPOCH) for text in dates]), "date"
    return (np.zeros(len(dates)), dates[0]) if len(set(dates)) == 1 else (None, "")
