"""Blocks of a parametric shape: meshed in boxes by Gmsh, then every node is moved through the chart.

Runs inside a session that `geometry.mesh` has opened.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from geometry.blocks import Array, Blocks


def mesh_blocks(blocks: Blocks, order: int) -> dict[int, dict[str, int]]:
    """Mesh the box in units of one element, move the nodes through vertices and chart, name the entities.

    Parameters
    ----------
    blocks : Blocks
        The parameter box with its chart.
    order : int
        Order of the cells, 1 or 2.
    """
    from gmsh import model

    dimension = len(blocks.axes)
    # One unit of the index box is one element; `positions` maps indices to parameters, linearly inside an
    # element, so that mid-side nodes stay in the middle of graded elements.
    positions = [_positions(axis) for axis in blocks.axes]
    breaks = [np.cumsum([0, *(interval.elements for interval in axis)]) for axis in blocks.axes]
    solids = []
    for index in itertools.product(*(range(len(axis)) for axis in blocks.axes)):
        low = np.array([breaks[a][i] for a, i in enumerate(index)], dtype=float)
        high = np.array([breaks[a][i + 1] for a, i in enumerate(index)], dtype=float)
        name = blocks.region(_parameters(0.5 * (low + high), positions))
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
        dimension: _name_regions(blocks, positions, dimension),
        dimension - 1: _name_faces(blocks, positions, dimension),
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
    points[:, :dimension] = blocks.chart(_parameters(indices, positions))
    for tag, point in zip(tags, points, strict=True):
        model.mesh.setNode(tag, point, [])
    if blocks.closed:
        model.mesh.removeDuplicateNodes()
    return names


def _positions(axis: tuple[Any, ...]) -> Array:
    return np.concatenate([axis[0].vertices(), *(interval.vertices()[1:] for interval in axis[1:])])


def _parameters(indices: Array, positions: list[Array]) -> Array:
    columns = [np.interp(indices[..., a], np.arange(len(p)), p) for a, p in enumerate(positions)]
    return np.stack(columns, axis=-1)


def _middle(dimension: int, tag: int, positions: list[Array]) -> tuple[Array, Array]:
    """Extent (in elements) and midpoint (in parameters) of an entity."""
    from gmsh import model

    box = np.array(model.getBoundingBox(dimension, tag)).reshape(2, 3)[:, : len(positions)]
    return box[1] - box[0], _parameters(box.mean(axis=0), positions)


def _name_regions(blocks: Blocks, positions: list[Array], dimension: int) -> dict[str, int]:
    from gmsh import model

    members: dict[str, list[int]] = {}
    for _, tag in model.getEntities(dimension):
        name = blocks.region(_middle(dimension, tag, positions)[1])
        assert name is not None
        members.setdefault(name, []).append(tag)
    return {name: model.addPhysicalGroup(dimension, tags, name=name) for name, tags in members.items()}


def _name_faces(blocks: Blocks, positions: list[Array], dimension: int) -> dict[str, int]:
    from gmsh import model

    ends = [(p[0], p[-1]) for p in positions]
    members: dict[str, list[int]] = {}
    for _, tag in model.getEntities(dimension - 1):
        if len(model.getAdjacencies(dimension - 1, tag)[0]) != 1:
            continue
        extent, middle = _middle(dimension - 1, tag, positions)
        axis = int(np.argmin(extent))
        if blocks.closed and axis == 1 and np.isclose(middle[1], ends[1]).any():
            continue
        name = blocks.face(axis, middle)
        if name is not None:
            members.setdefault(name, []).append(tag)
    return {name: model.addPhysicalGroup(dimension - 1, tags, name=name) for name, tags in members.items()}
