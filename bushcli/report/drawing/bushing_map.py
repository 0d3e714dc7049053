"""Map of the places in the rubber where a change of stiffness would help: a section, or the outside of a cut solid."""

from __future__ import annotations

from textwrap import fill

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize, to_rgba
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bushcli.mismatch.maps import LocalMap
from bushcli.report.drawing.looks import DIVERGING, GREY, INK
from bushcli.report.drawing.picture import literal, new_figure, section_axes, style
from bushcli.report.drawing.projection import cut, cut_view, face_edges, normals, once, outline, shade
from bushcli.report.plots.places import numbering
from cases.stretches import Surface

Array = NDArray[np.float64]

# Purple where the rubber would have to be stiffer, because the model is too soft there, orange where softer.
_COLOURS = DIVERGING.reversed()
# Share of the colour that remains where no place is significant: the map then shows noise.
_FADED = 0.25
# The colour scale covers all but this share of the rubber.
_BEYOND = 0.01
# Least end of the colour scale, a change of stiffness; a smaller one would show noise in full colours.
_LEAST = 0.02
# Characters in a line of the title.
_LINE = 50
_LONGEST = 4.6  # inches of the drawing's longer side
# Corners of a face in order around it, among those of a cell: of a simplex, in tensor-product and in ring numbering.
_SECTION = {"simplex": ((0, 1, 2),), "tensor": ((0, 1, 3, 2),), "ring": ((0, 1, 2, 3),)}
_SOLID = {
    "simplex": ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)),
    "tensor": ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)),
    "ring": ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (3, 2, 6, 7), (0, 3, 7, 4), (1, 2, 6, 5)),
}
# Tetrahedra of which a cell consists: six around a diagonal of a hexahedron.
_RING = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
_FROM_RING = (0, 1, 3, 2, 4, 5, 7, 6)
_TETRAHEDRA = {
    "simplex": ((0, 1, 2, 3),),
    "ring": _RING,
    "tensor": tuple(tuple(_FROM_RING[i] for i in tetrahedron) for tetrahedron in _RING),
}


def map_title(local_map: LocalMap) -> str:
    """Return the title of the picture."""
    return f"{local_map.name}: a local change helps{'' if local_map.helps_locally else ' no more than a uniform one'}"


def map_figure(local_map: LocalMap) -> Figure:
    """Draw the map in colours that are symmetric about zero change."""
    flat = local_map.points.shape[1] == 2
    if not flat:
        polygons, values, order = _solid(local_map)
    else:  # the faces of the half-plane and of its mirror image
        (corners,) = _SECTION[numbering(local_map)]
        faces = local_map.points[local_map.cells[:, corners]]
        polygons = np.concatenate([faces, faces * np.array([-1.0, 1.0])])
        values, order = np.concatenate([local_map.factor, local_map.factor]), np.ones(len(polygons))
    top = float(np.quantile(np.abs(local_map.factor), 1.0 - _BEYOND)) if len(local_map.factor) else 0.0
    norm = Normalize(-100.0 * max(top, _LEAST), 100.0 * max(top, _LEAST))
    mappable = ScalarMappable(norm, _COLOURS)
    colours = np.array(mappable.to_rgba(100.0 * values))
    if not local_map.helps_locally:
        colours[:, :3] = 1.0 - _FADED * (1.0 - colours[:, :3])
    colours[:, :3] *= order[:, None]
    low, high = polygons.reshape(-1, 2).min(axis=0), polygons.reshape(-1, 2).max(axis=0)
    margin = 0.04 * float((high - low).max())
    size = (high - low) * _LONGEST / float((high - low).max())
    with style():
        figure = new_figure(max(size[0] + 1.7, 4.6), size[1] + 1.1)
        axes = figure.add_subplot()
        # The edges of a solid are its own, which have no value, not those of the cells.
        lines = np.isnan(values)
        edges = np.where(lines[:, None], to_rgba(GREY[0]), (0.25, 0.25, 0.25, 0.18) if flat else colours)
        colours[lines] = 0.0
        axes.add_collection(
            PolyCollection(
                list(polygons),
                facecolors=list(colours),
                edgecolors=list(edges),
                linewidths=list(np.where(lines, 0.9, 0.3)),
                rasterized=not flat,
            )
        )
        axes.set_aspect("equal")
        axes.set_xlim(low[0] - margin, high[0] + margin)
        axes.set_ylim(low[1] - margin, high[1] + margin)
        bar = figure.colorbar(mappable, ax=axes, shrink=0.8, pad=0.03)
        bar.set_label("change of stiffness that helps: softer (-), stiffer (+) [%]", fontsize=9)
        if not local_map.helps_locally:
            bar.solids.set_alpha(_FADED)  # type: ignore[union-attr]  # drawn for a mappable
        # Nothing is softer by more than 100 %.
        bar.ax.set_ylim(max(-100.0, float(norm.vmin or 0.0)), norm.vmax)
        bar.outline.set_visible(False)  # type: ignore[operator]
        if flat:
            section_axes(axes, ("radius [mm]", "axis [mm]"))
        else:
            axes.set_axis_off()
            height = f"axis z upwards; {float(np.ptp(local_map.points[:, 2])):.3g} mm high"
            axes.annotate(height, (0.0, 0.0), xycoords="axes fraction", fontsize=8.5, color=GREY[0])
        axes.set_title(literal(fill(map_title(local_map), _LINE)), fontsize=10.5, color=INK[0])
        return figure


