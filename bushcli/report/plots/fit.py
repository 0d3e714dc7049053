"""Plots of an identified law: curves before and after, laws compared, what the curves determine, and the search."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.interpolate import PchipInterpolator

from bushcli.errors import count_of
from bushcli.inverse import Estimate, Fit, FittedCurve, Profile
from bushcli.inverse.file_units import parameter_unit
from bushcli.inverse.profile import RISE_95
from bushcli.inverse.result import NORMAL
from bushcli.report.document import Array, Note, Panels, Plot, Region, Series, Stripe
from bushcli.report.plots.cycles import history_panels, in_rows
from bushcli.report.plots.direct import (
    bar,
    capital,
    colour,
    difference_plot,
    limits_around,
    recorded_series,
    rest_lines,
    smooth,
)
from bushcli.report.plots.dynamic import table_panels
from bushcli.report.quantity import channel_label, interval, number, percent, quantities
from bushcli.report.results import InverseResult
from bushcli.report.views.fit import curves_of

# The axes extend at most this share of the force range beyond the curves; a start further away leaves the picture.
LEAVES = 0.6


def fit_panels(fit: Fit) -> Panels:
    """Return recorded points and fitted curve of every coupon or channel, with where the law is unstable."""
    worst = max(curve.rms_percent for curve in fit.curves)
    title = f"{fit.material.law} fitted to {curves_of(fit)}: {percent(worst)} rms at worst"
    stable = [fit.stability.get(curve.recording.mode) for curve in fit.curves]
    plots = [coupon_plot(*pair, i) for i, pair in enumerate(zip(fit.curves, stable, strict=True))]
    return Panels("coupons", "coupons", title, in_rows(plots, 2))


def coupon_plot(curve: FittedCurve, stable: tuple[float, float] | None, index: int) -> Plot:
    """Return one test with the fitted curve, and the stretches at which the law is unstable."""
    units = quantities(curve.recording.mode)
    q, force = smooth(curve.smooth or curve.fitted)
    at = units.convert(curve.recording.displacement)
    label = f"{'predicted (held out)' if curve.held_out else 'fitted'}, rms {percent(curve.rms_percent)}"
    series = [
        Series("recorded", "recorded", at, curve.recording.force, "dots"),
        Series("after", label, units.convert(q), force),
    ]
    left, right = limits_around(np.concatenate([at, units.convert(q)]), 0.05)
    bands = []
    if stable is not None:
        ends = [(left, min(stable[0], right)), (max(stable[1], left), right)]
        # Where the law violates Drucker's postulate.
        bands = [Stripe("unstable", x=(a, b), label="law unstable") for a, b in ends if b > a]
    title = curve.name if curve.name == curve.recording.mode else f"{curve.name} ({curve.recording.mode})"
    name, span = f"coupon-{index}", (left, right)
    return Plot(name, units.labels, series, bands=bands, x=span, heading=title, height=340.0)


def inverse_panels(result: InverseResult, names: Mapping[str, str]) -> list[Panels]:
    """Return curves, search and certainty, cycles and holds and, for several laws, their ranking."""
    fits, best = result.fits, result.best_fit
    panels = [fitted_panels(curve, names[curve.name]) for curve in best.curves]
    panels += [table_panels(compared, names[compared.table.name]) for compared in best.tables]
    if len(fits) > 1:
        panels.append(ranking_panels(fits))
    if best.profiles:
        kind = "profiles" if len(best.profiles) > 1 else "certainty"
        plots = [profile_plot(best, profile, best.parameters[profile.name]) for profile in best.profiles]
        panels.append(Panels("profiles", kind, "Profile likelihood", in_rows(plots, 2)))
    if len(best.parameters) > 1:
        panels.append(correlation_panels(best))
    if best.evaluations:
        panels.append(convergence_panels(best))
    if len(best.end_points) > 1:
        panels.append(ends_panels(best))
    return panels + history_panels(result.histories, names)


def fitted_panels(curve: FittedCurve, file: str) -> Panels:
    """Return recording, start and fit; below them the remaining misfit with the noise."""
    name, rms, units = capital(curve.name), percent(curve.rms_percent), quantities(curve.recording.mode)
    title = f"{name}: fitted to {rms} rms"
    if curve.held_out:
        title = f"{name}, held out: predicted to {rms} rms"
    elif np.isfinite(curve.started_percent):
        title = f"{name}: {percent(curve.started_percent)} rms before, {rms} after"
    q, force = smooth(curve.smooth or curve.fitted)
    q = units.convert(q)
    reach = 0.04 * float(np.ptp(curve.recording.displacement)) * units.per_internal
    span = (float(q.min()) - reach, float(q.max()) + reach)
    series = [recorded_series(curve.recording, units)]
    limits = None
    if (started := curve.started) is not None:
        at, before = smooth(started)
        series.append(
            Series("before", f"before: {percent(curve.started_percent)} rms", units.convert(at), before)
        )
        limits = force_limits(np.concatenate([curve.recording.force, curve.fitted.force]), before)
    label = "predicted (held out)" if curve.held_out else "after"
    series.append(Series("after", f"{label}: {rms} rms", q, force))
    curves = Plot(
        "curve", ("", units.force_label), series, x=span, y=limits, bands=rest_lines(units), height=370.0
    )
    difference = 100 * (curve.fitted.force - curve.recording.force) / float(np.ptp(curve.recording.force))
    noise = float(np.nan_to_num(curve.noise_percent))
    below = difference_plot(
        # Dots, because lines from cycle to cycle would hide whether the misfit follows the displacement.
        Series("dot", "", units.convert(curve.recording.displacement), difference, "dots"),
        Stripe("noise", y=(-2 * noise, 2 * noise)),
        units,
        span,
        f"{label} - recorded, in % of the recorded {units.force} range: rms {rms}; grey: noise {percent(noise)}, "
        "± 2 sigma",
    )
    return Panels(f"{file}-identified", "curve", title, [[curves], [below]], curve.name)


def force_limits(near: Array, far: Array) -> tuple[float, float]:
    """Return the limits around curves that are close to each other; a distant one leaves the picture."""
    low, high = float(np.nanmin(near)), float(np.nanmax(near))
    reach, margin = LEAVES * (high - low), 0.06 * (high - low) or 1.0
    bottom, top = max(low - reach, float(np.nanmin(far))), min(high + reach, float(np.nanmax(far)))
    return min(low, bottom) - margin, max(high, top) + margin


def ranking_panels(fits: Sequence[Fit]) -> Panels:
    """Return a bar per law and channel, the best law on top; held-out channels have their own colour and come last."""
    curves = {curve.name: curve for fit in fits for curve in fit.curves}
    order = sorted(curves, key=lambda name: curves[name].held_out)
    unfinished = "; grey: not converged" if not all(fit.converged for fit in fits) else ""
    title = f"Laws by misfit, best first (number of parameters){unfinished}"
    plots = [ranked_plot(fits, curves[name], i) for i, name in enumerate(order)]
    return Panels("ranking", "ranking", title, in_rows(plots, 2))


def ranked_plot(fits: Sequence[Fit], curve: FittedCurve, index: int) -> Plot:
    """Return the misfits of all laws on one channel, each with its number, and the noise of the recording."""
    rms = np.array([{c.name: c.rms_percent for c in fit.curves}.get(curve.name, np.nan) for fit in fits])
    noise = curve.noise_percent
    finite = np.append(rms[np.isfinite(rms) & (rms > 0)], noise if noise > 0 else [])
    left = 0.5 * float(finite.min()) if len(finite) else 0.1
    right = 6.0 * float(finite.max()) if len(finite) else 10.0
    bars, notes = [], []
    for i, (fit, value) in enumerate(zip(fits, rms, strict=True)):
        key = "bar_grey" if not fit.converged else "bar_second" if curve.held_out else "bar"
        end = value if np.isfinite(value) and value > left else left
        bars.append(Region(key, "", [bar(i, left, end)]))
        notes.append(Note(percent(float(value)) if np.isfinite(value) else "not solvable", (end, i)))
    label = f"noise {percent(noise)}"
    return Plot(
        f"law-{index}",
        ("rms misfit [% of the force range]", ""),
        x=(left, right),
        y=(len(fits) - 0.5, -0.5),
        regions=bars,
        bands=[Stripe("level", x=(noise, noise), label=label)] if noise > 0 else [],
        notes=notes,
        heading=channel_label(curve.name, curve.held_out),
        height=95.0 + 30.0 * len(fits),
        log="x",
        y_names=[(i, f"{fit.material.law} ({len(fit.parameters)})") for i, fit in enumerate(fits)],
    )


def correlation_panels(fit: Fit) -> Panels:
    """Return the correlation of the parameters' errors as a map with numbers."""
    count = len(fit.parameters)
    regions, notes = [], []
    for (i, j), value in np.ndenumerate(fit.correlation):
        known, cell = math.isfinite(value), bar(i, j - 0.5, j + 0.5, 1.0)
        regions.append(Region("bar", "", [cell], value=float(value) if known else 0.0))
        notes.append(Note(f"{value:+.2f}" if known else "-", (j, i), "middle"))
    names = list(enumerate(fit.parameters))
    size, title = (-0.5, count - 0.5), "Correlation of the errors"
    plot = Plot(
        "correlation",
        ("", ""),
        x=size,
        y=size[::-1],
        regions=regions,
        notes=notes,
        height=80.0 + 60.0 * count,
        width=240.0 + 85.0 * count,
        x_names=names,
        y_names=names,
        scale=(1.0, "correlation"),
    )
    return Panels("correlation", "certainty", title, [[plot]])


