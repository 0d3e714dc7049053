"""One block of quadrilaterals over a section with four sides: bond, free end, bond, free end.

The block is blended from its sides (Coons); where that makes an element too skew, triangles are used instead.

References
----------
Gordon and Hall (1973), Construction of curvilinear co-ordinate systems and applications to mesh generation, Int. J.
Numer. Methods Eng. 7:461-477, doi:10.1002/nme.1620070405.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from geometry.blocks import Array, Interval
from geometry.raw import QUADRANGLE9, Ints, RawMesh
from geometry.section.draw import Drawn
from geometry.section.outline import RUBBER
from geometry.session import model
from geometry.shape import Refinement

#: Elements across (half-plane, solid), longest over shortest across and along, length over width in the interior.
ACROSS, GRADING, LONG = (6, 4), (2.0, 4.0), 1.5
#: Least sine of the angles at the corners of an element.
LEAST_SINE = 0.35
#: Number of points along each curve of a side.
POINTS = 400


@dataclass(frozen=True)
class _Side:
    """A side of the block: its name, points along it (n, 2) and the shares of its length where it bends."""

    name: str
    points: Array
    bends: tuple[float, ...]

    def at(self, shares: Array) -> Array:
        """Points at shares of the length."""
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        positions = np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
        return np.column_stack([np.interp(shares, positions, self.points[:, k]) for k in range(2)])

    @property
    def length(self) -> float:
        """Length of the side, mm."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())


def block(drawn: Drawn, refinement: Refinement, solid: bool) -> RawMesh | None:
    """Return the mesh of a section with four sides; None for any other, or if an element would be too skew.

    Parameters
    ----------
    drawn
        The section, or its half above z = 0.
    refinement
        Elements of the whole bushing; "along" counts both halves.
    solid
        Whether it will be revolved, for which there are fewer elements.
    """
    if set(drawn.regions) != {RUBBER} or len(drawn.regions[RUBBER]) != 1:
        return None
    sides = _sides(drawn)
    if sides is None:
        return None
    inner, top, outer, bottom = sides
    half = bottom.name == "mirror_z"
    across = refinement.elements(refinement.across, ACROSS[1 if solid else 0])
    width = 0.5 * (top.length + bottom.length) / across
    along = max(2, math.ceil(0.5 * (inner.length + outer.length) / (LONG * width)))
    if refinement.along is not None:
        along = max(1, math.ceil(refinement.elements(refinement.along, 1) / (2 if half else 1)))
    s = _graded_shares(across, GRADING[0], "both")
    t = _graded_shares(along, GRADING[1], "stop" if half else "both")
    points = _transfinite_nodes(inner, top, outer, bottom, s, t)
    raw = _quadrilaterals(points, {"bottom": bottom.name, "top": top.name})
    return raw if _sound(points) else None


def _graded_shares(elements: int, grading: float, fine: str) -> Array:
    """Shares of corners and mid-side nodes."""
    corners = Interval(0.0, 1.0, elements, grading, fine).vertices()  # type: ignore[arg-type]
    return np.sort(np.concatenate([corners, 0.5 * (corners[1:] + corners[:-1])]))


def _snap_to_bends(shares: Array, bends: tuple[float, ...]) -> Array:
    """Move corners of elements to where a side bends; the mid-side nodes stay in the middle."""
    corners = shares[::2].copy()
    for bend in bends:
        nearest = int(np.argmin(np.abs(corners[1:-1] - bend))) + 1 if len(corners) > 2 else 0
        if nearest:
            corners[nearest] = bend
    if np.any(np.diff(corners) <= 0):
        return shares
    snapped = np.empty_like(shares)
    snapped[::2], snapped[1::2] = corners, 0.5 * (corners[1:] + corners[:-1])
    return snapped


def _transfinite_nodes(inner: _Side, top: _Side, outer: _Side, bottom: _Side, s: Array, t: Array) -> Array:
    """Nodes, shape (len(s), len(t), 2): s from the inner to the outer bond, t upward."""
    left, right = (side.at(_snap_to_bends(t, side.bends)) for side in (inner, outer))
    below, above = (side.at(_snap_to_bends(s, side.bends)) for side in (bottom, top))
    a, b = s[:, None, None], t[None, :, None]
    corners = (
        (1 - a) * (1 - b) * left[0] + a * (1 - b) * right[0] + (1 - a) * b * left[-1] + a * b * right[-1]
    )
    return np.asarray(
        (1 - a) * left[None] + a * right[None] + (1 - b) * below[:, None] + b * above[:, None] - corners
    )


