"""Fits on disk: whole or absent, never executed as code, and under another name for another question."""

from __future__ import annotations

import io
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest

from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect
from bushcli.runtime.store import Store
from bushcli.selection.codec import FitCodec
from bushcli.selection.fit import FittedSamples
from bushcli.selection.model import Fitted, Model

MODEL = Model(
    "neo_hookean", {"C10": 0.4}, effects=(ActiveEffect(effect("permanent_set")).with_start_values(),)
)
# The arguments of a fit: a case, a model, ...
QUESTION = ("case", MODEL)


def fitted():
    values = {"C10": 0.47, "permanent_set.set": 0.081}
    return Fitted(
        MODEL.at(values),
        ("C10", "permanent_set.set"),
        np.array(list(values.values())),
        (np.linspace(0.0, 1.0, 5), np.array([np.nan, 2.0])),
        (np.ones((5, 2)), np.eye(2)),
        True,
        17,
        2,
    )


@pytest.fixture
def store(tmp_path):
    return Store(tmp_path / "kept", FitCodec())


def test_a_fit_comes_back_as_it_was(store):
    file, before = store.file("fit", QUESTION), fitted()
    store.write(file, before)
    there, after = store.read(file, QUESTION)
    assert there
    assert after.model == before.model
    assert (after.names, after.converged, after.solves, after.failed) == (before.names, True, 17, 2)
    np.testing.assert_array_equal(after.x, before.x)
    for name in ("simulated", "jacobians"):
        pairs = zip(getattr(after, name), getattr(before, name), strict=True)
        assert all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)


@pytest.mark.parametrize("answer", [None, (), (np.arange(3.0), np.zeros((2, 0)))])
def test_derivatives_and_failures_come_back(store, answer):
    file = store.file("columns", QUESTION)
    store.write(file, answer)
    there, found = store.read(file, QUESTION)
    assert there
    if answer is None:
        assert found is None
    else:
        assert len(found) == len(answer)
        assert all(np.array_equal(a, b) and a.shape == b.shape for a, b in zip(found, answer, strict=True))


def test_what_is_not_there_is_absent(store, tmp_path):
    assert store.read(tmp_path / "none.npz", QUESTION) == (False, None)


def damaged(content: bytes):
    """Yield the file cut short, empty, replaced by something else, and with parts overwritten."""
    yield b""
    yield b"no archive"
    for share in (0.1, 0.5, 0.9, 0.999):
        yield content[: int(share * len(content))]
    rng = np.random.default_rng(1)
    for place in rng.integers(0, len(content), size=60):
        hurt = bytearray(content)
        hurt[place : place + 8] = rng.bytes(min(8, len(content) - place))
        yield bytes(hurt)


def test_a_damaged_file_counts_as_absent(store):
    file, before = store.file("fit", QUESTION), fitted()
    store.write(file, before)
    lost = 0
    for content in damaged(file.read_bytes()):
        file.write_bytes(content)
        there, after = store.read(file, QUESTION)
        lost += not there
        # Bytes that are not read, such as a date, may change.
        assert not there or np.array_equal(after.x, before.x)
    assert lost > 30


@pytest.mark.parametrize("change", [{"kind": None}, {"about": "{"}, {"about": "{}"}, {"x": None}])
def test_an_archive_that_lacks_something_counts_as_absent(store, change):
    file = store.file("fit", QUESTION)
    store.write(file, fitted())
    with np.load(file) as found:
        content = {name: found[name] for name in found.files}
    content = {n: a for n, a in content.items() if change.get(n, "") is not None}
    content |= {name: np.array(text) for name, text in change.items() if text is not None}
    np.savez(file, **content)
    assert store.read(file, QUESTION) == (False, None)


class Harm:
    """An object that creates a file when it is unpickled."""

    def __init__(self, place):
        self.place = place

    def __reduce__(self):
        return Path.touch, (self.place,)


@pytest.mark.parametrize("claimed", [10**13, 10**30])
def test_an_array_that_claims_more_numbers_than_memory_holds_counts_as_absent(store, claimed):
    file = store.file("columns", QUESTION)
    store.write(file, (np.arange(3.0),))
    with zipfile.ZipFile(file) as packed:
        members = {name: packed.read(name) for name in packed.namelist()}
    with zipfile.ZipFile(file, "w") as packed:
        for name, content in members.items():
            # The header is padded with blanks, which the longer number replaces.
            wider = content.replace(b"(3,)", f"({claimed},)".encode(), 1)
            blanks = b" " * (len(wider) - len(content))
            packed.writestr(name, wider.replace(blanks + b"\n", b"\n", 1) if blanks else wider)
    assert store.read(file, QUESTION) == (False, None)
    assert store.damaged == 1