def profile_plot(fit: Fit, profile: Profile, estimate: Estimate) -> Plot:
    """Return a profile with the line that ends its 95 % interval."""
    good = np.isfinite(profile.rise)
    values, rise = profile.values[good], profile.rise[good]
    least, most = float(profile.values.min()), float(profile.values.max())
    bands = [
        Stripe("limit", y=(RISE_95, RISE_95), label="95 %"),
        Stripe("zero", x=(estimate.value, estimate.value)),
    ]
    if estimate.interval is not None:
        low, high = (min(max(end, least), most) for end in estimate.interval)
        bands.insert(0, Stripe("shaded", x=(low, high)))
    series = []
    if estimate.std > 0:
        # Where profile and parabola differ, the standard error is misleading.
        q = np.linspace(least, most, 101)
        spread = estimate.std * estimate.quantile / NORMAL
        series.append(Series("faint", "standard error", q, ((q - estimate.value) / spread) ** 2))
    if len(values) > 2:
        q = np.linspace(values.min(), values.max(), 101)
        # The signed root of the rise is interpolated, because it is close to a straight line.
        root = np.sign(values - estimate.value) * np.sqrt(np.maximum(rise, 0.0))
        series.append(Series("after", "", q, PchipInterpolator(values, root)(q) ** 2))
    series.append(Series("after", "refitted", values, rise, "dots"))
    top = max(1.6 * RISE_95, min(float(rise.max(initial=0.0)) * 1.1, 4 * RISE_95))
    if not good.all():
        # Along the upper edge, because they have no misfit.
        edge = np.full((~good).sum(), 0.95 * top)
        series.append(Series("left_out", "not solvable", profile.values[~good], edge, "crosses"))
    unit = parameter_unit(fit, profile.name)
    label = profile.name if unit == "1" else f"{profile.name} [{unit}]"
    words = "no end within the profile"
    if estimate.interval is not None:
        ends = interval(*estimate.interval)
        words = f"95 % {'from ' * (' to ' in ends)}{ends}"
    name, heading, span = f"profile-{profile.name}", f"{profile.name}: {words}", (-0.04 * top, top)
    labels = (label, "rise of chi square")
    return Plot(name, labels, series, y=span, bands=bands, heading=heading, height=320.0)


