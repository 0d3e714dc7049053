"""Picture of several laws: the misfit of each law on every channel, compared with the noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bushcli.inverse import Fit, FittedCurve
from bushcli.report.figures.picture import BLACK, BLUE, GREY, ORANGE, literal, log_ticks, new_figure, style
from bushcli.report.quantity import percent


def ranking_figure(fits: Sequence[Fit]) -> Figure:
    """Draw a bar per law and channel; held-out channels have their own colour and come last.

    Parameters
    ----------
    fits
        The best first; it is drawn on top.
    """
    curves = {curve.name: curve for fit in fits for curve in fit.curves}
    order = sorted(curves, key=lambda name: curves[name].held_out)
    laws = [f"{fit.material.law} ({len(fit.parameters)})" for fit in fits]
    at = np.arange(len(fits))
    with style():
        figure = new_figure(2.0 + 3.4 * max(len(order), 1), 1.5 + 0.42 * len(fits))
        panels = figure.subplots(1, len(order), sharey=True, squeeze=False).ravel()
        for axes, name in zip(panels, order, strict=True):
            _panel(axes, fits, curves[name])
        panels[0].set_yticks(at, laws)
        for axes in panels:
            axes.tick_params(axis="y", length=0)
        panels[0].invert_yaxis()
        unfinished = "; grey: not converged" if not all(fit.converged for fit in fits) else ""
        figure.suptitle(
            f"Laws by misfit, best first (number of parameters){unfinished}",
            fontsize=12,
            fontweight="bold",
            x=0.01,
            ha="left",
        )
        return figure


def _panel(axes: Axes, fits: Sequence[Fit], curve: FittedCurve) -> None:
    """Draw the misfits of all laws on one channel, each with its number, and the noise of the recording."""
    at = np.arange(len(fits))
    rms = np.array([{c.name: c.rms_percent for c in fit.curves}.get(curve.name, np.nan) for fit in fits])
    noise = curve.noise_percent
    finite = np.append(rms[np.isfinite(rms) & (rms > 0)], noise if noise > 0 else [])
    left = 0.5 * float(finite.min()) if len(finite) else 0.1
    right = 4.0 * float(finite.max()) if len(finite) else 10.0
    colours = [(ORANGE if curve.held_out else BLUE) if fit.converged else GREY for fit in fits]
    shown = np.where(np.isfinite(rms), rms, left)
    axes.barh(at, shown - left, left=left, color=colours, height=0.62)
    for i, value in enumerate(rms):
        text = percent(float(value)) if np.isfinite(value) else "not solvable"
        axes.annotate(
            text,
            (max(shown[i], left), i),
            (4, 0),
            textcoords="offset points",
            va="center",
            fontsize=9,
        )
    if noise > 0:
        axes.axvline(noise, color=BLACK, lw=1.0, ls="--")
        axes.annotate(
            f"noise {percent(noise)}",
            (noise, 1.0),
            (3, 1),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            fontsize=8.5,
            va="bottom",
        )
    axes.set_xscale("log")
    axes.set_xlim(left, right)
    log_ticks(axes.xaxis, left, right)
    axes.grid(False, axis="y")
    title = f"{curve.name} (held out)" if curve.held_out else curve.name
    axes.set_title(literal(title), fontsize=10.5, fontweight="normal", pad=16)
    axes.set_xlabel("rms misfit [% of the force range]")
