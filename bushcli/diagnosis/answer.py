"""From the posterior to the result: named effects with their values, rivals, channels, doubts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.curve.earlier import earlier, not_from_rest
from bushcli.curve.misfit import rms_percent
from bushcli.diagnosis.posterior import SHOWN, WeighedModel
from bushcli.diagnosis.question import Question
from bushcli.diagnosis.result import (
    SMALL,
    DiagnosedChannel,
    DiagnosedTable,
    Diagnosis,
    FormError,
    RankedModel,
    Verdict,
)
from bushcli.diagnosis.words import possible_shift
from bushcli.effects.names import readable_name
from bushcli.faults import masks
from bushcli.likelihood.features import Features
from bushcli.likelihood.form import Likelihood
from bushcli.likelihood.noise import Compared, noise_model
from bushcli.mismatch.missing_force import describe_missing, missing_force
from bushcli.mismatch.record import locate
from bushcli.recording import Recording
from bushcli.runtime.condition import Condition
from bushcli.selection.model import Model
from bushcli.selection.queue import Search
from bushcli.selection.search_extent import Ended, SearchExtent
from bushcli.selection.state import CommonData
from bushcli.simulate.schedule import schedule

Array = NDArray[np.float64]

# Noise above this percentage of the force range causes a warning, because it hides what users usually look for: the
# literature calls 10 % of misfit a good agreement of simulation and rig.
LOUD = 5.0
# Misfit of a channel that was held out, % of the force range or of K*, up to which it counts as predicted: mesh and
# calibration alone make 1 % (`likelihood.calibration`).
MISSED = 1.0
# Misfit that the features do not show, over the noise, from which on it is told: hum and rounding, not noise that is
# known to some tenths. Judgement; words only.
_FAST = 2.0
# Noise that lasts for so many samples, and whose independent sample is so many times that of short windows, may be
# something else: two standard deviations of the windows' error (`likelihood.level`).
MEMORY, SWELLS = 6.0, 2.5


def verdict(best: WeighedModel, plain: Model) -> Verdict:
    """Return the verdict that the most probable model implies, beside the plain law."""
    if best.unknown:
        return "unexplained"
    if best.state.model.effects:
        return "missing_physics"
    model = best.state.model
    same = (model.law, model.terms, model.fixed) == (plain.law, plain.terms, plain.fixed)
    return "explained" if same else "law_too_poor"


def ranked_models(models: Sequence[WeighedModel], search: Search) -> tuple[RankedModel, ...]:
    """Return the models that the report shows: the first, which gave the verdict, then the others by probability."""
    base = search.plain.evidence.log
    best, *others = models
    return tuple(
        RankedModel(
            model.model.law,
            model.effects,
            model.probability,
            model.log_evidence - base,
            model.state.misfit_over_noise if model.predicted is None else None,
            model.state.evidence.judgement.phi
            if model.predicted is None and model.kind == "effects"
            else None,
            {active.identity: active.variant for active in model.model.effects if active.variant},
        )
        for model in (best, *sorted(others, key=lambda model: -model.probability))
        if model.probability >= SHOWN
    )


# -- channels ------------------------------------------------------------------------------------------------------


def diagnosed_channel(
    recording: Recording, before: Array, after: Array, sigma: float, used: NDArray[np.bool_], held_out: bool
) -> DiagnosedChannel:
    """Return a recording (n samples) with its simulations by the plain law and by the most probable model.

    `sigma` is the standard deviation of the noise, in the unit of the force; the samples `used` count.
    """

    def percent(force: Array) -> float:
        return rms_percent((force - recording.force)[used], recording.force[used])

    steps = schedule(recording.time, recording.displacement, recording.displacement_noise)
    clock = np.arange(len(recording.displacement), dtype=float) if recording.time is None else recording.time
    return DiagnosedChannel(
        recording.name or recording.mode,
        recording.mode,
        recording,
        before,
        after,
        percent(before),
        percent(after),
        100.0 * sigma / float(np.ptp(recording.force[used])),
        held_out,
        steps.path(clock),
        ~used,
    )


def form_error(best: WeighedModel, likelihood: Likelihood, compared: Sequence[Compared]) -> FormError:
    """Return the form error assumed for the most probable model; with unknown physics the size of that."""
    judged = best.state.evidence.judgement
    if best.unknown:
        return _unknown_force(compared, likelihood.features)
    scale = np.array(judged.scale) - 1.0
    percent, fast = {}, {}
    for channel, excess, m, features in zip(
        compared, scale, likelihood.effective, likelihood.features, strict=True
    ):
        samples = float(np.count_nonzero(features.weights))
        unit = channel.noise.sigma * np.sqrt(channel.noise.correlation_time)
        size = float(np.sqrt(max(excess, 0.0) * m / max(samples, 1.0))) * unit
        per_cent = 100.0 / float(np.ptp(channel.recording.force[channel.known]))
        percent[channel.name] = per_cent * size
        rest = float(np.linalg.norm(features.rest(channel.misfit))) / np.sqrt(max(samples, 1.0))
        if channel.recording.kind == "static" and rest > _FAST * channel.noise.sigma:
            fast[channel.name] = per_cent * float(np.sqrt(rest**2 - channel.noise.sigma**2))
    left = float(np.sum(np.maximum(best.state.evidence.left.excess, 0.0)))
    allowed = float(np.sum(np.maximum(scale, 0.0) * likelihood.effective))
    share = judged.phi if best.state.model.effects else 0.0
    return FormError(share, percent, 1.0 if left <= allowed else allowed / left, fast)


def _unknown_force(compared: Sequence[Compared], features: Sequence[Features]) -> FormError:
    """Return the size of the unknown force as it is drawn, and how much of the misfit above the noise it is."""
    percent, explained, excess = {}, 0.0, 0.0
    for channel, own in zip(compared, features, strict=True):
        force = missing_force(channel, own)
        percent[channel.name] = float(
            100.0 * np.sqrt(np.mean(force**2)) / np.ptp(channel.recording.force[channel.known])
        )
        before, after = channel.misfit[channel.known], (channel.misfit + force)[channel.known]
        explained += float(before @ before - after @ after) / channel.noise.sigma**2
        excess += float(before @ before) / channel.noise.sigma**2 - len(before)
    return FormError(0.0, percent, min(1.0, max(0.0, explained / excess)) if excess > 0.0 else 1.0)


def refusal(question: Question, seconds: float) -> Diagnosis:
    """Return the verdict "faulty_data" with the faults and their remedies, without a simulation.

    The channels have their recordings and NaN in place of simulated forces. A law from coupons has its parameters, one
    that would be fitted to the recordings has none.
    """
    fitted = question.plain.fixed
    law = question.material if fitted else replace(question.material, parameters={})
    names = [recording.name for recording in question.recordings]
    channels = []
    for recording in question.whole:
        if recording.kind == "static":
            used = ~masks(question.faults, recording)
            none = np.full(len(recording.force), np.nan)
            sigma = noise_model(recording, used).sigma
            channels.append(
                diagnosed_channel(recording, none, none, sigma, used, recording.name not in names)
            )
    return Diagnosis(
        case=question.case,
        verdict="faulty_data",
        asked=question.requested,
        law_from=question.law_from,
        law_fixed=fitted,
        plain=law,
        material=law,
        form_error=FormError(np.nan, {}, np.nan),
        searched=SearchExtent(False, 1.0, "faulty data", (), (), {}),
        channels=tuple(channels),
        location=locate(()),
        remaining=locate(()),
        faults=question.faults,
        conditions=question.unusual,
        seconds=seconds,
    )


# -- doubts --------------------------------------------------------------------------------------------------------


def search_extent(
    search: Search, ended: Ended, undetected: Mapping[str, str], probability: Mapping[str, float]
) -> SearchExtent:
    """Return the extent of the search; an effect that has a probability (0 to 1) beside another one is detectable."""
    untestable = {**undetected, **search.derivatives.untestable}
    return SearchExtent(
        ended == "nothing left",
        search.share_left,
        ended,
        tuple(search.rows),
        tuple(search.lost.values()),
        {name: why for name, why in untestable.items() if probability.get(name, 0.0) < SMALL},
    )


def doubts(
    case: Case,
    channels: Sequence[DiagnosedChannel],
    tables: Sequence[DiagnosedTable],
    best: WeighedModel,
    problem: CommonData,
    extent: SearchExtent,
) -> list[Condition]:
    """Return what is doubtful about a diagnosis, as conditions with a remedy."""
    return [
        *_recording_doubts(case, channels),
        *_unrelaxed_start(best, problem),
        *_long_memory(best, problem),
        *_held_out((*channels, *tables)),
        *_search_doubts(best, extent),
    ]


def _recording_doubts(case: Case, channels: Sequence[DiagnosedChannel]) -> Iterator[Condition]:
    """Yield doubts about the effects of the case and the noise of its recordings."""
    if case.effects:
        names = ", ".join(readable_name(effect.name) for effect in case.effects)
        yield Condition(
            "effects_of_the_case",
            f"the effects in the case file ({names}) are not used: a diagnosis begins with the law alone and "
            "looks for these effects as for all others",
            "nothing to do if the diagnosis finds them; bushcli inverse identifies the law together with them",
        )
    loud = [channel for channel in channels if channel.noise_percent > LOUD]
    if loud:
        sizes = ", ".join(f"{channel.name} {channel.noise_percent:.0f} %" for channel in loud)
        yield Condition(
            "loud_noise",
            f"the noise is large compared with the force range ({sizes}): smaller deviations cannot be detected",
            "record more samples on every branch, or reduce the noise (estimated from neighbouring samples)",
        )


def _unrelaxed_start(best: WeighedModel, problem: CommonData) -> list[Condition]:
    """Return a doubt about recordings that do not begin at rest, if the most probable model has memory."""
    # A rig with memory, such as a late logger, does not make the rubber remember.
    effects = [active.effect for active in best.state.model.effects]
    if not any(effect.has_memory and effect.feature is not None for effect in effects):
        return []
    known = [
        (recording.name, earlier(recording)) for recording in problem.recordings if recording.kind == "static"
    ]
    return [not_from_rest(name, before) for name, before in known if before is not None]


def _long_memory(best: WeighedModel, problem: CommonData) -> Iterator[Condition]:
    """Yield a doubt about noise that short windows of a recording do not show, and that the misfit alone suggests.

    Such noise and physics that changes slowly leave the same misfit along each branch.
    """
    for channel, used, smooth in zip(
        problem.compared_recordings(best.state.fitted.simulated),
        problem.used,
        problem.likelihood.features,
        strict=True,
    ):
        if channel.recording.kind == "dynamic":
            continue
        before = noise_model(channel.recording, used)
        units = [noise.sigma * float(np.sqrt(noise.correlation_time)) for noise in (before, channel.noise)]
        if channel.noise.correlation_time < MEMORY or units[1] < SWELLS * units[0]:
            continue
        percent = 100.0 / float(np.ptp(channel.recording.force[used]))
        memory = f"{channel.noise.correlation_time:.0f} samples"
        if channel.recording.time is not None:
            memory += f" ({channel.noise.correlation_time * float(np.median(np.diff(channel.recording.time))):.2g} s)"
        like = "".join(f" ({text})" for text in describe_missing([channel], [smooth], 0.0, 0.0).text[:1])
        yield Condition(
            "noise_with_memory",
            f"{channel.name}: the misfit of the plain law is taken for noise of "
            f"{percent * channel.noise.sigma:.2g} % of the force range that is correlated over {memory}; windows "
            f"of some 24 samples show noise of {percent * before.sigma:.2g} %. Physics that changes slowly would "
            f"leave the same misfit{like}",
            "compare with the noise of the sensors at rest; if it is smaller, something slow is missing, and the "
            "probabilities are those of a recording with this noise",
        )


def _held_out(channels: Sequence[DiagnosedChannel | DiagnosedTable]) -> Iterator[Condition]:
    """Yield a doubt about channels that took no part in the fits and that the most probable model misses."""
    missed = [
        channel
        for channel in channels
        if channel.held_out and channel.after_percent > max(MISSED, 3 * channel.noise_percent)
    ]
    if missed:
        sizes = ", ".join(
            f"{channel.name} by {channel.after_percent:.2g} % {channel.of}, noise {channel.noise_percent:.2g} %"
            for channel in missed
        )
        yield Condition(
            "held_out_missed",
            f"the most probable model misses what was held out ({sizes})",
            "do not rely on the diagnosis for that channel: diagnose all channels together, without --hold-out",
        )


def _search_doubts(best: WeighedModel, extent: SearchExtent) -> Iterator[Condition]:
    """Yield what is doubtful about the search."""
    if not best.state.fitted.converged:
        yield Condition(
            "not_converged",
            "the fit of the most probable model ended before it had converged",
            "give other start values in [material.parameters]",
        )
    if extent.not_simulated:
        names = ", ".join(readable_name(name) for name in extent.not_simulated)
        yield Condition(
            "not_simulated",
            f"the bushing cannot be simulated with {names}: nothing is known of these effects",
            "do not take them as ruled out; check that [geometry] and the displacement have the right units and "
            "that the bushing can travel so far",
        )
    if extent.lost:
        yield Condition(
            "models_lost",
            f"{len(extent.lost)} models could not be solved from any start and have no probability: "
            + "; ".join(extent.lost),
            "do not take them as ruled out: the recordings exclude none of them",
        )
    if extent.ended == "budget":
        yield Condition(
            "budget",
            f"the time limit was reached: {possible_shift(extent.left)}",
            "give a larger --budget; with -o DIR, --resume continues this run",
        )
