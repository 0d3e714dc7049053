"""ISO 7743: compression of rubber.

None of its clauses is public. The requirements here are laboratory practice: four slow cycles in succession to a
quarter of the height, the last of which is evaluated.

References
----------
ISO 7743, Rubber, vulcanized or thermoplastic: determination of compression stress-strain properties.
"""

from __future__ import annotations

from collections.abc import Iterator

from bushcli.recording.source import Source
from bushcli.runtime.digits import with_decimals, with_digits
from bushcli.standards.observed import Observed
from bushcli.standards.standard import Clause, Standard, cycles_clause, speed_clause

CYCLES, STRAIN, SPEED = 4, 0.25, 10.0


def judge(observed: Observed, source: Source) -> Iterator[Clause]:
    """Yield the clauses, each with what the recording has."""
    yield cycles_clause(observed, CYCLES, f"{CYCLES} cycles in succession, of which the last counts")
    largest = max(observed.amplitudes)
    met = abs(largest - STRAIN) <= 0.1 * STRAIN
    reached = with_decimals(100 * largest, 90 * STRAIN, 110 * STRAIN, decimals=1)
    yield Clause(f"compression to {STRAIN:.0%}", f"{reached}%", met, practice=True)
    yield speed_clause(observed, source, [(SPEED, 0.1 * SPEED)], practice=True)
    longest = max((*observed.holds, *observed.rests), default=0.0)
    yield Clause(
        "no pause between the cycles",
        f"the longest is {with_digits(longest, 1.0)} s",
        longest <= 1.0 if observed.timed else None,
        practice=True,
    )


STANDARD = Standard(
    name="ISO 7743",
    title="Compression stress-strain properties",
    source="good practice; the text of ISO 7743 is not public",
    modes=frozenset({"uniaxial"}),
    judge=judge,
)
