"""Questions that the recordings of a case cannot answer, and the tests that would.

Each question follows from the effects' formulas (docs/effects.md): viscosity makes the loop depend on the rate and lets
the force relax in a hold, friction does neither; Mullins softening appears as the difference between the first and the
second loading to the same travel.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from bushcli.standards.observed import ALIKE, DIFFERENT_RATE, Observed
from cases.mode import modes

#: Shortest hold, s, that shows relaxation beyond that of the ramp before it.
_HOLD = 10.0


@dataclass(frozen=True)
class Lack:
    """A question that recordings leave open."""

    channels: tuple[str, ...]  # that leave it open
    question: str
    why: str  # what the recordings have
    remedy: str  # the recording that would answer it


def open_questions(recordings: Sequence[Observed], coupons: Sequence[Observed] = ()) -> tuple[Lack, ...]:
    """Return the questions that recordings of a bushing and tests of its rubber leave open.

    Parameters
    ----------
    recordings : sequence of Observed
        Recordings of the bushing.
    coupons : sequence of Observed
        Material tests.
    """
    return (*_of_rates(recordings), *_of_cycles(recordings), *_of_modes(recordings, coupons))


def _of_rates(recordings: Sequence[Observed]) -> Iterator[Lack]:
    """Yield the questions that time, rates and holds leave open."""
    if not recordings:
        return
    names = tuple(recording.channel for recording in recordings)
    question = "whether viscosity or friction opens the loops"
    if not any(recording.timed for recording in recordings):
        yield Lack(names, question, "there is no time", "record the time, or give sample_rate")
        return
    if any(hold >= _HOLD for recording in recordings for hold in recording.holds):
        return
    by_mode: dict[str, list[float]] = {}
    for recording in recordings:
        by_mode.setdefault(recording.mode, []).extend(recording.rates)
    if any(rates and max(rates) >= DIFFERENT_RATE * min(rates) for rates in by_mode.values()):
        return
    yield Lack(
        names,
        question,
        f"each mode has one rate, and no hold lasts {_HOLD:g} s",
        "record a channel once more at a tenth of the rate, or hold it at its largest travel for some minutes",
    )


def _of_cycles(recordings: Sequence[Observed]) -> Iterator[Lack]:
    """Yield the questions that the number and amplitudes of the cycles leave open."""
    flat = tuple(recording.channel for recording in recordings if not recording.unloads)
    if flat:
        why, remedy = "the specimen is never unloaded", "record the unloading as well"
        yield Lack(flat, "damping, set and softening", why, remedy)
    # Where a later cycle goes further than the first, the softening shows.
    single = tuple(
        recording.channel
        for recording in recordings
        if recording.unloads
        and recording.alike < 2
        and max(recording.amplitudes, default=0.0) <= (1.0 + ALIKE) * (*recording.amplitudes, 0.0)[0]
    )
    if single:
        yield Lack(
            single,
            "Mullins softening",
            "no travel is reached twice",
            "record two or more cycles to the same travel, the first one of a new part included",
        )
    conditioned = tuple(
        recording.channel
        for recording in recordings
        if recording.conditioning
        and max(recording.compared) <= (1.0 + ALIKE) * max(recording.amplitudes[: recording.conditioning])
    )
    if conditioned:
        yield Lack(
            conditioned,
            "Mullins softening",
            "the first cycles condition the part, and the others go no further",
            "take later cycles beyond the conditioning amplitude, or compare the first cycles too",
        )
    preloaded = tuple(recording.channel for recording in recordings if not recording.from_rest)
    if preloaded:
        why, remedy = "the recording begins away from rest", "begin at zero displacement and force"
        yield Lack(preloaded, "offset and permanent set", why, remedy)


def _of_modes(recordings: Sequence[Observed], coupons: Sequence[Observed]) -> Iterator[Lack]:
    """Yield the questions that recordings of a single mode, and coupon tests of a single kind, leave open."""
    names = {recording.mode for recording in recordings if modes()[recording.mode].specimen == "bushing"}
    if len(names) == 1:
        # A mode that loads the rubber differently: a radial one unless this one is radial.
        sideways = bool(modes()[next(iter(names))].sideways)
        modes_of_bushing = [mode for mode in modes().values() if mode.directions]
        other = next(mode.name for mode in modes_of_bushing if bool(mode.sideways) != sideways)
        yield Lack(
            tuple(recording.channel for recording in recordings),
            "whether the rubber is from another batch, or the geometry, compressibility or rig differs",
            f"there is one mode only, {names.pop()}",
            f"record a second mode, such as {other}",
        )
    names = {coupon.mode for coupon in coupons if not modes()[coupon.mode].needs_compressibility}
    states = {"planar" if modes()[name].sheared else name for name in names}
    # Those that change the shape of the rubber, not its volume; simple shear is planar to the rubber.
    shapes = [
        mode for mode in modes().values() if mode.specimen == "coupon" and not mode.needs_compressibility
    ]
    others = [mode.name for mode in shapes if not mode.sheared and mode.name not in states]
    if len(states) == 1 and others:
        yield Lack(
            tuple(coupon.channel for coupon in coupons),
            f"the law in {' and '.join(others)} deformation",
            f"there is one kind of coupon test only, {names.pop()}",
            f"add one of the others ({', '.join(others)}), or use a law of I1 alone (yeoh)",
        )
