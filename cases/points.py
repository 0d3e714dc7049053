"""Quadrature points of a group of cells: gradients and pressure there, and the forces that stresses there cause.

Shape functions are tabulated once, with the mesh's geometry in them. Where the stress-free body is not the mesh, their
derivatives are taken by its coordinates; nothing else depends on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cases.elements import Index, QuadratureRule, Unknowns
from cases.kernels import loops, pointer
from cases.stress_free import StressFreePlacement
from forms.setting import KinematicDescription
from geometry.dolfinx_api import cell_nodes
from geometry.mesh import NamedMesh

Array = NDArray[np.float64]


class Points:
    """Points of some cells of a mesh.

    Parameters
    ----------
    mesh, space
        The mesh, and its mixed space with displacement first and pressure second.
    setting
        How the deformation follows from gradients.
    cells
        Numbers of the cells, on this rank.
    rule
        Points in each of them.

    Attributes
    ----------
    shape : tuple of int
        Cells and points in each.
    rows : int
        Number of gradients, plus one for the pressure, which is the last row.
    unknowns : Unknowns
    """

    def __init__(
        self, mesh: NamedMesh, space: Any, setting: KinematicDescription, cells: Index, rule: QuadratureRule
    ) -> None:
        self.setting, self.cells, self.rule = setting, cells, rule
        self.shape = (len(cells), len(rule.points))
        self.rows = len(setting.gradients) + 1
        self.unknowns = Unknowns.of(space, setting.components, cells)
        elements = [space.sub(i).element.basix_element for i in range(2)]
        self._N, slopes = _shape_functions(elements[0], rule.points)
        self._pressure, _ = _shape_functions(elements[1], rule.points)
        self._half_plane = setting.gradients[-1][1] != "d2"
        # The shape functions themselves are needed in the half-plane only.
        functions = np.stack([*slopes, self._N] if self._half_plane else [*slopes], axis=1)
        self._reference = _pad_last_axis(functions)
        self._transposed = _pad_last_axis(functions.reshape(-1, functions.shape[-1]).T)
        self._names = tuple(dict.fromkeys(table for _, table in setting.gradients))
        self._component = np.array([i for i, _ in setting.gradients], dtype=np.int32)
        self._table = np.array([self._names.index(table) for _, table in setting.gradients], dtype=np.int32)
        self.locate(mesh)

    def locate(self, mesh: NamedMesh) -> None:
        """Compute the points' geometry from the present nodes of the mesh, which then is the stress-free body."""
        self._x, slope = _geometry(mesh, self.cells, self.rule.points)
        self._measure = np.abs(np.linalg.det(slope)) * self.rule.weights
        # d(reference)_i / dx_j.
        self._inverse: Array = np.asarray(np.linalg.inv(slope), dtype=np.float64)
        self.move(StressFreePlacement.of_mesh(self._x.shape))

    def move(self, place: StressFreePlacement, swelling: float = 1.0) -> None:
        """Set the position of the stress-free body; its volume is ``swelling`` times that of this shape.

        Parameters
        ----------
        place : StressFreePlacement
            The stress-free body.
        swelling : float
            Volume of the stress-free body over that of its shape, a ratio.
        """
        self._place, self._swelling = place, swelling
        self.weight = self._measure * place.ratio * swelling
        self._radius = self._x[..., 0] + place.displacement[..., 0]
        if self._half_plane:
            self.weight = self.weight * 2 * np.pi * self._radius
        self._slopes: Array = self._inverse if place.at_rest else self._inverse @ place.inverse
        self._group = self._make_group(
            self._turn(self._slopes, self._radius, 1 / self._radius), self._pressure
        )

    def rescale(self, swelling: float) -> None:
        """Change the swelling alone."""
        self.weight *= swelling / self._swelling
        self._swelling = swelling

    @property
    def number(self) -> int:
        """Number of points, all cells together."""
        return self.shape[0] * self.shape[1]

    def gradients(self, x: Array, out: Array | None = None) -> Array:
        """Gradients and pressure of a vector of unknowns, shape (number, rows).

        Parameters
        ----------
        x : Array
            This rank's unknowns, shape (m,).
        out : Array | None
            Array for the results, shape (number, rows).
        """
        g = np.empty((self.number, self.rows)) if out is None else out
        loops().lib.gradients(self._group.struct, pointer(x), pointer(g))
        return g

    @property
    def coordinates(self) -> Array:
        """Return the coordinates of the points on the mesh, mm, shape (cells, points, d)."""
        return self._x

    def displacements(self, x: Array) -> Array:
        """Displacement of a vector of unknowns, shape (cells, points, components)."""
        return np.asarray(np.einsum("pn,cin->cpi", self._N, x[self.unknowns.displaced]))

    def add_forces(self, P: Array, forces: Array) -> None:
        """Add the forces of P, the derivatives of the energy density by the gradients, to a vector over the unknowns.

        Parameters
        ----------
        P : Array
            Derivative of the energy density by each gradient, shape (number, rows), MPa.
        forces : Array
            Vector over this rank's unknowns, shape (m,); changed in place.
        """
        loops().lib.forces(self._group.struct, pointer(P), pointer(forces))

    def add_stiffness(self, A: Array, place: Index, values: Array) -> None:
        """Add element stiffnesses of A, shape (number, upper triangle), to ``values`` at ``place`` (`cases.matrix`).

        Parameters
        ----------
        A : Array
            Second derivatives by the gradients, shape (number, upper triangle), MPa.
        place : Index
            Positions of the entries in ``values`` (`cases.matrix`).
        values : Array
            Entries, shape (entries,); changed in place.
        """
        loops().lib.stiffness(self._group.struct, pointer(A), pointer(place, "int32_t"), pointer(values))

    def add_action(self, A: Array, directions: Array, forces: Array, skew: Array | None = None) -> None:
        """Add the products of the stiffness of A and some directions.

        Parameters
        ----------
        A : Array
            Second derivatives by the gradients, shape (number, upper triangle), MPa.
        directions : Array
            Vectors over this rank's unknowns, shape (k, m), contiguous.
        forces : Array
            The same shape, contiguous; changed in place.
        skew : Array or None
            Pairs of vectors s and z, shape (pairs, 2, number, rows): (s_k z_l - z_k s_l) / 2 of each belongs to the
            stiffness too.
        """
        count, size = directions.shape
        x, r = pointer(directions), pointer(forces)
        pairs, turn = (0, loops().ffi.NULL) if skew is None else (len(skew), pointer(skew))
        loops().lib.action(self._group.struct, pointer(A), turn, pairs, count, size, x, r)

    def add_inertia(self, x: Array, directions: Array, forces: Array) -> None:
        """Add the products of the mass of a body of unit density and some directions, at a state.

        Parameters
        ----------
        x : Array
            This rank's unknowns, shape (m,): where the body is.
        directions : Array
            Vectors over this rank's unknowns, shape (k, m).
        forces : Array
            The same shape; changed in place.
        """
        weight = np.broadcast_to(
            self.weight[:, None], (len(self.cells), self.setting.components, self.shape[1])
        )
        if "radius_d0" in self._names:
            # The second component is an angle: its mass is a moment of inertia about the axis.
            lever = np.ones_like(weight)
            lever[:, 1] = (self._radius + self.displacements(x)[..., 0]) ** 2
            weight = weight * lever
        displaced = self.unknowns.displaced
        for direction, force in zip(directions, forces, strict=True):
            inertia = np.einsum("cip,pn,cin->cip", weight, self._N, direction[displaced], optimize=True)
            local = np.einsum("cip,pn->cin", inertia, self._N, optimize=True)
            force += np.bincount(displaced.ravel(), local.ravel(), minlength=len(force))

    def integral(self, density: Array) -> float:
        """Integrate a density per volume of the stress-free body, shape (number,)."""
        return float(self.weight.reshape(-1) @ density)

    # -- a stress-free body that moves with a parameter ----------------------------------------------------------

    def change_of_points(self, rate: StressFreePlacement) -> Moving:
        """Return how the points change when the stress-free body moves at this rate (displacement and inverse)."""
        radial, R = rate.displacement[..., 0], self._radius
        stretch = rate.ratio / self._place.ratio + (radial / R if self._half_plane else 0.0)
        change = self._inverse @ rate.inverse
        turn = self._turn(change, R, -radial / R**2)
        for i, name in enumerate(self._names):
            if name.startswith("radius_d"):
                turn[:, :, i, : change.shape[2]] += radial[..., None] * self._slopes[..., int(name[-1])]
        return Moving(self._make_group(turn, np.zeros_like(self._pressure)), stretch.reshape(-1), self)

    # -- tables --------------------------------------------------------------------------------------------------

    def _turn(self, slopes: Array, radius: Array, over_radius: Array) -> Array:
        """Factors of the reference cell's functions in each table, shape (cells, points, tables, functions).

        Parameters
        ----------
        slopes : shape (cells, points, d, d)
            Derivatives of the reference coordinates by those of the stress-free body, the latter last.
        radius, over_radius : shape (cells, points)
            Factors of "radius_d0" and "radius_d1", and of "over_radius".
        """
        d = slopes.shape[-1]
        turn = np.zeros((*self.shape, len(self._names), self._reference.shape[1]))
        for i, name in enumerate(self._names):
            if name == "over_radius":
                turn[:, :, i, d] = over_radius
            else:
                factor = radius[..., None] if name.startswith("radius") else 1.0
                turn[:, :, i, :d] = factor * slopes[..., int(name[-1])]
        return turn

    def _make_group(self, turn: Array, pressure: Array) -> _PointGroup:
        return _PointGroup.of(self, turn, pressure)


