"""Derivatives of a body's forces with respect to parameters, at one state, from its points.

A parameter changes the stresses at the points (law, volumetric part, branches, metal), the points' volumes (swelling),
or where the stress-free body is, and with it volumes and gradients. All of it is an energy's second derivative: once by
the parameter, and once by the gradients, along a direction (`work`) or by every unknown (`forces`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cases.body import Body, MaterialCells
from cases.material import PointState
from cases.metal import MetalAtPoints
from cases.parameters import Numbers
from cases.points import Moving

Array = NDArray[np.float64]

Memory = Sequence[Array | None]
"""Derivative of each family's memory at the points, (branches, points, k); None where it is still zero."""


Stresses = tuple[list[int], Array]
"""Parameters with which the stresses of a part change, by number, and those changes: shape (parameters, points,
1 + variables), MPa per unit of the parameter, as an answer without moduli (`forms.point`) whose energy is not read."""


class Slopes:
    """A body at a state, whose second derivatives `Body.stiffen` has just computed there.

    Parameters
    ----------
    body
        The body.
    state
        This rank's unknowns.
    """

    def __init__(self, body: Body, state: Array) -> None:
        self._body, self._state = body, state
        for part in body.parts:
            part.look_again(state)

    @cached_property
    def _at(self) -> PointState:
        return self._body.material.point_state()

    def stresses(self, rates: Sequence[Numbers], memory: Sequence[Memory]) -> list[Stresses]:
        """Changes of the stresses with each parameter, part by part.

        Parameters
        ----------
        rates, memory
            For each parameter, derivatives of `Body.numbers` and of the memory at the beginning of the step.
        """
        metals = []
        for stresses in zip(*(self._metal_stresses(change) for change in rates), strict=True):
            active = [i for i, stress in enumerate(stresses) if stress is not None]
            # The energy's place, which nothing reads, before the stresses.
            metals.append((active, np.array([np.pad(stresses[i], ((0, 0), (1, 0))) for i in active])))
        return [self._rubber_stresses(rates, memory), *metals]

    def _metal_stresses(self, rates: Numbers) -> Iterator[Array | None]:
        for part, change in zip(self._body.parts[1:], rates.metals, strict=True):
            assert isinstance(part.material, MetalAtPoints)
            yield part.material.change_of_stress(change) if change.any() else None

    def work(self, name: str, rates: Numbers, along: Along) -> float:
        """Work of the forces' derivative along a direction, on this rank; of a body without memory.

        Parameters
        ----------
        name
            The parameter.
        rates
            Derivative of `Body.numbers` by the parameter.
        along
            The direction.
        """
        law, volumetric = along.work_slopes(self._body)
        total = float(rates.law @ law + rates.volumetric @ volumetric)
        return total + self.work_of(name, rates, [None, *self._metal_stresses(rates)], along)

    def work_of(self, name: str, rates: Numbers, stresses: Sequence[Array | None], along: Along) -> float:
        """Work of the forces' derivative along a direction, on this rank; of any body.

        Parameters
        ----------
        name
            The parameter.
        rates
            Derivative of `Body.numbers` by the parameter.
        stresses
            For each part shape (points, variables), MPa per unit of the parameter; None where it does not change.
        along
            The direction.
        """
        total = 0.0
        for part, stress in zip(self._body.parts, stresses, strict=True):
            if stress is not None:
                total += part.points.integral(np.einsum("pa,pa->p", stress, along.strain(part)))
            swollen, moving = self._moves(part, name, rates)
            if swollen != 0.0:
                density = np.einsum("pk,pk->p", self._P(part), along.gradients(part))
                total += swollen * part.points.integral(density)
            if moving is not None:
                density = np.einsum("pk,pk->p", self._stress_change(part, moving), along.gradients(part))
                density += np.einsum("pk,pk->p", self._P(part), moving.gradients(along.direction))
                total += part.points.integral(density)
            drawn_in = part.change_of_gradients(name)
            if drawn_in is not None:
                density = np.einsum("pk,pk->p", part.contract(drawn_in), along.gradients(part))
                total += part.points.integral(density)
        return total

    def forces(self, names: Sequence[str], rates: Sequence[Numbers], stresses: Sequence[Stresses]) -> Array:
        """Return the derivatives of the forces by each parameter, (names, n); N per unit of the parameter.

        Parameters
        ----------
        names
            The parameters.
        rates
            For each parameter, derivative of `Body.numbers` by it.
        stresses
            Result of `stresses`, part by part.
        """
        forces = np.zeros((len(names), len(self._state)))
        for part, (active, answers) in zip(self._body.parts, stresses, strict=True):
            if active:
                for i, row in zip(active, part.by_gradients(answers), strict=True):
                    part.points.add_forces(row, forces[i])
            for name, change, force in zip(names, rates, forces, strict=True):
                swollen, moving = self._moves(part, name, change)
                if swollen != 0.0:
                    part.points.add_forces(swollen * self._P(part), force)
                if moving is not None:
                    part.points.add_forces(self._stress_change(part, moving), force)
                    moving.add_forces(self._P(part), force)
                drawn_in = part.change_of_gradients(name)
                if drawn_in is not None:
                    part.points.add_forces(part.contract(drawn_in), force)
        return forces

    def memory_after(
        self,
        names: Sequence[str],
        rates: Sequence[Numbers],
        memory: Sequence[Memory],
        directions: Sequence[Array],
    ) -> list[list[Array]]:
        """Derivatives of the memory at the end of the step with each parameter, of each family (branches, points, k).

        Parameters
        ----------
        names
            The parameters.
        rates, memory
            For each parameter, derivatives of `Body.numbers` and of the memory at the beginning of the step.
        directions
            For each parameter, derivative of the state, shape (n,).
        """
        material, n = self._body.material, self._body.material.variables
        strains = self._strain_changes(names, directions)
        energies = np.einsum("pa,kpa->kp", self._at.law[:, 1 : 1 + n], strains)
        law = np.array([change.law for change in rates])
        if law.any():
            energies += np.tensordot(law, self._law_slopes[:, :, 0], 1)
        memories: list[list[Array]] = [[] for _ in names]
        passed: list[Array] = []
        for i, branch in enumerate(material.families):
            changes = [
                _changes(branch.among(change.branches), own_memory[i], energy) | {"strain": strain}
                for change, own_memory, energy, strain in zip(rates, memory, energies, strains, strict=True)
            ]
            if branch.clock == "followed":
                _pace(changes, passed)
            rows = branch.rates("end", branch.inputs(self._at.strain, self._at.law), changes)
            if branch.clock == "shown":
                passed = [row[..., 0] for row in rows]
            for memory_rows, row in zip(memories, rows, strict=True):
                memory_rows.append(row)
        return memories

    def _strain_changes(self, names: Sequence[str], directions: Sequence[Array]) -> Array:
        """Derivatives of the rubber's strain variables by each parameter, (names, points, variables)."""
        part = self._body.rubber
        changes = np.empty((len(names), part.points.number, part.points.rows))
        for name, direction, change in zip(names, directions, changes, strict=True):
            part.points.gradients(direction, change)
            moving = part.change_of_points(name)
            if moving is not None:
                change += moving.gradients(self._state)
        return part.strain_rates(changes)

    # -- pieces --------------------------------------------------------------------------------------------------

    def _rubber_stresses(self, rates: Sequence[Numbers], memory: Sequence[Memory]) -> Stresses:
        material, state = self._body.material, self._at
        n = material.variables
        law, volumetric = (
            np.array(rows) for rows in zip(*((c.law, c.volumetric) for c in rates), strict=True)
        )
        stresses = np.zeros((len(rates), *state.law.shape))
        # All parameters in one product.
        if law.any():
            stresses += np.tensordot(law, self._law_slopes, 1)
        laws = stresses.copy() if any(branch.needs_energy for branch in material.families) else stresses
        if volumetric.any():
            stresses += np.tensordot(volumetric, self._volumetric_slopes, 1)
        by_law = np.any(law != 0.0, axis=1)
        active = np.logical_or(by_law, np.any(volumetric != 0.0, axis=1))
        passed = dict[int, Array]()
        for i, branch in enumerate(material.families):
            through = np.logical_and(by_law, branch.needs_energy)
            paced = passed if branch.clock == "followed" else {}
            own = [branch.among(change.branches) for change in rates]
            affected = [
                k
                for k, parameters in enumerate(own)
                if parameters.any() or memory[k][i] is not None or through[k] or k in paced
            ]
            changes = [
                _changes(own[k], memory[k][i], laws[k, :, 0] if through[k] else None) for k in affected
            ]
            if branch.clock == "shown":
                ends = branch.rates("end", branch.inputs(state.strain, state.law), changes)
                passed = {k: row[..., 0] for k, row in zip(affected, ends, strict=True)}
                continue
            if paced:
                _pace(changes, [passed.get(k) for k in affected])
            rows = branch.rates("stress", branch.inputs(state.strain, state.law), changes)
            for k, row in zip(affected, rows, strict=True):
                stresses[k, :, 1:] += row[:, :n]
                if branch.needs_energy:
                    stresses[k, :, 1:] += row[:, n, None] * state.law[:, 1 : 1 + n]
            if through.any():
                by_energy = material.by_energy(state, i)[:, None]
                for k in np.flatnonzero(through):
                    stresses[k, :, 1:] += by_energy * laws[k, :, 1:]
            active[affected] = True
        chosen = [int(k) for k in np.flatnonzero(active)]
        return chosen, stresses if active.all() else stresses[chosen]

    @cached_property
    def _law_slopes(self) -> Array:
        return self._body.material.slopes(self._at)

    @cached_property
    def _volumetric_slopes(self) -> Array:
        return self._body.material.volumetric_slopes(self._at)

    def _moves(self, part: MaterialCells, name: str, rates: Numbers) -> tuple[float, Moving | None]:
        """Return the relative change of a part's volume by swelling, and the motion of its stress-free body."""
        swollen = 0.0
        if part is self._body.rubber:
            swollen = float(rates.volumetric[1] / self._body.swelling)
        return swollen, part.change_of_points(name)

    def _stress_change(self, part: MaterialCells, moving: Moving) -> Array:
        """Change of the energy's derivatives by the gradients times the points' volumes, per volume."""
        return moving.stretch[:, None] * self._P(part) + part.contract(
            moving.gradients(part.strained(self._state))
        )

    def _P(self, part: MaterialCells) -> Array:
        """Return the derivatives of the energy by the displacement gradients."""
        if id(part) not in self._energy_derivatives:
            self._energy_derivatives[id(part)] = part.answer().copy()
        return self._energy_derivatives[id(part)]

    @cached_property
    def _energy_derivatives(self) -> dict[int, Array]:
        return {}

    def along(self, direction: Array) -> Along:
        """A direction, and what it means for the gradients and strains of each part."""
        return Along(direction)


