"""ISO 37: tension of rubber to rupture, one pull at a constant speed.

References
----------
ISO 37, Rubber, vulcanized or thermoplastic: determination of tensile stress-strain properties. Its text is not public.
Public summaries say that a specimen is pulled once, at a constant speed, until it breaks: at 500 mm/min, or at
200 mm/min if it is small or stiff.
"""

from __future__ import annotations

from collections.abc import Iterator

from bushcli.errors import count_of
from bushcli.recording.source import Source
from bushcli.standards.observation import Observed
from bushcli.standards.standard import Clause, Standard, speed_clause

SPEEDS = ((500.0, 50.0), (200.0, 20.0))


def judge(observed: Observed, source: Source) -> Iterator[Clause]:
    """Yield the clauses, each with what the recording has."""
    count = len(observed.amplitudes)
    yield Clause("one pull, without conditioning", count_of(count, "cycle"), count == 1)
    yield speed_clause(observed, source, SPEEDS, practice=True)
    start = "at rest" if observed.from_rest else "away from rest"
    yield Clause("the pull begins unloaded", start, observed.from_rest, practice=True)


STANDARD = Standard(
    name="ISO 37",
    title="Tensile stress-strain properties",
    source="public summaries of ISO 37",
    modes=frozenset({"uniaxial"}),
    judge=judge,
)
