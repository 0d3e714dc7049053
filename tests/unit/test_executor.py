import os
import signal
import socket
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from bushcli.errors import InputError
from bushcli.runtime.executor import AHEAD, Died, Here, Pool, dask, processes


def doubled(x):
    return 2 * x


def wrong(x):
    raise ValueError(f"not {x}")


def slow_first(x):
    time.sleep(0.2 if x == 0 else 0.0)
    return x


def dies_once(x, folder):
    marker = folder / f"{x}"
    if x == 5 and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return x


def dies_always(x, _):
    if x == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return x


def test_everything_is_answered_here():
    with processes(1) as pool:
        assert list(pool.answers(doubled, [(i,) for i in range(5)])) == [((i,), 2 * i) for i in range(5)]


def test_answers_come_as_they_are_known():
    with ThreadPoolExecutor(2) as executor:
        found = [answer for _, answer in Pool(executor, 2).answers(slow_first, [(i,) for i in range(6)])]
    assert sorted(found) == list(range(6))
    assert found[0] != 0


def test_few_questions_wait():
    asked = []

    def questions():
        for i in range(100):
            asked.append(i)
            yield (i,)

    for number, _ in enumerate(Pool(Here(), 2).answers(doubled, questions())):
        assert len(asked) <= number + 1 + 2 * AHEAD


def test_what_the_work_raises_comes_out():
    with pytest.raises(ValueError, match="not 1"):
        list(Pool(Here(), 1).answers(wrong, [(1,)]))


def test_a_process_that_dies_loses_no_answer(tmp_path):
    with processes(2) as pool:
        found = [answer for _, answer in pool.answers(dies_once, [(i, tmp_path) for i in range(12)])]
    assert sorted(found) == list(range(12))


def test_a_question_that_kills_its_process_is_named(tmp_path):
    with processes(2) as pool:
        found = dict(pool.answers(dies_always, [(i, None) for i in range(6)]))
    assert isinstance(found.pop((2, None)), Died)
    assert found == {(i, None): i for i in (0, 1, 3, 4, 5)}


def test_a_scheduler_that_is_not_there_is_refused(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("bushcli.runtime.executor.TIMEOUT", 1.0)
    with (
        pytest.raises(InputError, match=r"--scheduler: tcp://127\.0\.0\.1:9 does not answer"),
        dask("tcp://127.0.0.1:9"),
    ):
        pass


def test_a_port_that_accepts_and_never_answers_is_refused(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("bushcli.runtime.executor.TIMEOUT", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(InputError, match="does not answer: "), dask(address):
            pass
