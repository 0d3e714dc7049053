"""Independent runs in worker processes: answers in order, the same file names, ended with the first process."""

from __future__ import annotations

import operator
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from multiprocessing import active_children
from pathlib import Path

import ezdxf
import numpy as np
import pytest

from bushcli.case import load_case
from bushcli.errors import InputError
from bushcli.inverse.journal import digest
from bushcli.inverse.task import Task
from bushcli.runtime import workers
from bushcli.runtime.store import SUFFIX, Store
from bushcli.runtime.workers import Workers, _deaf
from bushcli.selection.codec import FitCodec
from tests.parts import make
from tests.processes import lives

CASE = """\
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0
[material]
law = "yeoh"
[[recordings]]
mode = "axial"
file = "axial.csv"
"""


@pytest.fixture
def case(tmp_path):
    (tmp_path / "axial.csv").write_text("displacement_mm,force_N\n" + "".join(f"{q},{q}\n" for q in range(6)))
    (tmp_path / "case.toml").write_text(CASE)
    return load_case(tmp_path / "case.toml")


def none_left() -> bool:
    """Whether all processes have ended.

    The pool's thread may have just asked for the end of a process and not have recorded it yet: seen on Python 3.14
    once in 25 interruptions.
    """
    soon = time.monotonic() + 5.0
    while active_children() and time.monotonic() < soon:
        time.sleep(0.01)
    return not active_children()


def name(folder, *question):
    return Store(folder, FitCodec()).file("mul", question).name


@pytest.mark.parametrize("count", [1, 2])
def test_a_question_is_worked_on_beside_others(count):
    with Workers(count).open() as crew:
        asked = crew.ask(operator.mul, (3, 4))
        assert crew.run(operator.mul, [(2, 2)]) == [4]
        assert asked.answer() == 12


def wait_until_abandoned(folder):
    (folder / "begun").touch()
    for _ in range(1000):
        workers.end_if_abandoned()
        time.sleep(0.01)


@pytest.mark.parametrize("begins", [True, False])
def test_work_ends_whose_answer_nobody_waits_for(tmp_path, begins, monkeypatch):
    monkeypatch.setattr(workers, "MARKS", 3)
    with Workers(2).open() as crew:
        asked = [crew.ask(wait_until_abandoned, (tmp_path,)) for _ in range(2 if begins else 3)]
        while not (tmp_path / "begun").exists():
            time.sleep(0.01)
        begun = time.monotonic()
        for one in asked:
            one.abandon()
        # Other work is done at once, and is not abandoned itself, with whichever mark.
        assert crew.ask(operator.mul, (3, 4)).answer() == 12
        assert crew.run(workers.end_if_abandoned, [()]) == [None]
        again = [crew.ask(workers.end_if_abandoned, ()) for _ in range(4)]
        assert [one.answer() for one in again] == [None] * 4
    assert time.monotonic() - begun < 5.0


def test_answers_are_in_order_and_every_process_is_of_a_group_of_its_own():
    heard = []
    with Workers(2).open() as crew:
        assert crew.run(operator.mul, [(i, i) for i in range(5)], lambda i, a: heard.append((i, a))) == [
            0,
            1,
            4,
            9,
            16,
        ]
        groups = set(crew.run(os.getpgrp, [()] * 4))
    assert heard == [(i, i * i) for i in range(5)]
    # Ctrl-C at the terminal goes to the group of the first process.
    assert os.getpgrp() not in groups
    assert none_left()


def test_an_interruption_ends_all_processes_at_once_and_what_is_done_is_kept(tmp_path, monkeypatch):
    def interrupt(number, answer):
        raise KeyboardInterrupt

    monkeypatch.setattr(workers, "SAVED", frozenset({"sleep"}))
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt), Workers(2, Store(tmp_path, FitCodec())).open() as crew:
        crew.run(time.sleep, [(0.0,), (100.0,), (100.0,), (100.0,), (100.0,)], interrupt)
    assert time.monotonic() - begin < 50.0
    assert none_left()
    (file,) = tmp_path.glob(f"*{SUFFIX}")
    assert Store(tmp_path, FitCodec(), resume=True).read(file, (0.0,)) == (True, None)
    # This answer differs from the calculation's, so that it can only come from the file.
    Store(tmp_path, FitCodec(), resume=True).write(file, (np.arange(3.0),))
    ((found,),) = Workers(1, Store(tmp_path, FitCodec(), resume=True)).run(time.sleep, [(0.0,)])
    np.testing.assert_array_equal(found, np.arange(3.0))


def test_only_what_takes_time_is_kept(tmp_path):
    assert Workers(1, Store(tmp_path, FitCodec())).run(operator.mul, [(2, 3)]) == [6]
    assert not list(tmp_path.iterdir())


def test_processes_that_do_not_hear_are_killed_and_gone_when_the_interruption_is_told():
    def interrupt(number, answer):
        raise KeyboardInterrupt

    with Workers(2).open() as crew:
        # Like a process that is still starting: SIGTERM waits until it is ready.
        crew.run(signal.pthread_sigmask, [(signal.SIG_BLOCK, [signal.SIGTERM])] * 8)
        with pytest.raises(KeyboardInterrupt):
            crew.run(time.sleep, [(0.0,), (100.0,), (100.0,), (100.0,)], interrupt)
        crew.stop()
    assert none_left()


