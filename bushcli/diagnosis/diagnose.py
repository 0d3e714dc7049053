"""Locate the mismatch, say what physics was left out, model it, and say how probable that is.

The calculation from top to bottom: data faults; the plain law as `bushcli inverse` fits it; the likelihood (noise,
calibration, error of form); the search over models; the posterior; what it says. docs/diagnosis.md has the formulas.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case, Material
from bushcli.diagnosis import answer, kept
from bushcli.diagnosis.codec import FitCodec
from bushcli.diagnosis.fit import Measured, all_features, exact, fit, fit_plain
from bushcli.diagnosis.fit import begin as begin_plain
from bushcli.diagnosis.likelihood.calibration import calibrated, factor_of
from bushcli.diagnosis.likelihood.form import Likelihood
from bushcli.diagnosis.likelihood.noise import Compared, noise_model
from bushcli.diagnosis.model import Fitted, Model
from bushcli.diagnosis.next_test import next_test
from bushcli.diagnosis.posterior import Weighed, credible_sets, groups, posterior, probabilities
from bushcli.diagnosis.queue import Progress, Search
from bushcli.diagnosis.result import DiagnosedChannel, Diagnosis, NextTest, Verdict
from bushcli.diagnosis.state import Problem, State
from bushcli.diagnosis.where.maps import LocalMap
from bushcli.diagnosis.where.missing import missing
from bushcli.diagnosis.where.record import locate
from bushcli.effects.effect import Effect
from bushcli.effects.effect import effects as catalogue
from bushcli.errors import InputError, nearest
from bushcli.errors import Problem as Finding
from bushcli.faults import DataFault, find_faults, masks
from bushcli.inverse.identify import fit_coupons
from bushcli.inverse.verdict import history_not_kept
from bushcli.recording import Recording, read_recording
from bushcli.runtime.condition import Condition
from bushcli.runtime.interrupt import is_interrupt
from bushcli.runtime.store import Store
from bushcli.runtime.workers import Workers
from cases.march import NotConverged
from forms.law import law, laws

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


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
    told = progress or (lambda *_: None)
    whole = _checked(case, model, effects, hold_out)
    faults = find_faults(case, whole)
    chosen, source, first = _plain(case, model)
    bare, recordings = _without(case, whole, hold_out)
    store = None if journal is None else Store(journal, FitCodec(), resume)
    _tell_what_is_kept(store, resume, told)
    crew = Workers(workers, store, executor)
    with crew.open():
        told("fit", chosen.law, "the plain law")
        used = tuple(~masks(faults, one) for one in recordings)
        rough = crew.run(begin_plain, [(bare, chosen, used)])[0]
        if rough is None:
            tried = ", ".join(f"{k} = {v:g}" for k, v in chosen.start.items())
            raise InputError(
                Finding(
                    case.path.name,
                    f"{chosen.law} cannot be solved on these recordings from {tried}, nor from its own start values",
                )
            )
        problem, state = _posed(bare, rough, recordings, used, crew)
        deadline = float("inf") if budget is None else begin + budget
        fatal = [fault for fault in faults if fault.fatal and fault.channel not in hold_out]
        considered = [] if fatal else _considered(bare, effects)
        search = Search(problem, crew, state, considered, uniform, deadline, told)
        interrupted = [] if fatal else _run(search, crew)
        models = posterior(search)
        best, plain = models[0], rough
        if not interrupted:
            best, plain, interrupted = _finished(best, rough, chosen, problem, crew)
            models = (best, *models[1:])
        extras = _Extras()
        if not interrupted and not fatal:
            extras.make(problem, plain, models, crew, maps, told)
    before = problem.compared(plain.simulated)
    after = problem.compared(best.state.fitted.simulated)
    probability = probabilities(models, [one.name for one in considered])
    channels = _channels(case, bare, whole, problem, plain, best, faults)
    says: Verdict = "faulty_data" if fatal else answer.verdict(best, chosen)
    judged = [_judged(bare, plain, compared) for compared in (before, after)]
    left = _left(best, search.plain)
    return Diagnosis(
        case=case,
        verdict=says,
        asked=None if effects is None else tuple(effects),
        law_from=source,
        law_fixed=best.state.model.fixed,
        plain=_material(first, plain.model),
        material=_material(first, best.state.model),
        parameters=answer.quantities(best.state, case.material),
        effects=() if fatal else answer.named(best, search, probability, case.material),
        probability=probability,
        models=answer.ranked(models, search),
        rivals=tuple(credible_sets(models)[1:]),
        groups=groups(models, probability),
        form_error=answer.form_error(best, search.plain, after),
        missing=missing(after, problem.likelihood.features, probability["unknown"], left)
        if says != "explained"
        else None,
        searched=answer.searched(search),
        channels=channels,
        location=locate(judged[0]),
        remaining=locate(judged[1]),
        next_test=extras.test,
        maps=extras.maps,
        faults=faults,
        conditions=(
            *interrupted,
            *extras.conditions,
            *answer.doubts(case, channels, best, search),
            *_not_kept(store),
        ),
        forward_solves=search.solves + plain.solves,
        failed_solves=search.failed + plain.failed,
        seconds=time.perf_counter() - begin,
    )


def _not_kept(store: Store | None) -> tuple[Condition, ...]:
    """The folder of results is full: the diagnosis is complete, but cannot be gone on with."""
    failure = "" if store is None else store.failure()
    return (history_not_kept(failure),) if failure else ()


# -- the question --------------------------------------------------------------------------------------------------


def _checked(
    case: Case, model: str | None, only: Sequence[str] | None, hold_out: Sequence[str]
) -> tuple[Recording, ...]:
    """The recordings of the case, after all names have been checked."""
    if not case.recordings:
        wanted = "[[recordings]] with mode and file"
        raise InputError(Finding(str(case.path), "there are no [[recordings]] to diagnose", "", wanted))
    recordings = tuple(read_recording(source) for source in case.recordings)
    if model is not None and model not in laws():
        raise InputError(
            Finding("--model", f'"{model}" is not a law', nearest(model, laws()), ", ".join(laws()))
        )
    names = [one.name for one in recordings]
    for given, known, option, kind in (
        (only or (), list(catalogue()), "--effects", "an effect"),
        (hold_out, names, "--hold-out", "a channel of this case"),
    ):
        wrong = [name for name in given if name not in known]
        if wrong:
            # The list of those that there are is long: once.
            lists = [""] * (len(wrong) - 1) + [", ".join(known)]
            raise InputError(
                *(
                    Finding(option, f'"{name}" is not {kind}', nearest(name, known), expected)
                    for name, expected in zip(wrong, lists, strict=True)
                )
            )
    if hold_out and set(names) <= set(hold_out):
        raise InputError(Finding("--hold-out", "leaves no channel to diagnose", "", ", ".join(names)))
    return recordings


def _without(
    case: Case, recordings: Sequence[Recording], hold_out: Sequence[str]
) -> tuple[Case, tuple[Recording, ...]]:
    """The case without effects and without what is held out, and its recordings."""
    kept_ = [(s, r) for s, r in zip(case.recordings, recordings, strict=True) if r.name not in hold_out]
    bare = replace(case, effects=(), recordings=tuple(source for source, _ in kept_))
    return bare, tuple(recording for _, recording in kept_)


def _considered(case: Case, only: Sequence[str] | None) -> list[Effect]:
    """The effects to be considered, of those that the specimen can have."""
    specimen = "coupon" if case.geometry.specimen == "coupon" else "bushing"
    return [
        effect
        for name, effect in catalogue().items()
        if specimen in effect.specimens and (only is None or name in only)
    ]


def _tell_what_is_kept(store: Store | None, resume: bool, told: Progress) -> None:
    """Whether fits of an earlier run are used, thrown away, or missing."""
    if store is None or not (resume or store.there):
        return
    fits = f"{store.there} result{'s' * (store.there != 1)}"
    if not resume:
        told("begin", store.folder.name, f"{fits} of an earlier run deleted; --resume would have kept them")
    elif store.there:
        told("resume", store.folder.name, f"{fits} found")
    else:
        told("resume", str(store.folder), "no results are there: from the beginning")


def _plain(case: Case, name: str | None) -> tuple[Model, Literal["recordings", "coupons"], Material]:
    """The law to begin with, where it comes from, and the case's material with it."""
    material = (
        case.material
        if name in (None, case.material.law)
        else Material(str(name), case.material.bulk_modulus)
    )
    chosen = law(material.law)
    if case.coupons:
        fitted = fit_coupons(case, material.law).material
        return Model(material.law, dict(fitted.parameters), fixed=True, terms=fitted.terms), "coupons", fitted
    names = material.parameter_names
    start = {key: chosen.parameter(key).start for key in names} | dict(material.parameters)
    return Model(material.law, start, terms=material.terms), "recordings", material


