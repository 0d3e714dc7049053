"""A channel whose data are a table of dynamic stiffness.

For each set of the law's constants the preloads are marched once, and the matrices of vibration there are reduced
(`cases.dynamic`); the branches of the rubber then take no further solution. A row is compared in its magnitude and in
its loss angle: with K* turned back by the measured loss angle, the real part is the magnitude, and the imaginary part
the magnitude times the deviation of the angle, to first order. Both are proportional to the stiffness as a force is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from bushcli.case import Case, DynamicTest
from bushcli.effects.active import ActiveEffect, acting, in_state
from bushcli.effects.assembly import features_of
from bushcli.effects.names import readable_name
from bushcli.effects.rig import has_slope, vibrating
from bushcli.errors import InputError, Problem
from bushcli.faults.dynamic import table_faults
from bushcli.inverse.channel import ChannelForces, Patience, isochoric_sample
from bushcli.inverse.problem import differences
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.runtime.condition import Condition
from bushcli.runtime.interrupt import meet
from bushcli.simulate.dynamic import (
    PROMISED,
    DynamicCurve,
    Vibrations,
    branches_of,
    doubts,
    effects_left_out,
    unfit,
)
from bushcli.simulate.dynamic_tables import SPREAD, ComparedTable, check_preloads, gathered, left_out
from cases.dynamic.model import Branches
from cases.equilibrium import Equilibrium
from cases.load import PrescribedForce
from cases.march import march, unsolved
from cases.mode import modes
from cases.simulate import Prepare, Rubber, prepare
from cases.stretches import principal_stretches

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Standard errors of rows for which the table states none: usual for a servo-hydraulic rig (judgement).
MAGNITUDE, ANGLE = 0.01, np.radians(0.3)
# Step of the central differences by a constant of the law, relative. Against a tenth of it, slopes of a bushing 10 mm
# thick at rest and sheared by 0.3 change by 4e-8 (Ogden), 2e-9 (Yeoh) and 1e-6 (Gent) of the largest.
STEP = 1e-3
# Sets of constants whose reduced matrices are kept: a point with its differences, and that to which a search returns.
KEPT = 32


@dataclass(frozen=True)
class _Preloads:
    """The preloads of some rows that are alike travels or forces: rows (m,), and which preload each has."""

    rows: NDArray[np.intp]
    number: NDArray[np.intp]
    test: DynamicTest


@dataclass(frozen=True)
class _Reached:
    """The curves of every preload, by group of preloads, and a sample (n, 3) of the stretches there."""

    curves: list[list[DynamicCurve]]
    states: Array


class DynamicChannel:
    """A table of dynamic stiffness and its model; a `FitChannel`.

    Attributes
    ----------
    table : DynamicTable
    measured : shape (2 n,)
        Magnitudes, and deviations of the loss angle times magnitude, which are zero.
    scale : shape (2 n,)
        Their standard errors; inf for rows that are not used.
    comm : MPI.Comm
    faults : tuple of DataFault
    """

    coupon = False

    def __init__(
        self,
        table: DynamicTable,
        rubber: Rubber,
        case: Case,
        comm: MPI.Comm,
        prepared: Prepare = prepare,
    ) -> None:
        self.table, self.comm = table, comm
        check_preloads(case, table)
        self._active = tuple(one.started() for one in acting(case.effects, table.name, table.mode, "dynamic"))
        problems = unfit(case.path.name, table.name, self._active)
        for one in self._active:
            if one.effect.acts == "rig" and _changes_stiffness(one):
                what = (
                    f"{table.name}: {readable_name(one.name)} changes the stiffness that the rig measures, "
                )
                what += "which is not fitted to tables"
                expected = (
                    f'give the effect "{one.name}" channels = [...] without {table.name}, or leave it out; '
                )
                expected += "`bushcli direct` compares tables with it"
                problems.append(Problem(case.path.name, what, "", expected))
        if problems:
            raise InputError(*problems)
        features = features_of(in_state(self._active, unrelaxed=False))
        self.model = prepared(
            case.geometry, modes()[table.mode], rubber, case.mesh.refinement, comm, features
        )
        self._density = case.material.density
        self.faults = table_faults(case.geometry, [table])
        used = self._used()
        self._preloads = _preloads(table)
        self._turned = np.exp(-1j * table.loss_angle)
        self.measured = np.concatenate([table.stiffness, np.zeros(len(table))])
        errors, unknown = _errors(table)
        self.scale = np.where(np.tile(used, 2), errors, np.inf)
        if unknown:
            remark = f"{unknown} of {len(table)} rows have no standard errors (columns storage_error and loss_error); "
            remark += f"{100 * MAGNITUDE:g} % of the stiffness and {np.degrees(ANGLE):g} degrees are assumed"
            self.table = replace(table, remarks=(*table.remarks, remark))
        self._known: dict[tuple[float, ...], _Reached] = {}

    @property
    def name(self) -> str:
        """Name of the channel."""
        return self.table.name

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which rows (n,) are fitted."""
        return np.isfinite(self.scale[: len(self.table)])

    def solve(
        self, parameters: Mapping[str, float], names: Sequence[str], patience: Patience | None = None
    ) -> ChannelForces:
        """Return the rows, their preloads (mm or rad) in place of displacements, and derivatives by those named.

        Parameters
        ----------
        parameters, names, patience
            As for `Channel.solve`.

        Raises
        ------
        NotConverged
            A preload was not reached, or is unstable.
        """
        patience = Patience() if patience is None else patience
        own = {k: v for k, v in parameters.items() if k in self.model.constants}
        branches = self._branches(parameters)
        reached = self._reached(own, branches, patience)
        slope = np.zeros((len(self.measured), len(names)))
        free = [name for name in names if name not in own and name in parameters]
        if free:
            slope[:, [names.index(name) for name in free]] = self._by_branches(
                reached, parameters, free, branches
            )
        for name in own:
            if name in names:
                step = STEP * max(abs(own[name]), 1e-3)
                ends = [
                    self._rows(self._reached(own | {name: own[name] + d}, branches, patience), branches)
                    for d in (step, -step)
                ]
                slope[:, names.index(name)] = (ends[0] - ends[1]) / (2.0 * step)
        return ChannelForces(
            np.tile(self._travels(reached), 2), self._rows(reached, branches), slope, reached.states
        )

    def at_samples(self, answer: ChannelForces) -> tuple[Array, Array]:
        """Return the rows (2 n,) and derivatives (2 n, parameters): those of the answer."""
        return answer.force, answer.slope

    def reached(self, parameters: Mapping[str, float], patience: Patience) -> Array:
        """Return a sample of isochoric principal stretches of the rubber at the preloads, shape (n, 3).

        Parameters
        ----------
        parameters, patience
            As for `Channel.reached`.
        """
        states = self.solve(parameters, (), patience).states
        assert states is not None
        return states

    def compared(self, parameters: Mapping[str, float]) -> ComparedTable:
        """Return the rows that are used beside their simulation.

        Parameters
        ----------
        parameters : Mapping[str, float]
            All parameters by name, in their units.

        Raises
        ------
        NotConverged
        """
        own = {k: v for k, v in parameters.items() if k in self.model.constants}
        branches = self._branches(parameters)
        reached, used = self._reached(own, branches, Patience()), self.used
        error = self._error(reached, branches)
        stiffness = self._stiffness(reached, branches)
        return ComparedTable(self.table.rows(used), stiffness[used], self._travels(reached)[used], error)

    def conditions(self, parameters: Mapping[str, float]) -> list[Condition]:
        """Return what has to be known about the table and its simulation.

        Parameters
        ----------
        parameters : Mapping[str, float]
            All parameters by name, in their units.

        Raises
        ------
        NotConverged
        """
        own = {k: v for k, v in parameters.items() if k in self.model.constants}
        reached = self._reached(own, self._branches(parameters), Patience())
        # Effects of the rig that act on a table leave its stiffness as it is.
        rubber = [one for one in self._active if one.effect.acts != "rig"]
        doubtful = [one for curves in reached.curves for curve in curves for one in doubts(curve)]
        return [*left_out(self.table, "fitted"), *effects_left_out(self.name, rubber), *doubtful]

    # -- evaluation ----------------------------------------------------------------------------------------------

    def _branches(self, parameters: Mapping[str, float]) -> Branches:
        return branches_of([one.with_values(parameters) for one in self._active])

    def _reached(self, own: Mapping[str, float], branches: Branches, patience: Patience) -> _Reached:
        """Return the reduced models of the preloads; they serve other branches as long as they are as exact."""
        key = tuple(own.values())
        known = self._known.pop(key, None)
        if known is None or not self._error(known, branches) <= PROMISED:
            self.model.set_parameters(own)
            ends: list[Array] = []
            curves = [self._marched(one.test, branches, patience, ends) for one in self._preloads]
            known = _Reached(curves, isochoric_sample(self.model.comm, ends))
            if len(self._known) == KEPT:
                self._known.pop(next(iter(self._known)))
        self._known[key] = known
        return known

    def _marched(
        self, test: DynamicTest, branches: Branches, patience: Patience, ends: list[Array]
    ) -> list[DynamicCurve]:
        made = Vibrations(self.name, test, self.model, branches, self._density)

        def observe(solver: Equilibrium) -> None:
            before = len(made.curves)
            made.observe(solver)
            if len(made.curves) > before:
                ends.append(principal_stretches(self.model).reshape(-1, 3))

        for program in made.programs():
            history = march(
                self.model,
                program,
                drive=PrescribedForce() if test.by_force else None,
                progress=lambda *_: meet(self.comm),
                observer=observe,
                patience=patience.limit,
            )
            patience.learn(history)
        if len(made.curves) < len(test.preload):
            raise unsolved("a preload is unstable")
        return [made.curves[i] for i in range(len(test.preload))]

    def _by_branches(
        self, reached: _Reached, parameters: Mapping[str, float], free: Sequence[str], branches: Branches
    ) -> Array:
        """Return the derivatives (2 n, parameters) by parameters of the branches."""

        def flat(values: Array) -> Array:
            given = {**parameters, **dict(zip(free, map(float, values), strict=True))}
            return np.array(self._branches(given), dtype=float).ravel()

        # The parameters are the moduli and times themselves: differences are exact.
        by = differences(flat, np.array([parameters[name] for name in free])).reshape(len(branches), 2, -1)
        slope = np.zeros((len(self.table), len(free)), dtype=np.complex128)
        for group, curves in zip(self._preloads, reached.curves, strict=True):
            for number, curve in enumerate(curves):
                rows = group.rows[group.number == number]
                by_g, by_tau, _ = curve.model.slopes(self.table.frequency[rows], branches)
                slope[rows] = np.einsum("bf,bp->fp", by_g, by[:, 0]) + np.einsum(
                    "bf,bp->fp", by_tau, by[:, 1]
                )
        turned = slope * self._turned[:, None]
        return np.asarray(np.concatenate([turned.real, turned.imag]))

    def _rows(self, reached: _Reached, branches: Branches) -> Array:
        turned = self._stiffness(reached, branches) * self._turned
        return np.concatenate([turned.real, turned.imag])

    def _stiffness(self, reached: _Reached, branches: Branches) -> Complex:
        found = np.empty(len(self.table), dtype=np.complex128)
        for group, curves in zip(self._preloads, reached.curves, strict=True):
            for number, curve in enumerate(curves):
                rows = group.rows[group.number == number]
                found[rows] = curve.model.stiffness(self.table.frequency[rows], branches)
        return found

    def _travels(self, reached: _Reached) -> Array:
        found = np.empty(len(self.table))
        for group, curves in zip(self._preloads, reached.curves, strict=True):
            found[group.rows] = np.array([curve.preload for curve in curves])[group.number]
        return found

    def _error(self, reached: _Reached, branches: Branches) -> float:
        frequencies = np.unique(self.table.frequency)
        return max(one.model.error(frequencies, branches) for curves in reached.curves for one in curves)

    def _used(self) -> NDArray[np.bool_]:
        """Return which rows (n,) are fitted: of small amplitude, and not faulty."""
        table, used = self.table, np.ones(len(self.table), dtype=bool)
        for fault in self.faults:
            used &= ~(fault.samples & (not fault.fatal))
        known = ~np.isnan(table.amplitude)
        if known.any():
            used &= ~(known & (table.amplitude > SPREAD * np.nanmin(table.amplitude)))
        if not used.any():
            what = f"{table.name}: none of its {len(table)} rows can be fitted"
            raise InputError(
                Problem(
                    ", ".join(map(str, table.files)), what, "", "rows that belong to a curve over frequency"
                )
            )
        return used


