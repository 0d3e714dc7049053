"""A batch of parts -> its document: scatter and band, the parts, outliers with their causes, the law of all."""

from __future__ import annotations

import math
from dataclasses import replace

from bushcli.errors import count_of
from bushcli.inverse.file_units import in_file_units, parameter_unit
from bushcli.report.conditions import conditions
from bushcli.report.document import Columns, Document, Section, Table, figures, note, table_of
from bushcli.report.quantity import join_names, number, percent, quantities, with_std
from bushcli.study.batch import Batch, BatchCurve, BatchPart
from bushcli.study.causes import join_causes
from bushcli.study.outliers import CONFIDENCE, CONTENT, FALSE_ALARM

_IN_WORDS = {
    "data": "its data, which are faulty",
    "program": "its program, which is not that of the others",
    "stiffness": "its stiffness",
    "shape": "the shape of its curve",
}
_NO_CAUSE = "; its recording shows no cause: suspect its rubber or a dimension"
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


def batch_document(batch: Batch) -> Document:
    """Return the document of a batch."""
    lines = []
    for part in batch.outliers:
        criteria = " and ".join(_IN_WORDS[kind] for kind in part.outlier)
        cause = f": {join_causes(part.causes)}" if part.causes else _NO_CAUSE
        lines.append(f"{part.name}: an outlier by {criteria}{cause}.")
    others = [part for part in batch.parts if part.causes and not part.outlier]
    lines += [f"{part.name}: {join_causes(part.causes)}." for part in others]
    fit = in_file_units(batch.fit)
    law = tuple(
        (name, parameter_unit(fit, name).replace("1", ""), with_std(estimate.value, estimate.std))
        for name, estimate in fit.parameters.items()
    )
    law_title = f"Law of all parts: {fit.material.law}"
    return Document(
        batch_headline(batch),
        lines,
        "bad" if batch.outliers else "good",
        [
            Section("Curves", [figures("curve")], on="page"),
            Section("Parts", [table_of("Parts", batch.parts, _PARTS, left=2), note(_HOW)]),
            Section(
                "Scatter of the stiffness",
                [table_of("Scatter of the stiffness", batch.curves, _SCATTER), note(_BAND)],
            ),
            Section(law_title, [Table(law_title, ("parameter", "", "value"), law, left=2)]),
        ],
        batch.conditions,
        conditions(replace(batch.case, material=batch.fit.material)),
    )


def batch_headline(batch: Batch) -> str:
    """Return the result in one sentence."""
    scatter = ", ".join(
        f"{curve.mode} {_mean(curve)} {unit} with a standard deviation of {percent(100.0 * curve.scatter)}"
        for curve in batch.curves
        for unit in [quantities(curve.mode).stiffness_unit]
    )
    names = [part.name for part in batch.outliers]
    outliers = f"outlier{'s' * (len(names) > 1)}: {join_names(names)}" if names else "no outliers"
    return f"{count_of(len(batch.parts), 'part')}: {scatter}; {outliers}"


def stiffness(part: BatchPart) -> float:
    """Return the secant stiffness of a part as recorded: N/mm, N mm per degree."""
    return quantities(part.mode).stiffness(part.recording.secant_stiffness())


def _mean(curve: BatchCurve) -> str:
    return number(quantities(curve.mode).stiffness(curve.mean.secant_stiffness()))


_PARTS: Columns[BatchPart] = (
    ("part", lambda part: part.name),
    ("mode", lambda part: part.mode),
    ("factor", lambda part: with_std(part.factor, part.std)),
    ("deviation [std]", lambda part: "-" if math.isnan(part.deviation) else f"{part.deviation:+z.1f}"),
    ("secant stiffness", lambda part: number(stiffness(part))),
    ("", lambda part: quantities(part.mode).stiffness_unit),
    ("misfit", lambda part: percent(part.rms_percent)),
    ("noise", lambda part: percent(part.noise_percent)),
    ("outlier in", lambda part: ", ".join(part.outlier)),
)
_SCATTER: Columns[BatchCurve] = (
    ("mode", lambda curve: curve.mode),
    ("parts", lambda curve: str(curve.parts)),
    ("mean stiffness", _mean),
    ("", lambda curve: quantities(curve.mode).stiffness_unit),
    ("standard deviation", lambda curve: percent(100.0 * curve.scatter)),
    ("tolerance band", lambda curve: f"± {percent(100.0 * curve.k * curve.scatter)}"),
)
