"""Measured curves and the law that was fitted to them, one panel per curve."""

from __future__ import annotations

import math

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bushcli.inverse import Fit, FittedCurve
from bushcli.report.figures.curves import smooth
from bushcli.report.figures.picture import BLACK, BLUE, RED, legend, literal, new_figure, style
from bushcli.report.quantity import percent, quantities
from bushcli.report.views.fit import curves_of

_ACROSS = 3


def coupon_title(fit: Fit) -> str:
    """Return the title of the picture."""
    worst = max(curve.rms_percent for curve in fit.curves)
    return f"{fit.material.law} fitted to {curves_of(fit)}: {percent(worst)} rms at worst"


def coupon_figure(fit: Fit) -> Figure:
    """Draw recorded points and fitted curve of every coupon or channel."""
    with style():
        across = min(_ACROSS, len(fit.curves))
        down = math.ceil(len(fit.curves) / across)
        figure = new_figure(max(3.7 * across, 5.2), 3.6 * down + 0.4)
        panels = figure.subplots(down, across, squeeze=False).ravel()
        for axes, curve in zip(panels, fit.curves, strict=False):
            _panel(axes, curve, fit.stability.get(curve.recording.mode))
        for axes in panels[len(fit.curves) :]:
            axes.set_visible(False)
        figure.suptitle(coupon_title(fit), fontsize=12, fontweight="bold", x=0.01, ha="left")
        return figure


def _panel(axes: Axes, curve: FittedCurve, limits: tuple[float, float] | None) -> None:
    shown = quantities(curve.recording.mode)
    axes.plot(
        shown.shown(curve.recording.displacement),
        curve.recording.force,
        "o",
        color=BLACK,
        ms=3.5,
        mfc="none" if len(curve.recording.force) > 60 else BLACK,
        label="recorded",
    )
    q, force = smooth(curve.smooth or curve.fitted)
    name = "predicted (held out)" if curve.held_out else "fitted"
    axes.plot(shown.shown(q), force, color=BLUE, label=f"{name}, rms {percent(curve.rms_percent)}")
    if limits is not None:
        _shade_unstable(axes, *limits)
    title = curve.name if curve.name == curve.recording.mode else f"{curve.name} ({curve.recording.mode})"
    axes.set_title(literal(title), fontsize=10.5, fontweight="normal")
    axes.set(xlabel=shown.displacement_label, ylabel=shown.force_label)
    legend(axes, loc="best")


def _shade_unstable(axes: Axes, low: float, high: float) -> None:
    """Shade where the law violates Drucker's postulate, inside the view and a little beyond the data."""
    left, right = axes.get_xlim()
    label: str | None = "law unstable"
    for start, stop in ((left, low), (high, right)):
        if stop > start:
            axes.axvspan(start, stop, color=RED, alpha=0.13, lw=0, zorder=0, label=label)
            label = None
    axes.set_xlim(left, right)
