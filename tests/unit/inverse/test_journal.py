"""Evaluations on disk."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from bushcli.errors import InputError
from bushcli.inverse.channel import Answer
from bushcli.inverse.journal import Journal

X = np.array([0.1 + 0.2, -1 / 3, 7e-3])
ANSWER = Answer(np.array([0.0, 1.0]), np.array([0.0, np.pi]), np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 1 / 3]]))


def test_round_trip_is_exact_to_the_bit(tmp_path):
    file = tmp_path / "run" / "history.jsonl"
    Journal(file, {"case": 1}, resume=False).add(X, [ANSWER])
    (found,) = Journal(file, {"case": 1}, resume=True).find(X)
    assert np.array_equal(found.displacement, ANSWER.displacement)
    assert np.array_equal(found.force, ANSWER.force)
    assert np.array_equal(found.slope, ANSWER.slope)


def test_reached_states_are_kept_where_there_are_any(tmp_path):
    file, states = tmp_path / "h.jsonl", np.array([[0.8, 1.0, 1 / 0.8]])
    Journal(file, {}, resume=False).add(X, [replace(ANSWER, states=states), ANSWER])
    first, second = Journal(file, {}, resume=True).find(X)
    assert np.array_equal(first.states, states)
    assert second.states is None


def test_other_parameters_are_not_known(tmp_path):
    journal = Journal(tmp_path / "h.jsonl", {}, resume=False)
    journal.add(X, [ANSWER])
    assert journal.find(np.nextafter(X, 1.0)) is None


def test_a_failure_is_remembered_as_one(tmp_path):
    file = tmp_path / "h.jsonl"
    Journal(file, {}, resume=False).add(X, [])
    assert Journal(file, {}, resume=True).find(X) == []


def test_every_evaluation_is_on_disk_at_once_and_nothing_else_is_left(tmp_path):
    file = tmp_path / "h.jsonl"
    journal = Journal(file, {}, resume=False)
    for i in range(3):
        journal.add(X + i, [ANSWER])
        assert len(file.read_text(encoding="utf-8").splitlines()) == i + 2
    assert [path.name for path in tmp_path.iterdir()] == ["h.jsonl"]


def test_without_resume_a_new_history_is_begun(tmp_path):
    file = tmp_path / "h.jsonl"
    Journal(file, {}, resume=False).add(X, [ANSWER])
    assert Journal(file, {}, resume=False).find(X) is None


def test_resuming_what_never_began_begins(tmp_path):
    assert Journal(tmp_path / "h.jsonl", {}, resume=True).find(X) is None


def test_history_of_another_run_is_refused(tmp_path):
    file = tmp_path / "h.jsonl"
    Journal(file, {"model": "yeoh"}, resume=False).add(X, [ANSWER])
    with pytest.raises(InputError, match="another case, law or option"):
        Journal(file, {"model": "ogden"}, resume=True)


@pytest.mark.parametrize("text", ["nonsense\n", "[1, 2]\n", json.dumps({"other": 1}) + "\n"])
def test_what_is_not_a_history_is_refused(tmp_path, text):
    file = tmp_path / "h.jsonl"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="not a history"):
        Journal(file, {}, resume=True)


@pytest.mark.parametrize(
    "content",
    [
        *(b"", b"\xff\xfe\0", b"\0", b"not json\n", b"[]\n", b"{}\n", b"[" * 100_000),
        *(b'{"identity": 5}\n', b'null\n{"x": 1}\n'),
    ],
)
def test_a_damaged_history_is_refused_and_left_as_it_is(tmp_path, content):
    file = tmp_path / "h.jsonl"
    file.write_bytes(content)
    with pytest.raises(InputError, match=r"h\.jsonl: is (damaged|of another case)"):
        Journal(file, {}, resume=True)
    assert file.read_bytes() == content


@pytest.mark.parametrize("keep", [0.3, 0.6, 0.95])
def test_a_history_that_was_cut_off_is_refused(tmp_path, keep):
    file = tmp_path / "h.jsonl"
    Journal(file, {}, resume=False).add(X, [ANSWER])
    content = file.read_bytes()
    file.write_bytes(content[: int(keep * len(content))])
    with pytest.raises(InputError, match=r"is damaged.*without --resume"):
        Journal(file, {}, resume=True)


def test_a_folder_in_place_of_the_history_is_refused(tmp_path):
    with pytest.raises(InputError, match="is damaged, or not a history"):
        Journal(tmp_path, {}, resume=True)


def test_a_full_disk_does_not_end_the_search(tmp_path):
    """What was written before stays, and the answer is still known."""
    file = tmp_path / "run" / "h.jsonl"
    (tmp_path / "run").write_text("a file where the folder should be")
    journal = Journal(file, {}, resume=False)
    journal.add(X, [ANSWER])
    assert journal.failure
    assert journal.find(X) == [ANSWER]
    (tmp_path / "run").unlink()
    journal.add(X + 1, [ANSWER])
    assert not journal.failure
    assert len(file.read_text(encoding="utf-8").splitlines()) == 3
