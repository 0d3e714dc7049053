"""Columns -> samples: time stamps repaired or computed, repeated rows left out; each change is reported."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.recorded import Repair
from bushcli.recording.header.columns import Column
from bushcli.recording.source import Source
from bushcli.recording.text.table import Table
from bushcli.recording.time.clock import clock, missing_time

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Least number of runs of equal samples in a pattern; least share of runs that last k rows, and a multiple of k rows.
_FEWEST, _MOST_K, _MULTIPLE = 10, 0.7, 0.97
#: Least change of the channel in steps of the converter, and share of the runs in which the other channel changes.
_STEPS, _GOES_ON = 3.0, 0.8


def updates(values: Array, other: Array) -> Mask | None:
    """Return whether each row (n,) has a new value of a channel that is updated every k-th row; None for others."""
    changes = np.flatnonzero(np.diff(values) != 0.0) + 1
    runs = np.diff(changes)
    if len(changes) < _FEWEST:
        return None
    stride = int(np.bincount(runs).argmax())
    regular = stride > 1 and np.mean(runs == stride) >= _MOST_K and np.mean(runs % stride == 0) >= _MULTIPLE
    steps = np.median(np.abs(np.diff(values)[changes - 1])) >= _STEPS * np.diff(np.unique(values)).min()
    kept = np.arange(len(values)) % stride == np.bincount(changes % stride).argmax()
    found = (
        regular and steps and np.mean([np.ptp(other[a:b]) > 0.0 for a, b in pairwise(changes)]) >= _GOES_ON
    )
    return kept if found else None


@dataclass(frozen=True)
class Samples:
    """Samples in internal units, and the changes to them.

    Attributes
    ----------
    displacement, force : (n,) arrays
    time : (n,) array or None
        s.
    rows : (n,) array of int
        Row of each sample in the table, from 0.
    repeated : tuple of int
        Rows, from 0, that were left out because they repeat the row before them, time included.
    repairs : tuple of Repair
    """

    displacement: Array
    force: Array
    time: Array | None
    rows: NDArray[np.int_]
    repeated: tuple[int, ...] = ()
    repairs: tuple[Repair, ...] = ()


def timed(
    table: Table, source: Source, stamps: Column | None, displacement: Array, force: Array, fewest: int
) -> Samples:
    """Return the samples with their times, repaired or computed as the case specifies."""
    if stamps is None:
        time, text = missing_time(source, table, displacement)
        rows = np.arange(len(displacement))
        return Samples(displacement, force, time, rows, (), (Repair("columns", text),) if text else ())
    for key in ("sample_rate", "rate"):
        if getattr(source, key) is not None:
            what = f"{key} has no meaning: {table.label(stamps.index)} gives the time"
            raise table.refused(what, f"delete {key} from the case file")
    time, kept, repairs = clock(table, stamps, displacement, force)
    if kept.sum() < fewest:
        what = f"has only {kept.sum()} different rows"
        raise table.refused(what, f"at least {fewest}")
    repeated = tuple(int(i) for i in np.flatnonzero(~kept))
    said = tuple(Repair("time", text) for text in repairs)
    return Samples(displacement[kept], force[kept], time, np.flatnonzero(kept), repeated, said)


def updated(table: Table, samples: Samples, moved: Column, forced: Column, fewest: int) -> Samples:
    """Leave out the rows between the updates of a channel that was logged more slowly than the others."""
    for values, other, one in (
        (samples.force, samples.displacement, forced),
        (samples.displacement, samples.force, moved),
    ):
        kept = updates(values, other)
        if kept is None or kept.sum() < fewest:
            continue
        text = (
            f"{table.label(one.index)} is updated only every {len(kept) / kept.sum():.3g} rows; the "
            f"{int((~kept).sum())} of {len(kept)} rows between, which repeat it, are left out"
        )
        return replace(
            samples,
            displacement=samples.displacement[kept],
            force=samples.force[kept],
            time=None if samples.time is None else samples.time[kept],
            rows=samples.rows[kept],
            repairs=(*samples.repairs, Repair("stuck", text)),
        )
    return samples
