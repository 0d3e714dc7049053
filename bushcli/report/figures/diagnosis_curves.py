"""Recording, plain law and most probable model of a channel, with their mismatches: zoomable, and as a picture."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from numpy.typing import NDArray

from bushcli.diagnosis.result import DiagnosedChannel, Diagnosis
from bushcli.diagnosis.words import sentence
from bushcli.mismatch.record import Mismatch
from bushcli.recording import branches
from bushcli.report.figures.picture import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LIGHT,
    ORANGE,
    RED,
    legend,
    literal,
    new_figure,
    style,
)
from bushcli.report.figures.plot import Plot, Region, Series
from bushcli.report.quantity import percent, quantities
from bushcli.report.views.diagnosis.words import channel_label

Array = NDArray[np.float64]

# Up to this many samples are drawn as separate points, more as a line.
_SEPARATE = 80
# The axes extend at most this share of the force range beyond the curves; a plain law further away leaves the picture.
_LEAVES = 0.6
_COLOURS = {"stiff": RED, "soft": GREEN}
# Label of the curve after the diagnosis.
BEST = "most probable model"


def curve_plot(found: Diagnosis, channel: DiagnosedChannel) -> Plot:
    """Return force over displacement; each numbered area is a mismatch between recording and plain law.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.
    channel : DiagnosedChannel
        The channel to plot.
    """
    units = quantities(channel.mode)
    recorded = channel.recording
    q, path = units.shown(recorded.displacement), units.shown(channel.path)
    few = len(q) <= _SEPARATE
    series = []
    if simulated(channel):
        series.append(Series("before", _label("plain law", channel.before_percent), path, channel.before))
    if changed(channel):
        series.append(Series("after", _label(BEST, channel.after_percent), path, channel.after))
    good = np.where(channel.faulty, np.nan, recorded.force)
    series.append(Series("recorded", "recorded", q, good, dots=few))
    if channel.faulty.any():
        bad = np.where(channel.faulty, recorded.force, np.nan)
        series.append(Series("faulty", "left out: faulty data", q, bad, dots=True))
    regions = []
    for i, mismatch in numbered(found, channel):
        outlines = [
            _oriented(
                np.stack([q[run], recorded.force[run]], axis=1),
                np.stack([path[run], channel.before[run]], axis=1),
            )
            for run in _pieces(channel, mismatch.samples & _known(channel))
        ]
        worst = _worst(channel, mismatch)
        at = (float(q[worst]), float((recorded.force[worst] + channel.before[worst]) / 2))
        text = sentence(mismatch, len(found.channels))
        regions.append(Region(i, _sense(mismatch), text, outlines, at))
    return Plot(
        f"curve-{found.channels.index(channel)}",
        f"{channel.name}: recorded and simulated {units.force} over {units.displacement}",
        units.displacement_label,
        units.force_label,
        _padded(np.concatenate([q, path]), 0.03),
        _force_limits(channel),
        series,
        regions,
        heading=_heading(found, channel),
    )


def time_plot(found: Diagnosis, channel: DiagnosedChannel) -> Plot:
    """Return the misfit over time, or over the samples, before and after, with the noise as a band.

    The lines are interrupted where samples were left out.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.
    channel : DiagnosedChannel
        The channel to plot.
    """
    x = _abscissa(channel)
    before, after = (np.where(channel.faulty, np.nan, one) for one in misfit_percent(channel))
    series = [Series("before", "plain law", x, before)]
    if changed(channel):
        series.append(Series("after", BEST, x, after))
    regions = []
    for i, mismatch in numbered(found, channel):
        runs = _runs(mismatch.samples & _known(channel))
        outlines = [
            np.concatenate([np.stack([x[run], before[run]], axis=1), [[x[run][-1], 0.0], [x[run][0], 0.0]]])
            for run in runs
        ]
        worst = _worst(channel, mismatch)
        regions.append(
            Region(
                i,
                _sense(mismatch),
                sentence(mismatch, len(found.channels)),
                outlines,
                (float(x[worst]), float(before[worst])),
            )
        )
    noise = 2 * channel.noise_percent
    nan = float("nan")
    bands = [(nan, nan, -noise, noise, "noise")]
    bands += [(*_around(x, run), nan, nan, "faulty") for run in _runs(channel.faulty, least=1)]
    misfits = [before, after, np.array([-1.3 * noise, 1.3 * noise])]
    return Plot(
        f"misfit-{found.channels.index(channel)}",
        f"{channel.name}: misfit over time",
        _abscissa_label(channel),
        "misfit [% of range]",
        _padded(x, 0.01),
        _padded(np.concatenate(misfits), 0.06),
        series,
        regions,
        bands,
        height=280.0,
        brief=True,
        heading=_heading(found, channel),
    )


def diagnosed_title(channel: DiagnosedChannel) -> str:
    """Return the title of the picture."""
    name = channel_label(channel)
    name = name[:1].upper() + name[1:]
    if not simulated(channel):
        return f"{name}: recorded, not simulated"
    if not changed(channel):
        return f"{name}: {percent(channel.before_percent)} rms, noise {percent(channel.noise_percent)}"
    before, after = percent(channel.before_percent), percent(channel.after_percent)
    return f"{name}: {before} rms before, {after} after, noise {percent(channel.noise_percent)}"


def diagnosed_figure(found: Diagnosis, channel: DiagnosedChannel) -> Figure:
    """Draw the curves with their mismatches; below them, if simulated, the misfit over time and the noise.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.
    channel : DiagnosedChannel
        The channel to draw.
    """
    plots = [curve_plot(found, channel)]
    if simulated(channel):
        plots.append(time_plot(found, channel))
    drawn = {
        "recorded": {"color": BLACK, "lw": 0.9, "zorder": 3},
        "before": {"color": ORANGE, "lw": 1.6, "zorder": 2},
        "faulty": {"color": RED, "lw": 0, "marker": "x", "ms": 5, "zorder": 3.5},
        "after": {"color": BLUE, "lw": 2.4, "alpha": 0.75, "zorder": 2.5},
    }
    with style():
        figure = new_figure(7.6, 6.8 if len(plots) > 1 else 4.8)
        panels = np.atleast_1d(figure.subplots(len(plots), 1, height_ratios=(2.4, 1)[: len(plots)]))
        for axes, plot in zip(panels, plots, strict=True):
            axes.axhline(0, color=GREY, lw=0.8, zorder=1)
            for x0, x1, y0, y1, key in plot.bands:
                if key == "noise":
                    axes.axhspan(y0, y1, color=LIGHT, lw=0, label="noise (± 2 standard deviations)")
                else:
                    axes.axvspan(x0, x1, color="#fbe3d6", lw=0, zorder=0)
            for region in plot.regions:
                outline = Path.make_compound_path(*(Path(points, closed=False) for points in region.outlines))
                colour = _COLOURS[region.key]
                axes.add_patch(PathPatch(outline, fc=colour, alpha=0.28, lw=0, zorder=1.5))
                axes.annotate(
                    str(region.number),
                    region.at,
                    ha="center",
                    va="center",
                    fontsize=9,
                    fontweight="bold",
                    color="white",
                    zorder=5,
                    bbox={"boxstyle": "circle,pad=0.25", "fc": _COLOURS[region.key], "ec": "white"},
                )
            for one in plot.series:
                look = dict(drawn[one.key])
                if one.dots and one.key != "faulty":
                    look |= {"lw": 0, "marker": "o", "ms": 3.5}
                axes.plot(one.x, one.y, label=one.label, **look)
            axes.set(xlabel=plot.x_label, ylabel=plot.y_label, xlim=plot.x, ylim=plot.y)
        if len(plots) > 1:
            panels[1].set_ylabel("simulated -\nrecorded [%]")
        panels[0].set_title(literal(diagnosed_title(channel)))
        legend(panels[0], loc="upper left")
        figure.align_ylabels(list(panels))
        return figure


def simulated(channel: DiagnosedChannel) -> bool:
    """Whether the plain law was simulated: not if the data are faulty, nor if a prediction has failed."""
    return bool(np.isfinite(channel.before).any())


def changed(channel: DiagnosedChannel) -> bool:
    """Whether the most probable model differs from the plain law."""
    return not np.allclose(channel.before, channel.after, equal_nan=True)


def numbered(found: Diagnosis, channel: DiagnosedChannel) -> list[tuple[int, Mismatch]]:
    """Return the mismatches of a channel, each with its number from 1 among those of all channels.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.
    channel : DiagnosedChannel
        The channel whose mismatches are returned.
    """
    return [(i, one) for i, one in enumerate(found.location.mismatch, start=1) if one.channel == channel.name]


def misfit_percent(channel: DiagnosedChannel) -> tuple[Array, Array]:
    """Return simulated minus recorded force before and after, in percent of the recorded force range."""
    force = channel.recording.force
    unit = 100.0 / force_range(channel)
    return unit * (channel.before - force), unit * (channel.after - force)


def force_range(channel: DiagnosedChannel) -> float:
    """Return the recorded force range; faulty samples count only if all samples are faulty."""
    force = channel.recording.force
    return float(np.ptp(force if channel.faulty.all() else force[~channel.faulty]))


def _abscissa(channel: DiagnosedChannel) -> Array:
    if channel.recording.time is None:
        return np.asarray(np.arange(1.0, len(channel.before) + 1.0))
    return channel.recording.time


def _abscissa_label(channel: DiagnosedChannel) -> str:
    return "time [s]" if channel.recording.time is not None else "sample"


def _heading(found: Diagnosis, channel: DiagnosedChannel) -> str:
    """Return the name of the channel if the diagnosis has several channels, else an empty text."""
    return channel_label(channel) if len(found.channels) > 1 else ""


def _label(what: str, rms: float) -> str:
    return f"{what}: {percent(rms)} rms"


def _sense(mismatch: Mismatch) -> str:
    return "stiff" if mismatch.sign in ("too_stiff", "too_high") else "soft"


def _worst(channel: DiagnosedChannel, mismatch: Mismatch) -> int:
    size = np.abs(channel.before - channel.recording.force)
    return int(np.argmax(np.where(mismatch.samples & _known(channel), size, -1.0)))


def _known(channel: DiagnosedChannel) -> NDArray[np.bool_]:
    """Return the samples (n,) at which the plain law is compared with good data."""
    return np.isfinite(channel.before) & ~channel.faulty


def _runs(marked: NDArray[np.bool_], least: int = 2) -> list[slice]:
    """Return the runs of at least `least` neighbouring samples that are marked."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
    return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= least]


