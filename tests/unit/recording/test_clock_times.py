"""Times of day and dates in text files."""

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.source import Source
from bushcli.recording.text.clock_times import clock_times


@pytest.mark.parametrize(
    ("texts", "seconds"),
    [
        (["10:15:03.25", "10:15:04", "10:16:04,5"], [0, 0.75, 61.25]),
        (["2026-03-01T10:15:03", "2026-03-01 10:15:03.1"], [0, 0.1]),
        (["2026-03-01T10:15:03+01:00", "2026-03-01T10:15:05+01:00"], [0, 2]),
        (["23:59:59", "0:00:01"], [0, 2]),
        (["28.02.2026 23:59:59", "01.03.2026 00:00:00"], [0, 1]),
        (["12:59:59 PM", "1:00:00 pm"], [0, 1]),
        (["11:59:59 AM", "12:00:00 PM"], [0, 1]),
        # The order of day and month does not matter where the date stays.
        (["03/04/2026 10:00:00", "03/04/2026 10:00:02"], [0, 2]),
        # Minutes and seconds, because of the fraction; after an hour two digits begin again.
        (["00:59.5", "01:00.0", "01:00.5"], [0, 0.5, 1.0]),
        (["59:59.5", "00:00.5"], [0, 1]),
        (["119:59,5", "120:00,5"], [0, 1]),
        # A running time may exceed a day.
        (["23:59:59", "24:00:00"], [0, 1]),
    ],
)
def test_stamps_become_seconds_since_the_first(texts, seconds):
    assert clock_times(texts).seconds == pytest.approx(np.array(seconds, float))


@pytest.mark.parametrize(
    "texts",
    [
        [],
        ["10:15", "10:16"],
        ["10:15:03", "3.5"],
        ["10:61:03"],
        ["03/04/2026 23:59:59", "04/04/2026 00:00:00"],
    ],
)
def test_what_is_not_certain_is_no_time(texts):
    assert clock_times(texts) is None


@pytest.mark.parametrize("heading", ["Time", "Timestamp", "Zeit [hh:mm:ss]"])
def test_a_recording_with_times_of_day_has_time(tmp_path, heading):
    rows = [f"2026-01-01 10:00:{0.1 * i:04.1f},{0.01 * i:.3f},{4.0 * i:.1f}" for i in range(200)]
    file = tmp_path / "a.csv"
    file.write_text("\n".join([f"{heading},Displacement [mm],Force [N]", *rows]))
    found = read_recording(Source("axial", file))
    assert found.time == pytest.approx(0.1 * np.arange(200))


@pytest.mark.parametrize(
    ("form", "unit"),
    [("Time [mm:ss]", 1.0), ("Time (m:ss)", 1.0), ("min:sec", 1.0), ("hh:mm", 60.0), ("Zeit [h:min]", 60.0)],
)
def test_the_form_says_which_two_numbers_a_stamp_has(form, unit):
    assert clock_times(["09:58", "09:59", "10:00"], form).seconds == pytest.approx(unit * np.arange(3.0))


def test_a_form_with_three_numbers_says_nothing_about_two():
    assert clock_times(["09:58", "09:59"], "Time [hh:mm:ss]") is None


def short_stamps(folder, heading):
    rows = [f"{i // 60:02d}:{i % 60:02d},{0.01 * i:.3f},{4.0 * i:.1f}" for i in range(200)]
    (folder / "a.csv").write_text("\n".join([f"{heading},Displacement [mm],Force [N]", *rows]))
    return folder / "a.csv"


def test_two_numbers_are_refused_unless_the_header_or_the_case_says_which(tmp_path):
    with pytest.raises(RecordingError, match=r'00:00 may be minutes and seconds.*units = \{time = "mm:ss"\}'):
        read_recording(Source("axial", short_stamps(tmp_path, "Time")))
    found = read_recording(Source("axial", short_stamps(tmp_path, "Time [mm:ss]")))
    assert found.time == pytest.approx(np.arange(200.0))
    found = read_recording(Source("axial", short_stamps(tmp_path, "Time"), units={"time": "hh:mm"}))
    assert found.time == pytest.approx(60.0 * np.arange(200.0))
