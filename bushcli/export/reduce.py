"""The force law with memory of each channel, identified from simulations of the bushing.

Three simulations give what `fmu.force_law` needs: the curve after a long rest S; the curve with branches that neither
relax nor slip, whose excess over S is H; a first loading with friction, whose excess over S is represented by sliders
on H that slip one after the other. The times tau_i are the rubber's. Rubber that amplitude thins has a clock for each
class of local strain, which the second simulation shows (`strain_classes`). Softening after the first loading needs
simulations to several displacements and back: the force lost in unloading depends on the largest displacement.
Permanent set and warming have the formulas of their effects; with permanent set, all these curves are over the
displacement from the position to which the rubber has set. A last simulation follows a program of ramps, reversals and
holds that the identification did not use, and gives the error of the force law.

References
----------
Iwan (1967), On a class of models for the yielding behavior of continuous and composite systems, J. Appl. Mech.
34:612-617, doi:10.1115/1.3607751: springs and sliders in parallel.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bushcli.case import Case
from bushcli.curve.misfit import peak_percent, rms_percent
from bushcli.effects.active import ActiveEffect, effects_on_channel, in_state
from bushcli.effects.effect import effect_in_force_law
from bushcli.effects.exported import ForceLawPart
from bushcli.errors import InputError, Problem
from bushcli.export.fmu.force_law import ChannelForceLaw
from bushcli.export.soften import softening
from cases.march import NotConverged
from cases.mode import modes

if TYPE_CHECKING:
    from bushcli.simulate.simulation import Answer, Simulation

Array = NDArray[np.float64]
Progress = Callable[[str, int, int, int, float], None]

#: Points of the curves on the longer side of rest.
POINTS = 20
#: Vibrations in the check of a force law with a clock: amplitudes over half the travel, frequencies (Hz), and samples
#: of a period, with which the stiffness along time is right to 0.1 % and 0.06 degrees (against twice as many).
SHARES, FREQUENCIES, SAMPLES = (0.01, 0.1, 1.0), (0.1, 10.0), 32
#: Number of sliders that together represent the friction.
SLIDERS = 10
#: Number of classes, of the same energy each: against a clock at each point six change the dynamic stiffness of a plain
#: bushing by at most 0.1 %.
CLASSES = 6


@dataclass(frozen=True)
class Sine:
    """A vibration in the check of a force law whose stiffness depends on the amplitude."""

    amplitude: float  # mm or rad
    frequency: float  # Hz
    # First harmonic of the force over that of the displacement in the last period, N/mm or N mm/rad.
    simulated: complex  # by finite elements along time
    predicted: complex  # of the force law

    @property
    def errors(self) -> tuple[float, float]:
        """Error of the dynamic stiffness in percent, and of the loss angle in degrees."""
        ratio = self.predicted / self.simulated
        return 100.0 * (abs(ratio) - 1.0), math.degrees(cmath.phase(ratio))


@dataclass(frozen=True)
class ReducedChannel:
    """The force law of one channel, and its check."""

    name: str
    mode: str
    data: Mapping[str, Any]  # of a `ChannelForceLaw`; N, mm, rad, s
    program: Array  # (n, 2), time (s) and displacement (mm or rad) of the check
    simulated: Array  # (n,), force of the bushing by finite elements along the program
    predicted: Array  # (n,), force of the force law
    sines: tuple[Sine, ...] = ()  # of a force law with a clock

    @property
    def rms_percent(self) -> float:
        """Root mean square error as a percentage of the range of the force."""
        return rms_percent(self.predicted - self.simulated, self.simulated)

    @property
    def peak_percent(self) -> float:
        """Largest error as a percentage of the range of the force."""
        return peak_percent(self.predicted - self.simulated, self.simulated)


def reduce(
    case: Case, channels: Sequence[tuple[str, str, float, float]], progress: Progress | None = None
) -> tuple[ReducedChannel, ...]:
    """Return the force law of each channel; refuse effects that it cannot express, and a range without equilibrium."""
    for active in case.effects:
        used = [p.name for p in active.parameters if p.along_path]
        if active.effect.acts == "rubber" and (used or active.effect.in_force_law is None):
            with_it = f" with {used[0]}" if used else ""
            what = f"a force law with memory cannot express the effect {active.effect.name}{with_it}"
            remedy = f"use --without {active.effect.name} for a force law without it"
            remedy += f", or leave {used[0]} out" if used else ""
            raise InputError(Problem("--to fmu", what, "", remedy))
    laws = []
    for name, mode, low, high in channels:
        try:
            laws.append(_Bushing(case, name, mode, progress).force_law(low, high))
        except NotConverged as failure:
            what = f"{name}: no equilibrium on the way to {max(abs(low), abs(high)):.4g} ({failure.reason})"
            remedy = "give a smaller amplitude in [[load_cases]]"
            raise InputError(Problem(case.path.name, what, "", remedy)) from None
    return tuple(laws)


class _Bushing:
    """One channel of a case, simulated with some of its effects."""

    def __init__(self, case: Case, name: str, mode: str, progress: Progress | None) -> None:
        self.case, self.name, self.mode, self.progress = case, name, mode, progress
        acting = effects_on_channel(case.effects, name, mode)
        active = [effect for effect in acting if effect.effect.acts != "rig" and not effect.is_off]
        #: Effects that are states of the force law, by state.
        others = (None, "curve")
        self.states = {e.effect.in_force_law: e for e in active if e.effect.in_force_law not in others}
        self.others = [effect for effect in active if effect.effect.in_force_law in others]

    def force(self, q: Array, time: Array | None, memory: Sequence[ActiveEffect] = ()) -> Array:
        """Return the force along a path."""
        return self._simulate(q, time, memory)[1].force

    def _simulate(
        self, q: Array, time: Array | None, memory: Sequence[ActiveEffect], keep_states: bool = False
    ) -> tuple[Simulation, Answer]:
        """Return the force of the bushing along a path, with some of its effects."""
        from bushcli.simulate.predict import rubber_of
        from bushcli.simulate.simulation import Simulation

        def report(step: int, steps: int, newton: int, q: float) -> None:
            if self.progress is not None:
                self.progress(self.name, step, steps, newton, q)

        rubber, fineness = rubber_of(self.case.material), self.case.mesh.refinement
        effects, mode = [*self.others, *memory], modes()[self.mode]
        simulation = Simulation(self.case.geometry, mode, rubber, fineness, effects, time, q, None)
        return simulation, simulation.solve({}, keep_states=keep_states, progress=report)

    def force_law(self, low: float, high: float) -> ReducedChannel:
        """Return the force law between two displacements."""
        from scipy.interpolate import CubicSpline

        permanent_set, set_cycles = (*self._values("set"), 0.0, 0.0)[:2]
        # Largest distances of the rubber from its set position, after the largest displacement to the other side; while
        # the set grows it is farther from there.
        remaining = 1.0 if set_cycles else 1.0 - permanent_set
        grid = _grid(low * remaining - permanent_set * high, high * remaining - permanent_set * low)
        static, _ = self._there_and_back(grid)
        data: dict[str, Any] = {"displacement": grid, "maxwell": [], "sliders": []}
        viscous, friction, mullins = (self.states.get(part) for part in ("maxwell", "sliders", "softening"))
        on_card = None if viscous is None else viscous.effect.on_card
        part = None if viscous is None or on_card is None else on_card(viscous.values)
        series = () if part is None else part.series
        warming = self._values("warming")
        elastic, clock = np.zeros_like(static), dict[str, Any]()
        if series or friction is not None or "clock" in self.states:
            # A branch that does not relax and has the law's initial shear modulus.
            branch = effect_in_force_law("maxwell")
            ones = {p.name: 1.0 for p in branch.parameters if not p.optional}
            saturated = in_state([ActiveEffect(branch, ones)], unrelaxed=True)
            unrelaxed, solutions = self._there_and_back(grid, saturated)
            elastic = unrelaxed - static
            clock = self._clock(grid, solutions)
        data["maxwell"] = [[g, tau] for g, tau in series]
        if friction is not None:
            data["sliders"] = self._sliders(friction, grid, static, elastic)
        data["softening"] = {} if mullins is None else softening(self.force, mullins, grid, static)
        for key, values in (("force", static), ("elastic", elastic)):
            data[key], data[f"{key}_slope"] = values, CubicSpline(grid, values)(grid, 1)
        data = {
            key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in data.items()
        }
        data |= {"clock": clock, "set": permanent_set, "set_cycles": set_cycles, "warming": warming}
        times = [tau for _, tau in (*series, *clock.get("maxwell", ()))] + warming[1:]
        program = _program(low, high, times, grows=mullins is not None or permanent_set > 0.0)
        simulated = self.force(program[:, 1], program[:, 0], list(self.states.values()))
        sines = self._sines(data, low, high, 10.0 * max(times)) if clock else ()
        return ReducedChannel(self.name, self.mode, data, program, simulated, follow(data, program), sines)

    def _sines(self, data: Mapping[str, Any], low: float, high: float, hold: float) -> tuple[Sine, ...]:
        """Return vibrations of rising amplitude about the middle, after a ramp and a rest (s) there."""
        middle, most = 0.5 * (low + high), 0.5 * (high - low)
        time = [np.linspace(0.0, 1.0, 11), 1.0 + hold * np.geomspace(1e-6, 1.0, 13)]
        path, last = [time[0] * middle, np.full(13, middle)], []
        # Of one and a half periods the last one is evaluated.
        turn = 2.0 * np.pi * np.arange(1, 3 * SAMPLES // 2 + 1) / SAMPLES
        kinds = [(most * share, frequency) for share in SHARES for frequency in FREQUENCIES]
        for amplitude, frequency in kinds:
            time.append(time[-1][-1] + turn / (2.0 * np.pi * frequency))
            path.append(middle + amplitude * np.sin(turn))
            last.append(slice(sum(map(len, path)) - SAMPLES, sum(map(len, path))))
        program = np.column_stack([np.concatenate(time), np.concatenate(path)])
        forces = self.force(program[:, 1], program[:, 0], list(self.states.values())), follow(data, program)
        wave = 2j / SAMPLES * np.exp(-1j * turn[-SAMPLES:])
        return tuple(
            Sine(*kind, *(complex(force[samples] @ wave) / kind[0] for force in forces))
            for kind, samples in zip(kinds, last, strict=True)
        )

    def _clock(self, grid: Array, solutions: Sequence[tuple[Simulation, Answer]]) -> dict[str, Any]:
        """Return the clock, its branches, and the classes of strain in elastic motions to each side; empty without."""
        from cases.stretches import metric_at, stretch_points

        thinned = self.states.get("clock")
        if thinned is None:
            return {}
        assert thinned.effect.feature is not None
        branches = thinned.effect.feature().branches
        assert branches is not None
        clock, *paced = branches(thinned.values)
        path, volume = [], np.empty(0)
        for simulation, answer in solutions:
            points = stretch_points(simulation.model)
            assert answer.history.states is not None
            C = [metric_at(points, x).reshape(-1, 3, 3) for x in answer.history.states]
            path.append((answer.history.displacement, np.array(C)))
            volume = points.weight.ravel()
        return {
            **{name: float(value) for name, value in clock.parameters.items()},
            "maxwell": [[float(effect.parameters[key]) for key in ("g", "tau")] for effect in paced],
            "classes": strain_classes(grid, path, volume),
        }

    def _values(self, part: ForceLawPart) -> list[float]:
        """Return the values of the effect that is a state of the force law; empty without it."""
        effect = self.states.get(part)
        return [] if effect is None else [float(effect.values[p.name]) for p in effect.parameters]

    def _there_and_back(
        self, grid: Array, memory: Sequence[ActiveEffect] = ()
    ) -> tuple[Array, list[tuple[Simulation, Answer]]]:
        """Return the force at the points of a grid, each side loaded from rest, and what was simulated."""
        force, solutions = np.zeros_like(grid), []
        for side in (grid >= 0.0, grid <= 0.0):
            q = grid[side] if grid[side][-1] > 0.0 else grid[side][::-1]
            if len(q) < 2:
                continue
            solutions.append(self._simulate(q, _second(len(q)), memory, keep_states=bool(memory)))
            reaction = solutions[-1][1].force
            force[side] = reaction if grid[side][-1] > 0.0 else reaction[::-1]
        return force, solutions

    def _sliders(
        self, friction: ActiveEffect, grid: Array, static: Array, elastic: Array
    ) -> list[list[float]]:
        """Return the sliders that reproduce the excess force of a first loading to the longer side."""
        from scipy.interpolate import CubicSpline
        from scipy.optimize import nnls

        sign = 1.0 if grid[-1] >= -grid[0] else -1.0
        end = max(grid[-1], -grid[0])
        # Points are dense where slip begins, sparse where all sliders slip.
        q = sign * end * np.linspace(0.0, 1.0, 2 * POINTS + 1) ** 2
        h = np.abs(CubicSpline(grid, elastic)(q))
        excess = np.abs(self.force(q, _second(len(q)), [friction]) - CubicSpline(grid, static)(q))
        limits = np.append(np.geomspace(h[-1] * 1e-3, h[-1], SLIDERS), 10.0 * h[-1])
        reach = np.minimum(h[:, None], limits[None, :])
        stiffness, _ = nnls(reach, excess)
        return [[float(k), float(k * limit)] for k, limit in zip(stiffness, limits, strict=True) if k > 0.0]


def strain_classes(grid: Array, path: Sequence[tuple[Array, Array]], volume: Array) -> list[dict[str, Any]]:
    """Return the classes, the data of `fmu.force_law.StrainClass`, with the strain at displacements (n,), mm or rad.

    The path has for each side displacements (m,) from rest and the right Cauchy-Green tensors (m, points, 3, 3) of the
    elastic body there; the volume (points,) is that of the rubber for which each point stands.

    The clock of a point of the rubber runs with its own strain (`forms.branches.payne`). In a motion along one
    direction the strain at each point is a function of the displacement, that of the elastic body: points of about the
    same strain share a clock, and their part of the force is their part of the energy of a branch that does not relax.
    That the strain gathers where the rubber is thinned is left out; the force is stationary in the displacement field,
    so that it changes little: the dynamic stiffness of a plain bushing, axial and radial, by 1 % and 0.4 degrees at
    most where the thinned branches are three times as stiff as the law, from 0.01 to 40 % of its wall and 0.01 to 100
    Hz.
    """
    from scipy.interpolate import CubicSpline

    sides, energy = [], np.zeros(len(volume))
    for q, C in path:
        isochoric = C / np.cbrt(np.linalg.det(C))[..., None, None]
        # |A, B|^2 = tr(A^-1 (B - A) B^-1 (B - A)) / 2, as in the law.
        change = np.diff(isochoric, axis=0)
        first, second = (np.linalg.solve(gradient, change) for gradient in (isochoric[:-1], isochoric[1:]))
        steps = np.sqrt(np.maximum(np.einsum("qpij,qpji->qp", first, second) / 2.0, 0.0))
        sides.append((q, np.vstack([np.zeros(len(volume)), np.sign(q[-1]) * np.cumsum(steps, axis=0)])))
        # That of a branch which has relaxed at rest, where the assembly may have strained the rubber.
        energy += volume * (np.trace(np.linalg.solve(isochoric[0], isochoric[-1]), axis1=-2, axis2=-1) - 3.0)
    order = np.argsort(sum(np.abs(strain[-1]) for _, strain in sides))
    share = np.cumsum(energy[order]) / energy.sum()
    classes = []
    parts = np.split(order, np.searchsorted(share, np.arange(1, CLASSES) / CLASSES))
    for points_of_class in filter(len, parts):
        energy_at = {
            float(x): float(y)
            for q, strain in sides
            for x, y in zip(q, strain[:, points_of_class] @ energy[points_of_class], strict=True)
        }
        x = np.array(sorted(energy_at))
        spline = CubicSpline(
            x, np.array([energy_at[position] for position in x]) / energy[points_of_class].sum()
        )
        data = {"strain": spline(grid).tolist(), "strain_slope": spline(grid, 1).tolist()}
        classes.append({"share": float(energy[points_of_class].sum() / energy.sum()), **data})
    return classes


def follow(data: Mapping[str, Any], program: Array) -> Array:
    """Return the force of a force law along a program (n, 2) of time and displacement, which begins at rest."""
    channel = ChannelForceLaw(dict(data))
    durations = np.diff(program[:, 0], prepend=program[0, 0])
    return np.array(
        [channel.advance(float(q), float(dt)) for q, dt in zip(program[:, 1], durations, strict=True)]
    )


def _grid(low: float, high: float) -> Array:
    """Return points from low to high through 0; each side is at least a quarter as long as the other."""
    end = max(high, -low)
    low, high = min(low, -0.25 * end), max(high, 0.25 * end)
    below, above = (max(2, math.ceil(POINTS * side / end)) for side in (-low, high))
    return np.concatenate([np.linspace(low, 0.0, below + 1)[:-1], np.linspace(0.0, high, above + 1)])


def _second(count: int) -> Array:
    """Return `count` times evenly distributed over one second."""
    return np.linspace(0.0, 1.0, count).astype(np.float64)


def _program(low: float, high: float, times: Sequence[float], grows: bool) -> Array:
    """Return time and displacement of a check: ramp, hold, reversals of two amplitudes, slow and ten times as fast.

    If it grows, it begins with half the amplitude, which conditions the rubber up to that amplitude only.
    """
    unit = float(np.exp(np.mean(np.log(times)))) if times else 1.0
    small = 0.3 * high + 0.7 * low, 0.7 * high + 0.3 * low
    corners = [(0.0, 0.0), (0.5, high), (1.5, high), (2.5, low), (3.5, high)]
    corners += [(3.6, small[0]), (3.7, small[1]), (3.8, small[0]), (5.0, small[0]), (5.1, 0.0), (6.0, 0.0)]
    if grows:
        small_first = [(0.0, 0.0), (0.5, 0.5 * high), (1.0, 0.5 * low)]
        corners = [*small_first, *((t + 1.5, q) for t, q in corners)]
    rows = [(0.0, 0.0)]
    for (t0, q0), (t1, q1) in pairwise(corners):
        # linspace ends at the corner itself: one that is missed by rounding would be a motion before a hold.
        rows += list(zip(np.linspace(t0, t1, 11)[1:], np.linspace(q0, q1, 11)[1:], strict=True))
    program = np.array(rows)
    return program * np.array([unit, 1.0])
