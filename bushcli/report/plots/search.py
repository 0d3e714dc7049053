"""Plots of the search for parameters: misfit and parameters by evaluation, and the ends of several starts."""

from __future__ import annotations

import numpy as np

from bushcli.inverse import Fit
from bushcli.report.document import Band, Panels, Plot, Series
from bushcli.report.quantity import number

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
        so_far = np.minimum.accumulate(misfit[searched])
        # A step at each evaluation that is better than all before.
        series.append(
            Series("after", "best so far", np.repeat(at[searched], 2)[1:], np.repeat(so_far, 2)[:-1])
        )
    level = Band("level", y=(1.0, 1.0), label="noise")
    failed = at[~np.isfinite(misfit)]
    if len(failed):
        # Along the upper edge, because they have no misfit.
        top = np.full(len(failed), 1.3 * float(misfit[good].max(initial=1.0)))
        series.append(Series("left_out", "not solvable", failed, top, "crosses"))
    shade = []
    if profiles.any():
        shade = [
            Band(
                "shaded", x=(float(at[profiles].min()) - 0.5, float(at.max()) + 0.5), label="for the profiles"
            )
        ]
    span = (0.5, float(at.max()) + 0.5)
    above = Plot(
        "misfit", ("", "misfit / noise"), series, x=span, bands=[*shade, level], height=300.0, log="y"
    )
    ratios = []
    for i, (name, estimate) in enumerate(fit.parameters.items()):
        unit = estimate.value if estimate.value else 1.0
        values = np.array([e.parameters.get(name, np.nan) for e in fit.evaluations]) / unit
        ratios.append(Series(f"line-{i % 10}", name, at, values, mark))  # type: ignore[arg-type]  # mypy infers str
    every = np.concatenate([np.ones(1), *(one.y[np.isfinite(one.y)] for one in ratios)])
    limits = (max(_LEAST_RATIO, float(every.min())) - 0.1, min(_MOST_RATIO, float(every.max())) + 0.1)
    label, heading = "evaluation of all channels", "each parameter / its identified value"
    below = Plot(
        "parameters",
        (label, "ratio"),
        ratios,
        x=span,
        y=limits,
        bands=[Band("zero", y=(1.0, 1.0))],
        heading=heading,
    )
    end = "converged" if fit.converged else "not converged"
    title = f"{fit.material.law}, {fit.method}: {end} after {fit.sweeps} evaluations, {fit.seconds:.0f} s"
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
        series.append(
            lines(
                "after",
                f"end at the best misfit, {number(float(misfit[best].min()))} times the noise",
                ends[best],
            )
        )
    labels = [
        f"{name}\nfrom {number(a)}\nto {number(b)}" for name, a, b in zip(names, low, high, strict=True)
    ]
    title = f"Where {len(ends)} starts ended: {int(best.sum())} at the best misfit"
    axes = [Band("zero", x=(i, i)) for i in range(len(names))]
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
