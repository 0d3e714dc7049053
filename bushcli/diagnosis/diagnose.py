"""Locate the mismatch, say what physics was left out, model it, and show the fit improve."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bushcli.casefile import Case, Material
from bushcli.condition import Condition
from bushcli.diagnosis import kept
from bushcli.diagnosis.before_after import before_and_after
from bushcli.diagnosis.doubts import doubts_of_the_data, doubts_of_the_model
from bushcli.diagnosis.hypotheses import hypotheses
from bushcli.diagnosis.where.record import locate
from bushcli.diagnosis.model import Fitted, Model, fit
from bushcli.diagnosis.naming import named, quantities
from bushcli.diagnosis.proposing import propose
from bushcli.diagnosis.result import (
    Diagnosis,
    LocalMap,
    NextTest,
    Stage,
    Verdict,
)
from bushcli.diagnosis.rivals import STRONG
from bushcli.diagnosis.selected import Selection, at_noise
from bushcli.diagnosis.selection import Progress, Search
from bushcli.diagnosis.workers import Workers
from bushcli.effect import effect_name
from bushcli.effect import effects as catalogue
from bushcli.errors import InputError, Problem, nearest
from bushcli.interrupt import is_interrupt
from bushcli.inverse.identify import fit_coupons
from bushcli.recording import read_recording
from cases.march import NotConverged
from forms.law import law, laws

Array = NDArray[np.float64]

# An effect that, at a typical size, would change the recordings by less than this many standard errors cannot be
# excluded by them.
SEEN = 3.0
# Effects that leave more than this share of the squared misfit beyond the noise do not explain it: they are the
# nearest that the catalogue has.
UNEXPLAINED = 0.1
# Evidence against an effect that is not worth more than a bare mention (Kass and Raftery 1995,
# doi:10.1080/01621459.1995.10476572), as a difference of BIC.
BARE = 2.0


def diagnose(
    case: Case,
    *,
    model: str | None = None,
    effects: Sequence[str] | None = None,
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
        Names of those to be thought of; all where None.
    workers
        Processes side by side; the answer does not depend on it.
    executor
        Of processes that are there already, such as the other ranks of `mpirun`, in place of `workers`.
    journal
        Folder in which every run is kept, so that a stopped diagnosis can go on.
    resume
        Go on with what the folder holds.
    maps
        Look for the place in the bushing, too.
    progress
        Called with the stage, what is looked at, and what came of it.

    Returns
    -------
    Diagnosis
        Also when it is interrupted after the model has been selected, with a condition that says so. Before that an
        interruption (KeyboardInterrupt) leaves what is in the journal.

    Raises
    ------
    InputError
        There are no recordings, one cannot be read, a name is unknown, or the plain law cannot be solved. Except in
        the last case nothing in the journal is touched.
    """
    begin = time.perf_counter()
    told = progress or (lambda *_: None)
    _check(case, model, effects)
    chosen, source, first = _plain(case, model)
    bare = replace(case, effects=())
    crew = Workers(workers, journal, resume, executor)
    _tell_what_is_kept(crew, resume, told)
    with crew.open():
        told("fit", chosen.law, "the plain law")
        plain = crew.run(_first, [(bare, chosen)])[0]
        if plain is None:
            tried = ", ".join(f"{k} = {v:g}" for k, v in chosen.start.items())
            raise InputError(
                Problem(case.path.name, f"{chosen.law} cannot be solved on these recordings from {tried}")
            )
        search = Search(bare, crew, effects, told)
        found = search.run(plain)
        before, after = (search.prediction(found, one) for one in (plain, found.best))
        channels = before_and_after(found)
        rivals = _rivals(found)
        proposal, made, trouble = _beyond(bare, found, rivals, crew, maps, told)
    location = locate(plain.judged)
    remaining = locate(found.best.judged)
    verdict = _verdict(found)
    return Diagnosis(
        case=case,
        verdict=verdict,
        asked=None if effects is None else tuple(effects),
        law_from=source,
        law_fixed=found.best.model.fixed,
        plain=_material(first, plain),
        material=_material(first, found.best),
        parameters=quantities(found.best, case.material),
        effects=named(found, case.material),
        hypotheses=hypotheses(found),
        path=tuple(_foretold(found, name, stage) for name, stage in found.stages),
        channels=channels,
        location=location,
        remaining=remaining,
        rivals=tuple(rivals),
        next_test=proposal,
        maps=made,
        conditions=(
            *trouble,
            *doubts_of_the_model(found, remaining, before, after),
            *doubts_of_the_data(case, channels),
        ),
        forward_solves=search.forward_solves,
        failed_solves=search.failed_solves,
        seconds=time.perf_counter() - begin,
    )


# -- the plain model ----------------------------------------------------------------------------------------------


def _check(case: Case, model: str | None, only: Sequence[str] | None) -> None:
    if not case.recordings:
        wanted = "[[recordings]] with mode and file"
        raise InputError(Problem(str(case.path), "there are no [[recordings]] to diagnose", "", wanted))
    for source in case.recordings:
        read_recording(source)
    if model is not None and model not in laws():
        raise InputError(
            Problem("--model", f'"{model}" is not a law', nearest(model, laws()), ", ".join(laws()))
        )
    wrong = [name for name in only or () if name not in catalogue()]
    if wrong:
        known = ", ".join(catalogue())
        raise InputError(
            *(
                Problem(
                    "--effects",
                    f'"{name}" is not an effect',
                    nearest(name, catalogue()),
                    known if name == wrong[-1] else "",
                )
                for name in wrong
            )
        )


