"""Tables of identified laws."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bushcli.inverse import Estimate, Fit
from bushcli.inverse.file_units import parameter_unit
from bushcli.report.identification_words import bulk_modulus, is_met, is_uncertain
from bushcli.report.quantity import number, percent
from bushcli.report.ranking import information_criterion
from bushcli.report.tables import ReportTable, Row


def estimate_table(fit: Fit) -> ReportTable:
    """Return the parameters with standard error, 95 % interval, bounds and doubts."""
    rows: list[Row] = []
    for name, estimate in fit.parameters.items():
        unit = parameter_unit(fit, name)
        rows.append(
            (
                name,
                "-" if unit == "1" else unit,
                number(estimate.value, 4),
                number(estimate.std, 2),
                _interval(estimate),
                f"{number(estimate.lower)} to {number(estimate.upper)}",
                _flags(estimate),
            )
        )
    if "compliance" in fit.parameters:
        rows.append(("bulk modulus", "MPa", bulk_modulus(fit), "", "", "", ""))
    heads = ("parameter", "unit", "value", "std error", "95 % interval", "bounds", "")
    return ReportTable(f"Law {fit.material.law}", heads, tuple(rows), left=2)


def _interval(estimate: Estimate) -> str:
    if estimate.range95 is None:
        return "-"
    low, high = estimate.range95
    # Two digits of the width, so that the ends of a narrow interval differ.
    width, size = high - low, max((abs(v) for v in (low, high) if math.isfinite(v)), default=1.0)
    narrow = math.isfinite(width) and 0 < width < size
    digits = 2 + math.ceil(math.log10(size / width)) if narrow else 3
    low_shown, high_shown = (number(value, max(3, digits)) for value in (low, high))
    if not math.isfinite(low):
        return f"below {high_shown}"
    return f"{low_shown} to {high_shown}" if math.isfinite(high) else f"above {low_shown}"


# What limits an interval, other than the misfit.
_LIMITED = {"stability": "the law's stability", "unsolvable": "failed simulations", "bound": "the bound"}


def _flags(estimate: Estimate) -> str:
    flags = []
    if estimate.at_bound:
        flags.append("at bound")
    if is_uncertain(estimate):
        flags.append("poorly determined")
    if estimate.interval is not None:
        for end, limit in zip(("lower", "upper"), estimate.limits, strict=True):
            if limit in _LIMITED:
                flags.append(f"{end} end: limited by {_LIMITED[limit]}")
    return ", ".join(flags)


def curve_table(fit: Fit) -> ReportTable:
    """Return the misfit of each channel before and after the identification."""
    rows = [
        (
            curve.name,
            curve.recording.mode,
            "predicted (held out)" if curve.held_out else "fitted",
            percent(curve.started_percent),
            percent(curve.rms_percent),
            percent(curve.noise_percent),
            "yes" if is_met(curve) else "no",
        )
        for curve in fit.curves
    ]
    heads = ("channel", "mode", "", "rms before", "rms after", "noise", "within noise")
    return ReportTable("Misfit in percent of the recorded force range", heads, tuple(rows), left=3)


def correlation_table(fit: Fit) -> ReportTable:
    """Return the correlation of the parameters' errors."""
    names = tuple(fit.parameters)
    rows = [
        (
            name,
            *(f"{fit.correlation[i, j]:+.2f}" if j < i else "1" if j == i else "" for j in range(len(names))),
        )
        for i, name in enumerate(names)
    ]
    return ReportTable("Correlation", ("", *names), tuple(rows))


def leverage_table(fit: Fit) -> ReportTable:
    """Return the effect of an error of 1 % in the force of one channel on the parameters."""
    names = tuple(fit.parameters)
    rows = [
        (channel, *(_change(fit.parameters[name], changes.get(name, math.nan)) for name in names))
        for channel, changes in fit.leverage.items()
    ]
    title = "Change of the parameters if the force of a channel were 1 % larger"
    return ReportTable(title, ("channel", *names), tuple(rows))


def _change(estimate: Estimate, relative: float) -> str:
    # A value on its bound does not change as the linear theory predicts.
    return "-" if estimate.at_bound or not math.isfinite(relative) else f"{100 * relative:+.1f} %"


def model_table(fits: Sequence[Fit]) -> ReportTable:
    """Return the laws, the best first, with their criterion relative to the smallest one."""
    names = list(dict.fromkeys(curve.name for fit in fits for curve in fit.curves))
    held = {curve.name for fit in fits for curve in fit.curves if curve.held_out}
    order = [name for name in names if name not in held] + [name for name in names if name in held]
    scores = [information_criterion(fit) for fit in fits]
    least = min((score for score in scores if math.isfinite(score)), default=0.0)
    rows = []
    for fit, score in zip(fits, scores, strict=True):
        rms = {curve.name: curve.rms_percent for curve in fit.curves}
        rows.append(
            (
                fit.material.law,
                str(len(fit.parameters)),
                *(percent(rms[name]) if name in rms else "not solved" for name in order),
                number(math.sqrt(fit.cost)) if fit.cost >= 0 else "-",
                f"{score - least:+.0f}",
                "yes" if fit.converged else "no",
                ", ".join(dict.fromkeys(c.name for c in fit.conditions)),
            )
        )
    heads = (
        "law",
        "parameters",
        *(f"{name} (held out)" if name in held else name for name in order),
        *("misfit/noise", "BIC", "converged", "problems"),
    )
    by = "prediction of what was held out" if held else "BIC"
    return ReportTable(f"Laws, best first by {by}", heads, tuple(rows))
