"""d(force)/d(parameter) along the march, exactly, from the tangent's solutions.

At equilibrium the residual R(x, h; c) vanishes in every direction that leaves the sleeves where they are; h is what
the rubber remembers from the steps before. The force is the work of R on v = dx/dq, the tangent's answer to a motion
of the sleeve, and because the tangent is symmetric the total derivative is dQ/dc = v . (dR/dc + dR/dh h'), with no
need for dx/dc. Without memory that is all: one back-substitution for all parameters together, then one scalar each.

With memory its derivative h' = dh/dc is marched along: one back-substitution per parameter and step gives x' = dx/dc,
and the update rule h_new = U(x, h; c) gives h'_new = U_x x' + U_h h' + U_c. Parameters may also move a boundary (its
motion is then an x' known beforehand) or the path of the sleeve itself (dq/dc, given with the program).

References
----------
Michaleris, Tortorelli and Vidal (1994), Int. J. Numer. Methods Eng. 37:2471-2499, doi:10.1002/nme.1620371408.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.fem import petsc
from numpy.typing import NDArray
from petsc4py import PETSc
from ufl.algorithms import expand_derivatives

from cases.equilibrium import Equilibrium
from cases.jit import options
from cases.model import Model
from cases.series import Series

Array = NDArray[np.float64]

# Step of the difference that bends a path: the rates are sines and cosines, known to rounding.
BEND = 1e-5


class Sensitivity:
    """Derivatives of a model's force with respect to its parameters, step by step.

    Parameters
    ----------
    model
        The model.
    names
        Law parameters, "compliance" (1 / bulk modulus, 1/MPa), parameters of features ("name.parameter"), and any
        others that only move the path.
    """

    def __init__(self, model: Model, names: Iterable[str]) -> None:
        self.model = model
        self.names = tuple(names)
        self._rate = fem.Function(model.space)
        self._moved = fem.Function(model.space)
        self.begin()

    @classmethod
    def of(cls, model: Model, names: Iterable[str]) -> Sensitivity:
        """The derivatives of a model by these names, at the beginning of a march.

        They are kept with the model: deriving its forms takes as long as dozens of steps.
        """
        kept, key = model.sensitivities, tuple(names)
        if key not in kept:
            kept[key] = cls(model, key)
        found: Sensitivity = kept[key]
        found.begin()
        return found

    def begin(self) -> None:
        """Forget the steps so far: the rubber is virgin."""
        model = self.model
        self.memory: list[Array | None] = [None] * len(self.names)
        self._space_size = len(model.state.x.array)

    def __call__(
        self,
        solver: Equilibrium,
        path_rates: Mapping[str, float] | None = None,
        series: Series | None = None,
        time: float = 0.0,
    ) -> tuple[Array, Array]:
        """Derivatives of the force and of the sleeve's displacement, shape (names,) each, at the present equilibrium.

        Where the model has a memory, call it once per accepted step, before the memory is brought up to date.

        Parameters
        ----------
        solver
            That has just found the equilibrium.
        path_rates
            Parameter -> derivative of the prescribed displacement, for those that move it.
        series
            A spring through which the sleeve is driven: what is prescribed is then of both together.
        time
            s, as in the program; for the spring.
        """
        model, prescribed = self.model, path_rates or {}
        self._rate.x.array[:] = solver.tangent_rate()
        stiffness = self._stiffness(solver.q) if series is not None or any(prescribed.values()) else 0.0
        forces, rates = np.zeros(len(self.names)), np.zeros(len(self.names))
        for i, name in enumerate(self.names):
            work = self._marched(i, name, solver.q) if model.path_dependent else self._work(name, solver.q)
            rates[i] = prescribed.get(name, 0.0)
            if series is not None:
                rates[i] = series.rate(name, solver.q, solver.force, time, stiffness, rates[i], work)
            forces[i] = work + stiffness * rates[i]
            if model.path_dependent:
                self._remember(solver, i, name, float(rates[i]))
        return forces, rates

    # -- without memory ------------------------------------------------------------------------------------------

    def _work(self, name: str, q: float) -> float:
        """Work on v of the residual's derivative, times the multiplicity."""
        form, total = self._works[name], 0.0
        if form is not None:
            total += float(self.model.comm.allreduce(fem.assemble_scalar(form)))
        boundary = self.model.boundary_rate(name, q)
        if boundary is not None:
            total += self._dot(self._assembled(self._action, self._rate.x.array), boundary)
        return (total + self._bent(name, q)) * self.model.multiplicity

    def _bent(self, name: str, q: float) -> float:
        """Work of the reactions on what a parameter changes of the sleeve's rate; of all ranks."""
        bend = self.model.boundary_bend(name, q)
        return 0.0 if bend is None else self._dot(self._assembled(self._residual, bend), bend)

    @cached_property
    def _works(self) -> dict[str, Any]:
        return {name: self._compiled(name, self._rate) for name in self.names}

    def _stiffness(self, q: float) -> float:
        """dQ/dq: the tangent's work on v, and that of the reactions on the bend of a rotating sleeve's path."""
        v = self._rate.x.array.copy()
        tangent = self._dot(self._assembled(self._action, v), v)
        model, step = self.model, BEND * max(abs(q), 1.0)
        bend = np.asarray((model.rate(q + step) - model.rate(q - step)) / (2.0 * step), dtype=np.float64)
        if bend.any():
            tangent += self._dot(self._assembled(self._residual, v), bend)
        return tangent * model.multiplicity

    @cached_property
    def _residual(self) -> Any:
        return fem.form(self.model.potential.residual, jit_options=options())

    # -- with memory ---------------------------------------------------------------------------------------------

    def _marched(self, i: int, name: str, q: float) -> float:
        """Derivative of the force at fixed displacement; leaves the residual's in `_force`."""
        model = self.model
        internal = model.internal
        assert internal is not None
        forms = [self._forces[name]] if self._forces[name] is not None else []
        if self.memory[i] is not None:
            internal.change.x.array[:] = self.memory[i]
            forms.append(self._memory_force)
        force = self._force
        with force.localForm() as local:
            local.set(0.0)
        for form in forms:
            petsc.assemble_vector(force, form)
        boundary = model.boundary_rate(name, q)
        if boundary is not None:
            self._moved.x.array[:] = boundary
            petsc.assemble_vector(force, self._action)
        force.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        size = force.getLocalSize()
        work = float(force.array_r @ self._rate.x.array[:size])
        return (float(model.comm.allreduce(work)) + self._bent(name, q)) * model.multiplicity

    def _remember(self, solver: Equilibrium, i: int, name: str, path_rate: float) -> None:
        """Bring the derivative of the memory up to date, from the force that `_marched` left."""
        model, force = self.model, self._force
        internal = model.internal
        assert internal is not None
        force.array_w[model.owned_constrained] = 0.0
        self._moved.x.array[:] = path_rate * self._rate.x.array
        boundary = model.boundary_rate(name, solver.q)
        if boundary is not None:
            self._moved.x.array[:] += boundary
        if force.norm() > 0.0:
            change = force.duplicate()
            solver.ksp.solve(force, change)
            size = force.getLocalSize()
            self._moved.x.array[:size] -= change.array_r
            self._moved.x.scatter_forward()
            change.destroy()
        internal.change.x.array[:] = 0.0 if self.memory[i] is None else self.memory[i]
        moved = internal.evaluated(self._memory_change)
        slope = self._memory_slopes[name]
        if slope is not None:
            moved = moved + internal.evaluated(slope)
        self.memory[i] = moved

    @cached_property
    def _force(self) -> PETSc.Vec:
        return self.model.create_vector()

    @cached_property
    def _forces(self) -> dict[str, Any]:
        return {name: self._compiled(name, None) for name in self.names}

    @cached_property
    def _memory_force(self) -> Any:
        assert self.model.internal is not None
        form = self.model.potential.memory_force(self.model.internal.change)
        return fem.form(form, jit_options=options())

    @cached_property
    def _memory_change(self) -> fem.Expression:
        internal = self.model.internal
        assert internal is not None
        return internal.expression(self.model.potential.memory_change(self._moved, internal.change))

    @cached_property
    def _memory_slopes(self) -> dict[str, fem.Expression | None]:
        internal = self.model.internal
        assert internal is not None
        found: dict[str, fem.Expression | None] = {}
        for name in self.names:
            found[name] = None
            if name in self.model.marked:
                slope = expand_derivatives(self.model.potential.memory_slope(self.model.marked[name]))
                if not _vanishes(slope):
                    found[name] = internal.expression(slope)
        return found

    # -- both ----------------------------------------------------------------------------------------------------

    def _compiled(self, name: str, direction: Any) -> Any:
        """The residual's derivative with respect to a parameter; None where it does not depend on it."""
        if name not in self.model.marked:
            return None
        form = expand_derivatives(self.model.potential.parameter_force(self.model.marked[name], direction))
        return None if form.empty() else fem.form(form, jit_options=options())

    @cached_property
    def _action(self) -> Any:
        return fem.form(self.model.potential.action(self._moved), jit_options=options())

    def _assembled(self, form: Any, direction: Array) -> Array:
        """A rank-1 form along a direction: this rank's unknowns, ghosts zero."""
        self._moved.x.array[:] = direction
        b = self.model.create_vector()
        with b.localForm() as local:
            local.set(0.0)
        petsc.assemble_vector(b, form)
        b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        result = np.zeros(self._space_size)
        result[: b.getLocalSize()] = b.array_r
        b.destroy()
        return result

    def _dot(self, left: Array, right: Array) -> float:
        owned = self.model.create_vector()
        size = owned.getLocalSize()
        owned.destroy()
        return float(self.model.comm.allreduce(float(left[:size] @ right[:size])))


def _vanishes(vector: Any) -> bool:
    from ufl.classes import Zero

    return isinstance(vector, Zero) or all(isinstance(part, Zero) for part in vector.ufl_operands)
