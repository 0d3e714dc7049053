"""Time stamps of a recording: repaired if only the stamps are wrong, refused if the samples are out of order.

These faults are repaired, and the number of repairs is reported:

- A row that repeats the one before it, time included, is left out.
- Stamps written with too few digits: two and more samples share each stamp, and equal intervals explain all of them to
  within a digit. They get these intervals.
- Single wrong stamps, at most one in a hundred, between samples at equal intervals: they are interpolated.

Everything else (a clock that restarts, runs backwards or stands still for long) is refused: the samples may belong to
several recordings.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.curve import SMALLEST_STEP
from bushcli.curve.segment import segment
from bushcli.errors import RecordingError
from bushcli.recording.header.columns import Column
from bushcli.recording.source import Source
from bushcli.recording.text.table import Table

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Share of stamps that may be wrong, and share of an interval by which equal intervals may differ from each other.
_MOST_WRONG, _EQUAL = 0.01, 0.05
#: Least number of repeated stamps that make a pattern.
_FEWEST = 10
#: Largest share that noise may add to the travelled path where the time is computed from a speed.
_MOST_NOISE = 0.05


def clock(
    table: Table, stamps: Column, displacement: Array, force: Array
) -> tuple[Array, Mask, tuple[str, ...]]:
    """Return the times of the samples that are kept, s, which of the samples (n,) these are, and what was repaired."""
    kept = np.ones(len(force), dtype=bool)
    kept[1:] = np.logical_or.reduce([one[1:] != one[:-1] for one in (stamps.values, displacement, force)])
    time = stamps.values[kept]
    wrong = int(np.count_nonzero(np.diff(time) <= 0))
    if not wrong:
        return time, kept, ()
    label = table.label(stamps.index)
    even = even_stamps(stamps.values)
    if even is not None:
        # Equal rows may be samples of a rig that holds: with the stamps repaired all are kept.
        step = float(even[1] - even[0])
        repeated = int(np.count_nonzero(np.diff(stamps.values) == 0))
        what = (
            f"{label}: {repeated} of {len(even)} time stamps repeat the one before them, because they are written with "
            f"too few digits; equal intervals of {step:.6g} s agree with all of them and are used instead"
        )
        return even, np.ones_like(kept), (what,)
    mended, count = _single(time)
    if mended is not None:
        stamps_ = (
            "an isolated time stamp that breaks" if count == 1 else f"{count} isolated time stamps that break"
        )
        are = "is" if count == 1 else "are"
        what = f"{label}: {stamps_} the equal intervals of the samples {are} interpolated"
        return mended, kept, (what,)
    raise _refused(table, stamps.index, stamps.values, ~kept)


def even_stamps(stamps: Array) -> Array | None:
    """Return times (n,) at equal intervals that explain stamps (n,) with too few digits, or None."""
    steps = np.diff(stamps)
    if (steps < 0).any() or not (steps > 0).any():
        return None
    digit = float(steps[steps > 0].min())
    n = np.arange(len(stamps), dtype=float)
    # At the first sample of a new stamp the true time is just beyond the stamp: these samples determine the intervals.
    first = np.concatenate([[False], steps > 0])
    if first.sum() < 3 or (steps == 0).sum() < _FEWEST:
        return None
    slope, begin = np.polynomial.polynomial.polyfit(n[first], stamps[first], 1)[::-1]
    # With fewer than two samples per stamp, an inserted row looks the same.
    if not slope > 0 or slope > 0.5 * digit:
        return None
    even = begin + slope * n
    explained = np.abs(even - stamps - 0.5 * (even - stamps).max() - 0.5 * (even - stamps).min())
    return even - even[0] + stamps[0] if explained.max() <= 1.02 * 0.5 * (digit + slope) else None


def _single(time: Array) -> tuple[Array | None, int]:
    """Return times with single wrong stamps interpolated, and the number of these; None where that is unsafe."""
    interval = float(np.median(np.diff(time)))
    if not interval > 0:
        return None, 0
    n = np.arange(len(time), dtype=float)
    offset = float(np.median(time - interval * n))
    # A slow drift of the clock is not a fault: only neighbours are compared.
    bad = np.zeros(len(time), dtype=bool)
    for i in np.flatnonzero(np.diff(time) <= 0):
        for j in (i, i + 1):
            before, after = time[j - 1] if j > 0 else -np.inf, time[j + 1] if j + 1 < len(time) else np.inf
            if not before < time[j] < after and abs(after - before - 2 * interval) <= 2 * _EQUAL * interval:
                bad[j] = True
                break
        else:
            return None, 0
    if bad.mean() > _MOST_WRONG or not np.isfinite(offset):
        return None, 0
    mended = time.copy()
    mended[bad] = np.interp(n[bad], n[~bad], time[~bad])
    return (mended, int(bad.sum())) if (np.diff(mended) > 0).all() else (None, 0)


def _refused(table: Table, index: int, time: Array, repeated: Mask) -> RecordingError:
    """Return the error for a time that does not increase."""
    wrong = np.flatnonzero((np.diff(time) <= 0) & ~repeated[1:])
    row = int(wrong[0]) + 1
    now, before = table.text(row, index), table.text(row - 1, index)
    what = f"{table.label(index)}: the time does not increase, {now} follows {before}"
    if len(wrong) > 1:
        what += f", and likewise in {len(wrong) - 1} more {'rows' if len(wrong) > 2 else 'row'}"
    back = (np.diff(time)[wrong] < 0).any()
    expected = (
        "write each recording into a file of its own, with its rows in the order of time; or, if the rows are those of "
        'one test in its order, read them without these stamps: columns = {time = "none"} in the table of the case '
        "file, with sample_rate if the samples are at equal intervals"
        if back
        else "write the time with more digits; of rows with the same time keep the one measured at that time"
    )
    return table.refused(what, expected, row)


def increasing(table: Table, stamps: Column) -> Array:
    """Return the times of a program, (n,), s; a program is written by the user, so nothing is repaired."""
    if (np.diff(stamps.values) <= 0).any():
        raise _refused(table, stamps.index, stamps.values, np.zeros(len(stamps.values), dtype=bool))
    return stamps.values


def missing_time(source: Source, table: Table, displacement: Array) -> tuple[Array | None, str]:
    """Return the time of a file without one, from the sampling rate or the speed of the test, and a remark about it."""
    if source.sample_rate is not None:
        what = f"no column has the time; it is computed from {source.sample_rate:g} samples per second"
        return np.arange(len(displacement)) / source.sample_rate, what
    if source.rate is None:
        return None, ""
    steps = np.abs(np.diff(displacement))
    if (steps <= SMALLEST_STEP * float(np.ptp(displacement))).any():
        row = int(np.argmin(steps)) + 1
        what = "rate: the displacement does not move, so the time cannot be computed from the speed"
        raise table.refused(what, "give sample_rate, samples per second", row)
    ends = [0, *(branch.stop - 1 for branch in segment(displacement))]
    way = float(np.abs(np.diff(displacement[ends])).sum())
    if steps.sum() > (1.0 + _MOST_NOISE) * way:
        what = f"rate: noise makes the travelled path {steps.sum() / way:.3g} times as long as its program"
        raise table.refused(what, "give sample_rate, samples per second")
    time = np.concatenate([[0.0], np.cumsum(steps)]) / source.rate
    return (
        time,
        "no column has the time; it is computed from the travelled path and the rate that the case gives",
    )
