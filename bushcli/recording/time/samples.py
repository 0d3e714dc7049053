"""Columns -> samples: time stamps repaired, computed, or refused if the samples are out of order; rows left out.

These faults are repaired, and a remark says so:

- A row that repeats the one before it, time included, is left out.
- Stamps written with too few digits: two and more samples share each stamp, and equal intervals explain all of them to
  within a digit. They get these intervals.
- Single wrong stamps, at most one in a hundred, between samples at equal intervals: they are interpolated.
- Rows between the updates of a channel that was logged more slowly than the others: they are left out.

Everything else (a clock that restarts, runs backwards or stands still for long) is refused: the samples may belong to
several recordings.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.curve import SMALLEST_STEP
from bushcli.curve.recording import Repair
from bushcli.curve.segment import segment
from bushcli.errors import RecordingError
from bushcli.recording.header.columns import Column
from bushcli.recording.source import Source
from bushcli.recording.text.table import Table

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Share of stamps that may be wrong, and share of an interval by which equal intervals may differ from each other.
_MOST_WRONG, _EQUAL = 0.01, 0.05
#: Largest share that noise may add to the travelled path where the time is computed from a speed.
_MOST_NOISE = 0.05
#: Least number of repeated stamps, or of runs of equal samples, that make a pattern.
_FEWEST = 10
#: Least share of runs that last k rows, and a multiple of k rows.
_MOST_K, _MULTIPLE = 0.7, 0.97
#: Least change of the channel in steps of the converter, and share of the runs in which the other channel changes.
_STEPS, _GOES_ON = 3.0, 0.8


@dataclass(frozen=True)
class Samples:
    """The rows of a table that are samples, their times, and what was changed.

    Attributes
    ----------
    rows : (n,) array of int
        From 0.
    time : (n,) array or None
        s.
    repeated : tuple of int
        Rows, from 0, that were left out because they repeat the row before them, time included.
    repairs : tuple of Repair
    """

    rows: NDArray[np.int_]
    time: Array | None
    repeated: tuple[int, ...] = ()
    repairs: tuple[Repair, ...] = ()

    def select(self, mask: Mask, *repairs: Repair) -> Samples:
        """Return some of the samples (n,)."""
        time = None if self.time is None else self.time[mask]
        return replace(self, rows=self.rows[mask], time=time, repairs=(*self.repairs, *repairs))


def samples_with_times(
    table: Table, source: Source, stamps: Column | None, moved: Column, forced: Column, fewest: int
) -> Samples:
    """Return the samples with their times, repaired or computed as the case specifies."""
    if stamps is None:
        time, text = _missing_time(source, table, moved.values)
        repairs = (Repair("columns", text),) if text else ()
        samples = Samples(np.arange(len(moved.values)), time, repairs=repairs)
    else:
        for key in ("sample_rate", "rate"):
            if getattr(source, key) is not None:
                what = f"{key} has no meaning: {table.label(stamps.index)} gives the time"
                raise table.refusal(what, f"delete {key} from the case file")
        mask: Mask = np.ones(len(table), dtype=bool)
        channels = (stamps.values, moved.values, forced.values)
        mask[1:] = np.logical_or.reduce([values[1:] != values[:-1] for values in channels])
        time, mask, text = _repair_times(table, stamps, mask)
        if mask.sum() < fewest:
            raise table.refusal(f"has only {mask.sum()} different rows", f"at least {fewest}")
        repairs = (Repair("time", text),) if text else ()
        samples = Samples(np.flatnonzero(mask), time, tuple(map(int, np.flatnonzero(~mask))), repairs)
    for channel, other in ((forced, moved), (moved, forced)):
        new = _updates(channel.values[samples.rows], other.values[samples.rows])
        if not new.all() and new.sum() >= fewest:
            text = f"{table.label(channel.index)} is updated only every {len(new) / new.sum():.3g} rows; the "
            text += f"{int((~new).sum())} of {len(new)} rows between, which repeat it, are left out"
            return samples.select(new, Repair("stuck", text))
    return samples


def _updates(values: Array, other: Array) -> Mask:
    """Return whether each row (n,) has a new value of a channel that is updated every k-th row; of others all have."""
    changes = np.flatnonzero(np.diff(values) != 0.0) + 1
    runs = np.diff(changes)
    stride = int(np.bincount(runs).argmax()) if len(changes) >= _FEWEST else 1
    is_slower = (
        stride > 1
        and np.mean(runs == stride) >= _MOST_K
        and np.mean(runs % stride == 0) >= _MULTIPLE
        and np.median(np.abs(np.diff(values)[changes - 1])) >= _STEPS * np.diff(np.unique(values)).min()
        and np.mean([np.ptp(other[a:b]) > 0.0 for a, b in pairwise(changes)]) >= _GOES_ON
    )
    stride = stride if is_slower else 1
    return np.asarray(np.arange(len(values)) % stride == np.bincount(changes % stride, minlength=1).argmax())


def _repair_times(table: Table, stamps: Column, mask: Mask) -> tuple[Array, Mask, str]:
    """Return the times of the samples that are kept, s, which of the rows (n,) these are, and what was repaired."""
    time, label, text = stamps.values[mask], table.label(stamps.index), ""
    if (np.diff(time) <= 0).any():
        even = even_stamps(stamps.values)
        single = _with_single(time) if even is None else None
        if even is not None:
            # Equal rows may be samples of a rig that holds: with the stamps repaired all are kept.
            repeated = int(np.count_nonzero(np.diff(stamps.values) == 0))
            text = (
                f"{label}: {repeated} of {len(even)} time stamps repeat the one before them, because they are written "
                f"with too few digits; equal intervals of {even[1] - even[0]:.6g} s agree with all of them "
                "and are used instead"
            )
            time, mask = even, np.ones_like(mask)
        elif single is not None:
            count = int(np.count_nonzero(single != time))
            broken = (
                f"{count} isolated time stamps that break"
                if count > 1
                else "an isolated time stamp that breaks"
            )
            are = "are" if count > 1 else "is"
            text = f"{label}: {broken} the equal intervals of the samples {are} interpolated"
            time = single
        else:
            raise _time_error(table, stamps.index, stamps.values, ~mask)
    return time, mask, text


def even_stamps(stamps: Array) -> Array | None:
    """Return times (n,) at equal intervals that explain stamps (n,) with too few digits, or None."""
    steps = np.diff(stamps)
    # At the first sample of a new stamp the true time is just beyond the stamp: these samples determine the intervals.
    first = np.concatenate([[False], steps > 0])
    if (steps < 0).any() or first.sum() < 3 or (steps == 0).sum() < _FEWEST:
        return None
    digit = float(steps[steps > 0].min())
    n = np.arange(len(stamps), dtype=float)
    slope, intercept = np.polynomial.polynomial.polyfit(n[first], stamps[first], 1)[::-1]
    even = intercept + slope * n
    deviation = np.abs(even - stamps - 0.5 * (even - stamps).max() - 0.5 * (even - stamps).min()).max()
    # With fewer than two samples per stamp, an inserted row looks the same.
    is_even = 0.0 < slope <= 0.5 * digit and deviation <= 1.02 * 0.5 * (digit + slope)
    return even - even[0] + stamps[0] if is_even else None


def _with_single(time: Array) -> Array | None:
    """Return times with single wrong stamps interpolated; None where that is unsafe."""
    interval = float(np.median(np.diff(time)))
    n = np.arange(len(time), dtype=float)
    # A slow drift of the clock is not a fault: only neighbours are compared.
    padded = np.concatenate([[-np.inf], time, [np.inf]])
    before, after = padded[:-2], padded[2:]
    alone = np.abs(after - before - 2 * interval) <= 2 * _EQUAL * interval
    alone &= ~((before < time) & (time < after))
    rows = np.flatnonzero(np.diff(time) <= 0)
    bad = np.zeros(len(time), dtype=bool)
    bad[np.where(alone[rows], rows, rows + 1)] = True
    mended = time.copy()
    if interval > 0 and (alone[rows] | alone[rows + 1]).all() and bad.mean() <= _MOST_WRONG:
        mended[bad] = np.interp(n[bad], n[~bad], time[~bad])
    return mended if (np.diff(mended) > 0).all() else None


def _time_error(table: Table, index: int, time: Array, repeated: Mask) -> RecordingError:
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
    return table.refusal(what, expected, row)


def program_times(table: Table, stamps: Column) -> Array:
    """Return the times of a program, (n,), s; a program is written by the user, so nothing is repaired."""
    if (np.diff(stamps.values) <= 0).any():
        raise _time_error(table, stamps.index, stamps.values, np.zeros(len(stamps.values), dtype=bool))
    return stamps.values


def _missing_time(source: Source, table: Table, displacement: Array) -> tuple[Array | None, str]:
    """Return the time of a file without one, from the sampling rate or the speed of the test, and a remark about it."""
    time: Array | None = None
    text = ""
    if source.sample_rate is not None:
        time = np.arange(len(displacement)) / source.sample_rate
        text = f"no column has the time; it is computed from {source.sample_rate:g} samples per second"
    elif source.rate is not None:
        steps = np.abs(np.diff(displacement))
        if (steps <= SMALLEST_STEP * float(np.ptp(displacement))).any():
            row = int(np.argmin(steps)) + 1
            what = "rate: the displacement does not move, so the time cannot be computed from the speed"
            raise table.refusal(what, "give sample_rate, samples per second", row)
        ends = [0, *(branch.stop - 1 for branch in segment(displacement))]
        travel = float(np.abs(np.diff(displacement[ends])).sum())
        if steps.sum() > (1.0 + _MOST_NOISE) * travel:
            what = f"rate: noise makes the travelled path {steps.sum() / travel:.3g} times as long as its program"
            raise table.refusal(what, "give sample_rate, samples per second")
        time = np.concatenate([[0.0], np.cumsum(steps)]) / source.rate
        source_of_time = "the travelled path and the rate that the case gives"
        text = f"no column has the time; it is computed from {source_of_time}"
    return time, text
