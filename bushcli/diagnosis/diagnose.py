"""Locate the mismatch, say what physics was left out, model it, and say how probable that is.

The calculation from top to bottom: data faults; the plain law as `bushcli inverse` fits it; the likelihood (noise,
calibration, error of form); the search over models; the posterior; what it says. docs/diagnosis.md has the formulas.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path

from bushcli.case import Case, Material
from bushcli.diagnosis import answer
from bushcli.diagnosis.aftermath import Extras, before_and_after, judged, share_left
from bushcli.diagnosis.codec import FitCodec
from bushcli.diagnosis.fit import begin as begin_plain
from bushcli.diagnosis.fit import exact, fit_plain
from bushcli.diagnosis.model import Fitted, Model
from bushcli.diagnosis.posterior import Weighed, credible_sets, groups, posterior, probabilities
from bushcli.diagnosis.question import Question, posed, question
from bushcli.diagnosis.queue import Progress, Search
from bushcli.diagnosis.result import Diagnosis, Verdict
from bushcli.diagnosis.state import Problem, State
from bushcli.diagnosis.where.missing import missing
from bushcli.diagnosis.where.record import locate
from bushcli.errors import InputError
from bushcli.errors import Problem as Finding
from bushcli.inverse.verdict import history_not_kept
from bushcli.runtime.condition import Condition
from bushcli.runtime.interrupt import is_interrupt
from bushcli.runtime.store import Store
from bushcli.runtime.workers import Workers


@dataclass(frozen=True)
class _Found:
    """What the search has found.

    Attributes
    ----------
    search : Search
    models : tuple of Weighed
        The most probable one first.
    plain : Fitted
        The plain law as exactly as `bushcli inverse` fits it.
    interrupted : list of Condition
        What to say where the user stopped it.
    """

    search: Search
    models: tuple[Weighed, ...]
    plain: Fitted
    interrupted: list[Condition]


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
    resume: bool = False,
    maps: bool = True,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnose a case.

    Parameters
    ----------
    case
        With recordings. A law without parameters is fitted to them; where there are coupons it is fitted to these and
        kept, and the first question is what the bushing's rubber has that the coupons' has not.
    model
        Law to begin with; the case's where None.
    effects
        Names of those to be considered; all where None.
    hold_out
        Channels that take part in nothing and are predicted in the end.
    uniform
        Give all effects the same prior odds.
    budget
        Seconds after which the search ends with what it knows; without end where None.
    workers
        Processes side by side; the answer does not depend on their number.
    executor
        Of processes that are there already, such as the other ranks of `mpirun`, in place of `workers`.
    journal
        Folder in which every fit is kept, so that a stopped diagnosis can go on.
    resume
        Go on with what the folder holds.
    maps
        Look for the place in the bushing, too.
    progress
        Called with the stage, what is looked at, and what came of it.

    Returns
    -------
    Diagnosis
        Also when it is interrupted during the search, with a condition that says so.

    Raises
    ------
    InputError
        There are no recordings, one cannot be read, a name is unknown, or the plain law cannot be solved. Except in
        the last case nothing in the journal is touched.
    """
    begin = time.perf_counter()
    notify = progress or (lambda *_: None)
    asked = question(case, model, effects, hold_out)
    store = None if journal is None else Store(journal, FitCodec(), resume)
    _announce(store, resume, notify)
    crew = Workers(workers, store, executor)
    with crew.open():
        notify("fit", asked.plain.law, "the plain law")
        rough = _rough(asked, crew)
        problem, state = posed(asked.bare, rough, asked.recordings, asked.used, crew)
        deadline = float("inf") if budget is None else begin + budget
        search = Search(problem, crew, state, asked.effects, uniform, deadline, notify)
        found = _searched(asked, search, rough, crew)
        extras = Extras()
        if not found.interrupted and not asked.fatal:
            extras.make(problem, found.plain, found.models, crew, maps, notify)
    named = None if effects is None else tuple(effects)
    said = _answer(asked, found, extras)
    conditions = (*said.conditions, *_not_kept(store))
    return replace(said, asked=named, conditions=conditions, seconds=time.perf_counter() - begin)


def _rough(asked: Question, crew: Workers) -> Fitted:
    """Fit the plain law before it is known how much it leaves."""
    rough: Fitted | None = crew.run(begin_plain, [(asked.bare, asked.plain, asked.used)])[0]
    if rough is None:
        tried = ", ".join(f"{k} = {v:g}" for k, v in asked.plain.start.items())
        raise InputError(
            Finding(
                asked.case.path.name,
                f"{asked.plain.law} cannot be solved on these recordings from {tried}, nor from its own start values",
            )
        )
    return rough