def test_nothing_in_a_file_is_executed(store, tmp_path):
    file, done = store.file("columns", QUESTION), tmp_path / "done"
    content = {"kind": np.array("arrays"), "count": np.array(1)}
    np.savez(file, **content, array0=np.array([Harm(done)], dtype=object))
    assert store.read(file, QUESTION) == (False, None)
    raw = io.BytesIO()
    np.save(raw, np.array([Harm(done)], dtype=object), allow_pickle=True)
    file.write_bytes(raw.getvalue())
    assert store.read(file, QUESTION) == (False, None)
    assert not done.exists()
    # Unpickled on purpose, it does create the file.
    np.load(io.BytesIO(raw.getvalue()), allow_pickle=True)
    assert done.exists()


def test_a_file_is_an_archive_of_plain_arrays(store):
    file = store.file("fit", QUESTION)
    store.write(file, fitted())
    with zipfile.ZipFile(file) as archive:
        assert all(name.endswith(".npy") for name in archive.namelist())
    assert [one.suffix for one in store.folder.iterdir()] == [".npz"]


def test_another_question_has_another_name(store):
    def name(work="fit", **change):
        given = {
            "model": MODEL,
            "used": np.ones(4, dtype=bool),
            "variance": 3.0,
            "contained": None,
            "least": 7.0,
        }
        given |= change
        measured = FittedSamples((given["used"],), (given["variance"],))
        return store.file(work, ("case", given["model"], measured, given["contained"], given["least"])).name

    others = [
        name(work="columns"),
        name(model=MODEL.at({"C10": 0.5})),
        name(model=MODEL.at({"permanent_set.set": 0.1})),
        name(used=np.array([True, True, False, True])),
        name(variance=3.1),
        name(contained=MODEL),
        name(least=8.0),
    ]
    assert name() == name()
    assert len({name(), *others}) == len(others) + 1


def test_another_revision_of_the_code_is_another_name(store, monkeypatch):
    before = store.file("fit", QUESTION)
    monkeypatch.setattr("bushcli.runtime.store.code_revision", lambda: "another")
    assert store.file("fit", QUESTION) != before


def test_a_new_run_uses_no_earlier_result_and_deletes_none(tmp_path):
    first = Store(tmp_path, FitCodec())
    first.write(first.file("fit", QUESTION), fitted())
    (tmp_path / f"{24 * '0'}.1.part").touch()
    (tmp_path / "notes.txt").touch()
    again = Store(tmp_path, FitCodec(), resume=True)
    assert (again.there, again.resumes, again.used) == (1, True, set())
    assert again.read(again.file("fit", ("another question",)), QUESTION) == (False, None)
    assert not again.used
    assert again.read(again.file("fit", QUESTION), QUESTION)[0]
    assert len(again.used) == 1
    assert sorted(one.suffix for one in tmp_path.iterdir()) == [".npz", ".txt"]
    # What this run has saved itself is no result of an earlier one.
    own = again.file("fit", ("new",))
    again.write(own, fitted())
    assert again.read(own, QUESTION)[0]
    assert len(again.used) == 1
    # A new beginning replaces what is asked for; results of other questions, and what is not a result, stay.
    anew = Store(tmp_path, FitCodec())
    elsewhere = pickle.loads(pickle.dumps(anew))
    assert (anew.there, anew.resumes) == (2, False)
    assert anew.read(own, QUESTION) == elsewhere.read(own, QUESTION) == (False, None)
    elsewhere.write(own, fitted())
    assert anew.read(own, QUESTION)[0]
    assert anew.read(anew.file("fit", QUESTION), QUESTION) == (False, None)
    assert len(list(tmp_path.iterdir())) == 3
    kept = Store(tmp_path, FitCodec(), resume=True)
    assert kept.read(kept.file("fit", QUESTION), QUESTION)[0]


def test_a_full_disk_does_not_end_a_diagnosis(store, monkeypatch):
    """The run continues without the file; existing files stay, and the end of the run says that nothing was saved."""

    def full(descriptor):
        raise OSError(28, "No space left on device")

    assert store.failure() == ""
    monkeypatch.setattr("bushcli.runtime.store.os.fsync", full)
    file = store.file("fit", QUESTION)
    store.write(file, fitted())
    assert not file.exists()
    assert store.failure() == "No space left on device"
    assert list(store.folder.glob("*.part")) == []
