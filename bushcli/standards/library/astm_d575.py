"""ASTM D575: compression of rubber at 12 mm/min.

References
----------
ASTM D575-91 (2018), Standard test methods for rubber properties in compression, section 5.1: rate of head travel of
12 ± 3 mm/min.
"""

from __future__ import annotations

from collections.abc import Iterator

from bushcli.recording.source import Source
from bushcli.standards.observed import Observed
from bushcli.standards.standard import Clause, Standard, speed_clause

SPEED = ((12.0, 3.0),)


def _judge(seen: Observed, source: Source) -> Iterator[Clause]:
    yield speed_clause(seen, source, SPEED)


STANDARD = Standard(
    name="ASTM D575",
    title="Rubber properties in compression",
    source="ASTM D575-91, section 5.1",
    modes=frozenset({"uniaxial"}),
    judge=_judge,
)
