"""A batch of parts -> its document: scatter and band, the parts, outliers with their causes, the law of all."""

from __future__ import annotations

import math
from dataclasses import replace

from bushcli.inverse import Estimate
from bushcli.inverse.file_units import in_file_units, parameter_unit
from bushcli.report.conditions import conditions
from bushcli.report.document import Columns, Document, Section, figures, note, table_of
from bushcli.report.quantity import listed, number, percent, quantities, with_std
from bushcli.study.batch import Batch, BatchCurve, BatchPart
from bushcli.study.causes import joined
from bushcli.study.outliers import CONFIDENCE, CONTENT, FALSE_ALARM

_IN_WORDS = {
    "data": "its data, which are faulty",
    "program": "its program, which is not that of the others",
    "stiffness": "its stiffness",
    "shape": "the shape of its curve",
}
_HOW = (
    "The factor is a part's stiffness over that of the batch, with the standard error that noise leaves; its "
    "deviation is that of its logarithm, in standard deviations of the parts that are no outliers; the misfit is "
    "what remains with the factor. Outliers are found by the generalised extreme studentised deviate test (Rosner "
    "1983) of the logarithms of factor and misfit: a batch without outliers is said to have one with a "
    f"probability of {100 * FALSE_ALARM:g} %."
)
_BAND = (
    f"The band holds {100 * CONTENT:g} % of all parts with a confidence of {100 * CONFIDENCE:g} % (Howe 1969), if "
    "the logarithms of their stiffnesses are normally distributed; outliers do not count."
)


def batch_document(found: Batch) -> Document:
    """Return the document of a batch."""
    lines = []
    for one in found.outliers:
        why = " and ".join(_IN_WORDS[kind] for kind in one.outlier)
        no_cause = "; its recording shows no cause: suspect its rubber or a dimension"
        lines.append(
            f"{one.name}: an outlier by {why}{f': {joined(one.causes)}' if one.causes else no_cause}."
        )
    lines += [f"{one.name}: {joined(one.causes)}." for one in found.parts if one.causes and not one.outlier]
    fit = in_file_units(found.fit)
    law = [(name, parameter_unit(fit, name), one) for name, one in fit.parameters.items()]
    return Document(
        batch_headline(found),
        lines,
        "bad" if found.outliers else "good",
        [
            Section("Curves", [figures("curve")], on="page"),
            Section("Parts", [table_of("Parts", found.parts, _PARTS, left=2), note(_HOW)]),
            Section("Scatter", [table_of("Scatter of the stiffness", found.curves, _SCATTER), note(_BAND)]),
            Section(
                "Law of all parts", [table_of(f"Law of all parts: {fit.material.law}", law, _LAW, left=2)]
            ),
        ],
        found.conditions,
        conditions(replace(found.case, material=found.fit.material)),
    )


def batch_headline(found: Batch) -> str:
    """Return the result in one sentence."""
    scatter = ", ".join(
        f"{one.mode} {_mean(one)} {quantities(one.mode).stiffness_unit} with a standard deviation of "
        f"{percent(100.0 * one.scatter)}"
        for one in found.curves
    )
    names = [one.name for one in found.outliers]
    said = f"outlier{'s' * (len(names) > 1)}: {listed(names)}" if names else "no outliers"
    return f"{len(found.parts)} parts: {scatter}; {said}"


def stiffness(one: BatchPart) -> float:
    """Return the secant stiffness of a part as recorded: N/mm, N mm per degree."""
    return quantities(one.mode).stiffness(one.recording.secant_stiffness())


def _mean(one: BatchCurve) -> str:
    return number(quantities(one.mode).stiffness(one.mean.secant_stiffness()))


_PARTS: Columns[BatchPart] = (
    ("part", lambda one: one.name),
    ("mode", lambda one: one.mode),
    ("factor", lambda one: with_std(one.factor, one.std)),
    ("deviation", lambda one: "-" if math.isnan(one.deviation) else f"{one.deviation:+.1f}"),
    ("secant stiffness", lambda one: number(stiffness(one))),
    ("", lambda one: quantities(one.mode).stiffness_unit),
    ("misfit", lambda one: percent(one.rms_percent)),
    ("noise", lambda one: percent(one.noise_percent)),
    ("outlier in", lambda one: ", ".join(one.outlier)),
)
_SCATTER: Columns[BatchCurve] = (
    ("mode", lambda one: one.mode),
    ("parts", lambda one: str(one.parts)),
    ("mean stiffness", _mean),
    ("", lambda one: quantities(one.mode).stiffness_unit),
    ("standard deviation", lambda one: percent(100.0 * one.scatter)),
    ("tolerance band", lambda one: f"± {percent(100.0 * one.k * one.scatter)}"),
)
_LAW: Columns[tuple[str, str, Estimate]] = (
    ("parameter", lambda one: one[0]),
    ("", lambda one: one[1].replace("1", "")),
    ("value", lambda one: with_std(one[2].value, one[2].std)),
)
