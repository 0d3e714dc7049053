"""A mismatch in one plain sentence, and what a search has left open."""

from __future__ import annotations

import math

from bushcli.inverse.verdict import ABOVE_NOISE
from bushcli.mismatch.record import Location, Mismatch
from cases.mode import modes


def sentence(mismatch: Mismatch, channels: int = 1) -> str:
    """Return a mismatch as a sentence.

    Parameters
    ----------
    mismatch : Mismatch
    channels : int
        Number of channels compared; if there are several, the sentence names the channel.

    Returns
    -------
    str
        "64 % of the misfit above the noise is on unloading below 4 mm in cycles 1 to 3: the simulation is ... there".
    """
    percent = 100 * min(mismatch.share, 1.0)
    share = f"{f'{percent:.0f}' if percent >= 1 else 'less than 1'} % of the misfit above the noise is"
    parts = _branch(mismatch), _displacement(mismatch), _cycles(mismatch), _rate(mismatch)
    where = " ".join(filter(None, parts))
    channel = f" in the {mismatch.channel} channel" if channels > 1 else ""
    if not where:
        return f"{share} spread over the whole recording{channel}: the simulation is {_size(mismatch)}"
    comma = "," if channel else ""
    return f"{share}{channel}{comma} {where}: the simulation is {_size(mismatch)} there"


def sentences(location: Location) -> tuple[str, ...]:
    """Return a sentence per mismatch, or a single sentence if there is no mismatch."""
    if not location.mismatch:
        if location.ratio > ABOVE_NOISE:
            return (
                f"the misfit, {location.ratio:.1f} times the noise, stands out in no part of the recordings",
            )
        return ("the misfit nowhere exceeds the noise",)
    channels = len({part.channel for part in location.bins})
    return tuple(sentence(mismatch, channels) for mismatch in location.mismatch)


def possible_shift(left: float) -> str:
    """Return what further fits could do to the posterior, of which a share from 0 to 1 is left; never 0 or 100 %."""
    size = "less than 1" if left < 0.01 else "more than 99" if left > 0.99 else f"{100 * left:.0f}"
    return f"further fits could shift {size} % of the probability"


def _size(mismatch: Mismatch) -> str:
    if mismatch.sign == "both_ways":
        return f"wrong in both directions, by {mismatch.rms:.1f} times the noise (rms)"
    sense = mismatch.sign.replace("_", " ")
    if mismatch.relative is not None:
        return f"{_digits(100 * abs(mismatch.relative))} % {sense}"
    unit = _units(mismatch)[1]
    if mismatch.sign in ("too_high", "too_low"):
        return f"{_digits(abs(mismatch.difference))} {unit} {sense}"
    return f"{sense} by {_digits(abs(mismatch.difference))} {unit}"


def _branch(mismatch: Mismatch) -> str:
    if "branch" in mismatch.whole:
        return ""
    if mismatch.branch == "hold":
        return "in holds"
    return f"on {mismatch.branch}"


def _displacement(mismatch: Mismatch) -> str:
    unit, _, scale = _units(mismatch)
    coupon = modes()[mismatch.mode].specimen == "coupon"
    low, high = f"{scale * mismatch.displacement_from:.3g}", f"{scale * mismatch.displacement_to:.3g}"
    # A strain has no unit that would say what the number is.
    of, of_both, kind = ("a strain of ", "strains of ", "strain") if coupon else ("", "", "displacement")
    if "displacement" in mismatch.whole:
        at = ""
    elif mismatch.displacement_from == 0.0:
        at = f"below {of}{high}{unit}"
    elif "largest" in mismatch.whole:
        at = f"above {of}{low}{unit}"
    else:
        at = f"between {of_both}{low} and {high}{unit}"
    if "side" in mismatch.whole:
        return at
    return f"{at} at {mismatch.side} {kind}".strip()


def _cycles(mismatch: Mismatch) -> str:
    first, last = mismatch.cycle
    if "cycle" in mismatch.whole:
        return ""
    return f"in cycle {first}" if first == last else f"in cycles {first} to {last}"


def _rate(mismatch: Mismatch) -> str:
    if mismatch.rate is None:
        return ""
    unit, _, scale = _units(mismatch)
    low, high = (f"{scale * value:.2g}" for value in mismatch.rate)
    per_second = f"{unit}/s" if unit else " 1/s"
    return f"at {low}{per_second}" if low == high else f"at {low} to {high}{per_second}"


def _units(mismatch: Mismatch) -> tuple[str, str, float]:
    """Units of displacement (with a space before it) and force, and a factor: a person reads angles in degrees."""
    mode = modes()[mismatch.mode]
    if mode.specimen == "coupon":
        return "", "MPa", 1.0
    return (" degrees", "N mm", 180 / math.pi) if mode.rotational else (" mm", "N", 1.0)


def _digits(value: float) -> str:
    """Two significant digits below 10, an integer from 10 on."""
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"
