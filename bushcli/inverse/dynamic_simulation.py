"""The stiffness of a table's rows from the matrices of vibration at its preloads.

For each set of the law's constants the preloads are marched once, and the matrices of vibration there are reduced
(`cases.dynamic`); the branches of the rubber then take no further solution.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bushcli.case import DynamicTest
from bushcli.case.case import DENSITY
from bushcli.effects.active import ActiveEffect
from bushcli.effects.rig import measured_stiffness
from bushcli.inverse.channel import StepLimit, isochoric_sample
from bushcli.inverse.problem import differences
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.runtime.interrupt import meet
from bushcli.simulate.vibrations import PROMISED, DynamicCurve, Vibrations, branches_of, thinned_of
from cases.dynamic.amplitude import UnevenModel
from cases.dynamic.model import Branches
from cases.equilibrium import Equilibrium
from cases.march import failure_at_start, march
from cases.model import FiniteElementModel
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
class ReducedCurves:
    """The curves of every preload, by group of preloads, a sample (n, 3) of the stretches there, and derivatives."""

    curves: list[list[DynamicCurve]]
    states: Array
    # Parameters of the model by which the curves have derivatives.
    names: tuple[str, ...]
    # Constants of the model at which they were computed.
    constants: Mapping[str, float]
    # Constants that differ: how far, in the coordinate in which ln K* is linear, and its derivative by the constant.
    steps: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def extrapolate(
        self, constants: Mapping[str, float], logarithmic: Collection[str]
    ) -> ReducedCurves | None:
        """Return the curves with other constants, to first order; None if these are too far.

        ln K* is linear in the logarithms of moduli and of the compliance to volume changes, because a common factor on
        all of these (its reciprocal for the compliance) is one on K*: they are the `logarithmic` ones. Of a power of
        the temperature it is linear in the power itself.
        """
        steps = {}
        for name, value in constants.items():
            before = self.constants[name]
            if value == before:
                continue
            if name not in self.names:
                return None
            steps[name] = value - before, 1.0
            if name in logarithmic and value * before > 0.0:
                steps[name] = before * math.log(value / before), before / value
        for model in (curve.model for group in self.curves for curve in group):
            stiffness = model.stiffness(np.zeros(1), ()).real
            slopes = model.slopes_by_parameters(np.zeros(1), ()).real
            factor = remainder = 0.0
            for i, (name, change) in enumerate(zip(model.changes.names, model.changes.matrices, strict=True)):
                step = steps.get(name, (0.0, 1.0))[0]
                # A factor on all moduli alone, as on those of the branches, is exact.
                relative_change = step * float(np.trace(change.viscous) / np.trace(model.reduced.viscous))
                factor += relative_change
                remainder += abs(step * float((slopes[i] / stiffness)[0]) - relative_change)
            if abs(factor) > math.log(FACTOR) or remainder > BESIDE:
                return None
        return replace(self, steps=steps)


Store = dict[tuple[tuple[str, float], ...], ReducedCurves]
"""Constants of a model -> the curves at its preloads."""


class DynamicSimulation:
    """Simulates the rows of a table with a model and effects, those of the rig included.

    The density of the rubber (t/mm^3) counts where it is no parameter, the temperature (degrees C) where an effect
    depends on it; `stored` is that of `bushcli.inverse.dynamic_channel.DynamicChannel`.
    """

    def __init__(
        self,
        table: DynamicTable,
        model: FiniteElementModel,
        active: tuple[ActiveEffect, ...],
        density: float,
        temperature: float | None,
        stored: Callable[[FiniteElementModel, bool], Store] | None,
    ) -> None:
        self.table, self.model, self.active = table, model, active
        self._density, self._temperature, self._near = density, temperature, stored is not None
        self.rig = tuple(effect for effect in active if effect.effect.acts == "rig")
        self._rubber = {effect.name for effect in active if effect not in self.rig}
        amplitudes = table.amplitude[~np.isnan(table.amplitude)]
        #: Whether amplitude thins the rubber of the simulation.
        self.uneven = thinned_of(active) is not None and len(amplitudes) > 0
        ends = (float(amplitudes.min()), float(amplitudes.max())) if self.uneven else ()
        self._preloads = _preloads(table, ends)
        self._known: Store = {} if stored is None else stored(model, self.uneven)

    def _relaxation(self, parameters: Mapping[str, float]) -> tuple[Branches, ThinnedSpectrum | None]:
        """Return the Maxwell branches, and the relaxation that amplitude thins."""
        active = [effect.with_values(parameters) for effect in self.active]
        return branches_of(active), thinned_of(active)

    def _branches(self, parameters: Mapping[str, float]) -> Branches:
        """Return all branches as they are at small amplitudes."""
        branches, thinned = self._relaxation(parameters)
        return [*branches, *(() if thinned is None else thinned.branches())]

    def reduced_curves(
        self, parameters: Mapping[str, float], names: Sequence[str], limit: StepLimit
    ) -> ReducedCurves:
        """Return the reduced models of the preloads, which are used again while they are accurate enough."""
        # Constants of the model, on which the preloads depend.
        constants = {k: v for k, v in parameters.items() if k in self.model.constants}
        if self._temperature is not None and "temperature" in self.model.constants:
            constants["temperature"] = self._temperature
        if self._near:
            # Another channel may ask for others.
            held = {effect.full_name(p) for effect in self.active for p in effect.parameters if p.of_mesh}
            moving = tuple(name for name in constants if name not in {"temperature", *held})
        else:
            moving = tuple(name for name in names if name in constants)
        key = tuple(constants.items())
        known = self._known.pop(key, None)
        if known is None and self._near:
            logarithmic = {*self.model.law.linear, "compliance"}
            shifted = (neighbour.extrapolate(constants, logarithmic) for neighbour in self._known.values())
            near = [curves for curves in shifted if curves and self.error(curves, parameters) <= PROMISED]
            if near:
                return min(near, key=lambda curves: sum(abs(step) for step, _ in curves.steps.values()))
        if known and not (set(moving) <= set(known.names) and self.error(known, parameters) <= PROMISED):
            known = None
        if known is None:
            self.model.set_parameters(constants)
            ends: list[Array] = []
            curves = [self._march(group.test, parameters, moving, limit, ends) for group in self._preloads]
            known = ReducedCurves(curves, isochoric_sample(self.model.comm, ends), moving, constants)
            if len(self._known) == CACHED:
                self._known.pop(next(iter(self._known)))
        self._known[key] = known
        return known

    def _march(
        self,
        test: DynamicTest,
        parameters: Mapping[str, float],
        names: Sequence[str],
        limit: StepLimit,
        ends: list[Array],
    ) -> list[DynamicCurve]:
        density = _density(parameters)
        branches, thinned = self._relaxation(parameters)
        if self._near:
            # Vectors for any relaxation that rows of these frequencies show.
            slow, fast = 0.5 / np.pi / self.table.frequency.min(), 0.5 / np.pi / self.table.frequency.max()
            branches = [*branches, (1.0, float(slow)), (1.0, float(fast))]
        density = self._density if density is None else density
        vibrations = Vibrations(self.table.name, test, self.model, branches, density, thinned, names)

        def observe(solver: Equilibrium) -> None:
            before = len(vibrations.curves)
            vibrations.observe(solver)
            if len(vibrations.curves) > before:
                ends.append(principal_stretches(self.model).reshape(-1, 3))

        def report(*_: float) -> None:
            meet(self.model.comm)

        followed = partial(march, self.model, drive=vibrations.drive, progress=report, observer=observe)
        for program in test.programs():
            limit.learn(followed(program, failure_limit=limit.steps))
        if len(vibrations.curves) < len(test.preload):
            raise failure_at_start("a preload is unstable")
        return [vibrations.curves[i][0] for i in range(len(test.preload))]

    def stiffness(
        self, reduced: ReducedCurves, parameters: Mapping[str, float], names: Sequence[str]
    ) -> tuple[Complex, Complex]:
        """Return K* (n,) as the rig measures it, and its derivatives (n, names)."""
        branches, density = self._branches(parameters), _density(parameters)
        rig = [active.with_values(parameters) for active in self.rig]
        value = np.empty(len(self.table), dtype=np.complex128)
        slope = np.zeros((len(self.table), len(names)), dtype=np.complex128)
        # Constants that have moved since the curves were computed change them, whether they are asked for or not.
        all_names = (*names, *(name for name in reduced.steps if name not in names))
        derivatives_by_parameter = self._by_parameter(parameters, all_names, len(branches))
        for group, curves in zip(self._preloads, reduced.curves, strict=True):
            for number, curve in enumerate(curves):
                rows = group.rows[group.number == number]
                frequency, model, uneven = self.table.frequency[rows], curve.model, curve.uneven
                force = np.zeros(len(all_names))
                indices = [i for i, name in enumerate(model.changes.names) if name in all_names]
                places = [all_names.index(model.changes.names[i]) for i in indices]
                force[places] = model.changes.force[indices]
                if uneven is not None:
                    part, by_constants, derivatives = self._thinned_stiffness(
                        curve, uneven, rows, parameters, all_names
                    )
                else:
                    part = model.stiffness(frequency, branches, density)
                    by_constants = np.zeros((len(rows), len(all_names)), dtype=np.complex128)
                    derivatives = np.zeros_like(by_constants)
                    if all_names:
                        by_constants[:, places] = model.slopes_by_parameters(frequency, branches, density)[
                            indices
                        ].T
                        by_g, by_tau, by_density = model.slopes(frequency, branches, density)
                        relaxing = np.vstack([by_g, by_tau, DENSITY * by_density])
                        derivatives = relaxing.T @ derivatives_by_parameter
                held = curve.force
                if reduced.steps:
                    # The branches are those of the new constants already.
                    step, rate = np.array([reduced.steps.get(name, (0.0, 1.0)) for name in all_names]).T
                    held += float(sum(force * step))
                    rescaling = np.exp((by_constants / part[:, None]) @ step)
                    part, by_constants = part * rescaling, by_constants * rescaling[:, None] * rate
                    derivatives = derivatives * rescaling[:, None]
                derivatives = derivatives + by_constants
                state = curve.preload, held, names, force[: len(names)]
                measured = measured_stiffness(rig, part, frequency, *state)
                value[rows] = measured.value
                slope[rows] = measured.slope + measured.by_part[:, None] * derivatives[:, : len(names)]
        return value, slope

    def _thinned_stiffness(
        self,
        curve: DynamicCurve,
        uneven: UnevenModel,
        rows: NDArray[np.intp],
        parameters: Mapping[str, float],
        names: Sequence[str],
    ) -> tuple[Complex, Complex, Complex]:
        """Return K* (m,) of rows of the bushing alone at their amplitudes, and its derivatives (m, names).

        Those of the matrices of vibration by the model's constants come first, those of the relaxation last.
        """

        def model(values: Mapping[str, float]) -> UnevenModel:
            branches, thinned = self._relaxation(values)
            assert thinned is not None
            return uneven.of(thinned, branches, _density(values))

        uneven_model, table = model(parameters), self.table
        # A row that does not say its amplitude is one of the smallest.
        amplitude = np.nan_to_num(table.amplitude[rows], nan=np.nanmin(table.amplitude))
        balances = uneven_model.balances(amplitude, table.frequency[rows])
        loads = uneven_model.loads(balances) if names else []
        value = np.array([balance.stiffness for balance in balances])
        by_constants = np.zeros((len(rows), len(names)), dtype=np.complex128)
        slope = np.zeros_like(by_constants)
        for i, name in enumerate(names):
            if name in curve.model.changes.names:
                change = curve.model.changes.matrices[curve.model.changes.names.index(name)]
                by_constants[:, i] = uneven_model.along(change, balances)
            if name == "density" or name.partition(".")[0] in self._rubber:
                step = THINNED_STEP * max(abs(parameters[name]), 1e-3)
                more, less = (model({**parameters, name: parameters[name] + d}) for d in (step, -step))
                if name == "density":
                    ends = zip(
                        *(m.balances(amplitude, table.frequency[rows]) for m in (more, less)), strict=True
                    )
                    slope[:, i] = [(a.stiffness - b.stiffness) / (2.0 * step) for a, b in ends]
                else:
                    slope[:, i] = uneven_model.slope(balances, loads, more, less) / (2.0 * step)
        return value, by_constants, slope

    def _by_parameter(self, parameters: Mapping[str, float], names: Sequence[str], branches: int) -> Array:
        """Return the derivatives (2 branches + 1, names) of all moduli, all times and the density by parameters."""
        free = [i for i, name in enumerate(names) if name.partition(".")[0] in self._rubber]

        def flat(values: Array) -> Array:
            changed = {**parameters, **{names[i]: float(v) for i, v in zip(free, values, strict=True)}}
            return np.array(self._branches(changed), dtype=float).T.ravel()

        derivatives = np.zeros((2 * branches + 1, len(names)))
        # The parameters are the moduli and times themselves: differences are exact.
        derivatives[:-1, free] = differences(flat, np.array([parameters[names[i]] for i in free]))
        derivatives[-1] = [name == "density" for name in names]
        return derivatives

    def travels(self, reduced: ReducedCurves) -> Array:
        """Return the preload (n,) of each row, mm or rad."""
        travels = np.empty(len(self.table))
        for group, curves in zip(self._preloads, reduced.curves, strict=True):
            travels[group.rows] = np.array([curve.preload for curve in curves])[group.number]
        return travels

    def error(self, reduced: ReducedCurves, parameters: Mapping[str, float]) -> float:
        """Return the largest relative error of the stiffness by the reduction."""
        frequencies, branches = np.unique(self.table.frequency), self._branches(parameters)
        models = [curve.model for curves in reduced.curves for curve in curves]
        return max(model.error(frequencies, branches, _density(parameters)) for model in models)


def _density(parameters: Mapping[str, float]) -> float | None:
    """Return the density of the rubber, t/mm^3, if it is a parameter, which is in kg/m^3."""
    return DENSITY * parameters["density"] if "density" in parameters else None


def _preloads(table: DynamicTable, amplitude: tuple[float, ...] = ()) -> list[_Preloads]:
    """Return the preloads of a table: those by travel, rest included, and those by force; for some amplitudes."""
    by_force = np.isnan(table.preload) & ~np.isnan(table.preload_force)
    groups = []
    for is_force in (False, True):
        rows = np.flatnonzero(by_force == is_force)
        if len(rows):
            # A row that states no preload is at rest.
            values = np.nan_to_num(table.levelled("preload_force" if is_force else "preload")[rows])
            levels, number = np.unique(values, return_inverse=True)
            frequency = np.unique(table.frequency[rows])
            frequency = frequency[[0, -1]] if amplitude else frequency
            asked = tuple(map(float, frequency)), tuple(map(float, levels))
            test = DynamicTest(table.mode, *asked, by_force=is_force, amplitude=amplitude)
            groups.append(_Preloads(rows, number.ravel(), test))
    return groups
