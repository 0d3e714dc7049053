"""Long text files are read in bulk where their lines are alike, and to the same result as line by line."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.source import Source
from bushcli.recording.text import rows

N = 9_000


def lines(delimiter=",", decimal=".", text=False, clock=False):
    time = np.arange(N) * 0.01
    q = 2.0 * np.sin(2.0 * np.pi * time / 30.0)
    noise = np.random.default_rng(3).normal(size=N)
    found = [delimiter.join(["Time [s]", "Weg [mm]", "Kraft [kN]", *(["State"] if text else [])])]
    for i in range(N):
        stamp = f"10:{i // 6000:02d}:{i % 6000 / 100:05.2f}" if clock else f"{time[i]:.2f}"
        fields = [stamp, f"{q[i]:.5f}", f"{0.2 * q[i] + 1e-4 * noise[i]:.6f}", *(["ok run"] if text else [])]
        found.append(delimiter.join(fields).replace(".", decimal))
    return found


def both(path, text, monkeypatch, **kwargs):
    """Return the recording, and that which is read line by line, or the errors; and how many lines were alike."""
    path.write_text(text, encoding="utf-8")
    found, alike = [], []
    read_runs = rows.split_runs

    def watched(*args):
        parts = read_runs(*args)
        alike.append(sum(map(len, parts[1])))
        return parts

    monkeypatch.setattr("bushcli.recording.text_file.split_runs", watched)
    for head in (rows.HEAD, 10**9):
        monkeypatch.setattr(rows, "HEAD", head)
        try:
            found.append(read_recording(Source("axial", path, **kwargs)))
        except RecordingError as error:
            found.append(str(error))
    return (*found, sum(alike))


def assert_equal(bulk, single):
    assert not isinstance(bulk, str), bulk
    for name in ("time", "displacement", "force"):
        np.testing.assert_array_equal(getattr(bulk, name), getattr(single, name))
    assert bulk.columns == single.columns
    assert bulk.repairs == single.repairs
    assert bulk.unused == single.unused


@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"delimiter": ";", "decimal": ","},
        {"delimiter": "\t"},
        {"delimiter": ";", "text": True},
        {"delimiter": ";", "clock": True, "text": True},
        {"delimiter": "   "},
    ],
)
def test_bulk_and_line_by_line_agree(tmp_path, monkeypatch, changed):
    bulk, single, alike = both(tmp_path / "long.csv", "\n".join(lines(**changed)), monkeypatch)
    assert_equal(bulk, single)
    assert len(bulk.force) == N
    assert alike > 0.7 * N


@pytest.mark.parametrize(
    "line",
    [
        "# a remark",
        "",
        "44.995,1.0,0.2 ",
        "44.995;1.0;0.2",
        "44.995,1.0",
        "44.995,#N/A,0.2",
        "44.995,1.0,-9999",
    ],
)
def test_a_line_of_another_kind_far_down_is_treated_as_in_a_short_file(tmp_path, monkeypatch, line):
    text = lines()
    text.insert(4_501, line)
    bulk, single, alike = both(tmp_path / "long.csv", "\n".join(text), monkeypatch)
    assert alike > 0.5 * N
    if isinstance(single, str):
        assert bulk == single
        assert "long.csv:4502" in bulk
    else:
        assert_equal(bulk, single)


def test_repeated_headers_and_text_below_are_left_out_with_the_same_remarks(tmp_path, monkeypatch):
    text = lines()
    text[6_001:6_001] = text[:1]
    bulk, single, alike = both(tmp_path / "long.csv", "\n".join([*text, "End of test"]), monkeypatch)
    assert_equal(bulk, single)
    assert alike > 0.5 * N
    assert any("repeats the header" in one.text for one in bulk.repairs)


def test_columns_in_another_order_far_down_are_put_into_the_first_order(tmp_path, monkeypatch):
    text = lines()
    text[6_001:] = [",".join(np.array(one.split(","))[[2, 0, 1]]) for one in [text[0], *text[6_001:]]]
    bulk, single, _ = both(tmp_path / "long.csv", "\n".join(text), monkeypatch)
    assert_equal(bulk, single)
    assert bulk.force[-1] == pytest.approx(float(text[-1].split(",")[0]) * 1e3)


def test_a_number_without_sense_is_refused_at_its_line(tmp_path, monkeypatch):
    text = lines()
    text[7_000] = "69.99,1e999,0.1"
    bulk, single, _ = both(tmp_path / "long.csv", "\n".join(text), monkeypatch)
    assert bulk == single
    assert "long.csv:7001" in bulk
