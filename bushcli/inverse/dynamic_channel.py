"""A channel whose data are a table of dynamic stiffness.

A row is compared in its magnitude and in its loss angle: with K* turned back by the measured loss angle, the real part
is the magnitude, and the imaginary part the magnitude times the deviation of the angle, to first order. Both are
proportional to the stiffness as a force is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from typing_extensions import override

from bushcli.case import Case
from bushcli.effects.active import ActiveEffect, effects_on_channel, in_state
from bushcli.effects.assembly import features_of
from bushcli.effects.names import readable_name
from bushcli.effects.rig import has_slope
from bushcli.errors import InputError, Problem
from bushcli.faults.dynamic import table_faults
from bushcli.inverse.channel import ChannelForces, FitChannel, StepLimit
from bushcli.inverse.dynamic_simulation import DynamicSimulation, Store
from bushcli.recording.dynamic.rows import ANGLE, MAGNITUDE, SPREAD
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.runtime.condition import Condition
from bushcli.simulate.dynamic import doubts, effects_left_out, effects_without_stiffness, is_in_vibrations
from bushcli.simulate.dynamic_tables import ComparedTable, check_preloads, left_out
from bushcli.simulate.extent import Extent, of_table
from cases.mode import modes
from cases.model import FiniteElementModel
from cases.simulate import Prepare, Rubber, prepare

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


class DynamicChannel(FitChannel):
    """A table of dynamic stiffness and its model; its displacements are the preloads (mm or rad) of the rows.

    Its rows (2 n,) are the magnitudes, and the deviations of the loss angle times magnitude, zero as they are measured;
    the scale is their standard errors. `stored` returns a store of reduced matrices, from which channels with other
    effects begin, too: they follow the law's constants to first order as far as that is exact enough, and effects
    without dynamic stiffness are left out. Without it, each set of constants has matrices of its own.
    """

    def __init__(
        self,
        table: DynamicTable,
        rubber: Rubber,
        case: Case,
        comm: MPI.Comm,
        prepared: Prepare = prepare,
        temperature: float | None = None,
        stored: Callable[[FiniteElementModel, bool], Store] | None = None,
    ) -> None:
        self.table, self._temperature = table, temperature
        check_preloads(case, table)
        acting = effects_on_channel(case.effects, table.name, table.mode, "dynamic", temperature)
        self.active = tuple(active.with_start_values() for active in acting)
        by_force = bool((np.isnan(table.preload) & ~np.isnan(table.preload_force)).any())
        if stored is not None:
            self.active = tuple(active for active in self.active if _vibrates(active, by_force))
        else:
            problems = effects_without_stiffness(case.path.name, table.name, self.active)
            problems += self._unfit_rig(case.path.name, by_force)
            if problems:
                raise InputError(*problems)
        features, mesh = features_of(in_state(self.active, unrelaxed=False)), case.mesh.refinement
        self.model = prepared(case.geometry, modes()[table.mode], rubber, mesh, comm, features)
        density = case.material.density
        self._simulation = DynamicSimulation(table, self.model, self.active, density, temperature, stored)
        # Rows of a recorded table that are faulty are left out by those who compare models.
        self.faults = () if stored is not None else table_faults(case.geometry, [table])
        self._turned = np.exp(-1j * table.loss_angle)
        self.measured = np.concatenate([table.stiffness, np.zeros(len(table))])
        errors, unknown = _errors(table)
        self.scale = np.where(np.tile(self._fitted_rows(), 2), errors, np.inf)
        if unknown:
            remark = f"{unknown} of {len(table)} rows have no standard errors (columns storage_error and loss_error); "
            remark += f"{100 * MAGNITUDE:g} % of the stiffness and {np.degrees(ANGLE):g} degrees are assumed"
            self.table = replace(table, remarks=(*table.remarks, remark))

    @property
    @override
    def name(self) -> str:
        # With its temperature where the table has several.
        warm = "" if self._temperature is None else f" at {self._temperature:.4g} degrees C"
        return self.table.name + warm

    @property
    def used_rows(self) -> NDArray[np.bool_]:
        """Which rows (n,) are fitted."""
        return np.isfinite(self.scale[: len(self.table)])

    @override
    def solve(
        self, parameters: Mapping[str, float], names: Sequence[str], limit: StepLimit | None = None
    ) -> ChannelForces:
        simulation = self._simulation
        reduced = simulation.reduced_curves(parameters, names, StepLimit() if limit is None else limit)
        value, slope = simulation.stiffness(reduced, parameters, names)
        delayed, derivatives = value * self._turned, slope * self._turned[:, None]
        force = np.concatenate([delayed.real, delayed.imag])
        by_name = np.concatenate([derivatives.real, derivatives.imag])
        return ChannelForces(np.tile(simulation.travels(reduced), 2), force, by_name, reduced.states)

    def at_samples(self, answer: ChannelForces) -> tuple[Array, Array]:
        """Return the rows (2 n,) and derivatives (2 n, parameters): those of the answer."""
        return answer.force, answer.slope

    @override
    def extent(self, temperature: float | None) -> Extent:
        return of_table(self.table)

    def compared_table(
        self, parameters: Mapping[str, float], names: Sequence[str] = (), deviations: Array | None = None
    ) -> ComparedTable:
        """Return the rows that are used beside their simulation. Raises `NotConverged`.

        Half widths of the parameters' intervals come as a matrix (p, p), whose product with its transpose is their
        covariance times the square of the quantile; without it the simulation has no intervals.
        """
        simulation, used = self._simulation, self.used_rows
        reduced = simulation.reduced_curves(parameters, names, StepLimit())
        simulated, slope = simulation.stiffness(reduced, parameters, names)
        table, preload = self.table.rows(used), simulation.travels(reduced)[used]
        errors = self.scale.reshape(2, -1)[:, used] / [np.ones(used.sum()), table.stiffness]
        rows = ComparedTable(table, simulated[used], preload, simulation.error(reduced, parameters), errors)
        if deviations is None:
            return rows
        # d ln K* = d ln |K*| + i d delta.
        relative = slope[used] / simulated[used, None] @ deviations
        spread = np.array([np.linalg.norm(relative.real, axis=1), np.linalg.norm(relative.imag, axis=1)])
        return replace(rows, spread=spread * [np.abs(simulated[used]), np.ones(used.sum())])

    def simulated_stiffness(self, answer: ChannelForces) -> Complex:
        """Return K* of the rows that are used from an answer, N/mm or N mm/rad."""
        along, across = answer.force.reshape(2, -1)[:, self.used_rows]
        return np.asarray((along + 1j * across) / self._turned[self.used_rows])

    def conditions(self, parameters: Mapping[str, float]) -> list[Condition]:
        """Return what has to be known about the table and its simulation. Raises `NotConverged`."""
        simulation = self._simulation
        reduced = simulation.reduced_curves(parameters, (), StepLimit())
        # Effects of the rig are in the simulation.
        rubber = [active for active in self.active if active not in simulation.rig]
        doubtful = [doubt for curves in reduced.curves for curve in curves for doubt in doubts(curve)]
        of_table = left_out(self.table, "fitted", simulation.uneven)
        return [*of_table, *effects_left_out(self.name, rubber), *doubtful]

    def _unfit_rig(self, where: str, by_force: bool) -> Iterator[Problem]:
        """Yield why effects of the rig cannot be fitted to the table."""
        for active in (effect for effect in self.active if effect.effect.acts == "rig"):
            stops = active.effect.rig is not None and active.effect.rig.parallel is not None
            if has_slope(active) and not (stops and by_force):
                continue
            what = f"{self.name}: with {readable_name(active.name)} the stiffness depends on the amplitude"
            expected = (
                f'give the effect "{active.name}" channels = [...] without {self.name}, or leave it out'
            )
            if has_slope(active):
                what = f"{self.name}: {readable_name(active.name)} carries an unknown share of a preload in N"
                expected = f"give the preload in mm, or {expected}"
            yield Problem(where, what, "", expected)

    def _fitted_rows(self) -> NDArray[np.bool_]:
        """Return which rows (n,) are fitted: of small amplitude, and not faulty."""
        table, used = self.table, np.ones(len(self.table), dtype=bool)
        for fault in self.faults:
            used &= ~(fault.samples & (not fault.fatal))
        has_amplitude = ~np.isnan(table.amplitude)
        if has_amplitude.any() and not self._simulation.uneven:
            used &= ~(has_amplitude & (table.amplitude > SPREAD * np.nanmin(table.amplitude)))
        if not used.any():
            where, what = (
                ", ".join(map(str, table.files)),
                f"{table.name}: none of its {len(table)} rows can be fitted",
            )
            raise InputError(Problem(where, what, "", "rows that belong to a curve over frequency"))
        return used


def _vibrates(active: ActiveEffect, by_force: bool) -> bool:
    """Whether an effect changes a dynamic stiffness in a way that is known, where a preload may be a force."""
    if active.effect.rig is not None:
        return has_slope(active) and not (active.effect.rig.parallel is not None and by_force)
    return active.effect.fades or is_in_vibrations(active)


def _errors(table: DynamicTable) -> tuple[Array, int]:
    """Return the standard errors (2 n,) of the rows, and the number of rows for which the table states none."""
    size, cosine, sine = table.stiffness, np.cos(table.loss_angle), np.sin(table.loss_angle)
    along = np.hypot(cosine * table.storage_error, sine * table.loss_error)
    across = np.hypot(sine * table.storage_error, cosine * table.loss_error)
    unknown = ~((along > 0.0) & (across > 0.0))
    along, across = np.where(unknown, MAGNITUDE * size, along), np.where(unknown, ANGLE * size, across)
    return np.concatenate([along, across]), int(np.count_nonzero(unknown))
