"""Temperatures that a case gives, and that its simulation leaves out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bushcli.case.case import Case
from bushcli.case.loads import LoadCase
from bushcli.recording.source import Source
from bushcli.runtime.condition import Condition

#: Kelvins by which temperatures of one rubber may differ without a word: those of a laboratory do by 4 (ISO 23529:
#: 23 or 27 degrees C, each within 2).
ALIKE = 5.0


class Warm(Protocol):
    """A recording, or a load case that is simulated."""

    @property
    def name(self) -> str:
        """Name of the channel."""

    @property
    def temperature(self) -> NDArray[np.float64] | float | None:
        """Degrees C, one or shape (n,); None where no column of a file has it."""


def unused_temperatures(case: Case, channels: Iterable[Warm]) -> Iterator[Condition]:
    """Yield a condition where the channels have several temperatures and the case has no effect ``temperature``.

    Parameters
    ----------
    case : Case
    channels : iterable of Warm
        Those that one law simulates.
    """
    if any(active.effect.needs_temperature for active in case.effects):
        return
    sources: tuple[LoadCase | Source, ...] = (
        *case.load_cases,
        *case.recordings,
        *case.specimens,
        *case.coupons,
    )
    of_case = {source.label: source.temperature for source in sources}
    given: list[float] = []
    for channel in channels:
        value = of_case.get(channel.name) if channel.temperature is None else channel.temperature
        given += [] if value is None else [float(np.min(value)), float(np.max(value))]
    distinct = sorted(set(given))
    if distinct and distinct[-1] - distinct[0] > ALIKE:
        listed = f"{distinct[0]:.4g} {'and' if len(distinct) == 2 else 'to'} {distinct[-1]:.4g} degrees C"
        what = f"temperatures of {listed} are not used: the case has no effect temperature, and one law serves them all"
        remedy = 'add [[effects]] with name = "temperature"; or use recordings of one temperature'
        yield Condition("temperature_left_out", what, remedy)