def _sides(drawn: Drawn) -> tuple[_Side, _Side, _Side, _Side] | None:
    """Inner bond (upward), top (outward), outer bond (upward), bottom (outward); None where there are not four."""
    names = {tag: name for name, tags in drawn.boundaries.items() for tag in tags}
    face = drawn.regions[RUBBER][0]
    loop = [int(tag) for _, tag in model().getBoundary([(2, face)], oriented=True)]
    if len({abs(tag) for tag in loop}) != len(names) or len(loop) < 4:
        return None
    start = next(
        (i for i in range(len(loop)) if names[abs(loop[i])] == "inner" != names[abs(loop[i - 1])]), None
    )
    if start is None:
        return None
    loop = loop[start:] + loop[:start]
    groups: list[tuple[str, list[int]]] = []
    for tag in loop:
        name = names[abs(tag)]
        if not groups or groups[-1][0] != name:
            groups.append((name, []))
        groups[-1][1].append(tag)
    if len(groups) != 4 or [groups[0][0], groups[2][0]] != ["inner", "outer"]:
        return None
    inner, end, outer, other_end = _orient_sides([_side_along(name, tags) for name, tags in groups])
    if inner.points[0, 1] > inner.points[-1, 1]:
        # Round the other way: downward inside, outward below, upward outside, inward above.
        return _reverse(inner), _reverse(other_end), outer, end
    return inner, end, _reverse(outer), _reverse(other_end)


def _side_along(name: str, tags: list[int]) -> _Side:
    parts: list[Array] = []
    lengths: list[float] = []
    for tag in tags:
        low, high = (float(bound[0]) for bound in model().getParametrizationBounds(1, abs(tag)))
        shares = np.linspace(low, high, POINTS)
        points = np.array(model().getValue(1, abs(tag), shares.tolist())).reshape(-1, 3)[:, :2]
        points = points if tag > 0 else points[::-1]
        if parts and np.linalg.norm(parts[-1][-1] - points[0]) > np.linalg.norm(parts[-1][-1] - points[-1]):
            points = points[::-1]
        parts.append(points)
        lengths.append(float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()))
    ends = np.cumsum(lengths)[:-1] / sum(lengths)
    return _Side(name, np.concatenate(parts), tuple(float(end) for end in ends))


def _orient_sides(sides: list[_Side]) -> list[_Side]:
    """Turn each side so that it ends where the next one is: the signs of a cut face's curves are not reliable."""

    def distance_to_end(point: Array, other_side: _Side) -> float:
        return float(np.linalg.norm(other_side.points[[0, -1]] - point, axis=1).min())

    return [
        side
        if distance_to_end(side.points[-1], next_side) <= distance_to_end(side.points[0], next_side)
        else _reverse(side)
        for side, next_side in zip(sides, [*sides[1:], sides[0]], strict=True)
    ]


def _reverse(side: _Side) -> _Side:
    return _Side(side.name, side.points[::-1], tuple(1.0 - bend for bend in side.bends[::-1]))


def _sound(points: Array) -> bool:
    """Whether no corner of an element is folded or too acute."""
    corners = points[::2, ::2]
    for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)):
        corner = corners[i : i + corners.shape[0] - 1, j : j + corners.shape[1] - 1]
        right = corners[1 - i : 1 - i + corners.shape[0] - 1, j : j + corners.shape[1] - 1] - corner
        up = corners[i : i + corners.shape[0] - 1, 1 - j : 1 - j + corners.shape[1] - 1] - corner
        area = right[..., 0] * up[..., 1] - right[..., 1] * up[..., 0]
        sine = area / (np.linalg.norm(right, axis=-1) * np.linalg.norm(up, axis=-1))
        if np.any((sine if i == j else -sine) < LEAST_SINE):
            return False
    return True


def _quadrilaterals(points: Array, ends: dict[str, str]) -> RawMesh:
    """Second-order quadrilaterals over a grid of corners and mid-side nodes."""
    m, n = points.shape[:2]
    number = np.arange(m * n).reshape(m, n)
    i, j = np.meshgrid(np.arange(0, m - 1, 2), np.arange(0, n - 1, 2), indexing="ij")
    i, j = i.ravel(), j.ravel()
    # Gmsh's order: corners, middles of the sides, centre.
    places = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1))
    cells = np.stack([number[i + a, j + b] for a, b in places], axis=1)

    def along(line: Ints) -> Ints:
        return np.stack([line[:-1:2], line[2::2], line[1::2]], axis=1)

    facets = {"inner": along(number[0]), "outer": along(number[-1])}
    for name, line in ((ends["bottom"], number[:, 0]), (ends["top"], number[:, -1])):
        facets[name] = np.concatenate([facets[name], along(line)]) if name in facets else along(line)
    flat = np.column_stack([points.reshape(-1, 2), np.zeros(m * n)])
    return RawMesh(flat, QUADRANGLE9, {RUBBER: cells}, facets)
