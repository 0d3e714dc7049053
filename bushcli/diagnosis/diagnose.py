"""Diagnosis of a case: locate the mismatch, identify the missing physics, fit it, and give its probability.

The calculation from top to bottom: data faults, which end it if they are fatal; the plain law; the likelihood (noise,
calibration, error of form); the search over models; the posterior; the plain law and the answer, fitted to their ends;
the result.
docs/diagnosis.md has the formulas.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import cast

from bushcli.case import Case, Material
from bushcli.diagnosis import answer, values
from bushcli.diagnosis.aftermath import Extras, before_and_after, calibrated_curves, misfit_share_left
from bushcli.diagnosis.posterior import (
    WeighedModel,
    credible_sets,
    groups,
    posterior,
    probabilities,
    run_with_shown,
)
from bushcli.diagnosis.question import Question, pose_problem, question
from bushcli.diagnosis.result import UNSEARCHED, Diagnosis, Verdict
from bushcli.diagnosis.words import possible_shift
from bushcli.errors import InputError, Problem, count_of
from bushcli.inverse.verdict import history_not_saved
from bushcli.mismatch.missing_force import describe_missing
from bushcli.mismatch.record import locate
from bushcli.recording.table_cache import TableCache
from bushcli.runtime.condition import CONTINUE, Condition, history_damaged
from bushcli.runtime.store import Store, history_of, holds_results
from bushcli.runtime.workers import Pending, Workers
from bushcli.selection.closest import closest_model, on_default_mesh
from bushcli.selection.codec import FitCodec
from bushcli.selection.model import Fitted, Model
from bushcli.selection.model_cache import ModelCache
from bushcli.selection.plain import first_plain_fit, fit_plain
from bushcli.selection.queue import Progress, Search
from bushcli.selection.search_extent import Ended
from bushcli.selection.state import State
from bushcli.selection.unnoticed import unnoticed_effects
from cases.interrupt import is_interrupt


@dataclass(frozen=True)
class _Outcome:
    """Result of the search, its most probable model first, and what follows from it."""

    search: Search
    ended: Ended
    # Effects that may be there unnoticed, and why.
    unnoticed: dict[str, str]
    models: tuple[WeighedModel, ...]
    # The plain law, fitted as accurately as by `bushcli inverse` unless the user stopped the calculation.
    plain: Fitted
    # What to report if the user stopped it.
    interrupted: list[Condition]
    extras: Extras


def diagnose(
    case: Case,
    *,
    model: str | None = None,
    effects: Sequence[str] | None = None,
    hold_out: Sequence[str] = (),
    uniform: bool = False,
    budget: float | None = None,
    workers: int = 1,
    executor: Executor | None = None,
    journal: Path | None = None,
    resume: bool | None = False,
    maps: bool = True,
    progress: Progress | None = None,
    tables: TableCache | None = None,
) -> Diagnosis:
    """Diagnose a case.

    Parameters
    ----------
    case
        With recordings, to which the plain law is fitted; if there are coupons, it is fitted to these and kept.
    model, effects
        Law to begin with, the case's where None; names of the effects to be considered, all where None.
    hold_out
        Channels that are left out of fits and evidence, and predicted at the end.
    uniform, budget
        Give all effects the same prior odds; seconds after which the search starts no further fits, or None.
    workers, executor
        Number of processes, or existing ones such as the ranks of `mpirun`; the answer does not depend on them.
    journal, resume
        Folder in which every fit is saved, untouched if the input is refused; whether to use the fits that it holds,
        or None: to use them if there are any.
    maps
        Whether to map the misfit in the bushing, too.
    progress
        Called with the stage, its subject, and a text about it.
    tables
        Cache of the files that the caller reads.

    Returns
    -------
    Diagnosis
        If the search was interrupted, it has a condition that says so.

    Raises
    ------
    InputError
        No recordings, one that cannot be read, an unknown name, or a plain law that cannot be solved.
    """
    start, notify = time.perf_counter(), progress or (lambda *_: None)
    cache = ModelCache(tables)
    asked = question(case, model, effects, hold_out, cache.tables)
    for fault in asked.faults:
        notify("data", fault.channel, fault.where)
    if asked.fatal:
        return answer.refusal(asked, time.perf_counter() - start)
    store = _open_store(journal, resume, notify)
    deadline = start + (float("inf") if budget is None else budget)
    with Workers(workers, store, executor, cache).open() as crew:
        outcome = _calculate(asked, crew, cache, uniform, deadline, maps, notify)
    return _with_notes(_answer(asked, outcome, cache), store, start, notify)


def _calculate(
    question: Question,
    crew: Workers,
    cache: ModelCache,
    uniform: bool,
    deadline: float,
    maps: bool,
    notify: Progress,
) -> _Outcome:
    """Return the fitted models, the next test and the maps; no fit begins after `deadline` of `time.perf_counter`."""
    notify("fit", question.plain.law, "the plain law")
    rough = _fit_before_noise(question, crew)
    problem, state = pose_problem(question.bare, rough, question.recordings, question.used, crew, cache)
    law_alone = _LawAlone(crew, problem.case, question.plain)
    meanwhile = partial(law_alone.ask, state.fitted)
    search = Search(problem, crew, state, question.effects, uniform, deadline, notify, meanwhile)
    ended, unnoticed, interrupted = _run(search)
    models, plain, extras = posterior(search), rough, Extras()
    if not interrupted:
        best, plain, interrupted = _finish(models[0], rough, law_alone, search)
        models = (best, *models[1:])
    if not interrupted:
        extras.make(search, plain, models, crew, cache, maps)
    return _Outcome(search, ended, unnoticed, models, plain, interrupted, extras)


def _fit_before_noise(question: Question, crew: Workers) -> Fitted:
    """Fit the plain law before the size of its misfit is known."""
    rough: Fitted | None = crew.run(first_plain_fit, [(question.bare, question.plain, question.used)])[0]
    if rough is None:
        tried = ", ".join(f"{k} = {v:g}" for k, v in question.plain.start.items())
        raise InputError(
            Problem(
                question.case.path.name,
                f"the recordings cannot be simulated with {question.plain.law}, from {tried} or from its own start "
                "values",
            )
        )
    return rough


class _LawAlone:
    """The plain law's fit as by `bushcli inverse`, which another process may do beside the search."""

    def __init__(self, crew: Workers, case: Case, chosen: Model) -> None:
        self._crew, self._case, self.chosen = crew, case, chosen
        self._known: dict[str, float] = {}
        self._asked: Pending | None = None

    def ask(self, found: Fitted) -> Pending:
        """Begin the fit, given what the search has found; again where it has found other values meanwhile."""
        known = dict(zip(found.names, map(float, found.x), strict=True))
        if self._asked is None or known != self._known:
            if self._asked is not None:
                self._asked.abandon()
            self._known = known
            self._asked = self._crew.ask(fit_plain, (self._case, self.chosen, known))
        return self._asked

    def fit(self, search: Search) -> Fitted | None:
        """Wait for the fit beside what the search has found at its end."""
        found = search.states.get(self.chosen.structure, search.plain).fitted
        return cast("Fitted | None", self.ask(found).answer())


