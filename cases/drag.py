"""A viscous drag on the displacements, which balances a state that is not yet an equilibrium (`cases.settling`)."""

from __future__ import annotations

from petsc4py import PETSc

from cases.model import FiniteElementModel


class Drag:
    """Resistance of the displacements to change.

    Parameters
    ----------
    model
        Its state is left as it is.
    most
        Largest number of Newton iterations for a state with the drag.

    Attributes
    ----------
    most : int
    """

    def __init__(self, model: FiniteElementModel, most: int) -> None:
        self.most, self._viscosity = most, 0.0
        self._stiffness = model.system.tangent_at_rest()
        self._origin, self._way = model.system.create_vector(), model.system.create_vector()

    def begin(self, x: PETSc.Vec, viscosity: float) -> None:
        """Pull towards a state from now on.

        Parameters
        ----------
        x : PETSc.Vec
            Unknowns of the state.
        viscosity : float
            Ratio of the drag's stiffness to that of the displacements at rest.
        """
        x.copy(self._origin)
        self._viscosity = viscosity

    def add_forces(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Add the drag at a state.

        Parameters
        ----------
        x : PETSc.Vec
            Unknowns.
        b : PETSc.Vec
            Out-of-balance force, N; changed in place.
        """
        self._origin.copy(self._way)
        self._way.aypx(-1.0, x)
        self._way.scale(self._viscosity)
        self._stiffness.multAdd(self._way, b, b)

    def add_stiffness(self, matrix: PETSc.Mat) -> None:
        """Add the drag's derivative to the tangent, which has entries wherever two unknowns share a cell."""
        matrix.axpy(self._viscosity, self._stiffness, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)

    def destroy(self) -> None:
        """Free the PETSc objects."""
        for petsc_object in (self._stiffness, self._origin, self._way):
            petsc_object.destroy()
