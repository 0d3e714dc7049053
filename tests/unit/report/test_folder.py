"""Files that may be written into a folder of results, and files that are not touched."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bushcli.errors import InputError
from bushcli.report.writers.files import write_refused
from bushcli.report.writers.folder import (
    CLAIMED,
    STAGING,
    NotDrawn,
    check_folder,
    occupy,
    own_files,
    refuse_others,
    staging_folder,
    write_files,
)
from bushcli.runtime.names import file_names
from geometry.errors import GeometryError
from geometry.view import View

RESULT = {"command": "direct", "versions": {}}


def text(content):
    return lambda path: path.write_text(content)


def test_the_result_lists_what_was_written(tmp_path):
    write_files(tmp_path / "out", {"result.json": RESULT, "a.csv": text("1")}, ())
    assert json.loads((tmp_path / "out" / "result.json").read_text())["files"] == ["a.csv", "result.json"]
    assert own_files(tmp_path / "out") == {"a.csv", "result.json"}


def test_results_of_several_commands_share_a_folder(tmp_path):
    for name in ("a.csv", "b.csv", "a.csv"):
        write_files(tmp_path, {"result.json": RESULT, name: text(name)}, ())
    assert own_files(tmp_path) == {"a.csv", "b.csv", "result.json"}


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


def test_a_result_that_lists_no_files_owns_none(tmp_path):
    # As `bushcli direct --json > out/result.json` writes it.
    (tmp_path / "result.json").write_text(json.dumps(RESULT))
    for name in ("report.html", "a.csv"):
        (tmp_path / name).write_text("mine")
        with pytest.raises(InputError, match=r"was not written by an earlier run"):
            write_files(tmp_path, {name: text("new")}, ())
        assert (tmp_path / name).read_text() == "mine"
    with pytest.raises(InputError, match=r"result\.json: exists already"):
        write_files(tmp_path, {"result.json": RESULT}, ())


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


def test_a_link_planted_where_a_part_is_written_is_not_followed(tmp_path):
    (tmp_path / "other.txt").write_text("mine")
    (tmp_path / STAGING).mkdir()
    (tmp_path / STAGING / "a.csv.part").symlink_to(tmp_path / "other.txt")
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
    with pytest.raises(InputError, match=r"cannot be written: |is a file") as refused:
        check_folder(tmp_path / name)
    # No name of a temporary file, which the user has never seen.
    assert str(tmp_path / name).startswith(refused.value.problems[0].where)


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
    (tmp_path / CLAIMED).write_text('["axial.h5"]')
    (tmp_path / "axial.h5").write_text("cut short")
    (tmp_path / "axial.csv").write_text("somebody's")
    refuse_others(tmp_path, ["axial.h5"], ())
    with pytest.raises(InputError, match="was not written by an earlier run"):
        refuse_others(tmp_path, ["axial.csv"], ())
    write_files(tmp_path, {"result.json": RESULT}, (), ["axial.h5"])
    # From then on result.json lists them.
    assert sorted(file.name for file in tmp_path.iterdir()) == ["axial.csv", "axial.h5", "result.json"]
    assert own_files(tmp_path) == {"axial.h5", "result.json"}


def asked(question, command="direct", problems=()):
    return RESULT | {
        "command": command,
        "question": question,
        "problems": [{"name": one} for one in problems],
    }


def answers(folder):
    """Return command and question of each result in a folder, by the name of the folder that holds it."""
    found = {file.parent.name: json.loads(file.read_text()) for file in folder.rglob("result.json")}
    return {name: (one["command"], one["question"]) for name, one in found.items()}


def test_a_result_of_another_question_or_command_is_kept_with_its_files(tmp_path):
    out = tmp_path / "out"
    for number, (question, command) in enumerate(
        [("p", "direct"), ("q", "direct"), ("q", "fit"), ("q", "fit")]
    ):
        name = f"{number}.csv"
        write_files(out, {"result.json": asked(question, command), name: text(name)}, ())
    assert answers(out) == {
        "out": ("fit", "q"),
        "earlier-direct": ("direct", "p"),
        "earlier-direct-2": ("direct", "q"),
    }
    assert [
        (out / place / name).read_text() for place, name in (("earlier-direct", "0.csv"), (".", "3.csv"))
    ] == ["0.csv", "3.csv"]
    assert not (out / "0.csv").exists()
    assert not list(out.glob(".bushcli*"))


def test_a_result_that_is_kept_already_is_not_kept_twice(tmp_path):
    for command in ("direct", "fit", "direct", "fit"):
        write_files(tmp_path / "out", {"result.json": asked("p", command)}, ())
    assert answers(tmp_path / "out").keys() == {"out", "earlier-direct", "earlier-fit"}


@pytest.mark.parametrize("question", ["p", "q"])
def test_an_unfinished_result_does_not_replace_a_finished_one(tmp_path, question):
    out = tmp_path / "out"
    write_files(out, {"result.json": asked("p"), "a.csv": text("whole")}, ())
    for _ in range(2):
        cut = asked(question, problems=["interrupted"])
        (path, _) = write_files(out, {"result.json": cut, "a.csv": text("part")}, ())
        assert path.parent == out / "unfinished-direct"
    assert answers(out) == {"out": ("direct", "p"), "unfinished-direct": ("direct", question)}
    assert (out / "a.csv").read_text() == "whole"


def test_a_finished_result_replaces_the_unfinished_one_with_its_pictures(tmp_path):
    cut = asked("p", problems=["interrupted"])
    write_files(tmp_path, {"result.json": cut}, (), drawn=lambda: {"a.png": text("part")})
    write_files(tmp_path, {"result.json": asked("p")}, ())
    assert [file.name for file in tmp_path.iterdir()] == ["result.json"]


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt(), OSError(28, "No space left on device"), ValueError("font")]
)
def test_the_result_is_there_when_the_drawing_fails(tmp_path, error):
    def draw():
        assert (tmp_path / "a.csv").read_text() == "1"
        raise error

    with pytest.raises(NotDrawn) as caught:
        write_files(tmp_path, {"result.json": RESULT, "a.csv": text("1")}, (), drawn=draw)
    assert caught.value.cause is error
    assert own_files(tmp_path) == {"a.csv", "result.json"}


def test_pictures_beside_a_picture_of_the_user_are_drawn(tmp_path):
    (tmp_path / "mine.png").write_text("mine")
    shown = {"mine.png": text("ours"), "other.png": text("ours")}
    with pytest.raises(NotDrawn) as caught:
        write_files(tmp_path, {"result.json": RESULT}, (), drawn=lambda: shown)
    assert "mine.png: exists already" in str(caught.value.cause)
    assert (tmp_path / "mine.png").read_text() == "mine"
    assert own_files(tmp_path) == {"other.png", "result.json"}


def test_a_folder_and_a_protected_file_in_place_of_a_result_are_refused(tmp_path):
    write_files(tmp_path, {"result.json": RESULT, "a.csv": text("1"), "b.csv": text("1")}, ())
    (tmp_path / "a.csv").chmod(0o444)
    (tmp_path / "b.csv").unlink()
    (tmp_path / "b.csv").mkdir()
    with pytest.raises(InputError, match=r"a\.csv: is write-protected(.|\n)*b\.csv: is a folder"):
        refuse_others(tmp_path, ["a.csv", "b.csv"], ())
    write_files(tmp_path, {"result.json": asked("p", "fit")}, ())
    assert (tmp_path / "a.csv").read_text() == "1"


def test_what_a_run_writes_while_it_calculates_is_apart_until_it_ends(tmp_path):
    write_files(tmp_path, {"result.json": RESULT, "a.h5": text("old")}, ())
    with staging_folder(tmp_path) as folder:
        (folder / "a.h5").write_text("part")
    assert (tmp_path / "a.h5").read_text() == "old"
    with staging_folder(tmp_path) as folder:
        (folder / "a.h5").write_text("new")
        write_files(tmp_path, {"result.json": asked("p")}, (), ["a.h5", "b.h5"])
    assert (tmp_path / "a.h5").read_text() == "new"
    assert (tmp_path / "earlier-direct" / "a.h5").read_text() == "old"
    assert own_files(tmp_path) == {"a.h5", "result.json"}
    assert not (tmp_path / STAGING).exists()


def test_a_result_cannot_own_files_elsewhere(tmp_path):
    (tmp_path / "mine.csv").write_text("mine")
    listed = {"files": ["../mine.csv", "result.json"]}
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "result.json").write_text(json.dumps(asked("p") | listed))
    write_files(tmp_path / "out", {"result.json": asked("q")}, ())
    assert (tmp_path / "mine.csv").read_text() == "mine"


KILLED = """
import os, signal, sys
from pathlib import Path
from bushcli.report.writers import folder

