import json
import sys

import pytest

from bushcli.errors import InputError
from bushcli.runtime.executor import dask
from bushcli.study import rows as module
from bushcli.study.plan import saltelli
from bushcli.study.rows import JOURNAL, Rows, columns_of

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


def test_a_damaged_block_is_solved_again(tmp_path):
    rows(tmp_path).add([row(number) for number in range(8)])
    part = tmp_path / "part-000000.parquet"
    part.write_bytes(part.read_bytes()[:-7])
    assert rows(tmp_path, resume=True).done == {4, 5, 6, 7}


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
