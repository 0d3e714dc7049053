"""The protocol of a case's tests -> sections: cycles, rates and holds, standards, open questions."""

from __future__ import annotations

from bushcli.recording import RecordedProgram, Recording
from bushcli.recording.text.table import SHOWN
from bushcli.report.document import Section, paragraphs
from bushcli.report.quantity import listed, number, quantities
from bushcli.standards import Observed
from bushcli.standards.protocol import Protocol
from cases.mode import modes

#: What a coupon's columns are called.
_COUPON = {"displacement": "strain", "force": "stress"}
#: Most unused columns that are listed.
_MOST = 8
_MARKS = {True: "yes", False: "no", None: "not known"}


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
    unit = f"{shown.displacement_unit}/s" if shown.displacement_unit else "1/s"
    cycles = len(one.compared)
    words = [f"{cycles} cycle{'s' if cycles != 1 else ''}"]
    if one.conditioning:
        words[0] += f" after {one.conditioning} for conditioning"
    if not one.timed:
        words.append("no time")
    elif one.rates:
        # Classes of rates that differ by less than is shown are named once.
        rates = dict.fromkeys(number(shown.per_internal * rate) for rate in one.rates)
        words.append(f"ramps at {listed(list(rates))} {unit}")
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
