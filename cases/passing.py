"""Checks whether surfaces pass through each other on a mesh shared by several processes, if contact is not modelled.

Pairs of facets of different processes have no place in a distributed matrix. The first process therefore makes the
whole mesh once more, takes over the displacements of all processes, and searches for surfaces that penetrate each other
at the states of the march and between them, as contact in one process does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from cases.model import FiniteElementModel
from geometry.dolfinx_api import collapse

Array = NDArray[np.float64]

# Largest motion of a node from one state that is searched to the next, over the breadth of the narrowest facet:
# penetration is sought down to more than this (`cases.contact.contact.BEYOND`).
STRIDE = 0.5
# Most states that are searched on the way from one state of the march to the next: a limit of the time, some ten
# milliseconds each, that only steps of 25 facets' breadth reach.
MOST_BETWEEN = 50


def passes_through(model: FiniteElementModel, states: Array, whole: Callable[[], FiniteElementModel]) -> bool:
    """Whether any surfaces penetrate each other at the states of a march, or on the way from one to the next.

    Parameters
    ----------
    model : FiniteElementModel
        Model whose mesh several processes share.
    states : Array
        This rank's unknowns, shape (steps, m), in mm for displacements.
    whole : callable
        Returns the same model on a mesh of one process; called on the first rank only.

    Returns
    -------
    bool
        The same on all ranks.
    """
    comm = model.mesh.mesh.comm
    parts = comm.gather(
        [(points, states[:, dofs]) for points, dofs in _displacements(model, owned=True)], root=0
    )
    penetrates = False
    if comm.rank == 0:
        whole_model = whole()
        contact = whole_model.surfaces.contact
        if contact is not None:
            contact.take(1.0)
            gathered = _whole_states(whole_model, parts, len(states))
            breadth = float(contact.bodies.breadth.min())
            for state in _intermediate_states(gathered, STRIDE * breadth):
                contact.look(state)
                penetrates = contact.penetration > 0.0
                if penetrates:
                    break
    return bool(comm.bcast(penetrates, root=0))


def _displacements(model: FiniteElementModel, owned: bool) -> Iterator[tuple[Array, NDArray[np.int32]]]:
    """Points (n, 3) and unknowns (n,) of each component of the displacement."""
    space = model.space.sub(0)
    for component in range(space.num_sub_spaces):
        subspace, dofs = collapse(space.sub(component))
        count = subspace.dofmap.index_map.size_local if owned else len(dofs)
        yield subspace.tabulate_dof_coordinates()[:count], dofs[:count]


def _whole_states(
    whole_model: FiniteElementModel, parts: list[list[tuple[Array, Array]]], steps: int
) -> Array:
    """Return all unknowns of the whole mesh, shape (steps, n): displacements of all ranks, zero pressures."""
    from scipy.spatial import cKDTree

    states = np.zeros((steps, len(whole_model.state.x.array)))
    for component, (points, dofs) in enumerate(_displacements(whole_model, owned=False)):
        theirs = np.vstack([part[component][0] for part in parts])
        values = np.hstack([part[component][1] for part in parts])
        states[:, dofs] = values[:, cKDTree(theirs).query(points)[1]]
    return states


def _intermediate_states(states: Array, stride: float) -> Iterator[Array]:
    """Yield the states, with intermediate states so that no unknown changes by more than one stride."""
    previous = np.zeros(states.shape[1])
    for state in states:
        count = int(np.clip(np.ceil(np.abs(state - previous).max() / stride), 1, MOST_BETWEEN))
        for share in np.arange(1, count + 1) / count:
            yield previous + share * (state - previous)
        previous = state
