"""Contact of a model: an energy of its state, beside those of its body and its surfaces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cases.contact.bodies import Bodies
from cases.contact.energy import Pressed
from cases.contact.mirrors import MirrorPlane, mirror_planes
from cases.contact.search import ContactSearch
from cases.contact.sleeves import RigidFacets, strip
from cases.contact.surface import Patch, exterior, facets_of, on_region, patch, places
from cases.matrix import MISSING, Pattern
from cases.mode import Mode
from cases.stress_free import MovedPoints, StressFree
from geometry.mesh import NamedMesh

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Index = NDArray[np.int32]

# Deepest penetration that an equilibrium may have, over the size of a facet.
DEEPEST = 0.01
# Depth to which points are sought that a step of the march may have moved through a surface, over a facet's breadth.
BEYOND = 0.75


@dataclass(frozen=True)
class Surroundings:
    """Position of the stress-free body at the nodes on which all others depend."""

    parts: Sequence[tuple[MovedPoints, Ints]]

    def displacement(self) -> Array:
        """Return the displacement from the mesh with the present parameters, shape (k, d)."""
        return np.concatenate([points.now().displacement[w[:, 0], w[:, 1]] for points, w in self.parts])

    def rate(self, name: str) -> Array | None:
        """Return the derivative of `displacement` by a parameter, at its last value; None for zero."""
        rates = [(points.rate(name), w) for points, w in self.parts]
        if rates[0][0] is None:
            return None
        return np.concatenate([rate.displacement[w[:, 0], w[:, 1]] for rate, w in rates if rate is not None])


class Contact:
    """Frictionless contact of a bushing's surfaces.

    Parameters
    ----------
    free
        The free surface.
    strips
        Sleeves beyond their bonds.
    axisymmetric
        Whether the mesh is the half-plane.
    stress_free
        Where the stress-free body is; None where it is the mesh.
    planes
        Planes of symmetry at which the mesh is cut.

    Attributes
    ----------
    bodies : Bodies
    near : bool
        Whether any surfaces come near each other at the state of `look`.
    """

    def __init__(
        self,
        free: Patch,
        strips: Sequence[RigidFacets],
        axisymmetric: bool,
        stress_free: StressFree | None = None,
        planes: Sequence[MirrorPlane] = (),
    ) -> None:
        self.bodies = Bodies.of(free, strips, axisymmetric)
        if strips:
            # A sleeve continues beyond its bond only where there is no rubber.
            blocked = ContactSearch(self.bodies).points_inside(self.bodies.X, BEYOND).other
            self.bodies = self.bodies.without(np.unique(blocked[blocked >= self.bodies.soft]))
        self.bodies = self.bodies.with_planes(planes)
        self._search = ContactSearch(self.bodies)
        self._patch, self._free = free, len(free.X)
        self._moved = None if stress_free is None else _surroundings(free, strips, stress_free)
        self._shift = np.zeros(self.bodies.X.shape)
        self.shear_modulus, self._share = 0.0, 1.0
        self._state: Array | None = None
        self._pressed: Pressed | None = None
        self._blocks: Array | None = None
        self.near = False

    def relocate(self, mesh: NamedMesh) -> bool:
        """Take over new coordinates of the mesh; return False if the contact has to be built again instead."""
        if (
            self.bodies.follow is not None
            or self._moved is not None
            or mesh.shape.contact_surfaces is not True
        ):
            return False
        planes = self.bodies.X[self.bodies.movable :]
        self.bodies = replace(self.bodies, X=np.concatenate([places(mesh, self._patch), planes]))
        self._search, self._state = ContactSearch(self.bodies), None
        return True

    def take(self, shear_modulus: float) -> None:
        """Update the law's shear modulus (MPa) and the position of the stress-free body."""
        self.shear_modulus = shear_modulus
        if self._moved is not None:
            self._shift = self.bodies.expand(self._moved.displacement())
        self._state = None

    @property
    def share(self) -> float:
        """Share of the contact stiffness in use; below 1 only on the way to an equilibrium."""
        return self._share

    @contextmanager
    def soften(self, share: float) -> Iterator[None]:
        """Reduce the stiffness to this share."""
        self._share, self._state = share, None
        try:
            yield
        finally:
            self._share, self._state = 1.0, None

    # -- at a state ----------------------------------------------------------------------------------------------

    def look(self, state: Array) -> None:
        """Find what is in contact at a state, given by this rank's unknowns."""
        if self._state is not None and np.array_equal(state, self._state):
            return
        self._state, self._blocks = state.copy(), None
        # A line search may try values that are not finite, which the body's residual shows.
        displacements = np.nan_to_num(self.bodies.displacements(state), posinf=0.0, neginf=0.0)
        self._x = self.bodies.X + self._shift + displacements
        self._pressed, self.near = None, self._search.facets_meet(self._x, BEYOND)
        if self.near:
            inside = self._search.points_inside(self._x)
            if len(inside):
                self._pressed = Pressed.of(self.bodies, inside, self._x)

    @property
    def pressed_points(self) -> Pressed:
        """Points in contact at the state of `look`."""
        assert self._pressed is not None
        return self._pressed

    @property
    def is_touching(self) -> bool:
        """Whether any surfaces meet at the state of `look`."""
        return self._pressed is not None

    @property
    def penetration(self) -> float:
        """Deepest penetration at the state of `look`, relative to the size of the facets, sought down to `BEYOND`."""
        if not self.near:
            return 0.0
        inside = self._search.points_inside(self._x, BEYOND)
        return float(np.max(inside.depth / self.bodies.size[inside.facet], initial=0.0))

    def places(self, facet: Ints, point: Ints) -> Array:
        """Return the positions of quadrature points of facets at the state of `look`, mm, shape (p, d).

        Parameters
        ----------
        facet : shape (p,)
            Numbers of soft facets.
        point : shape (p,)
            Numbers of quadrature points within each facet.
        """
        xi, _ = self.bodies.points
        shape = self.bodies.basis.values(xi)[point]
        return np.asarray(np.einsum("pn,pnd->pd", shape, self._x[self.bodies.facets[facet]]))

    def energy(self) -> float:
        """Return the energy, N mm."""
        return self._modulus * self.pressed_points.energy() if self.is_touching else 0.0

    def add_forces(self, forces: Array) -> None:
        """Add the derivative of the energy to a vector over this rank's unknowns."""
        if self.is_touching:
            self._add(self._modulus * self.pressed_points.forces(), forces)

    def add_action(self, direction: Array, forces: Array) -> None:
        """Add the product of the second derivative and a direction.

        Parameters
        ----------
        direction : Array
            Change of this rank's unknowns, shape (n,).
        forces : Array
            Vector over this rank's unknowns, shape (n,), N for displacements; changed in place.
        """
        if self.is_touching:
            self._add_change(self.bodies.displacements(direction), forces)

    def add_slope(self, name: str, shear_rate: float, forces: Array) -> None:
        """Add the derivative of the forces by a parameter, on which the shear modulus may depend.

        Parameters
        ----------
        name : str
            Name of the parameter.
        shear_rate : float
            Derivative of the shear modulus by the parameter, MPa per unit of the parameter.
        forces : Array
            Vector over this rank's unknowns, shape (n,), N per unit of the parameter; changed in place.
        """
        if not self.is_touching:
            return
        self._add(shear_rate * self.pressed_points.forces(), forces)
        rate = None if self._moved is None else self._moved.rate(name)
        if rate is not None:
            self._add_change(self.bodies.expand(rate), forces)

    def blocks(self, positive: bool = False) -> tuple[Index, Array]:
        """Second derivative by the unknowns of each pair of facets in contact.

        Parameters
        ----------
        positive : bool
            Without the negative eigenvalues of each point's (`Pressed.positive_stiffness`).

        Returns
        -------
        unknowns : shape (b, n)
            Local numbers of the unknowns of both facets; -1 for those of rigid facets.
        values : shape (b, n, n)
            N/mm, the sum over the points of the pair.
        """
        inside = self.pressed_points.found
        # Points of a pair have the same unknowns: the matrix gets one block for all of them.
        pair = inside.facet * len(self.bodies.facets) + inside.other
        order = np.argsort(pair, kind="stable")
        starts = np.flatnonzero(np.diff(pair[order], prepend=-1))
        points = self._modulus * self.pressed_points.positive_stiffness() if positive else self._stiffness
        values = np.add.reduceat(points[order], starts, axis=0)
        return self._unknowns(self.pressed_points.nodes[order[starts]]), values

    def couplings(self) -> list[Index]:
        """Return blocks of unknowns, shape (b, n), that contact couples or may soon couple."""
        pairs = self._search.near(self._x)
        nodes = np.concatenate([self.bodies.facets[pairs[:, 0]], self.bodies.facets[pairs[:, 1]]], axis=1)
        return [self._unknowns(nodes), self.blocks()[0]]

    def fit_pattern(self, pattern: Pattern, matrix: Any, positive: bool) -> tuple[Pattern, Index, Array]:
        """Find the places of the second derivative in a pattern, and give the matrix another if it lacks room.

        Parameters
        ----------
        pattern : Pattern
            Couplings that the matrix has room for.
        matrix : PETSc.Mat
            The tangent; its pattern is changed if it lacks room.
        positive : bool
            As in `blocks`.

        Returns
        -------
        pattern : Pattern
            With room for the contact at the state of `look`.
        places, values : shape (b, n, n)
            Entries of the second derivative, for `Pattern.add`.
        """
        unknowns, values = self.blocks(positive)
        places = pattern.locate(unknowns)
        if np.any(places == MISSING):
            pattern = pattern.widen(self.couplings())
            pattern.shape(matrix)
            places = pattern.locate(unknowns)
        return pattern, places, values

    # -- pieces --------------------------------------------------------------------------------------------------

    @property
    def _modulus(self) -> float:
        return self._share * self.shear_modulus

    @property
    def _stiffness(self) -> Array:
        if self._blocks is None:
            self._blocks = self._modulus * self.pressed_points.stiffness()
        return self._blocks

    def _add(self, values: Array, forces: Array) -> None:
        np.add.at(forces, self.bodies.dofs, self.bodies.gather(self.pressed_points.nodes, values))

    def _add_change(self, change: Array, forces: Array) -> None:
        """Add the change of the forces due to a change of the nodes' positions (nodes, d)."""
        nodal_change = change[self.pressed_points.nodes]
        answer = np.einsum("pxy,py->px", self._stiffness, nodal_change.reshape(len(nodal_change), -1))
        self._add(answer.reshape(nodal_change.shape), forces)

    def _unknowns(self, nodes: Ints) -> Index:
        """Unknowns of nodes (p, m), shape (p, m d); -1 for those of rigid facets."""
        unknowns = np.where(
            (nodes < self._free)[..., None], self.bodies.dofs[np.minimum(nodes, self._free - 1)], -1
        )
        return np.ascontiguousarray(unknowns.reshape(len(nodes), -1), dtype=np.int32)