def _posed(
    case: Case, plain: Fitted, recordings: tuple[Recording, ...], used: tuple[Mask, ...], crew: Workers
) -> tuple[Problem, State]:
    """The likelihood, and the plain law at its best under it.

    What the plain law leaves sets the units of all fits, its own included: two rounds, after which they stay.
    """
    features = all_features(case, plain.model, used)
    noises = tuple(noise_model(one) for one in recordings)
    fitted = plain
    for _ in range(2):
        empty = Problem(case, recordings, noises, used, Likelihood(features, tuple(0.0 for _ in features)))
        excess = State(empty, fitted).evidence.left.excess
        problem = replace(empty, likelihood=Likelihood(features, tuple(map(float, excess))))
        if not fitted.names:
            break
        again = crew.run(fit, [(case, fitted.model, Measured(used, problem.likelihood.plain))])[0]
        fitted = again or fitted
    return problem, State(problem, fitted)


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
        message = (
            f"stopped during the search: models that were not fitted may hold {left:.0f} % of the probability"
        )
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


class _Extras:
    """The next test and the maps, which the verdict does not wait for: what stops them is a condition."""

    def __init__(self) -> None:
        self.test: NextTest | None = None
        self.maps: tuple[LocalMap, ...] = ()
        self.conditions: tuple[Condition, ...] = ()

    def make(
        self,
        problem: Problem,
        plain: Fitted,
        models: Sequence[Weighed],
        crew: Workers,
        maps: bool,
        told: Progress,
    ) -> None:
        """Make them."""
        try:
            if len(credible_sets(models)) > 1:
                told("next", "test", "what would separate the rivals")
                self.test = next_test(problem, models, crew, told)
            if maps and models[0].effects:
                self.maps = _maps(problem, plain, told)
        except NotConverged as error:
            remedy = "nothing else depends on it; --no-maps leaves it out"
            self.conditions = (
                Condition("no_map", f"the map of the bushing cannot be solved: {error}", remedy),
            )
        except BaseException as error:
            if not is_interrupt(error):
                raise
            crew.stop()
            message = "stopped after the search: the next test or the map of the bushing is missing"
            self.conditions = (Condition("interrupted", message, "run it again with --resume"),)


