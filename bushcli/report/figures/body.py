"""The bushing itself: its mesh, and its deformed shape coloured by the largest principal stretch, in true scale.

A half-plane is drawn as the section that it is, a twisted one as a body of revolution with a quarter left open, a solid
from the side on which it is cut.
"""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bushcli.report.figures import projection
from bushcli.report.figures.picture import BLACK, GREY, METAL, literal, new_figure, style
from bushcli.report.figures.projection import View
from cases.stretches import Surface

Array = NDArray[np.float64]

_RUBBER = "#8fb3c9"
_COLOURS = "viridis"
_SPLIT_SECTION, _SPLIT_SOLID = 8, 4
# The colour scale ends where all but this share of the surface is told apart: at bond edges the stretch is singular.
_BEYOND = 0.005
_LONGEST = 5.4  # inches of the drawing's longer side


def mesh_figure(surface: Surface, title: str, note: str = "") -> Figure:
    """Draw the undeformed mesh."""
    with style():
        view = (
            projection.SECTION if projection.is_section(surface) else projection.cut_view(surface.reference)
        )
        return _Drawing(surface, surface.reference, view, None).figure(title, note)


def deformed_figure(surface: Surface, title: str, note: str = "") -> Figure:
    """Draw the deformed shape, with the outline that it had before."""
    scale = _scale(surface)
    with style():
        if not projection.is_section(surface):
            view = projection.cut_view(surface.reference)
            return _Drawing(surface, surface.deformed, view, scale).figure(title, note)
        if np.allclose(surface.deformed[..., 1], 0.0, atol=1e-9):
            return _Drawing(surface, surface.deformed, projection.SECTION, scale).figure(title, note)
        body = projection.revolved(surface)
        return _Drawing(body, body.deformed, projection.revolved_view(), scale).figure(title, note)


def _scale(surface: Surface) -> Normalize:
    values = surface.stretch[surface.rubber]
    top = float(np.quantile(values, 1.0 - _BEYOND)) if values.size else 1.0
    return Normalize(1.0, max(top, 1.01))


