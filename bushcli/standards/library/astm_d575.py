"""ASTM D575: compression of rubber at 12 mm/min; its method A evaluates the third loading.

References
----------
ASTM D575-91 (2001), Standard test methods for rubber properties in compression, section 5.1: rate of head travel of
12 ± 3 mm/min. According to public summaries, method A loads three times and takes the force of the third loading;
method B applies a force once.
"""

from __future__ import annotations

from collections.abc import Iterator

from bushcli.recording.source import Source
from bushcli.standards.observation import Observed
from bushcli.standards.standard import Clause, Standard, speed_clause

SPEED = ((12.0, 3.0),)
#: Loadings of method A to the same deflection.
LOADINGS = 3


def judge(observed: Observed, source: Source) -> Iterator[Clause]:
    """Yield the clauses, each with what the recording has."""
    yield speed_clause(observed, source, SPEED)
    yield Clause(
        "three loadings in succession, of which the last counts (method A)",
        f"{observed.largest_cycles} to the largest travel",
        True if observed.largest_cycles >= LOADINGS else None,  # method B loads once
        practice=True,
    )


STANDARD = Standard(
    name="ASTM D575",
    title="Rubber properties in compression",
    source="ASTM D575-91, section 5.1; public summaries of its method A",
    modes=frozenset({"uniaxial"}),
    judge=judge,
)
