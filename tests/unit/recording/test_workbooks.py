"""Excel workbooks: names in merged cells, formulas without values, numbers that are shown in percent."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.source import Source

openpyxl = pytest.importorskip("openpyxl")
pytestmark = pytest.mark.usefixtures("in_this_process")


def book(path, rows, merged=(), formats=()):
    made = openpyxl.Workbook()
    sheet = made.active
    for row in rows:
        sheet.append(row)
    for cells in merged:
        sheet.merge_cells(cells)
    for column, form in formats:
        for cell in sheet[column]:
            cell.number_format = form
    made.save(path)
    return path


def numbers(count=20):
    return [[0.1 * i, 0.05 * i, 5.0 * i] for i in range(count)]


def test_a_name_in_cells_merged_over_two_rows_is_that_of_its_column(tmp_path):
    rows = [
        ["Bushing 17", None, None],
        ["Time [s]", "Axial", None],
        [None, "Travel [mm]", "Force [kN]"],
        *numbers(),
    ]
    path = book(tmp_path / "axial.xlsx", rows, merged=("A2:A3", "B2:C2", "A1:C1"))
    found = read_recording(Source("axial", path))
    np.testing.assert_allclose(found.time, 0.1 * np.arange(20))
    assert found.force[-1] == pytest.approx(95e3)


def test_a_needed_formula_without_a_value_is_refused_with_its_cell(tmp_path):
    rows = [
        ["time_s", "displacement_mm", "force_N"],
        *([t, q, f"=100*B{i}"] for i, (t, q, _) in enumerate(numbers())),
    ]
    path = book(tmp_path / "axial.xlsx", rows)
    with pytest.raises(
        RecordingError, match=r"axial.xlsx:2: column 3 .* is a formula without a value.*save it"
    ):
        read_recording(Source("axial", path))


def test_a_formula_beside_the_table_is_ignored(tmp_path):
    rows = [["time_s", "displacement_mm", "force_N", "peak"], *([*row, None] for row in numbers())]
    rows[1][3] = "=MAX(C2:C21)"
    found = read_recording(Source("axial", book(tmp_path / "axial.xlsx", rows)))
    assert found.force[-1] == pytest.approx(95.0)


def test_a_sheet_of_formulas_says_what_to_do(tmp_path):
    path = book(
        tmp_path / "axial.xlsx", [["displacement_mm", "force_N"], *([f"=A{i}", f"=B{i}"] for i in range(9))]
    )
    with pytest.raises(RecordingError, match=r"its formulas have no values .*save it"):
        read_recording(Source("axial", path))


@pytest.mark.parametrize("name", ["Strain", "Strain [%]", "Strain in percent"])
def test_numbers_shown_in_percent_are_percent(tmp_path, name):
    rows = [[name, "Stress [MPa]"], *([0.05 * i, 0.1 * i] for i in range(12))]
    path = book(tmp_path / "uniaxial.xlsx", rows, formats=[("A", "0.00%")])
    assert read_recording(Source("uniaxial", path)).displacement[-1] == pytest.approx(0.55)


def test_a_header_behind_a_percent_sign_without_a_blank_is_one(tmp_path):
    path = tmp_path / "axial.csv"
    lines = [" ".join(f"{one:.3f}" for one in row) for row in numbers()]
    path.write_text("\n".join(["%time_s displacement_mm force_N", *lines]))
    found = read_recording(Source("axial", path))
    assert found.time[-1] == pytest.approx(1.9)


def test_stamps_that_go_back_are_left_out_where_the_case_says_so(tmp_path):
    path = tmp_path / "axial.csv"
    rows = [*numbers(10), *([0.1 * i, 0.5 + 0.05 * i, 50.0 + 5.0 * i] for i in range(10))]
    lines = [",".join(f"{one:.3f}" for one in row) for row in rows]
    path.write_text("\n".join(["time_s,displacement_mm,force_N", *lines]))
    with pytest.raises(RecordingError, match=r'columns = \{time = "none"\}'):
        read_recording(Source("axial", path))
    found = read_recording(Source("axial", path, columns={"time": "none"}))
    assert found.time is None
    assert found.displacement[-1] == pytest.approx(0.95)
    timed = read_recording(Source("axial", path, columns={"time": "none"}, sample_rate=10.0))
    np.testing.assert_allclose(timed.time, 0.1 * np.arange(20))
