"""Principal stretches that a deformed bushing reaches: for stability checks, pictures and field files."""

from __future__ import annotations

from dataclasses import dataclass

import basix
import numpy as np
from numpy.typing import NDArray

from cases.elements import QuadratureRule
from cases.model import FiniteElementModel
from cases.points import Points
from forms.setting import SETTINGS
from geometry.dolfinx_api import cell_nodes
from geometry.mesh import NamedMesh

Array = NDArray[np.float64]


def principal_stretches(
    model: FiniteElementModel, points: Array | None = None, region: str = "rubber"
) -> Array:
    """Principal stretches at the model's present state, on this rank.

    Parameters
    ----------
    model : FiniteElementModel
        The model, ready to be marched.
    points : Array | None
        Reference coordinates in the cell, shape (p, dimension); those of a quadrature of second degree if not given (of
        a quadrilateral two Gauss points in each direction), where a second-order element's strains are most accurate.
    region : str
        Name of the region.

    Returns
    -------
    Array
        Shape (cells, p, 3), in ascending order.
    """
    return stretches_at(stretch_points(model, points, region), model.state.x.array)


def stretch_points(model: FiniteElementModel, points: Array | None = None, region: str = "rubber") -> Points:
    """Points at which `principal_stretches` evaluates, for several states of a model.

    Parameters
    ----------
    model : FiniteElementModel
        The model, ready to be marched.
    points : Array | None
        Reference coordinates in the cell, shape (p, dimension); those of `principal_stretches` if not given.
    region : str
        Name of the region.
    """
    if points is not None:
        return _points(model, region, points)
    return _default_points(model, region)


def _default_points(model: FiniteElementModel, region: str) -> Points:
    """Return the default points, which are cached for each model and moved with it to another shape."""
    mesh = model.mesh
    degree = 2 if mesh.simplices else 3
    points, _ = basix.make_quadrature(mesh.mesh.basix_cell(), degree)
    if not all(installed.feature.of_rubber for installed in model.features):
        return _points(model, region, points)  # the stress-free body depends on the values of the effects
    of, sample_points = model.sampled.get(region) or (mesh, _points(model, region, points))
    if of is not mesh:
        sample_points.locate(mesh)
    model.sampled.put(region, (mesh, sample_points))
    return sample_points


def stretches_at(points: Points, x: Array) -> Array:
    """Principal stretches at points, shape (cells, p, 3), ascending, for a vector x of the unknowns of this rank.

    Parameters
    ----------
    points : Points
        The points, as `stretch_points` returned them.
    x : Array
        Unknowns of this rank, shape (n,): displacements in mm, pressures in MPa.
    """
    return np.asarray(np.sqrt(np.linalg.eigvalsh(metric_at(points, x))))


def metric_at(points: Points, x: Array) -> Array:
    """Right Cauchy-Green tensor at points, shape (cells, p, 3, 3), for a vector x of the unknowns of this rank.

    Parameters
    ----------
    points : Points
        The points, as `stretch_points` returned them.
    x : Array
        Unknowns of this rank, shape (n,): displacements in mm, pressures in MPa.
    """
    g = points.gradients(x).reshape(*points.shape, points.rows)
    rows = points.setting.deformation(list(np.moveaxis(g, -1, 0)))
    F = np.stack(
        [np.stack([np.broadcast_to(f, points.shape) for f in row], axis=-1) for row in rows], axis=-2
    )
    return np.asarray(np.swapaxes(F, -1, -2) @ F)


def _points(model: FiniteElementModel, region: str, points: Array) -> Points:
    """Points of a region's cells, the stress-free body in its present place."""
    rule, setting = QuadratureRule.at(points), SETTINGS[model.setting.kinematics]
    sample_points = Points(model.mesh, model.space, setting, model.cells(region), rule)
    moved_points = model.moved_points(region, rule)
    if moved_points is not None:
        sample_points.move(moved_points.now())
    return sample_points


@dataclass(frozen=True)
class Surface:
    """Faces for a picture of the bushing: four corners before and after, coloured by the largest stretch.

    Attributes
    ----------
    reference, deformed : shape (n, 4, 3)
        Corner coordinates in mm, corners in order around the face; counter-clockwise where a solid is seen from
        outside.
    stretch : shape (n, 4)
        Largest principal stretch at the corners (1 in a metal sleeve).
    rubber : shape (n,)
        Whether the face belongs to the rubber.
    displacement
        q of the picture, mm or rad.
    """

    reference: Array
    deformed: Array
    stretch: Array
    rubber: NDArray[np.bool_]
    displacement: float


# Corners of a face in order around it, as positions among the cell's corners (tensor-product numbering; a triangle
# repeats its last corner).
_TRIANGLE_FACES = ((0, 1, 2, 2),)
_TETRAHEDRON_FACES = ((0, 1, 2, 2), (0, 1, 3, 3), (0, 2, 3, 3), (1, 2, 3, 3))
_SECTION_FACES = ((0, 1, 3, 2),)
_SOLID_FACES = (
    (0, 1, 3, 2),
    (4, 5, 7, 6),
    (0, 1, 5, 4),
    (2, 3, 7, 6),
    (0, 2, 6, 4),
    (1, 3, 7, 5),
)


