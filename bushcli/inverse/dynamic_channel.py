"""A channel whose data are a table of dynamic stiffness.

For each set of the law's constants the preloads are marched once, and the matrices of vibration there are reduced
(`cases.dynamic`); the branches of the rubber then take no further solution. A row is compared in its magnitude and in
its loss angle: with K* turned back by the measured loss angle, the real part is the magnitude, and the imaginary part
the magnitude times the deviation of the angle, to first order. Both are proportional to the stiffness as a force is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from typing_extensions import override

from bushcli.case import Case, DynamicTest
from bushcli.case.case import DENSITY
from bushcli.effects.active import ActiveEffect, acting, in_state
from bushcli.effects.assembly import features_of
from bushcli.effects.names import readable_name
from bushcli.effects.rig import has_slope, vibrating
from bushcli.errors import InputError, Problem
from bushcli.faults.dynamic import table_faults
from bushcli.inverse.channel import ChannelForces, FitChannel, StepLimit, isochoric_sample
from bushcli.inverse.problem import differences
from bushcli.recording.dynamic.rows import ANGLE, MAGNITUDE, SPREAD
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.runtime.condition import Condition
from bushcli.runtime.interrupt import meet
from bushcli.simulate.dynamic import doubts, effects_left_out, is_in_vibrations, unfit
from bushcli.simulate.dynamic_tables import ComparedTable, check_preloads, gathered, left_out
from bushcli.simulate.extent import Extent, of_table
from bushcli.simulate.vibrations import PROMISED, DynamicCurve, Vibrations, branches_of, thinned_of
from cases.dynamic.amplitude import UnevenModel
from cases.dynamic.model import Branches
from cases.equilibrium import Equilibrium
from cases.march import march, unsolved
from cases.mode import modes
from cases.model import FiniteElementModel
from cases.simulate import Prepare, Rubber, prepare
from cases.sine import ThinnedSpectrum
from cases.stretches import principal_stretches

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Relative step of differences by a constant of the relaxation that amplitude thins: its tables of harmonics are smooth
# (the derivatives are within 1 % of those of the whole balance: `tests/verification/test_thinned_channel.py`).
THINNED_STEP = 1e-3
# Sets of constants whose reduced matrices are cached: a point with its differences, and that to which a search returns.
CACHED = 32
# The stiffness follows the law's constants to first order while they change by no more than this factor on average, and
# the stiffness at rest, at each preload, by no more than this share beside it. ln K* is linear in that of all moduli,
# but for the bulk's (errors: `tests/verification/test_table_channel.py`).
FACTOR, BESIDE = 1.15, 0.05


@dataclass(frozen=True)
class _Preloads:
    """Preloads of rows that give them in the same way, as travels or as forces: rows (m,), the preload of each."""

    rows: NDArray[np.intp]
    number: NDArray[np.intp]
    test: DynamicTest


@dataclass(frozen=True)
class _Reached:
    """The curves of every preload, by group of preloads, a sample (n, 3) of the stretches there, and derivatives."""

    curves: list[list[DynamicCurve]]
    states: Array
    # Parameters of the model by which the curves have derivatives.
    names: tuple[str, ...]
    # Constants of the model at which they were computed.
    constants: Mapping[str, float]
    # Constants that differ: how far, in the coordinate in which ln K* is linear, and its derivative by the constant.
    steps: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def moved(self, constants: Mapping[str, float]) -> _Reached | None:
        """Return the curves with other constants, to first order; None if these are too far.

        ln K* is linear in the logarithms of the constants where a common factor on all of them is one on K*.
        """
        steps = {}
        for name, value in constants.items():
            before = self.constants[name]
            if value == before:
                continue
            if name not in self.names:
                return None
            scales = value * before > 0.0
            steps[name] = (
                (before * math.log(value / before), before / value) if scales else (value - before, 1.0)
            )
        for model in (one.model for group in self.curves for one in group):
            rest, by = model.stiffness(np.zeros(1), ()).real, model.slopes_by_parameters(np.zeros(1), ()).real
            factor = beside = 0.0
            for i, (name, change) in enumerate(zip(model.changes.names, model.changes.matrices, strict=True)):
                step = steps.get(name, (0.0, 1.0))[0]
                # A factor on all moduli alone, as on those of the branches, is exact.
                own = step * float(np.trace(change.viscous) / np.trace(model.reduced.viscous))
                factor, beside = factor + own, beside + abs(step * float((by[i] / rest)[0]) - own)
            if abs(factor) > math.log(FACTOR) or beside > BESIDE:
                return None
        return replace(self, steps=steps)


Store = dict[tuple[tuple[str, float], ...], _Reached]
"""Constants of a model -> the curves at its preloads."""


class DynamicChannel(FitChannel):
    """A table of dynamic stiffness and its model; its displacements are the preloads (mm or rad) of the rows.

    Parameters
    ----------
    table, rubber, case, comm, prepared
        As for `bushcli.inverse.channel.Channel`.
    temperature : float or None
        Of the rows, degrees C, where an effect depends on it.
    stored : callable or None
        Returns a store of reduced matrices, from which channels with other effects begin, too. They then follow the
        law's constants to first order as far as that is exact enough, and effects without dynamic stiffness are left
        out. None: the channel's own, exact for each set of constants.

    Attributes
    ----------
    table : DynamicTable
    measured : shape (2 n,)
        Magnitudes, and deviations of the loss angle times magnitude, which are zero.
    scale : shape (2 n,)
        Their standard errors; inf for rows that are not used.
    faults : tuple of DataFault
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
        self.table, self._temperature, self._near = table, temperature, stored is not None
        check_preloads(case, table)
        there = acting(case.effects, table.name, table.mode, "dynamic", temperature)
        self.active = tuple(active.started() for active in there)
        if self._near:
            by_force = bool((np.isnan(table.preload) & ~np.isnan(table.preload_force)).any())
            self.active = tuple(active for active in self.active if _vibrates(active, by_force))
        self._rig = tuple(active for active in self.active if active.effect.acts == "rig")
        self._rubber = {active.name for active in self.active if active not in self._rig}
        known = table.amplitude[~np.isnan(table.amplitude)]
        #: Whether amplitude thins the rubber of the simulation.
        self._uneven = thinned_of(self.active) is not None and len(known) > 0
        self._preloads = _preloads(table, (float(known.min()), float(known.max())) if self._uneven else ())
        problems = [] if self._near else unfit(case.path.name, table.name, self.active)
        problems += self._unfit_rig(case.path.name)
        if problems:
            raise InputError(*problems)
        features = features_of(in_state(self.active, unrelaxed=False))
        self.model = prepared(
            case.geometry, modes()[table.mode], rubber, case.mesh.refinement, comm, features
        )
        self._density = case.material.density
        # Rows of a recorded table that are faulty are left out by those who compare models.
        self.faults = () if self._near else table_faults(case.geometry, [table])
        used = self._used()
        self._turned = np.exp(-1j * table.loss_angle)
        self.measured = np.concatenate([table.stiffness, np.zeros(len(table))])
        errors, unknown = _errors(table)
        self.scale = np.where(np.tile(used, 2), errors, np.inf)
        if unknown:
            remark = f"{unknown} of {len(table)} rows have no standard errors (columns storage_error and loss_error); "
            remark += f"{100 * MAGNITUDE:g} % of the stiffness and {np.degrees(ANGLE):g} degrees are assumed"
            self.table = replace(table, remarks=(*table.remarks, remark))
        self._known: Store = {} if stored is None else stored(self.model, self._uneven)

    @property
    @override
    def name(self) -> str:
        # With its temperature where the table has several.
        warm = "" if self._temperature is None else f" at {self._temperature:.4g} degrees C"
        return self.table.name + warm

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which rows (n,) are fitted."""
        return np.isfinite(self.scale[: len(self.table)])

    @override
    def solve(
        self, parameters: Mapping[str, float], names: Sequence[str], limit: StepLimit | None = None
    ) -> ChannelForces:
        reached = self._reached(parameters, names, StepLimit() if limit is None else limit)
        value, slope = self._simulated(reached, parameters, names)
        turned, by = value * self._turned, slope * self._turned[:, None]
        return ChannelForces(
            np.tile(self._travels(reached), 2),
            np.concatenate([turned.real, turned.imag]),
            np.concatenate([by.real, by.imag]),
            reached.states,
        )

    def at_samples(self, answer: ChannelForces) -> tuple[Array, Array]:
        """Return the rows (2 n,) and derivatives (2 n, parameters): those of the answer."""
        return answer.force, answer.slope

    @override
    def extent(self, temperature: float | None) -> Extent:
        return of_table(self.table)

    def compared(
        self, parameters: Mapping[str, float], names: Sequence[str] = (), deviations: Array | None = None
    ) -> ComparedTable:
        """Return the rows that are used beside their simulation. Raises `NotConverged`.

        Half widths of the parameters' intervals come as a matrix (p, p), whose product with its transpose is their
        covariance times the square of the quantile; without it the simulation has no intervals.
        """
        reached, used = self._reached(parameters, names, StepLimit()), self.used
        simulated, slope = self._simulated(reached, parameters, names)
        rows = ComparedTable(
            self.table.rows(used),
            simulated[used],
            self._travels(reached)[used],
            self._error(reached, parameters),
            self.scale.reshape(2, -1)[:, used] / [np.ones(used.sum()), self.table.stiffness[used]],
        )
        if deviations is None:
            return rows
        # d ln K* = d ln |K*| + i d delta.
        relative = slope[used] / simulated[used, None] @ deviations
        spread = np.array([np.linalg.norm(relative.real, axis=1), np.linalg.norm(relative.imag, axis=1)])
        return replace(rows, spread=spread * [np.abs(simulated[used]), np.ones(used.sum())])

    def simulated(self, answer: ChannelForces) -> Complex:
        """Return K* of the rows that are used from an answer, N/mm or N mm/rad."""
        along, across = answer.force.reshape(2, -1)[:, self.used]
        return np.asarray((along + 1j * across) / self._turned[self.used])

    def conditions(self, parameters: Mapping[str, float]) -> list[Condition]:
        """Return what has to be known about the table and its simulation. Raises `NotConverged`."""
        reached = self._reached(parameters, (), StepLimit())
        # Effects of the rig are in the simulation.
        rubber = [active for active in self.active if active not in self._rig]
        doubtful = [doubt for curves in reached.curves for curve in curves for doubt in doubts(curve)]
        left = [
            condition
            for condition in left_out(self.table, "fitted")
            if not self._uneven or condition.name != "amplitude_left_out"
        ]
        return [*left, *effects_left_out(self.name, rubber), *doubtful]

    # -- evaluation ----------------------------------------------------------------------------------------------

    def _relaxation(self, parameters: Mapping[str, float]) -> tuple[Branches, ThinnedSpectrum | None]:
        """Return the Maxwell branches, and the relaxation that amplitude thins."""
        active = [effect.with_values(parameters) for effect in self.active]
        return branches_of(active), thinned_of(active)

    def _branches(self, parameters: Mapping[str, float]) -> Branches:
        """Return all branches as they are at small amplitudes."""
        branches, thinned = self._relaxation(parameters)
        return [*branches, *(() if thinned is None else thinned.branches())]

    def _reached(self, parameters: Mapping[str, float], names: Sequence[str], limit: StepLimit) -> _Reached:
        """Return the reduced models of the preloads, which are used again while they are accurate enough."""
        # Constants of the model, on which the preloads depend.
        own = {k: v for k, v in parameters.items() if k in self.model.constants}
        if self._temperature is not None and "temperature" in self.model.constants:
            own["temperature"] = self._temperature
        if self._near:
            # Another channel may ask for others.
            held = {one.full_name(p) for one in self.active for p in one.parameters if p.of_mesh}
            moving = tuple(name for name in own if name not in {"temperature", *held})
        else:
            moving = tuple(name for name in names if name in own)
        key = tuple(own.items())
        known = self._known.pop(key, None)
        if known is None and self._near:
            moved = (one.moved(own) for one in self._known.values())
            near = [one for one in moved if one is not None and self._error(one, parameters) <= PROMISED]
            if near:
                return min(near, key=lambda one: sum(abs(step) for step, _ in one.steps.values()))
        if (
            known is None
            or not set(moving) <= set(known.names)
            or not self._error(known, parameters) <= PROMISED
        ):
            self.model.set_parameters(own)
            ends: list[Array] = []
            curves = [self._marched(group.test, parameters, moving, limit, ends) for group in self._preloads]
            known = _Reached(curves, isochoric_sample(self.model.comm, ends), moving, own)
            if len(self._known) == CACHED:
                self._known.pop(next(iter(self._known)))
        self._known[key] = known
        return known

    def _marched(
        self,
        test: DynamicTest,
        parameters: Mapping[str, float],
        names: Sequence[str],
        limit: StepLimit,
        ends: list[Array],
    ) -> list[DynamicCurve]:
        density = _density(parameters)
        density = self._density if density is None else density
        branches, thinned = self._relaxation(parameters)
        if self._near:
            # Vectors for any relaxation that rows of these frequencies show.
            slow, fast = 0.5 / np.pi / self.table.frequency.min(), 0.5 / np.pi / self.table.frequency.max()
            branches = [*branches, (1.0, float(slow)), (1.0, float(fast))]
        made = Vibrations(self.name, test, self.model, branches, density, thinned, names)

        def observe(solver: Equilibrium) -> None:
            before = len(made.curves)
            made.observe(solver)
            if len(made.curves) > before:
                ends.append(principal_stretches(self.model).reshape(-1, 3))

        for program in made.programs():
            history = march(
                self.model,
                program,
                drive=made.drive,
                progress=lambda *_: meet(self.comm),
                observer=observe,
                patience=limit.steps,
            )
            limit.learn(history)
        if len(made.curves) < len(test.preload):
            raise unsolved("a preload is unstable")
        return [made.curves[i][0] for i in range(len(test.preload))]

    def _simulated(
        self, reached: _Reached, parameters: Mapping[str, float], names: Sequence[str]
    ) -> tuple[Complex, Complex]:
        """Return K* (n,) as the rig measures it, and its derivatives (n, names)."""
        branches, density = self._branches(parameters), _density(parameters)
        rig = [active.with_values(parameters) for active in self._rig]
        value = np.empty(len(self.table), dtype=np.complex128)
        slope = np.zeros((len(self.table), len(names)), dtype=np.complex128)
        # Constants that have moved since the curves were computed change them, whether they are asked for or not.
        wanted = (*names, *(name for name in reached.steps if name not in names))
        by = self._by_parameter(parameters, wanted, len(branches))
        for group, curves in zip(self._preloads, reached.curves, strict=True):
            for number, curve in enumerate(curves):
                rows = group.rows[group.number == number]
                frequency, model = self.table.frequency[rows], curve.model
                force = np.zeros(len(wanted))
                asked = [i for i, name in enumerate(model.changes.names) if name in wanted]
                places = [wanted.index(model.changes.names[i]) for i in asked]
                force[places] = model.changes.force[asked]
                if curve.uneven is not None:
                    part, own = self._thinned(curve, curve.uneven, rows, parameters, wanted)
                else:
                    part = model.stiffness(frequency, branches, density)
                    own = np.zeros((len(rows), len(wanted)), dtype=np.complex128)
                    if wanted:
                        by_constants = model.slopes_by_parameters(frequency, branches, density)
                        own[:, places] = by_constants[asked].T
                        by_g, by_tau, by_density = model.slopes(frequency, branches, density)
                        own += np.vstack([by_g, by_tau, DENSITY * by_density]).T @ by
                held = curve.force
                if reached.steps:
                    step, rate = np.array([reached.steps.get(name, (0.0, 1.0)) for name in wanted]).T
                    held += float(sum(force * step))
                    moved = np.exp((own / part[:, None]) @ step)
                    part, own = part * moved, own * moved[:, None] * rate
                found = vibrating(rig, part, frequency, curve.preload, held, names, force[: len(names)])
                value[rows] = found.value
                slope[rows] = found.slope + found.by_part[:, None] * own[:, : len(names)]
        return value, slope

    def _thinned(
        self,
        curve: DynamicCurve,
        uneven: UnevenModel,
        rows: NDArray[np.intp],
        parameters: Mapping[str, float],
        names: Sequence[str],
    ) -> tuple[Complex, Complex]:
        """Return K* (m,) of rows of the bushing alone at their amplitudes, and its derivatives (m, names)."""

        def model(given: Mapping[str, float]) -> UnevenModel:
            branches, thinned = self._relaxation(given)
            assert thinned is not None
            return uneven.of(thinned, branches, _density(given))

        here, table = model(parameters), self.table
        # A row that does not say its amplitude is one of the smallest.
        amplitude = np.nan_to_num(table.amplitude[rows], nan=np.nanmin(table.amplitude))
        balances = here.balances(amplitude, table.frequency[rows])
        value = np.array([balance.stiffness for balance in balances])
        slope = np.zeros((len(rows), len(names)), dtype=np.complex128)
        for i, name in enumerate(names):
            if name in curve.model.changes.names:
                change = curve.model.changes.matrices[curve.model.changes.names.index(name)]
                slope[:, i] = here.along(change, balances)
            elif name == "density" or name.partition(".")[0] in self._rubber:
                step = THINNED_STEP * max(abs(parameters[name]), 1e-3)
                more, less = (model({**parameters, name: parameters[name] + d}) for d in (step, -step))
                if name == "density":
                    ends = (shifted.balances(amplitude, table.frequency[rows]) for shifted in (more, less))
                    slope[:, i] = [
                        (a.stiffness - b.stiffness) / (2.0 * step) for a, b in zip(*ends, strict=True)
                    ]
                else:
                    slope[:, i] = here.slope(balances, more, less) / (2.0 * step)
        return value, slope

    def _by_parameter(self, parameters: Mapping[str, float], names: Sequence[str], branches: int) -> Array:
        """Return the derivatives (2 branches + 1, names) of all moduli, all times and the density by parameters."""
        free = [i for i, name in enumerate(names) if name.partition(".")[0] in self._rubber]

        def flat(values: Array) -> Array:
            given = {**parameters, **{names[i]: float(v) for i, v in zip(free, values, strict=True)}}
            return np.array(self._branches(given), dtype=float).T.ravel()

        by = np.zeros((2 * branches + 1, len(names)))
        # The parameters are the moduli and times themselves: differences are exact.
        by[:-1, free] = differences(flat, np.array([parameters[names[i]] for i in free]))
        by[-1] = [name == "density" for name in names]
        return by

    def _travels(self, reached: _Reached) -> Array:
        travels = np.empty(len(self.table))
        for group, curves in zip(self._preloads, reached.curves, strict=True):
            travels[group.rows] = np.array([curve.preload for curve in curves])[group.number]
        return travels

    def _error(self, reached: _Reached, parameters: Mapping[str, float]) -> float:
        frequencies, branches = np.unique(self.table.frequency), self._branches(parameters)
        models = [curve.model for curves in reached.curves for curve in curves]
        return max(model.error(frequencies, branches, _density(parameters)) for model in models)

    def _unfit_rig(self, where: str) -> Iterator[Problem]:
        """Yield why effects of the rig cannot be fitted to the table."""
        for active in self._rig:
            stops = active.effect.rig is not None and active.effect.rig.parallel is not None
            if has_slope(active) and not (stops and any(group.test.by_force for group in self._preloads)):
                continue
            what, remedy = (
                f"{self.name}: with {readable_name(active.name)} the stiffness depends on the amplitude",
                "",
            )
            if has_slope(active):
                what = f"{self.name}: {readable_name(active.name)} carries an unknown share of a preload in N"
                remedy = "give the preload in mm, or "
            expected = f'{remedy}give the effect "{active.name}" channels = [...] without {self.name}, or leave it out'
            yield Problem(where, what, "", expected)

    def _used(self) -> NDArray[np.bool_]:
        """Return which rows (n,) are fitted: of small amplitude, and not faulty."""
        table, used = self.table, np.ones(len(self.table), dtype=bool)
        for fault in self.faults:
            used &= ~(fault.samples & (not fault.fatal))
        known = ~np.isnan(table.amplitude)
        if known.any() and not self._uneven:
            used &= ~(known & (table.amplitude > SPREAD * np.nanmin(table.amplitude)))
        if not used.any():
            what = f"{table.name}: none of its {len(table)} rows can be fitted"
            raise InputError(
                Problem(
                    ", ".join(map(str, table.files)), what, "", "rows that belong to a curve over frequency"
                )
            )
        return used


def _vibrates(one: ActiveEffect, by_force: bool) -> bool:
    """Whether an effect changes a dynamic stiffness in a way that is known, where a preload may be a force."""
    if one.effect.rig is not None:
        return has_slope(one) and not (one.effect.rig.parallel is not None and by_force)
    return one.effect.fades or is_in_vibrations(one)


def _density(parameters: Mapping[str, float]) -> float | None:
    """Return the density of the rubber, t/mm^3, if it is a parameter, which is in kg/m^3."""
    return DENSITY * parameters["density"] if "density" in parameters else None


def _preloads(table: DynamicTable, amplitude: tuple[float, ...] = ()) -> list[_Preloads]:
    """Return the preloads of a table: those by travel, rest included, and those by force; for some amplitudes."""
    by_force = np.isnan(table.preload) & ~np.isnan(table.preload_force)
    given = np.where(np.isnan(table.preload), 0.0, table.preload)
    groups = []
    for is_force, values in ((False, given), (True, table.preload_force)):
        rows = np.flatnonzero(by_force == is_force)
        if len(rows):
            levels, number = np.unique(gathered(values[rows]), return_inverse=True)
            frequency = np.unique(table.frequency[rows])
            test = DynamicTest(
                table.mode,
                tuple(map(float, frequency[[0, -1]] if amplitude else frequency)),
                tuple(map(float, levels)),
                by_force=is_force,
                amplitude=amplitude,
            )
            groups.append(_Preloads(rows, number.ravel(), test))
    return groups


def _errors(table: DynamicTable) -> tuple[Array, int]:
    """Return the standard errors (2 n,) of the rows, and the number of rows for which the table states none."""
    size, cosine, sine = table.stiffness, np.cos(table.loss_angle), np.sin(table.loss_angle)
    along = np.hypot(cosine * table.storage_error, sine * table.loss_error)
    across = np.hypot(sine * table.storage_error, cosine * table.loss_error)
    unknown = ~((along > 0.0) & (across > 0.0))
    along, across = np.where(unknown, MAGNITUDE * size, along), np.where(unknown, ANGLE * size, across)
    return np.concatenate([along, across]), int(np.count_nonzero(unknown))
