"""A direct prediction -> its document: stiffness, misfit, six motions, contact, and how it was solved."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from bushcli.errors import count_of
from bushcli.report.conditions import conditions
from bushcli.report.document import (
    Array,
    Columns,
    Document,
    Row,
    Section,
    Table,
    figures,
    paragraphs,
    table_of,
)
from bushcli.report.quantity import (
    FORCE_UNITS,
    MOTION_UNITS,
    largest_reactions,
    number,
    percent,
    quantities,
    shown_motion,
)
from bushcli.report.results import DirectResult
from bushcli.report.views.cycles import history_section
from bushcli.report.views.dynamic import compared_section, misfit_lines
from bushcli.report.views.fit import fit_section
from bushcli.report.views.mesh import measure_table
from bushcli.runtime.digits import with_decimals
from cases.six import MOTIONS, REACTIONS

if TYPE_CHECKING:
    from bushcli.simulate.misfit import Misfit
    from bushcli.simulate.response import Response, Simulated, SixCurve


# Rows of a printed path: its ends and states between them.
_ROWS = 9
# Values below this share of the largest one of the same kind are rounding errors and are printed as zero.
_NOTHING = 1e-6


def direct_document(result: DirectResult) -> Document:
    """Return the document of a direct prediction."""
    response, verdict, shape = result.response, result.verdict, result.response.case.geometry
    compared, headline, tolerance = result.tables or (), verdict.headline, response.case.tolerance
    if compared and not response.channels:
        headline = f"{count_of(len(compared), 'table')} of dynamic stiffness compared"
    checked = [channel for channel in response.channels if channel.mesh_error is not None]
    errors = ", ".join(f"{channel.name} {percent(channel.mesh_error)}" for channel in checked)
    error = f"estimated error of the mesh, of the force range: {errors}" if errors else ""
    interpretation = [*paragraphs(shape.notes), measure_table(shape), figures("geometry")]
    stiffness = comparison_table(response, result.misfits) if result.misfits else stiffness_table(response)
    solution = table_of(_SOLVED, response.channels, _SOLUTION)
    sections = [
        Section("Channels", [stiffness, *paragraphs([error], kind="note")]),
        Section(f"Simulated {'and recorded ' if result.misfits else ''}curves", [figures("curve")]),
        Section("Six motions", [*six_tables(response), figures("six")]),
        history_section(result.histories),
        *([] if result.fit is None else [fit_section(result.fit)]),
        Section("Contact", [contact_table(response)]),
        Section("How the geometry file was interpreted", interpretation if shape.notes else [], on="page"),
        Section("Deformed shape at the largest displacement", [figures("deformed")]),
        Section("Mesh and solution", [solution, figures("mesh")], on="page"),
        compared_section(compared),
    ]
    return Document(
        headline,
        [*verdict.lines, *misfit_lines(compared, tolerance)],
        verdict.tone if all(table.within(tolerance) for table in compared) else "bad",
        sections,
        result.conditions,
        conditions(response.case, response.material),
        ends_with_verdict=True,
    )


def stiffness_table(response: Response) -> Table:
    """Return the stiffness of each channel that was not compared with a recording."""
    heads = ("channel", "unit", "initial stiffness", "secant stiffness", "from", "to", "")
    rows: list[Row] = []
    for channel in response.channels:
        units, curve = quantities(channel.mode), channel.curve
        leads = "" if channel.six is None else f" ({MOTIONS[channel.six.lead]})"
        rates = (curve.initial_stiffness(), curve.secant_stiffness())
        ends = (min(curve.displacement), max(curve.displacement))
        cells = [*(number(units.stiffness(rate)) for rate in rates), *(number(units.at(q)) for q in ends)]
        rows.append((f"{channel.name}{leads}", units.stiffness_unit, *cells, units.displacement_unit))
    return Table("Simulated stiffness", heads, tuple(rows), left=2)


def comparison_table(response: Response, misfits: Mapping[str, Misfit]) -> Table:
    """Return simulated and measured stiffness, misfit and "within the tolerance" of each channel."""
    heads = ("channel", "stiffness", "simulated", "measured", "sim/meas", "rms", "peak", "noise")
    rows: list[Row] = []
    for channel in response.channels:
        units, misfit = quantities(channel.mode), misfits.get(channel.name)
        unit = units.stiffness_unit
        if misfit is None:
            secant = number(units.stiffness(channel.curve.secant_stiffness()))
            rows.append((channel.name, f"secant, {unit}", secant, *("-",) * 6))
            continue
        peak = percent(misfit.peak_percent, misfit.tolerance.percent)
        errors = [percent(misfit.rms_percent), peak, percent(misfit.noise_percent)]
        ends = [1.0 + side * misfit.tolerance.band for side in (-1, 1)]
        for name, label, rest in (
            ("secant", channel.name, (*errors, "yes" if misfit.within else "no")),
            ("initial", "", ("",) * 4),
        ):
            simulated, measured = (getattr(slopes, name) for slopes in (misfit.predicted, misfit.measured))
            limits = ends if name == "secant" else ()
            ratio = simulated / measured if measured else math.nan
            text = with_decimals(ratio, *limits, decimals=2) if math.isfinite(ratio) else "-"
            cells = (number(units.stiffness(simulated)), number(units.stiffness(measured)), text)
            rows.append((label, f"{name}, {unit}", *cells, *rest))
    within = f"within {response.case.tolerance.text}"
    return Table("Simulated against measured", (*heads, within), tuple(rows), left=2)


def steps_in_words(channel: Simulated) -> str:
    """Return the number of steps tried, and of those cut back."""
    rejected = sum(not attempt.accepted for attempt in channel.attempts)
    return str(len(channel.attempts)) + (f" ({rejected} cut back)" if rejected else "")


_SOLVED = "How it was solved (*smallest and largest principal stretch at the elements' Gauss points)"
_SOLUTION: Columns[Simulated] = (
    ("channel", lambda channel: channel.name),
    ("unknowns", lambda channel: str(channel.unknowns)),
    ("steps", steps_in_words),
    ("Newton", lambda channel: str(channel.newton)),
    ("stretches*", lambda channel: "{:.2f} to {:.2f}".format(*channel.strained.range)),
    ("unstable states", lambda c: percent(100 * c.strained.unstable) if c.strained.unstable else "none"),
    ("mesh error", lambda c: "not checked" if c.mesh_error is None else percent(c.mesh_error)),
    ("time", lambda channel: f"{sum(channel.seconds.values()):.2f} s"),
    ("complete", lambda channel: f"stopped: {channel.stopped}" if channel.stopped else "yes"),
)


def contact_table(response: Response) -> Table:
    """Return where surfaces met; without rows where none did."""
    rows = []
    for channel in response.channels:
        units = quantities(channel.mode)
        unit = "s" if channel.in_time else units.displacement_unit
        for contact in channel.touched:
            first, largest = (displacement_at(channel, q) for q in (contact.first, contact.at))
            partner = " with itself" if len(set(contact.surfaces)) == 1 else f" and {contact.surfaces[1]}"
            cells = (f"{number(first)} {unit}", f"{number(contact.force)} N", f"{number(largest)} {unit}")
            place = (f"{number(contact.radius)} mm", f"{number(contact.height)} mm")
            rows.append((channel.name, f"{contact.surfaces[0]}{partner}".replace("_", " "), *cells, *place))
    heads = ("channel", "surfaces", "met by", "largest force*", "at", "radius", "z")
    how = "(*pressure integrated over the area; radius and z of where it acts in the deformed rubber)"
    return Table(f"Contact {how}", heads, tuple(rows), left=2)


def six_tables(response: Response) -> Iterator[Table]:
    """Yield the tables of a prediction's paths and stiffness matrices."""
    for channel in response.channels:
        if channel.six is not None and len(channel.six.time):
            yield path_table(channel.name, channel.six)
        for state, (displacement, matrix) in (channel.stiffness or {}).items():
            yield matrix_table(channel, state, displacement, matrix)