def surface(model: FiniteElementModel, displacement: float = 0.0) -> Surface | None:
    """The model's faces at its present state: every cell of a half-plane, the outside of a solid.

    Collective; the faces of all ranks on rank 0, None elsewhere.

    Parameters
    ----------
    model : FiniteElementModel
        The model, ready to be marched.
    displacement : float
        Generalised displacement of this state, mm or rad.
    """
    mesh = model.mesh
    dimension = mesh.dimension
    corners = basix.cell.geometry(mesh.mesh.basix_cell())
    faces = _faces(mesh)
    reference, deformed, stretch, rubber = [], [], [], []
    for name, tag in mesh.region.items():
        cells = mesh.cells.find(tag)
        if not len(cells):
            continue
        x, y = _corners(model, name, corners)
        largest = (
            principal_stretches(model, corners, name)[..., -1] if name == "rubber" else np.ones(x.shape[:2])
        )
        cell, order = _seen_from_outside(x, faces)
        reference.append(x[cell, order].reshape(-1, 4, 3))
        deformed.append(y[cell, order].reshape(-1, 4, 3))
        stretch.append(largest[cell, order].reshape(-1, 4))
        rubber.append(np.full(len(cells) * len(faces), name == "rubber"))
    parts = model.comm.gather((reference, deformed, stretch, rubber), root=0)
    if parts is None:
        return None
    reference, deformed, stretch, rubber = (
        np.concatenate([block for part in parts for block in part[i]]) for i in range(4)
    )
    keep = _is_outer(reference) if dimension == 3 else np.full(len(reference), True)
    return Surface(reference[keep], deformed[keep], stretch[keep], rubber[keep], displacement)


def mesh_surface(mesh: NamedMesh) -> Surface | None:
    """Return the faces of an undeformed mesh; collective, None except on rank 0."""
    dimension = mesh.dimension
    faces = _faces(mesh)
    reference, rubber = [], []
    for name, tag in mesh.region.items():
        # Corners come first among a cell's nodes, in tensor-product order.
        nodes = cell_nodes(mesh.mesh)[mesh.cells.find(tag)][:, : mesh.corners]
        x = mesh.mesh.geometry.x[nodes]
        if dimension == 2:
            x = x[..., [0, 2, 1]]
        reference.append(x[_seen_from_outside(x, faces)].reshape(-1, 4, 3))
        rubber.append(np.full(len(reference[-1]), name == "rubber"))
    parts = mesh.mesh.comm.gather((np.concatenate(reference), np.concatenate(rubber)), root=0)
    if parts is None:
        return None
    x, kind = (np.concatenate([part[i] for part in parts]) for i in range(2))
    keep = _is_outer(x) if dimension == 3 else np.full(len(x), True)
    return Surface(x[keep], x[keep], np.ones((int(keep.sum()), 4)), kind[keep], 0.0)


def _faces(mesh: NamedMesh) -> NDArray[np.int_]:
    """Faces of a cell to be drawn, shape (n, 4)."""
    if mesh.simplices:
        return np.array(_TRIANGLE_FACES if mesh.dimension == 2 else _TETRAHEDRON_FACES)
    return np.array(_SECTION_FACES if mesh.dimension == 2 else _SOLID_FACES)


def _seen_from_outside(x: Array, faces: NDArray[np.int_]) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Return indices of cells (n, 1, 1) and of their faces' corners (n, faces, 4), counter-clockwise seen from outside.

    Parameters
    ----------
    x : shape (n, corners, 3)
        Corner coordinates of each cell, mm.
    faces : shape (faces, 4)
        Corners of each face in order around it, in either sense.
    """
    corners = x[:, faces]
    normal = np.cross(corners[:, :, 2] - corners[:, :, 0], corners[:, :, 3] - corners[:, :, 1])
    outwards = np.einsum("nfi,nfi->nf", normal, corners.mean(axis=2) - x.mean(axis=1)[:, None])
    # A cell may be mirrored; the face of a half-plane's cell is the cell itself, and has no outside.
    order = np.where(outwards[..., None] < 0.0, faces[:, [1, 0, 3, 2]], faces)
    return np.arange(len(x))[:, None, None], order


def _corners(model: FiniteElementModel, region: str, corners: Array) -> tuple[Array, Array]:
    """Reference and deformed Cartesian corner coordinates, each (cells, corners, 3)."""
    points = _points(model, region, corners)
    x, u_ = points.coordinates, points.displacements(model.state.x.array)
    dimension = model.mesh.dimension
    if dimension == 3:
        return x, x + u_
    radius, height = x[..., 0], x[..., 1]
    zero = np.zeros_like(radius)
    angle = u_[..., 1] if u_.shape[-1] == 3 else zero
    r = radius + u_[..., 0]
    positions = np.stack([r * np.cos(angle), r * np.sin(angle), height + u_[..., -1]], axis=-1)
    return np.stack([radius, zero, height], axis=-1), positions


def _is_outer(reference: Array) -> NDArray[np.bool_]:
    """Return the faces that occur once: a face between two cells occurs twice."""
    # Each corner of a triangle counts once, whichever is repeated.
    repeated = np.all(reference[:, 2] == reference[:, 3], axis=1)
    mean = np.where(repeated[:, None], reference[:, :3].mean(axis=1), reference.mean(axis=1))
    keys = np.round(mean, 6)
    _, inverse, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    return np.asarray(counts[inverse.ravel()] == 1)