def _around(x: Array, run: slice) -> tuple[float, float]:
    """Return the interval from the middle of the gap before a run of samples to the middle of the gap after it."""
    ends = np.concatenate([x[:1], (x[1:] + x[:-1]) / 2, x[-1:]])
    return float(ends[run.start]), float(ends[run.stop])


def _pieces(channel: DiagnosedChannel, marked: NDArray[np.bool_]) -> list[slice]:
    """Return the runs of marked samples, cut where the path turns and where the lines cross; neighbours share a sample.

    An outline that turns back on itself would enclose no area.
    """
    branch = np.zeros(len(marked), dtype=int)
    for i, one in enumerate(branches(channel.recording)):
        branch[one.start : one.stop] = i
    above = channel.before > channel.recording.force
    cuts = 1 + np.flatnonzero((np.diff(branch) != 0) | np.diff(above))
    pieces = []
    for run in _runs(marked):
        ends = [run.start, *cuts[(cuts > run.start) & (cuts < run.stop)], run.stop]
        # A branch ends where the path turns; the next branch begins at the same sample.
        pieces += [slice(max(int(a) - 1, run.start), int(b)) for a, b in pairwise(ends)]
    return [piece for piece in pieces if piece.stop - piece.start >= 2]


def _oriented(one: Array, other: Array) -> Array:
    """Return the outline (2 n, 2) between two lines, counter-clockwise, so that overlapping outlines leave no hole."""
    points = np.concatenate([one, other[::-1]])
    x, y = points.T
    area = float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    return points if area >= 0 else points[::-1]


def _padded(values: Array, share: float) -> tuple[float, float]:
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = share * (high - low) or 1.0
    return low - margin, high + margin


def _force_limits(channel: DiagnosedChannel) -> tuple[float, float]:
    recorded = np.where(channel.faulty, np.nan, channel.recording.force)
    if channel.faulty.all():
        recorded = channel.recording.force
    both = np.concatenate([recorded, channel.after])
    low, high = float(np.nanmin(both)), float(np.nanmax(both))
    reach = _LEAVES * (high - low)
    before = channel.before if simulated(channel) else both
    ends = [max(low - reach, float(np.nanmin(before))), min(high + reach, float(np.nanmax(before)))]
    return _padded(np.array([low, high, *ends]), 0.05)
