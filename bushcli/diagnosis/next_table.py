"""Tables of dynamic stiffness that could be measured next, and what rivals predict of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.diagnosis.menu import REMOUNT, SET_UP
from bushcli.likelihood.features import BRANCHES
from bushcli.recording.dynamic.rows import RecordedTable
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.selection.columns import temperatures
from bushcli.selection.model import Model
from bushcli.selection.model_cache import ModelCache
from bushcli.selection.state import CommonData
from cases.march import NotConverged
from cases.mode import modes

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Minutes per sweep, and to bring a chamber to another temperature. Guesses: nothing but the order of costs depends on
# them.
_SWEEP, _CHAMBER = 2.0, 60.0
# Frequencies of a sweep; factor by which a range of frequencies is made wider on one side.
_POINTS, _WIDER = 10, 4.0
# Amplitudes over the smallest; preloads as shares of the rubber's thickness; kelvins above and below. What rigs reach.
_AMPLITUDES, _PRELOADS, _KELVINS = (1.0, 4.0, 16.0), (0.0, 0.1, 0.2), (-25.0, 0.0, 30.0)


@dataclass(frozen=True)
class TableProposal:
    """A candidate for the next table.

    Attributes
    ----------
    name : str
        For readers: "axial, to 800 Hz".
    table : DynamicTable
        Its conditions, with a stiffness of 1.
    cost : float
        Minutes.
    text : str
        The conditions in words, with units.
    """

    name: str
    table: DynamicTable
    cost: float
    text: str

    @property
    def channel(self) -> str:
        """Mode of the table."""
        return self.table.mode


@dataclass(frozen=True)
class ExpectedTable:
    """What a model predicts of a table: K* (n,), its change by each independent combination (n, p), K* of the law."""

    stiffness: Complex
    spread: Complex
    law: Complex


def table_menu(problem: CommonData) -> list[TableProposal]:
    """Return tables that differ in one condition from those that were measured, and one of each other mode."""
    measured = [recording for recording in problem.recordings if isinstance(recording, RecordedTable)]
    proposals = [proposal for recording in measured for proposal in _plans(problem.case, recording)]
    known, wall = {recording.mode for recording in problem.recordings}, problem.case.geometry.wall
    reference = measured[0].table if measured else None
    for mode in modes().values():
        if reference is None or wall is None or mode.proposed_travel is None or mode.name in known:
            continue
        frequency = np.geomspace(reference.frequency.min(), reference.frequency.max(), _POINTS)
        degrees = temperatures(problem.case, measured)[reference.name].mean()
        table = _table(mode.name, mode.name, frequency, (np.nan,), (0.0,), (float(degrees),))
        text = f"{mode.name}, {_range(frequency)}, small amplitude, at rest"
        proposals.append(TableProposal(f"{mode.name} too", table, SET_UP + REMOUNT + _SWEEP, text))
    return sorted(proposals, key=lambda proposal: proposal.cost)


def _plans(case: Case, recorded: RecordedTable) -> Iterator[TableProposal]:
    """Yield tables of one mode on its rig."""
    table, wall = recorded.table, case.geometry.wall
    rotational = modes()[table.mode].rotational
    unit, per = ("deg", float(np.degrees(1.0))) if rotational else ("mm", 1.0)
    low, high = float(table.frequency.min()), float(table.frequency.max())
    smallest = float(np.nanmin(table.amplitude)) if np.isfinite(table.amplitude).any() else np.nan
    warm = temperatures(case, [recorded])[table.name]
    at = float(warm.mean()) if np.isfinite(warm).all() else np.nan

    def sweep(start: float, stop: float) -> Array:
        return np.asarray(np.geomspace(start, stop, _POINTS), dtype=np.float64)

    usual = sweep(low, high)

    def proposal(
        title: str,
        frequency: Array = usual,
        amplitude: Sequence[float] = (smallest,),
        preload: Sequence[float] = (0.0,),
        degrees: Sequence[float] = (at,),
    ) -> TableProposal:
        proposed = _table(table.name, table.mode, frequency, amplitude, preload, degrees)
        sweeps = len(amplitude) * len(preload) * len(degrees)
        cost = SET_UP + _SWEEP * sweeps + _CHAMBER * (len(degrees) - 1)
        parts = [f"{table.mode}, {_range(frequency)}"]
        for values, name, factor, unit_of_values in (
            (amplitude, "amplitudes of", per, unit),
            (preload, "preloads of", per, unit),
            (degrees, "at", 1.0, "degrees C"),
        ):
            if len(values) > 1:
                parts.append(f"{name} {', '.join(f'{factor * v:.3g}' for v in values)} {unit_of_values}")
        return TableProposal(f"{table.mode}, {title}", proposed, cost, ", ".join(parts))

    yield proposal(f"to {_WIDER * high:.3g} Hz", sweep(high, _WIDER * high))
    yield proposal(f"from {low / _WIDER:.2g} Hz", sweep(low / _WIDER, low))
    if np.isfinite(smallest):
        yield proposal("at several amplitudes", usual[::3], [smallest * f for f in _AMPLITUDES])
    if wall is not None:
        arm = modes()[table.mode].per_shear(wall)
        yield proposal("about several preloads", usual[::3], preload=[arm * f for f in _PRELOADS])
    if np.isfinite(at):
        yield proposal("at several temperatures", degrees=[at + d for d in _KELVINS])


def _table(
    name: str,
    mode: str,
    frequency: Array,
    amplitude: Sequence[float],
    preload: Sequence[float],
    degrees: Sequence[float],
) -> DynamicTable:
    grid = np.meshgrid(degrees, preload, amplitude, frequency, indexing="ij")
    T, q, a, f = (axis.ravel() for axis in grid)
    none = np.full(len(f), np.nan)
    return DynamicTable(
        name, mode, "stiffness", f, np.ones(len(f)), np.zeros(len(f)), a, q, none, T, none, none, none
    )


def _range(frequency: Array) -> str:
    return f"{frequency.min():.3g} to {frequency.max():.3g} Hz"


def expected_table(
    cache: ModelCache, case: Case, model: Model, known: tuple[tuple[str, ...], Array], proposal: TableProposal
) -> ExpectedTable | None:
    """Return what a rival predicts of a table, `known` as for `expected_curve`; None if it cannot be solved."""
    names, root = known
    if proposal.table.name not in {table.label for table in case.dynamic}:
        # Another mode has a rig of its own, of which the recordings say nothing.
        model = replace(model, effects=tuple(active for active in model.effects if not active.effect.of_rig))
        indices = [i for i, name in enumerate(names) if name in model.values]
        names, root = tuple(names[i] for i in indices), root[indices]
    try:
        K, slope = cache.dynamic_stiffness(model.task(case), proposal.table, model.values, names)
        bare = replace(model, effects=())
        law, _ = cache.dynamic_stiffness(bare.task(case), proposal.table, bare.values, ())
    except NotConverged:
        return None
    return ExpectedTable(K, slope @ root, law)


def rows(expected: ExpectedTable, at: Complex, errors: tuple[float, float]) -> tuple[Array, Array, Array]:
    """Return samples, their spread, and the part of them that formulas of effects may have wrong, over the noise.

    All are relative to K* `at` (n,) of one rival; `errors` are the standard errors of ln |K*| and of the loss angle,
    rad.
    """

    def over(values: Complex) -> Array:
        relative = (values.T / at).T
        return np.concatenate([relative.real / errors[0], relative.imag / errors[1]])

    return over(expected.stiffness), over(expected.spread), BRANCHES * over(expected.stiffness - expected.law)


def noise_of(problem: CommonData) -> tuple[float, float]:
    """Return the standard errors of ln |K*| and of the loss angle (rad), the means of the tables."""
    tables = [recording for recording in problem.recordings if isinstance(recording, RecordedTable)]
    size, angle = np.mean([table.errors.mean(axis=1) for table in tables], axis=0)
    return float(size), float(angle)
