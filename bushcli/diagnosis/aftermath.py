"""Last stage of a diagnosis: the proposed test, the maps, and the recordings before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bushcli.case import Case
from bushcli.diagnosis import answer
from bushcli.diagnosis.amplitudes import amplitude_faults
from bushcli.diagnosis.next_test import next_test
from bushcli.diagnosis.posterior import WeighedModel, credible_sets
from bushcli.diagnosis.question import Question
from bushcli.diagnosis.result import UNSEARCHED, DiagnosedChannel, DiagnosedTable, NextTest
from bushcli.diagnosis.vibrating import diagnosed_table
from bushcli.faults import DataFault, masks
from bushcli.inverse.channel import Channel
from bushcli.likelihood.calibration import calibrate, factor_of
from bushcli.likelihood.noise import Compared, noise_model
from bushcli.mismatch.maps import LocalMap
from bushcli.recording.dynamic.rows import RecordedTable
from bushcli.runtime.condition import CONTINUE, Condition
from bushcli.runtime.workers import Workers
from bushcli.selection.model import Fitted
from bushcli.selection.model_cache import ModelCache
from bushcli.selection.queue import Progress, Search
from bushcli.selection.state import CommonData, State
from cases.interrupt import is_interrupt
from cases.march import NotConverged


class Extras:
    """Doubts about amplitudes, the proposed test and the maps; if they fail, a condition is added to the verdict."""

    def __init__(self) -> None:
        self.test: NextTest | None = None
        self.maps: tuple[LocalMap, ...] = ()
        self.faults: tuple[DataFault, ...] = ()
        self.conditions: tuple[Condition, ...] = ()

    def make(
        self,
        search: Search,
        plain: Fitted,
        models: Sequence[WeighedModel],
        crew: Workers,
        cache: ModelCache,
        maps: bool,
    ) -> None:
        """Compute the doubts about amplitudes, the proposed test and, if `maps`, the maps of the bushing.

        The most probable of `models` is the first. If the search has not looked at most models, the rivals are not
        known, and no test is proposed.
        """
        problem, notify = search.problem, search.progress
        try:
            self.faults = amplitude_faults(search, crew)
            if search.share_left <= UNSEARCHED and len(credible_sets(models)) > 1:
                notify("next", "test", "which test would separate the rivals")
                self.test = next_test(problem, models, crew, notify)
            if maps and models[0].effects:
                self.maps = _maps(problem, plain, cache, notify)
        except NotConverged as error:
            remedy = "no other result depends on the map; --no-maps leaves it out"
            self.conditions = (
                Condition("no_map", f"the map of the bushing cannot be solved: {error}", remedy),
            )
        except BaseException as error:
            if not is_interrupt(error):
                raise
            crew.stop()
            what = "a doubt about amplitudes, the proposed test or the map of the bushing is missing"
            message = f"interrupted after the search: {what}"
            self.conditions = (Condition("interrupted", message, CONTINUE),)


def _maps(problem: CommonData, plain: Fitted, cache: ModelCache, notify: Progress) -> tuple[LocalMap, ...]:
    from bushcli.mismatch.bushing import local_map

    curves = [i for i, recording in enumerate(problem.recordings) if recording.kind == "static"]
    if problem.case.geometry.specimen == "coupon" or not curves:
        return ()
    channels = cache.channels(plain.model.task(problem.case))
    compared = problem.compared_recordings(plain.simulated)
    # All recordings are of one bushing: together they can show a place that none of them shows alone.
    rubber_map = local_map(
        [channel for channel in channels if isinstance(channel, Channel)],
        plain.model.start,
        [compared[i] for i in curves],
        [plain.jacobians[i] for i in curves],
        lambda name: notify("map", name, "where in the rubber a change would help"),
    )
    return (rubber_map,)


def calibrated_curves(
    cache: ModelCache, case: Case, plain: Fitted, compared: Sequence[Compared]
) -> tuple[Compared, ...]:
    """Return the recorded curves without the errors of their common factors, in which the misfit is located."""
    channels = cache.channels(plain.model.task(case))
    return tuple(
        calibrate(curve, factor_of(channel))
        for curve, channel in zip(compared, channels, strict=True)
        if curve.recording.kind == "static"
    )


def misfit_share_left(best: WeighedModel, plain: State) -> float:
    """Return the share of the plain law's squared misfit above the noise that a model leaves, 0 to 1."""
    before, after = (float(np.sum(np.maximum(s.evidence.left.excess, 0.0))) for s in (plain, best.state))
    return min(1.0, after / before) if before > 0.0 else 0.0


def before_and_after(
    cache: ModelCache, question: Question, problem: CommonData, plain: Fitted, best: WeighedModel
) -> tuple[tuple[DiagnosedChannel, ...], tuple[DiagnosedTable, ...]]:
    """Return recordings and tables beside the plain law and the most probable model; those held out are predicted."""
    fitted: Mapping[str, int] = {recording.name: i for i, recording in enumerate(problem.recordings)}
    predicted = {}
    case = question.case
    outside = replace(
        question.bare,
        recordings=tuple(recording for recording in case.recordings if recording.label not in fitted),
        dynamic=tuple(table for table in case.dynamic if table.label not in fitted),
    )
    if len(fitted) < len(question.whole):
        # An effect of a rig says nothing about the rig of another channel.
        bound = tuple(
            replace(active, channels=tuple(fitted))
            if active.effect.of_channel and active.channels is None
            else active
            for active in best.state.model.effects
        )
        for which, model in (("before", plain.model), ("after", replace(best.state.model, effects=bound))):
            for channel in cache.channels(model.task(outside)):
                try:
                    force, _ = channel.at_samples(channel.solve(model.values, ()))
                except NotConverged:
                    force = np.full(len(channel.recording.force), np.nan)
                predicted[which, channel.name] = force
    channels, tables = [], []
    for recording in question.whole:
        held_out = recording.name not in fitted
        if not held_out:
            i = fitted[recording.name]
            before, after = plain.simulated[i], best.state.fitted.simulated[i]
            used, sigma = problem.used[i], problem.noises[i].sigma
        else:
            before, after = predicted["before", recording.name], predicted["after", recording.name]
            used = ~masks(question.faults, recording)
            sigma = noise_model(recording, used).sigma
        if isinstance(recording, RecordedTable):
            tables.append(diagnosed_table(recording, before, after, used, held_out))
        else:
            channels.append(answer.diagnosed_channel(recording, before, after, sigma, used, held_out))
    return tuple(channels), tuple(tables)
