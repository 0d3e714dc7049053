"""Identified laws -> their document: parameters, curves before and after, and what the curves determine."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bushcli.curve.misfit import NOISE_FLOOR
from bushcli.errors import count_of
from bushcli.inverse import Estimate, Fit, FittedCurve
from bushcli.inverse.certainty import UNDETERMINED
from bushcli.inverse.file_units import parameter_unit
from bushcli.inverse.result import POOR
from bushcli.inverse.verdict import ABOVE_NOISE, POOR_FIT, POOR_NOISE, PREDICTED
from bushcli.report.conditions import conditions
from bushcli.report.document import (
    Block,
    Columns,
    Document,
    Row,
    Section,
    Table,
    Tone,
    figures,
    note,
    paragraphs,
    table_of,
)
from bushcli.report.quantity import channel_label, interval, join_names, number, percent, with_std
from bushcli.report.ranking import CLEAR, information_criterion
from bushcli.report.results import InverseResult
from bushcli.report.verdict import Verdict, doubt_lines, faulty_data
from bushcli.report.views.cycles import history_section
from bushcli.report.views.dynamic import compared_section, misfit_lines
from bushcli.report.views.fit import curves_of
from bushcli.runtime.digits import with_decimals

# A curve is met to its noise if the misfit is at most this multiple of the noise, which is an estimate itself.
MET = 1.3
# Largest number of parameters in the headline; more would obscure it.
_IN_HEADLINE = 3
# What limits an interval, other than the misfit.
_LIMITED = {"stability": "the law's stability", "unsolvable": "failed simulations", "bound": "the bound"}
_ERRORS = (
    "Standard errors follow from the remaining misfit, its autocorrelation included; the 95 % interval is given where "
    "a parameter is poorly determined, from its profile."
)
_RANKING = (
    f"BIC above the smallest one: {CLEAR:g} or more is clearly worse. Where a channel was held out, its prediction "
    "decides: the identification has not seen it."
)


def inverse_document(result: InverseResult) -> Document:
    """Return the document of identified laws; all but the ranking describes the best of them."""
    fits, best = result.fits, result.best_fit
    verdict = answer(best)
    laws: list[Block] = [model_table(fits), note(_RANKING), figures("ranking")] if len(fits) > 1 else []
    sections = [
        Section("Laws compared", laws),
        Section(f"Parameters identified from {curves_of(best)}", [estimate_table(best), note(_ERRORS)]),
        Section(
            "Curves before and after", [table_of(_MISFITS, best.curves, _CURVES, left=3), figures("curve")]
        ),
        compared_section(best.tables),
        history_section(result.histories),
        Section(
            "What the curves determine",
            [
                correlation_table(best),
                leverage_table(best),
                *paragraphs(determined_lines(best)),
                *paragraphs((f"{c.text[:1].upper()}{c.text[1:]}." for c in best.undetermined), "page"),
                figures("certainty", "profiles"),
            ],
        ),
        Section(
            "The search", [*paragraphs(search_lines(best), kind="note"), figures("convergence", "starts")]
        ),
    ]
    return Document(
        verdict.headline,
        (*verdict.lines, *misfit_lines(best.tables)),
        verdict.tone,
        sections,
        result.conditions,
        conditions(result.case, best.material, "recordings"),
        ends_with_verdict=True,
    )


def answer(fit: Fit) -> Verdict:
    """Return the verdict on an identification in words."""
    fitted = [curve for curve in fit.curves if not curve.held_out]
    values = join_names([f"{name} = {with_error(fit, name)}" for name in fit.parameters])
    misfits = ", ".join(f"{curve.name} {percent(curve.rms_percent)}" for curve in fitted)
    subject, noise = ("The curve is", "its noise") if len(fitted) == 1 else ("The curves are", "their noise")
    tone: Tone
    if any(fault.fatal for fault in fit.faults):
        # Neither the misfit nor the standard errors say anything about the rubber.
        text = f"The law was fitted to these data ({misfits} rms): its values do not describe the rubber."
        return Verdict(faulty_data(fit.faults), (text,), "bad")
    noises = (f"{c.name} {percent(c.rms_percent)}, noise {percent(c.noise_percent)}" for c in fitted)
    details = "; ".join(noises)
    if not fitted:
        met, tone = ("", "good") if fit.tables else ("There is no fitted curve", "bad")
    elif not fit.converged:
        so_far = f"the best point so far reproduces the curves to {misfits} rms"
        met, tone = f"The search did not converge; {so_far}", "bad"
    elif all(is_met(curve) for curve in fitted):
        met, tone = f"{subject} reproduced to within {noise} ({misfits})", "good"
    elif any(c.rms_percent > max(POOR_FIT, POOR_NOISE * np.nan_to_num(c.noise_percent)) for c in fitted):
        met, tone = f"{subject} not reproduced ({details})", "bad"
    else:
        met, tone = f"{subject} reproduced closely, not to within {noise} ({details})", "plain"
    met, tone = _with_tables(fit, met, tone)
    doubts = doubt_lines(fit.faults)
    tone = "plain" if doubts and tone == "good" else tone
    if len(fit.parameters) > _IN_HEADLINE:
        return Verdict(met, (*doubts, f"{values}.", *_lines(fit)), tone)
    return Verdict(f"{met}: {values}", (*doubts, *_lines(fit)), tone)


def _with_tables(fit: Fit, met: str, tone: Tone) -> tuple[str, Tone]:
    """Return a headline and its tone with what is to be said of tables of dynamic stiffness; empty = no curves."""
    tables = [comparison for comparison in fit.tables if not comparison.held_out]
    not_met = [comparison for comparison in tables if comparison.over_errors > ABOVE_NOISE]
    if not tables or (met and not fit.converged):
        return met, tone
    if not fit.converged:
        return "The search did not converge", "bad"
    subject, possessive = ("the table is", "its") if len(tables) == 1 else ("the tables are", "their")
    within = f"{subject} reproduced to within {possessive} errors"
    if not_met:
        misfits = ", ".join(
            f"{table.table.name} {percent(table.stiffness_percent)} and {number(table.loss_angle_deg)} degrees"
            for table in not_met
        )
        within, tone = f"{subject} not reproduced ({misfits})", "bad" if tone == "bad" or not met else "plain"
    return f"{met}, {'but' if not_met else 'and'} {within}" if met else within[0].upper() + within[1:], tone


def is_met(curve: FittedCurve) -> bool:
    """Whether the noise explains the misfit."""
    return bool(curve.rms_percent <= MET * max(np.nan_to_num(curve.noise_percent), 100 * NOISE_FLOOR))


def is_uncertain(estimate: Estimate) -> bool:
    """Whether the standard error is so large that the value is poorly determined."""
    return not estimate.std <= POOR * abs(estimate.value)


def with_error(fit: Fit, name: str) -> str:
    """Return value, standard error and unit, as many digits as the error permits: "0.1175 ± 0.0002 MPa"."""
    estimate, unit = fit.parameters[name], parameter_unit(fit, name)
    return f"{with_std(estimate.value, estimate.std)} {unit}".removesuffix(" 1")


def _lines(fit: Fit) -> list[str]:
    lines = []
    poor = [name for name, estimate in fit.parameters.items() if is_uncertain(estimate)]
    if poor and fit.converged:
        lines.append(
            f"{join_names(poor)} {'is' if len(poor) == 1 else 'are'} poorly determined: the standard error exceeds "
            f"{100 * POOR:.0f} % of the value."
        )
    for curve in (curve for curve in fit.curves if curve.held_out):
        predicted = "predicted" if curve.rms_percent <= PREDICTED else "not predicted"
        rms, noise = percent(curve.rms_percent), percent(curve.noise_percent)
        lines.append(f"{curve.name}, held out, is {predicted}: {rms} rms (noise {noise}).")
    if "compliance" in fit.parameters:
        bulk = bulk_modulus_line(fit)
        bulk += " MPa" if bulk[-1].isdigit() else ""
        lines.append(f"Bulk modulus: {bulk}, from the identified compliance.")
    return lines


def bulk_modulus_line(fit: Fit) -> str:
    """Return the identified bulk modulus, MPa; its lower limit if the rubber may be incompressible."""
    compliance = fit.parameters["compliance"]
    if compliance.value > 2 * compliance.std:
        return number(1 / compliance.value, 3)
    limit = compliance.value + 2 * compliance.std
    return f"above {number(1 / limit, 2)}" if limit > 0 else "not determined"


def determined_lines(fit: Fit) -> list[str]:
    """Return a sentence on which combinations the curves leave open beside the others, by the singular values."""
    values = list(map(float, fit.singular_values))
    # They are relative: of a single parameter they say nothing.
    if len(values) < 2:
        return []
    left, count = sum(value < UNDETERMINED for value in values), len(values)
    values_text = ", ".join(number(value, 2) for value in values)
    text = f"{left or 'None'} of the {count} combinations of the parameters {'are' if left > 1 else 'is'} left open"
    return [f"{text} (relative singular values {values_text}; below {UNDETERMINED:g} one is)."]


def search_lines(fit: Fit) -> list[str]:
    """Return a line on how the result was found."""
    failed = f" ({fit.failed_solves} failed)" if fit.failed_solves else ""
    starts = f", {len(fit.end_points)} starts" if len(fit.end_points) > 1 else ""
    end = f"{'converged' if fit.converged else 'not converged'} after {count_of(fit.iterations, 'iteration')}{starts}"
    calls = f"{count_of(fit.sweeps, 'evaluation')}{failed}, {count_of(fit.forward_solves, 'simulation')} of one channel"
    why = f" ({fit.message.rstrip('.').replace('`', '')})" if fit.message and not fit.converged else ""
    return [f"{fit.method}: {end}, {calls}, {fit.seconds:.1f} s{why}"]


def estimate_table(fit: Fit) -> Table:
    """Return the parameters with standard error, 95 % interval, bounds and doubts."""
    rows: list[Row] = []
    for name, estimate in fit.parameters.items():
        unit = parameter_unit(fit, name)
        bounds = f"{number(estimate.lower)} to {number(estimate.upper)}"
        value = (number(estimate.value, 4), number(estimate.std, 2), _interval(estimate), bounds)
        flags = ["at bound"] * estimate.at_bound + ["poorly determined"] * is_uncertain(estimate)
        flags += [
            f"{end} end: limited by {_LIMITED[limit]}"
            for end, limit in zip(("lower", "upper"), estimate.limits, strict=True)
            if estimate.interval is not None and limit in _LIMITED
        ]
        rows.append((name, "-" if unit == "1" else unit, *value, ", ".join(flags)))
    if "compliance" in fit.parameters:
        rows.append(("bulk modulus", "MPa", bulk_modulus_line(fit), "", "", "", ""))
    heads = ("parameter", "unit", "value", "std error", "95 % interval", "bounds", "")
    return Table(f"Law {fit.material.law}", heads, tuple(rows), left=2)


def _interval(estimate: Estimate) -> str:
    if estimate.range95 is None:
        return "-"
    low, high = estimate.range95
    # Two digits of the width, so that the ends of a narrow interval differ.
    width, size = high - low, max((abs(v) for v in (low, high) if math.isfinite(v)), default=1.0)
    narrow = math.isfinite(width) and 0 < width < size
    digits = 2 + math.ceil(math.log10(size / width)) if narrow else 3
    return interval(low, high, lambda value: number(value, max(3, digits)))


_MISFITS = "Misfit in percent of the recorded force range"
_CURVES: Columns[FittedCurve] = (
    ("channel", lambda curve: curve.name),
    ("mode", lambda curve: curve.recording.mode),
    ("", lambda curve: "predicted (held out)" if curve.held_out else "fitted"),
    ("rms before", lambda curve: percent(curve.started_percent)),
    ("rms after", lambda curve: percent(curve.rms_percent)),
    ("noise", lambda curve: percent(curve.noise_percent)),
    ("within noise", lambda curve: "yes" if is_met(curve) else "no"),
)


def correlation_table(fit: Fit) -> Table:
    """Return the correlation of the parameters' errors."""
    names = tuple(fit.parameters)
    rows: list[Row] = []
    for i, name in enumerate(names):
        below = (f"{fit.correlation[i, j]:+.2f}" for j in range(i))
        rows.append((f"{i + 1}", name, *below, "1", *("",) * (len(names) - i - 1)))
    heads = ("", "", *(str(i + 1) for i in range(len(names))))
    return Table("Correlation", heads, tuple(rows) if len(names) > 1 else (), left=2, on="terminal")