def path_table(name: str, six: SixCurve) -> Table:
    """Return motions and reactions at some times of a path."""
    chosen = np.unique(np.linspace(0, len(six.time) - 1, min(_ROWS, len(six.time))).round().astype(int))
    motion = shown_motion(six)
    moving = [k for k in range(6) if k in six.free or np.any(motion[:, k])]
    heads = ["time, s"]
    heads += [f"{MOTIONS[k]}{six.follows(k)}, {MOTION_UNITS[k]}" for k in moving]
    heads += [f"{force}, {unit}" for force, unit in zip(REACTIONS, FORCE_UNITS, strict=True)]
    largest = largest_reactions(six.force)
    widest = [float(np.abs(motion[:, part]).max()) for part in (slice(0, 3), slice(3, 6))]
    rows: list[Row] = []
    for i in chosen:
        forces = [_force(six.force[i, k], largest[k // 3]) for k in range(6)]
        moved = [_force(motion[i, k], widest[k // 3]) for k in moving]
        rows.append((number(six.time[i]), *moved, *forces))
    title = f"{name}: motions of the inner sleeve, and the reactions (moments about its centre)"
    return Table(title, tuple(heads), tuple(rows), left=0)


def matrix_table(channel: Simulated, state_name: str, displacement: float, matrix: Array) -> Table:
    """Return one stiffness matrix of a channel."""
    heads = ("", *(f"{name}, {'mm' if k < 3 else 'rad'}" for k, name in enumerate(MOTIONS)))
    diagonal = np.sqrt(np.abs(np.diag(matrix)))
    rows = []
    for k, name in enumerate(REACTIONS):
        row = [_force(matrix[k, m], float(diagonal[k] * diagonal[m])) for m in range(6)]
        rows.append((f"{name}, {FORCE_UNITS[k]}", *row))
    unit = "s" if channel.in_time else quantities(channel.mode).displacement_unit
    travel = f"{number(displacement_at(channel, displacement))} {unit}"
    place = f"at {travel}" if state_name == "at" else f"at the {state_name} ({travel})"
    state = f"; {channel.state}" if channel.state else ""
    return Table(f"{channel.name}: stiffness matrix {place}, N, mm, rad{state}", heads, tuple(rows), left=1)


def displacement_at(channel: Simulated, displacement: float) -> float:
    """Return a displacement in mm or degrees; on a path of six motions it is a time."""
    return displacement if channel.in_time else quantities(channel.mode).at(displacement)


def _force(value: float, largest: float) -> str:
    return "0" if abs(value) <= _NOTHING * largest else number(value, 4)
