"""Checks whether a prediction lies outside the measured temperatures, rates, frequencies and amplitudes.

Where time or temperature act, what a law does beyond them is a guess: relaxation times that no test could show, rubber
that becomes glass.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case, DynamicTest
from bushcli.effects.active import ActiveEffect
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.runtime.condition import Condition
from cases.mode import modes

Array = NDArray[np.float64]

# How far beyond the measured values is still at them: kelvins of a climatic chamber, and ratios of rates or frequencies
# and of amplitudes. Judgement: relaxation is spread over decades.
_KELVINS, _PACE, _SIZE = 2.0, 1.5, 1.05


@dataclass(frozen=True)
class Extent:
    """What a test covers, or a prediction; empty where it is not known or plays no part.

    Attributes
    ----------
    mode : str
        Rates, frequencies and amplitudes are compared within a mode.
    temperature : tuple of float
        Degrees C.
    rate : tuple of float
        mm/s, rad/s or 1/s.
    frequency : tuple of float
        Hz.
    amplitude : tuple of float
        Largest displacement, or amplitude of a vibration: mm, rad or strain.
    """

    mode: str
    temperature: tuple[float, ...] = ()
    rate: tuple[float, ...] = ()
    frequency: tuple[float, ...] = ()
    amplitude: tuple[float, ...] = ()


def of_path(mode: str, q: Array, time: Array | None, temperature: float | None) -> Extent:
    """Return the extent of a path: its temperature, its usual rate and its largest displacement.

    Parameters
    ----------
    mode : str
    q : shape (n,)
        mm, rad or stretch - 1.
    time : shape (n,) or None
        s.
    temperature : float or None
        Degrees C.
    """
    temperatures = () if temperature is None else (temperature,)
    pace: tuple[float, ...] = ()
    if time is not None and len(q) > 1:
        step = np.abs(np.diff(q)) / np.maximum(np.diff(time), 1e-12)
        moving = step > 0.1 * np.median(step[step > 0.0]) if (step > 0.0).any() else step > 0.0
        pace = (float(np.median(step[moving])),) if moving.any() else ()
    return Extent(mode, temperatures, pace, (), (float(np.abs(q).max()),))


def of_table(table: DynamicTable) -> Extent:
    """Return the extent of a table of dynamic stiffness."""

    def distinct_values(values: Array) -> tuple[float, ...]:
        return tuple(map(float, np.unique(values[~np.isnan(values)])))

    temperatures, frequencies = distinct_values(table.temperature), distinct_values(table.frequency)
    return Extent(table.mode, temperatures, (), frequencies, distinct_values(table.amplitude))


def of_test(test: DynamicTest) -> Extent:
    """Return the extent of vibrations that are predicted."""
    temperatures = () if test.temperature is None else (test.temperature,)
    amplitude = test.amplitude if isinstance(test.amplitude, tuple) else ()
    return Extent(test.mode, temperatures, (), tuple(test.frequency), amplitude)


def tested_temperatures(case: Case) -> list[Extent]:
    """Return the temperatures of the tests of a case, whose files are not read."""
    sources = (*case.recordings, *case.coupons)
    return [Extent(test.mode, (test.temperature,)) for test in sources if test.temperature is not None]


def outside_measured(
    name: str, extent: Extent, known: Iterable[Extent], active: Sequence[ActiveEffect]
) -> list[Condition]:
    """Return a condition if a prediction lies outside of what was measured.

    Parameters
    ----------
    name : str
        Name of the channel that is predicted.
    extent : Extent
    known : iterable of Extent
        Of the tests.
    active : sequence of ActiveEffect
        Effects of the channel: a temperature counts where one needs it, the rest where one has a memory.
    """
    known = list(known)
    heated = any(effect.effect.needs_temperature for effect in active)
    remembers = any(effect.effect.has_memory for effect in active)
    # Frequencies are the rubber's, rates and amplitudes those of a mode.
    alike = [other if other.mode == extent.mode else Extent("", frequency=other.frequency) for other in known]
    comparable = [replace(other, temperature=()) for other in alike] if remembers else []
    comparable += [Extent("", other.temperature) for other in known] if heated else []
    beyond = list(_excesses(extent, comparable))
    if not beyond:
        return []
    what = f"{name} is predicted outside of what was measured: {'; '.join(beyond)}"
    remedy = "a test there would show whether it holds; do not rely on it before"
    return [Condition("outside_measured", what, remedy)]


def _excesses(extent: Extent, known: Sequence[Extent]) -> Iterator[str]:
    rotational = modes()[extent.mode].rotational
    unit, factor = ("degrees", np.degrees(1.0)) if rotational else ("mm", 1.0)
    if modes()[extent.mode].specimen == "coupon":
        unit = "strain"
    for key, words, label, scale in (
        ("temperature", "degrees C", "", 1.0),
        ("rate", f"{unit}/s".replace("strain/s", "1/s"), "rates of ", factor),
        ("frequency", "Hz", "", 1.0),
        ("amplitude", unit, "up to ", factor),
    ):
        requested = scale * np.array(getattr(extent, key), dtype=float)
        values = scale * np.array([v for other in known for v in getattr(other, key)], dtype=float)
        if not len(requested) or not len(values):
            continue
        low, high = float(values.min()), float(values.max())
        if key == "temperature":
            far = (requested < low - _KELVINS) | (requested > high + _KELVINS)
        elif key == "amplitude":
            far, low = requested > _SIZE * high, high
        else:
            far = (requested < low / _PACE) | (requested > high * _PACE)
        if far.any():
            measured = f"{high:.3g}" if low == high else f"{low:.3g} to {high:.3g}"
            yield f"{label}{requested[far][np.argmax(np.abs(requested[far] - low))]:.3g} {words} (measured: {measured})"
