"""Files that may be written into a folder of results, and files that are not touched."""

import json
from pathlib import Path

import pytest

from bushcli.errors import InputError
from bushcli.report.folder import check_folder, owned, refuse_others, write_files
from bushcli.report.occupied import occupy
from bushcli.runtime.claims import claim
from bushcli.runtime.names import file_names

RESULT = {"command": "direct", "versions": {}}


def text(content):
    return lambda path: path.write_text(content)


def test_the_result_lists_what_was_written(tmp_path):
    write_files(tmp_path / "out", {"result.json": RESULT, "a.csv": text("1")}, ())
    assert json.loads((tmp_path / "out" / "result.json").read_text())["files"] == ["a.csv", "result.json"]
    assert owned(tmp_path / "out") == {"a.csv", "result.json"}


def test_results_of_several_commands_share_a_folder(tmp_path):
    for name in ("a.csv", "b.csv", "a.csv"):
        write_files(tmp_path, {"result.json": RESULT, name: text(name)}, ())
    assert owned(tmp_path) == {"a.csv", "b.csv", "result.json"}


def test_a_file_that_the_result_does_not_list_is_not_replaced(tmp_path):
    write_files(tmp_path, {"result.json": RESULT}, ())
    (tmp_path / "a.csv").write_text("mine")
    with pytest.raises(InputError, match=r"a\.csv: exists already.*does not list it"):
        write_files(tmp_path, {"result.json": RESULT, "a.csv": text("1")}, ())
    assert (tmp_path / "a.csv").read_text() == "mine"


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"files": ["a.csv"]}', "\x00", "[" * 100_000])
def test_a_result_that_is_not_bushclis_is_not_replaced(tmp_path, content):
    (tmp_path / "result.json").write_text(content)
    with pytest.raises(
        InputError, match=r"result\.json: exists already and was not written by an earlier run"
    ):
        write_files(tmp_path, {"result.json": RESULT}, ())
    assert (tmp_path / "result.json").read_text() == content


def test_a_result_of_an_earlier_version_is_replaced_with_its_files(tmp_path):
    (tmp_path / "result.json").write_text(json.dumps(RESULT))
    (tmp_path / "a.csv").write_text("old")
    write_files(tmp_path, {"result.json": RESULT, "a.csv": text("new")}, ())
    assert (tmp_path / "a.csv").read_text() == "new"


@pytest.mark.parametrize("there", [True, False])
def test_a_symbolic_link_is_neither_followed_nor_replaced(tmp_path, there):
    other = tmp_path / "other.txt"
    if there:
        other.write_text("mine")
    write_files(tmp_path / "out", {"result.json": RESULT, "a.csv": text("1")}, ())
    (tmp_path / "out" / "a.csv").unlink()
    (tmp_path / "out" / "a.csv").symlink_to(other)
    with pytest.raises(InputError, match=r"a\.csv: is a symbolic link, which is not followed"):
        write_files(tmp_path / "out", {"result.json": RESULT, "a.csv": text("2")}, ())
    assert (other.read_text() if there else other.exists()) == ("mine" if there else False)


def test_a_link_planted_where_a_part_is_written_is_not_followed(tmp_path, monkeypatch):
    monkeypatch.setattr("bushcli.report.folder.os.getpid", lambda: 7)
    (tmp_path / "other.txt").write_text("mine")
    (tmp_path / ".a.csv.7.part").symlink_to(tmp_path / "other.txt")
    write_files(tmp_path, {"a.csv": text("1")}, ())
    assert (tmp_path / "other.txt").read_text() == "mine"
    assert (tmp_path / "a.csv").read_text() == "1"


def test_an_input_is_not_replaced_through_a_link_in_its_path(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "a.csv").write_text("recorded")
    (tmp_path / "out").symlink_to(tmp_path / "data")
    with pytest.raises(InputError, match="is an input of the case"):
        refuse_others(tmp_path / "out", ["a.csv"], [tmp_path / "data" / "a.csv"])


def test_a_failure_half_way_leaves_no_part_and_keeps_what_was_there(tmp_path):
    def full(path):
        path.write_text("half")
        raise OSError(28, "No space left on device")

    write_files(tmp_path, {"result.json": RESULT, "a.csv": text("old")}, ())
    with pytest.raises(InputError, match="cannot be written: No space left on device"):
        write_files(tmp_path, {"result.json": RESULT, "a.csv": full}, ())
    assert (tmp_path / "a.csv").read_text() == "old"
    assert {path.name for path in tmp_path.iterdir()} == {"a.csv", "result.json"}


@pytest.mark.parametrize("name", ["x" * 300, "/".join(["x" * 100] * 60), "/proc/x", "/dev/null/x"])
def test_a_folder_that_cannot_be_made_is_refused_before_anything_is_computed(tmp_path, name):
    with pytest.raises(InputError, match=r"cannot be written: |is a file"):
        check_folder(tmp_path / name)


def test_a_folder_that_can_be_made_is_not_made_yet(tmp_path):
    check_folder(tmp_path / "a" / "b")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["../../x", "/etc/x", "a/b", "x" * 300, "..", "ü" * 200, "-rf"])
def test_no_name_of_a_channel_leaves_the_folder(name):
    (safe,) = file_names([name]).values()
    assert Path(safe).name == safe
    assert len(f".{safe}-comparison.csv.1234567.part".encode()) < 255
    assert not safe.startswith((".", "-"))


def test_files_of_an_interrupted_run_are_replaced(tmp_path):
    claim(tmp_path, ["axial.h5"])
    (tmp_path / "axial.h5").write_text("cut short")
    (tmp_path / "axial.csv").write_text("somebody's")
    refuse_others(tmp_path, ["axial.h5"], ())
    with pytest.raises(InputError, match="was not written by an earlier run"):
        refuse_others(tmp_path, ["axial.csv"], ())
    write_files(tmp_path, {"result.json": RESULT}, (), ["axial.h5"])
    # From then on result.json lists them.
    assert sorted(file.name for file in tmp_path.iterdir()) == ["axial.csv", "axial.h5", "result.json"]
    assert owned(tmp_path) == {"axial.h5", "result.json"}


def test_a_folder_belongs_to_one_run_at_a_time(tmp_path):
    folder = tmp_path / "deep" / "out"
    leave = occupy(folder)
    with pytest.raises(InputError, match=r"out: is in use: another run of bushcli writes into this folder"):
        occupy(folder)
    write_files(folder, {"result.json": RESULT}, ())
    leave()
    assert (folder / "result.json").exists()
    occupy(folder)()


def test_a_folder_without_a_result_is_not_left_behind(tmp_path):
    occupy(tmp_path / "out")()
    assert not (tmp_path / "out").exists()
    # An empty folder of the user remains.
    (tmp_path / "mine").mkdir()
    occupy(tmp_path / "mine")()
    assert (tmp_path / "mine").exists()