def _changes_stiffness(one: ActiveEffect) -> bool:
    """Whether an effect of the rig changes the dynamic stiffness that is measured; offset and drift do not."""
    started = replace(one, values={p.name: p.start for p in one.parameters})
    part = np.array([1e3 + 1e2j])
    # Far from rest every stop is engaged.
    return not has_slope(started) or not np.allclose(
        vibrating((started,), part, np.ones(1), 1e3, 1e6), part, rtol=1e-12
    )


def _preloads(table: DynamicTable) -> list[_Preloads]:
    """Return the preloads of a table: those by travel, rest included, and those by force."""
    by_force = np.isnan(table.preload) & ~np.isnan(table.preload_force)
    given = np.where(np.isnan(table.preload), 0.0, table.preload)
    found = []
    for is_force, values in ((False, given), (True, table.preload_force)):
        rows = np.flatnonzero(by_force == is_force)
        if len(rows):
            levels, number = np.unique(gathered(values[rows]), return_inverse=True)
            frequency = tuple(map(float, np.unique(table.frequency[rows])))
            test = DynamicTest(table.mode, frequency, tuple(map(float, levels)), by_force=is_force)
            found.append(_Preloads(rows, number.ravel(), test))
    return found


def _errors(table: DynamicTable) -> tuple[Array, int]:
    """Return the standard errors (2 n,) of the rows, and the number of rows for which the table states none."""
    size, cosine, sine = table.stiffness, np.cos(table.loss_angle), np.sin(table.loss_angle)
    along = np.hypot(cosine * table.storage_error, sine * table.loss_error)
    across = np.hypot(sine * table.storage_error, cosine * table.loss_error)
    unknown = ~((along > 0.0) & (across > 0.0))
    along, across = np.where(unknown, MAGNITUDE * size, along), np.where(unknown, ANGLE * size, across)
    return np.concatenate([along, across]), int(np.count_nonzero(unknown))