def _tell_what_is_kept(crew: Workers, resume: bool, told: Progress) -> None:
    """Whether fits of an earlier run are used, thrown away, or missing."""
    if crew.folder is None or not (resume or crew.there):
        return
    fits = f"{crew.there} fit{'s' * (crew.there != 1)}"
    if not resume:
        told(
            "begin", crew.folder.name, f"{fits} of an earlier run thrown away: --resume would have kept them"
        )
    elif crew.there:
        told("resume", crew.folder.name, f"{fits} kept")
    else:
        told("resume", str(crew.folder), "no fits are kept there: from the beginning")


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
    start = {key_: chosen.parameter(key_).start for key_ in names} | dict(material.parameters)
    return Model(material.law, start, terms=material.terms), "recordings", material


def _first(case: Case, model: Model) -> Fitted | None:
    return fit(case, model, rescale=True)


def _material(material: Material, fitted: Fitted) -> Material:
    return Material(fitted.model.law, material.bulk_modulus, dict(fitted.model.start), fitted.model.terms)


# -- the answer ---------------------------------------------------------------------------------------------------


def _verdict(found: Selection) -> Verdict:
    best, reached = found.best, at_noise(found.best) is not None
    if best.model.effects:
        excess = [max(one.chi_square - one.samples, 0.0) for one in (best, found.plain)]
        explains = reached or excess[0] < UNEXPLAINED * excess[1]
        return "missing_physics" if explains else "unexplained"
    if best.model.law != found.plain.model.law:
        return "law_too_poor" if reached or best.size < 0.5 * found.plain.size else "unexplained"
    return "explained" if reached else "unexplained"


def _rivals(found: Selection) -> dict[tuple[str, ...], Fitted | None]:
    """Sets of effects that explain the recordings as well as the chosen one, which comes first, with their fits."""
    best = found.best.model
    own = {one.identity: one.name for one in best.effects}
    chosen = tuple(own.values())
    taken = set(map(effect_name, chosen))
    near: dict[tuple[str, ...], Fitted | None] = {chosen: found.best}
    limit = found.compared.bic() + STRONG
    others = sorted(found.refits.items(), key=lambda item: item[1].bic())
    for name, refit in others:
        there = {one.identity: one.name for one in refit.model.effects}
        # In another rig than the chosen one it is told with its rig.
        names = tuple(
            own.get(one, one if effect_name(one) in taken else short) for one, short in there.items()
        )
        # One that has the same effects and more is none; nor is one that differs in its law only.
        more = set(own) <= set(there) if chosen else not names
        if name and refit.bic() <= limit and not more:
            same = (refit.model.law, refit.model.fixed) == (best.law, best.fixed)
            near.setdefault(names if same and names else name, refit)
    if not chosen:
        # Nothing is missing that these recordings could show; what they could not show may still be there.
        for score in found.rounds[0].scores if found.rounds else ():
            unknowns = len(score.amplitude) + len(score.shape)
            price = unknowns * float(np.log(max(found.plain.samples, 2.0))) - score.drop
            if not score.testable or score.hidden > SEEN / 3.0 or price < BARE:
                near.setdefault((score.name,), None)
    return near


def _beyond(
    case: Case,
    found: Selection,
    rivals: Mapping[tuple[str, ...], Fitted | None],
    crew: Workers,
    maps: bool,
    told: Progress,
) -> tuple[NextTest | None, tuple[LocalMap, ...], tuple[Condition, ...]]:
    """The next test and the maps, which the verdict does not wait for: what stops them is a condition."""
    proposal: NextTest | None = None
    try:
        missing = "next test and map of the bushing"
        if len(rivals) > 1 and found.best.model.effects:
            told("next", "test", "what would separate the rivals")
            fitted = {names: one for names, one in rivals.items() if one is not None}
            proposal = propose(case, found, fitted, crew, told)
        missing = "map of the bushing"
        return proposal, _maps(case, found, told) if maps else (), ()
    except NotConverged as error:
        remedy = "nothing else depends on it; --no-maps leaves it out"
        return (
            proposal,
            (),
            (Condition("no_map", f"the map of the bushing cannot be solved: {error}", remedy),),
        )
    except BaseException as error:
        if not is_interrupt(error):
            raise
        crew.stop()
        message = f"stopped after the model was selected: {missing} not made"
        return proposal, (), (Condition("interrupted", message, "run it again with --resume"),)


def _maps(case: Case, found: Selection, told: Progress) -> tuple[LocalMap, ...]:
    from bushcli.diagnosis.local import local_map

    if case.geometry.specimen == "coupon" or at_noise(found.plain) is not None:
        return ()
    plain = found.plain
    # All recordings are of one bushing: together they tell a place that none of them tells alone.
    one = local_map(
        kept.channels(plain.model.task(case)),
        plain.model.start,
        plain.channels,
        plain.jacobians,
        lambda name: told("map", name, "where in the rubber a change would help"),
    )
    return (one,)


def _foretold(found: Selection, name: tuple[str, ...], stage: Stage) -> Stage:
    """The stage with the prediction of what was held out, where it was made later."""
    return replace(stage, held_out=found.predictions.get(name, stage.held_out))
