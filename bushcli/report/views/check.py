"""A checked case -> its document: what was understood, its recordings, and the protocol of its tests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bushcli.case import DynamicTest, LoadCase
from bushcli.recording import RecordedProgram, Recording, branches
from bushcli.recording.text.table import SHOWN
from bushcli.report.conditions import conditions
from bushcli.report.document import Document, Row, Section, Table, paragraphs, table_of
from bushcli.report.quantity import listed, number, quantities
from bushcli.report.results import Checked
from bushcli.report.views.dynamic import dynamic_tables_section
from bushcli.report.views.mesh import notes_section
from bushcli.standards import Observed
from bushcli.standards.protocol import Protocol
from cases.mode import modes
from cases.six import MOTIONS, REACTIONS

#: What a coupon's columns are called.
_COUPON = {"displacement": "strain", "force": "stress"}
#: Most unused columns that are listed.
_MOST = 8
_MARKS = {True: "yes", False: "no", None: "not known"}


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


def protocol_sections(found: Protocol) -> list[Section]:
    """Return the sections that describe the tests of a case."""
    said = [f"{channel}: {text}" for channel, text in found.remarks]
    tests = [observed_line(one) for one in (*found.recordings, *found.coupons)]
    lacks = [
        f"{one.question} ({', '.join(one.channels)}): {one.why}. To answer it, {one.remedy}."
        for one in found.lacks
    ]
    return [
        Section("How the files were read", paragraphs([*map(file_line, found.files), *said])),
        Section("What the tests are", paragraphs(tests)),
        *(
            Section(
                f"{channel} and {name}",
                paragraphs(
                    f"{_MARKS[clause.met]}: {'good practice, ' if clause.practice else ''}{clause.text} "
                    f"(found: {clause.found})"
                    for clause in asked
                ),
            )
            for channel, name, asked in found.judged
        ),
        Section("What the recordings leave open", paragraphs(lacks)),
    ]


def file_line(one: Recording | RecordedProgram) -> str:
    """Return which columns of a file were read as what, and in which units."""
    words = []
    coupon = modes()[one.mode].specimen == "coupon"
    for column in one.columns:
        quantity = _COUPON.get(column.quantity, column.quantity) if coupon else column.quantity
        name = f" ({column.name[:SHOWN]})" if column.name else ""
        assumed = ", assumed because no unit is given" if column.assumed else ""
        if not column.unit:
            words.append(f"{quantity} = column {column.number}{name}")
            continue
        unit = f"as a {column.unit}" if column.unit in ("strain", "stretch") else f"in {column.unit}"
        words.append(f"{quantity} = column {column.number}{name} {unit}{assumed}")
    if all(column.quantity != "time" for column in one.columns):
        words.append("no column of time")
    shown = [name[:SHOWN] for name in one.unused[:_MOST]]
    more = len(one.unused) - len(shown)
    shown += [f"{more} more"] if more else []
    words += [f"not used: {', '.join(shown)}"] if shown else []
    return f"{one.name}: {'; '.join(words)}"


def observed_line(one: Observed) -> str:
    """Return cycles, rates, holds and pauses of a test in words."""
    shown = quantities(one.mode)
    cycles = len(one.compared)
    words = [f"{cycles} cycle{'s' if cycles != 1 else ''}"]
    if one.conditioning:
        words[0] += f" after {one.conditioning} for conditioning"
    if not one.timed:
        words.append("no time")
    elif one.rates:
        # Classes of rates that differ by less than is shown are named once.
        rates = dict.fromkeys(number(shown.per_internal * rate) for rate in one.rates)
        words.append(f"ramps at {listed(list(rates))} {shown.rate_unit}")
    for held, where in ((one.holds, "hold"), (one.rests, "rest")):
        if held:
            plural = f"{where}s" if len(held) > 1 else where
            words.append(f"{len(held)} {plural} of up to {number(max(held))} s")
    if one.pauses:
        plural = "pauses" if len(one.pauses) > 1 else "pause"
        words.append(
            f"{len(one.pauses)} {plural} of the logger of up to {number(max(one.pauses))} s, in which it moved"
        )
    words += [] if one.unloads else ["without unloading"]
    words += [] if one.from_rest else ["not from rest"]
    return f"{one.channel}: {', '.join(words)}"
