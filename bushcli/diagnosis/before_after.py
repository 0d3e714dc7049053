"""Every recording beside its simulation, before and after."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bushcli.diagnosis.held_out import HeldOut
from bushcli.diagnosis.noise_model import Compared
from bushcli.diagnosis.result import DiagnosedChannel
from bushcli.diagnosis.selected import Selection, structure
from bushcli.recording import Recording, displacement_noise
from bushcli.schedule import schedule

Array = NDArray[np.float64]


def before_and_after(found: Selection) -> tuple[DiagnosedChannel, ...]:
    """What the plain and the final model make of every channel, on the data used and on those held out."""
    outside = [
        found.foretold.get(structure(one.model, found.plain.model)) for one in (found.plain, found.best)
    ]
    made = []
    for i, (plain, best) in enumerate(zip(found.plain.channels, found.best.channels, strict=True)):
        recording, span = plain.recording, float(np.ptp(plain.recording.force))
        held = found.held[i]
        made.append(
            DiagnosedChannel(
                name=plain.name,
                mode=recording.mode,
                recording=recording,
                before=plain.simulated,
                after=best.simulated,
                before_percent=_percent(plain, span),
                after_percent=_percent(best, span),
                noise_percent=100.0 * plain.noise.sigma / span,
                held_out=held.samples,
                held_out_text=held.text,
                held_out_before=_held(outside[0], i, held, span),
                held_out_after=_held(outside[1], i, held, span),
                path=_smooth(recording),
            )
        )
    return tuple(made)


def _smooth(recording: Recording) -> Array:
    steps = schedule(recording.time, recording.displacement, displacement_noise(recording))
    clock = np.arange(len(recording.displacement), dtype=float) if recording.time is None else recording.time
    return steps.path(clock)


def _percent(channel: Compared, span: float) -> float:
    misfit = channel.misfit[channel.known]
    return 100.0 * float(np.sqrt(np.mean(misfit**2))) / span


def _held(answer: tuple[Compared, ...] | None, i: int, held: HeldOut, span: float) -> float:
    if answer is None or not held.samples.any():
        return float("nan")
    return 100.0 * float(np.sqrt(np.mean(answer[i].misfit[held.samples] ** 2))) / span
