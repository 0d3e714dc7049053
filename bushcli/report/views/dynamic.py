"""Dynamic stiffness, and measured tables of it -> documents and sections: a table for each preload or curve."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bushcli.case.tolerance import Tolerance
from bushcli.errors import count_of
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.report.conditions import conditions
from bushcli.report.document import (
    Array,
    Block,
    Columns,
    Document,
    Section,
    Table,
    figures,
    paragraphs,
    table_of,
)
from bushcli.report.quantity import number, percent, quantities
from bushcli.report.results import DynamicResult
from bushcli.report.views.fit import fit_section
from cases.mode import modes

if TYPE_CHECKING:
    from bushcli.simulate.dynamic import DynamicResponse
    from bushcli.simulate.dynamic_tables import ComparedTable
    from bushcli.simulate.vibrations import DynamicCurve

# Rows of a printed table; the page, the CSV file and the JSON have all.
_ROWS = 10


def dynamic_document(result: DynamicResult) -> Document:
    """Return the document of dynamic stiffness."""
    response = result.response
    count = len({(curve.name, curve.preload) for curve in response.curves})
    tables = [frequency_table(curve) for curve in response.curves]
    printed = [replace(table, on="terminal") for table in tables]
    headline = f"Dynamic stiffness about {count_of(count, 'preload')}"
    lines = [] if response.complete else ["Not every preload has a result: see the problems."]
    return Document(
        headline,
        lines,
        "plain" if response.complete else "bad",
        [
            *([] if result.fit is None else [fit_section(result.fit)]),
            Section("Dynamic stiffness and loss angle", [figures("dynamic")]),
            Section("Preloads", [table_of("", response.curves, _PRELOADS, left=3)]),
            Section("Tables", printed, fold="All frequencies", folded=tables),
            Section("Solution", paragraphs([solution_line(response)], kind="note")),
        ],
        response.conditions,
        conditions(response.case, response.material),
        ends_with_verdict=True,
    )


def stiffness_unit(mode: str) -> str:
    """Return the unit of a mode's dynamic stiffness: N/mm, N mm/rad, MPa."""
    return quantities(mode).stiffness_unit.replace("deg", "rad")


def preload_in_words(curve: DynamicCurve) -> str:
    """Return the preload with its force."""
    units = quantities(curve.mode)
    travel = f"{number(units.at(curve.preload), 4)} {units.displacement_unit}".strip()
    # At rest the force is rounding.
    return f"{travel}, {number(round(curve.force, 9), 4)} {units.force_unit}"


def amplitude_in_words(curve: DynamicCurve) -> str:
    """Return the amplitude, "small" where none is given."""
    if curve.amplitude is None:
        return "small"
    units = quantities(curve.mode)
    return f"{units.per_internal * curve.amplitude:.4g} {units.displacement_unit}".strip()


def point_in_words(curve: DynamicCurve) -> str:
    """Return where the force is taken: at the held sleeve (transfer), or where the bushing is driven."""
    if modes()[curve.mode].specimen == "coupon":
        return "modulus"
    return "transfer stiffness" if curve.test.transfer else "driving-point stiffness"


def title(curve: DynamicCurve) -> str:
    """Return the name of a load case, and which motion vibrates on a path of six."""
    return f"{curve.name}{curve.test.shown_motion}"


_PRELOADS: Columns[DynamicCurve] = (
    ("load case", title),
    ("preload", preload_in_words),
    ("amplitude", amplitude_in_words),
    ("static rate", lambda curve: number(curve.static, 4)),
    ("|K*| from", lambda curve: number(float(np.abs(curve.stiffness).min()), 4)),
    ("to", lambda curve: number(float(np.abs(curve.stiffness).max()), 4)),
    ("", lambda curve: stiffness_unit(curve.mode)),
    ("over static", lambda curve: number(float(np.abs(curve.stiffness).max()) / abs(curve.static), 3)),
    ("loss angle to", lambda curve: f"{math.degrees(float(curve.loss_angle.max())):.2f} deg"),
)


def frequency_table(curve: DynamicCurve) -> Table:
    """Return stiffness and loss angle at each frequency, for one preload and amplitude."""
    unit, K = stiffness_unit(curve.mode), curve.stiffness
    name = f"{title(curve)}: {point_in_words(curve)}, preload {preload_in_words(curve)}"
    if curve.amplitude is not None:
        name += f", amplitude {amplitude_in_words(curve)}"
    columns: list[tuple[str, Callable[[int], str]]] = [
        ("frequency [Hz]", lambda i: f"{curve.frequency[i]:.4g}"),
        (f"|K*| [{unit}]", lambda i: number(abs(K[i]), 4)),
        (f"K' [{unit}]", lambda i: number(K[i].real, 4)),
        (f"K'' [{unit}]", lambda i: number(K[i].imag, 4)),
        ("loss angle [deg]", lambda i: f"{math.degrees(curve.loss_angle[i]):.2f}"),
    ]
    if (third := curve.third_harmonic) is not None:
        columns.append(("third harmonic [%]", lambda i: f"{100 * third[i]:.2f}"))
    return table_of(name, range(len(K)), columns, left=0, most=_ROWS)