def _maps(problem: Problem, plain: Fitted, told: Progress) -> tuple[LocalMap, ...]:
    from bushcli.diagnosis.where.bushing import local_map

    if problem.case.geometry.specimen == "coupon":
        return ()
    # All recordings are of one bushing: together they tell a place that none of them tells alone.
    one = local_map(
        kept.channels(plain.model.task(problem.case)),
        plain.model.start,
        problem.compared(plain.simulated),
        plain.jacobians,
        lambda name: told("map", name, "where in the rubber a change would help"),
    )
    return (one,)


# -- the answer ----------------------------------------------------------------------------------------------------


def _judged(case: Case, plain: Fitted, compared: Sequence[Compared]) -> tuple[Compared, ...]:
    """The channels with their common factors taken out, as they are looked at."""
    channels = kept.channels(plain.model.task(case))
    return tuple(calibrated(one, factor_of(channel)) for one, channel in zip(compared, channels, strict=True))


def _left(best: Weighed, plain: State) -> float:
    """Share of the plain law's squared misfit above the noise that the best model leaves."""
    before, after = (
        max(float(np.sum(np.maximum(s.evidence.left.excess, 0.0))), 1e-12) for s in (plain, best.state)
    )
    return min(1.0, after / before)


def _channels(
    case: Case,
    bare: Case,
    whole: Sequence[Recording],
    problem: Problem,
    plain: Fitted,
    best: Weighed,
    faults: Sequence[DataFault],
) -> tuple[DiagnosedChannel, ...]:
    """Every recording before and after, those held out predicted."""
    fitted: Mapping[str, int] = {one.name: i for i, one in enumerate(problem.recordings)}
    predicted = {}
    sources = tuple(s for s, r in zip(case.recordings, whole, strict=True) if r.name not in fitted)
    if sources:
        outside = replace(bare, recordings=sources)
        # What belongs to a rig says nothing of the rig of another channel.
        bound = tuple(
            replace(one, channels=tuple(fitted)) if one.effect.of_channel and one.channels is None else one
            for one in best.state.model.effects
        )
        for which, model in (("before", plain.model), ("after", replace(best.state.model, effects=bound))):
            for channel in kept.channels(model.task(outside)):
                try:
                    force, _ = channel.at_samples(channel.solve(model.values, ()))
                except NotConverged:
                    force = np.full(len(channel.recording.force), np.nan)
                predicted[which, channel.name] = force
    found = []
    for recording in whole:
        if recording.name in fitted:
            i = fitted[recording.name]
            before, after = plain.simulated[i], best.state.fitted.simulated[i]
            used, sigma = problem.used[i], problem.noises[i].sigma
        else:
            before, after = predicted["before", recording.name], predicted["after", recording.name]
            used, sigma = ~masks(faults, recording), noise_model(recording).sigma
        found.append(answer.channel(recording, before, after, sigma, used, recording.name not in fitted))
    return tuple(found)


def _material(material: Material, model: Model) -> Material:
    return Material(model.law, material.bulk_modulus, dict(model.start), model.terms)
