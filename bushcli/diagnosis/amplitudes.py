"""Double amplitudes that are read as peaks, and peaks that are read as double amplitudes.

A table whose amplitudes are all half as large is fitted as well by other constants of the relaxation that they thin, so
that one table alone does not show the error. A second recording of the same rubber does: all of them are fitted once as
they are read, and once with the amplitudes of one table, or of all, half or twice as large. It is an opinion, as are
all faults that no two statements of a file contradict.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from bushcli.case import Case
from bushcli.faults.fault import MENTIONED, WRONG, DataFault
from bushcli.recording.dynamic.rows import RecordedTable
from bushcli.runtime.workers import Workers
from bushcli.selection.fit import FittedSamples, fit
from bushcli.selection.neighbourhood import NEIGHBOURS
from bushcli.selection.queue import Search
from bushcli.selection.state import State

_FACTORS = {"peak": 0.5, "double": 2.0}


def amplitude_faults(search: Search, crew: Workers) -> tuple[DataFault, ...]:
    """Return tables whose amplitudes are probably others than were read, each with its probability.

    Only where rubber that amplitude thins is in the answer of the search, which has ended, and there is time left.
    """
    problem = search.problem
    thinned = [
        state
        for state in search.states.values()
        if any(active.effect.needs_amplitudes for active in state.model.effects)
        and max(search.weights(state)) > search.total + math.log(NEIGHBOURS)
    ]
    readings = list(_readings(problem.recordings))
    if not thinned or not readings or time.perf_counter() > search.deadline:
        return ()
    best = max(thinned, key=lambda state: search.weights(state)[0])
    measured = FittedSamples(problem.used, problem.likelihood.plain, problem.noises)
    search.progress("fit", "amplitudes", "peaks or double amplitudes")
    cases = [_read_otherwise(problem.case, reading) for reading in ((), *readings)]
    fits = crew.run(fit, [(case, best.model, measured) for case in cases])
    logs = [
        -math.inf if fitted is None else State(replace(problem, case=case), fitted).evidence.log
        for case, fitted in zip(cases, fits, strict=True)
    ]
    own = max(logs[0], best.evidence.log)
    odds = np.array([WRONG / (1.0 - WRONG) * math.exp(min(log - own, 20.0)) for log in logs[1:]])
    probability = odds / (1.0 + odds.sum())
    faults = []
    for table in {table.name: table for reading in readings for table in reading}.values():
        wrong = [any(other.name == table.name for other in reading) for reading in readings]
        total = float(probability[wrong].sum())
        if total >= MENTIONED:
            faults.append(_fault(table, total))
    return tuple(faults)


def _readings(recordings: Sequence[object]) -> Iterator[tuple[RecordedTable, ...]]:
    """Yield the tables that another reading of the amplitudes changes: each by itself, and all."""
    tables = [
        recording
        for recording in recordings
        if isinstance(recording, RecordedTable)
        and recording.table.amplitude_is
        and not np.isnan(recording.table.amplitude).all()
        and "amplitude" not in recording.accepted_faults
    ]
    if len(recordings) > 1:
        yield from ((table,) for table in tables)
    if 1 < len(tables) < len(recordings):
        yield tuple(tables)


def _read_otherwise(case: Case, reading: Sequence[RecordedTable]) -> Case:
    """Return the case with the other amplitudes of some tables."""
    factors = {recording.name: _FACTORS[recording.table.amplitude_is] for recording in reading}
    return replace(
        case,
        dynamic=tuple(
            replace(source, amplitude_factor=factors.get(source.label, 1.0)) for source in case.dynamic
        ),
    )


def _fault(recording: RecordedTable, probability: float) -> DataFault:
    """Return the fault of a table whose amplitudes are others than were read."""
    read, meant, other = "peaks", "double amplitudes (peak to peak)", "double"
    if recording.table.amplitude_is == "double":
        read, meant, other = "double amplitudes", "peaks (from the middle)", "peak"
    where = f"amplitudes that were read as {read}: with a probability of {probability:.3g} they are {meant}, "
    where += "with which the table suits the other recordings of this rubber"
    remedy = f'amplitude_is = "{other}" in the recording\'s table, and a column whose name does not say otherwise; '
    remedy += 'if they are as they were read, accept = ["amplitude"]'
    samples = np.zeros(len(recording.force), dtype=bool)
    return DataFault(recording.name, "amplitude", where, remedy, False, samples, probability)
