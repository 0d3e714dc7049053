"""A run that was killed or interrupted is resumed and ends with the same answer to the bit."""

from __future__ import annotations

import ctypes
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from bushcli.errors import InputError
from bushcli.inverse import Task, identify
from tests.processes import lives

# Kills itself without warning when the given evaluation is done, like a power failure.
KILLED = """
import os, signal, sys
from pathlib import Path
from bushcli.case import load_case
from bushcli.inverse import Task, identify
def die(found):
    if found.number == int(sys.argv[3]):
        os.kill(os.getpid(), signal.SIGKILL)
identify(Task(load_case(sys.argv[1]), "yeoh"), journal=Path(sys.argv[2]), progress=die)
"""


def values(fit):
    return {name: estimate.value for name, estimate in fit.parameters.items()}


@pytest.mark.slow
@pytest.mark.parametrize("after", [1, 3])
def test_resumes_after_a_kill_with_the_same_answer(experiment, tmp_path, after):
    case, journal = experiment("axial"), tmp_path / "history"
    whole = identify(Task(case, "yeoh"))
    command = [sys.executable, "-c", KILLED, str(case.path), str(journal), str(after)]
    assert subprocess.run(command, check=False, timeout=120).returncode == -signal.SIGKILL
    assert len(list(journal.glob("*.npz"))) == after
    solved = []
    resumed = identify(Task(case, "yeoh"), journal=journal, resume=True, progress=solved.append)
    # Exactly equal: the saved answers are those that would have been computed.
    assert values(resumed) == values(whole)
    assert resumed.sweeps == whole.sweeps
    assert [e.cost for e in resumed.evaluations] == [e.cost for e in whole.evaluations]


def test_a_finished_run_is_resumed_without_solving_anything(experiment, tmp_path, monkeypatch):
    case, journal = experiment("axial"), tmp_path / "history"
    whole = identify(Task(case, "yeoh"), journal=journal)
    monkeypatch.delattr("bushcli.inverse.channel.SweptChannel.solve")
    assert values(identify(Task(case, "yeoh"), journal=journal, resume=True)) == values(whole)


def test_history_of_another_case_is_refused(experiment, tmp_path):
    case, journal = experiment("axial"), tmp_path / "history"
    identify(Task(case, "yeoh"), journal=journal)
    other = replace(case, geometry=case.geometry.model_copy(update={"length": 35.0}))
    with pytest.raises(InputError, match="another case, law or option"):
        identify(Task(other, "yeoh"), journal=journal, resume=True)
    # A recording that was changed in between makes it another case, too.
    file = case.recordings[0].file
    file.write_text(file.read_text(encoding="utf-8") + "6.01,500\n", encoding="utf-8")
    with pytest.raises(InputError, match="another case, law or option"):
        identify(Task(case, "yeoh"), journal=journal, resume=True)


def test_an_interrupted_search_gives_its_best(experiment):
    def interrupt(found):
        if found.number == 3:
            raise KeyboardInterrupt

    fit = identify(Task(experiment("axial"), "yeoh"), progress=interrupt)
    assert not fit.converged
    assert fit.conditions[0].name == "interrupted"
    assert fit.cost == min(e.cost for e in fit.evaluations)


def test_an_interrupted_profile_leaves_the_minimum_found(experiment):
    def interrupt(found):
        if found.stage == "profile":
            raise KeyboardInterrupt

    case = experiment("axial", noise=1.0, seed=3)
    fit = identify(Task(case, "yeoh"), progress=interrupt)
    # C30 is poorly determined at this noise, so that there are profiles to interrupt.
    assert fit.profile_sweeps == 1
    assert fit.converged
    assert fit.conditions[0].name == "interrupted"
    assert "profiles" in fit.conditions[0].message


def test_faulty_data_get_no_profiles(experiment):
    """The same recording in mN, read in N: C30 is as poorly determined, but an interval of it would mean nothing."""
    case = experiment("axial", noise=1.0, seed=3)
    file = case.recordings[0].file
    head, *rows = file.read_text(encoding="utf-8").splitlines()
    pairs = [row.split(",") for row in rows]
    file.write_text(
        "\n".join([head, *(f"{q},{1e3 * float(force)!r}" for q, force in pairs)]), encoding="utf-8"
    )
    fit = identify(Task(case, "yeoh"))
    assert fit.conditions[0].name == "faulty_data"
    assert fit.profile_sweeps == 0


def test_an_interruption_within_another_error_gives_the_best_too(experiment):
    """A signal during a callback may come out as an error of the library that called back."""

    def interrupt(found):
        if found.number == 3:
            raise ctypes.ArgumentError("argument 1: KeyboardInterrupt: ")

    fit = identify(Task(experiment("axial"), "yeoh"), progress=interrupt)
    assert fit.conditions[0].name == "interrupted"
    assert fit.cost == min(e.cost for e in fit.evaluations)


def ended_by(sent: signal.Signals, case: Path, out: Path, saved: str, *options: str) -> list[str]:
    """Send a signal to `bushcli inverse` after two evaluations in the files `saved`; return its child processes then.

    The other evaluations take more than a second, and the signal comes within hundredths. The first may have to wait
    for kernels that other tests are compiling.
    """
    command = [sys.executable, "-m", "bushcli.cli", "inverse", str(case), "-o", str(out), *options]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        end = time.monotonic() + 300
        while time.monotonic() < end and process.poll() is None and len(list(out.glob(saved))) < 2:
            time.sleep(0.02)
        assert process.poll() is None, process.stderr.read()
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        process.send_signal(sent)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert b"Traceback" not in said
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert "interrupted" in json.dumps(result["problems"])
    return children


@pytest.mark.slow
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_a_signal_ends_the_command_with_the_best_so_far(experiment, tmp_path, sent):
    out = tmp_path / "out"
    ended_by(sent, experiment("axial", "radial").path, out, "history-yeoh/*.npz")
    assert list(out.glob("history-yeoh/*.npz"))


@pytest.mark.slow
def test_ctrl_c_ends_processes_that_refine_further_starts(experiment, tmp_path):
    """A signal to the command alone: its processes are told to end, and the best of all starts is written."""
    case, options = experiment("axial", "radial").path, ("--starts", "4", "--workers", "2")
    children = ended_by(signal.SIGINT, case, tmp_path / "out", "history-yeoh-start-*/*.npz", *options)
    assert len(children) >= 2
    assert [one for one in children if lives(one)] == []
