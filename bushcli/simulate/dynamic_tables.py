"""Measured tables of dynamic stiffness beside the simulated stiffness at their frequencies and preloads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.case import Case, DynamicTest, Material, checks
from bushcli.case.temperatures import ALIKE
from bushcli.case.tolerance import Tolerance
from bushcli.effects.active import ActiveEffect, effects_on_channel, in_state, require_values
from bushcli.effects.assembly import features_of
from bushcli.effects.rig import has_slope, measured_stiffness
from bushcli.errors import InputError, Problem
from bushcli.recording.dynamic.rows import SPREAD
from bushcli.recording.dynamic.table import DynamicTable, temperature_levels
from bushcli.runtime.condition import Condition
from bushcli.simulate.channels import with_all_beside
from bushcli.simulate.dynamic import vibrate
from bushcli.simulate.predict import rubber_of
from bushcli.simulate.response import Progress
from bushcli.simulate.vibrations import thinned_of
from cases.march import NotConverged, march
from cases.mode import modes
from cases.program import path
from cases.simulate import prepare

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_STEPS = 20


@dataclass(frozen=True, eq=False)
class ComparedTable:
    """A measured table with the simulated stiffness of its rows.

    Attributes
    ----------
    table : DynamicTable
        The rows whose preload was reached.
    simulated : shape (n,)
        K* as the rig measures it, N/mm or N mm/rad.
    preload : shape (n,)
        mm or rad, as it was simulated.
    reduction_error : float
        Bound of the relative error of the simulated stiffness by its reduction.
    errors : shape (2, n), optional
        Standard errors of the measured |K*| (N/mm or N mm/rad) and of the loss angle (rad), of a fit.
    started : shape (n,), optional
        K* where the fit began.
    spread : shape (2, n), optional
        Standard errors of the simulated |K*| and loss angle, from those of the parameters.
    held_out : bool
        Whether the table was predicted and not fitted.
    """

    table: DynamicTable
    simulated: Complex
    preload: Array
    reduction_error: float
    errors: Array | None = None
    started: Complex | None = None
    spread: Array | None = None
    held_out: bool = False

    @property
    def stiffness_percent(self) -> float:
        """Root mean square of the misfit of |K*|, relative to the measured one, in %."""
        return 100.0 * float(np.sqrt(np.mean((np.abs(self.simulated) / self.table.stiffness - 1.0) ** 2)))

    def within(self, tolerance: Tolerance) -> bool:
        """Whether the misfit of |K*| is within a tolerance."""
        return self.stiffness_percent <= tolerance.percent

    @property
    def loss_angle_deg(self) -> float:
        """Root mean square of the misfit of the loss angle, degrees."""
        return float(np.degrees(np.sqrt(np.mean((np.angle(self.simulated) - self.table.loss_angle) ** 2))))

    @property
    def over_errors(self) -> float:
        """Root mean square of the misfit over the standard errors of the rows; nan where there are none."""
        if self.errors is None:
            return float("nan")
        size = np.abs(self.simulated) - self.table.stiffness
        angle = np.angle(self.simulated) - self.table.loss_angle
        return float(np.sqrt(np.mean((np.array([size, angle]) / self.errors) ** 2)))

    @property
    def errors_in_words(self) -> str:
        """The root mean squares of the rows' standard errors: "1 % and 0.3 degrees"."""
        if self.errors is None:
            return ""
        relative = self.errors / [self.table.stiffness, np.ones(len(self.table))]
        size, angle = np.sqrt(np.mean(relative**2, axis=1))
        return f"{100.0 * size:.2g} % and {np.degrees(angle):.2g} degrees"


