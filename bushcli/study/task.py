"""Simulation of one design in any process, with the models and recordings of earlier ones."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from mpi4py import MPI

from bushcli.case import Case, Material, load_case
from bushcli.case.hardness import HARDNESS, scaled_to_hardness
from bushcli.errors import InputError
from bushcli.recording.table_cache import TableCache
from bushcli.simulate.bodies import PreparedModels
from bushcli.simulate.predict import fineness_of, predict
from bushcli.simulate.prediction_cache import PredictionCache
from bushcli.simulate.recording_cache import RecordingCache
from bushcli.simulate.response import Response
from bushcli.study.answers import Asked, NoAnswer, answer_columns, quantity_unit
from bushcli.study.variable import Value
from cases.mode import modes
from geometry.errors import GeometryError

Describe = Callable[[Response], Mapping[str, Any]]
Row = dict[str, Any]

#: Columns of every study besides keys and answers.
DESIGN, STATUS, KIND = "design", "status", "failure"
REASON, CONDITIONS, SECONDS = "reason", "conditions", "seconds"


@dataclass(frozen=True)
class StudyTask:
    """The calculation for each design; can be pickled.

    Attributes
    ----------
    case : Path
        The case file, which every process reads.
    overrides : tuple of str
        ``KEY=VALUE`` that hold for the whole study.
    keys : tuple of str
        The varied keys.
    answers : tuple of Asked
        The numbers to be calculated.
    curves : bool
        Whether the curves are saved.
    material : Material or None
        Law that was identified from the coupons; None where the case gives its parameters.
    hardness : float or None
        Nominal Shore A hardness, a number without a unit, where "hardness" is varied.
    describe : callable or None
        Response -> result as JSON-ready data, at module level; for answers that are keys of the result.
    fineness : mapping of str to float
        Fineness of the steps along recorded paths, by channel: determined once, so that each design is marched once.
    """

    case: Path
    overrides: tuple[str, ...]
    keys: tuple[str, ...]
    answers: tuple[Asked, ...]
    curves: bool = True
    material: Material | None = None
    hardness: float | None = None
    describe: Describe | None = None
    fineness: Mapping[str, float] = field(default_factory=dict)

    def load(self, values: Sequence[Value], tables: TableCache) -> tuple[Case, Material]:
        """Return the case of a design, and its material.

        Parameters
        ----------
        values : sequence
            In the order of the keys.
        tables : TableCache

        Raises
        ------
        InputError
            The case is not valid with these values.
        ValueError
            The hardness is outside the range of its relation.
        """
        by_key = dict(zip(self.keys, values, strict=True))
        shore_a = by_key.pop(HARDNESS, None)
        changed = [f"{key}={written(value)}" for key, value in by_key.items()]
        case = load_case(self.case, [*self.overrides, *changed], tables)
        material = self.material if case.needs_fit and self.material is not None else case.material
        if shore_a is not None and self.hardness is not None:
            material = scaled_to_hardness(material, self.hardness, float(shore_a))
        return replace(case, material=material), material


def with_fineness(cache: DesignCache, task: StudyTask, values: Sequence[Value]) -> StudyTask:
    """Return the task with steps along recorded paths that are fine enough at one design."""
    case, material = task.load(values, cache.tables)
    if not case.effects or not case.recordings:
        return task
    try:
        return replace(task, fineness=fineness_of(case, material, cache.measured))
    except (InputError, GeometryError, ValueError):
        return task  # the row of that design will state the error


def written(value: Value) -> str:
    """Return a value as text that ``--set`` reads back."""
    return value if isinstance(value, str) else json.dumps(value)


def evaluate(
    cache: DesignCache, task: StudyTask, first_number: int, rows: Sequence[tuple[Value, ...]]
) -> list[Row]:
    """Simulate designs one after the other; the row of a design that fails has the reason."""
    results = []
    for number, values in enumerate(rows, start=first_number):
        start_time = time.perf_counter()
        row = empty_row(task, number, values)
        try:
            row = _simulate(cache, task, row, values)
        except (InputError, GeometryError, ValueError) as error:
            row = failed_row(row, "input", str(error).splitlines()[0].removeprefix(f"{task.case}: "))
        except Exception as error:  # noqa: BLE001 - one design must not end the study
            row = failed_row(row, "error", f"{type(error).__name__}: {error}".splitlines()[0])
        results.append(row | {SECONDS: time.perf_counter() - start_time})
    return results


def empty_row(task: StudyTask, number: int, values: Sequence[Value]) -> Row:
    """Return the row of a design without results."""
    row: Row = {DESIGN: number, **dict(zip(task.keys, values, strict=True))}
    row |= {STATUS: "ok", KIND: "", REASON: "", CONDITIONS: "", SECONDS: 0.0}
    return row | dict.fromkeys((answer.name for answer in task.answers), None)


def failed_row(row: Row, kind: str, reason: str) -> Row:
    """Return the row of a design that has failed."""
    return row | {STATUS: "failed", KIND: kind, REASON: reason}


def _simulate(cache: DesignCache, task: StudyTask, row: Row, values: Sequence[Value]) -> Row:
    case, material = task.load(values, cache.tables)
    predictions = PredictionCache(cache.bodies, cache.measured, task.fineness)
    response = predict(case, material, comm=MPI.COMM_SELF, kept=predictions, pictures=False)
    if task.curves:
        row |= curves(response)
    row[CONDITIONS] = ",".join(dict.fromkeys(condition.name for condition in response.conditions))
    for channel in response.channels:
        if channel.stopped:
            unit = quantity_unit(channel.mode)
            factor = math.degrees(1.0) if unit == " deg" else 1.0
            reached, target = channel.reach * factor, channel.target * factor
            where = f"{channel.name}: no equilibrium beyond {reached:.4g} of {target:.4g}{unit}"
            return failed_row(row, "not_converged", f"{where} ({channel.stopped})")
    try:
        document = None if task.describe is None else task.describe(response)
        return row | answer_columns(task.answers, response, document)
    except NoAnswer as error:
        return failed_row(row, "no_answer", str(error))


def curves(response: Response) -> Row:
    """Return the curves as columns: displacement (mm, degrees) and force of every channel."""
    row: Row = {}
    for channel in response.channels:
        if channel.mode not in modes():
            continue
        factor = math.degrees(1.0) if modes()[channel.mode].rotational else 1.0
        row[f"{channel.name}.displacement"] = (factor * channel.curve.displacement).tolist()
        row[f"{channel.name}.force"] = channel.curve.force.tolist()
    return row


def curve_columns(case: Case) -> tuple[str, ...]:
    """Return the names of the columns of `curves`."""
    channels = [name for name, mode in case.channels if mode in modes()]
    return tuple(f"{name}.{what}" for name in channels for what in ("displacement", "force"))


@dataclass(frozen=True)
class DesignCache:
    """Finite-element models and recordings, from one design to the next; they serve one thread at a time."""

    bodies: PreparedModels = field(default_factory=PreparedModels)
    measured: RecordingCache = field(default_factory=RecordingCache)

    @property
    def tables(self) -> TableCache:
        """Cache of the binary files that the recordings are read from."""
        return self.measured.tables
