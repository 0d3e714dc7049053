"""Blocks of a parametric shape: meshed in boxes by Gmsh, then every node is moved through the chart.

Runs inside a session that `geometry.mesh` has opened.
"""

from __future__ import annotations

import itertools

import numpy as np

from geometry.blocks import Array, Blocks, Interval


def mesh_blocks(blocks: Blocks, order: int) -> dict[int, dict[str, int]]:
    """Mesh the box in units of one element, map the nodes through vertices and chart, name the entities.

    Parameters
    ----------
    blocks : Blocks
        The parameter box with its chart.
    order : int
        Order of the cells, 1 or 2.
    """
    from gmsh import model

    dimension = len(blocks.axes)
    # One unit of the index box is one element; `vertices` maps indices to parameters, linearly inside an
    # element, so that mid-side nodes stay in the middle of graded elements.
    vertices = [positions(axis) for axis in blocks.axes]
    breaks = [np.cumsum([0, *(interval.elements for interval in axis)]) for axis in blocks.axes]
    solids = []
    for index in itertools.product(*(range(len(axis)) for axis in blocks.axes)):
        low = np.array([breaks[a][i] for a, i in enumerate(index)], dtype=float)
        high = np.array([breaks[a][i + 1] for a, i in enumerate(index)], dtype=float)
        name = blocks.region(parameters(0.5 * (low + high), vertices))
        if name is None:
            continue
        size = high - low
        if dimension == 2:
            solids.append((2, model.occ.addRectangle(*low, 0.0, *size)))
        else:
            solids.append((3, model.occ.addBox(*low, *size)))
    if len(solids) > 1:
        model.occ.fragment(solids[:1], solids[1:])
    model.occ.synchronize()
    names = {
        dimension: _name_regions(blocks, vertices, dimension),
        dimension - 1: _name_faces(blocks, vertices, dimension),
    }
    for _, curve in model.getEntities(1):
        box = np.array(model.getBoundingBox(1, curve))
        model.mesh.setTransfiniteCurve(curve, round(float(np.max(box[3:] - box[:3]))) + 1)
    for _, surface in model.getEntities(2):
        model.mesh.setTransfiniteSurface(surface)
        model.mesh.setRecombine(2, surface)
    for _, volume in model.getEntities(3):
        model.mesh.setTransfiniteVolume(volume)
    model.mesh.generate(dimension)
    # A mesh of order 2 has curved elements whose nodes all lie on the chart.
    model.mesh.setOrder(order)
    tags, coordinates, _ = model.mesh.getNodes()
    indices = coordinates.reshape(-1, 3)[:, :dimension]
    points = np.zeros((len(tags), 3))
    points[:, :dimension] = blocks.chart(parameters(indices, vertices))
    for tag, point in zip(tags, points, strict=True):
        model.mesh.setNode(tag, point, [])
    if blocks.closed:
        model.mesh.removeDuplicateNodes()
    return names


def positions(axis: tuple[Interval, ...]) -> Array:
    """Return the vertices of all elements along an axis, in parameters, shape (elements + 1,)."""
    return np.concatenate([axis[0].vertices(), *(interval.vertices()[1:] for interval in axis[1:])])


def parameters(indices: Array, vertices: list[Array]) -> Array:
    """Return the parameters, (n, d), of places given in numbers of elements.

    Parameters
    ----------
    indices : shape (n, d)
        Numbers of elements from the start of each axis; halves are the middles of elements.
    vertices : list of Array
        Vertices of each axis, shape (elements + 1,), as `positions` returned them.
    """
    columns = [np.interp(indices[..., a], np.arange(len(p)), p) for a, p in enumerate(vertices)]
    return np.stack(columns, axis=-1)


def _middle(dimension: int, tag: int, vertices: list[Array]) -> tuple[Array, Array]:
    """Extent (in elements) and midpoint (in parameters) of an entity."""
    from gmsh import model

    box = np.array(model.getBoundingBox(dimension, tag)).reshape(2, 3)[:, : len(vertices)]
    return box[1] - box[0], parameters(box.mean(axis=0), vertices)


def _name_regions(blocks: Blocks, vertices: list[Array], dimension: int) -> dict[str, int]:
    from gmsh import model

    members: dict[str, list[int]] = {}
    for _, tag in model.getEntities(dimension):
        name = blocks.region(_middle(dimension, tag, vertices)[1])
        assert name is not None
        members.setdefault(name, []).append(tag)
    return {name: model.addPhysicalGroup(dimension, tags, name=name) for name, tags in members.items()}


def _name_faces(blocks: Blocks, vertices: list[Array], dimension: int) -> dict[str, int]:
    from gmsh import model

    ends = [(p[0], p[-1]) for p in vertices]
    members: dict[str, list[int]] = {}
    for _, tag in model.getEntities(dimension - 1):
        if len(model.getAdjacencies(dimension - 1, tag)[0]) != 1:
            continue
        extent, middle = _middle(dimension - 1, tag, vertices)
        axis = int(np.argmin(extent))
        if blocks.closed and axis == 1 and np.isclose(middle[1], ends[1]).any():
            continue
        name = blocks.face(axis, middle)
        if name is not None:
            members.setdefault(name, []).append(tag)
    return {name: model.addPhysicalGroup(dimension - 1, tags, name=name) for name, tags in members.items()}
