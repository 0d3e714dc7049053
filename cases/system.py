"""The system of equations: residual and tangent of a model at its present state, in PETSc's vectors and matrices.

Contributions of the body (`cases.body`) and of energies on surfaces and contact (`cases.surfaces`) are added here, and
the constrained unknowns are separated from the free ones.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from dolfinx import fem
from numpy.typing import NDArray
from petsc4py import PETSc

from cases.body import Body
from cases.matrix import Pattern
from cases.parameters import Parameters
from cases.ranks import sum_over_ranks
from cases.surfaces import SurfaceForms
from geometry.dolfinx_api import collapse

Array = NDArray[np.float64]
Index = NDArray[np.int32]


class System:
    """Residual and tangent of a model, and which of its unknowns are constrained.

    Parameters
    ----------
    state
        Unknowns of the model; read whenever something is assembled.
    parameters
        Parameters of the model; `body` and `surfaces` are brought up to their present values before anything is
        assembled.
    body
        Rubber and elastic sleeves.
    surfaces
        Energies on boundaries, and contact.
    constrained : shape (n,)
        Local numbers of the constrained unknowns, ghosts included.
    bc
        The same as DOLFINx's Dirichlet condition.
    """

    def __init__(
        self,
        state: fem.Function,
        parameters: Parameters,
        body: Body,
        surfaces: SurfaceForms,
        constrained: Index,
        bc: Any,
    ) -> None:
        self._state, self._body, self._surfaces = state, body, surfaces
        self._constrained, self._bc = constrained, bc
        self._parameters = parameters
        self._taken: tuple[float, ...] = ()
        # Entries of the last tangent without its contact, where it had any.
        self._apart: Array | None = None
        self._space = state.function_space
        self._comm = self._space.mesh.comm

    def take_parameters(self, moved: bool = False) -> None:
        """Update everything that depends on parameters, stage, duration (and a moved mesh) to their present values."""
        if moved:
            self._taken = ()
        state = self._parameters.state
        if state != self._taken:
            numbers = self._parameters.numbers()
            # All but the duration, which moves nothing.
            self._body.take(numbers, anew=state[:-1] != self._taken[:-1])
            self._surfaces.take(numbers.shear_modulus)
            self._taken = state

    # -- unknowns ------------------------------------------------------------------------------------------------

    @property
    def owned(self) -> int:
        """Number of unknowns that this rank owns."""
        return int(self._space.dofmap.index_map.size_local * self._space.dofmap.index_map_bs)

    @cached_property
    def owned_constrained(self) -> Index:
        """Constrained unknowns that this rank owns."""
        return self._constrained[self._constrained < self.owned]

    @cached_property
    def owned_pressures(self) -> Index:
        """Pressure unknowns that this rank owns."""
        _, dofs = collapse(self._space.sub(1))
        return dofs[dofs < self.owned]

    @cached_property
    def free_pressures(self) -> int:
        """Number of pressure unknowns on all ranks that are not constrained; collective when first read."""
        return int(sum_over_ranks(self._comm, len(np.setdiff1d(self.owned_pressures, self._constrained))))

    # -- residual ------------------------------------------------------------------------------------------------

    def create_vector(self) -> PETSc.Vec:
        """Return a new vector over the unknowns."""
        return self._state.x.petsc_vec.duplicate()

    def residual(self, b: PETSc.Vec) -> None:
        """Assemble the out-of-balance force at the present state in every unknown, constrained ones included."""
        self.take_parameters()
        with b.localForm() as local:
            forces = local.array_w
            forces[:] = 0.0
            self._body.add_forces(self._state.x.array, forces)
            self._surfaces.add_forces(forces)
        b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)

    def clear_constrained(self, b: PETSc.Vec) -> float:
        """Set the constrained entries of an owned vector to zero; return their norm before that (the reactions)."""
        owned = self.owned_constrained
        squares = float(np.sum(b.array_r[owned] ** 2))
        b.array_w[owned] = 0.0
        return float(np.sqrt(sum_over_ranks(self._comm, squares)))

    # -- tangent -------------------------------------------------------------------------------------------------

    @property
    def symmetric(self) -> bool:
        """Whether the tangent is symmetric; if not, `tangent` assembles its symmetric part only."""
        return self._body.symmetric

    @cached_property
    def _pattern(self) -> Pattern:
        unknowns = [part.points.unknowns.of_cells for part in self._body.parts]
        if self._surfaces.gradient is not None:
            unknowns.append(self._surfaces.gradient.unknowns)
        return Pattern(self._space.dofmap.index_map, self._comm, unknowns, self._constrained)

    def create_matrix(self) -> PETSc.Mat:
        """Return a new matrix for `tangent`, marked symmetric."""
        return self._pattern.matrix()

    def tangent_at_rest(self) -> PETSc.Mat:
        """Return the stiffness of the undeformed body's displacements, without surfaces; zero for other unknowns."""
        pattern = self._pattern.bare()
        matrix = pattern.matrix()
        self.take_parameters()
        self._body.stiffen(np.zeros_like(self._state.x.array))
        self._body.add_stiffness(pattern.places[: len(self._body.parts)], pattern.values)
        pattern.add_to(matrix)
        matrix.assemble()
        first_row, _ = matrix.getOwnershipRange()
        constrained_rows = first_row + np.concatenate([self.owned_pressures, self.owned_constrained])
        matrix.zeroRowsColumns(constrained_rows.astype(PETSc.IntType), diag=0.0)
        return matrix

    def tangent(self, matrix: PETSc.Mat, stiffened: bool = False, positive: bool = False) -> None:
        """Assemble the tangent's symmetric part at the present state; constrained rows and columns are the identity's.

        Parameters
        ----------
        matrix : PETSc.Mat
            Matrix that `create_matrix` returned; changed in place.
        stiffened : bool
            Whether `stiffen` was called at this very state.
        positive : bool
            Take of the contact's stiffness only the part that has no negative eigenvalues. Beside `stiffened`: the
            rest is that of the last tangent.
        """
        if not stiffened:
            self.stiffen()
        contact = self._surfaces.active_contact
        pressed = None
        if contact is not None and contact.is_touching:
            self._pattern, places, entries = contact.fit_pattern(self._pattern, matrix, positive)
            pressed = (places, entries)
        pattern = self._pattern
        if positive and stiffened and self._apart is not None:
            pattern.values[:] = self._apart
        else:
            self._add_rubber(pattern)
            self._apart = pattern.values.copy() if pressed is not None else None
        if pressed is not None:
            pattern.add(*pressed)
        matrix.zeroEntries()
        pattern.add_to(matrix)
        self._surfaces.add_stiffness(matrix, self._bc)
        matrix.assemble()

    def _add_rubber(self, pattern: Pattern) -> None:
        """Set the pattern's values to the stiffness of body and strain gradients at the state of `stiffen`."""
        pattern.values[:] = 0.0
        self._body.add_stiffness(pattern.places[: len(self._body.parts)], pattern.values)
        if self._surfaces.gradient is not None:
            cells, values = self._surfaces.gradient.blocks(self._state.x.array)
            pattern.add(pattern.places[-1][cells], values)

    def stiffen(self) -> None:
        """Compute the moduli at the present state, for `apply_tangent` and `lift`."""
        self.take_parameters()
        self._surfaces.look()
        self._body.stiffen(self._state.x.array)

    def apply_tangent(self, b: PETSc.Vec, direction: Array) -> None:
        """Set a vector to the product of the tangent and a direction.

        Parameters
        ----------
        b
            Receives the forces (N, or N mm for rotations).
        direction : shape (n,)
            Over all local unknowns, ghosts included; the tangent is that at the state of the last `stiffen`.
        """
        with b.localForm() as local:
            forces = local.array_w
            forces[:] = 0.0
            self._body.add_action(direction, forces)
            self._surfaces.add_action(direction, forces)
        b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)

    def pulls(self, directions: Array) -> Array:
        """Return this rank's contributions to the products of the tangent and some directions, shape (k, n).

        Parameters
        ----------
        directions : shape (k, n)
            Over all local unknowns, ghosts included; the tangent is that at the state of the last `stiffen`.
        """
        forces = np.zeros_like(directions)
        self._body.add_action(directions, forces)
        for direction, force in zip(directions, forces, strict=True):
            self._surfaces.add_action(direction, force)
        return forces

    def lift(self, b: PETSc.Vec, rate: Array) -> None:
        """Set b to -K_fc rate_c, the force that a motion of the sleeve exerts on the free unknowns.

        Parameters
        ----------
        b
            Receives that force; its constrained entries become those of `rate`.
        rate : shape (n,)
            Derivative of all local unknowns by the displacement q, zero in the free ones; the tangent is that at the
            state of the last `tangent` or `stiffen`.
        """
        self.apply_tangent(b, rate)
        b.scale(-1.0)
        b.array_w[self.owned_constrained] = rate[self.owned_constrained]
