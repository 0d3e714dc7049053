"""Map of the places in the rubber where a change of stiffness would help: a section, or the outside of a cut solid."""

from __future__ import annotations

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgba
from matplotlib.figure import Figure

from bushcli.mismatch.maps import LocalMap
from bushcli.report.document import Array
from bushcli.report.drawing import projection
from bushcli.report.drawing.looks import DIVERGING, GREY
from bushcli.report.drawing.picture import body_axes, colour_bar, paint, section_axes, style, wrap
from bushcli.report.plots.places import ring_cells
from cases.stretches import Surface

# Purple where the rubber would have to be stiffer, because the model is too soft there, orange where softer.
_COLOURS = DIVERGING.reversed()
# Share of the colour that remains where no place is significant: the map then shows noise.
_FADED = 0.25
# The colour scale covers all but this share of the rubber.
_BEYOND = 0.01
# Least end of the colour scale, a change of stiffness; a smaller one would show noise in full colours.
_LEAST = 0.02
_LONGEST = 4.6  # inches of the drawing's longer side
# By the number of corners of a cell: those of each face in order around it, and those of the tetrahedra of which it
# consists, six around a diagonal of a hexahedron.
_FACES = {
    4: ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)),
    8: ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (3, 2, 6, 7), (0, 3, 7, 4), (1, 2, 6, 5)),
}
_TETRAHEDRA = {
    4: ((0, 1, 2, 3),),
    8: ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)),
}


def map_title(local_map: LocalMap) -> str:
    """Return the title of the picture."""
    return f"{local_map.name}: a local change helps{'' if local_map.helps_locally else ' no more than a uniform one'}"


def map_figure(local_map: LocalMap) -> Figure:
    """Draw the map in colours that are symmetric about zero change."""
    flat = local_map.points.shape[1] == 2
    view, faces, values, edges = (_section if flat else _solid)(local_map)
    top = float(np.quantile(np.abs(local_map.factor), 1.0 - _BEYOND)) if len(local_map.factor) else 0.0
    norm = Normalize(-100.0 * max(top, _LEAST), 100.0 * max(top, _LEAST))
    mappable = ScalarMappable(norm, _COLOURS)
    fill = np.array(mappable.to_rgba(100.0 * values))
    if not local_map.helps_locally:
        fill[:, :3] = 1.0 - _FADED * (1.0 - fill[:, :3])
    if not flat:
        fill[:, :3] *= projection.shade(faces, view)[:, None]
    ink = np.tile((0.25, 0.25, 0.25, 0.18), (len(fill), 1)) if flat else fill
    # The edges of a solid are a little nearer to the eye than the faces that they bound.
    near = view.depth(edges).mean(axis=1) + 0.02 * float(np.ptp(local_map.points))
    layers = [
        projection.Layer(faces, fill, ink, view.depth(faces).mean(axis=1), 0.3),
        projection.line_layer(edges, to_rgba(GREY[0]), near, 0.9),
    ]
    corners = view.project(faces).reshape(-1, 2)
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = 0.04 * float((high - low).max())
    with style():
        figure, axes = body_axes(low - margin, high + margin, _LONGEST, (1.7, 1.1))
        paint(axes, view, layers, rasterized=not flat)
        label = "change of stiffness that helps: softer (-), stiffer (+) [%]"
        bar = colour_bar(figure, axes, mappable, label, shrink=0.8, pad=0.03)
        if not local_map.helps_locally:
            bar.solids.set_alpha(_FADED)  # type: ignore[union-attr]  # drawn for a mappable
        # Nothing is softer by more than 100 %.
        bar.ax.set_ylim(max(-100.0, float(norm.vmin or 0.0)), norm.vmax)
        if flat:
            section_axes(axes, ("radius [mm]", "axis [mm]"))
        else:
            axes.set_axis_off()
            height = f"axis z upwards; {float(np.ptp(local_map.points[:, 2])):.3g} mm high"
            axes.annotate(height, (0.0, 0.0), xycoords="axes fraction", fontsize=8.5, color=GREY[0])
        axes.set_title(wrap(map_title(local_map), figure.get_figwidth(), 10.5), fontsize=10.5)
        return figure


def _section(local_map: LocalMap) -> tuple[projection.Projection, Array, Array, Array]:
    """Return the faces of the half-plane and of its mirror image, as `_solid` does; without edges."""
    half = np.insert(local_map.points[ring_cells(local_map)[:, [0, 1, 2, -1]]], 1, 0.0, axis=-1)
    faces = np.concatenate([half, half * np.array([-1.0, 1.0, 1.0])])
    return projection.SECTION, faces, np.tile(local_map.factor, 2), np.empty((0, 2, 3))


def _solid(local_map: LocalMap) -> tuple[projection.Projection, Array, Array, Array]:
    """Return a view, the faces (n, 4, 3) that it shows, their values, and the sharp edges (m, 2, 3) of the body.

    A whole body is cut open in a plane beside y = 0.
    """
    cells = ring_cells(local_map)
    corners, tetrahedra = np.array(_FACES[cells.shape[1]]), np.array(_TETRAHEDRA[cells.shape[1]])
    faces = cells[:, corners].reshape(-1, corners.shape[1])
    owner = np.repeat(np.arange(len(cells)), len(corners))
    _, index, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    outside = index[count == 1]
    shapes, values = local_map.points[faces[outside][:, [0, 1, 2, -1]]], local_map.factor[owner[outside]]
    outward = shapes.mean(axis=1) - local_map.points[cells[owner[outside]]].mean(axis=1)
    normal = projection.normals(shapes)
    outward = normal * np.sign(np.einsum("ij,ij->i", normal, outward))[:, None]
    reach = float(np.abs(local_map.points[:, 1]).max())
    if local_map.points[:, 1].min() < -0.1 * reach and local_map.points[:, 1].max() > 0.1 * reach:
        # Nodes lie in y = 0: a plane through them would cut no cell.
        y, distance = np.eye(3)[1], 1.234e-4 * reach
        triangles = np.concatenate([shapes[:, [0, 1, 2]], shapes[:, [0, 2, 3]]])
        half, of = projection.cut(triangles, y, distance, above=True)
        simplices = local_map.points[cells[:, tetrahedra].reshape(-1, 4)]
        section, of_cell = projection.cut(simplices, y, distance, above=False)
        shapes = np.concatenate([half[:, [0, 1, 2, 2]], section])
        cut_values = np.repeat(local_map.factor, len(tetrahedra))[of_cell]
        values = np.concatenate([np.tile(values, 2)[of], cut_values])
        outward = np.concatenate([np.tile(outward, (2, 1))[of], np.tile(-y, (len(section), 1))])
    view = projection.cut_view(shapes)
    # The body is closed: what is turned away from the eye cannot be seen, and would be drawn over its edges.
    visible = np.flatnonzero(outward @ view.towards > 0.0)
    shapes, values = shapes[visible], values[visible]
    whole = np.ones(len(visible), dtype=bool)
    edged = projection.outline(Surface(shapes, shapes, shapes[..., 0], whole, 0.0))
    sharp = projection.once(projection.face_edges(shapes)[edged])
    sharp = sharp[(sharp[:, 0] != sharp[:, 1]).any(axis=1)]  # the last corner of a triangle stands twice
    return view, shapes, values, sharp
