"""Pictures of the search: misfit and parameters by evaluation, and the ends of several starts."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator
from numpy.typing import NDArray

from bushcli.inverse import Evaluation, Fit
from bushcli.report.figures.picture import (
    BLACK,
    BLUE,
    GREY,
    LIGHT,
    RED,
    legend,
    literal,
    log_ticks,
    new_figure,
    style,
)
from bushcli.report.quantity import number

Array = NDArray[np.float64]

# The legend is outside, so that it hides no curve.
_BESIDE: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.03), "frameon": False}
# Labelled ratios on an axis that is linear up to two and logarithmic beyond.
_RATIOS = [sign * ratio for sign in (-1, 1) for ratio in (1, 2, 10, 100, 1000, 1e4)] + [0]
# Largest number of evaluations that are drawn with a mark on each.
_SEPARATE = 60
# Ends whose misfits differ by less than this ratio share one colour, because such differences are insignificant.
_SPREAD = 1.5


def convergence_figure(fit: Fit) -> Figure:
    """Draw misfit and parameters of every evaluation; those that could not be solved are marked."""
    with style():
        figure = new_figure(9.0, 5.6)
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.2, 1))
        number_of = np.array([e.number for e in fit.evaluations])
        # Misfit in units of the noise, as during the search: the cost is its square.
        misfit = np.sqrt([e.cost for e in fit.evaluations])
        profiles = np.array([e.stage == "profile" for e in fit.evaluations])
        _shade(above, number_of, profiles, "for the profiles")
        _shade(below, number_of, profiles)
        _misfit(above, number_of, misfit, profiles)
        _parameters(below, fit, number_of, fit.evaluations)
        below.set(xlabel="evaluation of all channels", xlim=(0.5, float(number_of.max()) + 0.5))
        below.xaxis.set_major_locator(MaxNLocator(integer=True))
        end = "converged" if fit.converged else "not converged"
        above.set_title(
            literal(
                f"{fit.material.law}, {fit.method}: {end} after {fit.sweeps} evaluations, {fit.seconds:.0f} s"
            )
        )
        figure.align_ylabels([above, below])
        return figure


def _shade(axes: Axes, number_of: Array, profiles: NDArray[np.bool_], label: str | None = None) -> None:
    if profiles.any():
        first = float(number_of[profiles].min()) - 0.5
        axes.axvspan(first, float(number_of.max()) + 0.5, color=LIGHT, lw=0, zorder=0, label=label)


def _misfit(axes: Axes, number_of: Array, misfit: Array, profiles: NDArray[np.bool_]) -> None:
    good = np.isfinite(misfit) & (misfit > 0)
    few = len(misfit) <= _SEPARATE
    axes.plot(
        number_of[good],
        misfit[good],
        color=GREY,
        lw=0.8 if few else 0.5,
        marker="o",
        ms=4 if few else 2,
        label="evaluation",
    )
    searched = good & ~profiles
    if searched.any():
        so_far = np.minimum.accumulate(misfit[searched])
        axes.plot(number_of[searched], so_far, color=BLUE, drawstyle="steps-post", label="best so far")
    axes.axhline(1.0, color=BLACK, lw=0.8, ls=":", label="noise")
    axes.set_yscale("log")
    failed = number_of[~np.isfinite(misfit)]
    if len(failed):
        bottom, top = axes.get_ylim()
        axes.set_ylim(top=top * (top / bottom) ** 0.12)
        # Drawn along the upper edge, because they have no misfit.
        axes.plot(
            failed,
            np.full(len(failed), 0.95),
            "X",
            color=RED,
            ms=7,
            transform=axes.get_xaxis_transform(),
            label="not solvable",
        )
    log_ticks(axes.yaxis, *axes.get_ylim())
    axes.set(ylabel="misfit / noise")
    legend(axes, **_BESIDE)


def _parameters(axes: Axes, fit: Fit, number_of: Array, evaluations: tuple[Evaluation, ...]) -> None:
    """Draw the ratio of each parameter to its identified value, so that all of them end at one."""
    marks = "os^Dv<>P*"
    few = len(evaluations) <= _SEPARATE
    colours = colormaps["tab10"].colors  # type: ignore[attr-defined]  # a list of colours, which the stubs do not know
    for i, (name, estimate) in enumerate(fit.parameters.items()):
        unit = estimate.value if estimate.value else 1.0
        values = np.array([e.parameters.get(name, np.nan) for e in evaluations]) / unit
        axes.plot(
            number_of,
            values,
            color=colours[i % 10],
            lw=1.2,
            marker=marks[i % len(marks)] if few else "",
            ms=3.5,
            label=literal(name),
        )
    # Linear around one, logarithmic beyond: starts may deviate by factors of hundreds.
    axes.set_yscale("symlog", linthresh=2.0, linscale=2.0)
    axes.yaxis.set_major_locator(FixedLocator(_RATIOS))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.axhline(1.0, color=GREY, lw=0.8)
    axes.set(ylabel="parameter /\nidentified value")
    legend(axes, **_BESIDE)


def ends_figure(fit: Fit) -> Figure:
    """Draw starts and ends as lines across the parameters' axes, coloured by the misfit at the end."""
    names = list(fit.parameters)
    starts = np.array([[end.start[name] for name in names] for end in fit.end_points])
    ends = np.array([[end.parameters[name] for name in names] for end in fit.end_points])
    misfit = np.sqrt([end.cost for end in fit.end_points])
    finite = misfit[np.isfinite(misfit) & (misfit > 0)]
    best = float(finite.min()) if len(finite) else 1.0
    norm = LogNorm(best, max(float(finite.max(initial=best)), _SPREAD * best))
    with style():
        figure = new_figure(max(6.5, 2.6 + 1.7 * len(names)), 4.8)
        axes = figure.add_subplot()
        axes.grid(False)
        low, high = np.minimum(starts, ends).min(axis=0), np.maximum(starts, ends).max(axis=0)
        span = np.where(high > low, high - low, 1.0)
        at = np.arange(len(names))
        for j in range(len(names)):
            axes.axvline(j, color=GREY, lw=0.8, zorder=1)
        for row in (starts - low) / span:
            axes.plot(at, row, color=GREY, lw=0.8, ls=":", marker="o", ms=3, mfc="white", zorder=2)
        colours = colormaps["viridis"]
        # The best end is drawn last, on top.
        for row, size in reversed(list(zip((ends - low) / span, misfit, strict=True))):
            colour = colours(norm(size)) if np.isfinite(size) else RED
            axes.plot(at, row, color=colour, lw=1.8, marker="o", ms=5, zorder=3)
        axes.plot([], [], color=GREY, lw=0.8, ls=":", marker="o", ms=3, mfc="white", label="start")
        axes.plot([], [], color=colours(0.2), marker="o", ms=5, label="end")
        labels = [
            f"{name}\nfrom {number(a)}\nto {number(b)}" for name, a, b in zip(names, low, high, strict=True)
        ]
        axes.set_xticks(at, [literal(label) for label in labels])
        axes.tick_params(length=0)
        axes.set(yticks=[], ylim=(-0.05, 1.05), xlim=(-0.3, len(names) - 0.7))
        for spine in axes.spines.values():
            spine.set_visible(False)
        bar = figure.colorbar(ScalarMappable(norm, colours), ax=axes, label="misfit / noise at the end")
        bar.ax.minorticks_off()
        ticks = np.geomspace(norm.vmin or best, norm.vmax or best, 4)
        bar.set_ticks(list(ticks), labels=[number(tick) for tick in ticks])
        equal = int(np.sum(misfit <= 1.05 * best))
        axes.set_title(f"Where {len(ends)} starts ended: {equal} at the best misfit")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
        return figure
