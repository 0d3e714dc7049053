"""Binary files are read once by those who share a cache of tables, and anew by everyone else."""

from __future__ import annotations

import os

import numpy as np
import pytest

from bushcli.case import load_case
from bushcli.diagnosis.question import question
from bushcli.inverse.task import Task
from bushcli.recording import isolated, read_recording, table_cache
from bushcli.recording.table_cache import TableCache
from bushcli.selection.model import Model
from bushcli.selection.model_cache import ModelCache
from bushcli.simulate.recording_cache import RecordingCache

pytestmark = pytest.mark.usefixtures("in_this_process")

CASE = """
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0
[material]
law = "neo_hookean"
[[recordings]]
mode = "axial"
file = "axial.tdms"
[[recordings]]
mode = "axial"
name = "again"
file = "again.tdms"
"""


def write(path, stiffness, count=41):
    nptdms = pytest.importorskip("nptdms")
    q = np.linspace(0.0, 2.0, count)
    columns = {"displacement": (q, "mm"), "force": (stiffness * q, "N")}
    with nptdms.TdmsWriter(path) as file:
        file.write_segment(
            [
                nptdms.ChannelObject("Run", name, values, properties={"unit_string": unit})
                for name, (values, unit) in columns.items()
            ]
        )


@pytest.fixture
def case(tmp_path):
    """Return a case with two files."""
    (tmp_path / "case.toml").write_text(CASE)
    write(tmp_path / "axial.tdms", 150.0)
    write(tmp_path / "again.tdms", 160.0)
    return load_case(tmp_path / "case.toml")


@pytest.fixture
def reads(in_this_process, monkeypatch):
    """Return a list that receives the name of each file that is read."""
    names, asked = [], isolated.child_output

    def counted(path, *others):
        names.append(path.name)
        return asked(path, *others)

    monkeypatch.setattr(isolated, "child_output", counted)
    return names


def test_channels_of_several_files_read_each_of_them_once(case, reads):
    tables = TableCache()
    for _ in range(2):
        found = [read_recording(source, tables) for source in case.recordings]
    assert [one.force[-1] for one in found] == pytest.approx([300.0, 320.0])
    assert reads == ["axial.tdms", "again.tdms"]
    # Nothing is left in the module.
    read_recording(case.recordings[0])
    assert reads == ["axial.tdms", "again.tdms", "axial.tdms"]


def test_a_diagnosis_and_a_prediction_read_each_file_once(case, reads):
    cache = ModelCache()
    question(case, None, (), (), cache.tables)
    for law in ("neo_hookean", "yeoh"):
        start = {"C10": 0.4} if law == "neo_hookean" else {"C10": 0.4, "C20": 0.0, "C30": 0.0}
        cache.channels(Model(law, start).task(case))
    Task(case, "neo_hookean").problem(tables=cache.tables)
    RecordingCache(cache.tables)(case)
    assert reads == ["axial.tdms", "again.tdms"]


def test_a_case_with_six_motions_is_loaded_and_read_with_one_reading(tmp_path, reads):
    nptdms = pytest.importorskip("nptdms")
    time = np.linspace(0.0, 4.0, 41)
    columns = {"time_s": time, "uz_mm": np.sin(time), "fz_N": 350.0 * np.sin(time)}
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as file:
        file.write_segment(
            [
                nptdms.ChannelObject(
                    "Run", name.partition("_")[0], values, properties={"unit_string": name.partition("_")[2]}
                )
                for name, values in columns.items()
            ]
        )
    text = CASE.partition("[[recordings]]")[0] + '[[recordings]]\nmode = "path"\nfile = "run.tdms"\n'
    (tmp_path / "case.toml").write_text(text)
    tables = TableCache()
    case = load_case(tmp_path / "case.toml", (), tables)
    (recording,) = (read_recording(source, tables=tables) for source in case.recordings)
    assert recording.six is not None
    assert reads == ["run.tdms"]


def test_a_changed_file_is_read_again(case, reads):
    tables, source = TableCache(), case.recordings[0]
    first = read_recording(source, tables=tables)
    write(source.file, 155.0)
    os.utime(source.file, ns=(1, 1))
    assert read_recording(source, tables=tables).force[-1] > first.force[-1]
    assert len(reads) == 2


def test_the_numbers_in_memory_are_bounded(case, reads, monkeypatch):
    # One file of 41 samples of two columns, and not two.
    monkeypatch.setattr(table_cache, "MOST_NUMBERS", 100)
    tables = TableCache()
    for number in (0, 0, 1, 1, 0):
        read_recording(case.recordings[number], tables=tables)
    assert reads == ["axial.tdms", "again.tdms", "axial.tdms"]
    # A file with more numbers is not kept.
    monkeypatch.setattr(table_cache, "MOST_NUMBERS", 10)
    tables = TableCache()
    for _ in range(2):
        read_recording(case.recordings[0], tables=tables)
    assert len(reads) == 5
