"""Material answers at the points of a body's part: stress and moduli added over law, volumetric part and branches.

One row a point, as `forms.answers` describes it. A branch that depends on the law's energy e, V(e, ...), adds

    V_e W_a   and   V_e W_ab + V_ee W_a W_b + V_ae W_b + V_be W_a

to its own slopes and curvatures, W the law's energy alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cases.kernels import Kernel, kernel
from cases.parameters import Numbers
from forms import answers
from forms.branch import Branch
from forms.kinematics import Setting
from forms.law import Law

Array = NDArray[np.float64]


class Remembered:
    """A branch at the points of the rubber.

    Attributes
    ----------
    values : shape (n, k)
        Memory at the beginning of the step.
    """

    def __init__(self, setting: Setting, branch: Branch, points: int) -> None:
        self._functions = answers.branch_functions(setting, branch)
        self.needs_energy = self._functions.needs_energy
        self.values = np.empty((points, self._functions.memory))
        self.reset()

    def reset(self) -> None:
        """Make the rubber virgin."""
        self.values[:] = self._functions.virgin

    def answer(self, moduli: bool) -> Kernel:
        """Its answer, with or without moduli."""
        return kernel(self._functions.moduli if moduli else self._functions.stress)

    @property
    def end(self) -> Kernel:
        """[stored energy, memory at the end of the step]."""
        return kernel(self._functions.end)

    @property
    def rate(self) -> Kernel:
        """Derivative of [slopes, memory at the end of the step] along a change of all inputs."""
        return kernel(self._functions.rate)


@dataclass(frozen=True)
class Held:
    """A state at which derivatives are asked for: strains, the law's [W, W_a] and the whole answer's."""

    strain: Array
    law: Array
    total: Array


class Rubber:
    """Law, volumetric part and branches.

    Parameters
    ----------
    setting
        How the strain variables follow from gradients.
    law, names
        The law, and those of its parameters that are given.
    branches
        In the order of `Numbers.branches`.
    points
        How many.

    Attributes
    ----------
    branches : list of Remembered
    """

    def __init__(
        self, setting: Setting, law: Law, names: tuple[str, ...], branches: Sequence[Branch], points: int
    ) -> None:
        self._setting, self._law, self._names, self._points = setting, law, names, points
        self.variables = len(setting.names) + 1
        self.branches = [Remembered(setting, branch, points) for branch in branches]
        self._stress = kernel(answers.law_answer(setting, law, names, moduli=False))
        self._volumetric = [kernel(answers.volumetric_answer(setting, moduli)) for moduli in (False, True)]
        self._rows = [np.zeros((points, answers.length(self.variables, moduli))) for moduli in (False, True)]
        # Row and column of each curvature in an answer.
        self._upper = np.triu_indices(self.variables)

    def answer(self, strain: Array, given: Numbers, moduli: bool) -> Array:
        """Answer of all together, shape (points, length); its energy is that of law and volumetric part.

        The next call writes into the same array.
        """
        total = self.isochoric(strain, given, moduli)
        self._volumetric[moduli].add(total, {"strain": strain, "parameters": given.volumetric})
        return total

    def isochoric(self, strain: Array, given: Numbers, moduli: bool) -> Array:
        """Answer of law and branches; the next call writes into the same array."""
        total = self._rows[moduli]
        total[:] = 0.0
        function = self._stress
        if moduli:
            function = kernel(answers.law_answer(self._setting, self._law, self._names, moduli=True))
        function.add(total, {"strain": strain, "parameters": given.law})
        law = total.copy() if any(one.needs_energy for one in self.branches) else total
        for one, parameters in zip(self.branches, given.branches, strict=True):
            inputs = {"strain": strain, "law energy": law, "memory": one.values, "parameters": parameters}
            if one.needs_energy:
                self._add_through_energy(total, law, one.answer(moduli)(self._points, inputs), moduli)
            else:
                one.answer(moduli).add(total, inputs)
        return total

    def _add_through_energy(self, total: Array, law: Array, row: Array, moduli: bool) -> None:
        n = self.variables
        slopes = law[:, 1 : 1 + n]
        tail = answers.length(n, moduli)
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

    def energy(self, strain: Array, given: Numbers) -> Array:
        """Stored energy per volume, MPa, shape (points,)."""
        law = self._law_row(strain, given)
        total = law.copy()
        self._volumetric[False].add(total, {"strain": strain, "parameters": given.volumetric})
        stored = total[:, 0]
        for one, parameters in zip(self.branches, given.branches, strict=True):
            inputs = {"strain": strain, "law energy": law, "memory": one.values, "parameters": parameters}
            stored = stored + one.end(self._points, inputs)[:, 0]
        return stored

    def commit(self, strain: Array, given: Numbers) -> None:
        """Accept these strains as those at the end of the step."""
        law = self._law_row(strain, given)
        for one, parameters in zip(self.branches, given.branches, strict=True):
            inputs = {"strain": strain, "law energy": law, "memory": one.values, "parameters": parameters}
            one.values = np.ascontiguousarray(one.end(self._points, inputs)[:, 1:])

    def _law_row(self, strain: Array, given: Numbers) -> Array:
        row = np.zeros((self._points, answers.length(self.variables, moduli=False)))
        self._stress.add(row, {"strain": strain, "parameters": given.law})
        return row

    # -- derivatives by parameters -------------------------------------------------------------------------------

    def held(self, strain: Array, given: Numbers) -> Held:
        """The present state, for the functions below."""
        return Held(strain, self._law_row(strain, given), self.answer(strain, given, moduli=False).copy())

    def slopes(self, at: Held, given: Numbers) -> Array:
        """Derivatives of the law's [W, W_a] by each of its parameters, shape (parameters, points, 1 + variables)."""
        function = kernel(answers.law_slopes(self._setting, self._law, self._names))
        rows = function(self._points, {"strain": at.strain, "parameters": given.law})
        return np.ascontiguousarray(rows.reshape(self._points, len(self._names), -1).transpose(1, 0, 2))

    def volumetric_slopes(self, at: Held, given: Numbers) -> Array:
        """Of the volumetric part's by compliance and swelling."""
        function = kernel(answers.volumetric_slopes(self._setting))
        rows = function(self._points, {"strain": at.strain, "parameters": given.volumetric})
        return np.ascontiguousarray(rows.reshape(self._points, 2, -1).transpose(1, 0, 2))

    def branch_rate(
        self,
        at: Held,
        given: Numbers,
        i: int,
        change: Array,
        memory: Array | None,
        energy: Array | None = None,
        strain: Array | None = None,
    ) -> Array:
        """Derivative of [V_a, (V_e,) memory at the end] of a branch along changes of what it depends on.

        Parameters
        ----------
        change : shape (parameters,)
            Of its `Numbers`.
        memory, energy, strain : shape (points, ...)
            Of the memory at the beginning, of the law's energy and of the strains; None for no change.
        """
        one = self.branches[i]
        nothing = np.zeros(max(self.variables, one.values.shape[1], 1))
        return one.rate(
            self._points,
            {
                "strain": at.strain,
                "law energy": at.law,
                "memory": one.values,
                "parameters": given.branches[i],
                "d strain": nothing if strain is None else strain,
                "d law energy": nothing if energy is None else energy[:, None],
                "d memory": nothing if memory is None else memory,
                "d parameters": change,
            },
        )

    def by_energy(self, at: Held, given: Numbers, i: int) -> Array:
        """V_e of a branch that depends on the law's energy, shape (points,)."""
        one = self.branches[i]
        inputs = {
            "strain": at.strain,
            "law energy": at.law,
            "memory": one.values,
            "parameters": given.branches[i],
        }
        return one.answer(moduli=False)(self._points, inputs)[:, 1 + self.variables]


class Metal:
    """An elastic sleeve: small strain, any rotation."""

    def __init__(self, setting: Setting, points: int) -> None:
        self._answer, self._points = kernel(answers.metal_answer(setting)), points
        self.variables = len(setting.names) + 1

    def answer(self, strain: Array, moduli: Array) -> Array:
        """Answer with these moduli (shear and bulk, MPa), or their change: it is linear in them."""
        return self._answer(self._points, {"strain": strain, "parameters": moduli})
