"""The part of a solid that remains after cutting at all planes of symmetry, with the names of its faces."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from geometry.blocks import Array
from geometry.cad.find_part import FoundPart
from geometry.session import model

#: A face lies in a plane if its points are no farther from it than this share of the file's largest extent.
FLAT = 1e-6
Faces = dict[str, dict[int, int]]
"""Boundary -> face of the cut part -> face of the whole one; 0 in a plane of symmetry."""


def cut(part: FoundPart) -> tuple[dict[str, tuple[int, ...]], Faces]:
    """Keep only the meshed solids of the open part, and of these the piece at positive coordinates.

    Returns
    -------
    regions
        Name -> solids.
    boundaries
        Name -> faces, each with the face of the whole part that it is a piece of.
    """
    occ = model().occ
    rigid = [(3, tag) for tag in part.roles if tag not in part.meshed]
    if rigid:
        occ.remove(rigid, recursive=True)
        occ.synchronize()
    if not part.planes:
        regions: dict[str, tuple[int, ...]] = {}
        for tag in part.meshed:
            regions[part.roles[tag]] = (*regions.get(part.roles[tag], ()), tag)
        boundaries: Faces = {}
        for face, name in part.labels.items():
            boundaries.setdefault(name, {})[face] = face
        return regions, boundaries
    originals = {face: occ.copy([(2, face)])[0][1] for face in part.labels}
    solids = [(3, tag) for tag in part.meshed]
    half_size = 2.0 * float(np.abs(np.array(model().getBoundingBox(-1, -1))).max()) + 1.0
    planes = [(2, _plane(part, "xyz".index(plane), half_size)) for plane in sorted(part.planes)]
    _, fragments = occ.fragment(solids, planes)
    occ.synchronize()
    regions = _kept_regions(part, fragments)
    labelled = _boundaries(part, regions, originals)
    occ.remove([(2, tag) for tag in originals.values()], recursive=True)
    used_faces = {
        tag
        for solids in regions.values()
        for s in solids
        for _, tag in model().getBoundary([(3, s)], oriented=False)
    }
    occ.remove([(2, t) for _, t in model().getEntities(2) if t not in used_faces], recursive=True)
    occ.synchronize()
    return regions, labelled


def _plane(part: FoundPart, component: int, half_size: float) -> int:
    """A large square in a plane of symmetry."""
    occ = model().occ
    a, b = (i for i in range(3) if i != component)
    corners = np.zeros((4, 3))
    corners[:, a] = [-half_size, half_size, half_size, -half_size]
    corners[:, b] = [-half_size, -half_size, half_size, half_size]
    points = [occ.addPoint(*p) for p in part.frame.in_file(corners)]
    lines = [occ.addLine(points[i], points[(i + 1) % 4]) for i in range(4)]
    return int(occ.addPlaneSurface([occ.addCurveLoop(lines)]))


def _kept_regions(part: FoundPart, fragments: list[list[tuple[int, int]]]) -> dict[str, tuple[int, ...]]:
    """Return the solids at positive coordinates, by region, and remove the others."""
    occ = model().occ
    components = ["xyz".index(plane) for plane in part.planes]
    regions: dict[str, tuple[int, ...]] = {}
    for tag, pieces in zip(part.meshed, fragments, strict=False):
        for dimension, piece in pieces:
            if dimension != 3:
                continue
            centre = part.frame.local(np.array([occ.getCenterOfMass(3, piece)]))[0]
            if np.all(centre[components] > 0):
                role = part.roles[tag]
                regions[role] = (*regions.get(role, ()), int(piece))
            else:
                occ.remove([(3, piece)], recursive=True)
    occ.synchronize()
    return regions


def _boundaries(
    part: FoundPart, regions: Mapping[str, tuple[int, ...]], originals: Mapping[int, int]
) -> Faces:
    """Name the outer faces: after the plane of symmetry that contains them, else after the face they were cut from."""
    count: dict[int, int] = {}
    for solids in regions.values():
        for solid in solids:
            for _, face in model().getBoundary([(3, solid)], oriented=False):
                count[int(face)] = count.get(int(face), 0) + 1
    boxes = {face: np.array(model().getBoundingBox(2, copy)) for face, copy in originals.items()}
    boundaries: Faces = {}
    for face, times in count.items():
        if times != 1:
            continue
        points = _inner_points(face)
        local = part.frame.local(points)
        distances = dict(zip("xyz", np.abs(local).max(axis=0), strict=True))
        plane = next((p for p in sorted(part.planes) if distances[p] < FLAT * part.size), None)
        if plane is not None:
            boundaries.setdefault(f"mirror_{plane}", {})[face] = 0
        else:
            origin = _origin(points, originals, boxes)
            boundaries.setdefault(part.labels[origin], {})[face] = origin
    return boundaries


def _inner_points(face: int) -> Array:
    """A few points on a face, away from its edges where there are any."""
    low, high = (np.array(bound) for bound in model().getParametrizationBounds(2, face))
    for count in (4, 12, 60):
        shares = (np.arange(count) + 0.5) / count
        grid = np.stack(np.meshgrid(*[a + shares * (b - a) for a, b in zip(low, high, strict=True)]), axis=-1)
        inside = [uv for uv in grid.reshape(-1, 2).tolist() if model().isInside(2, face, uv, parametric=True)]
        if len(inside) >= 3:
            chosen = [inside[i] for i in np.unique(np.linspace(0, len(inside) - 1, 5).round().astype(int))]
            return np.array(model().getValue(2, face, np.ravel(chosen).tolist())).reshape(-1, 3)
    return np.array([model().occ.getCenterOfMass(2, face)])


def _origin(points: Array, originals: Mapping[int, int], boxes: Mapping[int, Array]) -> int:
    """Return the face of the whole part on which all these points lie."""
    occ = model().occ
    spots = [occ.addPoint(*p) for p in points]
    margin = 1e-3 * max(float(np.ptp(box.reshape(2, 3), axis=0).max()) for box in boxes.values())
    best, least = 0, np.inf
    for face, copy in originals.items():
        box = boxes[face].reshape(2, 3)
        if np.any(points < box[0] - margin) or np.any(points > box[1] + margin):
            continue
        distance = max(float(occ.getDistance(0, point, 2, copy)[0]) for point in spots)
        if distance < least:
            best, least = face, distance
    occ.remove([(0, point) for point in spots])
    return best
