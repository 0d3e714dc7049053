"""Pictures of an identified law: its curves before and after, the search, and what the curves determine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bushcli.inverse import Fit, FittedCurve
from bushcli.report.figures.certainty import correlation_figure, profile_figure
from bushcli.report.figures.curves import smooth
from bushcli.report.figures.picture import (
    BLACK,
    BLUE,
    GREY,
    LIGHT,
    ORANGE,
    RED,
    Picture,
    legend,
    literal,
    new_figure,
    picture,
    style,
)
from bushcli.report.figures.ranking import ranking_figure
from bushcli.report.figures.search import convergence_figure, ends_figure
from bushcli.report.quantity import Quantities, percent, quantities

Array = NDArray[np.float64]

# Up to this many samples are drawn as separate points, more as a line.
_SEPARATE = 80
# The axes extend at most this share of the force range beyond the curves; a start further away leaves the picture.
_LEAVES = 0.6


def inverse_figures(fits: Sequence[Fit], names: Mapping[str, str]) -> tuple[Picture, ...]:
    """Return the pictures of curves, search and certainty and, for several laws, of their ranking.

    Parameters
    ----------
    fits
        The best first; all pictures except the ranking show the best law.
    names
        Channel -> name for its files.
    """
    best = fits[0]
    found = [
        picture(
            f"{names[curve.name]}-identified", "curve", fitted_title(curve), fitted_figure(curve), curve.name
        )
        for curve in best.curves
    ]
    if len(fits) > 1:
        found.append(picture("ranking", "ranking", "Misfit of each law", ranking_figure(fits)))
    if best.profiles:
        title = "Profiles of the poorly determined parameters"
        found.append(
            picture(
                "profiles", "profiles" if len(best.profiles) > 1 else "certainty", title, profile_figure(best)
            )
        )
    if len(best.parameters) > 1:
        title = "Correlation of the parameters' errors"
        found.append(picture("correlation", "certainty", title, correlation_figure(best)))
    if best.evaluations:
        found.append(picture("convergence", "convergence", "The search", convergence_figure(best)))
    if len(best.end_points) > 1:
        title = f"Where {len(best.end_points)} starts ended"
        found.append(picture("starts", "starts", title, ends_figure(best)))
    return tuple(found)


def fitted_title(curve: FittedCurve) -> str:
    """Return the title of the picture."""
    name = curve.name[:1].upper() + curve.name[1:]
    rms = percent(curve.rms_percent)
    if curve.held_out:
        return f"{name}, held out: predicted to {rms} rms"
    if np.isfinite(curve.started_percent):
        return f"{name}: {percent(curve.started_percent)} rms before, {rms} after"
    return f"{name}: fitted to {rms} rms"


def fitted_figure(curve: FittedCurve) -> Figure:
    """Draw recording, start and fit; below them the remaining misfit with the noise."""
    with style():
        figure = new_figure(6.8, 6.0)
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.15))
        shown = quantities(curve.recording.mode)
        above.axhline(0, color=GREY, lw=0.8, zorder=1)
        above.axvline(shown.rest, color=GREY, lw=0.8, zorder=1)
        few = len(curve.recording.force) <= _SEPARATE
        above.plot(
            shown.shown(curve.recording.displacement),
            curve.recording.force,
            color=BLACK,
            lw=0 if few else 0.9,
            marker="o" if few else "",
            ms=3.5,
            label="recorded",
            # On top and thin, so that both are visible where they agree.
            zorder=3.5,
        )
        _before(above, curve, shown)
        q, force = smooth(curve.smooth or curve.fitted)
        label = "predicted (held out)" if curve.held_out else "after"
        above.plot(
            shown.shown(q),
            force,
            color=BLUE,
            lw=3.0,
            alpha=0.75,
            label=f"{label}: {percent(curve.rms_percent)} rms",
            zorder=3,
        )
        reach = float(np.ptp(curve.recording.displacement)) * shown.per_internal
        above.set_xlim(float(shown.shown(q).min()) - 0.04 * reach, float(shown.shown(q).max()) + 0.04 * reach)
        above.set(ylabel=shown.force_label, title=literal(fitted_title(curve)))
        legend(above, loc="upper left")
        _left(below, curve, shown)
        figure.align_ylabels([above, below])
        return figure


def _before(axes: Axes, curve: FittedCurve, shown: Quantities) -> None:
    """Draw the start, and limit the axes so that a distant start does not dwarf the recording."""
    if curve.started is None:
        return
    order = np.argsort(curve.started.displacement, kind="stable")
    axes.plot(
        shown.shown(curve.started.displacement[order]),
        curve.started.force[order],
        color=ORANGE,
        ls="--",
        lw=1.5,
        label=f"before: {percent(curve.started_percent)} rms",
        zorder=2,
    )
    both = np.concatenate([curve.recording.force, curve.fitted.force])
    low, high = float(both.min()), float(both.max())
    reach = _LEAVES * (high - low)
    bottom = max(low - reach, float(curve.started.force.min()))
    top = min(high + reach, float(curve.started.force.max()))
    margin = 0.06 * (high - low)
    axes.set_ylim(min(low, bottom) - margin, max(high, top) + margin)


def _left(axes: Axes, curve: FittedCurve, shown: Quantities) -> None:
    """Draw fitted minus recorded force in percent of the force range, with the noise."""
    span = float(np.ptp(curve.recording.force))
    difference = 100 * (curve.fitted.force - curve.recording.force) / span
    noise = float(np.nan_to_num(curve.noise_percent))
    axes.axhspan(-2 * noise, 2 * noise, color=LIGHT, lw=0)
    axes.axhline(0, color=GREY, lw=0.8)
    # Dots, because lines from cycle to cycle would hide whether the misfit follows the displacement.
    q = shown.shown(curve.recording.displacement)
    axes.plot(q, difference, "o", color=RED, ms=2.2 if len(difference) > _SEPARATE else 3.5, mew=0)
    reach = 1.15 * max(3 * noise, float(np.abs(difference).max()), 1e-3)
    axes.set(
        xlabel=shown.displacement_label,
        ylabel=f"{'predicted' if curve.held_out else 'after'} -\nrecorded [%]",
        ylim=(-reach, reach),
    )
    axes.set_title(
        f"difference in % of the recorded {shown.force} range: rms {percent(curve.rms_percent)}; "
        f"grey: noise {percent(noise)}, ± 2 sigma",
        fontsize=9,
        fontweight="normal",
        pad=4,
    )
