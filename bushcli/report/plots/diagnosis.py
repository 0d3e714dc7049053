"""Plots of a diagnosed channel: recording, plain law and most probable model with their mismatches, and the misfit."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bushcli.diagnosis.result import DiagnosedChannel, Diagnosis
from bushcli.diagnosis.words import sentence
from bushcli.mismatch.record import Mismatch
from bushcli.report.document import Array, Panels, Plot, Region, Series, Stripe
from bushcli.report.plots.direct import SEPARATE, capital, limits_around
from bushcli.report.plots.fit import force_limits
from bushcli.report.quantity import channel_label, percent, quantities

# Samples of a place at which its number may stand, those of the largest misfit first.
_PLACES = 12
# Share of the axis below which two marks beside each other are drawn as one.
_BESIDE = 1 / 1600
# Label of the curve after the diagnosis.
BEST = "most probable model"


def diagnosed_panels(diagnosis: Diagnosis, channel: DiagnosedChannel, file: str) -> Panels:
    """Return the curves with their mismatches; below them, if simulated, the misfit over time and the noise."""
    rows = [[curve_plot(diagnosis, channel)]]
    if is_simulated(channel):
        rows.append([time_plot(diagnosis, channel)])
    return Panels(f"{file}-diagnosis", "diagnosed", diagnosed_title(channel), rows, channel.name)


def curve_plot(diagnosis: Diagnosis, channel: DiagnosedChannel) -> Plot:
    """Return force over displacement; each numbered area is a mismatch between recording and plain law."""
    units = quantities(channel.mode)
    recorded = channel.recording
    q, path = units.convert(recorded.displacement), units.convert(channel.path)
    mark = "dots" if len(q) <= SEPARATE else "line"
    good = np.where(channel.faulty, np.nan, recorded.force)
    series = [Series("recorded", "recorded", q, good, mark)]  # type: ignore[arg-type]  # mypy infers str
    if is_simulated(channel):
        series.append(Series("before", _label("plain law", channel.before_percent), path, channel.before))
    if differs_from_plain(channel):
        series.append(Series("after", _label(BEST, channel.after_percent), path, channel.after))
    if channel.faulty.any():
        bad = np.where(channel.faulty, recorded.force, np.nan)
        series.append(Series("left_out", "left out: faulty data", q, bad, "crosses"))
    near = np.concatenate([recorded.force[~channel.faulty | channel.faulty.all()], channel.after])

    def between(marked: NDArray[np.bool_]) -> list[Array]:
        measured, plain = np.stack([q, recorded.force], axis=1), np.stack([path, channel.before], axis=1)
        outlines = []
        for run in _pieces(channel, marked):
            outline = np.concatenate([measured[run], plain[run][::-1]])
            x, y = outline.T
            # Counter-clockwise, so that overlapping outlines leave no hole.
            outlines.append(outline if x @ np.roll(y, -1) >= y @ np.roll(x, -1) else outline[::-1])
        return outlines

    middle = np.stack([q, (recorded.force + channel.before) / 2], axis=1)
    return Plot(
        f"curve-{diagnosis.channels.index(channel)}",
        units.labels,
        series,
        _places(diagnosis, channel, between, middle),
        x=limits_around(np.concatenate([q, path]), 0.03),
        y=force_limits(near, channel.before if is_simulated(channel) else near),
        heading=_heading(diagnosis, channel),
        height=430.0,
    )


def time_plot(diagnosis: Diagnosis, channel: DiagnosedChannel) -> Plot:
    """Return the misfit over time, or over the samples, before and after, with the noise as a band.

    The lines are interrupted where samples were left out.
    """
    time = channel.recording.time
    x = np.asarray(np.arange(1.0, len(channel.before) + 1.0)) if time is None else time
    unit = 100.0 / force_range(channel)
    before, after = (
        np.where(channel.faulty, np.nan, unit * (simulated - channel.recording.force))
        for simulated in (channel.before, channel.after)
    )
    series = [Series("before", "plain law", x, before)]
    if differs_from_plain(channel):
        series.append(Series("after", BEST, x, after))
    line = np.stack([x, before], axis=1)

    def below(marked: NDArray[np.bool_]) -> list[Array]:
        ends = [(line[run], [(x[run][-1], 0.0), (x[run][0], 0.0)]) for run in _runs(marked)]
        return [np.concatenate(outline) for outline in ends]

    noise = 2 * channel.noise_percent
    bands = [Stripe("noise", y=(-noise, noise), label="noise (± 2 standard deviations)")]
    bands += _faulty_bands(x, channel.faulty)
    misfits = [before, after, np.array([-1.3 * noise, 1.3 * noise])]
    return Plot(
        f"misfit-{diagnosis.channels.index(channel)}",
        ("sample" if time is None else "time [s]", "misfit [% of range]"),
        series,
        _places(diagnosis, channel, below, line),
        x=limits_around(x, 0.01),
        y=limits_around(np.concatenate(misfits), 0.06),
        bands=bands,
        heading=_heading(diagnosis, channel),
        numbers_only=True,
    )


def diagnosed_title(channel: DiagnosedChannel) -> str:
    """Return the title of the picture."""
    name = capital(channel_label(channel.name, channel.held_out))
    if not is_simulated(channel):
        return f"{name}: recorded, not simulated"
    change = f" before, {percent(channel.after_percent)} after" if differs_from_plain(channel) else ""
    return f"{name}: {percent(channel.before_percent)} rms{change}, noise {percent(channel.noise_percent)}"


def is_simulated(channel: DiagnosedChannel) -> bool:
    """Whether the plain law was simulated: not if the data are faulty, nor if a prediction has failed."""
    return bool(np.isfinite(channel.before).any())


def differs_from_plain(channel: DiagnosedChannel) -> bool:
    """Whether the most probable model differs from the plain law."""
    return not np.allclose(channel.before, channel.after, equal_nan=True)


def _places(
    diagnosis: Diagnosis,
    channel: DiagnosedChannel,
    outlined: Callable[[NDArray[np.bool_]], list[Array]],
    line: Array,
) -> list[Region]:
    """Return the mismatches of a channel, with their numbers among those of all channels.

    Their outlines are those of the samples that are marked; the numbers may stand at the points (n, 2) of a line.
    """
    return [
        Region(
            "stiff" if mismatch.sign in ("too_stiff", "too_high") else "soft",
            sentence(mismatch, len(diagnosis.channels)),
            outlined(mismatch.samples & _compared_samples(channel)),
            i,
            line[_worst_samples(channel, mismatch)],
        )
        for i, mismatch in enumerate(diagnosis.location.mismatch, start=1)
        if mismatch.channel == channel.name
    ]


def force_range(channel: DiagnosedChannel) -> float:
    """Return the recorded force range; faulty samples count only if all samples are faulty."""
    force = channel.recording.force
    return float(np.ptp(force if channel.faulty.all() else force[~channel.faulty]))


def _heading(diagnosis: Diagnosis, channel: DiagnosedChannel) -> str:
    """Return the name of the channel if the diagnosis has several channels, else an empty text."""
    return channel_label(channel.name, channel.held_out) if len(diagnosis.channels) > 1 else ""


def _label(what: str, rms: float) -> str:
    return f"{what}: {percent(rms)} rms"


def _worst_samples(channel: DiagnosedChannel, mismatch: Mismatch) -> NDArray[np.int_]:
    """Return samples of a place, that of the largest misfit first, the others spread over the place."""
    size = np.abs(channel.before - channel.recording.force)
    inside = np.flatnonzero(mismatch.samples & _compared_samples(channel))
    spread = inside[np.linspace(0, len(inside) - 1, min(_PLACES, len(inside))).astype(int)]
    order = spread[np.argsort(-size[spread], kind="stable")]
    return np.concatenate([inside[[int(np.argmax(size[inside]))]], order])


def _compared_samples(channel: DiagnosedChannel) -> NDArray[np.bool_]:
    """Return the samples (n,) at which the plain law is compared with good data."""
    return np.isfinite(channel.before) & ~channel.faulty


def _runs(marked: NDArray[np.bool_], least: int = 2) -> list[slice]:
    """Return the runs of at least `least` neighbouring samples that are marked."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
    return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= least]


