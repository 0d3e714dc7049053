"""Position of the stress-free body at points of the mesh, and its derivatives by the parameters.

Each feature that moves the body does so by a `forms.kinematics.Moved` of its own, evaluated here at the points;
the displacements of several features are added, and the gradient of the sum is inverted numerically.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray

from cases.compiling import bare
from cases.feature import Installed
from cases.jit import options
from cases.parameters import Parameters
from forms.kinematics import Moved
from forms.law import Scalar
from geometry.mesh import NamedMesh

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StressFreePlacement:
    """A stress-free body, or the rate at which it moves, at points of cells.

    Attributes
    ----------
    displacement : shape (cells, points, d)
        Displacement from the mesh, mm.
    inverse : shape (cells, points, d, d)
        M^-1, with M the gradient of X + displacement(X) on the mesh.
    ratio : shape (cells, points)
        det M.
    at_rest : bool
        Whether it is the mesh.
    """

    displacement: Array
    inverse: Array
    ratio: Array
    at_rest: bool = False

    @classmethod
    def of_mesh(cls, shape: tuple[int, ...]) -> StressFreePlacement:
        """The mesh itself, at points of this shape (cells, points, d)."""
        inverse = np.broadcast_to(np.eye(shape[-1]), (*shape, shape[-1]))
        return cls(np.zeros(shape), inverse, np.ones(shape[:2]), at_rest=True)


class StressFree:
    """Position of the stress-free body as the features of a model define it.

    Parameters
    ----------
    mesh, features, parameters
        Those of the model.
    """

    def __init__(self, mesh: NamedMesh, features: Sequence[Installed], parameters: Parameters) -> None:
        self._mesh, self._features, self._parameters = mesh, features, parameters

    def each(self, features: Sequence[Installed]) -> dict[str, Moved]:
        """Return, by the name of each feature that moves the body, the position in UFL."""
        x = ufl.SpatialCoordinate(self._mesh.mesh)
        return {
            installed.name: installed.feature.stress_free(
                self._parameters.ufl_values(installed), x, self._mesh.shape
            )
            for installed in features
            if installed.feature.stress_free is not None
        }

    def together(self, features: Sequence[Installed]) -> Moved | None:
        """Return the position due to these features together, in UFL; None if it is the mesh."""
        positions = list(self.each(features).values())
        if len(positions) < 2:
            return positions[0] if positions else None
        return Moved.by(sum((position.displacement for position in positions[1:]), positions[0].displacement))

    def arms(self) -> Scalar | None:
        """Return the displacement by which sleeves turn as other bodies (`Feature.arms`), in UFL; None if by none."""
        x = ufl.SpatialCoordinate(self._mesh.mesh)
        arms = [
            installed.feature.arms(self._parameters.ufl_values(installed), x, self._mesh.shape)
            for installed in self._features
            if installed.feature.arms is not None
        ]
        nonzero = [arm for arm in arms if arm is not None]
        return sum(nonzero[1:], nonzero[0]) if nonzero else None

    def at(self, cells: NDArray[np.int32], points: Array) -> MovedPoints | None:
        """Return the position at reference points of cells; None if it is the mesh.

        Parameters
        ----------
        cells : NDArray[np.int32]
            Numbers of cells, shape (cells,).
        points : Array
            Reference coordinates in the cell, shape (points, dimension).
        """
        positions = self.each(self._features)
        if not positions:
            return None
        return MovedPoints(self._mesh.mesh, positions, self._parameters.marked, cells, points)


class MovedPoints:
    """The stress-free body at some points.

    Parameters
    ----------
    mesh
        DOLFINx's mesh.
    moved
        Position of the stress-free body, by the name of the feature that moves it.
    parameters
        Name of a feature's parameter -> ufl.variable.
    cells, points
        Numbers of cells, and points in the reference cell.
    """

    def __init__(
        self, mesh: Any, moved: Mapping[str, Moved], parameters: Mapping[str, Any], cells: Any, points: Array
    ) -> None:
        self._mesh, self._cells = mesh, cells
        self._shape = (len(cells), len(points))
        self._moved = [
            _FeatureMotion(
                position, {n: v for n, v in parameters.items() if n.startswith(f"{feature}.")}, points
            )
            for feature, position in moved.items()
        ]

    def now(self) -> StressFreePlacement:
        """Return the position with the present parameters; `rate` then returns the derivatives there."""
        parts = [part.evaluate(self._mesh, self._cells, self._shape) for part in self._moved]
        displacement = sum((u for u, _, _ in parts), np.zeros(1))
        d = displacement.shape[-1]
        if len(parts) == 1:
            inverse = parts[0][1]
            gradient: Array = np.asarray(np.linalg.inv(inverse), dtype=np.float64)
        else:
            gradient = np.eye(d) + sum(np.linalg.inv(inverse) - np.eye(d) for _, inverse, _ in parts)
            inverse = np.asarray(np.linalg.inv(gradient), dtype=np.float64)
        self._rates: dict[str, StressFreePlacement] = {}
        ratio = np.linalg.det(gradient)
        for _, gradients, rates in parts:
            M = np.linalg.inv(gradients)
            for name, (u, change) in rates.items():
                # Derivatives of the gradient, then of the inverse and the determinant of the sum.
                slope = -M @ change @ M
                product = inverse @ slope
                self._rates[name] = StressFreePlacement(
                    u, -product @ inverse, ratio * np.trace(product, axis1=-2, axis2=-1)
                )
        return StressFreePlacement(displacement, inverse, ratio)

    def rate(self, name: str) -> StressFreePlacement | None:
        """Return the derivative by a parameter at the last position of `now`; None if it does not move the body."""
        return self._rates.get(name)


class _FeatureMotion:
    """Motion by one feature: displacement and inverse gradient, and their derivatives by its parameters."""

    def __init__(self, moved: Moved, parameters: Mapping[str, Any], points: Array) -> None:
        self._names = tuple(parameters)
        self._d = len(moved.displacement)
        components = self._components(moved)
        parts = components + [ufl.diff(part, v) for v in parameters.values() for part in components]
        self._expression = fem.Expression(bare(ufl.as_vector(parts)), points, jit_options=options(light=True))

    def _components(self, moved: Moved) -> list[Any]:
        flat = [moved.displacement[i] for i in range(self._d)]
        return flat + [ufl.as_ufl(part) for row in moved.inverse for part in row]

    def evaluate(
        self, mesh: Any, cells: Any, shape: Sequence[int]
    ) -> tuple[Array, Array, dict[str, tuple[Array, Array]]]:
        """Displacement, inverse, and by parameter the derivatives of both."""
        d = self._d
        values = np.asarray(self._expression.eval(mesh, cells)).reshape(
            *shape, 1 + len(self._names), d + d * d
        )
        pairs = [(v[..., :d], v[..., d:].reshape(*shape, d, d)) for v in np.moveaxis(values, 2, 0)]
        return (*pairs[0], dict(zip(self._names, pairs[1:], strict=True)))