def leverage_table(fit: Fit) -> Table:
    """Return the effect of an error of 1 % in the force of one channel on the parameters."""
    names = tuple(fit.parameters)

    def cell(name: str, change: float) -> str:
        # A value on its bound does not change as the linear theory predicts.
        is_determined = math.isfinite(change) and not fit.parameters[name].at_bound
        return f"{100 * change:+.1f} %" if is_determined else "-"

    rows = [
        (channel, *(cell(name, changes.get(name, math.nan)) for name in names))
        for channel, changes in fit.leverage.items()
    ]
    title = "Change of the parameters if the force of a channel were 1 % larger"
    return Table(title, ("channel", *names), tuple(rows), on="page")


def model_table(fits: Sequence[Fit]) -> Table:
    """Return the laws, the best first, with their criterion relative to the smallest one."""
    names = list(dict.fromkeys(curve.name for fit in fits for curve in fit.curves))
    unseen = {curve.name for fit in fits for curve in fit.curves if curve.held_out}
    order = sorted(names, key=lambda name: name in unseen)
    scores = [information_criterion(fit) for fit in fits]
    smallest = min((score for score in scores if math.isfinite(score)), default=0.0)
    rows = []
    for fit, score in zip(fits, scores, strict=True):
        rms = {curve.name: curve.rms_percent for curve in fit.curves}
        misfits = [percent(rms[name]) if name in rms else "not solved" for name in order]
        cost = number(math.sqrt(fit.cost)) if fit.cost >= 0 else "-"
        problems = ", ".join(dict.fromkeys(c.name for c in fit.conditions))
        cells = (f"+{with_decimals(score - smallest, CLEAR)}", "yes" if fit.converged else "no", problems)
        rows.append((fit.material.law, str(len(fit.parameters)), *misfits, cost, *cells))
    channels = [channel_label(name, name in unseen) for name in order]
    heads = ("law", "parameters", *channels, "misfit/noise", "BIC", "converged", "problems")
    by = "prediction of what was held out" if unseen else "BIC"
    return Table(f"Laws, best first by {by}", heads, tuple(rows))