def _faulty_bands(x: Array, faulty: NDArray[np.bool_]) -> list[Stripe]:
    """Return a band for each run of faulty samples, to the middle of the gaps around it; neighbours are one band."""
    runs = _runs(faulty, least=1)
    middle = np.concatenate([x[:1], (x[1:] + x[:-1]) / 2, x[-1:]])
    start, stop = middle[[run.start for run in runs]], middle[[run.stop for run in runs]]
    apart = start[1:] - stop[:-1] > _BESIDE * float(np.ptp(x))
    ends = zip(start[np.append(True, apart)], stop[np.append(apart, True)], strict=True) if runs else ()
    return [Stripe("faulty", x=(float(a), float(b))) for a, b in ends]


def _pieces(channel: DiagnosedChannel, marked: NDArray[np.bool_]) -> list[slice]:
    """Return the runs of marked samples, cut where the path turns and where the lines cross; neighbours share a sample.

    An outline that turns back on itself would enclose no area.
    """
    branch = np.zeros(len(marked), dtype=int)
    for i, segment in enumerate(channel.recording.branches):
        branch[segment.start : segment.stop] = i
    above = channel.before > channel.recording.force
    cuts = 1 + np.flatnonzero((np.diff(branch) != 0) | np.diff(above))
    pieces = []
    for run in _runs(marked):
        start, stop = np.searchsorted(cuts, [run.start + 1, run.stop])
        ends = [run.start, *cuts[start:stop], run.stop]
        # A branch ends where the path turns; the next branch begins at the same sample.
        pieces += [slice(max(int(a) - 1, run.start), int(b)) for a, b in pairwise(ends)]
    return [piece for piece in pieces if piece.stop - piece.start >= 2]
