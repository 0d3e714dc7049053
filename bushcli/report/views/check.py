"""A checked case -> its document: what was understood, its recordings, and the protocol of its tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bushcli.case import Case, DynamicTest, LoadCase
from bushcli.faults import DataFault, condition
from bushcli.recording import RecordedProgram, Recording, branches
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.report.conditions import conditions
from bushcli.report.document import Document, Row, Section, Table, table_of
from bushcli.report.quantity import number, quantities
from bushcli.report.views.dynamic_tables import dynamic_tables_section
from bushcli.report.views.mesh import notes_section
from bushcli.report.views.protocol import protocol_sections
from bushcli.runtime.condition import Condition
from bushcli.standards.protocol import Protocol
from cases.six import MOTIONS, REACTIONS


@dataclass(frozen=True)
class Checked:
    """A case that was checked.

    Attributes
    ----------
    curves, coupons : sequence of Recording
        Recordings of the bushing, and coupon tests.
    tests : Protocol
        What the tests are.
    faults : sequence of DataFault
        Faults of recordings and coupon tests.
    programs : sequence of RecordedProgram or None
        For each load case the program that it has in a file.
    problems : sequence of Condition
        Those that are no faults of recordings.
    tables : sequence of DynamicTable
        Measured tables of dynamic stiffness.
    """

    case: Case
    curves: Sequence[Recording]
    coupons: Sequence[Recording]
    tests: Protocol
    faults: Sequence[DataFault] = ()
    programs: Sequence[RecordedProgram | None] = ()
    problems: Sequence[Condition] = ()
    tables: Sequence[DynamicTable] = ()

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """All conditions, those of the faults first."""
        return (*map(condition, self.faults), *self.problems)


def check_document(found: Checked) -> Document:
    """Return the document of a case that was checked."""
    case, seen = found.case, conditions(found.case)
    loads = [load_case_row(*one) for one in zip(case.load_cases, found.programs, strict=True)]
    heads = ("load case", "mode", "program", "from", "to", "")
    sections = [
        Section(case.title, [Table("", ("", ""), tuple(seen), left=2)]),
        notes_section(case.geometry),
        Section("Load cases", [Table("Load cases", heads, tuple(loads), left=3)]),
        Section("Vibrations", [vibration_table(case.vibrations)]),
        Section("Recordings", [_recording_table("Recordings", found.curves)]),
        Section("Coupon tests", [_recording_table("Coupon tests", found.coupons)]),
        *([dynamic_tables_section(found.tables)] if found.tables else []),
        *protocol_sections(found.tests),
    ]
    return Document("", (), "plain", sections, found.conditions, seen)


def vibration_table(tests: Sequence[DynamicTest]) -> Table:
    """Return a row for each dynamic test: frequencies and preloads."""
    heads = ("vibration", "mode", "preload", "", "amplitude", "", "frequencies", "from", "to", "")

    def row(test: DynamicTest) -> Row:
        shown = quantities(test.mode)
        preload = ", ".join(number(q if test.by_force else shown.at(q)) for q in test.preload)
        unit = shown.force_unit if test.by_force else shown.displacement_unit
        preloads = (preload, unit) if test.pose is None else ("the end of its path", "")
        peak = ", ".join(number(shown.per_internal * one) for one in test.amplitude) or "small"
        peaks = (peak, shown.displacement_unit if test.amplitude else "")
        ends = (f"{end(test.frequency):g}" for end in (min, max))
        return (test.label, test.mode, *preloads, *peaks, str(len(test.frequency)), *ends, "Hz")

    return Table("Vibrations", heads, tuple(map(row, tests)), left=3)


def _recording_table(title: str, curves: Sequence[Recording]) -> Table:
    """Return a row for each recording: samples, cycles, ranges of displacement and force."""
    return table_of(
        title,
        [(curve, quantities(curve.mode)) for curve in curves],
        (
            ("channel", lambda one: one[0].name),
            ("mode", lambda one: one[0].mode),
            ("samples", lambda one: str(len(one[0].force))),
            ("cycles", lambda one: str(len({branch.cycle for branch in branches(one[0])}))),
            ("from", lambda one: number(one[1].at(one[0].displacement.min()))),
            ("to", lambda one: number(one[1].at(one[0].displacement.max()))),
            ("", lambda one: one[1].displacement_unit or one[1].displacement),
            ("force from", lambda one: number(float(one[0].force.min()))),
            ("to", lambda one: number(float(one[0].force.max()))),
            ("", lambda one: one[1].force_unit),
        ),
        left=2,
    )


def load_case_row(load: LoadCase, read: RecordedProgram | None) -> Row:
    """Return a load case as a row: its program, and the range of what it prescribes."""
    if load.six is not None:
        six = load.six
        moved = [MOTIONS[k] for k in range(6) if np.ptp(six.motion[:, k]) > 0.0]
        motions = [f"{', '.join(moved) or 'nothing'} moved"]
        motions += [f"{', '.join(REACTIONS[k] for k in six.loaded)} prescribed"] if six.loaded else []
        free = [MOTIONS[k] for k in six.free if k not in six.loaded]
        motions += [f"{', '.join(free)} free"] if free else []
        return load.label, load.mode, f"{len(load.six.time)} poses: {'; '.join(motions)}", "", "", ""
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
    return load.label, load.mode, program, number(low), number(high), unit or shown.displacement
