"""Places in the rubber: cells of different meshes mapped onto one another, and parts that have a name."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from cases.local import Cells
from geometry.shape import Mirrors, Shape

Array = NDArray[np.float64]


def onto(cells: Cells, mirrors: Mirrors, host: Cells, cut: Mirrors) -> Array:
    """Matrix (cells, host's cells): the mean of a field on the host over each cell and its mirror images.

    The meshes of the cells and of the host are cut at the planes `mirrors` and `cut`.
    """
    flat = host.points.shape[1] == 2
    own, other = (_place_of(c, flat, mirrors | cut) for c in (cells, host))
    # Cells at the same place, round the axis or as mirror images, form one group.
    size = 1e-6 * float(np.ptp(host.points, axis=0).max())
    groups, member = np.unique(np.round(own / size), axis=0, return_inverse=True)
    tree = KDTree(groups * size)
    weight = np.zeros((len(groups), len(host.volume)))
    weight[tree.query(other)[1], np.arange(len(host.volume))] = host.volume
    # If the host's cells are larger than the channel's, the nearest one is taken.
    empty = np.flatnonzero(weight.sum(axis=1) == 0)
    weight[empty, KDTree(other).query(groups[empty] * size)[1]] = 1.0
    return np.asarray((weight / weight.sum(axis=1, keepdims=True))[member.ravel()])


def _place_of(cells: Cells, flat: bool, mirrors: Mirrors) -> Array:
    """Return the centres of the cells, (R, Z) or (x, y, z), with mirror images folded onto one another."""
    # The mean radius of the corners: the radius of their mean would change with the angle that a cell covers.
    centres = (_section(cells.points) if flat else cells.points)[cells.corners].mean(axis=1)
    names = "rz" if flat else "xyz"
    for plane in mirrors & set(names):
        centres[:, names.index(plane)] = np.abs(centres[:, names.index(plane)])
    return np.asarray(centres)


def _section(points: Array) -> Array:
    """(R, Z) of points in the half-plane or in space."""
    return np.column_stack([np.linalg.norm(points[:, :-1], axis=1), points[:, -1]])


def thickness(cells: Cells) -> float:
    """Thickness of the rubber along the radius, mm."""
    return float(np.ptp(_section(cells.points)[:, 0]))


def zones(cells: Cells, mirrors: Mirrors, shape: Shape) -> tuple[list[str], Array]:
    """Names of parts of the rubber, and which cells (m, k) belong to each."""
    radius, height = _place_of(cells, True, frozenset()).T
    corners = _section(cells.points)
    across = (radius - corners[:, 0].min()) / thickness(cells)
    end = float(np.abs(corners[:, 1]).max())
    bonded = shape.wall is not None
    inside, between, outside = (
        ("near the inner bond", "between the bonds", "near the outer bond")
        if bonded
        else ("near the bore", "in the middle", "near the flank")
    )
    rings = {inside: across < 1 / 3, between: (across >= 1 / 3) & (across <= 2 / 3), outside: across > 2 / 3}
    if "z" in mirrors:
        parts = {"about mid-length": height < 0.5 * end, "towards the ends": height >= 0.5 * end}
    else:
        third = f"{end / 3:.3g} mm"
        parts = {
            f"at the lower end (z < -{third})": height < -end / 3,
            "about mid-length": np.abs(height) <= end / 3,
            f"at the upper end (z > {third})": height > end / 3,
        }
    pairs = {
        f"{ring} {part}": a & b for ring, a in rings.items() for part, b in parts.items() if (a & b).any()
    }
    return list(pairs), np.array(list(pairs.values()), dtype=float).T
