"""Stress and moduli at the points of a part of the body: the sum over law, volumetric part and branches.

One row per point, as `forms.point` describes it. A branch that depends on the law's energy e, V(e, ...), adds

    V_e W_a   and   V_e W_ab + V_ee W_a W_b + V_ae W_b + V_be W_a

to its own slopes and curvatures, W the law's energy alone. Where branches follow a clock z that depends on the strain
(`forms.branch`), the stresses are V_a at fixed z, and the moduli are V_ab + V_az z_b, whose symmetric part is
in the answer and whose skew part is kept as s_a = V_az and z_b (`RubberAtPoints.skew`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from cases.kernels import Call, Kernel, kernel
from cases.parameters import Numbers
from forms import answers
from forms.branch import Branch
from forms.branch_answers import GIVEN, branch_functions
from forms.law import Law
from forms.point import length
from forms.setting import KinematicDescription

Array = NDArray[np.float64]


# Number of directions along which a branch's rates are computed at once, and the least number for which that pays: they
# share work, so that five cost as much as three computed singly (measured, Maxwell and slider).
BATCH, WORTH_IT = 5, 3


class Remembered:
    """Branches of one formula at the points of the rubber, which are computed together.

    Parameters
    ----------
    setting, branch
        Kinematics and formula.
    span : slice
        Their places among all branches.
    points : int

    Attributes
    ----------
    values : shape (b, n, k)
        Memory of each branch at the beginning of the step; always the same array.
    parameters : shape (b, 1, m), or (b, n, m) on a clock
        As in `cases.parameters.Numbers.branches`; on a clock each point has its own duration. Always the same array.
    clock : {"", "shown", "followed"}
        As in `forms.branch.Branch`.
    """

    def __init__(self, setting: KinematicDescription, branch: Branch, span: slice, points: int) -> None:
        self._functions = branch_functions(setting, branch)
        self.needs_energy = self._functions.needs_energy
        self.clock, self._span = branch.clock, span
        count = span.stop - span.start
        self.values = np.empty((count, points, self._functions.memory))
        numbers = len(branch.parameters) + len(GIVEN)
        self.parameters = np.zeros((count, points if self.clock == "followed" else 1, numbers))
        # Kept apart: a rank without rubber has none on a clock.
        self._amplitudes = np.zeros(count)
        self.reset()

    def take(self, branches: Sequence[Array]) -> None:
        """Set the parameters, given those of all branches as in `cases.parameters.Numbers`."""
        own = self.among(branches)
        self._amplitudes[:] = own[:, 0, 0]
        # What has passed on the clock comes from the strains.
        columns = slice(-1 if self.clock == "followed" else None)
        self.parameters[..., columns] = own[..., columns]

    def among(self, branches: Sequence[Array]) -> Array:
        """Return these branches' part of `cases.parameters.Numbers.branches`, shape (b, 1, m)."""
        return np.array(branches[self._span])[:, None]

    def reset(self) -> None:
        """Forget all earlier deformation."""
        self.values[:] = self._functions.virgin

    @property
    def is_off(self) -> bool:
        """Whether all amplitudes are zero, so that the branches add nothing to stresses and moduli."""
        return not self._amplitudes.any()

    def answer(self, moduli: bool) -> Kernel:
        """Return the kernel of a branch's stresses, with or without moduli."""
        return kernel(self._functions.moduli if moduli else self._functions.stress)

    def by_duration(self, out: Array, inputs: Mapping[str, Array]) -> Call:
        """Return a call that adds the derivatives of all stresses by the step's duration to an array."""
        function = kernel(self._functions.stress_rate(1))
        last = np.zeros(self.parameters.shape[-1])
        last[-1] = 1.0
        nothing = np.zeros(self.values.shape[-1])
        no_change = {f"d0 {name}": nothing for name in inputs}
        return function.bind(out, {**inputs, **no_change, "d0 parameters": last})

    @property
    def end(self) -> Kernel:
        """Return [stored energy, memory at the end of the step]."""
        return kernel(self._functions.end)

    def rates(
        self, what: str, inputs: Mapping[str, Array], changes: Sequence[Mapping[str, Array]]
    ) -> list[Array]:
        """Return derivatives of the stresses, or of the memory at the end of the step, along changes of the inputs.

        Parameters
        ----------
        what : str
            "stress" (at fixed strains; the sum over the branches, shape (points, rows)) or "end" (shape (branches,
            points, rows)).
        inputs : Mapping[str, Array]
            Inputs of the kernel by name, shape (branches, points, width) where nothing is the same for all.
        changes : Sequence[Mapping[str, Array]]
            For each direction, changes of the inputs by their names, in the shape of the inputs; those left out do not
            change.
        """
        function = self._functions.stress_rate if what == "stress" else self._functions.end_rate
        shape = self.values.shape[1 if what == "stress" else 0 : 2]
        nothing = np.zeros(max(array.shape[-1] for array in inputs.values()))
        rates: list[Array] = []
        while len(rates) < len(changes):
            remaining = changes[len(rates) :]
            count = BATCH if len(remaining) >= WORTH_IT else 1
            point_inputs = dict(inputs)
            for d in range(count):
                change = remaining[d] if d < len(remaining) else {}
                point_inputs |= {f"d{d} {name}": change.get(name, nothing) for name in inputs}
            evaluate = kernel(function(count))
            rows = np.zeros((*shape, evaluate.size))
            evaluate.bind(rows, point_inputs)()
            by_direction = rows.reshape(*shape, count, evaluate.size // count)
            rates += [by_direction[..., d, :] for d in range(min(count, len(remaining)))]
        return rates

    def inputs(self, strain: Array, law: Array) -> dict[str, Array]:
        """Return the inputs of the kernels, given strains and the law's [W, ...].

        Parameters
        ----------
        strain : Array
            Strain variables and pressure, shape (points, variables).
        law : Array
            The law's [W, ...] at the points, shape (points, length).
        """
        return {"strain": strain, "law energy": law, "memory": self.values, "parameters": self.parameters}


@dataclass(frozen=True)
class PointState:
    """A state at which derivatives are computed: strains, and the law's [W, W_a] there."""

    strain: Array
    law: Array


@dataclass(frozen=True)
class _Answered:
    """Kernel calls that compute stresses, with or without moduli, in arrays of their own.

    Attributes
    ----------
    law, total : shape (points, length)
        Answer of the law, kept separate where a branch needs the law's energy, and sum of all answers.
    begin : Call
        The law's answer, into ``law``.
    adding : list of (Remembered, Call, Array)
        Branches by formula; the answer of those that depend on the law's energy has an array of its own.
    volumetric : Call
    pacing : list of Call
        With moduli and a clock: what adds s_a and z_a.
    """

    law: Array
    total: Array
    begin: Call
    adding: list[tuple[Remembered, Call, Array]]
    volumetric: Call
    pacing: list[Call]


class RubberAtPoints:
    """Rubber at some points: law, volumetric part and branches.

    Parameters
    ----------
    setting
        How the strain variables follow from gradients.
    law, names
        The law, and those of its parameters that are given.
    branches
        In the order of `cases.parameters.Numbers.branches`.
    points
        Number of points.
    guard : shape (points, 2)
        Which points have the further energies of volumes (`forms.answers.volumetric_answer`).

    Attributes
    ----------
    strain : shape (points, variables)
        Strain variables and pressure at which answers are computed; written by others.
    families : list of Remembered
        Branches of one formula that follow each other are a family.
    skew : shape (clocks, 2, points, 1 + variables), or None without a clock
        s_a and z_a of each clock at the last moduli, each after an entry for an energy, as an answer without moduli.
    """

    def __init__(
        self,
        setting: KinematicDescription,
        law: Law,
        names: tuple[str, ...],
        branches: Sequence[Branch],
        points: int,
        guard: Array,
    ) -> None:
        self._setting, self._law, self._names, self._points = setting, law, names, points
        self._guard = guard
        self.variables = len(setting.names) + 1
        self.strain = np.zeros((points, self.variables))
        self.families: list[Remembered] = []
        begin = 0
        for _, same in groupby(branches, id):
            branch, *others = same
            end = begin + 1 + len(others)
            self.families.append(Remembered(setting, branch, slice(begin, end), points))
            begin = end
        clocks = sum(branch.clock == "shown" for branch in self.families)
        self.skew = np.zeros((clocks, 2, points, 1 + self.variables)) if clocks else None
        self._parameters = {"law": np.zeros(len(names)), "volumetric": np.zeros(answers.VOLUMETRIC)}
        # Row and column of each curvature in an answer.
        self._upper = np.triu_indices(self.variables)

    def take(self, numbers: Numbers) -> None:
        """Set the material numbers."""
        self._parameters["law"][:] = numbers.law
        self._parameters["volumetric"][:] = numbers.volumetric
        for branch in self.families:
            branch.take(numbers.branches)

    def answer(self, moduli: bool) -> Array:
        """Return energy, stresses and moduli at `strain`, shape (points, length); the energy excludes the branches.

        The next call writes into the same array.
        """
        total = self.isochoric(moduli)
        self._calls(moduli).volumetric()
        return total

    def isochoric(self, moduli: bool) -> Array:
        """Return energy, stresses and moduli of law and branches; the next call overwrites the array."""
        calls = self._calls(moduli)
        calls.begin()
        if calls.law is not calls.total:
            calls.total[:] = calls.law
        self._wind()
        for branch, call_branch, row in calls.adding:
            if branch.is_off:
                continue
            call_branch()
            if branch.needs_energy:
                self._add_through_energy(calls.total, calls.law, row, moduli)
        if moduli and self.skew is not None:
            is_paced = not all(branch.is_off for branch in self.families if branch.clock == "followed")
            self.skew[:] = 0.0
            for call in calls.pacing if is_paced else ():
                call()
            a, b = self._upper
            for stress, pace in self.skew[..., 1:]:
                calls.total[:, 1 + self.variables :] += (
                    stress[:, a] * pace[:, b] + stress[:, b] * pace[:, a]
                ) / 2
        return calls.total

    def _wind(self) -> None:
        """Advance the clocks of the branches from the start of the step to `strain`."""
        if self.skew is None:
            return
        for branch, end, row in self._ends:
            if branch.clock == "shown":
                end()
                passed = row[..., 1]
            elif branch.clock == "followed":
                branch.parameters[..., -1] = passed

    def _calls(self, moduli: bool) -> _Answered:
        return self._with_moduli if moduli else self._without_moduli

    @cached_property
    def _with_moduli(self) -> _Answered:
        return self._bind(moduli=True)

    @cached_property
    def _without_moduli(self) -> _Answered:
        return self._bind(moduli=False)

    def _bind(self, moduli: bool) -> _Answered:
        law = total = np.zeros((self._points, length(self.variables, moduli)))
        if any(branch.needs_energy for branch in self.families):
            total = np.zeros_like(law)
        law_function = answers.law_answer(self._setting, self._law, self._names, moduli)
        law_call = kernel(law_function).bind(
            law, {"strain": self.strain, "parameters": self._parameters["law"]}, clear=True
        )
        adding: list[tuple[Remembered, Call, Array]] = []
        pacing: list[Call] = []
        clocks = iter(() if self.skew is None else self.skew)
        for branch in self.families:
            if branch.clock == "shown":
                stress, pace = next(clocks)
                if moduli:
                    pacing.append(branch.answer(moduli=False).bind(pace, branch.inputs(self.strain, law)))
                continue
            if moduli and branch.clock == "followed":
                pacing.append(branch.by_duration(stress[:, 1:], branch.inputs(self.strain, law)))
            function = branch.answer(moduli)
            row = np.zeros((self._points, function.size)) if branch.needs_energy else total
            inputs = branch.inputs(self.strain, law)
            adding.append((branch, function.bind(row, inputs, clear=branch.needs_energy), row))
        function = kernel(answers.volumetric_answer(self._setting, moduli))
        volumetric = function.bind(total, self._volumetric_inputs(self.strain))
        return _Answered(law, total, law_call, adding, volumetric, pacing)

    def _add_through_energy(self, total: Array, law: Array, row: Array, moduli: bool) -> None:
        n = self.variables
        slopes = law[:, 1 : 1 + n]
        tail = length(n, moduli)
        by_energy = row[:, tail, None]
        total[:, 1 : 1 + n] += row[:, 1 : 1 + n] + by_energy * slopes
        if moduli:
            a, b = self._upper
            twice, mixed = row[:, tail + 1, None], row[:, tail + 2 :]
            total[:, 1 + n :] += (
                row[:, 1 + n : tail]
                + by_energy * law[:, 1 + n :]
                + twice * slopes[:, a] * slopes[:, b]
                + mixed[:, a] * slopes[:, b]
                + mixed[:, b] * slopes[:, a]
            )

    def energy(self) -> Array:
        """Stored energy per volume at `strain`, MPa, shape (points,)."""
        self._without_moduli.begin()
        stored: Array = self._without_moduli.law[:, 0].copy()
        self._wind()
        volumetric, row = self._volumetric_call
        volumetric()
        stored += row[:, 0]
        for _, end, state in self._ends:
            end()
            stored += state[..., 0].sum(axis=0)
        return stored

    def commit(self) -> None:
        """Accept `strain` as the strain at the end of the step."""
        self._without_moduli.begin()
        self._wind()
        for branch, end, row in self._ends:
            end()
            branch.values[:] = row[..., 1:]

    @cached_property
    def _volumetric_call(self) -> tuple[Call, Array]:
        """Return the contribution of the volumetric part in an array of its own."""
        function = kernel(answers.volumetric_answer(self._setting, False))
        row = np.zeros((self._points, function.size))
        return function.bind(row, self._volumetric_inputs(self.strain), clear=True), row

    def _volumetric_inputs(self, strain: Array) -> dict[str, Array]:
        return {"guard": self._guard, "strain": strain, "parameters": self._parameters["volumetric"]}

    @cached_property
    def _ends(self) -> list[tuple[Remembered, Call, Array]]:
        """Calls that compute stored energy and memory at the end of the step, each with its output for each branch."""
        ends: list[tuple[Remembered, Call, Array]] = []
        for branch in self.families:
            row = np.zeros((len(branch.values), self._points, branch.end.size))
            inputs = branch.inputs(self.strain, self._without_moduli.law)
            ends.append((branch, branch.end.bind(row, inputs, clear=True), row))
        return ends

    # -- derivatives by parameters -------------------------------------------------------------------------------

    def point_state(self) -> PointState:
        """Return the state at `strain`, as the functions for derivatives need it."""
        function = answers.law_answer(self._setting, self._law, self._names, moduli=False)
        strain = self.strain.copy()
        law = kernel(function)(self._points, {"strain": strain, "parameters": self._parameters["law"]})
        return PointState(strain, law)

    def slopes(self, state: PointState) -> Array:
        """Derivatives of the law's [W, W_a] by each of its parameters, shape (parameters, points, 1 + variables)."""
        function = kernel(answers.law_slopes(self._setting, self._law, self._names))
        rows = function(self._points, {"strain": state.strain, "parameters": self._parameters["law"]})
        return np.ascontiguousarray(
            rows.reshape(self._points, len(self._names), 1 + self.variables).transpose(1, 0, 2)
        )

    def volumetric_slopes(self, state: PointState) -> Array:
        """Return derivatives of the volumetric part's [W, W_a] by its parameters."""
        function = kernel(answers.volumetric_slopes(self._setting))
        rows = function(self._points, self._volumetric_inputs(state.strain))
        return np.ascontiguousarray(rows.reshape(self._points, -1, 1 + self.variables).transpose(1, 0, 2))

    def work_slopes(self, strain: Array, change: Array) -> tuple[Array, Array]:
        """Derivatives by the law's and the volumetric part's parameters of the work on a change, (points, parameters).

        Parameters
        ----------
        strain : Array
            Strain variables and pressure, shape (points, variables).
        change : Array
            Change of the strain variables, shape (points, variables).
        """
        law = answers.law_slopes(self._setting, self._law, self._names)
        volumetric = answers.volumetric_slopes(self._setting)
        evaluate = kernel(answers.work_slopes(law, len(self._names)))
        evaluate_volumetric = kernel(answers.work_slopes(volumetric, answers.VOLUMETRIC))
        return (
            evaluate(
                self._points, {"strain": strain, "change": change, "parameters": self._parameters["law"]}
            ),
            evaluate_volumetric(self._points, {"change": change} | self._volumetric_inputs(strain)),
        )

    def by_energy(self, state: PointState, i: int) -> Array:
        """V_e of a family that depends on the law's energy, shape (points,).

        Parameters
        ----------
        state : PointState
            State that `point_state` returned.
        i : int
            Index of the family.
        """
        branch = self.families[i]
        row = branch.answer(moduli=False)(self._points, branch.inputs(state.strain, state.law))
        return row[:, 1 + self.variables]
