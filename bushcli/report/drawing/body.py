"""Draws the bushing in true scale: its mesh, and its deformed shape coloured by the largest principal stretch.

A half-plane is drawn as a section, a twisted half-plane as a body of revolution with a quarter left open, a solid from
the side on which it is cut.
"""

from __future__ import annotations

import math

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgba
from matplotlib.figure import Figure

from bushcli.report.document import Array
from bushcli.report.drawing import projection
from bushcli.report.drawing.looks import GREY, INK, METAL
from bushcli.report.drawing.picture import (
    body_axes,
    colour_bar,
    directions,
    literal,
    paint,
    section_axes,
    style,
    wrap,
)
from bushcli.report.drawing.projection import Layer, Projection, line_layer
from bushcli.report.quantity import join_names
from cases.stretches import Surface

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
    view = projection.SECTION if projection.is_section(surface) else projection.cut_view(surface.reference)
    return _Drawing(surface, surface.reference, view, None).figure(title, _note(surface))


def deformed_figure(surface: Surface, title: str) -> Figure:
    """Draw the deformed shape and, dashed, the outline before the load."""
    values = surface.stretch[surface.rubber]
    top = float(np.quantile(values, 1.0 - _BEYOND)) if values.size else 1.0
    scale, note = Normalize(1.0, max(top, 1.01)), _note(surface, deformed=True)
    view, closed = projection.SECTION, True
    if not projection.is_section(surface):
        view = projection.cut_view(surface.reference)
    elif projection.is_twisted(surface):
        surface, view, closed = projection.body_of_revolution(surface), projection.OPEN_QUARTER, False
    return _Drawing(surface, surface.deformed, view, scale, closed=closed).figure(title, note)


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
        self, surface: Surface, points: Array, view: Projection, scale: Normalize | None, closed: bool = True
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
        room = ((1.3 if self.scale else 0.3) + 0.6 * self.flat, 0.9)
        with style():
            figure, axes = body_axes(low, high, _LONGEST, room)
            paint(axes, self.view, self._layers())
            if self.scale is not None:
                values = self.surface.stretch[self.surface.rubber]
                is_clipped = bool(values.size and values.max() > self.scale.vmax * 1.001)  # type: ignore[operator]
                mappable, ends = ScalarMappable(self.scale, _COLOURS), "max" if is_clipped else "neither"
                label = "largest principal stretch"
                colour_bar(figure, axes, mappable, label, shrink=0.75, pad=0.02, extend=ends)
            if self.flat:
                section_axes(axes, ("radius [mm]", "axis [mm]"))
            else:
                self._solid_axes(axes)
            axes.set_title(wrap(title, figure.get_figwidth(), 12.0), fontsize=11.5)
            figure.supxlabel(literal(note), fontsize=8.5, color=GREY[0], x=0.01, ha="left")
        return figure

    def _layers(self) -> list[Layer]:
        """Return faces and lines; those behind a closed body are left out."""
        many = self.many
        pieces = projection.cells(self.grid)
        stretch = projection.cells(projection.bilinear(self.surface.stretch[..., None], many))
        rubber = np.repeat(self.surface.rubber, many * many)
        fill = np.tile(to_rgba(METAL), (len(pieces), 1))
        fill[rubber] = to_rgba(_RUBBER)
        if self.scale is not None:
            fill[rubber] = colormaps[_COLOURS](self.scale(stretch.mean(axis=(1, 2))[rubber]))
        if not self.flat:
            fill[:, :3] *= projection.shade(pieces, self.view)[:, None]
        depth = self.view.depth(pieces).mean(axis=1)
        lines = projection.segments(projection.sides(self.grid))
        bold = np.repeat(projection.outline(self.surface), many)
        # A line is drawn right after the piece of face that it bounds; in the plane, where nothing hides it, last.
        beside = projection.sides(depth.reshape(-1, many, many)).ravel()
        beside += self.extent * (1.0 if self.flat else 0.006)
        # The corners of a closed body are counter-clockwise seen from outside.
        visible = (projection.normals(pieces) @ self.view.towards > 0.0) | (not self.closed)
        drawn = projection.sides(visible.reshape(-1, many, many)).ravel()
        thin, thick = drawn & ~bold, drawn & bold
        layers = [
            Layer(pieces[visible], fill[visible], fill[visible], depth[visible], 0.4),
            line_layer(lines[thin], to_rgba(INK[0], 0.25 if self.scale else 0.8), beside[thin], 0.35),
            line_layer(lines[thick], to_rgba(INK[0]), beside[thick] + 1e-3 * self.extent, 1.1),
        ]
        if self.scale is not None:
            former = projection.lattice(self.surface, self.surface.reference, many)
            edges = projection.once(projection.sides(former)[projection.outline(self.surface)])
            dashes = projection.dashes(edges, 0.012 * self.extent)
            # Slightly nearer to the eye, so that faces that have not moved, or are beside the line, do not hide it.
            near = self.view.depth(dashes).mean(axis=1) + self.extent * (2.0 if self.flat else 0.008)
            layers.append(line_layer(dashes, to_rgba(INK[0], 0.8), near, 0.7))
        return layers

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
        directions(axes, self.view, origin, 0.1 * self.extent)
