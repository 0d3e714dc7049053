"""Plots of a direct prediction: each curve with its recording and their difference, and the six motions of a path."""

from __future__ import annotations

from typing import Literal

import numpy as np

from bushcli.curve.curve import Curve
from bushcli.recording import Recording
from bushcli.report.document import Array, Panels, Plot, Region, Series, Stripe
from bushcli.report.quantity import Quantities, largest_reactions, number, percent, quantities, shown_motion
from bushcli.report.verdict import stiffer
from bushcli.simulate.misfit import Misfit
from bushcli.simulate.response import Simulated, SixCurve
from cases.six import MOTIONS, REACTIONS

#: Up to this many samples are drawn as separate points, more as a line.
SEPARATE = 80
# Curves of six motions below this share of the largest one of the same kind are not drawn.
_NOTHING = 1e-3


def capital(name: str) -> str:
    """Return the name with a capital letter first."""
    return name[:1].upper() + name[1:]


def colour(number: int) -> str:
    """Return the role of one of many curves, of which there are ten."""
    return f"line-{number % 10}"


def rest_lines(units: Quantities) -> tuple[Stripe, Stripe]:
    """Return the lines of no force and of no displacement."""
    return Stripe("zero", y=(0.0, 0.0)), Stripe("zero", x=(units.rest, units.rest))


def recorded_series(recording: Recording, units: Quantities) -> Series:
    """Return a recording, as points where it has few samples."""
    mark: Literal["dots", "line"] = "dots" if len(recording.displacement) <= SEPARATE else "line"
    q = units.convert(recording.displacement)
    return Series("recorded", "recorded", q, recording.force, mark)


def limits_around(values: Array, share: float = 0.04) -> tuple[float, float]:
    """Return limits around values, with this share of their range free on either side."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = share * (high - low) or 1.0
    return low - margin, high + margin


def smooth(curve: Curve) -> tuple[Array, Array]:
    """Return points to draw a computed curve by; they are interpolated if the curve goes in one direction only."""
    steps = np.diff(curve.displacement)
    if not ((steps > 0).all() or (steps < 0).all()):
        return curve.displacement, curve.force
    q = np.linspace(curve.displacement.min(), curve.displacement.max(), 200)
    return q, curve.at(q)


def curve_title(channel: Simulated, misfit: Misfit | None) -> str:
    """Return the title of a channel's curves; the misfit is None where nothing was compared."""
    name = capital(channel.name)
    units = quantities(channel.mode)
    if misfit is None:
        secant = units.stiffness(channel.curve.secant_stiffness())
        return f"{name}: {number(secant)} {units.stiffness_unit} simulated (secant)"
    if misfit.within:
        return f"{name}: within {misfit.tolerance.text} of the recording ({percent(misfit.rms_percent)} rms)"
    if abs(misfit.stiffness_ratio - 1.0) <= misfit.tolerance.band:
        off = percent(misfit.peak_percent, misfit.tolerance.percent)
        return f"{name}: stiffness within {misfit.tolerance.text}, curve off by up to {off}"
    return f"{name}: simulation {stiffer(misfit.stiffness_ratio, misfit.tolerance.percent)}"


def curve_panels(channel: Simulated, misfit: Misfit | None, file: str) -> Panels:
    """Return a channel's curve, with its recording, the accepted band and the difference where there is a misfit."""
    units = quantities(channel.mode)
    q, force = smooth(channel.curve)
    series = [] if channel.recording is None else [recorded_series(channel.recording, units)]
    series.append(Series("after", "simulated", units.convert(q), force))
    states = units.convert(channel.curve.displacement), channel.curve.force
    if misfit is None:
        series.append(Series("after", "", *states, "dots"))
    if channel.stopped:
        end = int(np.argmax(np.abs(channel.curve.displacement)))
        at, last = (values[[end]] for values in states)
        series.append(Series("stopped", "simulation stopped", at, last, "crosses"))
    title, span = curve_title(channel, misfit), limits_around(np.concatenate([curve.x for curve in series]))
    if misfit is None or channel.recording is None:
        plot = Plot("curve", units.labels, series, bands=rest_lines(units), x=span, height=400.0)
        return Panels(f"{file}-curve", "curve", title, [[plot]], channel.name)
    secants = (misfit.predicted.secant, misfit.measured.secant)
    simulated, measured = (number(units.stiffness(secant)) for secant in secants)
    heading = f"secant stiffness: simulated {simulated}, measured {measured} {units.stiffness_unit}"
    accepted, labels = _tolerance_region(channel.recording, misfit, units), ("", units.force_label)
    plot = Plot("curve", labels, series, [accepted], rest_lines(units), x=span, heading=heading, height=370.0)
    q, off = units.convert(misfit.displacement), 100 * misfit.difference / misfit.force_range
    reach = misfit.tolerance.percent
    below = difference_plot(
        Series("after", "", q, off, "both" if len(q) <= SEPARATE else "line"),
        Stripe("tolerance", y=(-reach, reach)),
        units,
        span,
        f"simulated - recorded, in % of the recorded {units.force} range: rms {percent(misfit.rms_percent)}, "
        f"peak {percent(misfit.peak_percent, reach)}, noise {percent(misfit.noise_percent)}",
    )
    return Panels(f"{file}-curve", "curve", title, [[plot], [below]], channel.name)