def _answer(question: Question, outcome: _Outcome, cache: ModelCache) -> Diagnosis:
    """Return the result that follows from the posterior."""
    search, models, best, plain = outcome.search, outcome.models, outcome.models[0], outcome.plain
    problem, extras = search.problem, outcome.extras
    before = problem.compared_recordings(plain.simulated)
    after = problem.compared_recordings(best.state.fitted.simulated)
    probability = probabilities(models, [effect.name for effect in question.effects])
    channels, tables = before_and_after(cache, question, problem, plain, best)
    # Models are compared only if most of them have been looked at.
    unsearched = search.share_left > UNSEARCHED
    verdict: Verdict = "unexplained" if unsearched else answer.verdict(best, question.plain)
    left = misfit_share_left(best, search.plain)
    unknown = probability.get("unknown", 0.0)
    extent = answer.search_extent(search, outcome.ended, outcome.unnoticed, probability)
    places = [calibrated_curves(cache, question.bare, plain, compared) for compared in (before, after)]
    curves = [i for i, recording in enumerate(problem.recordings) if recording.kind == "static"]
    return Diagnosis(
        case=question.case,
        verdict=verdict,
        asked=question.requested,
        law_from=question.law_from,
        law_fixed=best.state.model.fixed,
        plain=_material(question.material, plain.model),
        material=_material(question.material, best.state.model),
        parameters=values.quantities(models, question.case.material),
        effects=() if unsearched else values.diagnosed_effects(models, search, question.case.material),
        probability=probability,
        models=() if unsearched else answer.ranked_models(models, search),
        rivals=() if unsearched else tuple(names for names in credible_sets(models) if names != best.effects),
        groups=() if unsearched else groups(models, probability),
        form_error=answer.form_error(best, problem.likelihood, after),
        missing=None
        if unsearched or verdict == "explained" or (left <= 0.0 and not best.unknown)
        else describe_missing(
            [after[i] for i in curves], [problem.likelihood.features[i] for i in curves], unknown, left
        ),
        searched=extent,
        channels=channels,
        tables=tables,
        location=locate(places[0]),
        remaining=locate(places[1]),
        next_test=extras.test,
        maps=extras.maps,
        faults=(*question.faults, *extras.faults),
        conditions=(
            *outcome.interrupted,
            *extras.conditions,
            *answer.doubts(question.case, channels, tables, best, problem, extent),
            *question.unusual,
        ),
        forward_solves=search.solves + plain.solves,
        failed_solves=search.failed + plain.failed,
        uniform_odds=search.uniform,
        seconds=0.0,
    )


