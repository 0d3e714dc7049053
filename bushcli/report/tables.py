"""Results as tables of text, for both the terminal and the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bushcli.case import load_case_names
from bushcli.recording import RecordedProgram, Recording, branches
from bushcli.report.conditions import conditions
from bushcli.report.fit_part import bulk_modulus_std
from bushcli.report.quantity import Quantities, number, percent, quantities, with_std
from cases.mode import modes
from cases.six import MOTIONS

if TYPE_CHECKING:
    from bushcli.case import Case, LoadCase
    from bushcli.inverse import Fit
    from bushcli.simulate.meshes import Meshed
    from bushcli.simulate.misfit import Misfit
    from bushcli.simulate.response import Response
    from geometry.shape import Shape

Array = NDArray[np.float64]
Row = tuple[str, ...]


@dataclass(frozen=True)
class ReportTable:
    """A table.

    Attributes
    ----------
    title : str
    heads : tuple of str
    rows : tuple of rows
    left : int
        Number of columns, from the left, that are words; the others are numbers and aligned right.
    """

    title: str
    heads: Row
    rows: tuple[Row, ...]
    left: int = 1


def case_table(case: Case) -> ReportTable:
    """Return a table of the bushing and the rubber of a case."""
    return ReportTable(case.title, ("", ""), tuple(conditions(case)), left=2)


def recording_table(title: str, curves: Sequence[Recording]) -> ReportTable:
    """Return a row for each recording: samples, cycles, ranges of displacement and force.

    Parameters
    ----------
    title : str
        Title of the table.
    curves : sequence of Recording
        The recordings.
    """
    heads = ("channel", "mode", "samples", "cycles", "from", "to", "", "force from", "to", "")
    return ReportTable(title, heads, tuple(_recording_row(curve) for curve in curves), left=2)


def load_case_table(case: Case, programs: Sequence[RecordedProgram | None]) -> ReportTable:
    """Return a row for each load case: its range, segments and rate, or the motions of a path.

    Parameters
    ----------
    case : Case
    programs : sequence of RecordedProgram or None
        Programs of the load cases that have them in a file.
    """
    heads = ("load case", "mode", "program", "from", "to", "")
    names = load_case_names(case.load_cases, case.recordings)
    found = zip(names, case.load_cases, programs, strict=True)
    return ReportTable("Load cases", heads, tuple(_load_case_row(*one) for one in found), left=3)


def measure_table(shape: Shape) -> ReportTable:
    """Return the volumes of the bodies and the areas of the bonds."""
    rows = tuple(
        (name.replace("_bond", " bond"), f"{value:.6g}", "mm2" if name.endswith("_bond") else "mm3")
        for name, value in shape.measures().items()
    )
    return ReportTable("Volumes and areas", ("", "", ""), rows, left=1)


def mesh_table(meshes: Sequence[Meshed]) -> ReportTable:
    """Return size and boundaries of the meshes."""
    rows = tuple(
        (mesh.name, ", ".join(mesh.modes), ", ".join(mesh.boundaries), str(mesh.cells), str(mesh.nodes))
        for mesh in meshes
    )
    return ReportTable("Meshes", ("mesh", "for", "boundaries", "elements", "nodes"), rows, left=3)


def channel_table(response: Response, misfits: Mapping[str, Misfit]) -> ReportTable:
    """Return simulated and measured stiffness, misfit and "within the tolerance" of each channel.

    Parameters
    ----------
    response : Response
        The simulated channels.
    misfits : mapping of str to Misfit
        By channel name, for the channels that were compared with a recording.
    """
    return _compared(response, misfits) if misfits else _simulated(response)


def _simulated(response: Response) -> ReportTable:
    heads = ("channel", "unit", "initial stiffness", "secant stiffness", "from", "to", "")
    rows: list[Row] = []
    for channel in response.channels:
        shown = quantities(channel.mode)
        ends = [shown.at(q) for q in (min(channel.curve.displacement), max(channel.curve.displacement))]
        leads = "" if channel.six is None else f" ({MOTIONS[channel.six.lead]})"
        rows.append(
            (
                f"{channel.name}{leads}",
                shown.stiffness_unit,
                number(shown.stiffness(channel.curve.initial_stiffness())),
                number(shown.stiffness(channel.curve.secant_stiffness())),
                *(number(end) for end in ends),
                shown.displacement_unit,
            )
        )
    return ReportTable("Simulated stiffness", heads, tuple(rows), left=2)


def _compared(response: Response, misfits: Mapping[str, Misfit]) -> ReportTable:
    heads = (
        *("channel", "stiffness", "simulated", "measured", "sim/meas"),
        *("rms", "peak", "noise", f"within {response.case.tolerance.text}"),
    )
    rows = []
    for channel in response.channels:
        shown, found = quantities(channel.mode), misfits.get(channel.name)
        unit = shown.stiffness_unit
        if found is None:
            secant = number(shown.stiffness(channel.curve.secant_stiffness()))
            rows.append((channel.name, f"secant, {unit}", secant, *("-",) * 6))
            continue
        for name, ours, theirs, rest in (
            (
                "secant",
                found.predicted.secant,
                found.measured.secant,
                (
                    percent(found.rms_percent),
                    percent(found.peak_percent),
                    percent(found.noise_percent),
                    "yes" if found.within else "no",
                ),
            ),
            ("initial", found.predicted.initial, found.measured.initial, ("", "", "", "")),
        ):
            rows.append(
                (
                    channel.name if name == "secant" else "",
                    f"{name}, {unit}",
                    number(shown.stiffness(ours)),
                    number(shown.stiffness(theirs)),
                    f"{ours / theirs:.2f}" if theirs and np.isfinite(ours / theirs) else "-",
                    *rest,
                )
            )
    return ReportTable("Simulated against measured", heads, tuple(rows), left=2)


def solution_table(response: Response) -> ReportTable:
    """Return the numbers of the solution of each channel."""
    rows = []
    for channel in response.channels:
        rejected = sum(not attempt.accepted for attempt in channel.attempts)
        low, high = channel.strained.range
        rows.append(
            (
                channel.name,
                str(channel.unknowns),
                str(len(channel.attempts)) + (f" ({rejected} cut back)" if rejected else ""),
                str(channel.newton),
                f"{low:.2f} to {high:.2f}",
                percent(100 * channel.strained.unstable) if channel.strained.unstable else "none",
                "not checked" if channel.mesh_error is None else percent(channel.mesh_error),
                f"{sum(channel.seconds.values()):.2f} s",
                "yes" if not channel.stopped else f"stopped: {channel.stopped}",
            )
        )
    heads = (
        *("channel", "unknowns", "steps", "Newton", "stretches*"),
        *("unstable states", "mesh error", "time", "complete"),
    )
    return ReportTable(
        "How it was solved (*smallest and largest principal stretch at the elements' Gauss points)",
        heads,
        tuple(rows),
    )


def parameter_table(fit: Fit) -> ReportTable:
    """Return the parameters of the identified law."""
    # Imported only if there is a fit, because it loads PETSc and DOLFINx.
    from bushcli.inverse.file_units import parameter_unit

    rows = [
        (
            name,
            number(estimate.value, 4),
            number(estimate.std, 2),
            "-" if parameter_unit(fit, name) == "1" else parameter_unit(fit, name),
            f"{number(estimate.lower)} to {number(estimate.upper)}"
            + (" (at bound)" if estimate.at_bound else ""),
        )
        for name, estimate in fit.parameters.items()
    ]
    return ReportTable(
        f"Law {fit.material.law}", ("parameter", "value", "std", "unit", "bounds"), tuple(rows)
    )


def fitted_table(fit: Fit) -> ReportTable:
    """Return the curves of a fit: misfit, range tested, range in which the law is stable."""
    rows = []
    for curve in fit.curves:
        mode, shown = curve.recording.mode, quantities(curve.recording.mode)
        low, high = (
            shown.at(q) for q in (curve.recording.displacement.min(), curve.recording.displacement.max())
        )
        # Simple shear reaches the states of a planar test.
        limits = fit.stability.get("planar" if modes()[mode].sheared else mode)
        rows.append(
            (
                f"{curve.name} (held out)" if curve.held_out else curve.name,
                mode,
                percent(curve.rms_percent),
                _range(low, high, shown),
                "-" if limits is None else _interval(*limits),
            )
        )
    heads = ("test", "mode", "rms misfit", "tested", "stable at stretch")
    weighting = f", {fit.weighting} weighting" if _all_coupons(fit) else ""
    return ReportTable(f"Fitted to {curves_of(fit)}{weighting}", heads, tuple(rows), left=2)


def fit_lines(fit: Fit) -> list[str]:
    """Return sentences on the branches of the coupons that were fitted, and on where the bulk modulus comes from."""
    lines = []
    for curve in fit.curves:
        if curve.branch:
            of = f"{curve.samples} of {len(curve.recording.force)} samples"
            which = (
                "loading and unloading together" if curve.branch == "both" else f"{curve.branch} alone ({of})"
            )
            count = len({branch.cycle for branch in branches(curve.recording)})
            cycles = f", of all {count} cycles (cycles chooses among them)" if count > 1 else ""
            other = {"loading": "unloading", "unloading": "loading"}.get(curve.branch, "loading")
            lines.append(
                f'{curve.name}: fitted to {which}{cycles}; --branch {other} or branch = "{other}" changes it'
            )
    bulk, std = fit.material.bulk_modulus, bulk_modulus_std(fit)
    if not _all_coupons(fit):
        return lines
    if std is not None:
        lines.append(f"bulk modulus {with_std(bulk, std)} MPa, identified from the volumetric tests")
    else:
        value = "incompressible" if np.isinf(bulk) else f"bulk modulus {number(bulk, 4)} MPa"
        lines.append(
            f"{value}, as the case gives it: no coupon test here can identify it, a volumetric one would"
        )
    return lines


def _range(low: float, high: float, shown: Quantities) -> str:
    unit = shown.displacement_unit
    return (
        f"{number(low)} to {number(high)} {unit}"
        if unit
        else f"{shown.displacement} {number(low)} to {number(high)}"
    )


def curves_of(fit: Fit) -> str:
    """Return the data to which a law was fitted, in words: "3 coupon tests"."""
    count = sum(not curve.held_out for curve in fit.curves)
    return f"{count} {'coupon test' if _all_coupons(fit) else 'recording'}{'s' if count != 1 else ''}"


def _all_coupons(fit: Fit) -> bool:
    return all(modes()[curve.recording.mode].specimen == "coupon" for curve in fit.curves)


def _interval(low: float, high: float) -> str:
    if low <= 0 and not np.isfinite(high):
        return "all"
    if low <= 0:
        return f"below {high:.2f}"
    return f"above {low:.2f}" if not np.isfinite(high) else f"{low:.2f} to {high:.2f}"


def _recording_row(curve: Recording) -> tuple[str, ...]:
    shown = quantities(curve.mode)
    low, high = (shown.at(q) for q in (curve.displacement.min(), curve.displacement.max()))
    return (
        curve.name,
        curve.mode,
        str(len(curve.displacement)),
        str(len({branch.cycle for branch in branches(curve)})),
        number(low),
        number(high),
        shown.displacement_unit or shown.displacement,
        number(float(curve.force.min())),
        number(float(curve.force.max())),
        shown.force_unit,
    )


def _load_case_row(name: str, load: LoadCase, read: RecordedProgram | None) -> Row:
    if load.six is not None:
        free = [MOTIONS[k] for k in load.six.free]
        moved = [MOTIONS[k] for k in range(6) if np.ptp(load.six.motion[:, k]) > 0.0]
        motions = [f"{', '.join(moved) or 'nothing'} moved", *([f"{', '.join(free)} free"] if free else [])]
        return name, load.mode, f"{len(load.six.time)} poses: {'; '.join(motions)}", "", "", ""
    shown = quantities(load.mode)
    values = np.array(load.path) if read is None else read.displacement
    unit = shown.force_unit if load.by_force else shown.displacement_unit
    low, high = (float(end if load.by_force else shown.at(end)) for end in (values.min(), values.max()))
    per = 1.0 if load.by_force else shown.per_internal
    if load.source is not None:
        program = f"{len(values)} points of {load.source.file.name}"
    else:
        segments = len(values) - 1
        program = f"{segments} segment{'s' * (segments != 1)}, up to {load.steps} steps each"
        if load.rate is not None:
            program += f", {number(per * load.rate)} {unit or shown.displacement}/s"
    return name, load.mode, program, number(low), number(high), unit or shown.displacement
