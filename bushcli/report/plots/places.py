"""Plots of where a diagnosis' misfit is: by cycle and displacement, along time and rate; and the test to make next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bushcli.diagnosis.result import DiagnosedChannel, Diagnosis, NextTest
from bushcli.mismatch.bins import KINDS, Bin
from bushcli.mismatch.maps import LocalMap, MissingProfile
from bushcli.report.document import Panels, Plot, Region, Series, Stripe
from bushcli.report.plots.cycles import in_rows
from bushcli.report.plots.diagnosis import BEST, changed, force_range
from bushcli.report.plots.direct import Array, around
from bushcli.report.plots.fit import bar
from bushcli.report.quantity import Quantities, quantities

# Least end of the colour scale, in percent of the force range; a smaller one would show noise in full colours.
_LEAST = 0.2
# Rates that span more than this factor are drawn on a logarithmic axis.
_WIDE = 5.0
# Up to this many points are drawn separately, with error bars.
_FEW = 12
# Cycles up to which each has a name on the axis.
_NAMED = 30


def record_panels(found: Diagnosis, channel: DiagnosedChannel, file: str) -> Panels:
    """Return the mean misfit by cycle, displacement and branch, for the plain law and for the most probable model."""
    rows = [("plain law", [one for one in found.location.bins if one.channel == channel.name])]
    after = [one for one in found.remaining.bins if one.channel == channel.name]
    if after and changed(channel):
        rows.append((BEST, after))
    every = [one for _, bins in rows for one in bins]
    kinds = [kind for kind in KINDS if any(one.branch == kind for one in every)]
    cycles = sorted({one.cycle for one in every})
    scale = 100.0 / force_range(channel)
    end = max([_LEAST, *(abs(scale * one.mean) for one in rows[0][1])])
    units = quantities(channel.mode)
    ends = [_sign(one) * v for one in every for v in (one.displacement_from, one.displacement_to)]
    span = (units.at(min(ends)), units.at(max(ends)))
    step = -(-len(cycles) // _NAMED)
    names = [(i, f"{a}" if a == b else f"{a}-{b}") for i, (a, b) in enumerate(cycles) if i % step == 0]

    def plot(what: str, kind: str, bins: Sequence[Bin]) -> Plot:
        regions, dots = _cells([one for one in bins if one.branch == kind], cycles, units, scale)
        last = what == rows[-1][0]
        return Plot(
            f"{what}-{kind}",
            (units.displacement_label if last else "", "cycle" if kind == kinds[0] else ""),
            [Series("significant", "", *dots, "dots")],
            regions,
            x=(min(span), max(span)),
            y=(len(cycles) - 0.5, -0.5),
            bands=[Stripe("zero", x=(units.rest, units.rest))],
            heading=f"{what}: {kind}",
            height=95.0 + min(24.0 * max(len(cycles), 2), 500.0),
            width=900.0 / len(kinds),
            y_names=names,
            scale=(end, "simulated force too small (-) or too large (+) [% of range]"),
        )

    title = f"{channel.name}: where in the record the simulation misses"
    made = [[plot(what, kind, bins) for kind in kinds] for what, bins in rows]
    note = "dots: more than noise, all bins tested together"
    return Panels(f"{file}-record-map", "record_map", title, made, channel.name, note)


def _sign(one: Bin) -> float:
    return 1.0 if one.side == "positive" else -1.0


def _cells(
    bins: Sequence[Bin], cycles: Sequence[tuple[int, int]], units: Quantities, scale: float
) -> tuple[list[Region], tuple[Array, Array]]:
    """Return a rectangle for each cycle and band, with bins that differ in rate only averaged, weighted by samples."""
    groups: dict[tuple[int, float, float], list[Bin]] = {}
    for one in bins:
        low, high = sorted((_sign(one) * one.displacement_from, _sign(one) * one.displacement_to))
        groups.setdefault((cycles.index(one.cycle), low, high), []).append(one)
    regions, dots = [], []
    for (row, low, high), members in groups.items():
        count = sum(one.samples for one in members)
        mean = _sign(members[0]) * scale * sum(one.samples * one.mean for one in members) / count
        x = (units.at(low), units.at(high))
        regions.append(Region("bar", "", [bar(row, *x, 0.96)], value=mean))
        if any(one.significant for one in members):
            dots.append((sum(x) / 2, float(row)))
    at = np.reshape(dots, (-1, 2))
    return regions, (at[:, 0], at[:, 1])


def missing_panels(channel: DiagnosedChannel, profiles: Sequence[MissingProfile], file: str) -> Panels:
    """Return the misfit that the most probable model leaves in a channel, along each quantity, with its uncertainty."""
    kinds = ("displacement", "time", "cycle", "rate")
    groups = [[one for one in profiles if one.along == along] for along in kinds]
    plots = [profile_plot(group, quantities(channel.mode)) for group in groups if group]
    title = f"{channel.name}: what the most probable model leaves"
    note = "recorded - simulated; bands and bars: two standard deviations to either side"
    return Panels(f"{file}-missing", "missing", title, in_rows(plots, 2), channel.name, note)


def profile_plot(profiles: Sequence[MissingProfile], units: Quantities) -> Plot:
    """Return the misfit along one quantity, a line for each branch."""
    along = profiles[0].along
    factor = units.per_internal if along == "rate" else 1.0
    series, regions, every = [], [], []
    for one in profiles:
        key = one.branch or "all"
        x = np.asarray(units.shown(one.x) if along == "displacement" else factor * one.x)
        order = np.argsort(x)
        x, mean, two = x[order], one.mean[order], 2 * one.std[order]
        every.append(x)
        few = along in ("cycle", "rate") and len(x) <= _FEW
        label = key if len(profiles) > 1 else ""
        series.append(Series(key, label, x, mean, "both" if few else "line", two if few else None))
        if not few:
            regions.append(Region(key, "", [around(x, mean - two, mean + two)]))
    x = np.concatenate(every)
    labels = {
        "displacement": units.displacement_label,
        "time": "time [s]",
        "cycle": "cycle",
        "rate": f"rate [{units.rate_unit}]",
    }
    wide = along == "rate" and x.min() > 0 and x.max() > _WIDE * x.min()
    span = (float(x.min()) / 1.5, float(x.max()) * 1.5) if wide else None
    if along == "cycle":
        span = (float(x.min()) - 0.5, float(x.max()) + 0.5)
    return Plot(
        along,
        (labels[along], "left [% of range]"),
        series,
        regions,
        x=span,
        bands=[Stripe("zero", y=(0.0, 0.0))],
        log="x" if wide else "",
    )


def next_test_panels(found: Diagnosis, test: NextTest) -> Panels:
    """Return the program of the proposed test: displacement over time."""
    mode = {one.name: one.mode for one in found.channels}.get(test.channel, test.channel)
    units = quantities(mode)
    time, q = program(test)
    minutes = time[-1] > 600.0
    speeds = sorted({float(f"{units.per_internal * rate:.3g}") for rate in test.rates})
    heading = f"{test.channel} at {' and '.join(f'{v:g}' for v in speeds)} {units.rate_unit}"
    series = [Series("after", "", time / 60.0 if minutes else time, units.shown(q))]
    label = "time [min]" if minutes else "time [s]"
    bands, title = [Stripe("zero", y=(units.rest, units.rest))], f"Next test: {test.name}"
    plot = Plot(
        "program", (label, units.displacement_label), series, bands=bands, heading=heading, height=240.0
    )
    return Panels("next-test", "next_test", title, [[plot]])


def program(test: NextTest) -> tuple[Array, Array]:
    """Return time (s) and displacement (mm or rad) at the corners of a test's path."""
    time, q = [0.0], [test.points[0]]
    for target, rate, hold in zip(test.points, (None, *test.rates), test.holds, strict=True):
        if rate is not None:
            time.append(time[-1] + abs(target - q[-1]) / rate)
            q.append(target)
        if hold > 0:
            time.append(time[-1] + hold)
            q.append(target)
    return np.array(time), np.array(q)


def numbering(found: LocalMap) -> str:
    """Return "simplex", or how the corners of cells are numbered: "tensor" for a tensor product, "ring" around a face.

    The first four corners are a face: in a tensor product its diagonals join corners 0, 3 and 1, 2, in a ring 0, 2 and
    1, 3. The midpoints of the diagonals coincide, exactly in a parallelogram and nearly in any good cell.
    """
    if found.cells.shape[1] == found.points.shape[1] + 1:
        return "simplex"
    a, b, c, d = (found.points[found.cells[:, i]] for i in range(4))
    tensor = float(np.linalg.norm(a + d - b - c, axis=1).sum())
    ring = float(np.linalg.norm(a + c - b - d, axis=1).sum())
    return "tensor" if tensor <= ring else "ring"
