"""Fit the right physics to a recording made by another formula, and compare its misfit with the plain law's.

The truth is given, so that nothing is searched. The misfit of a model is measured by its excess: the sum of squares of
the misfit's features beyond the expectation of noise and calibration (`bushcli.likelihood.form`).
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.case import load_case
from bushcli.diagnosis import question
from bushcli.effects.effect import effects
from bushcli.faults import find_faults, masks
from bushcli.recording import read_recording
from bushcli.runtime.workers import Workers
from bushcli.selection.fit import FittedSamples, fit
from bushcli.selection.model_cache import ModelCache
from bushcli.selection.plain import first_plain_fit
from bushcli.selection.predict import Beside
from bushcli.selection.queue import Search
from bushcli.selection.state import State

Array = NDArray[np.float64]


def excess_by_channel(case_file: Path, truth: tuple[str, ...]) -> dict[str, Any] | None:
    """Excess of the plain law and of the right physics, by channel; None where one of them cannot be solved.

    Parameters
    ----------
    case_file
    truth : tuple of str
        Names of the true effects; empty for the law alone.
    """
    case = load_case(case_file)
    recordings = tuple(read_recording(source) for source in case.recordings)
    used = tuple(~masks(find_faults(case, recordings), recording) for recording in recordings)
    bare = replace(case, effects=())
    cache = ModelCache()
    plain, _, _ = question._plain_law(bare, None, cache.tables)
    rough = first_plain_fit(cache, bare, plain, used)
    if rough is None:
        return None
    problem, state = question.pose_problem(bare, rough, recordings, used, Workers(1, cache=cache), cache)
    result = {
        "names": [recording.name for recording in recordings],
        "law": plain.law,
        "features": [features.count for features in problem.likelihood.features],
        "signal": [float(v) for v in problem.likelihood.signal],
        "plain": [float(v) for v in state.evidence.left.excess],
    }
    if not truth:
        return result | {"left": result["plain"], "effective": _effective(state)}
    best: State | None = None
    search = Search(
        problem,
        Workers(1, cache=cache),
        state,
        [effects()[name] for name in truth],
        False,
        float("inf"),
        lambda *_: None,
    )
    while len(truth) > len((best or state).model.effects):
        base = best or state
        singles = Beside(base, search.derivatives.additions_beside(base)).singles()
        predicted = [
            prediction for prediction in singles if len(prediction.model.effects) > len(base.model.effects)
        ]
        tried = []
        for prediction in sorted(predicted, key=lambda prediction: -prediction.log_evidence)[:2]:
            fitted = fit(
                cache,
                bare,
                prediction.model,
                FittedSamples(used, problem.likelihood.plain, problem.noises),
                (base.model,),
                base.objective,
            )
            if fitted is not None:
                tried.append(State(problem, fitted))
        if not tried:
            return None
        best = max(tried, key=lambda candidate: candidate.evidence.log)
    assert best is not None
    return result | {
        "left": [float(v) for v in best.evidence.left.excess],
        "effective": _effective(best),
        "values": {k: float(v) for k, v in zip(best.fitted.names, best.fitted.x, strict=True)},
    }


def _effective(state: State) -> list[float]:
    """Participation ratio of the features of each channel's remaining misfit, less noise."""
    ratios = []
    for z in state.misfit:
        power = np.maximum(z**2 - 1.0, 0.0)
        ratios.append(float(power.sum() ** 2 / max(float(power @ power), 1e-300)))
    return ratios
