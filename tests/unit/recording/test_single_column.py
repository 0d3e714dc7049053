"""A program of a load case in a single column: displacements without a time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import openpyxl
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.read import read_program
from bushcli.recording.source import Source


def program(folder: Path, text: str, mode: str = "axial", **options: object) -> list[float]:
    (folder / "drive.csv").write_text(text, encoding="utf-8")
    read = read_program(Source(mode, folder / "drive.csv", **options))  # type: ignore[arg-type]
    assert read.time is None
    return list(np.round(read.displacement, 9))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("displacement_mm\n0\n1.5\n-2\n", [0.0, 1.5, -2.0]),
        ("displacement_mm\n0,0\n1,5\n-2,0\n", [0.0, 1.5, -2.0]),
        ("Weg\nmm\n0\n1\n2\n", [0.0, 1.0, 2.0]),
        ("drive 7\n\nTravel [in]\n0\n1\n2\n", [0.0, 25.4, 50.8]),
        ("displacement_mm;\n0;\n1;\n2;\n", [0.0, 1.0, 2.0]),
        ("Displacement [cm]\n# a comment\n0\n\n1\n2\n", [0.0, 10.0, 20.0]),
    ],
)
def test_a_single_column_is_a_program(tmp_path, text, found):
    assert program(tmp_path, text) == found


def test_a_single_column_of_rotations(tmp_path):
    assert program(tmp_path, "Winkel [Grad]\n0\n90\n", "torsional") == [0.0, round(np.pi / 2, 9)]


def test_a_single_column_of_a_sheet(tmp_path):
    book = openpyxl.Workbook()
    for value in ("displacement_mm", 0, 1.5, 3):
        book.active.append([value])
    book.create_sheet("info").append(["Operator", "Smith"])
    book.save(tmp_path / "drive.xlsx")
    read = read_program(Source("axial", tmp_path / "drive.xlsx"))
    assert list(read.displacement) == [0.0, 1.5, 3.0]


def test_two_columns_remain_two(tmp_path):
    (tmp_path / "drive.csv").write_text("time_s,displacement_mm\n0,0\n1,2\n2,5\n")
    read = read_program(Source("axial", tmp_path / "drive.csv"))
    assert read.time is not None
    assert (list(read.time), list(read.displacement)) == ([0.0, 1.0, 2.0], [0.0, 2.0, 5.0])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0\n1\n2\n", r"columns = \{displacement = ...\}"),
        ("time_s\n0\n1\n2\n", "no column displacement_mm.*there are time_s"),
        ("displacement_mm\n", r"no column of numbers.*e\.g\. displacement_mm, or time_s,displacement_mm"),
        ("displacement_mm\n0\n1\nx\n2\n3\n", r'drive\.csv:4: column 1 .*: "x" is not a number'),
        ("displacement_mm\n0\n1\n2 3\n2\n", r"drive\.csv:4: "),
        ("displacement_mm\n1,234\n2,345\n", r"drive\.csv:2: column 1: 1,234 may be 1.234 or 1234"),
        ("0,5\n1,5\n2,5\n", "the table has no header"),
    ],
)
def test_what_is_not_clear_is_refused(tmp_path, text, said):
    with pytest.raises(RecordingError, match=said):
        program(tmp_path, text)


def test_a_column_without_a_name_is_read_where_the_case_says_what_it_is(tmp_path):
    assert program(tmp_path, "0\n1\n2\n", columns={"displacement": 1}, units={"displacement": "cm"}) == [
        0.0,
        10.0,
        20.0,
    ]


def test_a_recording_needs_two_columns(tmp_path):
    (tmp_path / "run.csv").write_text("force_N\n" + "\n".join(map(str, range(9))) + "\n")
    with pytest.raises(RecordingError, match="no table with two columns"):
        read_recording(Source("axial", tmp_path / "run.csv"))
