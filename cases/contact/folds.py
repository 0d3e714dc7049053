"""Pairs of facets so near to each other along the surface that the mesh cannot resolve a fold between them.

Where a compressed surface creases, it folds within one or two elements, however fine the mesh. The facets there
suddenly penetrate each other by half an element, and their contact would stop the march. Facets on the two walls of a
slot are as near to each other at its bottom, but they face each other in the undeformed body, and their contact is
kept.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cases.contact.bodies import Bodies
from cases.contact.surface import MAYBE, normals

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def folds(bodies: Bodies) -> tuple[Ints, Ints]:
    """Return the facets that each soft facet does not meet: those that share a node with it, and their neighbours.

    Parameters
    ----------
    bodies : Bodies
        The surfaces.

    Returns
    -------
    start : shape (soft + 1,)
        Where the numbers of each facet begin in `others`.
    others : shape (n,)
        Numbers of facets, sorted for each facet.
    """
    soft_nodes: list[list[int]] = [[int(node) for node in nodes] for nodes in bodies.facets[: bodies.soft]]
    facets_of_node: dict[int, set[int]] = {}
    for facet, nodes in enumerate(soft_nodes):
        for node in nodes:
            facets_of_node.setdefault(node, set()).add(facet)
    first_ring: list[set[int]] = [
        set().union(*(facets_of_node[node] for node in nodes)) for nodes in soft_nodes
    ]
    second_ring = [sorted(set().union(*(first_ring[neighbour] for neighbour in ring))) for ring in first_ring]
    upright = _upright(bodies)
    rows = []
    for facet, ring in enumerate(second_ring):
        candidates = np.array(ring, dtype=np.int64)
        rows.append(candidates[upright[candidates] @ upright[facet] >= MAYBE])
    start = np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int64)
    return start, np.concatenate([np.zeros(0, dtype=np.int64), *rows])


def _upright(bodies: Bodies) -> Array:
    """Return the outward unit normals of the undeformed body at the centres of the soft facets."""
    basis, soft = bodies.basis, bodies.soft
    centre_slopes = basis.slopes(basis.nodes.mean(axis=0)[None])[0]
    slopes = np.einsum("an,fnd->fad", centre_slopes, bodies.X[bodies.facets[:soft]])
    directions = normals(slopes) * bodies.sign[:soft, None]
    return np.asarray(directions / np.linalg.norm(directions, axis=1)[:, None])
