"""The protocol of a case's tests as text and as JSON: cycles, rates and holds, standards, open questions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.padding import Padding
from rich.text import Text

from bushcli.recording import RecordedProgram, Recording
from bushcli.recording.text.table import SHOWN
from bushcli.report.quantity import listed, number, quantities
from bushcli.standards import Clause, Lack, Observed
from bushcli.standards.protocol import Protocol
from cases.mode import modes

#: What a coupon's columns are called.
_COUPON = {"displacement": "strain", "force": "stress"}
#: Most unused columns that are listed.
_MOST = 8
_MARKS = {True: "yes", False: "no", None: "not known"}


def protocol_json(found: Protocol) -> dict[str, Any]:
    """Return the protocol as JSON-ready data: the keys that `bushcli check` adds to its result."""
    return {
        "protocol": [_observed(one) for one in (*found.recordings, *found.coupons)],
        "standards": [
            {"channel": channel, "standard": name, "clauses": [vars(clause) for clause in asked]}
            for channel, name, asked in found.judged
        ],
        "open_questions": [vars(lack) | {"channels": list(lack.channels)} for lack in found.lacks],
        "sources": [
            {
                "channel": one.name,
                "columns": [vars(column) for column in one.columns],
                "unused": list(one.unused),
            }
            for one in found.files
        ],
        "remarks": [{"channel": channel, "text": text} for channel, text in found.remarks],
    }


def _observed(one: Observed) -> dict[str, Any]:
    shown = quantities(one.mode)
    return {
        "channel": one.channel,
        "cycles": len(one.compared),
        "conditioning": one.conditioning,
        "amplitudes": [shown.per_internal * value for value in one.compared],
        "conditioning_amplitudes": [
            shown.per_internal * value for value in one.amplitudes[: one.conditioning]
        ],
        "rates": [shown.per_internal * rate for rate in one.rates],
        "holds_s": list(one.holds),
        "rests_s": list(one.rests),
        "pauses_s": list(one.pauses),
        "timed": one.timed,
        "from_rest": one.from_rest,
        "unloads": one.unloads,
    }


def protocol_parts(found: Protocol) -> list[object]:
    """Return the parts of the summary of a case that describe its tests."""
    parts: list[object] = []
    if found.files or found.remarks:
        said = [f"{channel}: {text}" for channel, text in found.remarks]
        parts += _titled("How the files were read", [*map(_file, found.files), *said])
    if found.recordings or found.coupons:
        parts += _titled("What the tests are", [_line(one) for one in (*found.recordings, *found.coupons)])
    for channel, name, asked in found.judged:
        parts += _titled(f"{channel} and {name}", [_clause(clause) for clause in asked])
    if found.lacks:
        parts += _titled("What the recordings leave open", [_lack(lack) for lack in found.lacks])
    return parts


def _titled(title: str, lines: Sequence[str]) -> list[object]:
    return [Text(), Text(title, "bold"), *(Padding(Text(line), (0, 0, 0, 2)) for line in lines)]


def _file(one: Recording | RecordedProgram) -> str:
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


def _line(one: Observed) -> str:
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


def _clause(clause: Clause) -> str:
    asked = "good practice, " if clause.practice else ""
    return f"{_MARKS[clause.met]}: {asked}{clause.text} (found: {clause.found})"


def _lack(lack: Lack) -> str:
    return f"{lack.question} ({', '.join(lack.channels)}): {lack.why}. To answer it, {lack.remedy}."
