"""Sampling rates above a table without a time: reported with the value to give, and not used without it."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from bushcli.case.from_files import case_from_files
from bushcli.cli import main
from bushcli.errors import RecordingError
from bushcli.recording.read import read_recording
from bushcli.recording.source import Source

ROWS = "\n".join(f"{0.1 * i:.1f};{10 * i}" for i in range(8))
TABLE = f"Displacement [mm];Force [N]\n{ROWS}\n"


def remarks(path, above, table=TABLE, **known):
    path.write_text(f"{above}\n{table}", encoding="utf-8")
    recording = read_recording(Source("axial", path, **known))
    return recording, [one.text for one in recording.repairs if "sampling" in one.text]


@pytest.mark.parametrize(
    ("above", "hertz"),
    [
        ("Sample rate: 100 Hz", "100"),
        ("# sampling frequency = 0.5 kHz", "500"),
        ("Sampling Rate [Hz];50", "50"),
        ("Abtastrate;1;kHz", "1000"),
        ("dt = 0.01 s", "100"),
        ("Sample interval (ms): 20", "50"),
        ("Abtastintervall: 0,02 s", "50"),
        ("Data rate 200 samples/s", "200"),
        ("Acquisition rate: 128 samples per second", "128"),
        ("fréquence d'échantillonnage : 25 Hz", "25"),
        ("Specimen 7\nScan rate: 10 Hz\nOperator: N. N.", "10"),
        ("Sample rate: 100 Hz\nSample interval: 0.01 s", "100"),
    ],
)
def test_a_rate_is_reported_with_its_line_and_what_to_give(tmp_path, above, hertz):
    recording, said = remarks(tmp_path / "a.csv", above)
    assert recording.time is None
    assert len(said) == 1
    assert f"give sample_rate = {hertz} if" in said[0]
    line = above.splitlines()[1 if "Specimen" in above else 0].removeprefix("# ")
    assert line in said[0]


@pytest.mark.parametrize(
    "above",
    [
        "Sample: 12",
        "Rate: 100 mm/min",
        "Test speed 10 mm/s",
        "Sample rate: 100",
        "Sample rate: 0 Hz",
        "Sample rate: high",
        "dt = 0.01 mm",
        "Data rating: 5 Hz",
        "Refs: 12 s",
    ],
)
def test_what_is_no_rate_of_samples_is_not_reported(tmp_path, above):
    assert remarks(tmp_path / "a.csv", above)[1] == []


def test_contradictory_rates_are_reported_and_none_proposed(tmp_path):
    _, said = remarks(tmp_path / "a.csv", "Sample rate: 100 Hz\nSampling interval: 0.5 s")
    assert said == [
        "sampling rates that contradict are stated above the table, and not used"
        ' (line 1 "Sample rate: 100 Hz", line 2 "Sampling interval: 0.5 s")'
    ]


def test_where_the_time_is_known_it_is_not_reported(tmp_path):
    timed = "Time [s];Displacement [mm];Force [N]\n" + "\n".join(f"{i};{0.1 * i:.1f};{i}" for i in range(8))
    assert remarks(tmp_path / "a.csv", "Sample rate: 100 Hz", timed)[1] == []
    recording, said = remarks(tmp_path / "b.csv", "Sample rate: 100 Hz", sample_rate=100.0)
    assert recording.time[1] == 0.01
    assert said == []


def test_a_new_case_shows_the_stated_rate_and_no_other(tmp_path):
    remarks(tmp_path / "a.csv", "Sample rate: 40 Hz")
    text = case_from_files([tmp_path / "a.csv"], tmp_path)
    assert "give sample_rate = 40 if" in text
    assert text.count("sample_rate") == 1


@pytest.mark.parametrize(
    "text",
    [
        TABLE.replace(";", "|"),
        TABLE.replace(";", " | "),
        # A table in Markdown.
        "| Displacement [mm] | Force [N] |\n|---|---|\n"
        + "\n".join(f"| {row.replace(';', ' | ')} |" for row in ROWS.splitlines()),
    ],
)
def test_columns_may_be_separated_by_vertical_bars(tmp_path, text):
    file = tmp_path / "a.txt"
    file.write_text(text, encoding="utf-8")
    recording = read_recording(Source("axial", file))
    assert recording.force.tolist() == [10.0 * i for i in range(8)]
    assert recording.units == ("mm", "N")
    with pytest.raises(RecordingError, match="for this delimiter"):
        read_recording(Source("axial", file, delimiter=";"))


CASE = """
[geometry]
shape = "plain"
inner_radius = 10.0
outer_radius = 20.0
length = 30.0

[material]
law = "yeoh"
parameters = { C10 = 0.5, C20 = -0.05, C30 = 0.03 }

[[load_cases]]
mode = "axial"
file = "drive.csv"
"""


def test_check_says_how_the_program_of_a_load_case_was_read(tmp_path):
    (tmp_path / "case.toml").write_text(CASE)
    text = "Sample rate: 10 Hz\nDisplacement [cm];Temperature [C]\n0;20\n0.1;20\n0.2;21\n"
    (tmp_path / "drive.csv").write_text(text)
    done = CliRunner().invoke(main, ["check", str(tmp_path / "case.toml"), "--json", "-q"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.output)
    (read,) = found["sources"]
    assert (read["channel"], read["unused"]) == ("axial", ["Temperature [C]"])
    assert [(one["quantity"], one["unit"]) for one in read["columns"]] == [("displacement", "cm")]
    (said,) = found["remarks"]
    assert said["channel"] == "axial"
    assert "give sample_rate = 10 if" in said["text"]
    shown = CliRunner().invoke(main, ["check", str(tmp_path / "case.toml")])
    assert "How the files were read" in shown.output