def test_processes_end_with_the_first_one_when_that_is_killed(tmp_path):
    script = (
        "import os, time\n"
        "from bushcli.runtime.workers import Workers\n"
        "if __name__ == '__main__':\n"
        "    with Workers(2).open() as crew:\n"
        "        print(*crew.run(os.getpid, [()] * 8), flush=True)\n"
        "        crew.run(time.sleep, [(100.0,)] * 4)\n"
    )
    file = tmp_path / "main.py"
    file.write_text(script)
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    with subprocess.Popen(
        [sys.executable, str(file)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment
    ) as process:
        assert process.stdout is not None
        workers = {int(pid) for pid in process.stdout.readline().split()}
        process.kill()
        # The workers' inherited end of the pipe is closed when they have ended.
        process.communicate(timeout=60)
    assert workers
    end = time.monotonic() + 20.0
    while any(map(lives, workers)) and time.monotonic() < end:
        time.sleep(0.05)
    assert not any(map(lives, workers))


@pytest.mark.parametrize("seed", ["1", "2"])
def test_a_question_has_the_same_name_in_every_process(case, tmp_path, seed):
    script = (
        "import sys\n"
        "from pathlib import Path\n"
        "from bushcli.case import load_case\n"
        "from bushcli.runtime.store import Store\n"
        "case = load_case(Path(sys.argv[1]))\n"
        "print(Store(Path(sys.argv[2]), None).file('mul', (case, {'a', 'b', 'c', 'd'})).name)\n"
    )
    # The order of a set depends on the seed of the hash, and the geometry holds a set.
    environment = os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": str(Path(__file__).parents[2])}
    arguments = [sys.executable, "-c", script, str(case.path), str(tmp_path / "out")]
    said = subprocess.run(arguments, env=environment, capture_output=True, text=True, check=True).stdout
    assert said.strip() == name(tmp_path / "out", case, {"a", "b", "c", "d"})


def test_equal_questions_have_one_name_whether_their_parts_are_one_object_or_two(tmp_path):
    # No literals, because equal literals would be the same object.
    one, two = "".join(["ax", "ial"]), "".join(["ax", "ial"])
    assert one is not two
    assert name(tmp_path, (one, one)) == name(tmp_path, (one, two))


def test_a_recording_that_was_changed_is_another_question(case, tmp_path):
    folder = tmp_path / "out"
    before = name(folder, case)
    assert name(folder, replace(case, title="another")) != before
    file = case.recordings[0].file
    file.write_text(file.read_text() + "6,6.1\n")
    assert name(folder, case) != before


@pytest.mark.parametrize("suffix", [".dxf", ".step"])
def test_a_part_that_was_changed_makes_saved_fits_another_question(case, tmp_path, suffix):
    part, shape = tmp_path / f"part{suffix}", "section" if suffix == ".dxf" else "cad"
    if suffix == ".dxf":
        drawing = ezdxf.new(units=4)
        for layer, ends in {"inner": [(10, -20), (10, 20)], "outer": [(20, 20), (20, -20)]}.items():
            drawing.modelspace().add_line(*ends, dxfattribs={"layer": layer})
            drawing.modelspace().add_line(ends[1], (30 - ends[1][0], ends[1][1]))
        drawing.saveas(part)
    else:
        make("plain", tmp_path).rename(part)
    case.path.write_text(
        f'[geometry]\nshape = "{shape}"\nfile = "{part.name}"\n' + CASE[CASE.index("[material]") :]
    )
    case, folder = load_case(case.path), tmp_path / "out"
    fit, evaluations = name(folder, case), Task(case, "yeoh").identity()
    assert (name(folder, load_case(case.path)), Task(case, "yeoh").identity()) == (fit, evaluations)
    text = part.read_text()
    part.write_text(f"999\nrevision B\n{text}" if suffix == ".dxf" else f"{text}/* revision B */\n")
    changed = load_case(case.path)
    assert name(folder, changed) != fit
    assert digest(Task(changed, "yeoh").identity()) != digest(evaluations)


def test_a_folder_that_cannot_be_made_is_wrong_input(tmp_path):
    (tmp_path / "history").write_text("a file")
    with pytest.raises(InputError, match="history: cannot be written: File exists"):
        Store(tmp_path / "history", FitCodec())


def test_a_signal_that_comes_while_processes_are_started_is_heard_when_they_are():
    whole = []

    def start():
        with _deaf():
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.01)
            whole.append(True)

    # A process that was started in the background ignores SIGINT.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            start()
    finally:
        signal.signal(signal.SIGINT, before)
    assert whole


def test_signals_of_the_first_process_are_heard_again_after_others_were_started():
    with Workers(2).open() as crew:
        crew.run(operator.mul, [(1, 2)])
        assert not signal.pthread_sigmask(signal.SIG_BLOCK, []) & {signal.SIGINT, signal.SIGTERM}