calls = 0
def counted(call):
    def count(*arguments, **options):
        global calls
        calls += 1
        if calls == int(sys.argv[2]):
            os.kill(os.getpid(), signal.SIGKILL)
        return call(*arguments, **options)
    return count

for name in ("replace", "unlink", "rename", "mkdir"):
    setattr(Path, name, counted(getattr(Path, name)))
os.link = counted(os.link)
result = {"command": "direct", "versions": {}, "question": "q", "problems": []}
files = {"result.json": result, "a.csv": lambda path: path.write_text("q"), "b.csv": lambda path: path.write_text("q")}
drawn = lambda: {"a.png": lambda path: path.write_text("q")}
folder.write_files(Path(sys.argv[1]), files, (), (), drawn)
"""


def is_whole(folder):
    """Whether a folder holds the result of question p with all its files."""
    names = ("a.csv", "c.csv", "a.png")
    there = all((folder / name).exists() and (folder / name).read_text() == "p" for name in names)
    return there and json.loads((folder / "result.json").read_text())["question"] == "p"


@pytest.mark.parametrize("moment", range(1, 30, 3))
def test_whenever_a_run_is_killed_the_earlier_result_is_whole_and_the_next_run_is_accepted(tmp_path, moment):
    out = tmp_path / "out"
    before = {"result.json": asked("p"), "a.csv": text("p"), "c.csv": text("p")}
    write_files(out, before, (), drawn=lambda: {"a.png": text("p")})
    subprocess.run([sys.executable, "-c", KILLED, out, str(moment)], check=False)
    for _ in range(2):
        assert any(is_whole(file.parent) for file in out.rglob("result.json"))
        with staging_folder(out):
            write_files(out, {"result.json": asked("r"), "a.csv": text("r")}, ())
    assert not [file for file in out.rglob("*") if file.name.endswith(".part") or file.name == STAGING]


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


def test_the_picture_of_a_refused_geometry_is_replaced_by_the_next_one(tmp_path):
    triangle = np.array([[[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 0.0, 1.0]]])
    view = View(triangle, np.zeros(1, dtype=int), ("rubber",))
    for reason in ("it has no axis", "it has no bond"):
        written = write_refused(tmp_path, GeometryError("part.step", reason, view=view))
        assert [path.name for path in written] == ["geometry.png", "geometry.svg"]
    assert own_files(tmp_path) == {path.name for path in written}
