"""Dynamic stiffness -> its document: K* and loss angle over frequency, a table for each preload."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bushcli.report.conditions import conditions
from bushcli.report.document import Columns, Document, Section, Table, figures, paragraphs, table_of
from bushcli.report.quantity import number, quantities
from bushcli.report.views.fit import fit_section
from cases.mode import modes

if TYPE_CHECKING:
    from bushcli.inverse import Fit
    from bushcli.simulate.dynamic import DynamicResponse
    from bushcli.simulate.vibrations import DynamicCurve

# Rows of a printed table; the page, the CSV file and the JSON have all.
_ROWS = 10


def dynamic_document(response: DynamicResponse, fit: Fit | None) -> Document:
    """Return the document of dynamic stiffness.

    Parameters
    ----------
    response : DynamicResponse
    fit : Fit or None
        Fit to the coupons; None where the case gives the parameters.
    """
    count = len({(curve.name, curve.preload) for curve in response.curves})
    tables = [frequency_table(curve) for curve in response.curves]
    headline = f"Dynamic stiffness about {count} preload{'' if count == 1 else 's'}"
    lines = [] if response.complete else ["Not every preload has a result: see the problems."]
    return Document(
        headline,
        lines,
        "plain" if response.complete else "bad",
        [
            *([] if fit is None else [fit_section(fit)]),
            Section("Dynamic stiffness and loss angle", [figures("dynamic")]),
            Section("Preloads", [table_of("", response.curves, _PRELOADS, left=3)]),
            Section(
                "Tables", [replace(one, on="terminal") for one in tables], "both", "All frequencies", tables
            ),
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
    shown = quantities(curve.mode)
    travel = f"{number(shown.at(curve.preload), 4)} {shown.displacement_unit}".strip()
    # At rest the force is rounding.
    return f"{travel}, {number(round(curve.force, 9), 4)} {shown.force_unit}"


def amplitude_in_words(curve: DynamicCurve) -> str:
    """Return the amplitude, "small" where none is given."""
    if curve.amplitude is None:
        return "small"
    shown = quantities(curve.mode)
    return f"{shown.per_internal * curve.amplitude:.4g} {shown.displacement_unit}".strip()


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
    if response.curves:
        worst = max(curve.reduction_error for curve in response.curves)
        vectors = max(curve.vectors for curve in response.curves)
        kind = "small vibrations"
        if any(curve.uneven for curve in response.curves):
            kind = "harmonic balance of vibrations"
        text = (
            f"{kind} about the relaxed preload, reduced to at most {vectors} vectors: relative error of the "
            f"reduction at most {number(worst, 2)}; {text}"
        )
    return text
