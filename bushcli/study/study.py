"""A whole study: simulates the designs of a case, saves their rows on disk, and returns a `Study`."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bushcli.case import Case, case_json
from bushcli.case.tolerance import toleranced_number
from bushcli.case.typical import unusual_values
from bushcli.errors import InputError, Problem, nearest
from bushcli.recording.table_cache import TableCache
from bushcli.runtime.condition import Condition, history_damaged
from bushcli.runtime.executor import Died, Pool
from bushcli.runtime.store import code_revision, history_of
from bushcli.simulate.recording_cache import RecordingCache
from bushcli.study.analysis import Band, Failure, Limits, Summary, band, columns, failures, summary
from bushcli.study.plan import Plan
from bushcli.study.rows import Rows, columns_of, is_defined
from bushcli.study.task import (
    CONDITIONS,
    SECONDS,
    DesignCache,
    Row,
    StudyTask,
    curve_columns,
    empty_row,
    evaluate,
    failed_row,
    with_fineness,
)
from bushcli.study.variable import Value

# Approximate duration of a batch of designs, s, and the largest number of designs in it.
BATCH_SECONDS, BATCH = 0.5, 64
# Number of first designs among which one has to be a valid case before anything is solved.
TRIED = 20
Notify = Callable[[int, int, int], None]
"""Called with the numbers of finished designs, of all designs, and of failed ones."""


@dataclass(frozen=True)
class Study:
    """The result of a study.

    Attributes
    ----------
    case : Case
        The case as in the case file, without the varied keys' values.
    summaries : mapping of str to Summary
        By answer; an answer that fewer than two designs have is left out.
    failures : tuple of Failure
        The most frequent reason first.
    bands : tuple of Band
        Bands of the channels whose curves can be compared.
    samples : mapping of str to sequence
        Columns of keys and answers of at most `SHOWN` designs that have all answers, for plots.
    failed, resumed : int
        Number of designs that failed, and of those that an earlier run had saved.
    seconds : float
        Time of all designs together, summed over the processes.
    """

    case: Case
    task: StudyTask
    plan: Plan
    summaries: Mapping[str, Summary]
    failures: tuple[Failure, ...]
    bands: tuple[Band, ...]
    samples: Mapping[str, Sequence[Value]]
    failed: int
    resumed: int
    seconds: float
    conditions: tuple[Condition, ...]


# Dots in a scatter plot.
SHOWN = 1000


def first_valid_design(cache: DesignCache, task: StudyTask, plan: Plan) -> tuple[Case, Sequence[Value]]:
    """Return the case of the first design that is valid, and its values; an error where none of the first ones is."""
    names = [*plan.keys, *(answer.name for answer in task.answers)]
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated:
        raise InputError(Problem(f"--answer {repeated}", "is the name of two columns", "", "NAME=ANSWER"))
    refusal: Exception | None = None
    for number, values in enumerate(plan.rows[:TRIED]):
        try:
            return task.load(values, cache.tables)[0], values
        except InputError as error:
            problems = (plan.problem_of_design(problem, number) for problem in error.problems)
            refusal = refusal or InputError(*problems)
        except ValueError as error:
            refusal = refusal or error
    if isinstance(refusal, InputError):
        raise refusal
    raise InputError(Problem("study", str(refusal)))


def _refuse_impossible_limits(cache: DesignCache, task: StudyTask, plan: Plan) -> None:
    """Refuse a tolerance at whose limits, with all other keys in the middle, there is no valid case."""
    middle = [variable.nominal for variable in plan.variables]
    for number, variable in enumerate(plan.variables):
        if toleranced_number(variable.spec) is None:
            continue
        for limit in (variable.low, variable.high):
            try:
                task.load([*middle[:number], limit, *middle[number + 1 :]], cache.tables)
            except (InputError, ValueError) as error:
                reason = error.problems[0].what if isinstance(error, InputError) else error
                what = f"has the limit {limit:g}, which is not possible: {reason}"
                at = (
                    variable.where if variable.where.startswith("--") else f"{variable.where}: {variable.key}"
                )
                expected = "a tolerance within which every bushing can be made"
                raise InputError(Problem(at, what, expected=expected)) from None


def study(
    case: Case,
    task: StudyTask,
    plan: Plan,
    pool: Pool,
    folder: Path,
    *,
    limits: Mapping[str, Limits] | None = None,
    resume: bool | None = False,
    notify: Notify | None = None,
    tables: TableCache | None = None,
) -> tuple[Study, Rows]:
    """Simulate all designs, and return their statistics, with the rows on disk.

    Parameters
    ----------
    case : Case
        The case without the varied keys' values.
    task, plan : StudyTask, Plan
        The calculation of each design, and the designs.
    pool : Pool
        The processes that run it.
    folder : Path
        Where each row is saved as soon as it is known.
    limits : mapping of str to Limits or None
        By answer, in its unit.
    resume : bool or None
        Continue with the rows of an earlier run of the same study; None: if there are any.
    notify : Notify or None
        Called whenever designs are finished.
    tables : TableCache, optional
        Cache of the binary files that the caller reads.

    Raises
    ------
    InputError
        The folder cannot be written or holds another study, limits are given for something that is not an answer, or
        the case is not valid at the limits of a tolerance.
    """
    limits = limits or {}
    names = [answer.name for answer in task.answers]
    for name in (name for name in limits if name not in names):
        what = "is not an answer of this study"
        raise InputError(Problem(f"--limits {name}", what, nearest(name, names), ", ".join(names)))
    cache = DesignCache(measured=RecordingCache(tables))
    first_case, values = first_valid_design(cache, task, plan)
    _refuse_impossible_limits(cache, task, plan)
    keys = {variable.key: variable.is_numeric for variable in plan.variables}
    kinds = columns_of(keys, names, curve_columns(first_case) if task.curves else ())
    defined = definition(task, plan, case)
    place, used = history_of(folder, lambda path: is_defined(path, defined), resume)
    rows = Rows(place, defined, kinds, len(plan.rows), used)
    resumed = len(rows.done)
    with closing(rows):
        if resumed < len(plan.rows):
            task = with_fineness(cache, task, values)
        _solve(cache, task, plan, pool, rows, notify)
    # How many designs have such numbers is known from their rows, which numbers from the first one.
    warnings = [
        replace(condition, message=f"the first design: {condition.message}")
        for condition in unusual_values(first_case, first_case.material)
    ]
    return _statistics(case, task, plan, rows, limits, resumed, warnings), rows


def _statistics(
    case: Case,
    task: StudyTask,
    plan: Plan,
    rows: Rows,
    limits: Mapping[str, Limits],
    resumed: int,
    warnings: Sequence[Condition],
) -> Study:
    """Return the statistics of the rows, with the conditions `warnings` of the first design."""
    names = [answer.name for answer in task.answers]
    table = columns(rows, plan.keys, names)
    summaries = {
        name: statistics
        for name in names
        if (statistics := summary(plan, table, name, limits.get(name), plan.seed)) is not None
    }
    reasons = failures(table)
    failed = sum(reason.count for reason in reasons)
    channels = [name for name, _ in case.channels if f"{name}.force" in rows.columns]
    bands = tuple(curves for name in channels if (curves := band(rows, name)) is not None)
    seconds, doubtful = 0.0, dict[str, int]()
    for block in rows.tables([SECONDS, CONDITIONS]):
        seconds += math.fsum(block[SECONDS].to_pylist())
        for name in filter(None, ",".join(block[CONDITIONS].to_pylist()).split(",")):
            doubtful[name] = doubtful.get(name, 0) + 1
    samples: dict[str, Sequence[Value]] = {}
    if names:
        complete = np.flatnonzero(np.all([np.isfinite(column) for column in table.answers.values()], axis=0))
        sample = complete[:: max(1, -(-len(complete) // SHOWN))]
        samples = {key: [column[i] for i in sample] for key, column in table.keys.items()}
        samples |= {name: [float(v) for v in column[sample]] for name, column in table.answers.items()}
    return Study(
        case=case,
        task=task,
        plan=plan,
        summaries=summaries,
        failures=reasons,
        bands=bands,
        samples=samples,
        failed=failed,
        resumed=resumed,
        seconds=seconds,
        conditions=(*_conditions(plan, failed, summaries, doubtful, rows.damaged), *warnings),
    )


def _solve(
    cache: DesignCache, task: StudyTask, plan: Plan, pool: Pool, rows: Rows, notify: Notify | None
) -> None:
    failed = 0
    spent, solved = 0.0, 0

    def questions() -> Iterator[tuple[Any, ...]]:
        """Yield batches of consecutive designs that have no row yet; the quicker a design, the larger the batch."""
        number, total = 0, len(plan.rows)
        while number < total:
            if number in rows.done:
                number += 1
                continue
            most = 1 if not solved else max(1, min(BATCH, int(BATCH_SECONDS / max(spent / solved, 1e-6))))
            # Smaller batches towards the end, so that no process works alone for long.
            most = max(1, min(most, (total - number) // (2 * pool.workers)))
            stop = number + 1
            while stop < min(total, number + most) and stop not in rows.done:
                stop += 1
            yield task, number, [plan.rows[i] for i in range(number, stop)]
            number = stop

    def take(batch: Sequence[Row]) -> None:
        nonlocal failed, spent, solved
        rows.add(batch)
        failed += sum(row["status"] != "ok" for row in batch)
        spent += sum(row[SECONDS] for row in batch)
        solved += len(batch)
        if notify is not None:
            notify(len(rows.done), len(plan.rows), failed)

    died: list[tuple[Any, ...]] = []
    for question, answer in pool.answers(evaluate, questions(), cache):
        if isinstance(answer, Died):
            died.append(question)
        else:
            take(answer)
    singles = ((task, number + i, [values]) for _, number, batch in died for i, values in enumerate(batch))
    for (_, number, batch), answer in pool.answers(evaluate, singles, cache):
        if isinstance(answer, Died):
            answer = [failed_row(empty_row(task, number, batch[0]), "died", str(answer))]
        take(answer)


def _conditions(
    plan: Plan, failed: int, summaries: Mapping[str, Summary], doubtful: Mapping[str, int], damaged: int
) -> tuple[Condition, ...]:
    conditions = [history_damaged(damaged)] if damaged else []
    if failed:
        some = failed < len(plan.rows)
        what = f"{failed} of {len(plan.rows)} designs have no result"
        what += "; the statistics are those of the others" if some else ""
        remedy = f"see the reasons{'; narrower ranges avoid such designs' if some else ''}"
        conditions.append(Condition("designs_failed", what, remedy))
    # Conditions other than those with which designs failed.
    for name, count in doubtful.items():
        if name != "not_converged":
            what = f'{count} of {len(plan.rows)} designs have the condition "{name}"'
            remedy = "see the column `conditions`; `bushcli direct --set ...` shows one of them in detail"
            conditions.append(Condition("designs_doubtful", what, remedy))
    uncertain = [
        key
        for summary in summaries.values()
        for key, influence in summary.influences.items()
        if influence.total_error > 0.1
    ]
    if uncertain:
        what = f"Sobol indices are known to no better than 0.1 for {', '.join(dict.fromkeys(uncertain))}"
        remedy = "ask for more --designs, twice as many for each halving of the variance"
        conditions.append(Condition("uncertain_indices", what, remedy))
    if not plan.of_probability and any(summary.limits for summary in summaries.values()):
        what = (
            f"shares within limits refer to the designs of this {plan.sampling}, not to parts in production"
        )
        remedy = "use --sampling lhs with distributions to estimate a yield"
        conditions.append(Condition("no_probability", what, remedy))
    return tuple(conditions)


def definition(task: StudyTask, plan: Plan, case: Case) -> dict[str, Any]:
    """Return what identifies a study, JSON-ready: rows of a study with another definition are not used."""
    # Of a list `vary` has the name of the file only.
    listed = {"list": hashlib.sha256(repr(plan.rows).encode()).hexdigest()} if plan.lines else {}
    return listed | {
        "case": case_json(case),
        "set": list(task.overrides),
        "vary": {variable.key: variable.spec for variable in plan.variables},
        "sampling": plan.sampling,
        "designs": len(plan.rows),
        "seed": plan.seed,
        "answers": {answer.name: [answer.channel, answer.kind, answer.travel] for answer in task.answers},
        "curves": task.curves,
        "hardness": task.hardness,
        "data": case.data_digest(),
        "program": code_revision(),
        "material": None if task.material is None else dict(task.material.parameters),
    }
