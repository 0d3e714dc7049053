"""The rig's own count of cycles: a column of the file whose number changes with each cycle."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bushcli.curve.recorded import Recording
from bushcli.errors import RecordingError
from bushcli.recording.header.name import heading
from bushcli.recording.text.table import Table

Array = NDArray[np.float64]
Index = NDArray[np.int_]

#: Words of which one has to be in the name, and words that may stand beside it; "cycle time" is no count.
_CYCLE = re.compile(
    r"cycles?|cyc|zykl(?:us|en)|(?:zyklus|zyklen|zykel)(?:zahl|zähler|nummer|nr)?|last(?:spiele?|wechsel)(?:zahl|zähler|nr)?"
    r"|schwingspiele?(?:zahl)?|cicl[oi]s?|cykl|cyklus|cykel|循环(?:次数|数)?|サイクル(?:数)?|segments?|seg|loops?|blocks?|abschnitte?"
)
_BESIDE = re.compile(
    r"counts?|counter|number|num|no|nr|n|id|index|total|elapsed|current|actual|of|the|axial|radial|torsional|channel"
    r"|zähler|zahl|nummer|anzahl|aktuelle[rs]?|numéro|numero|número|compteur|nombre|contador"
)
_NAMED = re.compile(r"[^\W\d_]+[\s._#:\-]*(\d{1,9})")
# Most cycles, by the motion, in one number of the count: a column that counts blocks of cycles has more. Least share of
# the numbers in which the motion turns back: one that counts ramps has none. Judgement.
_ONE, _TURNING = 1.5, 0.5
# A stretch turns back if its ends are nearer to each other than its range, by this share of it.
_BACK = 0.2


def cycle_count(table: Table, rows: Index, recording: Recording) -> tuple[int, Index] | None:
    """Return the column in which the rig counts cycles, and the number, from 1, of each sample's cycle; None without.

    What precedes the first cycle and what follows the last one, without a reversal, belongs to that cycle.
    """
    for index, name in enumerate(table.names):
        words = [part for word in heading(name).words for part in re.split(r"[\s._\-#:]+", word) if part]
        counters = [word for word in words if _CYCLE.fullmatch(word)]
        if not counters or not all(word in counters or _BESIDE.fullmatch(word) for word in words):
            continue
        try:
            count = np.floor(table.numbers(index))
        except RecordingError:
            # Whole numbers behind a word: "Zyklus 3".
            matches = [_NAMED.fullmatch(table.text(row, index)) for row in range(len(table))]
            count = np.array([float(match[1]) for match in matches if match is not None])
        numbers = _numbers(count[rows], recording) if len(count) == len(table) else None
        if numbers is not None:
            return index, numbers
    return None


def _numbers(count: Array, recording: Recording) -> Index | None:
    """Return the numbers from 1 of the cycles (n,) that a column (n,) delimits; None if it counts something else."""
    starts = [0, *(np.flatnonzero(np.diff(count)) + 1), len(count)]
    slices = [slice(a, b) for a, b in pairwise(starts)]
    displacement, by_motion = recording.displacement, recording.segments[-1].cycle if len(slices) > 1 else 0
    if len(slices) < 2 or len(slices) > 2 * by_motion + 2:
        return None
    parts = [displacement[max(part.start - 1, 0) : part.stop] for part in slices]
    turns = [bool(abs(q[-1] - q[0]) < (1.0 - _BACK) * np.ptp(q)) for q in parts]
    if not turns[0] and len(slices) > 1:
        slices[:2], turns[:2] = [slice(0, slices[1].stop)], [turns[1]]
    last = float(np.ptp(displacement[slices[-1]])) if len(slices) > 1 else 0.0
    if len(slices) > 1 and not turns[-1] and last < 0.9 * float(np.ptp(displacement[slices[-2]])):
        slices[-2:], turns[-2:] = [slice(slices[-2].start, len(count))], [turns[-2]]
    if np.mean(turns) < _TURNING or by_motion > _ONE * len(slices):
        return None
    return np.repeat(np.arange(1, len(slices) + 1), [part.stop - part.start for part in slices])
