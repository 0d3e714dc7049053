"""A simulated curve, alone or with its recording, the accepted band and, below, the difference."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bushcli.curve.curve import Curve
from bushcli.recording import Recording, branches
from bushcli.report.figures.picture import BLACK, BLUE, GREY, LIGHT, RED, legend, literal, new_figure, style
from bushcli.report.quantity import Quantities, number, percent, quantities
from bushcli.report.verdict import stiffer
from bushcli.simulate.misfit import Misfit
from bushcli.simulate.response import Simulated

Array = NDArray[np.float64]

# Up to this many samples are drawn as separate points, more as a line.
_SEPARATE = 80


def curve_title(channel: Simulated, found: Misfit | None) -> str:
    """Return the title of a channel's picture.

    Parameters
    ----------
    channel : Simulated
        The simulated channel.
    found : Misfit or None
        Its misfit; None where nothing was compared.
    """
    name = channel.name[:1].upper() + channel.name[1:]
    shown = quantities(channel.mode)
    if found is None:
        secant = shown.stiffness(channel.curve.secant_stiffness())
        return f"{name}: {number(secant)} {shown.stiffness_unit} simulated (secant)"
    if found.within:
        return f"{name}: within {found.tolerance.text} of the recording ({percent(found.rms_percent)} rms)"
    if abs(found.stiffness_ratio - 1.0) <= found.tolerance.band:
        return f"{name}: stiffness within {found.tolerance.text}, curve off by up to {percent(found.peak_percent)}"
    return f"{name}: simulation {stiffer(found.stiffness_ratio)}"


def curve_figure(channel: Simulated, found: Misfit | None) -> Figure:
    """Draw a channel, with its recording, the accepted band and the difference where there is a misfit.

    Parameters
    ----------
    channel : Simulated
        The simulated channel.
    found : Misfit or None
        Its misfit; None where nothing was compared.
    """
    with style():
        if found is None or channel.recording is None:
            return _alone(channel)
        return _compared(channel, channel.recording, found)


def _alone(channel: Simulated) -> Figure:
    figure = new_figure(6.8, 4.4)
    axes = figure.add_subplot()
    shown = quantities(channel.mode)
    _zero_lines(axes, shown)
    if channel.recording is not None:
        _recorded(axes, channel.recording, shown)
    _simulated(axes, channel, shown, marked=True)
    _stop(axes, channel, shown)
    axes.set(
        xlabel=shown.displacement_label, ylabel=shown.force_label, title=literal(curve_title(channel, None))
    )
    legend(axes, loc="best")
    return figure


def _compared(channel: Simulated, recording: Recording, found: Misfit) -> Figure:
    figure = new_figure(6.8, 6.0)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.15))
    shown = quantities(channel.mode)
    _zero_lines(above, shown)
    _band(above, recording, found, shown)
    _recorded(above, recording, shown)
    _simulated(above, channel, shown)
    _stop(above, channel, shown)
    above.set(ylabel=shown.force_label, title=literal(curve_title(channel, found)))
    legend(above, loc="upper left")
    unit = shown.stiffness_unit
    above.annotate(
        f"secant stiffness\nsimulated {number(shown.stiffness(found.predicted.secant))} {unit}\n"
        f"measured {number(shown.stiffness(found.measured.secant))} {unit}",
        (0.985, 0.04),
        xycoords="axes fraction",
        ha="right",
        va="bottom",
        fontsize=9.5,
        bbox={"boxstyle": "round,pad=0.4", "fc": "white", "ec": LIGHT},
    )
    _residual(below, channel, found, shown)
    figure.align_ylabels([above, below])
    return figure


def _residual(axes: Axes, channel: Simulated, found: Misfit, shown: Quantities) -> None:
    """Draw simulated minus recorded force in percent of the force range, with the accepted band."""
    percent_off = 100 * found.difference / found.force_range
    axes.axhspan(-found.tolerance.percent, found.tolerance.percent, color=LIGHT, lw=0)
    axes.axhline(0, color=GREY, lw=0.8)
    q = shown.shown(found.displacement)
    few = len(q) <= _SEPARATE
    axes.plot(q, percent_off, color=RED, lw=1.1, marker="o" if few else "", ms=2.5)
    reach = 1.15 * max(found.tolerance.percent, float(np.abs(percent_off).max()))
    axes.set(
        xlabel=shown.displacement_label,
        ylabel="simulated -\nrecorded [%]",
        ylim=(-reach, reach),
    )
    axes.set_title(
        f"difference in % of the recorded {shown.force} range: rms {percent(found.rms_percent)}, "
        f"peak {percent(found.peak_percent)}, noise {percent(found.noise_percent)}",
        fontsize=9,
        fontweight="normal",
        pad=4,
    )


def _zero_lines(axes: Axes, shown: Quantities) -> None:
    axes.axhline(0, color=GREY, lw=0.8, zorder=1)
    axes.axvline(shown.rest, color=GREY, lw=0.8, zorder=1)


def _band(axes: Axes, recording: Recording, found: Misfit, shown: Quantities) -> None:
    """Draw the recording, branch by branch, widened by the tolerance, a share of its force range."""
    width = found.tolerance.band * found.force_range
    for i, branch in enumerate(branches(recording)):
        # The sample before belongs to both branches; without it the band would have gaps at the turning points.
        part = slice(max(branch.start - 1, 0), branch.stop)
        q, force = recording.displacement[part], recording.force[part]
        if branch.kind == "hold" or len(q) < 2:
            continue
        order = np.argsort(q, kind="stable")
        axes.fill_between(
            shown.shown(q[order]),
            force[order] - width,
            force[order] + width,
            color=LIGHT,
            lw=0,
            zorder=0.5,
            label=f"± {found.tolerance.percent:g} % of the recorded {shown.force} range" if i == 0 else None,
        )


def _recorded(axes: Axes, recording: Recording, shown: Quantities) -> None:
    few = len(recording.displacement) <= _SEPARATE
    axes.plot(
        shown.shown(recording.displacement),
        recording.force,
        color=BLACK,
        lw=0 if few else 1.0,
        marker="o" if few else "",
        ms=3.5,
        label="recorded",
        zorder=2.5,
    )


def _simulated(axes: Axes, channel: Simulated, shown: Quantities, marked: bool = False) -> None:
    """Draw the curve, interpolated between the steps of the march if it goes in one direction only."""
    curve = channel.curve
    q, force = smooth(curve)
    axes.plot(shown.shown(q), force, color=BLUE, label="simulated", zorder=3)
    if marked:
        axes.plot(shown.shown(curve.displacement), curve.force, "o", color=BLUE, ms=3, zorder=3)


def _stop(axes: Axes, channel: Simulated, shown: Quantities) -> None:
    if not channel.stopped:
        return
    end = int(np.argmax(np.abs(channel.curve.displacement)))
    axes.plot(
        shown.shown(channel.curve.displacement[end : end + 1]),
        channel.curve.force[end : end + 1],
        "X",
        color=RED,
        ms=9,
        zorder=4,
        label="simulation stopped",
    )


def smooth(curve: Curve) -> tuple[Array, Array]:
    """Return points to draw a computed curve by; they are interpolated if the curve goes in one direction only."""
    steps = np.diff(curve.displacement)
    if not ((steps > 0).all() or (steps < 0).all()):
        return curve.displacement, curve.force
    q = np.linspace(curve.displacement.min(), curve.displacement.max(), 200)
    return q, curve.at(q)
