"""Work that takes a cache: the caller's own in this process, and one of its own in each worker process."""

from __future__ import annotations

import os
import threading
import time
from concurrent.futures import ThreadPoolExecutor

from bushcli.runtime import workers
from bushcli.runtime.executor import Pool, processes
from bushcli.runtime.store import Store
from bushcli.runtime.workers import Workers


class Used:
    """A cache that counts how often it was used."""

    def __init__(self):
        self.times = 0
        self.thread: int | None = None


def use(cache: Used, pause: float) -> tuple[int, int]:
    """Return the process and how often its cache was used."""
    cache.times += 1
    cache.thread = threading.get_ident()
    time.sleep(pause)
    # Nobody else has used it in the meantime.
    assert cache.thread == threading.get_ident()
    return os.getpid(), cache.times


def test_in_this_process_it_is_the_callers_own():
    mine, other = Used(), Used()
    with processes(1) as pool:
        found = [answer for _, answer in pool.answers(use, [(0.0,)] * 3, mine)]
    assert found == [(os.getpid(), i) for i in (1, 2, 3)]
    assert Workers(1, cache=mine).run(use, [(0.0,)]) == [(os.getpid(), 4)]
    assert other.times == 0


def test_a_worker_process_retains_one_of_its_own():
    mine = Used()
    with processes(2) as pool:
        found = [answer for _, answer in pool.answers(use, [(0.05,)] * 6, mine)]
        found += [answer for _, answer in pool.answers(use, [(0.05,)] * 6, mine)]
    assert mine.times == 0
    by_process = {process: [n for one, n in found if one == process] for process, _ in found}
    assert os.getpid() not in by_process
    for times in by_process.values():
        assert sorted(times) == list(range(1, len(times) + 1))
    with Workers(2, cache=mine).open() as crew:
        # Other processes begin with other caches.
        assert min(times for _, times in crew.run(use, [(0.0,)] * 4)) == 1


def test_threads_of_a_worker_use_its_cache_one_at_a_time():
    mine = Used()
    with ThreadPoolExecutor(2) as executor:
        found = [times for _, (_, times) in Pool(executor, 2).answers(use, [(0.01,)] * 6, mine)]
    assert mine.times == 0
    assert sorted(found) == list(range(1, 7))


def test_saved_answers_have_the_name_of_the_work_and_not_of_the_cache(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "SAVED", frozenset({"use"}))
    for count in (1, 2):
        store = Store(tmp_path, _Numbers())
        with Workers(count, store, cache=Used()).open() as crew:
            crew.run(use, [(0.0,)])
        assert list(tmp_path.iterdir()) == [store.file(f"{use.__module__}.use", (0.0,))]


class _Numbers:
    """Writes the answers of `use`."""

    def encode(self, answer):
        return {"answer": answer}

    def decode(self, found, question):
        return tuple(map(int, found["answer"]))