def _searched(asked: Question, search: Search, rough: Fitted, crew: Workers) -> _Found:
    """Search, and weigh the models."""
    interrupted = [] if asked.fatal else _run(search, crew)
    models, plain = posterior(search), rough
    if not interrupted:
        best, plain, interrupted = _finished(models[0], rough, asked.plain, search.problem, crew)
        models = (best, *models[1:])
    return _Found(search, models, plain, interrupted)


def _answer(asked: Question, found: _Found, extras: Extras) -> Diagnosis:
    """What follows from the posterior."""
    search, models, best, plain = found.search, found.models, found.models[0], found.plain
    problem = search.problem
    before = problem.compared(plain.simulated)
    after = problem.compared(best.state.fitted.simulated)
    probability = probabilities(models, [one.name for one in asked.effects])
    channels = before_and_after(asked, problem, plain, best)
    says: Verdict = "faulty_data" if asked.fatal else answer.verdict(best, asked.plain)
    left = share_left(best, search.plain)
    unknown = probability["unknown"]
    return Diagnosis(
        case=asked.case,
        verdict=says,
        asked=None,
        law_from=asked.law_from,
        law_fixed=best.state.model.fixed,
        plain=_material(asked.material, plain.model),
        material=_material(asked.material, best.state.model),
        parameters=answer.quantities(best.state, asked.case.material),
        effects=() if asked.fatal else answer.named(best, search, probability, asked.case.material),
        probability=probability,
        models=answer.ranked(models, search),
        rivals=tuple(one for one in credible_sets(models) if one != best.effects),
        groups=groups(models, probability),
        form_error=answer.form_error(best, search.plain, after),
        missing=None if says == "explained" else missing(after, problem.likelihood.features, unknown, left),
        searched=answer.searched(search),
        channels=channels,
        location=locate(judged(asked.bare, plain, before)),
        remaining=locate(judged(asked.bare, plain, after)),
        next_test=extras.test,
        maps=extras.maps,
        faults=asked.faults,
        conditions=(
            *found.interrupted,
            *extras.conditions,
            *answer.doubts(asked.case, channels, best, search),
        ),
        forward_solves=search.solves + plain.solves,
        failed_solves=search.failed + plain.failed,
        seconds=0.0,
    )


def _not_kept(store: Store | None) -> tuple[Condition, ...]:
    """The folder of results is full: the diagnosis is complete, but cannot be gone on with."""
    failure = "" if store is None else store.failure()
    return (history_not_kept(failure),) if failure else ()


def _announce(store: Store | None, resume: bool, notify: Progress) -> None:
    """Whether fits of an earlier run are used, thrown away, or missing."""
    if store is None or not (resume or store.there):
        return
    fits = f"{store.there} result{'s' * (store.there != 1)}"
    if not resume:
        notify("begin", store.folder.name, f"{fits} of an earlier run deleted; --resume would have kept them")
    elif store.there:
        notify("resume", store.folder.name, f"{fits} found")
    else:
        notify("resume", str(store.folder), "no results are there: from the beginning")


def _run(search: Search, crew: Workers) -> list[Condition]:
    """Search; where that is interrupted, what to say of it."""
    try:
        search.run()
    except BaseException as error:
        if not is_interrupt(error) or not search.states:
            raise
        crew.stop()
        search.ended = "interrupted"
        left = 100 * search.left
        message = f"stopped during the search: further fits may move {left:.0f} % of the probability"
        return [Condition("interrupted", message, "run it again with --resume")]
    return []


def _finished(
    best: Weighed, rough: Fitted, chosen: Model, problem: Problem, crew: Workers
) -> tuple[Weighed, Fitted, list[Condition]]:
    """The best model with the forces of the usual mesh, and the plain law as exactly as `bushcli inverse` fits it.

    Both as they are where that is interrupted, with what to say of it.
    """
    try:
        plain = crew.run(fit_plain, [(problem.case, chosen)])[0] or rough
        if best.state.model.anchor is not None:
            found = crew.run(exact, [(problem.case, best.state.fitted)])[0]
            best = best if found is None else replace(best, state=State(problem, found))
    except BaseException as error:
        if not is_interrupt(error):
            raise
        crew.stop()
        message = "stopped after the search: the plain law is less exact than that of bushcli inverse"
        return best, rough, [Condition("interrupted", message, "run it again with --resume")]
    return best, plain, []


def _material(material: Material, model: Model) -> Material:
    return Material(model.law, material.bulk_modulus, dict(model.start), model.terms)
