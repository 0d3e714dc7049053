"""d(force)/d(local stiffness): what a stiffer or softer spot of the rubber would do to the curve, cell by cell.

Let a factor s(x), 1 everywhere, multiply the rubber's law and its branches, but not the volumetric part. At equilibrium
dQ/ds = v . dR/ds, with v = dx/dq the tangent's answer to a motion of the sleeve (`cases.sensitivity`): the tangent is
symmetric, so that v is the adjoint solution too, and one back-substitution per step serves every cell. With a test
function that is 1 in one cell and 0 elsewhere, v . dR/ds is one assembled vector.

What the rubber remembers is held: that a spot which is stiffer would also remember otherwise is neglected. The sum over
all cells is the derivative with respect to a factor on all rubber at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray

from cases.equilibrium import Equilibrium
from cases.jit import options
from cases.march import History, march
from cases.model import Model
from cases.program import Program
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
    corners : shape (m, 4) or (m, 8)
        By cell, in tensor-product order.
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

    Attributes
    ----------
    cells : Cells
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        self._rate = fem.Function(model.space)
        space = fem.functionspace(model.mesh.mesh, ("DG", 0))
        self._piece = ufl.TestFunction(space)
        inner = model.mesh.mesh
        found = model.mesh.cells.find(model.mesh.region["rubber"])
        own = found[found < inner.topology.index_map(inner.topology.dim).size_local]
        self._own = space.dofmap.list[own, 0]
        self._form = fem.form(model.potential.stiffness_force(self._rate, self._piece), jit_options=options())
        self.cells = self._cells(own)

    def __call__(self, solver: Equilibrium) -> Array:
        """Derivatives of the force (m,) at the equilibrium that the solver has just found; collective.

        Where the model has a memory, it is that of the step's beginning.
        """
        self._rate.x.array[:] = solver.tangent_rate()
        return self._assembled(self._form)

    def _assembled(self, form: fem.Form) -> Array:
        # A cell's value comes from that cell alone: nothing has to be sent between ranks.
        local = fem.assemble_vector(form).array[self._own] * self.model.multiplicity
        return np.concatenate(self.model.comm.allgather(local))

    def _cells(self, own: NDArray[np.int32]) -> Cells:
        model = self.model
        geometry, dimension = model.mesh.mesh.geometry, model.mesh.dimension
        # Corners come first among the nodes of a cell of second order.
        nodes = cell_nodes(model.mesh.mesh)[own][:, : model.mesh.corners]
        # Ranks share points: by their global numbers they are one, and cells on both sides stay neighbours.
        names = geometry.index_map().local_to_global(nodes.ravel()).reshape(nodes.shape)
        parts = model.comm.allgather((names, geometry.x[nodes][..., :dimension]))
        names, places = (np.concatenate([part[i] for part in parts]) for i in range(2))
        _, first, corners = np.unique(names, return_index=True, return_inverse=True)
        dx = ufl.dx(model.mesh.mesh, metadata={"quadrature_degree": model.quadrature_degree})
        weight = model.strain.weight * self._piece * dx
        return Cells(
            places.reshape(-1, dimension)[first],
            corners.reshape(names.shape),
            self._assembled(fem.form(weight, jit_options=options())),
        )


def swept(model: Model, targets: Array) -> Local:
    """Derivatives along the curve of a path-independent body, as `cases.simulate.sweep` follows it.

    Raises
    ------
    NotConverged
    """
    stiffness, rows = LocalStiffness(model), dict[float, Array]()

    def observe(solver: Equilibrium) -> None:
        rows[solver.q] = stiffness(solver)

    history = sweep(model, targets, observer=observe)
    return Local(stiffness.cells, history, np.array([rows[float(q)] for q in history.displacement]))


def marched(model: Model, program: Program) -> Local:
    """Derivatives along a program, at its targets.

    Raises
    ------
    NotConverged
    """
    stiffness, rows = LocalStiffness(model), list[Array]()
    history = march(model, program, observer=lambda solver: rows.append(stiffness(solver)))
    return Local(stiffness.cells, history, np.array(rows))