def _solid(local_map: LocalMap) -> tuple[Array, Array, Array]:
    """Return the outer faces of the solid, distant ones first; a whole body is cut open in a plane beside y = 0.

    The sharp edges of the body are among them, as faces without area and without value.
    """
    kind = numbering(local_map)
    corners = np.array(_SOLID[kind])
    faces = local_map.cells[:, corners].reshape(-1, corners.shape[1])
    owner = np.repeat(np.arange(len(local_map.cells)), len(corners))
    _, index, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    outside = index[count == 1]
    shapes, values = local_map.points[faces[outside][:, [0, 1, 2, -1]]], local_map.factor[owner[outside]]
    outward = shapes.mean(axis=1) - local_map.points[local_map.cells[owner[outside]]].mean(axis=1)
    outward = normals(shapes) * np.sign(np.einsum("ij,ij->i", normals(shapes), outward))[:, None]
    reach = float(np.abs(local_map.points[:, 1]).max())
    if local_map.points[:, 1].min() < -0.1 * reach and local_map.points[:, 1].max() > 0.1 * reach:
        # Nodes lie in y = 0: a plane through them would cut no cell.
        y, distance = np.eye(3)[1], 1.234e-4 * reach
        triangles = np.concatenate([shapes[:, [0, 1, 2]], shapes[:, [0, 2, 3]]])
        half, of = cut(triangles, y, distance, above=True)
        cells = np.array(_TETRAHEDRA[kind])
        section, of_cell = cut(
            local_map.points[local_map.cells[:, cells].reshape(-1, 4)], y, distance, above=False
        )
        shapes = np.concatenate([half[:, [0, 1, 2, 2]], section])
        values = np.concatenate([np.tile(values, 2)[of], np.repeat(local_map.factor, len(cells))[of_cell]])
        outward = np.concatenate([np.tile(outward, (2, 1))[of], np.tile(-y, (len(section), 1))])
    view = cut_view(shapes)
    # The body is closed: what is turned away from the eye cannot be seen, and would be drawn over its edges.
    visible = np.flatnonzero(outward @ view.towards > 0.0)
    shapes, values = shapes[visible], values[visible]
    whole = np.ones(len(visible), dtype=bool)
    sharp = once(face_edges(shapes)[outline(Surface(shapes, shapes, shapes[..., 0], whole, 0.0))])
    sharp = sharp[(sharp[:, 0] != sharp[:, 1]).any(axis=1)]  # the last corner of a triangle stands twice
    # A little nearer to the eye than the faces that they bound.
    depth = np.concatenate(
        [
            view.depth(shapes).mean(axis=1),
            view.depth(sharp).mean(axis=1) + 0.02 * float(np.ptp(local_map.points)),
        ]
    )
    shapes = np.concatenate([shapes, sharp[:, [0, 1, 1, 0]]])
    values = np.concatenate([values, np.full(len(sharp), np.nan)])
    order = np.argsort(depth)
    bright = shade(shapes, view)[order]
    return view.project(shapes)[order], values[order], bright
