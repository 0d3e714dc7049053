"""The verdict on a direct prediction in the engineer's words: stiffness, deviation, and whether it is accepted.

If all channels deviate by about the same factor, another batch of rubber is the most likely cause: bushings of the
literature had 645 N/mm by coupon data but 363 N/mm by measurement. The factor here is measured, not assumed: it is the
least-squares factor between the curves, and is given with the remaining misfit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bushcli.faults import DataFault
from bushcli.faults.fault import chance_in_words
from bushcli.report.document import Tone
from bushcli.report.quantity import Quantities, join_names, number, percent, quantities
from bushcli.runtime.digits import with_decimals
from bushcli.simulate.misfit import Misfit

if TYPE_CHECKING:
    from bushcli.simulate.response import Response, Simulated

# Conditions that repeat the faults of the data.
FAULTS = frozenset({"faulty_data", "doubtful_data", "bad_samples"})
_KINDS = {
    "sign": "wrong sign",
    "position": "displacement from another zero",
    "unit": "wrong unit",
    "swapped": "columns or channels swapped",
    "clipped": "values clipped",
    "extremes": "extremes in place of samples",
    "spikes": "single bad samples",
    "stuck": "values stuck",
    "time": "wrong times",
    "no_signal": "noise in place of a force",
    "temperature": "two sweeps at one temperature",
    "loss_angle": "another angle than the loss angle",
    "order": "rows after larger amplitudes",
    "amplitude": "other amplitudes",
}

# Largest factor between the stiffnesses of two batches of one compound (judgement).
_BATCHES = 4.0
# A larger ratio is written as a multiple, not in percent. Words only.
_MULTIPLE = 10.0
# A single factor counts as an explanation if it removes at least this share of the rms misfit...
EXPLAINS = 0.5
# ... and the best factor of each channel deviates from the common one by at most this share.
AGREE = 0.05


@dataclass(frozen=True)
class Verdict:
    """The verdict on a result in words: a headline without its full stop, and sentences."""

    headline: str
    lines: tuple[str, ...]
    tone: Tone

    @property
    def text(self) -> str:
        """The whole verdict."""
        return " ".join([f"{self.headline}.", *self.lines])


@dataclass(frozen=True)
class ChannelVerdict:
    """The verdict on one channel in one sentence; `within` is None without a recording to compare with."""

    name: str
    mode: str
    text: str
    within: bool | None


@dataclass(frozen=True)
class SingleFactor:
    """The common factor on all simulated forces that brings them closest to the recordings.

    By channel: the best factor for this channel alone, and the rms misfit in percent of the force range, without and
    with the common factor; and whether this removes most of the misfit, and the channels agree on it.
    """

    factor: float
    by_channel: Mapping[str, float]
    rms_before: Mapping[str, float]
    rms_after: Mapping[str, float]
    explains: bool


@dataclass(frozen=True)
class DirectVerdict(Verdict):
    """The verdict on a direct prediction; `within` is None without recorded channels."""

    within: bool | None
    channels: tuple[ChannelVerdict, ...]
    single_factor: SingleFactor | None


def judge(response: Response, misfits: Mapping[str, Misfit]) -> DirectVerdict:
    """Return the verdict on a direct prediction in words; the misfits are those of the channels that were compared."""
    faulty = {fault.channel for fault in response.faults if fault.fatal}
    channels = tuple(
        _channel(channel, misfits.get(channel.name), channel.name in faulty) for channel in response.channels
    )
    compared = [channel for channel in channels if channel.within is not None]
    recorded = [channel for channel in response.channels if channel.recording is not None]
    within = len(compared) == len(recorded) and all(c.within for c in compared) if recorded else None
    factor = single_factor(list(misfits.values()))
    outside = [c.name for c in compared if not c.within]
    headline = faulty_data(response.faults) if faulty else _headline(response, misfits, within, outside)
    lines = [*doubt_lines(response.faults), *(channel.text for channel in channels)]
    # Within the tolerance there is no deviation to be explained.
    if factor is not None and not within and not faulty:
        lines.append(_factor_text(factor))
    tone: Tone = "plain" if within is None else "good" if within else "bad"
    return DirectVerdict(headline, tuple(lines), tone, within, channels, factor)


def single_factor(misfits: Sequence[Misfit]) -> SingleFactor | None:
    """Return the best common factor on the simulated forces; None where nothing is compared.

    Each channel's misfit counts relative to its force range and per sample, so that neither the stiffer nor the longer
    recording dominates.
    """
    if not misfits or not all(np.any(m.simulated) and m.force_range > 0 for m in misfits):
        return None
    scaled = {m.channel: m.simulated / m.force_range / math.sqrt(len(m.simulated)) for m in misfits}
    recorded = {
        m.channel: (m.simulated - m.difference) / m.force_range / math.sqrt(len(m.simulated)) for m in misfits
    }
    above = {name: float(s @ recorded[name]) for name, s in scaled.items()}
    below = {name: float(s @ s) for name, s in scaled.items()}
    factor = sum(above.values()) / sum(below.values())
    factors = {name: above[name] / below[name] for name in scaled}
    before = {m.channel: m.rms_percent for m in misfits}
    after = {name: 100 * float(np.linalg.norm(factor * s - recorded[name])) for name, s in scaled.items()}
    agree = all(abs(value / factor - 1.0) <= AGREE for value in factors.values()) if factor > 0 else False
    takes_away = _joint_rms(after) <= (1.0 - EXPLAINS) * _joint_rms(before)
    return SingleFactor(factor, factors, before, after, bool(agree and takes_away))


def _joint_rms(rms: Mapping[str, float]) -> float:
    return math.sqrt(sum(value**2 for value in rms.values()) / len(rms))


def _headline(
    response: Response, misfits: Mapping[str, Misfit], within: bool | None, outside: list[str]
) -> str:
    if within is None:
        stopped = join_names([c.name for c in response.channels if c.stopped])
        return f"Simulated{f', but {stopped} stopped early' if stopped else ''}; no recording to compare with"
    accepted = f"the accepted {response.case.tolerance.text}"
    if within:
        return f"Within {accepted} of the recording" + ("s" if len(misfits) > 1 else "")
    if not outside:
        return "Not comparable with the recordings: the simulation ended too early"
    ratios, band = [misfits[name].stiffness_ratio for name in outside], response.case.tolerance.band
    text = f"{join_names(outside)} outside {accepted}"
    if all(ratio > 1 + band for ratio in ratios):
        return f"Too stiff: {text}"
    if all(ratio < 1 - band for ratio in ratios):
        return f"Too soft: {text}"
    # Not `capitalize`, which would write the class of the tolerance in lower case.
    return text[:1].upper() + text[1:]


def _channel(channel: Simulated, misfit: Misfit | None, is_faulty: bool) -> ChannelVerdict:
    units = quantities(channel.mode)
    if misfit is None or is_faulty:
        # Neither too stiff nor too soft: a faulty recording says nothing about that.
        later = "" if misfit is None else "; to be compared when its recording is corrected"
        text = f"{channel.name}: {_alone(channel, units)}{later}."
        return ChannelVerdict(channel.name, channel.mode, text, None if misfit is None else False)
    unit, ratio, tolerance = units.stiffness_unit, misfit.stiffness_ratio, misfit.tolerance
    accepted = f"the accepted {tolerance.text}"
    if misfit.within:
        rms, noise = percent(misfit.rms_percent), percent(misfit.noise_percent)
        assessment = f"within {accepted} (curve {rms} rms, noise {noise})"
    elif not abs(ratio - 1.0) <= tolerance.band:
        assessment = f"outside {accepted}"
    elif misfit.peak_percent > tolerance.percent:
        peak = percent(misfit.peak_percent, tolerance.percent)
        assessment = (
            f"the secant stiffness is within {accepted}, the curve is not: it departs by up to {peak}"
        )
        assessment += " of the force range"
    else:
        assessment = f"within {accepted} as far as the simulation went"
    secants = (misfit.predicted.secant, misfit.measured.secant)
    simulated, measured = (f"{number(units.stiffness(secant))} {unit}" for secant in secants)
    comparison = f"simulated {simulated}, measured {measured}: {stiffer(ratio, tolerance.percent)}"
    part = f"compared on {percent(100 * misfit.compared)} of the recording, where the simulation ended"
    part = f" ({part})" if misfit.compared < 1.0 else ""
    text = f"{channel.name}: {comparison}; {assessment}{part}."
    return ChannelVerdict(channel.name, channel.mode, text, misfit.within)


def _alone(channel: Simulated, units: Quantities) -> str:
    stiffness = f"{number(units.stiffness(channel.curve.secant_stiffness()))} {units.stiffness_unit} (secant)"
    q = channel.curve.displacement
    low, high = (number(units.at(end)) for end in (q.min(), q.max()))
    text = f"simulated {stiffness} from {low} to {high} {units.displacement_unit}".rstrip()
    if not channel.stopped:
        return text
    force = float(channel.curve.force[int(np.argmax(np.abs(q)))])
    return f"{text}, where it stopped at {number(force)} {units.force_unit}"


def all_within_10_percent(verdict: DirectVerdict, misfits: Mapping[str, Misfit]) -> bool | None:
    """Return whether every recorded channel is within 10 %; None where there is nothing to compare."""
    verdicts = [
        misfits[channel.name].within_10_percent for channel in verdict.channels if channel.name in misfits
    ]
    # If all compared channels are within the tolerance but the verdict is not, a recorded channel was not compared.
    lost = not verdict.within and all(misfit.within for misfit in misfits.values())
    return None if verdict.within is None else bool(verdicts) and all(verdicts) and not lost


def stiffer(ratio: float, limit: float) -> str:
    """Return the ratio of simulated to measured stiffness in words: "78 % too stiff"."""
    if not math.isfinite(ratio):
        return "no stiffness to compare"
    if ratio >= _MULTIPLE:
        return f"{number(ratio)} times as stiff as measured"
    deviation = 100 * abs(ratio - 1.0)
    if deviation < 0.5 and deviation <= limit:
        return "as stiff as measured"
    return f"{with_decimals(deviation, limit)} % too {'stiff' if ratio > 1 else 'soft'}"


def _factor_text(single: SingleFactor) -> str:
    misfits = join_names([f"{percent(rms)} ({name})" for name, rms in single.rms_after.items()])
    factor, alone = _factor(single.factor), len(single.by_channel) == 1
    if single.explains:
        gap = f"most of the gap{'' if alone else ' in all channels'}, leaving {misfits} rms"
        is_batch = 1.0 / _BATCHES < single.factor < _BATCHES
        what = "another batch of rubber" if is_batch else "another rubber or unit"
        return f"A single factor of {factor} on the stiffness would explain {gap}: {what}?"
    if alone:
        best = f"the best, {factor}, leaves {misfits} rms"
        return f"A single factor on the stiffness does not explain the gap: {best}."
    factors = join_names([f"{_factor(value)} ({name})" for name, value in single.by_channel.items()])
    need = f"the channels need {factors}, and a common {factor} leaves {misfits} rms"
    return f"No single factor on the stiffness explains the gap: {need}."


def _factor(factor: float) -> str:
    """Return a factor in words: 0.57, 1.75, 0.00037."""
    return f"{factor:.2f}" if 0.1 <= abs(factor) < 100.0 else number(factor)


def fault_kind(fault: DataFault) -> str:
    """Return the kind of a fault in two or three words."""
    return _KINDS.get(fault.kind, fault.kind)


def faulty_data(faults: Sequence[DataFault]) -> str:
    """Return a headline without its full stop: the faults that must be corrected before anything else, and where."""
    fatal = [fault for fault in faults if fault.fatal] or list(faults)
    places = dict.fromkeys(f"{fault_kind(fault)} in the {fault.channel} channel" for fault in fatal)
    return f"Faulty data: {join_names(list(places))}, to be corrected first"


def doubt_lines(faults: Sequence[DataFault]) -> list[str]:
    """Return a sentence on the faults that are probable, to stand above what follows from the recordings."""
    doubtful = [fault for fault in faults if fault.is_doubtful]
    places = [
        f"{fault_kind(fault)} in the {fault.channel} channel ({chance_in_words(fault.probability)})"
        for fault in doubtful
    ]
    return [f"Doubtful data: {join_names(places)}; what follows holds if there is none."] if places else []


def fault_lines(faults: Sequence[DataFault]) -> list[str]:
    """Return a line for each fault of the recordings: place and remedy; the fatal faults first."""
    return [
        f"{fault.channel}: {fault_kind(fault)}, {fault.where.rstrip('.')}. What to do: {fault.remedy.rstrip('.')}"
        for fault in sorted(faults, key=lambda fault: not fault.fatal)
    ]
