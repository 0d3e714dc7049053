"""SAE J1636: load and deformation tests of elastomeric components.

It asks that the test be stated rather than for one set of numbers: cycles before the evaluated one, preload, ramp
rates, hold times, test levels. According to it, a component usually takes three to ten cycles to become steady.

References
----------
SAE J1636 (1993, 2017), Recommended guidelines for load/deformation testing of elastomeric components. Its text is not
public; the requirements here come from public summaries of it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from bushcli.recording.source import Source
from bushcli.standards.observation import Observed
from bushcli.standards.standard import Clause, Standard, cycles_clause
from cases.mode import modes

#: Least number of cycles before the evaluated one.
FEWEST = 3


def judge(observed: Observed, source: Source) -> Iterator[Clause]:
    """Yield the clauses, each with what the recording has."""
    yield cycles_clause(
        observed, FEWEST + 1, f"{FEWEST} to 10 cycles to the same travel before the one that counts"
    )
    marked = (
        f"conditioning = {observed.conditioning}" if observed.conditioning else "conditioning is not given"
    )
    yield Clause(
        "which cycles only condition the part is stated",
        marked,
        observed.conditioning > 0 or source.cycles is not None,
    )
    turns = modes()[observed.mode].rotational
    rates = ", ".join(f"{math.degrees(rate) if turns else rate:.3g}" for rate in observed.rates)
    unit = "degrees/s" if turns else "mm/s"
    one_rate = len(observed.rates) == 1 if rates else None
    yield Clause("one ramp rate", f"{rates} {unit}" if rates else "no time", one_rate, practice=True)
    start = "at rest" if observed.from_rest else "away from rest"
    yield Clause("the test begins unloaded or at a stated preload", start, observed.from_rest, practice=True)


STANDARD = Standard(
    name="SAE J1636",
    title="Load/deformation testing of elastomeric components",
    source="public summaries of SAE J1636",
    modes=frozenset({"axial", "radial", "torsional", "conical"}),
    judge=judge,
)
