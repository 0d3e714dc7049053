"""Pictures of the parameters' uncertainty: correlation, and profiles with their 95 % intervals."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.interpolate import PchipInterpolator

from bushcli.inverse import Estimate, Fit, Profile
from bushcli.inverse.file_units import parameter_unit
from bushcli.inverse.refit import RISE_95
from bushcli.inverse.result import NORMAL
from bushcli.report.figures.picture import BLUE, GREY, LIGHT, RED, legend, literal, new_figure, style
from bushcli.report.quantity import number

_ACROSS = 3


def correlation_figure(fit: Fit) -> Figure:
    """Draw the correlation of the parameters' errors as a map with numbers."""
    names = list(fit.parameters)
    count = len(names)
    with style():
        figure = new_figure(2.6 + 0.75 * count, 1.5 + 0.7 * count)
        axes = figure.add_subplot()
        axes.grid(False)
        image = axes.imshow(fit.correlation, cmap="RdBu", vmin=-1, vmax=1)
        for i in range(count):
            for j in range(count):
                value = float(fit.correlation[i, j])
                shown = f"{value:+.2f}" if math.isfinite(value) else "-"
                dark = abs(value) > 0.6
                axes.text(
                    j, i, shown, ha="center", va="center", color="white" if dark else "black", fontsize=9.5
                )
        axes.set_xticks(range(count), names)
        axes.set_yticks(range(count), names)
        axes.tick_params(length=0)
        for spine in axes.spines.values():
            spine.set_visible(False)
        figure.colorbar(image, ax=axes, shrink=0.8, ticks=[-1, -0.5, 0, 0.5, 1])
        axes.set_title("Correlation of the errors")
        return figure


def profile_figure(fit: Fit) -> Figure:
    """Draw each profile with the line that ends its 95 % interval."""
    with style():
        across = min(_ACROSS, len(fit.profiles))
        down = math.ceil(len(fit.profiles) / across)
        figure = new_figure(max(3.9 * across, 5.2), 3.5 * down + 0.4)
        panels = figure.subplots(down, across, squeeze=False).ravel()
        for axes, profile in zip(panels, fit.profiles, strict=False):
            _panel(axes, fit, profile, fit.parameters[profile.name])
        for axes in panels[len(fit.profiles) :]:
            axes.set_visible(False)
        figure.suptitle(
            "Profile likelihood",
            fontsize=12,
            fontweight="bold",
            x=0.01,
            ha="left",
        )
        return figure


def _panel(axes: Axes, fit: Fit, profile: Profile, estimate: Estimate) -> None:
    good = np.isfinite(profile.rise)
    values, rise = profile.values[good], profile.rise[good]
    if estimate.interval is not None:
        low, high = estimate.interval
        inside = np.clip([low, high], profile.values.min(), profile.values.max())
        axes.axvspan(*inside, color=LIGHT, lw=0, zorder=0)
    axes.axhline(RISE_95, color=RED, lw=1.2, ls="--", label="95 %")
    if estimate.std > 0:
        # Where profile and parabola differ, the standard error is misleading.
        q = np.linspace(profile.values.min(), profile.values.max(), 101)
        spread = estimate.std * estimate.quantile / NORMAL
        axes.plot(q, ((q - estimate.value) / spread) ** 2, color=GREY, lw=1.0, ls=":", label="standard error")
    if len(values) > 2:
        q = np.linspace(values.min(), values.max(), 101)
        # The signed root of the rise is interpolated, because it is close to a straight line.
        root = np.sign(values - estimate.value) * np.sqrt(np.maximum(rise, 0.0))
        axes.plot(q, PchipInterpolator(values, root)(q) ** 2, color=BLUE)
    axes.plot(values, rise, "o", color=BLUE, ms=4, label="refitted")
    if not good.all():
        # Drawn along the upper edge, because they have no misfit.
        axes.plot(
            profile.values[~good],
            np.full((~good).sum(), 0.95),
            "X",
            color=RED,
            ms=7,
            transform=axes.get_xaxis_transform(),
            label="not solvable",
        )
    axes.axvline(estimate.value, color=BLUE, lw=0.8)
    unit = parameter_unit(fit, profile.name)
    top = max(1.6 * RISE_95, min(float(rise.max(initial=0.0)) * 1.1, 4 * RISE_95))
    axes.set(
        xlabel=literal(profile.name if unit == "1" else f"{profile.name} [{unit}]"),
        ylabel="rise of the misfit [chi square],\nall others refitted",
        ylim=(-0.04 * top, top),
    )
    axes.locator_params(axis="x", nbins=5)
    axes.set_title(literal(_interval(profile.name, estimate)), fontsize=10, fontweight="normal")
    legend(axes, loc="upper center", fontsize=8.5)


def _interval(name: str, estimate: Estimate) -> str:
    if estimate.interval is None:
        return f"{name}: no end within the profile"
    low, high = estimate.interval
    if not math.isfinite(low):
        return f"{name}: 95 % below {number(high)}"
    if not math.isfinite(high):
        return f"{name}: 95 % above {number(low)}"
    return f"{name}: 95 % from {number(low)} to {number(high)}"
