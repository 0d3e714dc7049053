"""Rigid sleeves beyond the bond: each continues from the edges of the bond along its tangent.

A sleeve that is not meshed is known only by its bond. Without a continuation, rubber that bulges over the bond's edge
would enter the metal. The continuation moves with the bond: its nodes are affine combinations of four of the bond's
nodes, which is exact for a rigid motion. The force on it is thus part of the reactions, and its derivatives part of
theirs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cases.contact.facets import Basis
from cases.contact.surface import Patch, normals, patch
from geometry.mesh import NamedMesh

# A tangent of a bond leads along the axis if its axial part is at least this; at a corner of a bond it is 0.7.
ALONG = 0.5
# A continuation that is shorter than this share of the bushing is none.
NEGLIGIBLE = 1e-6

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Anchors:
    """Nodes of a bond: unknowns (k, d), and the cells that have the nodes, as in `Patch`."""

    dofs: Ints
    where: Ints
    cells: NDArray[np.int32]


@dataclass(frozen=True)
class RigidFacets:
    """Rigid facets.

    Attributes
    ----------
    facets : shape (f, n)
        Numbers of the strip's own nodes.
    sign : shape (f,)
        As in `Patch`; the normal points to where the rubber is.
    X : shape (nodes, d)
        Coordinates of the nodes, mm.
    anchors : Anchors
        Nodes of the bond.
    weights : shape (nodes, k)
        Displacement of a node by those of the anchors.
    name : str
        Name of the bond.
    """

    facets: Ints
    sign: Array
    X: Array
    anchors: Anchors
    weights: Array
    name: str


def strip(
    mesh: NamedMesh,
    space: Any,
    bonded: Ints,
    free: Patch,
    components: tuple[int, ...],
    drawn: tuple[float, float] | None = None,
) -> RigidFacets | None:
    """Return the continuation of a bond beyond its edges; None if nothing continues there.

    Parameters
    ----------
    mesh, space, components
        As in `patch`.
    bonded
        Numbers of the bond's facets.
    free
        The free facets of the mesh.
    drawn
        Lengths by which the sleeve continues below and above the bond, mm; None where they are not known.
    """
    if not len(bonded):
        return None
    bond = patch(mesh, space, bonded, components)
    edges = _edges(bond, free)
    # Rubber that flows out of the gap between two sleeves goes no further than this.
    length = 0.5 * float(np.ptp(bond.X, axis=0).max() + np.ptp(free.X, axis=0).max())
    order = int(bond.basis.powers.max())
    directions = _directions(bond, edges)
    X, facets, sign = list[Array](), list[Ints](), list[float]()

    def add(corners: Array, outward: Array) -> None:
        facets.append(np.arange(len(corners)) + sum(map(len, X)))
        slope = np.einsum("an,nd->ad", bond.basis.slopes(bond.basis.nodes.mean(axis=0)[None])[0], corners)
        sign.append(-float(np.sign(normals(slope[None])[0] @ outward)))
        X.append(corners)

    for facet, nodes in edges:
        ways = length * np.array([directions[n] for n in nodes])
        if drawn is not None:
            ways = _along(ways, drawn)
        if not np.any(np.abs(ways) > NEGLIGIBLE * length):
            continue
        shares = np.linspace(0.0, 1.0, order + 1)[None, :, None]
        grid = bond.X[nodes][:, None, :] + shares * ways[:, None, :]
        outward = bond.sign[facet] * _middle(bond, facet)
        # Rubber may come to lie behind the bond too, where a corner folds.
        for corners in (*_cut(bond.basis, grid), bond.X[bond.facets[facet]]):
            add(corners, outward)
    if not X:
        return None
    places = np.concatenate(X)
    anchors, weights = _rigid_weights(bond.X, places)
    anchor_points = Anchors(bond.dofs[anchors], bond.where[anchors], bond.cells)
    return RigidFacets(np.array(facets), np.array(sign), places, anchor_points, weights, str(bond.names[0]))


def _along(ways: Array, drawn: tuple[float, float]) -> Array:
    """Continuation at an edge's nodes as far as a sleeve is drawn; zero where it bends around the axis instead."""
    length = float(np.linalg.norm(ways[0]))
    rise = float(ways[:, -1].mean()) / length
    directions = np.zeros_like(ways)
    if abs(rise) > ALONG:
        directions[:, -1] = np.sign(rise) * min(length, drawn[int(rise > 0.0)])
    return directions


