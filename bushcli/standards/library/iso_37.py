"""ISO 37: tension of rubber to rupture, one pull at 500 mm/min (dumb-bells type 1, 1A, 2) or 200 mm/min (types 3, 4).

References
----------
ISO 37:2017, Rubber, vulcanized or thermoplastic: determination of tensile stress-strain properties.
"""

from __future__ import annotations

from collections.abc import Iterator

from bushcli.recording.source import Source
from bushcli.standards.observed import Observed
from bushcli.standards.standard import Clause, Standard, speed_clause

SPEEDS = ((500.0, 50.0), (200.0, 20.0))


def _judge(seen: Observed, source: Source) -> Iterator[Clause]:
    count = len(seen.amplitudes) + seen.conditioning
    yield Clause("one pull, without conditioning", f"{count} cycle{'s' if count != 1 else ''}", count == 1)
    yield speed_clause(seen, source, SPEEDS)
    yield Clause(
        "the pull begins unloaded", "at rest" if seen.from_rest else "away from rest", seen.from_rest
    )


STANDARD = Standard(
    name="ISO 37",
    title="Tensile stress-strain properties",
    source="ISO 37:2017",
    modes=frozenset({"uniaxial"}),
    judge=_judge,
)
