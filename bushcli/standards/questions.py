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


def lacking(seen: Sequence[Observed], coupons: Sequence[Observed] = ()) -> tuple[Lack, ...]:
    """Return the questions that recordings of a bushing and tests of its rubber leave open.

    Parameters
    ----------
    seen : sequence of Observed
        Recordings of the bushing.
    coupons : sequence of Observed
        Material tests.
    """
    return (*_of_rates(seen), *_of_cycles(seen), *_of_modes(seen, coupons))


def _of_rates(seen: Sequence[Observed]) -> Iterator[Lack]:
    """Yield the questions that time, rates and holds leave open."""
    if not seen:
        return
    names = tuple(one.channel for one in seen)
    question = "whether viscosity or friction opens the loops"
    if not any(one.timed for one in seen):
        yield Lack(names, question, "there is no time", "record the time, or give sample_rate")
        return
    if any(hold >= _HOLD for one in seen for hold in one.holds):
        return
    by_mode: dict[str, list[float]] = {}
    for one in seen:
        by_mode.setdefault(one.mode, []).extend(one.rates)
    if any(rates and max(rates) >= DIFFERENT_RATE * min(rates) for rates in by_mode.values()):
        return
    yield Lack(
        names,
        question,
        f"each mode has one rate, and no hold lasts {_HOLD:g} s",
        "record a channel once more at a tenth of the rate, or hold it at its largest travel for some minutes",
    )


def _of_cycles(seen: Sequence[Observed]) -> Iterator[Lack]:
    """Yield the questions that the number and amplitudes of the cycles leave open."""
    flat = tuple(one.channel for one in seen if not one.unloads)
    if flat:
        why, remedy = "the specimen is never unloaded", "record the unloading as well"
        yield Lack(flat, "damping, set and softening", why, remedy)
    # Where a later cycle goes further than the first, the softening shows.
    single = tuple(
        one.channel
        for one in seen
        if one.unloads
        and one.alike < 2
        and max(one.amplitudes, default=0.0) <= (1.0 + ALIKE) * (*one.amplitudes, 0.0)[0]
    )
    if single:
        yield Lack(
            single,
            "Mullins softening",
            "no travel is reached twice",
            "record two or more cycles to the same travel, the first one of a new part included",
        )
    known = tuple(
        one.channel
        for one in seen
        if one.conditioning and max(one.compared) <= (1.0 + ALIKE) * max(one.amplitudes[: one.conditioning])
    )
    if known:
        yield Lack(
            known,
            "Mullins softening",
            "the first cycles condition the part, and the others go no further",
            "take later cycles beyond the conditioning amplitude, or compare the first cycles too",
        )
    begun = tuple(one.channel for one in seen if not one.from_rest)
    if begun:
        why, remedy = "the recording begins away from rest", "begin at zero displacement and force"
        yield Lack(begun, "offset and permanent set", why, remedy)


def _of_modes(seen: Sequence[Observed], coupons: Sequence[Observed]) -> Iterator[Lack]:
    """Yield the questions that recordings of a single mode, and coupon tests of a single kind, leave open."""
    found = {one.mode for one in seen if modes()[one.mode].specimen == "bushing"}
    if len(found) == 1:
        # A mode that loads the rubber differently: a radial one unless this one is radial.
        sideways = bool(modes()[next(iter(found))].sideways)
        known = [one for one in modes().values() if one.directions]
        other = next(one.name for one in known if bool(one.sideways) != sideways)
        yield Lack(
            tuple(one.channel for one in seen),
            "whether the rubber is from another batch, or the geometry, compressibility or rig differs",
            f"there is one mode only, {found.pop()}",
            f"record a second mode, such as {other}",
        )
    found = {one.mode for one in coupons if not modes()[one.mode].needs_compressibility}
    states = {"planar" if modes()[name].sheared else name for name in found}
    # Those that change the shape of the rubber, not its volume; simple shear is planar to the rubber.
    shapes = [one for one in modes().values() if one.specimen == "coupon" and not one.needs_compressibility]
    others = [one.name for one in shapes if not one.sheared and one.name not in states]
    if len(states) == 1 and others:
        yield Lack(
            tuple(one.channel for one in coupons),
            f"the law in {' and '.join(others)} deformation",
            f"there is one kind of coupon test only, {found.pop()}",
            f"add one of the others ({', '.join(others)}), or use a law of I1 alone (yeoh)",
        )