def contact_of(mesh: NamedMesh, space: Any, mode: Mode, stress_free: StressFree | None) -> Contact | None:
    """Return the contact of a bushing's surfaces; None if none of them can meet.

    Parameters
    ----------
    mesh, space, mode
        Mesh, space and mode of the model; the space is mixed, displacement first.
    stress_free
        Where the stress-free body is; None where it is the mesh.
    """
    if mode.specimen != "bushing" or not mesh.shape.contact_surfaces:
        return None
    if mesh.mesh.comm.size > 1:
        # Pairs of facets on different ranks have no place in a distributed matrix yet: docs/contact.md says so.
        return None
    bonds = [*mode.driven, *mode.held]
    outside = exterior(mesh)
    free = np.setdiff1d(outside, facets_of(mesh, bonds))
    if not len(free):
        return None
    # The half-plane has two coordinates; a twist, the component between them, moves no surface.
    count = space.sub(0).num_sub_spaces
    components = (0, count - 1) if mesh.dimension == 2 else (0, 1, 2)
    surface = patch(mesh, space, free, components)
    strips = []
    drawn = {name: mesh.shape.beyond.get(name) for name in bonds}
    for name in bonds if mesh.shape.contact_surfaces == "sleeves" else [n for n in bonds if drawn[n]]:
        bonded = on_region(mesh, np.intersect1d(facets_of(mesh, [name]), outside), "rubber")
        bond_strip = strip(mesh, space, bonded, surface, components, drawn[name])
        if bond_strip is not None:
            strips.append(bond_strip)
    return Contact(surface, strips, mesh.dimension == 2, stress_free, mirror_planes(mesh, surface))


def _surroundings(free: Patch, strips: Sequence[RigidFacets], stress_free: StressFree) -> Surroundings | None:
    parts = []
    for cells, where in ((free.cells, free.where), *((s.anchors.cells, s.anchors.where) for s in strips)):
        points = stress_free.at(cells, free.points)
        if points is None:
            return None
        parts.append((points, where))
    return Surroundings(parts)