# Largest number of evaluations that are drawn with a mark on each.
_SEPARATE = 60
# Ends whose misfits differ by less than this ratio are equal.
_EQUAL = 1.05
# Ratios of parameters that are shown at first; starts may deviate by factors of hundreds.
_LEAST_RATIO, _MOST_RATIO = -1.0, 4.0


def convergence_panels(fit: Fit) -> Panels:
    """Return misfit and parameters of every evaluation; those that could not be solved are marked."""
    at = np.array([float(e.number) for e in fit.evaluations])
    # Misfit in units of the noise, as during the search: the cost is its square.
    misfit = np.sqrt([e.cost for e in fit.evaluations])
    profiles = np.array([e.stage == "profile" for e in fit.evaluations])
    mark = "both" if len(at) <= _SEPARATE else "line"
    good = np.isfinite(misfit) & (misfit > 0)
    series = [Series("faint", "evaluation", at[good], misfit[good], "both")]
    if (searched := good & ~profiles).any():
        # A step at each evaluation that is better than all before.
        so_far = np.repeat(np.minimum.accumulate(misfit[searched]), 2)[:-1]
        series.append(Series("after", "best so far", np.repeat(at[searched], 2)[1:], so_far))
    failed = at[~np.isfinite(misfit)]
    if len(failed):
        # Along the upper edge, because they have no misfit.
        top = np.full(len(failed), 1.3 * float(misfit[good].max(initial=1.0)))
        series.append(Series("left_out", "not solvable", failed, top, "crosses"))
    span = (0.5, float(at.max()) + 0.5)
    bands = [Stripe("level", y=(1.0, 1.0), label="noise")]
    if profiles.any():
        start = float(at[profiles].min()) - 0.5
        bands.insert(0, Stripe("shaded", x=(start, span[1]), label="for the profiles"))
    above = Plot("misfit", ("", "misfit / noise"), series, x=span, bands=bands, height=300.0, log="y")
    ratios = []
    for i, (name, estimate) in enumerate(fit.parameters.items()):
        unit = estimate.value if estimate.value else 1.0
        values = np.array([e.parameters.get(name, np.nan) for e in fit.evaluations]) / unit
        ratios.append(Series(colour(i), name, at, values, mark))  # type: ignore[arg-type]  # mypy infers str
    finite = np.concatenate([np.ones(1), *(ratio.y[np.isfinite(ratio.y)] for ratio in ratios)])
    limits = (max(_LEAST_RATIO, float(finite.min())) - 0.1, min(_MOST_RATIO, float(finite.max())) + 0.1)
    labels, heading = ("evaluation of all channels", "ratio"), "each parameter / its identified value"
    line = [Stripe("zero", y=(1.0, 1.0))]
    below = Plot("parameters", labels, ratios, x=span, y=limits, bands=line, heading=heading)
    end = "converged" if fit.converged else "not converged"
    title = f"{fit.material.law}, {fit.method}: {end} after {count_of(fit.sweeps, 'evaluation')}, {fit.seconds:.0f} s"
    return Panels("convergence", "convergence", title, [[above], [below]])


