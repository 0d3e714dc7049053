"""Plots of where a diagnosis' misfit is: by cycle and displacement, along time and rate; and the test to make next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bushcli.diagnosis.result import DiagnosedChannel, Diagnosis, NextTest
from bushcli.mismatch.bins import KINDS, Bin
from bushcli.mismatch.maps import LocalMap, MissingProfile
from bushcli.report.document import Array, Panels, Plot, Region, Series, Stripe
from bushcli.report.plots.cycles import in_rows
from bushcli.report.plots.diagnosis import BEST, differs_from_plain, force_range
from bushcli.report.plots.direct import around, bar, capital
from bushcli.report.quantity import Quantities, quantities

# Least end of the colour scale, in percent of the force range; a smaller one would show noise in full colours.
_LEAST = 0.2
# Rates that span more than this factor are drawn on a logarithmic axis.
_WIDE = 5.0
# Up to this many points are drawn separately, with error bars.
_FEW = 12
# Cycles up to which each has a name on the axis.
_NAMED = 30


def record_panels(diagnosis: Diagnosis, channel: DiagnosedChannel, file: str) -> Panels:
    """Return the mean misfit by cycle, displacement and branch, for the plain law and for the most probable model."""
    rows = [("plain law", [bin_ for bin_ in diagnosis.location.bins if bin_.channel == channel.name])]
    after = [bin_ for bin_ in diagnosis.remaining.bins if bin_.channel == channel.name]
    if after and differs_from_plain(channel):
        rows.append((BEST, after))
    all_bins = [bin_ for _, bins in rows for bin_ in bins]
    kinds = [kind for kind in KINDS if any(bin_.branch == kind for bin_ in all_bins)]
    cycles = sorted({bin_.cycle for bin_ in all_bins})
    scale = 100.0 / force_range(channel)
    end = max([_LEAST, *(abs(scale * bin_.mean) for bin_ in rows[0][1])])
    units = quantities(channel.mode)
    ends = [_sign(bin_) * v for bin_ in all_bins for v in (bin_.displacement_from, bin_.displacement_to)]
    span = (units.at(min(ends)), units.at(max(ends)))
    step = -(-len(cycles) // _NAMED)
    names = [(i, f"{a}" if a == b else f"{a}-{b}") for i, (a, b) in enumerate(cycles) if i % step == 0]

    def plot(what: str, kind: str, bins: Sequence[Bin]) -> Plot:
        regions, dots = _cells([bin_ for bin_ in bins if bin_.branch == kind], cycles, units, scale)
        is_last = what == rows[-1][0]
        return Plot(
            f"{what}-{kind}",
            (units.displacement_label if is_last else "", "cycle" if kind == kinds[0] else ""),
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

    title = f"{capital(channel.name)}: where in the record the simulation misses"
    plots = [[plot(what, kind, bins) for kind in kinds] for what, bins in rows]
    note = "dots: more than noise, all bins tested together"
    return Panels(f"{file}-record-map", "record_map", title, plots, channel.name, note)


def _sign(bin_: Bin) -> float:
    return 1.0 if bin_.side == "positive" else -1.0


def _cells(
    bins: Sequence[Bin], cycles: Sequence[tuple[int, int]], units: Quantities, scale: float
) -> tuple[list[Region], tuple[Array, Array]]:
    """Return a rectangle for each cycle and band, with bins that differ in rate only averaged, weighted by samples."""
    groups: dict[tuple[int, float, float], list[Bin]] = {}
    for bin_ in bins:
        low, high = sorted((_sign(bin_) * bin_.displacement_from, _sign(bin_) * bin_.displacement_to))
        groups.setdefault((cycles.index(bin_.cycle), low, high), []).append(bin_)
    regions, dots = [], []
    for (row, low, high), members in groups.items():
        count = sum(bin_.samples for bin_ in members)
        mean = _sign(members[0]) * scale * sum(bin_.samples * bin_.mean for bin_ in members) / count
        x = (units.at(low), units.at(high))
        regions.append(Region("bar", "", [bar(row, *x, 0.96)], value=mean))
        if any(bin_.significant for bin_ in members):
            dots.append((sum(x) / 2, float(row)))
    at = np.reshape(dots, (-1, 2))
    return regions, (at[:, 0], at[:, 1])


def missing_panels(channel: DiagnosedChannel, profiles: Sequence[MissingProfile], file: str) -> Panels:
    """Return the misfit that the most probable model leaves in a channel, along each quantity, with its uncertainty."""
    kinds = ("displacement", "time", "cycle", "rate")
    groups = [[profile for profile in profiles if profile.along == along] for along in kinds]
    plots = [profile_plot(group, quantities(channel.mode)) for group in groups if group]
    title = f"{capital(channel.name)}: what the most probable model leaves"
    note = "recorded - simulated; bands and bars: two standard deviations to either side"
    return Panels(f"{file}-missing", "missing", title, in_rows(plots, 2), channel.name, note)


def profile_plot(profiles: Sequence[MissingProfile], units: Quantities) -> Plot:
    """Return the misfit along one quantity, a line for each branch."""
    along = profiles[0].along
    factor = units.per_internal if along == "rate" else 1.0
    series, regions = [], []
    for profile in profiles:
        key = profile.branch or "all"
        x = np.asarray(units.convert(profile.x) if along == "displacement" else factor * profile.x)
        order = np.argsort(x)
        x, mean, two = x[order], profile.mean[order], 2 * profile.std[order]
        few = along in ("cycle", "rate") and len(x) <= _FEW
        label = key if len(profiles) > 1 else ""
        series.append(Series(key, label, x, mean, "both" if few else "line", two if few else None))
        if not few:
            regions.append(Region(key, "", [around(x, mean - two, mean + two)]))
    x = np.concatenate([curve.x for curve in series])
    low, high = float(x.min()), float(x.max())
    axes = {"displacement": units.displacement_label, "time": "time [s]", "rate": f"rate [{units.rate_unit}]"}
    wide = along == "rate" and low > 0 and high > _WIDE * low
    span = (low / 1.5, high * 1.5) if wide else (low - 0.5, high + 0.5) if along == "cycle" else None
    labels, zero = (axes.get(along, along), "left [% of range]"), [Stripe("zero", y=(0.0, 0.0))]
    return Plot(along, labels, series, regions, zero, x=span, log="x" if wide else "")


def next_test_panels(diagnosis: Diagnosis, test: NextTest) -> Panels:
    """Return the program of the proposed test: displacement over time."""
    mode = {channel.name: channel.mode for channel in diagnosis.channels}.get(test.channel, test.channel)
    units = quantities(mode)
    time, q = program(test)
    minutes = time[-1] > 600.0
    speeds = sorted({float(f"{units.per_internal * rate:.3g}") for rate in test.rates})
    heading = f"{test.channel} at {' and '.join(f'{v:g}' for v in speeds)} {units.rate_unit}"
    series = [Series("after", "", time / 60.0 if minutes else time, units.convert(q))]
    label = "time [min]" if minutes else "time [s]"
    bands, title = [Stripe("zero", y=(units.rest, units.rest))], f"Next test: {test.name}"
    labels = (label, units.displacement_label)
    plot = Plot("program", labels, series, bands=bands, heading=heading, height=240.0)
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


def ring_cells(local_map: LocalMap) -> NDArray[np.int_]:
    """Return the corners of cells in VTK's order: around a face, then, above each of these, around the opposite face.

    The first four corners are a face: in a tensor product its diagonals join corners 0, 3 and 1, 2, in a ring 0, 2 and
    1, 3. The midpoints of the diagonals coincide, exactly in a parallelogram and nearly in any good cell.
    """
    cells = local_map.cells
    if cells.shape[1] == local_map.points.shape[1] + 1:
        return cells
    a, b, c, d = (local_map.points[cells[:, i]] for i in range(4))
    tensor, ring = (np.linalg.norm(gap, axis=1).sum() for gap in (a + d - b - c, a + c - b - d))
    return cells[:, (0, 1, 3, 2, 4, 5, 7, 6)[: cells.shape[1]]] if tensor <= ring else cells
