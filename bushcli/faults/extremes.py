"""Tables of peaks and valleys: each row is a reversal of the motion, and nothing between the reversals is known."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bushcli.faults.fault import DataFault
from bushcli.recording import Recording

#: Fewest rows; share of rows at which the motion reverses; least median step between them as a share of the range.
#: Judgement: a sampled signal has such steps only where the noise hides the motion, and is then no recording either.
_FEWEST, _REVERSALS, _STEP = 8, 0.9, 0.3


def extremes(recording: Recording) -> Iterator[DataFault]:
    """Yield a fault if a recording consists of the extremes of its cycles."""
    steps = np.diff(recording.displacement)
    if len(steps) + 1 < _FEWEST or not np.ptp(recording.displacement) > 0.0:
        return
    reversals = float(np.mean(steps[1:] * steps[:-1] < 0.0))
    if reversals < _REVERSALS or np.median(np.abs(steps)) < _STEP * np.ptp(recording.displacement):
        return
    yield DataFault(
        recording.name,
        "extremes",
        f"the motion reverses at {'each' if reversals == 1.0 else f'{100 * reversals:.0f} % of the'} "
        f"sample{'' if reversals == 1.0 else 's'}: this is a table of peaks and valleys, or a signal that was "
        "sampled too slowly, and the curve between its points is unknown",
        "export the samples of some whole cycles, at least twenty in each, with their time",
        True,
        np.zeros(len(recording.force), dtype=bool),
    )