def compare_tables(
    case: Case,
    material: Material,
    tables: Sequence[DynamicTable],
    progress: Progress | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> tuple[tuple[ComparedTable, ...], tuple[Condition, ...]]:
    """Return the simulated stiffness of every row of tables, and what has to be known about it.

    Parameters
    ----------
    case : Case
    material : Material
    tables : sequence of DynamicTable
        Tables of the bushing.
    progress : Progress or None
        Called after each step of the static march.
    comm : MPI.Comm
        Ranks that share each model.

    Raises
    ------
    InputError
        A preload is beyond what the bushing's shape admits, the rubber has no viscous branch, or an effect has no
        dynamic stiffness.
    """
    compared: list[ComparedTable] = []
    conditions: list[Condition] = []
    parts = [(table.rows(rows), warm) for table in tables for rows, warm in by_temperature(case, table)]
    for table, temperature in parts:
        check_preloads(case, table)
        own = effects_on_channel(case.effects, table.name, table.mode, "dynamic", temperature)
        require_values(own, case.path.name)
        amplitudes = table.amplitude[~np.isnan(table.amplitude)]
        thinned = thinned_of(own) is not None and len(amplitudes) > 0
        conditions += left_out(table, "compared", thinned)
        # What the rig changes is applied to the stiffness of the part; what has none is said by `vibrate`.
        rig = tuple(active for active in own if active.effect.acts == "rig" and has_slope(active))
        others = tuple(replace(effect, channels=None) for effect in own if effect not in rig)
        part = replace(case, effects=others)
        preload, failed = _preloads(part, material, table, rig, comm)
        conditions += failed
        usable = ~np.isnan(preload)
        if not usable.any():
            continue
        rows = table.rows(usable)
        ends = (float(amplitudes.min()), float(amplitudes.max())) if thinned else ()
        frequencies = np.unique(rows.frequency)
        asked = tuple(frequencies[[0, -1]] if thinned else frequencies), tuple(np.unique(preload[usable]))
        test = DynamicTest(
            table.mode, *asked, amplitude=tuple(dict.fromkeys(ends)), steps=_STEPS, temperature=temperature
        )
        response = vibrate(replace(part, vibrations=(test,)), material, progress=progress, comm=comm)
        conditions += response.conditions
        # What a rig with these effects measures about the preloads that were reached.
        preload, simulated = preload[usable], np.full(len(rows), np.nan, dtype=np.complex128)
        for curve in response.curves:
            own = preload == curve.preload
            if not np.isnan(simulated[own]).any():
                continue
            frequency, amplitude = rows.frequency[own], rows.amplitude[own]
            if curve.uneven is None:
                part_k = curve.model.stiffness(frequency, curve.branches)
            else:
                # A row that does not say its amplitude is one of the smallest.
                amplitude = np.nan_to_num(amplitude, nan=curve.test.amplitude[0])
                part_k = curve.uneven.stiffness(amplitude, frequency)[0]
            simulated[own] = measured_stiffness(rig, part_k, frequency, curve.preload, curve.force).value
        usable = ~np.isnan(simulated)
        if usable.any():
            error = max(curve.reduction_error for curve in response.curves)
            compared.append(ComparedTable(rows.rows(usable), simulated[usable], preload[usable], error))
    return tuple(compared), tuple(conditions)


def by_temperature(case: Case, table: DynamicTable) -> list[tuple[NDArray[np.intp], float | None]]:
    """Return the rows of each temperature with their mean, degrees C, if an effect of the case depends on it.

    Parameters
    ----------
    case : Case
    table : DynamicTable

    Raises
    ------
    InputError
        A row has no temperature, nor has the case.
    """
    acting = effects_on_channel(case.effects, table.name, table.mode, "dynamic")
    heated = [active.name for active in acting if active.effect.needs_temperature]
    if not heated:
        return [(np.arange(len(table)), None)]
    degrees = np.where(np.isnan(table.temperature), case.temperature or np.nan, table.temperature)
    if np.isnan(degrees).any():
        row = int(np.argmax(np.isnan(degrees)))
        what = f"{table.name}: has no temperature, which the effect {heated[0]} needs"
        expected = "write temperature = 23.0 (degrees C) in its entry, or a column"
        raise InputError(Problem(table.places[row], what, "", expected))
    return [(rows, float(np.mean(degrees[rows]))) for rows in temperature_levels(degrees)]


def check_preloads(case: Case, table: DynamicTable) -> None:
    """Refuse a table with a preload that no bushing of this shape has, as a load case with it is refused.

    Parameters
    ----------
    case : Case
    table : DynamicTable
    """
    travel = np.abs(np.nan_to_num(table.preload))
    row = int(np.argmax(travel))
    finding = next(checks.travel(("preload",), table.mode, (float(travel[row]),), case.geometry), None)
    if travel[row] and finding is not None:
        remedy = f"{finding.expected}; units = {{preload = ...}} in the recording's table, if the file has another unit"
        raise InputError(Problem(table.places[row], finding.what, "", remedy))


def left_out(table: DynamicTable, use: Literal["compared", "fitted"], thinned: bool) -> Iterator[Condition]:
    """Yield what of a table a simulation lacks: its temperatures, and its amplitudes unless they thin the rubber.

    Parameters
    ----------
    table : DynamicTable
    use
        What is done with it: rows of larger amplitudes are compared, but not fitted.
    thinned
        Whether amplitude thins the rubber of the simulation.
    """
    amplitudes = table.amplitude[~np.isnan(table.amplitude)]
    if len(amplitudes) and amplitudes.max() > SPREAD * amplitudes.min() and not thinned:
        what = f"{table.name}: the amplitudes differ {amplitudes.max() / amplitudes.min():.3g}-fold, "
        what += "and the simulation is that of small ones"
        remedy = "compare the rows of the smallest amplitude"
        if use == "fitted":
            what += f": rows beyond {SPREAD:g} times the smallest are left out"
            remedy = "nothing to do"
        yield Condition("amplitude_left_out", what, f"{remedy}; filled rubber is softer at larger ones")
    degrees = table.temperature[~np.isnan(table.temperature)]
    if len(degrees) and np.ptp(degrees) > ALIKE:
        what = (
            f"{table.name}: the temperatures go from {degrees.min():.3g} to {degrees.max():.3g} degrees C, "
        )
        remedy = "compare the rows" if use == "compared" else "give a table"
        what += "and the rubber of the simulation has one"
        yield Condition("temperature_left_out", what, f"{remedy} of one temperature")


def _preloads(
    case: Case, material: Material, table: DynamicTable, rig: Sequence[ActiveEffect], comm: MPI.Comm
) -> tuple[Array, list[Condition]]:
    """Return the displacement (n,) of each row's preload, nan where a force is not reached; equal ones are one."""
    preload, conditions = table.levelled("preload"), []
    preload[np.isnan(table.preload) & np.isnan(table.preload_force)] = 0.0
    levels = np.where(np.isnan(preload), table.levelled("preload_force"), np.nan)
    mode, mesh = modes()[table.mode], case.mesh.refinement
    features = features_of(in_state(case.effects, unrelaxed=False))
    for force in np.unique(levels[~np.isnan(levels)]):
        travel = 0.0
        if force:
            try:
                # Where the force holds the bushing and what is beside it.
                model = prepare(case.geometry, mode, rubber_of(material), mesh, comm, features)
                history = march(model, path((0.0, float(force)), _STEPS), drive=with_all_beside(rig))
                travel = float(history.displacement[-1])
            except NotConverged as failure:
                unit, remedy = (
                    "N mm" if mode.rotational else "N",
                    "check the preload, the law and the dimensions",
                )
                what = f"{table.name}: the preload of {force:.4g} {unit} is not reached ({failure.reason})"
                conditions.append(Condition("not_compared", what, remedy))
                continue
        preload[levels == force] = travel
    return preload, conditions
