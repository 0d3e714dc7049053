"""Evaluations on disk."""

from __future__ import annotations

import json
import os
import shutil
from dataclasses import replace

import numpy as np
import pytest

from bushcli.errors import InputError
from bushcli.inverse.channel import ChannelForces
from bushcli.inverse.journal import RUN, Journal, open_journal
from bushcli.runtime import store
from bushcli.runtime.store import SUFFIX

X = np.array([0.1 + 0.2, -1 / 3, 7e-3])
ANSWER = ChannelForces(
    np.array([0.0, 1.0]), np.array([0.0, np.pi]), np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 1 / 3]])
)


def saved(folder):
    return sorted(folder.glob(f"*{SUFFIX}"))


def test_round_trip_is_exact_to_the_bit(tmp_path):
    folder = tmp_path / "run" / "history"
    Journal(folder, {"case": 1}, resume=False).add(X, [ANSWER])
    (found,) = Journal(folder, {"case": 1}, resume=True).find(X)
    assert np.array_equal(found.displacement, ANSWER.displacement)
    assert np.array_equal(found.force, ANSWER.force)
    assert np.array_equal(found.slope, ANSWER.slope)


def test_reached_states_are_kept_where_there_are_any(tmp_path):
    states = np.array([[0.8, 1.0, 1 / 0.8]])
    Journal(tmp_path, {}, resume=False).add(X, [replace(ANSWER, states=states), ANSWER])
    first, second = Journal(tmp_path, {}, resume=True).find(X)
    assert np.array_equal(first.states, states)
    assert second.states is None


def test_other_parameters_are_not_known(tmp_path):
    journal = Journal(tmp_path, {}, resume=False)
    journal.add(X, [ANSWER])
    assert journal.find(np.nextafter(X, 1.0)) is None


def test_a_failure_is_remembered_as_one(tmp_path):
    Journal(tmp_path, {}, resume=False).add(X, [])
    assert Journal(tmp_path, {}, resume=True).find(X) == []


def test_every_evaluation_is_on_disk_at_once_and_nothing_else_is_left(tmp_path):
    journal = Journal(tmp_path, {}, resume=False)
    for i in range(3):
        journal.add(X + i, [ANSWER])
        assert len(saved(tmp_path)) == i + 1
    assert {path.name for path in tmp_path.iterdir()} == {RUN, *(path.name for path in saved(tmp_path))}


def test_without_resume_a_new_history_is_begun(tmp_path):
    Journal(tmp_path, {}, resume=False).add(X, [ANSWER])
    anew = Journal(tmp_path, {}, resume=False)
    assert anew.find(X) is None
    anew.add(X, [replace(ANSWER, force=2.0 * ANSWER.force)])
    assert len(saved(tmp_path)) == 1
    (found,) = Journal(tmp_path, {}, resume=True).find(X)
    np.testing.assert_array_equal(found.force, 2.0 * ANSWER.force)


def test_resuming_what_never_began_begins(tmp_path):
    assert Journal(tmp_path / "history", {}, resume=True).find(X) is None


def test_history_of_another_run_is_refused(tmp_path):
    Journal(tmp_path, {"model": "yeoh"}, resume=False).add(X, [ANSWER])
    with pytest.raises(InputError, match="another case, law or option"):
        Journal(tmp_path, {"model": "ogden"}, resume=True)
    assert saved(tmp_path)


def test_histories_of_several_questions_stand_side_by_side(tmp_path):
    base = tmp_path / "history-yeoh"
    for model in ("yeoh", "ogden"):
        open_journal(base, {"model": model}, None).add(X, [ANSWER])
    (tmp_path / "history-yeoh-3").mkdir()
    (tmp_path / "history-yeoh-3" / "run.json").write_text("mine")
    assert open_journal(base, {"model": "third"}, None).folder.name == "history-yeoh-4"
    for model, name in (("yeoh", "history-yeoh"), ("ogden", "history-yeoh-2")):
        again = open_journal(base, {"model": model}, None)
        assert (again.folder.name, again.find(X) is not None) == (name, True)
    # Only that of the same question is begun anew.
    assert open_journal(base, {"model": "ogden"}, False).find(X) is None
    assert open_journal(base, {"model": "yeoh"}, True).find(X) is not None
    assert (tmp_path / "history-yeoh-3" / "run.json").read_text() == "mine"
    with pytest.raises(InputError, match="another case, law or option"):
        open_journal(base, {"model": "fifth"}, True)


