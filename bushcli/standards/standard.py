"""The type of a standard: its requirements, as far as a recording can show them."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache

from bushcli.errors import count_of
from bushcli.recording.source import Source
from bushcli.runtime.digits import with_digits
from bushcli.standards.observation import Observed


@dataclass(frozen=True)
class Clause:
    """One requirement, and whether a recording meets it."""

    text: str  # the requirement
    found: str  # what the recording has
    met: bool | None  # None where the recording cannot show it
    # Good practice for tests of this kind: the text of the standard is not public, and what is known of it does not
    # confirm the clause word for word.
    practice: bool = False


@dataclass(frozen=True)
class Standard:
    """A standard for tests of rubber.

    Attributes
    ----------
    source : str
        Source of the requirements as implemented here.
    modes : frozenset of str
        Modes that it covers.
    judge : callable
        (Observed, Source) -> clauses.
    """

    name: str
    title: str
    source: str
    modes: frozenset[str]
    judge: Callable[[Observed, Source], Iterable[Clause]]


@cache
def standards() -> dict[str, Standard]:
    """Return all standards found in ``bushcli/standards/library``, by name."""
    package = importlib.import_module("bushcli.standards.library")
    library = [
        importlib.import_module(f"{package.__name__}.{module.name}").STANDARD
        for module in pkgutil.iter_modules(package.__path__)
    ]
    return {standard.name: standard for standard in sorted(library, key=lambda standard: standard.name)}


def clauses(observed: Observed, source: Source) -> tuple[Clause, ...]:
    """Return the requirements of the standard that a source names; nothing where it names none.

    Parameters
    ----------
    observed : Observed
    source : Source
    """
    if source.standard is None:
        return ()
    standard = standards()[source.standard]
    if observed.mode not in standard.modes:
        text, mode = f"a test in mode {' or '.join(sorted(standard.modes))}", f"mode {observed.mode}"
        return (Clause(text, mode, False),)
    return tuple(standard.judge(observed, source))


def speed_clause(
    observed: Observed, source: Source, wanted: Sequence[tuple[float, float]], practice: bool = False
) -> Clause:
    """Return the clause on the speed of the grips or plates."""
    text = " or ".join(f"{speed:g} ± {slack:g} mm/min" for speed, slack in wanted)
    length = source.specimen.gauge_length
    if not observed.rates:
        return Clause(f"speed {text}", "no time", None, practice)
    if length is None:
        shown = ", ".join(f"{rate:.3g}" for rate in observed.rates)
        unknown = f"{shown} strain per second, and no gauge_length to turn it into a speed"
        return Clause(f"speed {text}", unknown, None, practice)
    speeds = [60.0 * rate * length for rate in observed.rates]
    ends = [want + side * slack for want, slack in wanted for side in (-1, 1)]
    met = all(any(abs(speed - want) <= slack for want, slack in wanted) for speed in speeds)
    shown = ", ".join(f"{with_digits(speed, *ends)} mm/min" for speed in speeds)
    return Clause(f"speed {text}", shown, met, practice)


def cycles_clause(observed: Observed, least: int, text: str) -> Clause:
    """Return the clause of good practice on the number of cycles of the same amplitude."""
    marked = f", {observed.conditioning} of them marked as conditioning" if observed.conditioning else ""
    return Clause(
        text,
        f"{count_of(observed.largest_cycles, 'cycle')} to the largest travel{marked}",
        observed.largest_cycles >= least,
        practice=True,
    )
