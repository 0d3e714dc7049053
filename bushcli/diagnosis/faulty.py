"""The result of a diagnosis that is refused: a fault of the data must be corrected first, and nothing is fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bushcli.diagnosis import answer
from bushcli.diagnosis.question import Question
from bushcli.diagnosis.result import DiagnosedChannel, Diagnosis, FormError
from bushcli.faults import masks
from bushcli.likelihood.noise import noise_model
from bushcli.mismatch.record import locate
from bushcli.selection.search_extent import SearchExtent


def refusal(question: Question, seconds: float) -> Diagnosis:
    """Return the verdict "faulty_data" with the faults and their remedies, without a simulation.

    The channels have their recordings and NaN in place of simulated forces. A law from coupons has its parameters, one
    that would be fitted to the recordings has none.
    """
    fitted = question.plain.fixed
    law = question.material if fitted else replace(question.material, parameters={})
    return Diagnosis(
        case=question.case,
        verdict="faulty_data",
        asked=question.requested,
        law_from=question.law_from,
        law_fixed=fitted,
        plain=law,
        material=law,
        parameters={},
        effects=(),
        probability={},
        models=(),
        rivals=(),
        groups=(),
        form_error=FormError(np.nan, {}, np.nan),
        missing=None,
        searched=SearchExtent(False, 1.0, "faulty data", (), (), {}),
        channels=_recorded_channels(question),
        tables=(),
        location=locate(()),
        remaining=locate(()),
        next_test=None,
        maps=(),
        faults=question.faults,
        conditions=question.unusual,
        forward_solves=0,
        failed_solves=0,
        seconds=seconds,
    )


def _recorded_channels(question: Question) -> tuple[DiagnosedChannel, ...]:
    """Return the recordings without a simulation beside them."""
    names = [recording.name for recording in question.recordings]
    channels = []
    for recording in question.whole:
        if recording.kind == "dynamic":
            continue
        used = ~masks(question.faults, recording)
        none = np.full(len(recording.force), np.nan)
        sigma = noise_model(recording, used).sigma
        channels.append(
            answer.diagnosed_channel(recording, none, none, sigma, used, recording.name not in names)
        )
    return tuple(channels)
