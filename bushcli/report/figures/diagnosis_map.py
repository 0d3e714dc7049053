"""Map of the places in the rubber where a change of stiffness would help: a section, or the outside of a cut solid."""

from __future__ import annotations

from textwrap import fill

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bushcli.mismatch.maps import LocalMap
from bushcli.report.figures.picture import BLACK, GREY, literal, new_figure, style
from bushcli.report.figures.projection import cut_view, shade

Array = NDArray[np.float64]

# From ColorBrewer: orange where the rubber would have to be stiffer, purple where softer.
_COLOURS = "PuOr_r"
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


def map_title(found: LocalMap) -> str:
    """Return the title of the picture."""
    helps = (
        "a local change helps" if found.helps_locally else "a local change helps no more than a uniform one"
    )
    return f"{found.name}: {helps}"


def map_figure(found: LocalMap) -> Figure:
    """Draw the map in colours that are symmetric about zero change."""
    flat = found.points.shape[1] == 2
    polygons, values, order = _section(found) if flat else _solid(found)
    top = float(np.quantile(np.abs(found.factor), 1.0 - _BEYOND)) if len(found.factor) else 0.0
    norm = Normalize(-100.0 * max(top, _LEAST), 100.0 * max(top, _LEAST))
    mappable = ScalarMappable(norm, _COLOURS)
    colours = np.array(mappable.to_rgba(100.0 * values))
    colours[:, :3] *= order[:, None]
    low, high = polygons.reshape(-1, 2).min(axis=0), polygons.reshape(-1, 2).max(axis=0)
    margin = 0.04 * float((high - low).max())
    size = (high - low) * _LONGEST / float((high - low).max())
    with style():
        figure = new_figure(max(size[0] + 1.7, 4.6), size[1] + 1.1)
        axes = figure.add_subplot()
        edges = [(0.25, 0.25, 0.25, 0.18)] * len(polygons)
        axes.add_collection(
            PolyCollection(list(polygons), facecolors=list(colours), edgecolors=edges, linewidths=0.3)
        )
        axes.set_aspect("equal")
        axes.set_xlim(low[0] - margin, high[0] + margin)
        axes.set_ylim(low[1] - margin, high[1] + margin)
        bar = figure.colorbar(mappable, ax=axes, shrink=0.8, pad=0.03)
        bar.set_label("change of stiffness that helps: softer (-), stiffer (+) [%]", fontsize=9)
        # Nothing is softer by more than 100 %.
        bar.ax.set_ylim(max(-100.0, float(norm.vmin or 0.0)), norm.vmax)
        bar.outline.set_visible(False)  # type: ignore[operator]
        axes.grid(False)
        if flat:
            axes.axvline(0.0, color=GREY, lw=0.9, ls=(0, (10, 3, 2, 3)))
            axes.set(xlabel="radius [mm]", ylabel="axis [mm]")
        else:
            axes.set_axis_off()
            length = float(np.ptp(found.points[:, 2]))
            axes.annotate(
                f"axis z upwards; {length:.3g} mm high",
                (0.0, 0.0),
                xycoords="axes fraction",
                fontsize=8.5,
                color=GREY,
            )
        axes.set_title(literal(fill(map_title(found), _LINE)), fontsize=10.5, color=BLACK)
        return figure


def numbering(found: LocalMap) -> str:
    """Return "simplex", or how the corners of cells are numbered: "tensor" for a tensor product, "ring" around a face.

    The first four corners are a face: in a tensor product its diagonals join corners 0, 3 and 1, 2, in a ring 0, 2 and
    1, 3. The midpoints of the diagonals coincide, exactly in a parallelogram and nearly in any good cell.
    """
    if found.cells.shape[1] == found.points.shape[1] + 1:
        return "simplex"
    a, b, c, d = (found.points[found.cells[:, i]] for i in range(4))
    tensor = float(np.linalg.norm(a + d - b - c, axis=1).sum())
    ring = float(np.linalg.norm(a + c - b - d, axis=1).sum())
    return "tensor" if tensor <= ring else "ring"


def _section(found: LocalMap) -> tuple[Array, Array, Array]:
    """Return the faces of the half-plane and of its mirror image."""
    (corners,) = _SECTION[numbering(found)]
    faces = found.points[found.cells[:, corners]]
    mirrored = faces * np.array([-1.0, 1.0])
    values = np.concatenate([found.factor, found.factor])
    return np.concatenate([faces, mirrored]), values, np.ones(len(values))


def _solid(found: LocalMap) -> tuple[Array, Array, Array]:
    """Return the outer faces of the solid, distant ones first; a whole body is cut open at y = 0."""
    middle = found.points[found.cells].mean(axis=1)
    reach = float(np.abs(found.points[:, 1]).max())
    whole = middle[:, 1].min() < -0.1 * reach and middle[:, 1].max() > 0.1 * reach
    shown = np.flatnonzero(middle[:, 1] >= 0.0 if whole else np.full(len(middle), True))
    corners = np.array(_SOLID[numbering(found)])
    faces = found.cells[shown][:, corners].reshape(-1, corners.shape[1])
    owner = np.repeat(shown, len(corners))
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    outside = first[count == 1]
    shapes, values = found.points[faces[outside]], found.factor[owner[outside]]
    view = cut_view(shapes)
    order = np.argsort(view.depth(shapes.mean(axis=1)))
    bright = shade(shapes, view)[order]
    return view.project(shapes)[order], values[order], bright
