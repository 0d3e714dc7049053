"""What the rubber remembers: internal variables of all branches, at the quadrature points.

One function holds them all, as they were at the beginning of the present step. A step that is cut back leaves them as
they are; an accepted one writes those at its end.
"""

from __future__ import annotations

from collections.abc import Sequence

import basix
import basix.ufl
import numpy as np
from dolfinx import fem
from numpy.typing import NDArray
from ufl.algorithms import expand_derivatives
from ufl.corealg.map_dag import map_expr_dag
from ufl.corealg.multifunction import MultiFunction

from cases.jit import options
from forms.kinematics import Kinematics
from forms.potential import Attached, Potential, memory_places
from forms.symmetric import PAIRS
from geometry.mesh import NamedMesh

Array = NDArray[np.float64]


class Internal:
    """Internal variables of a model.

    Parameters
    ----------
    mesh, strain
        Of the model.
    branches
        In the order in which their variables are kept.
    degree
        Of the quadrature that the energy is integrated with.

    Attributes
    ----------
    values : Function, shape (k,) at each point
        At the beginning of the step.
    change : Function
        A direction in the same space, for derivatives.
    """

    def __init__(
        self, mesh: NamedMesh, strain: Kinematics, branches: Sequence[Attached], degree: int
    ) -> None:
        places = memory_places(strain)
        virgin: list[float] = []
        for attached in branches:
            for kind in attached.branch.internal.values():
                identity = [1.0 if PAIRS[i][0] == PAIRS[i][1] else 0.0 for i in places]
                virgin += [0.0] if kind == "scalar" else identity
        cell = mesh.mesh.basix_cell()
        element = basix.ufl.quadrature_element(cell, value_shape=(len(virgin),), degree=degree)
        space = fem.functionspace(mesh.mesh, element)
        self.values, self.change = fem.Function(space), fem.Function(space)
        self._virgin = np.array(virgin)
        self._points, _ = basix.make_quadrature(
            getattr(basix.CellType, mesh.mesh.topology.cell_name()), degree
        )
        cells = mesh.mesh.topology.index_map(mesh.mesh.topology.dim)
        self._cells = np.arange(cells.size_local + cells.num_ghosts, dtype=np.int32)
        self.reset()

    def follow(self, potential: Potential) -> None:
        """Take the rule by which the variables change from the model's potential."""
        self._update = self.expression(potential.update)

    def expression(self, vector: object) -> fem.Expression:
        """Compile a UFL vector of the variables' shape, for `evaluated`."""
        # The number of a `variable` is part of an expression's signature, and would make every model's another one.
        bare = map_expr_dag(_Bare(), expand_derivatives(vector))
        return fem.Expression(bare, self._points, jit_options=options())

    def evaluated(self, expression: fem.Expression) -> Array:
        """Values of an expression over all points, laid out as in the arrays of `values`."""
        return np.asarray(expression.eval(self.values.function_space.mesh, self._cells)).reshape(-1)

    def reset(self) -> None:
        """Make the rubber virgin."""
        array = self.values.x.array
        array[:] = np.tile(self._virgin, len(array) // len(self._virgin))

    def commit(self) -> None:
        """Accept the present state as the end of the step."""
        self.values.x.array[:] = self.evaluated(self._update)


class _Bare(MultiFunction):  # type: ignore[misc]  # UFL has no type information
    """Takes the marks for differentiation off an expression."""

    expr = MultiFunction.reuse_if_untouched

    def variable(self, o: object, operand: object, _: object) -> object:
        """The expression that is marked."""
        return operand
