"""A checked case -> its document: what was understood, its recordings, and the protocol of its tests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bushcli.case import DynamicTest, LoadCase
from bushcli.errors import count_of
from bushcli.recording import RecordedProgram, Recording
from bushcli.recording.source import Source
from bushcli.recording.text.table import SHOWN
from bushcli.report.conditions import conditions
from bushcli.report.document import Document, Row, Section, Table, paragraphs
from bushcli.report.quantity import join_names, number, quantities
from bushcli.report.results import CheckResult
from bushcli.report.views.dynamic import dynamic_tables_section, span
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


def check_document(checked: CheckResult) -> Document:
    """Return the document of a case that was checked."""
    case, condition_rows = checked.case, conditions(checked.case)
    loads = [load_case_row(*pair) for pair in zip(case.load_cases, checked.programs, strict=True)]
    heads = ("load case", "mode", "program", "from", "to", "")
    sections = [
        Section(case.title, [Table("", ("", ""), tuple(condition_rows), left=2)]),
        notes_section(case.geometry),
        Section("Load cases", [Table("Load cases", heads, tuple(loads), left=3)]),
        Section("Vibrations", [vibration_table(case.vibrations)]),
        Section(
            "Recordings",
            [_recording_table("Recordings", checked.curves, (*case.recordings, *case.specimens))],
        ),
        Section("Coupon tests", [_recording_table("Coupon tests", checked.coupons, case.coupons)]),
        dynamic_tables_section(checked.tables),
        *protocol_sections(checked.tests),
    ]
    return Document("", (), "plain", sections, checked.conditions, condition_rows)


def vibration_table(tests: Sequence[DynamicTest]) -> Table:
    """Return a row for each dynamic test: frequencies and preloads."""
    heads = ("vibration", "mode", "preload", "", "amplitude", "", "frequencies", "from", "to", "")

    def row(test: DynamicTest) -> Row:
        units = quantities(test.mode)
        preload = ", ".join(number(q if test.by_force else units.at(q)) for q in test.preload)
        unit = units.force_unit if test.by_force else units.displacement_unit
        preloads = (preload, unit) if test.pose is None else ("the end of its path", "")
        peak = ", ".join(number(units.per_internal * amplitude) for amplitude in test.amplitude) or "small"
        peaks = (peak, units.displacement_unit if test.amplitude else "")
        ends = (f"{end(test.frequency):g}" for end in (min, max))
        return (test.label, test.mode, *preloads, *peaks, str(len(test.frequency)), *ends, "Hz")

    return Table("Vibrations", heads, tuple(map(row, tests)), left=3)


def _recording_table(title: str, curves: Sequence[Recording], sources: Sequence[Source]) -> Table:
    """Return a row for each recording: samples, cycles, ranges of displacement and force; temperatures, if given."""
    rows = []
    of_case = {source.label: source.temperature for source in sources}
    given = [of_case.get(curve.name) if curve.temperature is None else curve.temperature for curve in curves]
    warm = ["-" if value is None else span(np.atleast_1d(value), "°C") for value in given]
    shown = any(value is not None for value in given)
    for curve, temperature in zip(curves, warm, strict=True):
        units, q, force = quantities(curve.mode), curve.displacement, curve.force
        counts = (str(len(force)), str(len({branch.cycle for branch in curve.branches})))
        travel = (number(units.at(q.min())), number(units.at(q.max())))
        unit, forces = (
            units.displacement_unit or units.displacement,
            (number(force.min()), number(force.max())),
        )
        row = (curve.name, curve.mode, *counts, *travel, unit, *forces, units.force_unit)
        rows.append((*row, temperature) if shown else row)
    heads: Row = ("channel", "mode", "samples", "cycles", "from", "to", "", "force from", "to", "")
    heads = (*heads, "temperature") if shown else heads
    return Table(title, heads, tuple(rows), left=2)


def load_case_row(load: LoadCase, recorded: RecordedProgram | None) -> Row:
    """Return a load case as a row: its program, and the range of what it prescribes."""
    if load.six is not None:
        six = load.six
        moved = [MOTIONS[k] for k in range(6) if np.ptp(six.motion[:, k]) > 0.0]
        motions = [f"{', '.join(moved) or 'nothing'} moved"]
        motions += [f"{', '.join(REACTIONS[k] for k in six.loaded)} prescribed"] if six.loaded else []
        free = [MOTIONS[k] for k in six.free if k not in six.loaded]
        motions += [f"{', '.join(free)} free"] if free else []
        return load.label, load.mode, f"{len(load.six.time)} poses: {'; '.join(motions)}", "", "", ""
    units = quantities(load.mode)
    values = np.array(load.path) if recorded is None else recorded.displacement
    unit = units.force_unit if load.by_force else units.displacement_unit or units.displacement
    low, high = (number(end if load.by_force else units.at(end)) for end in (values.min(), values.max()))
    if load.source is not None:
        program = f"{len(values)} points of {load.source.file.name}"
    else:
        segments = len(values) - 1
        program = f"{count_of(segments, 'segment')}, up to {load.steps} steps each"
        if load.rate is not None:
            program += f", {number(load.rate * (1.0 if load.by_force else units.per_internal))} {unit}/s"
    return load.label, load.mode, program, low, high, unit


def protocol_sections(protocol: Protocol) -> list[Section]:
    """Return the sections that describe the tests of a case."""
    remarks = [f"{channel}: {text}" for channel, text in protocol.remarks]
    tests = [observed_line(test) for test in (*protocol.recordings, *protocol.coupons)]
    lacks = [
        f"{gap.question} ({', '.join(gap.channels)}): {gap.why}. To answer it, {gap.remedy}."
        for gap in protocol.lacks
    ]
    return [
        Section("How the files were read", paragraphs([*map(file_line, protocol.files), *remarks])),
        Section("What the tests are", paragraphs(tests)),
        *(
            Section(
                f"{channel} and {name}",
                paragraphs(
                    f"{_MARKS[clause.met]}: {'good practice, ' if clause.practice else ''}{clause.text} "
                    f"(found: {clause.found})"
                    for clause in clauses
                ),
            )
            for channel, name, clauses in protocol.judged
        ),
        Section("What the recordings leave open", paragraphs(lacks)),
    ]


def file_line(recording: Recording | RecordedProgram) -> str:
    """Return which columns of a file were read as what, and in which units."""
    words = []
    coupon = modes()[recording.mode].specimen == "coupon"
    for column in recording.columns:
        quantity = _COUPON.get(column.quantity, column.quantity) if coupon else column.quantity
        name = f" ({column.name[:SHOWN]})" if column.name else ""
        assumed = ", assumed because no unit is given" if column.assumed else ""
        how = " as a" if column.unit in ("strain", "stretch") else " in"
        unit = f"{how} {column.unit}{assumed}" if column.unit else ""
        words.append(f"{quantity} = column {column.number}{name}{unit}")
    if all(column.quantity != "time" for column in recording.columns):
        words.append("no column of time")
    unused = [name[:SHOWN] for name in recording.unused[:_MOST]]
    more = len(recording.unused) - len(unused)
    unused += [f"{more} more"] if more else []
    words += [f"not used: {', '.join(unused)}"] if unused else []
    return f"{recording.name}: {'; '.join(words)}"


def observed_line(test: Observed) -> str:
    """Return cycles, rates, holds and pauses of a test in words."""
    units = quantities(test.mode)
    cycles = len(test.compared)
    words = [count_of(cycles, "cycle")]
    if test.conditioning:
        words[0] += f" after {test.conditioning} for conditioning"
    if not test.timed:
        words.append("no time")
    elif test.rates:
        # Classes of rates that differ by less than is shown are named once.
        rates = dict.fromkeys(number(units.per_internal * rate) for rate in test.rates)
        words.append(f"ramps at {join_names(list(rates))} {units.rate_unit}")
    for durations, kind in ((test.holds, "hold"), (test.rests, "rest")):
        if durations:
            plural = f"{kind}s" if len(durations) > 1 else kind
            words.append(f"{len(durations)} {plural} of up to {number(max(durations))} s")
    if test.pauses:
        plural = "pauses" if len(test.pauses) > 1 else "pause"
        longest = number(max(test.pauses))
        words.append(f"{len(test.pauses)} {plural} of the logger of up to {longest} s, in which it moved")
    words += [] if test.unloads else ["without unloading"]
    words += [] if test.from_rest else ["not from rest"]
    return f"{test.channel}: {', '.join(words)}"
