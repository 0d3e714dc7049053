"""Missing values, codes for them, separators of thousands: read where they are unambiguous, else refused."""

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.source import Source

HEAD = "time_s;displacement_mm;force_N\n"


def read(tmp_path, rows, head=HEAD, **keys):
    file = tmp_path / "rig.csv"
    file.write_text(head + "\n".join(";".join(map(str, row)) for row in rows) + "\n")
    return read_recording(Source("axial", file, **keys))


def rows(n=12):
    return [[f"{0.1 * i:.2f}", f"{0.25 * i:.2f}", f"{100.5 * i:.2f}"] for i in range(n)]


@pytest.mark.parametrize("text", ["#N/A", "#NV", "#n/a", "#DIV/0!", "#WERT!", "#REF!"])
@pytest.mark.parametrize("column", [0, 1, 2])
def test_a_missing_value_is_refused_wherever_it_stands(tmp_path, text, column):
    """A row that begins with #N/A is not a comment."""
    found = rows()
    found[5][column] = text
    with pytest.raises(
        RecordingError, match=rf"rig\.csv:7: column {column + 1} .*is a missing value \(delete the row"
    ):
        read(tmp_path, found)


def test_comments_are_still_comments(tmp_path):
    found = rows()
    found.insert(4, ["# N/A here: the operator stopped"])
    found.insert(6, ["#0.45", "1.1", "451"])
    assert len(read(tmp_path, found).force) == 12


@pytest.mark.parametrize(
    "code",
    ["-9999", "9999", "-999", "-9999.0", "99999", "-9999.99", "1e30", "-32768", "65535", "3.4028235e38"],
)
@pytest.mark.parametrize("place", [0, 5, 11])
def test_a_code_for_a_missing_value_is_asked_about(tmp_path, code, place):
    found = [[a, b, f"{float(c) / 100:.3f}"] for a, b, c in rows()]
    found[place][2] = code
    with pytest.raises(
        RecordingError, match=rf"rig\.csv:{place + 2}: column 3 .*code for a missing.*accept = \["
    ):
        read(tmp_path, found)
    recording = read(tmp_path, found, accept=(float(code),))
    assert recording.force[place] == float(code)


def test_a_code_within_the_range_of_the_others_jumps(tmp_path):
    """A force of 15 kN goes through -9999 N; a single sample of it in the middle of +15 kN is a code."""
    q = np.sin(np.linspace(0, 4 * np.pi, 200))
    found = [[f"{0.1 * i:.2f}", f"{v:.4f}", f"{15000 * v:.0f}"] for i, v in enumerate(q)]
    found[120][2] = "-9999"  # at 7.6 rad sin is near 1: the neighbours are near +15 kN
    value = 15000 * q[120]
    assert abs(value + 9999) > 15000
    with pytest.raises(RecordingError, match=r"rig\.csv:122: .*-9999 looks like a code"):
        read(tmp_path, found)


@pytest.mark.parametrize(
    "force", [[0, 333, 666, 999, 666], [0, 500, 999, 500, 0], [900, 950, 999, 1040, 1100]]
)
def test_a_measured_999_is_no_code(tmp_path, force):
    found = [[i, 0.1 * i + 0.01, f] for i, f in enumerate(force)]
    np.testing.assert_allclose(read(tmp_path, found).force, force)


@pytest.mark.parametrize("decimal", [",", "."])
def test_numbers_that_may_have_separators_of_thousands_are_refused(tmp_path, decimal):
    found = [[i, i + 1, f"{i + 1}{decimal}{100 + i}"] for i in range(6)]
    with pytest.raises(
        RecordingError, match=r"rig\.csv:2: column 3: 1[.,]100 may be 1\.100 or 1100.*decimal = "
    ):
        read(tmp_path, found)
    read_as = read(tmp_path, found, decimal=decimal)
    np.testing.assert_allclose(read_as.force, [i + 1 + (100 + i) / 1000 for i in range(6)])


@pytest.mark.parametrize("proof", ["0,123", "12,34", "1234,567"])
def test_one_number_that_can_only_be_decimal_is_enough(tmp_path, proof):
    found = [[i, i + 1, f"{i + 1},{100 + i}"] for i in range(6)]
    found[3][2] = proof
    assert read(tmp_path, found).force[0] == 1.1


@pytest.mark.parametrize(("decimal", "by"), [(",", "."), (".", ","), (",", " "), (".", "'"), (",", "\u00a0")])
@pytest.mark.parametrize("columns", [2, 3])
def test_separators_of_thousands_that_can_mean_one_thing_are_left_out(tmp_path, decimal, by, columns):
    force = np.array([0.5, 250.25, -900.75, 1018.0, -12345.5, 1234567.0, 1000.5])
    found = [[f"{0.1 * i:.2f}", f"{0.5 * i:.1f}", f"{f:,.2f}".replace(",", "_")] for i, f in enumerate(force)]
    found[3][2] = "1_018"  # one thousand, although it has no decimals, because the others are thousands
    found = [[text.replace(".", decimal).replace("_", by) for text in row][3 - columns :] for row in found]
    head = ";".join(HEAD.strip().split(";")[3 - columns :]) + "\n"
    recording = read(tmp_path, found, head)
    np.testing.assert_allclose(recording.force, force)
    [said] = [repair.text for repair in recording.repairs if repair.kind == "columns"]
    assert (
        f"column {columns}: thousands separators are removed from 4 numbers: 1{by}018 is read as 1018" in said
    )


def test_groups_of_other_than_three_digits_are_refused(tmp_path):
    found = [[text.replace(".", ",") for text in row] for row in rows()]
    found[4][2] = "1.23.456,5"
    with pytest.raises(RecordingError, match=r'rig\.csv:6: column 3 .*"1\.23\.456,5" is not a number'):
        read(tmp_path, found)


def test_mixed_separators_are_refused(tmp_path):
    found = [[f"0.{i}", f"{i}.5", f"1,{100 + i}"] for i in range(6)]
    with pytest.raises(RecordingError, match=r'"1,100" is not a number'):
        read(tmp_path, found)


def test_a_row_before_a_broken_one_is_not_dropped(tmp_path):
    found = rows()
    found[1] = ["0.1", "broken"]
    with pytest.raises(RecordingError, match=r"rig\.csv:[23]: "):
        read(tmp_path, found)
    with pytest.raises(RecordingError, match=r"rig\.csv:[12]: "):
        read(tmp_path, found, head="", columns={"time": 1, "displacement": 2, "force": 3})
