import json
import os
import sys

import pytest

from bushcli.errors import InputError
from bushcli.runtime.executor import dask
from bushcli.study import rows as module
from bushcli.study.plan import saltelli
from bushcli.study.rows import DEFINITION, JOURNAL, Rows, columns_of

COLUMNS = columns_of({"a": True, "word": False}, ["k"], ["axial.force"])


def row(number):
    return {
        "design": number,
        "a": number / 7,
        "word": f"w{number}",
        "status": "ok",
        "failure": "",
        "reason": "",
        "k": 3.0 * number,
        "conditions": "",
        "seconds": 0.1,
        "axial.force": [1.0, float(number)],
    }


OPEN = []


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    monkeypatch.setattr(module, "BLOCK", 4)
    yield
    while OPEN:
        OPEN.pop().close()


def rows(folder, resume=False, count=10, definition=None):
    OPEN.append(Rows(folder, definition or {"keys": ["a"]}, COLUMNS, count, resume))
    return OPEN[-1]


def read(found, name="design"):
    return [value for table in found.tables([name]) for value in table[name].to_pylist()]


def test_rows_come_back_in_order_whatever_order_they_came_in(tmp_path):
    found = rows(tmp_path)
    for number in (9, 3, 1, 0, 2, 8, 4, 7, 6, 5):
        found.add([row(number)])
    assert read(found) == list(range(10))
    assert read(found, "axial.force")[5] == [1.0, 5.0]
    assert sorted(file.name for file in tmp_path.glob("part-*")) == [
        f"part-00000{i}.parquet" for i in range(3)
    ]
    assert (tmp_path / JOURNAL).read_bytes() == b""


def test_nothing_is_lost_and_nothing_twice_when_a_line_is_cut_short(tmp_path):
    found = rows(tmp_path)
    found.add([row(number) for number in (0, 1, 2, 3, 5)])
    # Killed while writing design 6, after design 1 had been written a second time.
    with (tmp_path / JOURNAL).open("ab") as file:
        file.write(json.dumps(row(1)).encode() + b"\n" + json.dumps(row(6)).encode()[:20])
    again = rows(tmp_path, resume=True)
    assert again.done == {0, 1, 2, 3, 5}
    again.add([row(number) for number in (3, 4, 6, 7, 8, 9)])
    assert read(again) == list(range(10))


def test_killed_between_a_block_and_the_shorter_journal(tmp_path):
    found = rows(tmp_path)
    found.add([row(number) for number in (0, 1, 2)])
    before = (tmp_path / JOURNAL).read_bytes()
    found.add([row(3)])
    found.close()
    (tmp_path / JOURNAL).write_bytes(before + json.dumps(row(3)).encode() + b"\n")
    assert read(rows(tmp_path, resume=True)) == [0, 1, 2, 3]


def cut(content):
    return content[:-7]


def flip(content):
    """One bit of the curves, far from the footer."""
    at = content.index(b"\x28\xb5\x2f\xfd") + 12
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


@pytest.mark.parametrize("damage", [cut, flip, lambda content: b"", lambda content: b"PAR1"])
def test_a_damaged_block_is_solved_again_and_counted(tmp_path, damage):
    rows(tmp_path).add([row(number) for number in range(8)])
    part = tmp_path / "part-000000.parquet"
    part.write_bytes(damage(part.read_bytes()))
    again = rows(tmp_path, resume=True)
    assert (again.done, again.damaged) == ({4, 5, 6, 7}, 4)
    again.add([row(number) for number in range(10)])
    assert read(again) == list(range(10))


