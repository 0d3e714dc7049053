"""Interpretation of a CAD file or a section, with areas and volumes."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from bushcli.report.figures.picture import BLACK, GREY, METAL, literal, new_figure, style
from geometry.view import View

Array = NDArray[np.float64]

# From the Okabe-Ito palette, safe for colour-blind eyes.
_COLOURS = {
    "inner": "#0072B2",
    "outer": "#D55E00",
    "free": "#c9c9c9",
    "rubber": "#8fb3c9",
    "not closed": "#CC79A7",
}
_OTHERS = ("#56B4E9", "#009E73", "#E69F00", "#CC79A7", "#F0E442")
_PAINT: dict[str, Any] = {"linewidths": 0.3, "rasterized": True}
_LIGHT = np.array([0.3, 0.5, 0.8])
_AZIMUTH, _ELEVATION = np.radians(-60.0), np.radians(28.0)


def geometry_figure(view: View, title: str, measures: Mapping[str, float]) -> Figure:
    """Draw a geometry with its faces coloured by their interpretation.

    Parameters
    ----------
    view
        Triangles with names.
    title
        Title above the picture.
    measures
        Volumes (mm^3) and areas (mm^2) by name, bonds as "inner_bond".
    """
    with style():
        figure = new_figure(6.4 if view.flat else 8.6, 5.2)
        if view.flat:
            _section(figure.add_subplot(), view)
        else:
            sides = figure.subplots(1, 2)
            _solid(sides[0], view, opened=False)
            _solid(sides[1], view, opened=True)
            sides[0].set_title("outside", fontsize=10)
            sides[1].set_title("without the quarter in front", fontsize=10)
        figure.suptitle(literal("\n".join(textwrap.wrap(title, 60 if view.flat else 95))), fontsize=10.5)
        handles = [
            Patch(facecolor=_colour(name, view), edgecolor=GREY, label=literal(_label(name, measures, view)))
            for name in dict.fromkeys(view.names)
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=9, frameon=False)
        return figure


def _label(name: str, measures: Mapping[str, float], view: View) -> str:
    volume = measures.get(name) if name in view.names and f"{name}_bond" not in measures else None
    area = measures.get(f"{name}_bond")
    if area is not None:
        return f"{name} bond, {area:.5g} mm²"
    if volume is None:
        return name
    return f"{name}, {volume:.5g} {'mm²' if name == 'free' else 'mm³'}"


def _colour(name: str, view: View) -> str:
    """Return the colour for the interpretation of a face; each solid that was not identified has its own colour."""
    if name[:1].isdigit():
        return _OTHERS[view.names.index(name) % len(_OTHERS)]
    return _COLOURS.get(name, METAL)


def _section(axes: Axes, view: View) -> None:
    fill = [_colour(view.names[i], view) for i in view.label]
    axes.add_collection(
        PolyCollection(
            list(view.triangles[:, :, [0, 2]]),
            facecolors=fill,
            edgecolors=fill,
            linewidths=0.3,
            rasterized=True,
        )
    )
    ink = [BLACK if view.names[i] == "free" else _colour(view.names[i], view) for i in view.line_label]
    width = [1.0 if view.names[i] == "free" else 3.5 for i in view.line_label]
    axes.add_collection(LineCollection(list(view.lines[:, :, [0, 2]]), colors=ink, linewidths=width))
    axes.axvline(0.0, color=GREY, linestyle="-.", linewidth=0.8)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_xlabel("r, mm")
    axes.set_ylabel("z from the centre, mm")


def _solid(axes: Axes, view: View, opened: bool) -> None:
    toward = np.array(
        [
            np.cos(_ELEVATION) * np.cos(_AZIMUTH),
            np.cos(_ELEVATION) * np.sin(_AZIMUTH),
            np.sin(_ELEVATION),
        ]
    )
    right = np.array([-np.sin(_AZIMUTH), np.cos(_AZIMUTH), 0.0])
    up = np.cross(toward, right)
    centre = view.triangles.mean(axis=1)
    keep = ~((centre[:, 0] > 0) & (centre[:, 1] < 0)) if opened else np.full(len(centre), True)
    triangles, label = view.triangles[keep], view.label[keep]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    # Where the part is open both sides of a face are visible: the side towards the eye is lit.
    facing = normals * np.sign(normals @ toward)[:, None]
    shade = 0.55 + 0.45 * np.clip(facing @ (_LIGHT / np.linalg.norm(_LIGHT)), 0.0, 1.0)
    colours = np.array([to_rgb(_colour(name, view)) for name in view.names]).reshape(-1, 3)
    fill = colours[label] * shade[:, None]
    order = np.argsort(triangles.mean(axis=1) @ toward)
    flat = np.stack([triangles @ right, triangles @ up], axis=-1)
    axes.add_collection(
        PolyCollection(
            list(flat[order]), facecolors=fill[order], edgecolors=fill[order], linewidths=0.3, rasterized=True
        )
    )
    extent = float(np.abs(view.triangles).max(initial=1.0))
    for vector, name in ((np.eye(3)[0], "x"), (np.eye(3)[1], "y"), (np.eye(3)[2], "z")):
        start = np.array([-0.9 * extent, -0.95 * extent])
        end = start + 0.22 * extent * np.array([vector @ right, vector @ up])
        axes.annotate(
            name, xy=tuple(start), xytext=tuple(end), fontsize=8, arrowprops={"arrowstyle": "<-", "lw": 0.8}
        )
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()
