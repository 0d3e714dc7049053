"""A batch of parts -> its document: scatter and band, the parts, outliers with their causes, the law of all."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from bushcli.report.conditions import conditions
from bushcli.report.document import Document, Picture, Section, Table, of_kind, paragraphs
from bushcli.report.quantity import listed, number, percent, quantities, with_std
from bushcli.study.batch import Batch, BatchPart
from bushcli.study.causes import joined
from bushcli.study.outliers import CONFIDENCE, CONTENT, FALSE_ALARM

_IN_WORDS = {
    "data": "its data, which are faulty",
    "program": "its program, which is not that of the others",
    "stiffness": "its stiffness",
    "shape": "the shape of its curve",
}


def batch_document(found: Batch, pictures: Sequence[Picture] = ()) -> Document:
    """Return the document of a batch.

    Parameters
    ----------
    found : Batch
    pictures : sequence of Picture
        Those of its folder.
    """
    out = found.outliers
    sections = [
        Section("Curves", of_kind(pictures, "curve"), on="page"),
        Section("Parts", [_parts(found), *paragraphs([_how(found)], "page", "note")]),
        Section("Scatter", [_scatter(found), *paragraphs([_band()], "page", "note")]),
        Section("Law of all parts", [_law(found)]),
    ]
    lines = [f"{one.name}: an outlier by {_why(one)}." for one in out]
    lines += [f"{one.name}: {joined(one.causes)}." for one in found.parts if one.causes and not one.outlier]
    return Document(
        batch_headline(found),
        lines,
        "bad" if out else "good",
        sections,
        found.conditions,
        conditions(replace(found.case, material=found.fit.material)),
    )


def batch_headline(found: Batch) -> str:
    """Return the result in one sentence."""
    scatter = ", ".join(
        f"{one.mode} {number(quantities(one.mode).stiffness(one.mean.secant_stiffness()))} "
        f"{quantities(one.mode).stiffness_unit} with a standard deviation of {percent(100.0 * one.scatter)}"
        for one in found.curves
    )
    names = [one.name for one in found.outliers]
    said = f"outlier{'s' * (len(names) > 1)}: {listed(names)}" if names else "no outliers"
    return f"{len(found.parts)} parts: {scatter}; {said}"


def stiffness(one: BatchPart) -> float:
    """Return the secant stiffness of a part as recorded: N/mm, N mm per degree."""
    return quantities(one.mode).stiffness(one.recording.secant_stiffness())


def _why(one: BatchPart) -> str:
    found = " and ".join(_IN_WORDS[kind] for kind in one.outlier)
    if one.causes:
        return f"{found}: {joined(one.causes)}"
    return f"{found}; its recording shows no cause: suspect its rubber or a dimension"


def _parts(found: Batch) -> Table:
    rows = tuple(
        (
            one.name,
            one.mode,
            with_std(one.factor, one.std),
            "-" if math.isnan(one.deviation) else f"{one.deviation:+.1f}",
            number(stiffness(one)),
            quantities(one.mode).stiffness_unit,
            percent(one.rms_percent),
            percent(one.noise_percent),
            ", ".join(one.outlier),
        )
        for one in found.parts
    )
    heads = ("part", "mode", "factor", "deviation", "secant stiffness", "", "misfit", "noise", "outlier in")
    return Table("Parts", heads, rows, left=2)


def _scatter(found: Batch) -> Table:
    rows = tuple(
        (
            one.mode,
            str(one.parts),
            number(shown.stiffness(one.mean.secant_stiffness())),
            shown.stiffness_unit,
            percent(100.0 * one.scatter),
            f"± {percent(100.0 * one.k * one.scatter)}",
        )
        for one in found.curves
        for shown in [quantities(one.mode)]
    )
    heads = ("mode", "parts", "mean stiffness", "", "standard deviation", "tolerance band")
    return Table("Scatter of the stiffness", heads, rows, left=1)


def _law(found: Batch) -> Table:
    from bushcli.inverse.file_units import in_file_units, parameter_unit

    fit = in_file_units(found.fit)
    rows = tuple(
        (name, parameter_unit(fit, name).replace("1", ""), with_std(one.value, one.std))
        for name, one in fit.parameters.items()
    )
    return Table(f"Law of all parts: {fit.material.law}", ("parameter", "", "value"), rows, left=2)


def _how(found: Batch) -> str:
    return (
        "The factor is a part's stiffness over that of the batch, with the standard error that noise leaves; its "
        "deviation is that of its logarithm, in standard deviations of the parts that are no outliers; the misfit is "
        "what remains with the factor. Outliers are found by the generalised extreme studentised deviate test (Rosner "
        "1983) of the logarithms of factor and misfit: a batch without outliers is said to have one with a "
        f"probability of {100 * FALSE_ALARM:g} %."
    )


def _band() -> str:
    return (
        f"The band holds {100 * CONTENT:g} % of all parts with a confidence of {100 * CONFIDENCE:g} % (Howe 1969), if "
        "the logarithms of their stiffnesses are normally distributed; outliers do not count."
    )
