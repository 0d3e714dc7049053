"""d(force)/d(local stiffness): the effect of locally stiffer or softer rubber on the curve, cell by cell.

Let a factor s(x), 1 everywhere, multiply the rubber's law and its branches, but not the volumetric part. At equilibrium
dQ/ds = v . dR/ds, with v = dx/dq the tangent's answer to a motion of the sleeve (`cases.sensitivity`): the tangent is
symmetric (nearly so with a clock, `forms.branch`), so that v is the adjoint solution too, and one solution per step
serves every cell. A cell's share of v . dR/ds is the work of its stresses on the strains of v.

The rubber's memory is held fixed: that a stiffer spot would also have another memory is neglected. The sum over
all cells is the derivative with respect to a factor on all rubber at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cases.equilibrium import Equilibrium
from cases.march import History, march
from cases.model import FiniteElementModel
from cases.program import Program
from cases.rigid import adjoint
from cases.simulate import sweep
from geometry.dolfinx_api import cell_nodes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cells:
    """The rubber's cells, of all ranks.

    Attributes
    ----------
    points : shape (n, 2) or (n, 3)
        Corners, mm: (R, Z) of the half-plane, or x, y, z.
    corners : shape (m, 3), (m, 4) or (m, 8)
        Corners of each cell: a triangle, a tetrahedron, or a quadrilateral or hexahedron in tensor-product order.
    volume : shape (m,)
        mm^3, of the whole bushing: mirror images and the turn about the axis included.
    """

    points: Array
    corners: NDArray[np.int64]
    volume: Array

    @property
    def centres(self) -> Array:
        """Mean of the corners, shape (m, 2) or (m, 3)."""
        return np.asarray(self.points[self.corners].mean(axis=1))


@dataclass(frozen=True)
class Local:
    """Derivatives along a path.

    Attributes
    ----------
    cells : Cells
    history : History
    slope : shape (n, m)
        Derivative of the force with respect to each cell's factor, at each of the history's points.
    """

    cells: Cells
    history: History
    slope: Array


class LocalStiffness:
    """Derivative of a model's force with respect to the stiffness of each cell of its rubber.

    Parameters
    ----------
    model
        The model.
    reaction
        On a path of six motions, the number of the reaction that is differentiated; None = the power, where no motion
        is free.

    Attributes
    ----------
    cells : Cells
    """

    def __init__(self, model: FiniteElementModel, reaction: int | None = None) -> None:
        self.model, self._reaction = model, reaction
        inner = model.mesh.mesh
        cells = model.cells("rubber")
        # Those of the rubber's cells that this rank owns.
        self._own = np.flatnonzero(cells < inner.topology.index_map(inner.topology.dim).size_local)
        self.cells = self._cells(cells[self._own])

    def __call__(self, solver: Equilibrium) -> Array:
        """Derivatives of the force (m,) at the equilibrium that the solver has just found; collective.

        Where the model has a memory, it is that of the step's beginning.
        """
        rate, part = self._direction(solver), self.model.body.rubber
        part.look(self.model.state.x.array)
        change = part.strain_rates(part.points.gradients(rate)[None])[0]
        stress = self.model.body.material.isochoric(moduli=False)[:, 1:]
        return self._by_cell(np.einsum("pa,pa->p", stress, change))

    def _direction(self, solver: Equilibrium) -> Array:
        if self._reaction is None:
            return solver.tangent_rate()
        solver.factorise()
        return adjoint(self.model, solver.factor, solver.q, self._reaction)

    def _by_cell(self, density: Array) -> Array:
        """Integrals of a density at the points over each cell, of all ranks."""
        points = self.model.body.rubber.points
        totals = (density.reshape(points.shape) * points.weight).sum(axis=1)[self._own]
        return np.concatenate(self.model.comm.allgather(totals * self.model.multiplicity))

    def _cells(self, cells: NDArray[np.int32]) -> Cells:
        model = self.model
        geometry, dimension = model.mesh.mesh.geometry, model.mesh.dimension
        # Corners come first among the nodes of a cell of second order.
        nodes = cell_nodes(model.mesh.mesh)[cells][:, : model.mesh.corners]
        # Ranks share points: global numbers identify them, so that cells on both sides stay neighbours.
        names = geometry.index_map().local_to_global(nodes.ravel()).reshape(nodes.shape)
        parts = model.comm.allgather((names, geometry.x[nodes][..., :dimension]))
        names, places = (np.concatenate([part[i] for part in parts]) for i in range(2))
        _, indices, corners = np.unique(names, return_index=True, return_inverse=True)
        # Volume of the stress-free shape, before the rubber swells or shrinks.
        model.take_parameters()
        volume = self._by_cell(np.full(model.body.rubber.points.number, 1.0 / model.body.swelling))
        return Cells(places.reshape(-1, dimension)[indices], corners.reshape(names.shape), volume)


def differentiate_sweep(model: FiniteElementModel, targets: Array) -> Local:
    """Derivatives along the curve of a path-independent body, as `cases.simulate.sweep` follows it.

    Parameters
    ----------
    model : FiniteElementModel
        The model, ready to be marched.
    targets : Array
        Displacements, shape (n,), mm or rad.

    Raises
    ------
    NotConverged
    """
    stiffness, rows = LocalStiffness(model), dict[float, Array]()

    def observe(solver: Equilibrium) -> None:
        rows[solver.q] = stiffness(solver)

    history = sweep(model, targets, observer=observe)
    return Local(stiffness.cells, history, np.array([rows[float(q)] for q in history.displacement]))


def differentiate_march(model: FiniteElementModel, program: Program) -> Local:
    """Derivatives along a program, at its targets.

    Parameters
    ----------
    model : FiniteElementModel
        The model, ready to be marched.
    program : Program
        The path of the sleeve.

    Raises
    ------
    NotConverged
    """
    stiffness, rows = LocalStiffness(model), list[Array]()
    history = march(model, program, observer=lambda solver: rows.append(stiffness(solver)))
    return Local(stiffness.cells, history, np.array(rows))