def _edges(bond: Patch, free: Patch) -> list[tuple[int, Ints]]:
    """Facets of the bond, and their nodes on an edge that the bond shares with the free surface."""
    outside = {key for _, key, _ in _all_edges(free)}
    return [(facet, nodes) for facet, key, nodes in _all_edges(bond) if key in outside]


def _all_edges(of: Patch) -> list[tuple[int, frozenset[int], Ints]]:
    """Facet, unknowns that identify the edge, and nodes along it, for every edge of every facet."""
    edges = []
    for start, edge in dict.fromkeys((tuple(a), tuple(b)) for a, b in of.basis.edges):
        offsets = of.basis.nodes - np.array(start)
        t = offsets @ np.array(edge) / max(float(np.dot(edge, edge)), 1.0)
        on_edge = np.flatnonzero(np.linalg.norm(offsets - t[:, None] * np.array(edge), axis=1) < 1e-9)
        places = on_edge[np.argsort(t[on_edge])]
        for facet, nodes in enumerate(of.facets[:, places]):
            edges.append((facet, frozenset(map(int, of.dofs[nodes, 0])), nodes))
    return edges


def _directions(bond: Patch, edges: list[tuple[int, Ints]]) -> dict[int, Array]:
    """Unit tangent of the bond that leads out of it, at each node of its edges: the mean over the node's facets."""
    total: dict[int, Array] = {}
    for facet, nodes in edges:
        face_nodes = bond.facets[facet]
        centre = bond.X[face_nodes].mean(axis=0)
        for number, node in enumerate(nodes):
            xi = bond.basis.nodes[np.flatnonzero(face_nodes == node)]
            slope = np.einsum("an,nd->ad", bond.basis.slopes(xi)[0], bond.X[face_nodes])
            normal = normals(slope[None])[0]
            if len(nodes) == 1:
                tangent = slope[0]
            else:
                ends = bond.X[nodes[[max(number - 1, 0), min(number + 1, len(nodes) - 1)]]]
                tangent = np.cross(normal, ends[1] - ends[0])
            tangent = tangent * np.sign(tangent @ (bond.X[node] - centre)) / np.linalg.norm(tangent)
            total[int(node)] = total.get(int(node), np.zeros(len(tangent))) + tangent
    return {node: tangent / np.linalg.norm(tangent) for node, tangent in total.items()}


def _middle(bond: Patch, facet: int) -> Array:
    """Normal at the centre of a facet, with the sign that the order of its nodes gives."""
    slope = bond.basis.slopes(bond.basis.nodes.mean(axis=0)[None])[0]
    return normals(np.einsum("an,nd->ad", slope, bond.X[bond.facets[facet]])[None])[0]


def _cut(basis: Basis, grid: Array) -> list[Array]:
    """Facets of a strip between an edge's nodes, along the first axis, and their continuation along the second."""
    if basis.kind == "interval":
        return [grid[0]]
    last = len(grid) - 1
    i, j = basis.powers.T
    if basis.kind == "quadrilateral":
        return [grid[i, j]]
    return [grid[i, j], grid[last - i, last - j]]


def _rigid_weights(bond: Array, places: Array) -> tuple[Ints, Array]:
    """Nodes of a bond, and the weights that give a rigid motion of other points from that of these nodes."""
    d = bond.shape[1]
    if d == 2:
        # In the half-plane a sleeve moves along the axis alone.
        return np.zeros(1, dtype=np.int64), np.ones((len(places), 1))
    affine = np.column_stack([bond, np.ones(len(bond))])
    from scipy.linalg import qr  # takes 0.1 s: only where there is contact

    _, _, order = qr(affine.T, mode="economic", pivoting=True)
    anchors = order[: d + 1].astype(np.int64)
    homogeneous = np.column_stack([places, np.ones(len(places))])
    return anchors, np.asarray(np.linalg.solve(affine[anchors].T, homogeneous.T).T)
