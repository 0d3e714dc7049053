"""LabVIEW measurement files, made after NI's specification: no file from a machine was at hand."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from bushcli.errors import RecordingError
from bushcli.recording import Recording, read_recording
from bushcli.recording.source import Source

N = 120
TIME = 0.5 * np.arange(N)
TRAVEL = 3.0 * np.sin(0.3 * TIME)
FORCE = 300.0 * TRAVEL
END = "***End_of_Header***"


def lvm(columns="One", decimal=".", separator="\t", segments=1, clock=True, begin=0.0, units=("mm", "kN")):
    """Return a file of two channels, in segments of equal length; `columns` is X_Columns.

    With a clock the x values of each segment count from its own date and time, as LabVIEW writes them.
    """
    name = {"\t": "Tab", ",": "Comma"}[separator]
    lines = [
        "LabVIEW Measurement", "Writer_Version\t2", f"Separator\t{name}", f"Decimal_Separator\t{decimal}",
        f"X_Columns\t{columns}", "Operator\tA. Smith", "Time\t10:15:03.5", END, "",
        "***Start_Special***", "Channels\tnot these", "***End_Special***",
    ]  # fmt: skip
    for rows in np.array_split(np.arange(N), segments):
        first = TIME[rows[0]]
        start = begin if clock else first + begin
        stamp = f"10:{int(15 + first // 60):02d}:{first % 60:04.1f}"
        lines += [
            "Channels\t2", f"Samples\t{len(rows)}\t{len(rows)}", "Date\t2026/03/01\t2026/03/01",
            f"Time\t{stamp}\t{stamp}" if clock else "", f"Y_Unit_Label\t{units[0]}\t{units[1]}",
            "X_Dimension\tTime\tTime", f"X0\t{start:.4E}\t{start:.4E}", "Delta_X\t5.0E-1\t5.0E-1", END,
            "X_Value\tDisplacement\tX_Value\tForce\tComment" if columns == "Multi"
            else "X_Value\tDisplacement\tForce\tComment",
        ]  # fmt: skip
        for i in rows:
            x = f"{TIME[i] - first + start:.6f}"
            values = f"{TRAVEL[i]:.9f}", f"{FORCE[i] / 1000:.12f}"
            fields = {
                "One": (x, *values), "No": ("", *values), "Multi": (x, values[0], x, values[1])
            }[columns]  # fmt: skip
            lines.append("\t".join(fields) + ("\tstarted" if i == 0 else ""))
        lines.append("")
    head, body = lines[:8], lines[8:]
    text = "\n".join([*head, *body])
    if decimal == ",":
        text = "\n".join(
            line.replace(".", ",") if line[:1] in "-0123456789XD\t" else line for line in text.split("\n")
        )
    return text.replace("\t", separator)


def read(folder: Path, text: str, **keys: object) -> Recording:
    file = folder / "run.lvm"
    file.write_text(text)
    return read_recording(Source("axial", file, **keys))  # type: ignore[arg-type]


@pytest.mark.parametrize("columns", ["One", "No", "Multi"])
@pytest.mark.parametrize(("decimal", "separator"), [(".", "\t"), (",", "\t"), (".", ",")])
@pytest.mark.parametrize(("segments", "clock"), [(1, True), (4, True), (4, False)])
def test_every_form_gives_the_same_numbers(tmp_path, columns, decimal, separator, segments, clock):
    found = read(tmp_path, lvm(columns, decimal, separator, segments, clock))
    np.testing.assert_allclose(found.time - found.time[0], TIME, atol=1e-6)
    np.testing.assert_allclose(found.displacement, TRAVEL, atol=1e-8)
    np.testing.assert_allclose(found.force, FORCE, atol=1e-8)
    assert found.units == ("mm", "kN")


def test_segments_without_a_common_clock_are_groups(tmp_path):
    text = "\n".join(line for line in lvm(segments=2).split("\n") if not line.startswith("Date"))
    with pytest.raises(RecordingError, match=r'2 sheets or groups have columns .*"segment 1", "segment 2"'):
        read(tmp_path, text)
    assert len(read(tmp_path, text, group=2).force) == N // 2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("X_Columns\tOne", "X_Columns\tSome", "X_Columns = some"),
        ("Channels\t2", "Channels\tmany", "Channels: 'many' is not a number"),
        ("Channels\t2", "Channels", "Channels: a number is missing"),
        ("Channels\t2", f"Channels\t{'9' * 400}", "Channels: inf are too many"),
        ("Channels\t2", "Channels\t7", "there are no names and values of 7 channels"),
        (f"{FORCE[7] / 1000:.12f}", "bad", r"line \d+: 'bad' is not a number"),
        (END, "", "End_of_Header"),
        ("\tmm\t", "\tV\t", "V"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path, old, new, message):
    with pytest.raises(RecordingError, match=message):
        read(tmp_path, lvm().replace(old, new))


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    at=st.integers(0, 4000),
    what=st.sampled_from(["", "\t", "\n", "x", "9" * 400, END]),
    cut=st.integers(0, 8000),
)
@example(at=205, what="\n", cut=0)  # the line "Channels" without a number
@example(at=361, what="9" * 400, cut=0)  # an increment that is infinite
def test_a_damaged_file_is_read_or_refused(tmp_path, at, what, cut):
    text = lvm(segments=2)
    text = (text[:at] + what + text[at + 1 :])[: max(len(text) - cut, 1)]
    with contextlib.suppress(RecordingError):
        read(tmp_path, text)
