"""Draws the bushing in true scale: its mesh, and its deformed shape coloured by the largest principal stretch.

A half-plane is drawn as a section, a twisted half-plane as a body of revolution with a quarter left open, a solid from
the side on which it is cut.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bushcli.report.drawing import projection
from bushcli.report.drawing.looks import GREY, INK, METAL
from bushcli.report.drawing.picture import literal, new_figure, section_axes, style
from bushcli.report.drawing.projection import Projection
from bushcli.report.quantity import join_names
from cases.stretches import Surface

Array = NDArray[np.float64]
_Layer: TypeAlias = tuple[Array, Array, Array, float, Array]
"""Polygons (n, 4, 3), fill and ink (n, 4), line width in points, depth (n,) in mm: larger is drawn later."""

_RUBBER = "#8fb3c9"
_COLOURS = "YlOrRd"  # from ColorBrewer, safe for colour-blind eyes; light where the stretch is small
_SPLIT_SECTION, _SPLIT_SOLID = 8, 6
# Pieces of a drawing up to which faces are split: the half of 100,000 that can be seen takes some two seconds to draw.
_MOST_PIECES = 100_000
# The colour scale covers all but this share of the surface: at bond edges the stretch is singular.
_BEYOND = 0.005
_LONGEST = 5.4  # inches of the drawing's longer side


def mesh_figure(surface: Surface, title: str) -> Figure:
    """Draw the undeformed mesh."""
    with style():
        flat = projection.is_section(surface)
        view = projection.SECTION if flat else projection.cut_view(surface.reference)
        return _Drawing(surface, surface.reference, view, None).figure(title, _note(surface))


def deformed_figure(surface: Surface, title: str) -> Figure:
    """Draw the deformed shape and, dashed, the outline before the load."""
    values = surface.stretch[surface.rubber]
    top = float(np.quantile(values, 1.0 - _BEYOND)) if values.size else 1.0
    scale, note = Normalize(1.0, max(top, 1.01)), _note(surface, deformed=True)
    with style():
        if not projection.is_section(surface):
            view = projection.cut_view(surface.reference)
            return _Drawing(surface, surface.deformed, view, scale).figure(title, note)
        if not projection.is_twisted(surface):
            return _Drawing(surface, surface.deformed, projection.SECTION, scale).figure(title, note)
        body = projection.body_of_revolution(surface)
        view = projection.view_of_revolution()
        return _Drawing(body, body.deformed, view, scale, closed=False).figure(title, note)


def _note(surface: Surface, deformed: bool = False) -> str:
    """Return the small print of a picture: where the body is cut, and that the scale is true."""
    low, high = (end(surface.reference.reshape(-1, 3), axis=0) for end in (np.min, np.max))
    scale = "true scale; dashed: before the load" if deformed else "true scale"
    if np.isclose(low[1], high[1]):
        twisted = deformed and projection.is_twisted(surface)
        return f"{'a quarter is left open' if twisted else 'section'}; {scale}"
    ends = zip("xyz", low, high, 1e-3 * (high - low), strict=True)
    cut = [f"{axis} = 0" for axis, a, b, small in ends if abs(a) < small or abs(b) < small]
    return f"cut at {join_names(cut)} by symmetry; {scale}" if cut else scale


class _Drawing:
    """One drawing of a surface: faces, element edges, outline, and axes or a scale bar to measure it."""

    def __init__(
        self,
        surface: Surface,
        points: Array,
        view: Projection,
        scale: Normalize | None,
        *,
        closed: bool = True,
    ) -> None:
        self.surface, self.view, self.scale = surface, view, scale
        self.flat = view is projection.SECTION
        self.closed = closed and not self.flat
        # Triangles are small enough to be sorted and coloured as a whole.
        triangles = bool(np.all(surface.reference[:, 2] == surface.reference[:, 3]))
        split = 1 if triangles else _SPLIT_SECTION if self.flat else _SPLIT_SOLID
        # Small elements need no curved sides.
        self.many = max(1, min(split, math.isqrt(_MOST_PIECES // max(len(surface.reference), 1))))
        self.grid = projection.lattice(surface, points, self.many)
        self.extent = float(np.ptp(surface.reference.reshape(-1, 3), axis=0).max())

    def figure(self, title: str, note: str) -> Figure:
        """Return the drawing as a figure."""
        both = (self.grid.reshape(-1, 3), self.surface.reference.reshape(-1, 3))
        projected = self.view.project(np.concatenate(both))
        low, high = projected.min(axis=0), projected.max(axis=0)
        if self.flat:
            low[0] = min(low[0], 0.0)
        else:
            low[1] -= 0.1 * self.extent  # room for the bar and the directions
        low, high = low - 0.03 * self.extent, high + 0.03 * self.extent
        size = high - low
        width, height = _LONGEST * size / size.max()
        figure = new_figure(max(width + (1.3 if self.scale else 0.3) + 0.6 * self.flat, 4.6), height + 0.9)
        axes = figure.add_subplot()
        self._faces(axes)
        if self.scale is not None:
            self._colour_bar(figure, axes)
        axes.set_aspect("equal")
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        if self.flat:
            if self.scale is not None:
                self._former_outline(axes)
            section_axes(axes, ("radius [mm]", "axis [mm]"))
        else:
            self._solid_axes(axes)
        wrapped = "\n".join(textwrap.wrap(title, max(20, int(9.5 * figure.get_figwidth()))))
        axes.set_title(literal(wrapped), fontsize=11.5)
        if note:
            figure.supxlabel(literal(note), fontsize=8.5, color=GREY[0], x=0.01, ha="left")
        return figure

    def _faces(self, axes: Axes) -> None:
        """Draw faces and lines as one collection, distant ones first; those behind a closed body are left out."""
        many = self.many
        pieces = projection.cells(self.grid)
        values = projection.cells(projection.bilinear(self.surface.stretch[..., None], many)).mean(
            axis=(1, 2)
        )
        rubber = np.repeat(self.surface.rubber, many * many)
        fill = np.empty((len(pieces), 4))
        fill[rubber] = (
            (*to_rgb(_RUBBER), 1.0) if self.scale is None else colormaps[_COLOURS](self.scale(values[rubber]))
        )
        fill[~rubber] = (*to_rgb(METAL), 1.0)
        if not self.flat:
            fill[:, :3] *= projection.shade(pieces, self.view)[:, None]
        depth = self.view.depth(pieces).mean(axis=1)
        lines = projection.segments(projection.sides(self.grid))
        bold = np.repeat(projection.outline(self.surface), many)
        # A line is drawn right after the piece of face that it bounds; in the plane, where nothing hides it, last.
        beside = projection.side_cells(depth, many) + self.extent * (1.0 if self.flat else 0.006)
        visible = projection.faces_the_eye(pieces, self.view) | (not self.closed)
        drawn = projection.side_cells(visible, many)
        thin, thick = drawn & ~bold, drawn & bold
        layers = [
            (pieces[visible], fill[visible], fill[visible], 0.4, depth[visible]),
            self._lines(lines[thin], 0.25 if self.scale else 0.8, 0.35, beside[thin]),
            self._lines(lines[thick], 1.0, 1.1, beside[thick] + 1e-3 * self.extent),
        ]
        if self.scale is not None and not self.flat:
            former = projection.lattice(self.surface, self.surface.reference, many)
            edges = projection.once(projection.sides(former)[projection.outline(self.surface)])
            dashes = projection.dashes(edges, 0.012 * self.extent)
            # Slightly nearer to the eye, so that faces that have not moved, or are beside the line, do not hide it.
            near = self.view.depth(dashes).mean(axis=1) + 0.008 * self.extent
            layers.append(self._lines(dashes, 0.8, 0.7, near))
        self._paint(axes, layers)

    def _lines(self, segments: Array, opacity: float, width: float, depth: Array) -> _Layer:
        """Return segments (n, 2, 3) as polygons without area."""
        ink = np.tile((*to_rgb(INK[0]), opacity), (len(segments), 1))
        return segments[:, [0, 1, 1, 0]], np.zeros_like(ink), ink, width, depth

    def _paint(self, axes: Axes, layers: Sequence[_Layer]) -> None:
        depth = np.concatenate([layer[4] for layer in layers])
        order = np.argsort(depth, kind="stable")
        polygons, fill, ink = (np.concatenate([layer[i] for layer in layers])[order] for i in range(3))
        width = np.concatenate([np.full(len(layer[0]), layer[3]) for layer in layers])[order]
        axes.add_collection(
            PolyCollection(
                # An array is converted three times as fast as a list.
                self.view.project(polygons),  # type: ignore[arg-type]  # Matplotlib's stubs know lists only
                facecolors=fill,
                edgecolors=ink,
                linewidths=width,
                joinstyle="round",
                rasterized=True,
            )
        )

    def _former_outline(self, axes: Axes) -> None:
        """Draw the outline before the load over a section; that of a solid is drawn among the faces."""
        edges = projection.face_edges(self.surface.reference)[projection.outline(self.surface)]
        lines = self.view.project(projection.once(edges))
        axes.add_collection(
            LineCollection(list(lines), colors=GREY[0], linewidths=0.8, linestyles=(0, (4, 3)), zorder=3)
        )

    def _colour_bar(self, figure: Figure, axes: Axes) -> None:
        assert self.scale is not None
        values = self.surface.stretch[self.surface.rubber]
        is_clipped = bool(values.size and values.max() > self.scale.vmax * 1.001)  # type: ignore[operator]
        mappable, ends = ScalarMappable(self.scale, _COLOURS), "max" if is_clipped else "neither"
        bar = figure.colorbar(mappable, ax=axes, shrink=0.75, pad=0.02, extend=ends)
        bar.set_label("largest principal stretch")
        bar.outline.set_visible(False)  # type: ignore[operator]

    def _solid_axes(self, axes: Axes) -> None:
        """Replace the axes by arrows for the directions and a bar of known length."""
        axes.set_axis_off()
        (left, right), bottom = axes.get_xlim(), axes.get_ylim()[0]
        # The largest of 1, 2, 5 times a power of ten that does not exceed this length.
        most = 0.3 * self.extent
        power = 10.0 ** np.floor(np.log10(most))
        length = float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= most * (1 + 1e-9)))
        y = bottom + 0.01 * self.extent
        axes.plot([right - length, right], [y, y], color=INK[0], lw=2.0, solid_capstyle="butt")
        middle = (right - length / 2, y)
        axes.annotate(f"{length:g} mm", middle, (0, 3), textcoords="offset points", ha="center", fontsize=9)
        origin = np.array([left + 0.06 * self.extent, y + 0.04 * self.extent])
        for name, direction in zip("xyz", np.eye(3), strict=True):
            x, y = (float(value) for value in self.view.project(direction) * self.extent)
            tip = (origin[0] + 0.075 * x, origin[1] + 0.075 * y)
            arrow = {"arrowstyle": "-|>", "color": GREY[0], "lw": 1.1, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", tip, (origin[0], origin[1]), arrowprops=arrow)
            label = (origin[0] + 0.1 * x, origin[1] + 0.1 * y)
            axes.annotate(name, label, ha="center", va="center", fontsize=9, color=GREY[0])
