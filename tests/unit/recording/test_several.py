"""Many recordings one below the other in one table: one is chosen by its label, and no two are read as one."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.source import Source
from bushcli.recording.table_cache import TableCache

STRETCH = np.linspace(1.0, 2.0, 11)


def long_form(path, names=("S1", "S2"), time=False):
    """Write a table in which the second specimen is twice as stiff as the first."""
    head = ["Specimen ID", "rate", "stretch", "stress [MPa]", *(["time [s]"] if time else [])]
    rows = [
        [
            name,
            f"0,{k}",
            f"{x:.3f}".replace(".", ","),
            f"{k * (x - 1):.4f}".replace(".", ","),
            *([f"{i}"] if time else []),
        ]
        for k, name in enumerate(names, start=1)
        for i, x in enumerate(STRETCH)
    ]
    path.write_text("\n".join(";".join(row) for row in [head, *rows]), encoding="utf-8")
    return path


@pytest.mark.parametrize("time", [False, True])
def test_two_specimens_are_never_read_as_one(tmp_path, time):
    file = long_form(tmp_path / "long.csv", time=time)
    with pytest.raises(
        RecordingError, match=r'2 recordings one below the other .*rows = {"Specimen ID" = "S1"}'
    ):
        read_recording(Source("uniaxial", file))


@pytest.mark.parametrize("rows", [{"Specimen ID": "S2"}, {"rate": 0.2}, {"1": "S2", "rate": "0,2"}])
@pytest.mark.parametrize("time", [False, True])
def test_one_of_them_is_chosen(tmp_path, rows, time):
    file = long_form(tmp_path / "long.csv", time=time)
    found = read_recording(Source("uniaxial", file, rows=rows))
    np.testing.assert_allclose(found.force, 2.0 * (STRETCH - 1.0), atol=1e-12)


def test_a_label_that_no_row_has_is_refused_with_those_that_there_are(tmp_path):
    file = long_form(tmp_path / "long.csv")
    with pytest.raises(RecordingError, match=r"has no row with S3 .it has S1, S2"):
        read_recording(Source("uniaxial", file, rows={"Specimen ID": "S3"}))


def test_a_run_that_goes_on_in_time_is_one_recording(tmp_path):
    rows = [f"{1 + i // 20},{i},{np.sin(0.3 * i):.4f},{10 * np.sin(0.3 * i):.4f}" for i in range(60)]
    file = tmp_path / "run.csv"
    file.write_text("\n".join(["run,time_s,displacement_mm,force_N", *rows]), encoding="utf-8")
    assert len(read_recording(Source("axial", file)).force) == 60


def test_a_text_is_read_once_for_its_channels(tmp_path, monkeypatch):
    file = long_form(tmp_path / "long.csv", names=("S1", "S2", "S3"))
    tables, read = TableCache(), []
    monkeypatch.setattr(
        "bushcli.recording.text_file.read_text", lambda path: read.append(path) or path.read_text("utf-8")
    )
    for name in ("S1", "S2", "S3"):
        read_recording(Source("uniaxial", file, rows={"1": name}), tables)
    assert len(read) == 1
    file.write_text(file.read_text("utf-8") + "\n", encoding="utf-8")
    read_recording(Source("uniaxial", file, rows={"1": "S1"}), tables)
    assert len(read) == 2