def _changes(parameters: Array, memory: Array | None, energy: Array | None) -> dict[str, Array]:
    """Return the changes of the inputs of a family, by their names."""
    changes = {"parameters": parameters}
    if memory is not None:
        changes["memory"] = memory
    if energy is not None:
        changes["law energy"] = energy[:, None]
    return changes


def _pace(changes: list[dict[str, Array]], passed: Sequence[Array | None]) -> None:
    """Replace the change of the step's duration by that of the clock's advance, (1, points) each."""
    for change, row in zip(changes, passed, strict=True):
        if row is not None:
            own = change["parameters"]
            parameters = np.empty((len(own), row.shape[-1], own.shape[-1]))
            parameters[:] = own
            parameters[..., -1] = row
            change["parameters"] = parameters


class Along:
    """A direction of the unknowns at the points, computed when first needed."""

    def __init__(self, direction: Array) -> None:
        self.direction = direction
        self._gradients: dict[int, Array] = {}
        self._strains: dict[int, Array] = {}
        self._works: tuple[Array, Array] | None = None

    def gradients(self, part: MaterialCells) -> Array:
        """Change of a part's gradients, shape (points, rows)."""
        if id(part) not in self._gradients:
            self._gradients[id(part)] = part.points.gradients(self.direction)
        return self._gradients[id(part)]

    def strain(self, part: MaterialCells) -> Array:
        """Change of a part's strain variables, shape (points, variables)."""
        if id(part) not in self._strains:
            self._strains[id(part)] = part.strain_rates(self.gradients(part)[None])[0]
        return self._strains[id(part)]

    def work_slopes(self, body: Body) -> tuple[Array, Array]:
        """Derivatives of the rubber's work on this direction by the law's and the volumetric part's parameters."""
        if self._works is None:
            part = body.rubber
            densities = body.material.work_slopes(part.material.strain, self.strain(part))
            weight = part.points.weight.reshape(-1)
            self._works = (weight @ densities[0], weight @ densities[1])
        return self._works