def test_another_revision_of_the_code_calculates_again(tmp_path, monkeypatch):
    Journal(tmp_path, {}, resume=False).add(X, [ANSWER])
    monkeypatch.setattr(store, "code_revision", lambda: "another")
    assert Journal(tmp_path, {}, resume=True).find(X) is None


@pytest.mark.parametrize(
    "content", [b"", b"\xff\xfe\0", b"not json\n", b"[]\n", b"{}\n", b"[" * 5_000, b"x" * 20_000, b"null\n"]
)
def test_a_damaged_index_is_refused_and_left_as_it_is(tmp_path, content):
    (tmp_path / RUN).write_bytes(content)
    with pytest.raises(InputError, match=r"run\.json: is damaged.*without --resume"):
        Journal(tmp_path, {}, resume=True)
    assert (tmp_path / RUN).read_bytes() == content


def test_an_evaluation_that_is_a_link_or_a_pipe_is_calculated_again(tmp_path):
    journal = Journal(tmp_path / "one", {}, resume=False)
    for x in (X, X + 1):
        journal.add(x, [ANSWER])
    linked, pipe = saved(journal.folder)
    linked.rename(tmp_path / "elsewhere")
    linked.symlink_to(tmp_path / "elsewhere")
    pipe.unlink()
    os.mkfifo(pipe)
    again = Journal(journal.folder, {}, resume=True)
    assert [again.find(x) for x in (X, X + 1)] == [None, None]
    assert again.damaged_entries == 2


@pytest.mark.parametrize("keep", [0.0, 0.3, 0.95])
def test_an_evaluation_that_was_cut_off_is_calculated_again(tmp_path, keep):
    Journal(tmp_path, {}, resume=False).add(X, [ANSWER])
    (file,) = saved(tmp_path)
    content = file.read_bytes()
    file.write_bytes(content[: int(keep * len(content))])
    assert Journal(tmp_path, {}, resume=True).find(X) is None


def test_files_that_bushcli_did_not_write_stay(tmp_path):
    others = [tmp_path / name for name in ("mine.npz", "notes.txt", "half.part")]
    for file in others:
        file.write_text("mine")
    Journal(tmp_path, {}, resume=False).add(X, [ANSWER])
    Journal(tmp_path, {}, resume=False)
    assert [file.read_text() for file in others] == ["mine"] * 3


def test_an_index_that_bushcli_did_not_write_is_not_replaced(tmp_path):
    (tmp_path / RUN).write_text(json.dumps({"mine": 1}))
    with pytest.raises(InputError, match="exists already and was not written by an earlier run"):
        Journal(tmp_path, {}, resume=False)
    assert json.loads((tmp_path / RUN).read_text()) == {"mine": 1}


def test_links_are_not_followed(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "history").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="symbolic link"):
        Journal(tmp_path / "history", {}, resume=False)
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / RUN).symlink_to(tmp_path / "target")
    with pytest.raises(InputError, match="symbolic link"):
        Journal(tmp_path / "real", {}, resume=False)
    assert not (tmp_path / "target").exists()


def test_a_file_in_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "history").write_text("a file")
    with pytest.raises(InputError, match="cannot be written"):
        Journal(tmp_path / "history", {}, resume=False)


def test_a_full_disk_does_not_end_the_search(tmp_path):
    """The answer is still known, and it is said that none can be saved."""
    folder = tmp_path / "history"
    journal = Journal(folder, {}, resume=False)
    shutil.rmtree(folder)
    journal.add(X, [ANSWER])
    assert journal.failure
    assert journal.find(X) == [ANSWER]
    folder.mkdir()
    journal.add(X + 1, [ANSWER])
    assert not journal.failure
    assert len(saved(folder)) == 1