def ends_panels(fit: Fit) -> Panels:
    """Return starts and ends as lines across the parameters' axes; the ends at the best misfit in colour."""
    names = list(fit.parameters)
    starts = np.array([[end.start[name] for name in names] for end in fit.end_points])
    ends = np.array([[end.parameters[name] for name in names] for end in fit.end_points])
    misfit = np.sqrt([end.cost for end in fit.end_points])
    finite = misfit[np.isfinite(misfit) & (misfit > 0)]
    best = misfit <= _EQUAL * (float(finite.min()) if len(finite) else 1.0)
    low, high = np.minimum(starts, ends).min(axis=0), np.maximum(starts, ends).max(axis=0)
    span = np.where(high > low, high - low, 1.0)

    def lines(key: str, label: str, values: np.ndarray) -> Series:  # type: ignore[type-arg]
        gap = np.full((len(values), 1), np.nan)
        x = np.hstack([np.tile(np.arange(len(names), dtype=float), (len(values), 1)), gap])
        return Series(key, label, x.ravel(), np.hstack([(values - low) / span, gap]).ravel(), "both")

    series = [lines("faint", "start", starts)]
    worse = misfit[~best & np.isfinite(misfit)]
    if (~best).any():
        more = f": misfit up to {number(float(worse.max()))} times the noise" if len(worse) else ""
        series.append(lines("unloading", f"end elsewhere{more}", ends[~best]))
    if best.any():
        label = f"end at the best misfit, {number(float(misfit[best].min()))} times the noise"
        series.append(lines("after", label, ends[best]))
    ranges = zip(names, low, high, strict=True)
    labels = [f"{name}\nfrom {number(a)}\nto {number(b)}" for name, a, b in ranges]
    title = f"Where {len(ends)} starts ended: {int(best.sum())} at the best misfit"
    axes = [Stripe("zero", x=(i, i)) for i in range(len(names))]
    plot = Plot(
        "starts",
        ("", ""),
        series,
        height=400.0,
        x=(-0.3, len(names) - 0.7),
        y=(-0.05, 1.05),
        bands=axes,
        x_names=list(enumerate(labels)),
        y_names=[(0.0, ""), (1.0, "")],
    )
    return Panels("starts", "starts", title, [[plot]])