@pytest.mark.parametrize(
    "line",
    [
        b"no json",
        b"[1]",
        b"7",
        b'{"design": 2}',
        json.dumps(row(2) | {"design": 99}).encode(),
        json.dumps(row(2) | {"design": True}).encode(),
        json.dumps(row(2) | {"k": "word"}).encode(),
        json.dumps(row(2) | {"conditions": None}).encode(),
        b"[" * 100_000,
        b"\xff\x00",
    ],
    ids=lambda line: line[:20],
)
def test_damaged_lines_of_the_journal_are_solved_again_and_counted(tmp_path, line):
    rows(tmp_path).add([row(0), row(1)])
    journal = tmp_path / JOURNAL
    journal.write_bytes(line + b"\n" + journal.read_bytes() + b'{"design": 3, "cut sh')
    again = rows(tmp_path, resume=True)
    assert (again.done, again.damaged) == ({0, 1}, 1)
    again.add([row(number) for number in range(10)])
    assert read(again) == list(range(10))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is damaged"),
        (b'{"keys": ["a"', "is damaged"),
        (b"7", "is damaged"),
        (b"\xff", "is damaged"),
        (None, "is missing"),
    ],
)
def test_a_damaged_definition_is_said_to_be_damaged(tmp_path, content, said):
    rows(tmp_path).add([row(0)])
    file = tmp_path / DEFINITION
    file.unlink() if content is None else file.write_bytes(content)
    with pytest.raises(InputError, match=rf"study\.json: {said}"):
        rows(tmp_path, resume=True)
    assert rows(tmp_path).done == set()


@pytest.mark.parametrize("resume", [False, True])
@pytest.mark.parametrize("name", ["", DEFINITION, JOURNAL, "part-000000.parquet", "journal.part"])
def test_symbolic_links_are_not_followed(tmp_path, name, resume):
    """Another folder with files of these names must stay as it is."""
    other, folder = tmp_path / "other", tmp_path / "rows"
    rows(other).add([row(number) for number in range(6)])
    before = {file: file.read_bytes() for file in other.iterdir()}
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / name).symlink_to(other / name)
    with pytest.raises(InputError, match="is a symbolic link, which is not followed"):
        rows(folder, resume=resume)
    assert {file: file.read_bytes() for file in other.iterdir()} == before


@pytest.mark.parametrize("name", [DEFINITION, JOURNAL, "part-000000.parquet"])
def test_a_pipe_in_the_folder_is_not_read(tmp_path, name):
    rows(tmp_path).add([row(number) for number in range(6)])
    (tmp_path / name).unlink()
    os.mkfifo(tmp_path / name)
    if name == DEFINITION:
        with pytest.raises(InputError, match=r"is damaged \(is a device or a pipe"):
            rows(tmp_path, resume=True)
    else:
        assert rows(tmp_path, resume=True).damaged > 0


def test_files_of_others_in_the_folder_stay(tmp_path):
    (tmp_path / "part-list.txt").write_text("mine")
    rows(tmp_path).add([row(0)])
    assert rows(tmp_path).done == set()
    assert (tmp_path / "part-list.txt").read_text() == "mine"


def test_without_resume_the_folder_is_emptied(tmp_path):
    rows(tmp_path).add([row(number) for number in range(6)])
    assert rows(tmp_path).done == set()


def test_rows_of_another_study_are_refused(tmp_path):
    rows(tmp_path).add([row(0)])
    with pytest.raises(InputError, match="another study: keys differ"):
        rows(tmp_path, resume=True, definition={"keys": ["b"]})


def test_one_file_for_all(tmp_path):
    import pyarrow.parquet

    found = rows(tmp_path / "rows")
    found.add([row(number) for number in (0, 1, 2, 3, 4, 7)])
    found.write(tmp_path / "all.parquet")
    table = pyarrow.parquet.read_table(tmp_path / "all.parquet")
    assert table["design"].to_pylist() == [0, 1, 2, 3, 4, 7]
    assert table.column_names == list(COLUMNS)


@pytest.mark.parametrize(
    ("module_name", "use"),
    [
        ("pyarrow", lambda: module.parquet()),
        ("SALib.sample", lambda: saltelli(2, 4, 0)),
        ("distributed", lambda: dask("tcp://127.0.0.1:9").__enter__()),
    ],
)
def test_without_a_library_the_message_names_the_extra(monkeypatch, module_name, use):
    monkeypatch.setitem(sys.modules, module_name, None)
    with pytest.raises(
        InputError, match=r'which is not installed \(make install .* pip install "bushcli\[study\]"\)'
    ):
        use()
