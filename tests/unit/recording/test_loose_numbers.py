"""Numbers without a unit in the name of a column: ranges are remarks, what may be a factor is refused."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.header.name import heading
from bushcli.recording.source import Source

ROWS = [(0.05 * i, 5.0 * math.sin(i / 6), 400.0 * math.sin(i / 6)) for i in range(48)]


def rig(folder: Path, header: str, below: str = "", above: str = "", **options: object):
    """Read a file of time, travel up to 5 and force up to 400; names are separated by |, and so are units."""
    lines = [*([above] if above else []), header, *([below] if below else [])]
    lines += ["|".join(f"{value:.6f}" for value in row) for row in ROWS]
    (folder / "rig.csv").write_text("\n".join(lines).replace("|", ";") + "\n", encoding="utf-8")
    return read_recording(Source("axial", folder / "rig.csv", **options))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "name",
    [
        "Displacement ±25", "Displacement +/-25", "Displacement (±25)", "Displacement [±25]", "Weg -25...+25",
        "Travel range ±25", "Weg Messbereich ±25", "Displacement <25", "Weg -25 bis 25", "Displacement 0-10",
        "Displacement ±0.006 [m]",
    ],
)  # fmt: skip
def test_a_range_with_its_sign_is_reported(tmp_path, name):
    found = rig(tmp_path, f"Time [s]|{name}|Force [N]")
    assert found.units == ("m" if "[m]" in name else "mm", "N")
    assert [one.text for one in found.repairs if f"column 2 ({name})" in one.text and "range" in one.text]


@pytest.mark.parametrize(
    "name", ["Force ±25", "Force (±2,5)", "Load cell range ±25", "Kraft -25..25", "Force 0-10"]
)
def test_numbers_beyond_their_range_are_not_in_the_default_unit(tmp_path, name):
    header = f"Time [s]|Displacement [mm]|{name}"
    place = re.escape(f"column 3 ({name})")
    with pytest.raises(RecordingError, match=rf"rig\.csv:\d+: {place}.*beyond the range.*units = \{{force"):
        rig(tmp_path, header)
    assert rig(tmp_path, header, units={"force": "N"}).units == ("mm", "N")
    assert rig(tmp_path, header, below="s|mm|N").units == ("mm", "N")


@pytest.mark.parametrize(
    "name",
    [
        "Force 2.5", "Force 2,5", "Force (2.5)", "Force 100", "Force 10", "Force_10", "Load cell 5000", "Force 1.2",
        "1000 Force", "Force range 10", "Force @100", "Kraft 25000", "Force 10 raw",
    ],
)  # fmt: skip
def test_a_bare_number_that_may_be_a_factor_is_refused_with_its_place(tmp_path, name):
    header = f"Time [s]|Displacement [mm]|{name}"
    place = re.escape(f"rig.csv:1: column 3 ({name})")
    with pytest.raises(RecordingError, match=rf"{place}: .*may be a factor.*units = \{{force"):
        rig(tmp_path, header)
    assert rig(tmp_path, header, units={"force": "kN"}).units == ("mm", "kN")
    if "(" not in name:  # that may be another unit
        assert rig(tmp_path, header, below="s|mm|N").units == ("mm", "N")


@pytest.mark.parametrize(
    "name", ["Force 10kN range", "Force 10 kN range", "Kraft 10kN", "Force ±25kN", "Kraft Messbereich 10kN"]
)
def test_the_unit_of_a_range_is_not_that_of_the_column(tmp_path, name):
    with pytest.raises(RecordingError, match=r"rig\.csv:1: column 3 .*may be the range of the sensor"):
        rig(tmp_path, f"Time [s]|Displacement [mm]|{name}")


@pytest.mark.parametrize("name", ["Weg 10mm", "Weg ±10mm", "Weg Messbereich 10mm"])
def test_a_range_beside_a_row_of_units(tmp_path, name):
    assert rig(tmp_path, f"Zeit|{name}|Kraft 5kN", "s|mm|N").units == ("mm", "N")


@pytest.mark.parametrize(
    "name",
    [
        "Force 2",
        "Force 12",
        "Force Ch 10",
        "Force channel 100",
        "Force Ch. 1.2",
        "Force #1.1",
        "Force 001",
        "Force 1.0",
    ],
)
def test_the_number_of_a_channel_is_none(tmp_path, name):
    assert heading(name).written == ()
    assert rig(tmp_path, f"Time [s]|Displacement [mm]|{name}").columns[1].assumed


@pytest.mark.parametrize(
    ("above", "header", "below", "place"),
    [
        ("", "Time|Displacement|Force", "s|mm|N\ns|in|lbf", ":3: column 2 is in mm by line 2 and in in by line 3"),
        ("", "Time|Displacement|Force", "s|mm|N\n||kN", ":3: column 3 is in N by line 2 and in kN by line 3"),
        ("", "Time|Displacement|Force", "s|mm|N\n# s|mm|kN", ":3: column 3 is in N by line 2 and in kN by line 3"),
        ("", "Time|Displacement|Force", "[s]|[mm]|[klx]\n[s]|[mm]|[N]", ":3: column 3 is in klx by line 2"),
        ("s|in|lbf", "Time|Displacement|Force", "s|mm|N", ":3: column 2 is in in by line 1 and in mm by line 3"),
        ("s|in|lbf\ns|mm|N", "Time|Displacement|Force", "", ":2: column 2 is in in by line 1 and in mm by line 2"),
        ("s|in|lbf", "Time [s]|Weg [mm]|Force [N]", "", r":1: column 2 \(Weg \[mm\]\) is in mm and in in"),
        ("s|in|lbf", "s|mm|N", "", ":2: column 2 is in in by line 1 and in mm by line 2"),
    ],
)  # fmt: skip
def test_rows_of_units_that_contradict_each_other(tmp_path, above, header, below, place):
    with pytest.raises(RecordingError, match=rf"rig\.csv{place}"):
        rig(tmp_path, header, below, above)


@pytest.mark.parametrize("again", ["s|in|kN", "[s]|[in]|[kN]", "Sec|Inch|Kilonewton", "s||kN", "|in|"])
def test_rows_of_units_that_say_the_same(tmp_path, again):
    assert rig(tmp_path, "Time|Displacement|Force", f"s|in|kN\n{again}").units == ("in", "kN")
    assert rig(tmp_path, "Time|Displacement|Force", "s|in|kN", again).units == ("in", "kN")


@pytest.mark.parametrize("above", ["Force unit: lbf", "Units: s, mm, lbf"])
def test_a_unit_above_the_table_that_differs_from_the_header_is_reported(tmp_path, above):
    found = rig(tmp_path, "Time [s]|Displacement [mm]|Force [N]", "", above)
    assert found.units == ("mm", "N")
    (text,) = [one.text for one in found.repairs]
    assert text == "column 3 (Force [N]): line 1 states lbf, the header N, which is used"
    assert not rig(tmp_path, "Time [s]|Displacement [mm]|Force [lbf]", "", above).repairs


def test_a_row_of_units_with_a_label_and_a_row_below_it(tmp_path):
    rows = "\n".join(";".join(["", *(f"{value:.6f}" for value in row)]) for row in ROWS)
    (tmp_path / "rig.csv").write_text(f"Name;Time;Travel;Force\nUnit;s;in;kN\nValue;;;\n{rows}\n")
    assert read_recording(Source("axial", tmp_path / "rig.csv")).units == ("in", "kN")


def test_two_rows_of_names(tmp_path):
    german, english = "Zeit [s]|Weg [mm]|Kraft [kN]", "Time [s]|Displacement [mm]|Force [kN]"
    assert rig(tmp_path, english, above=german).units == ("mm", "kN")
    assert rig(tmp_path, "Time|Displacement|Force", "s|mm|kN", german).units == ("mm", "kN")
    place = r"rig\.csv:1: column 3 is in kN here and in N by the lines below"
    with pytest.raises(RecordingError, match=place):
        rig(tmp_path, english.replace("kN", "N"), above=german)
    with pytest.raises(RecordingError, match=place):
        rig(tmp_path, "Time|Displacement|Force", "s|mm|N", german)


def test_units_above_the_table_in_quotation_marks(tmp_path):
    found = rig(tmp_path, '"Time"|"Extension"|"Force"', above='"Force Units","kN"\n"Extension Units","mm"')
    assert found.units == ("mm", "kN")
    assert not any(one.assumed for one in found.columns[1:2])
