"""Results for the user: tables with rules on a terminal, plain aligned columns in piped output.

Every function returns a rich renderable, which the command line prints. Colour only repeats what the words say; piped
output has no colour.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import rich.table
from rich import box
from rich.console import Console, ConsoleOptions, Group, RenderResult
from rich.padding import Padding
from rich.text import Text

from bushcli.faults import DataFault, condition
from bushcli.report.contact import contact_tables
from bushcli.report.cycles import ChannelHistory, response_histories
from bushcli.report.cycles_tables import history_tables
from bushcli.report.json.direct import problems_of
from bushcli.report.quantity import percent
from bushcli.report.six import six_tables
from bushcli.report.tables import (
    ReportTable,
    case_table,
    channel_table,
    fit_lines,
    fitted_table,
    load_case_table,
    measure_table,
    mesh_table,
    parameter_table,
    recording_table,
)
from bushcli.report.verdict import judge

if TYPE_CHECKING:
    from bushcli.case import Case
    from bushcli.inverse import Fit
    from bushcli.recording import RecordedProgram, Recording
    from bushcli.runtime.condition import Condition
    from bushcli.simulate.meshes import Meshed
    from bushcli.simulate.misfit import Misfit
    from bushcli.simulate.response import Response
    from geometry.shape import Shape


@dataclass(frozen=True)
class Shown:
    """A table on a console: with rules on a terminal, as plain aligned columns elsewhere."""

    table: ReportTable

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Draw the table for the given console."""
        # The title is printed separately: as title of the table it would be wrapped at the width of a narrow table.
        yield Text(self.table.title, "bold")
        drawn = rich.table.Table(
            box=box.SIMPLE_HEAD if console.is_terminal else None,
            pad_edge=False,
            padding=(0, 2, 0, 0),
            header_style="bold",
            show_header=any(self.table.heads),
        )
        for i, head in enumerate(self.table.heads):
            justify: Literal["left", "right"] = "left" if i < self.table.left else "right"
            drawn.add_column(Text(head), justify=justify)
        for row in self.table.rows:
            # As Text, because a name in square brackets must not act as mark-up.
            drawn.add_row(*(Text(cell) for cell in row))
        yield drawn


def direct_text(response: Response, misfits: Mapping[str, Misfit], fit: Fit | None) -> Group:
    """Return the coupon fit if there was one, the table of channels, the verdict and the problems.

    Parameters
    ----------
    response : Response
        The simulated channels.
    misfits : mapping of str to Misfit
        By channel name, for the channels that were compared with a recording.
    fit : Fit or None
        Fit to the coupons; None where the case gives the parameters.
    """
    parts: list[object] = []
    if fit is not None:
        parts += [*_fit_parts(fit), Text()]
    parts.append(Shown(channel_table(response, misfits)))
    tables = [*six_tables(response), *contact_tables(response)]
    parts += [part for table in tables for part in (Text(), Shown(table))]
    checked = [channel for channel in response.channels if channel.mesh_error is not None]
    if checked:
        errors = ", ".join(f"{channel.name} {percent(channel.mesh_error)}" for channel in checked)
        parts.append(Text(f"estimated error of the mesh, of the force range: {errors}", "dim"))
    parts += history_parts(response_histories(response, misfits))
    verdict = judge(response, misfits)
    style = {True: "bold green", False: "bold red", None: "bold"}[verdict.within]
    parts += [Text(), Text(f"{verdict.headline}.", style)]
    parts += [Padding(Text(line), (0, 0, 0, 2)) for line in verdict.lines]
    parts += problem_parts(problems_of(response, misfits, fit))
    return Group(*parts)  # type: ignore[arg-type]  # every part is a renderable


def fit_text(fit: Fit) -> Group:
    """Return the identified law: parameters, misfit by coupon, stability, problems."""
    return Group(*_fit_parts(fit), *problem_parts(fit.conditions))  # type: ignore[arg-type]


def case_text(
    case: Case,
    curves: Sequence[Recording],
    coupons: Sequence[Recording],
    faults: Sequence[DataFault] = (),
    programs: Sequence[RecordedProgram | None] = (),
) -> Group:
    """Return a summary of a case, of its load cases, of its recordings and of their faults.

    Parameters
    ----------
    case : Case
        The validated case.
    curves : sequence of Recording
        Recordings of the bushing.
    coupons : sequence of Recording
        Coupon tests.
    faults : sequence of DataFault
        Faults of recordings and coupon tests.
    programs : sequence of RecordedProgram or None
        Programs of the load cases that have them in a file; without them no load cases are shown.
    """
    parts: list[object] = [Shown(case_table(case)), *_notes(case.geometry)]
    if programs:
        parts += [Text(), Shown(load_case_table(case, programs))]
    for title, recorded in (("Recordings", curves), ("Coupon tests", coupons)):
        if recorded:
            parts += [Text(), Shown(recording_table(title, recorded))]
    parts += problem_parts(map(condition, faults))
    return Group(*parts)  # type: ignore[arg-type]


def mesh_text(meshes: Sequence[Meshed], shape: Shape | None = None) -> Group:
    """Return the interpretation of a geometry file with its areas and volumes, and the sizes of the meshes.

    Parameters
    ----------
    meshes : sequence of Meshed
        The meshes that were built.
    shape : Shape or None
        Shape of the case; its interpretation is shown if it was read from a file.
    """
    parts: list[object] = []
    if shape is not None and shape.notes:
        parts += [*_notes(shape), Text(), Shown(measure_table(shape)), Text()]
    if shape is not None and shape.overall is not None:
        wall = "" if shape.wall is None else f", rubber {shape.wall.thickness:.4g} mm between the bonds"
        parts += [Text(f"Size in mm: {shape.overall:.4g} overall{wall}"), Text()]
    return Group(*parts, Shown(mesh_table(meshes)))  # type: ignore[arg-type]


def _notes(shape: Shape) -> list[object]:
    """Return the interpretation of a geometry file."""
    head = [Text(), Text("How the file was interpreted", "bold")] if shape.notes else []
    return [*head, *(Padding(Text(note), (0, 0, 0, 2)) for note in shape.notes)]


def _fit_parts(fit: Fit) -> list[object]:
    solved = (
        f"{'converged' if fit.converged else 'not converged'} after {fit.iterations} iterations, "
        f"{fit.sweeps} evaluations, {fit.forward_solves} simulations of one test, {fit.seconds:.1f} s"
    )
    return [
        Shown(parameter_table(fit)),
        Text(),
        Shown(fitted_table(fit)),
        *(Text(line) for line in fit_lines(fit)),
        Text(solved, "dim"),
    ]


def history_parts(histories: Sequence[ChannelHistory]) -> list[object]:
    """Return cycles and holds of every channel, long tables without their middle rows."""
    return [part for table in history_tables(histories, brief=True) for part in (Text(), Shown(table))]


def problem_parts(found: Iterable[Condition]) -> list[object]:
    """Return the problems, each with its remedy."""
    parts: list[object] = []
    for problem in found:
        parts += [
            Text(),
            Text.assemble(("problem ", "bold yellow"), (problem.name, "bold"), f": {problem.message}"),
            Padding(Text(f"remedy: {problem.remedy}"), (0, 0, 0, 2)),
        ]
    return parts