def solution_line(response: DynamicResponse) -> str:
    """Return how the vibrations were solved, and how long it took."""
    text = f"static march {response.seconds['static']:.1f} s, the rest {response.seconds['dynamic']:.2f} s"
    if not response.curves:
        return text
    worst = max(curve.reduction_error for curve in response.curves)
    vectors = max(curve.vectors for curve in response.curves)
    uneven = any(curve.uneven for curve in response.curves)
    return (
        f"{'harmonic balance of' if uneven else 'small'} vibrations about the relaxed preload, reduced to at most "
        f"{vectors} vectors: relative error of the reduction at most {number(worst, 2)}; {text}"
    )


def table_units(table: DynamicTable) -> tuple[str, str, str]:
    """Return the units of displacement, force and stiffness that are shown."""
    units = quantities(table.mode)
    return units.displacement_unit or "strain", units.force_unit, stiffness_unit(table.mode)


def dynamic_tables_section(tables: Sequence[DynamicTable]) -> Section:
    """Return a table with a row for each curve of each measured table, and what was understood from the files."""
    parts = [table.rows(rows) for table in tables for rows in table.conditions()]
    return Section(
        "Dynamic tables", [table_of("Dynamic tables", parts, _MEASURED, left=2), *_remarks(tables)]
    )


def misfit_lines(compared: Sequence[ComparedTable], tolerance: Tolerance | None = None) -> list[str]:
    """Return a sentence with the misfit of each table, and whether it is accepted."""
    lines = []
    for comparison in compared:
        line = (
            f"{comparison.table.name}: dynamic stiffness within {percent(comparison.stiffness_percent)} and "
        )
        line += f"{number(comparison.loss_angle_deg)} degrees of its table (rms)"
        if tolerance is not None and not comparison.within(tolerance):
            line += f", which is not within the accepted {tolerance.text}"
        lines.append(f"{line}.")
    return lines


def compared_section(compared: Sequence[ComparedTable]) -> Section:
    """Return a table with the misfit of each curve of each measured table."""
    curves = [(comparison, curve) for comparison in compared for curve in comparison.table.conditions()]
    parts = [(comparison.table.rows(rows), comparison.simulated[rows]) for comparison, rows in curves]
    title = "Dynamic stiffness: simulated and measured"
    tables = [comparison.table for comparison in compared]
    blocks = [table_of(title, parts, _COMPARED), *_remarks(tables), figures("table")]
    return Section(title, blocks if parts else [])


def _remarks(tables: Sequence[DynamicTable]) -> list[Block]:
    return paragraphs(f"{table.name}: {text}" for table in tables for text in table.remarks)


def preload_of(table: DynamicTable) -> str:
    """Return the preload of rows in words: "preload 1500 N"; with their temperature and amplitude, if these differ."""
    curve = table.rows(table.conditions()[0])
    conditions_text = [text for text in (_preload(curve), span(curve.temperature, "°C")) if text != "-"]
    return f"preload {', '.join(conditions_text)}" if conditions_text else "at rest"


def _motion(part: DynamicTable, values: Array) -> str:
    """Return the range of a motion: mm, degrees, or a strain in percent."""
    unit = table_units(part)[0]
    if unit == "strain":
        return span(100.0 * values, "%")
    return span(quantities(part.mode).per_internal * values, unit)


def _preload(part: DynamicTable) -> str:
    """Return the preload as a motion, or else as a force."""
    moved = _motion(part, part.preload)
    return span(part.preload_force, table_units(part)[1]) if moved == "-" else moved


def span(values: Array, unit: str) -> str:
    """Return the range of values, or their mean where they differ by less than is shown."""
    finite = values[~np.isnan(values)]
    if not len(finite):
        return "-"
    ends = [number(float(end)) for end in (finite.min(), finite.max())]
    return (ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}") + (f" {unit}" if unit else "")


# Of the rows of one curve.
_MEASURED: Columns[DynamicTable] = (
    ("channel", lambda part: part.name),
    ("quantity", lambda part: f"{part.quantity.replace('stiffness', 'K')}* [{table_units(part)[2]}]"),
    ("rows", lambda part: str(len(part))),
    ("frequency [Hz]", lambda part: span(part.frequency, "")),
    ("amplitude", lambda part: _motion(part, part.amplitude)),
    ("preload", _preload),
    ("temperature", lambda part: span(part.temperature, "°C")),
    ("magnitude", lambda part: span(part.stiffness, "")),
    ("loss angle [deg]", lambda part: span(np.degrees(part.loss_angle), "")),
)
# Of the same, and their simulated stiffness.
_COMPARED: Columns[tuple[DynamicTable, NDArray[np.complex128]]] = (
    ("channel", lambda row: row[0].name),
    ("frequency [Hz]", lambda row: span(row[0].frequency, "")),
    ("amplitude", lambda row: _motion(row[0], row[0].amplitude)),
    ("preload", lambda row: _preload(row[0])),
    ("|K*|", lambda row: span(row[0].stiffness, "")),
    ("simulated", lambda row: span(np.abs(row[1]), "")),
    ("misfit", lambda row: percent(100.0 * _rms(np.abs(row[1]) / row[0].stiffness - 1.0))),
    ("loss angle [deg]", lambda row: span(np.degrees(row[0].loss_angle), "")),
    ("simulated", lambda row: span(np.degrees(np.angle(row[1])), "")),
    ("misfit", lambda row: number(np.degrees(_rms(np.angle(row[1]) - row[0].loss_angle)))),
)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
