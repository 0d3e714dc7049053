"""Draws how a CAD file or a section was interpreted, with areas and volumes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba, to_rgba_array
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from bushcli.report.document import Array
from bushcli.report.drawing.looks import GREY, INK, METAL
from bushcli.report.drawing.picture import directions, literal, new_figure, paint, section_axes, style, wrap
from bushcli.report.drawing.projection import SECTION, Layer, cut, shade, view_from
from geometry.view import View

# From the Okabe-Ito palette, safe for colour-blind eyes.
_COLOURS = {
    "inner": "#0072B2",
    "outer": "#D55E00",
    "free": "#c9c9c9",
    "rubber": "#8fb3c9",
    "inner_sleeve": "#5b4a8a",
    "outer_sleeve": "#E69F00",
    "not closed": "#CC79A7",
}
_OTHERS = ("#56B4E9", "#009E73", "#E69F00", "#CC79A7", "#F0E442")
_PLATES = ("#009E73", "#F0E442", "#CC79A7", METAL)
# Rows of pixels in a section through an assembly.
_ROWS = 700
# Direction from which a solid is seen, and how much darker a face is that gets no light.
_TOWARDS = np.array([0.44, -0.76, 0.47])
_CONTRAST = 0.45


def geometry_figure(view: View, title: str, measures: Mapping[str, float]) -> Figure:
    """Draw a geometry with its faces coloured by their interpretation."""
    with style():
        figure = new_figure(6.4 if view.flat else 8.6, 5.2)
        if view.flat:
            _section(figure.add_subplot(), view)
        else:
            sides = figure.subplots(1, 2)
            _solid(sides[0], view, opened=False)
            sides[0].set_title("outside", fontsize=10)
            if view.shows_assembly:
                _fill_section(sides[1], view)
                sides[1].set_title("cut in the plane of x and z", fontsize=10)
            else:
                _solid(sides[1], view, opened=True)
                sides[1].set_title("without the quarter in front", fontsize=10)
        figure.suptitle(wrap(title, figure.get_figwidth(), 10.5), fontsize=10.5)
        handles = [
            Patch(fc=_colour(name, view), ec=GREY[0], label=literal(_label(name, measures, view)))
            for name in view.names
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=9, frameon=False)
        return figure


def _label(name: str, measures: Mapping[str, float], view: View) -> str:
    if name in view.captions:
        return view.captions[name]
    if name == "free" and "rubber" in measures and "rubber" not in view.names:
        return f"free surface; the rubber has {measures['rubber']:.5g} mm³"
    if (area := measures.get(f"{name}_bond")) is not None:
        return f"{name} bond, {area:.5g} mm²"
    if (size := measures.get(name)) is None:
        return "free surface" if name == "free" else name
    return f"{name}, {size:.5g} {'mm²' if name == 'free' else 'mm³'}"


def _colour(name: str, view: View) -> str:
    """Return the colour for the interpretation of a face; each solid that was not identified has its own colour."""
    if name[:1].isdigit():
        return _OTHERS[view.names.index(name) % len(_OTHERS)]
    if name in _COLOURS:
        return _COLOURS[name]
    plates = [other for other in dict.fromkeys(view.names) if other not in _COLOURS]
    return _PLATES[plates.index(name) % len(_PLATES)]


def _section(axes: Axes, view: View) -> None:
    fill = to_rgba_array([_colour(name, view) for name in view.names])[view.label]
    paint(axes, SECTION, [Layer(view.triangles, fill, fill, np.zeros(len(fill)), 0.3)])
    names = [view.names[i] for i in view.line_label]
    ink = [INK[0] if name == "free" else _colour(name, view) for name in names]
    width = [1.0 if name == "free" else 3.5 for name in names]
    axes.add_collection(LineCollection(list(view.lines[:, :, [0, 2]]), colors=ink, linewidths=width))
    axes.autoscale_view()
    section_axes(axes, ("radius [mm]", "z from the centre [mm]"))


def _fill_section(axes: Axes, view: View) -> None:
    """Fill the bodies of an assembly where the plane of x and z cuts them, and draw the bonds as lines."""
    size = float(np.abs(view.solids).max())
    # Nodes lie in a plane of symmetry: the section is taken beside it.
    y = 1.234e-4 * size
    low, high = view.solids.min(axis=(0, 1)), view.solids.max(axis=(0, 1))
    columns = max(2, round(_ROWS * (high[0] - low[0]) / (high[2] - low[2])))
    x, z = (low[i] + (np.arange(n) + 0.5) / n * (high[i] - low[i]) for i, n in ((0, columns), (2, _ROWS)))
    image = np.ones((_ROWS, columns, 4))
    image[..., 3] = 0.0
    for number in np.unique(view.solid_label):
        lines = _section_lines(view.solids[view.solid_label == number], y)
        start, end = lines[:, 0], lines[:, 1]
        for row, height in enumerate(z):
            crossing = (start[:, 1] > height) != (end[:, 1] > height)
            a, b = start[crossing], end[crossing]
            at = np.sort(a[:, 0] + (height - a[:, 1]) * (b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1]))
            image[row, np.searchsorted(at, x) % 2 == 1] = to_rgba(_colour(view.names[number], view))
    extent = (low[0], high[0], low[2], high[2])
    axes.imshow(image, origin="lower", extent=extent, interpolation="nearest")
    axes.margins(0.03)
    axes.autoscale()
    for i, name in enumerate(view.names):
        if name in ("inner", "outer"):
            lines = _section_lines(view.triangles[view.label == i], y)
            axes.add_collection(LineCollection(list(lines), colors=_colour(name, view), linewidths=3.5))
    section_axes(axes, ("x [mm]", "z [mm]"))


def _section_lines(triangles: Array, y: float) -> Array:
    """Return where triangles cross the plane of this y: ends (x, z) of lines, mm, shape (k, 2, 2)."""
    return cut(triangles, np.eye(3)[1], y, above=False)[0][..., [0, 2]]


def _solid(axes: Axes, view: View, opened: bool) -> None:
    eye = view_from(_TOWARDS)
    triangles, label = view.triangles, view.label
    if opened:
        x, y = np.eye(3)[:2]
        front, of_front = cut(triangles, x, above=True)
        behind, of_behind = cut(front, y, above=True)
        left, of_left = cut(triangles, -x, above=True)
        triangles = np.concatenate([left, behind])
        label = label[np.concatenate([of_left, of_front[of_behind]])]
    fill = to_rgba_array([_colour(name, view) for name in view.names])[label]
    fill[:, :3] *= shade(triangles, eye, _CONTRAST)[:, None]
    paint(axes, eye, [Layer(triangles, fill, fill, eye.depth(triangles).mean(axis=1), 0.3)])
    extent = float(np.abs(view.triangles).max(initial=1.0))
    directions(axes, eye, np.array([-0.9 * extent, -0.95 * extent]), 0.22 * extent)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()