def _with_notes(diagnosis: Diagnosis, store: Store | None, start: float, notify: Progress) -> Diagnosis:
    """Add the time spent, and what became of the saved results: how many were used, damaged, or cannot be saved."""
    conditions = list(diagnosis.conditions)
    if store is not None:
        if store.resumes:
            notify("resume", store.folder.name, f"{len(store.used)} of {store.there} saved results were used")
        if store.damaged:
            conditions.append(history_damaged(store.damaged))
        if failure := store.failure():
            conditions.append(history_not_saved(failure))
    return replace(diagnosis, conditions=tuple(conditions), seconds=time.perf_counter() - start)


def _open_store(journal: Path | None, resume: bool | None, notify: Progress) -> Store | None:
    """Open the folder of results, and say whether those of an earlier run are used, replaced, or missing.

    To resume is as True with None, but without a word if there are none.
    """
    if journal is None:
        return None
    # Fits of any question share a folder, because each has the name of its own question.
    store = Store(history_of(journal, holds_results, resume)[0], FitCodec(), resume is not False)
    fits = count_of(store.there, "result")
    if store.there and resume is False:
        notify("begin", store.folder.name, f"{fits} found; those of the same question are calculated again")
    elif store.there:
        notify("resume", store.folder.name, f"{fits} found; those of the same case and revision are used")
    elif resume:
        notify("resume", str(store.folder), "there are no saved results: starting from the beginning")
    return store


def _run(search: Search) -> tuple[Ended, dict[str, str], list[Condition]]:
    """Run the search; return why it ended, effects that may be there unnoticed, a condition if it was interrupted."""
    unnoticed: dict[str, str] = {}
    try:
        ended = run_with_shown(search)
        if ended == "nothing left":
            unnoticed = unnoticed_effects(search, posterior(search)[0].state)
    except BaseException as error:
        if not is_interrupt(error):
            raise
        search.workers.stop()
        message = f"interrupted during the search: {possible_shift(search.share_left)}"
        return "interrupted", {}, [Condition("interrupted", message, CONTINUE)]
    return ended, unnoticed, []


def _finish(
    best: WeighedModel, rough: Fitted, law_alone: _LawAlone, search: Search
) -> tuple[WeighedModel, Fitted, list[Condition]]:
    """Return the best model and the plain law, each fitted until it converges on the default mesh.

    If the user interrupts this, both are returned unchanged, with a condition that says so.
    """
    problem, crew, chosen = search.problem, search.workers, law_alone.chosen
    search.progress("fit", chosen.law, "the plain law once more, with the weights of bushcli inverse")
    try:
        if best.state.model.structure == chosen.structure:
            # What is printed of the law alone are the numbers of `bushcli inverse`.
            plain = law_alone.fit(search) or rough
            best = replace(best, state=State(problem, plain))
        else:
            closest = on_default_mesh(search, closest_model(search, best.state))
            best = replace(best, state=closest, searched=best.state)
            plain = law_alone.fit(search) or rough
    except BaseException as error:
        if not is_interrupt(error):
            raise
        crew.stop()
        message = "interrupted after the search: plain law and answer are fitted less closely than by bushcli inverse"
        return best, rough, [Condition("interrupted", message, CONTINUE)]
    return best, plain, []


def _material(material: Material, model: Model) -> Material:
    return Material(model.law, material.bulk_modulus, dict(model.start), model.terms)
