"""Identify a law's parameters from measured curves: start, search, uncertainty, verdict."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import starmap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.case.temperatures import unused_temperatures
from bushcli.case.typical import unusual_values
from bushcli.curve.earlier import not_from_rest
from bushcli.errors import InputError, Problem
from bushcli.faults import DataFault, condition, find_faults
from bushcli.inverse import certainty, starts
from bushcli.inverse.channel import Channel
from bushcli.inverse.contained import from_contained, removable_parts
from bushcli.inverse.estimates import (
    compared_curves,
    compared_tables,
    end_points,
    estimates,
    material,
)
from bushcli.inverse.file_units import values_in_file_units
from bushcli.inverse.journal import open_journal
from bushcli.inverse.local import Minimum
from bushcli.inverse.minimum_search import first_minimum, search
from bushcli.inverse.problem import LeastSquaresProblem, Progress
from bushcli.inverse.profile import profiles_of
from bushcli.inverse.result import Evaluation, Fit, Profile, Weighting
from bushcli.inverse.task import Task, refuse_fixed
from bushcli.inverse.verdict import conditions, history_not_saved, start_replaced
from bushcli.recording.table_cache import TableCache
from bushcli.runtime.condition import CONTINUE, Condition, history_damaged
from bushcli.runtime.executor import Pool
from bushcli.runtime.interrupt import unwrapped_interrupts
from bushcli.simulate.extent import outside_measured
from bushcli.simulate.play import check_play
from cases.mode import modes
from cases.stability import coupon_limits

if TYPE_CHECKING:
    from bushcli.inverse.dynamic_channel import DynamicChannel

Array = NDArray[np.float64]

# Largest number of times that a search is resumed from a lower misfit that a profile found.
BETTER_ROUNDS = 3


def fit_coupons(
    case: Case,
    model: str | None = None,
    *,
    weighting: Weighting = "relative",
    fixed: tuple[str, ...] = (),
    hold_out: tuple[str, ...] = (),
    progress: Progress | None = None,
    tables: TableCache | None = None,
) -> Fit:
    """Identify a law on all coupon tests of a case together.

    Parameters
    ----------
    case
        Its coupons are read; its material gives the law, the bulk modulus and, where present, the start values. Its
        effects are the bushing's, and act on load cases and recordings; those on the rubber whose `channels` name
        coupons, or that have nothing else to act on, are identified too.
    fixed
        Parameters that keep their start value.
    hold_out
        Coupons that are predicted instead of fitted.
    model
        Law to use instead of the case's.
    weighting
        "relative": the misfit in stress is divided by the stress itself, which suits the moderate strains of a bushing;
        "absolute": it is divided by the coupon's largest stress.
    progress
        Called after each evaluation.
    tables
        Cache of the binary files that the caller reads.

    Raises
    ------
    InputError
        The case has no coupons, one cannot be read, or the start cannot be solved.
    """
    warm = {test.label: test.temperature for test in case.coupons if test.temperature is not None}
    elsewhere = bool(case.channels or case.dynamic or case.vibrations)
    names = {source.label for source in case.coupons}
    effects = tuple(
        replace(effect, temperatures=warm if effect.effect.needs_temperature else {})
        for effect in case.effects
        if effect.effect.feature is not None
        and (not elsewhere if effect.channels is None else names & set(effect.channels))
    )
    case = replace(case, effects=effects)
    volumetric = [modes()[source.mode].needs_compressibility for source in case.coupons]
    task = Task(case, model or case.material.law, "coupons", fixed=fixed, hold_out=hold_out)
    task = replace(task, weighting=weighting, bulk_modulus=any(volumetric))
    if volumetric and all(volumetric):
        # They say nothing about the law, whose energy does not depend on the volume.
        task = replace(task, fixed=tuple(task.material.parameters))
    refuse_fixed([task])
    return identify(task, progress=progress, tables=tables)


def identify(
    task: Task,
    *,
    journal: Path | None = None,
    resume: bool | None = False,
    progress: Progress | None = None,
    pool: Pool | None = None,
    tables: TableCache | None = None,
    told: Callable[[DataFault], None] | None = None,
) -> Fit:
    """Identify a law's parameters from the recordings or the coupons of a case.

    Parameters
    ----------
    task
        Definition of the identification.
    journal, resume
        Folder in which every evaluation is saved; whether to continue from those that it holds (`journal.opened`).
    progress
        Called after each evaluation.
    pool
        Processes that share the starts, in place of the task's workers.
    tables
        Cache of the binary files that the caller reads.
    told
        Called with each fault of the data, before anything is fitted.

    Returns
    -------
    Fit
        If the search was interrupted (KeyboardInterrupt), the best so far, with a condition that says so.

    Raises
    ------
    InputError
        A file cannot be read, an option makes no sense, or the start cannot be solved at all.
    """
    started, tables = time.perf_counter(), TableCache() if tables is None else tables
    # The law is read first, so that a wrong name is reported before a mesh is built.
    start = (task.law, task.vectors())[1][0]
    saved = open_journal(journal, task.identity(), resume) if journal is not None else None
    problem, curves, dynamic = task.problem(journal=saved, progress=progress, tables=tables)
    place = None if saved is None else saved.folder
    run = _Searches(task, problem, curves, dynamic, start, place, resume, progress, pool, tables)
    run.check(told)
    interrupted = False
    try:
        with unwrapped_interrupts():
            run.search()
    except KeyboardInterrupt:
        interrupted = True
        if problem.best is None:
            raise
        cost, x = problem.best
        run.minima.append(Minimum(start, x, cost, 0, False, "interrupted"))
    return run.result(interrupted, started)


@dataclass
class _Searches:
    """An identification in progress."""

    task: Task
    problem: LeastSquaresProblem
    # All channels of the case, those held out too.
    curves: list[Channel]
    dynamic: list[DynamicChannel]
    start: Array
    journal: Path | None
    resume: bool | None
    progress: Progress | None
    pool: Pool | None
    tables: TableCache
    # Ends of the searches, the first start's first.
    minima: list[Minimum] = field(default_factory=list)
    # Where the search began if the given start could not be solved, shape (parameters,).
    instead: Array | None = None

    @cached_property
    def faults(self) -> tuple[DataFault, ...]:
        """Faults of the recordings, the fatal ones first."""
        recordings = [channel.recording for channel in self.curves]
        of_tables = [fault for channel in self.dynamic for fault in channel.faults]
        every = (*find_faults(self.task.case, recordings), *of_tables)
        return tuple(sorted(every, key=lambda fault: not fault.fatal))

    def check(self, told: Callable[[DataFault], None] | None) -> None:
        """Report the faults of the data; refuse what the recordings cannot tell, whatever their values.

        That is a play in the rig that takes up the whole travel, and the influence of a temperature that they share.
        """
        where = self.task.case.path.name
        for effect in self.task.effects:
            acting = [active for channel in self.problem.channels for active in channel.active]
            temperatures = {active.temperature for active in acting if active.name == effect.name}
            free = [p for p in effect.parameters if not self.task.is_fixed(effect.full_name(p))]
            if effect.effect.needs_temperature and free and len(temperatures) == 1:
                what = f"the effect {effect.name} cannot be identified: all that is fitted was measured at "
                what += f"{temperatures.pop():g} degrees C"
                expected = (
                    "recordings at another temperature; or give its parameters their values, and --fix "
                )
                raise InputError(Problem(where, what, "", expected + effect.name))
        for recording in (channel.recording for channel in self.curves):
            check_play(self.task.case, recording.name, recording.mode, recording.displacement)
        if told is not None:
            for fault in self.faults:
                told(fault)

    def _held_out_beyond_range(self) -> Iterator[Condition]:
        """Yield conditions for held-out channels that lie outside the range of the fitted ones."""
        case, every = self.task.case, (*self.curves, *self.dynamic)
        warm = {source.label: source.temperature for source in (*case.recordings, *case.coupons)}
        extents = {channel: channel.extent(warm.get(channel.name)) for channel in every}
        fitted = [extents.pop(channel) for channel in self.problem.channels]
        for channel, extent in extents.items():
            yield from outside_measured(channel.name, extent, fitted, channel.active)

    def values(self, x: Array) -> dict[str, float]:
        """Return the values (parameters,) by name, in the units of the case file."""
        inside = dict(zip(self.task.names, map(float, x), strict=True))
        return values_in_file_units(inside, self.task.rotational_parameters)

    def unsolvable_problem(self) -> Problem:
        """Return why nothing can be fitted; the likely cause is a fatal fault of the data, if there is one."""
        fatal = next((fault for fault in self.faults if fault.fatal), None)
        values = ", ".join(f"{name} = {value:g}" for name, value in self.values(self.start).items())
        what = f"the curves cannot be simulated with {self.task.model}, from {values} "
        what += "or from the law's own start values"
        remedy = "give other start values in [material.parameters]"
        if fatal is not None:
            what, remedy = f"{what}; {fatal.channel}: {fatal.where}", fatal.remedy
        return Problem(self.task.case.path.name, what, "", remedy)

    def search(self) -> None:
        """Search from all starts. Raises `InputError` where the start cannot be solved at all."""
        task, problem = self.task, self.problem
        fitted = [channel.recording for channel in self.curves if channel in problem.channels]
        searched = partial(from_contained, every=removable_parts(task, fitted))
        first = first_minimum(problem, self.start, task.loss, searched)
        if first is None:
            raise InputError(self.unsolvable_problem())
        self.minima.append(first.minimum)
        self.instead = first.instead
        states = {0: problem.states}
        points, limits = self._further_starts(first.initial), tuple(problem.limits)
        known = first.states, limits, first.minimum.cost, self.journal, self.resume
        assignments = [starts.Assignment(i, point, *known) for i, point in enumerate(points, 1)]

        def forward(evaluation: Evaluation) -> None:
            if self.progress is not None:
                self.progress(replace(evaluation, number=problem.sweeps + evaluation.number))

        def done(refined: starts.Refined) -> None:
            problem.count_evaluations(refined.evaluations, refined.forward_solves, refined.failed_solves)
            if refined.answers is not None:
                problem.learn(refined.minimum.x, refined.answers)
                states[len(self.minima)] = refined.states
                self.minima.append(refined.minimum)

        starts.refine_start(task, problem.channels, assignments, done, forward, self.pool)
        problem.begin_profiles(states[self._index_of_lowest()])

    def _further_starts(self, initial: Array) -> list[Array]:
        """Return further starts, found on a coarse mesh; none if only one start is requested."""
        task = self.task
        if task.starts <= 1 and not task.globally:
            return []
        shear = task.law.shear_modulus(**self.problem.law_parameters(initial))
        low, high = starts.box(initial, self.problem.bounds, abs(shear))
        points: list[Array] = []
        with starts.coarse_costs(task, self.tables, self.pool) as costs:
            if task.globally:
                points.append(starts.evolve_start(costs, low, high, task.seed))
            if task.starts > 1:
                points += starts.screen_starts(costs, task.starts - 1, low, high, task.seed)
        return points

    def _profile_best(self, best: Minimum, skipped: bool) -> tuple[Minimum, list[Profile], bool]:
        """Return the best point, which a profile may improve, the profiles, and whether they were interrupted."""
        profiles: dict[int, Profile] = {}
        cut = False
        if skipped or self.task.source != "recordings":
            return best, [], False
        try:
            with unwrapped_interrupts():
                for _ in range(BETTER_ROUNDS):
                    profiles.clear()
                    uncertainty = certainty.uncertainty(self.problem, best.x)
                    better = profiles_of(self.problem, best, uncertainty, profiles)
                    if better is None:
                        break
                    # The search had ended too early: from here the misfit falls further.
                    minimum = search(self.problem, better, self.task.loss)
                    best = replace(minimum, start=best.start, iterations=best.iterations + minimum.iterations)
        except KeyboardInterrupt:
            # The search is complete: its result is kept although intervals are missing.
            cut = True
        return best, [profiles[index] for index in sorted(profiles)], cut

    def result(self, interrupted: bool, started: float) -> Fit:
        """Return the best minimum as a fit, with its uncertainty."""
        task, problem = self.task, self.problem
        sweeps, forward_solves, failed_solves = problem.sweeps, problem.forward_solves, problem.failed_solves
        # The intervals of a law that is fitted to wrong data would mean nothing.
        fatal = any(fault.fatal for fault in self.faults)
        best, profiles, cut = self._profile_best(self.minima[self._index_of_lowest()], interrupted or fatal)
        rubber = material(task, problem, best.x)
        uncertainty = certainty.uncertainty(problem, best.x)
        parameters, correlation = estimates(task, problem, best.x, uncertainty, profiles)
        deviations = uncertainty.deviations
        tables, of_tables = compared_tables(problem, self.dynamic, best.x, self.start, deviations)
        singular, undetermined = certainty.directions(problem, best.x)
        fit = Fit(
            material=rubber,
            parameters=parameters,
            correlation=correlation,
            curves=compared_curves(problem, self.curves, best.x, self.start),
            stability=coupon_limits(task.law, rubber.parameters),
            weighting=task.weighting,
            forward_solves=forward_solves,
            sweeps=sweeps,
            failed_solves=failed_solves,
            profile_sweeps=problem.sweeps - sweeps,
            iterations=best.iterations,
            converged=best.converged and not interrupted,
            singular_values=singular,
            undetermined=undetermined,
            seconds=time.perf_counter() - started,
            conditions=(),
            message=best.message,
            cost=best.cost,
            evaluations=tuple(problem.evaluations),
            end_points=end_points(task, self.minima),
            profiles=tuple(profiles),
            leverage=certainty.leverage(problem, best.x),
            effects=tuple(effect.with_values(problem.parameters(best.x)) for effect in task.effects),
            faults=self.faults,
            tables=tables,
        )
        return replace(fit, conditions=tuple(self._conditions(fit, best, interrupted, cut, of_tables)))

    def _conditions(
        self, fit: Fit, best: Minimum, interrupted: bool, cut: bool, of_tables: tuple[Condition, ...]
    ) -> Iterator[Condition]:
        """Yield all conditions of the fit; those of its tables are given."""
        # Data faults come first: they explain more of a poor fit than any condition found after them.
        yield from map(condition, self.faults)
        if cut:
            what = "stopped after the search, while profiles were computed: intervals are missing"
            yield Condition("interrupted", what, CONTINUE)
        loaded = [(channel.name, channel.before) for channel in self.curves if channel.before is not None]
        doubts = [*conditions(fit, self.task, best, interrupted), *starmap(not_from_rest, loaded), *of_tables]
        doubts += self._held_out_beyond_range()
        # What a fit to wrong data looks like would only distract from the fault.
        fatal = any(fault.fatal for fault in self.faults)
        yield from (doubt for doubt in doubts if not fatal or doubt.name == "interrupted")
        journal = self.problem.journal
        if journal is not None and journal.failure:
            yield history_not_saved(journal.failure)
        if journal is not None and journal.damaged_entries:
            yield history_damaged(journal.damaged_entries)
        if self.instead is not None:
            yield start_replaced(self.values(self.instead), self.task)
        case, recordings = self.task.case, [channel.recording for channel in self.curves]
        yield from unusual_values(case, case.material, recordings)
        yield from unused_temperatures(case, recordings)

    def _index_of_lowest(self) -> int:
        """Return the index of the lowest minimum; of equal ones, the first."""
        return int(np.argmin([m.cost if np.isfinite(m.cost) else np.inf for m in self.minima]))