@dataclass(frozen=True)
class _PointGroup:
    """The struct that the C loops read, with its arrays, which must live as long as it does."""

    struct: Any
    kept: Sequence[Any]

    @classmethod
    def of(cls, points: Points, turn: Array, pressure: Array) -> _PointGroup:
        ffi = loops().ffi
        cells, number, tables, _ = turn.shape
        arrays = {
            "component": points._component,
            "table": points._table,
            "reference": points._reference,
            "transposed": points._transposed,
            "turn": turn,
            "pressure": np.ascontiguousarray(pressure),
            "displaced": points.unknowns.displaced,
            "pressed": points.unknowns.pressed,
            "weight": points.weight,
        }
        sizes = {
            "cells": cells,
            "points": number,
            "nodes": points.unknowns.displaced.shape[-1],
            "tables": tables,
            "gradients": points.rows - 1,
            "components": points.setting.components,
            "corners": pressure.shape[-1],
        }
        addresses = {
            name: ffi.cast("int32_t *" if array.dtype == np.int32 else "double *", array.ctypes.data)
            for name, array in arrays.items()
        }
        return cls(ffi.new("group *", sizes | addresses), list(arrays.values()))


@dataclass(frozen=True)
class Moving:
    """Change of points with a parameter that moves the stress-free body.

    Attributes
    ----------
    stretch : shape (number,)
        Relative change of the points' volumes.
    """

    group: _PointGroup
    stretch: Array
    points: Points

    def gradients(self, x: Array) -> Array:
        """Change of the gradients of a vector of unknowns, shape (number, rows)."""
        g = np.empty((self.points.number, self.points.rows))
        loops().lib.gradients(self.group.struct, pointer(x), pointer(g))
        return g

    def add_forces(self, P: Array, forces: Array) -> None:
        """Add the change of the forces of P that is due to the change of the gradients.

        Parameters
        ----------
        P : Array
            Derivative of the energy density by each gradient, shape (number, rows), MPa.
        forces : Array
            Vector over this rank's unknowns, shape (m,); changed in place.
        """
        loops().lib.forces(self.group.struct, pointer(P), pointer(forces))