class _Drawing:
    """One drawing of a surface: faces, element edges, outline; and what an engineer measures it by."""

    def __init__(self, surface: Surface, points: Array, view: View, scale: Normalize | None) -> None:
        self.surface, self.points, self.view, self.scale = surface, points, view, scale
        self.flat = view is projection.SECTION

    def figure(self, title: str, note: str) -> Figure:
        """Draw."""
        projected = self.view.project(np.concatenate([self.points, self.surface.reference]).reshape(-1, 3))
        low, high = projected.min(axis=0), projected.max(axis=0)
        if self.flat:
            low[0] = min(low[0], 0.0)
        size = high - low
        width, height = _LONGEST * size / size.max()
        figure = new_figure(max(width + (1.9 if self.scale else 0.9), 4.2), max(height + 1.2, 2.6))
        axes = figure.add_subplot()
        self._faces(axes)
        if self.scale is not None:
            self._former_outline(axes)
            self._colour_bar(figure, axes)
        axes.set_aspect("equal")
        margin = 0.03 * size.max()
        axes.set_xlim(low[0] - margin, high[0] + margin)
        axes.set_ylim(low[1] - margin, high[1] + margin)
        if self.flat:
            self._section_axes(axes)
        else:
            self._solid_axes(axes)
        figure.suptitle(literal(title), fontsize=11.5, fontweight="bold", x=0.01, ha="left")
        if note:
            axes.annotate(
                literal(note),
                (0.0, 0.0),
                xycoords="figure fraction",
                xytext=(6, 5),
                textcoords="offset points",
                fontsize=8,
                color=GREY,
            )
        return figure

    def _faces(self, axes: Axes) -> None:
        """Faces and edges in one collection, far ones first."""
        many = _SPLIT_SECTION if self.flat else _SPLIT_SOLID
        pieces = projection.split(self.points, many)
        values = projection.split(self.surface.stretch[..., None], many).mean(axis=(1, 2))
        rubber = np.repeat(self.surface.rubber, many * many)
        fill = np.empty((len(pieces), 4))
        fill[rubber] = (
            (*to_rgb(_RUBBER), 1.0) if self.scale is None else colormaps[_COLOURS](self.scale(values[rubber]))
        )
        fill[~rubber] = (*to_rgb(METAL), 1.0)
        if not self.flat:
            fill[:, :3] *= projection.shade(pieces, self.view)[:, None]
        lines, bold = self._lines(1 if self.flat else many)
        ink = np.tile((*to_rgb(BLACK), 1.0 if self.scale is None else 0.35), (len(lines), 1))
        ink[bold, 3] = 1.0
        # A line lies on the faces beside it; towards the eye by a little, it is drawn after them.
        extent = float(np.ptp(self.surface.reference.reshape(-1, 3), axis=0).max())
        depth = np.concatenate(
            [
                self.view.depth(pieces).mean(axis=1),
                self.view.depth(lines).mean(axis=1) + (extent if self.flat else 0.012 * extent),
            ]
        )
        order = np.argsort(depth, kind="stable")
        polygons = np.concatenate([self.view.project(pieces), self.view.project(lines[:, [0, 1, 1, 0]])])
        none = np.zeros((len(lines), 4))
        axes.add_collection(
            PolyCollection(
                list(polygons[order]),
                facecolors=np.concatenate([fill, none])[order],
                edgecolors=np.concatenate([fill, ink])[order],
                linewidths=np.concatenate([np.full(len(pieces), 0.4), np.where(bold, 1.1, 0.35)])[order],
                joinstyle="round",
                rasterized=True,
            )
        )

    def _lines(self, many: int) -> tuple[Array, NDArray[np.bool_]]:
        """Element edges in pieces, shape (n, 2, 3), and which of them are outline."""
        edges = projection.face_edges(self.points)
        bold = projection.outline(self.surface)
        t = np.linspace(0.0, 1.0, many + 1)[:, None]
        grid = edges[:, None, 0] * (1 - t) + edges[:, None, 1] * t
        pieces = np.stack([grid[:, :-1], grid[:, 1:]], axis=2).reshape(-1, 2, 3)
        return pieces, np.repeat(bold, many)

    def _former_outline(self, axes: Axes) -> None:
        edges = projection.face_edges(self.surface.reference)[projection.outline(self.surface)]
        axes.add_collection(
            LineCollection(
                list(self.view.project(edges)), colors=GREY, linewidths=0.8, linestyles=(0, (4, 3)), zorder=3
            )
        )

    def _colour_bar(self, figure: Figure, axes: Axes) -> None:
        assert self.scale is not None
        values = self.surface.stretch[self.surface.rubber]
        over = bool(values.size and values.max() > self.scale.vmax * 1.001)  # type: ignore[operator]
        bar = figure.colorbar(
            ScalarMappable(self.scale, _COLOURS),
            ax=axes,
            shrink=0.75,
            pad=0.02,
            extend="max" if over else "neither",
        )
        bar.set_label("largest principal stretch")
        bar.outline.set_visible(False)  # type: ignore[operator]

    def _section_axes(self, axes: Axes) -> None:
        axes.axvline(0.0, color=GREY, lw=0.9, ls=(0, (10, 3, 2, 3)))
        axes.set(xlabel="radius [mm]", ylabel="axis [mm]")
        axes.grid(False)

    def _solid_axes(self, axes: Axes) -> None:
        """No axes, but the directions and a bar to measure by."""
        axes.set_axis_off()
        (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
        extent = max(right - left, top - bottom)
        length = _round_length(0.2 * extent)
        y = bottom - 0.03 * extent
        axes.plot([right - length, right], [y, y], color=BLACK, lw=2.0, solid_capstyle="butt")
        axes.annotate(
            f"{length:g} mm",
            (right - length / 2, y),
            (0, 3),
            textcoords="offset points",
            ha="center",
            fontsize=9,
        )
        origin = np.array([left + 0.07 * extent, y + 0.02 * extent])
        for name, direction in zip("xyz", np.eye(3), strict=True):
            tip = origin + 0.075 * extent * self.view.project(direction)
            axes.annotate(
                "",
                tip,
                origin,
                arrowprops={"arrowstyle": "-|>", "color": GREY, "lw": 1.1, "shrinkA": 0, "shrinkB": 0},
            )
            label = origin + 0.1 * extent * self.view.project(direction)
            axes.annotate(name, label, ha="center", va="center", fontsize=9, color=GREY)
        axes.set_ylim(bottom - 0.08 * extent, top)


def _round_length(length: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not longer."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= length * (1 + 1e-9)))