def difference_plot(
    off: Series, band: Stripe, units: Quantities, span: tuple[float, float], heading: str
) -> Plot:
    """Return the difference of two curves in percent of the force range, with a band that lies inside the picture."""
    reach = 1.15 * max(band.y[1], float(np.abs(off.y).max()), 1e-3)
    labels, bands = (units.displacement_label, "difference [%]"), (band, *rest_lines(units))
    limits = (-reach, reach)
    return Plot("difference", labels, [off], (), bands, x=span, y=limits, heading=heading, height=190.0)


def _tolerance_region(recording: Recording, misfit: Misfit, units: Quantities) -> Region:
    """Return the recording, branch by branch, widened by the tolerance, a share of its force range."""
    width = misfit.tolerance.band * misfit.force_range
    outlines = []
    for branch in recording.branches:
        # The sample before belongs to both branches; without it the band would have gaps at the turning points.
        part = slice(max(branch.start - 1, 0), branch.stop)
        q, force = recording.displacement[part], recording.force[part]
        if branch.kind == "hold" or len(q) < 2:
            continue
        order = np.argsort(q, kind="stable")
        outlines.append(around(units.convert(q[order]), force[order] - width, force[order] + width))
    label = f"± {misfit.tolerance.percent:g} % of the recorded {units.force} range"
    return Region("tolerance", label, outlines)


def around(x: Array, low: Array, high: Array) -> Array:
    """Return the outline (2 n, 2) of the area between two curves, counter-clockwise: overlapping ones leave no hole."""
    if x[-1] < x[0]:
        x, low, high = x[::-1], low[::-1], high[::-1]
    return np.concatenate([np.stack([x, low], axis=1), np.stack([x, high], axis=1)[::-1]])


def box(x: tuple[float, float], y: tuple[float, float]) -> Array:
    """Return the corners (4, 2) of a rectangle on the axes of the plot."""
    return np.array([(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])])


def bar(at: float, start: float, end: float, height: float = 0.62) -> Array:
    """Return the corners (4, 2) of a horizontal bar; the position and the ends are on the axes of the plot."""
    return box((start, end), (at - height / 2, at + height / 2))


def six_panels(name: str, six: SixCurve, file: str) -> Panels:
    """Return motions and reactions of a path: translations and forces left, rotations and moments right."""
    motion, largest = shown_motion(six), largest_reactions(six.force)
    title = f"{capital(name)}: motions of the inner sleeve, and the reactions"
    above, below = [], []
    for column, (kind, unit, force, force_unit) in enumerate(
        (("displacement", "mm", "force", "N"), ("rotation", "deg", "moment", "N mm"))
    ):
        part = range(3 * column, 3 * column + 3)
        moved = [k for k in part if k in six.free or motion[:, k].any()]
        labels = [MOTIONS[k] + six.follows(k) for k in moved]
        pushed = [k for k in part if np.abs(six.force[:, k]).max() > _NOTHING * largest[column]]
        reactions = [REACTIONS[k] for k in pushed]
        above.append(_over_time(kind, f"{kind} [{unit}]", six.time, motion[:, moved], labels))
        below.append(_over_time(force, f"{force} [{force_unit}]", six.time, six.force[:, pushed], reactions))
    return Panels(f"{file}-six", "six", title, [above, below], name)


def _over_time(what: str, label: str, time: Array, values: Array, labels: list[str]) -> Plot:
    series = [Series(colour(i), name, time, values[:, i], "both") for i, name in enumerate(labels)]
    span = (float(time[0]), float(time[-1]))
    return Plot(what, ("time [s]", label), series, x=span, bands=[Stripe("zero", y=(0.0, 0.0))], width=450.0)