def _shape_functions(element: Any, points: Array) -> tuple[Array, Array]:
    """Values (p, nodes) and derivatives (d, p, nodes) of a scalar element's shape functions."""
    table = element.tabulate(1, points)
    return np.ascontiguousarray(table[0, :, :, 0]), np.ascontiguousarray(table[1:, :, :, 0])


def _geometry(mesh: NamedMesh, cells: Index, points: Array) -> tuple[Array, Array]:
    """Coordinates (cells, p, d), mm, and their derivatives by the reference ones (cells, p, d, d)."""
    element = mesh.mesh.ufl_domain().ufl_coordinate_element().sub_elements[0]
    N, dN = _shape_functions(element.basix_element, points)
    nodes = mesh.mesh.geometry.x[cell_nodes(mesh.mesh)[cells]][..., : mesh.dimension]
    x = np.einsum("pn,cni->cpi", N, nodes, optimize=True)
    return x, np.einsum("jpn,cni->cpij", dN, nodes, optimize=True)


def _pad_last_axis(table: Array) -> Array:
    """The table with its last axis filled up with zeros to a multiple of four."""
    padding = -table.shape[-1] % 4
    return np.ascontiguousarray(np.pad(table, [(0, 0)] * (table.ndim - 1) + [(0, padding)]))
