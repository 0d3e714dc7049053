"""An interruption is recognised in every form, and leaves no kernel for which other processes would wait."""

from __future__ import annotations

import ctypes
import importlib
import os
import signal
import subprocess
import sys
import time
from types import ModuleType

import pytest

from bushcli.runtime.interrupt import (
    SAME,
    abandon_compilation,
    hold,
    let_go,
    listen,
    meet,
    ranks_started,
    unwrapped_interrupts,
)
from cases.interrupt import is_interrupt

STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@pytest.fixture
def listening():
    """Listen for signals with a clock that stands still unless it is set."""
    before = {one: signal.getsignal(one) for one in STOPS}
    hook = sys.unraisablehook
    now = [100.0]
    # Tests that were started with nohup ignore it.
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    listen(lambda: now[0])
    yield now
    for one, handler in before.items():
        signal.signal(one, handler)
    sys.unraisablehook = hook


def test_a_signal_where_an_object_is_destroyed_is_sent_again(listening):
    """Python drops an exception there: a signal at such a moment was lost, and the command went on."""

    class Thing:
        def __del__(self):
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.0)

    def work():
        Thing()
        time.sleep(5.0)

    with pytest.raises(KeyboardInterrupt):
        work()


@pytest.mark.parametrize("sent", STOPS, ids=lambda s: s.name)
def test_signals_that_come_together_are_one_interruption(listening, sent):
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), sent)
    # A launcher that passes Ctrl-C on may send a second signal.
    os.kill(os.getpid(), signal.SIGTERM)
    listening[0] += 1.1 * SAME
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), sent)


@pytest.mark.slow
def test_a_signal_waits_until_native_code_is_loaded(listening, tmp_path, monkeypatch):
    """An exception in the middle of loading DOLFINx would end the process with a dump of its stack."""
    (tmp_path / "loads_slowly.py").write_text(
        "import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(0.1)\nCOMPLETE = True\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("bushcli.runtime.interrupt._NATIVE", ("loads_slowly",))

    def load() -> None:
        importlib.import_module("loads_slowly")
        time.sleep(5.0)

    with pytest.raises(KeyboardInterrupt):
        load()
    assert sys.modules.pop("loads_slowly").COMPLETE


def test_while_the_command_loads_its_modules_ctrl_c_ends_it_without_a_traceback():
    code = "import os, signal, sys, time; sys.argv = ['{}']; import bushcli; os.kill(os.getpid(), 2); time.sleep(5)"
    command, library = (
        subprocess.run([sys.executable, "-c", code.format(name)], capture_output=True, text=True, check=False)
        for name in ("/usr/bin/bushcli", "/usr/bin/other")
    )
    assert (command.returncode, command.stderr) == (-signal.SIGINT, "")
    # Whoever imports bushcli keeps the usual exception.
    assert "KeyboardInterrupt" in library.stderr


def test_under_nohup_a_closed_terminal_does_not_interrupt():
    before = {one: signal.getsignal(one) for one in STOPS}
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        listen()
        os.kill(os.getpid(), signal.SIGHUP)
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)


HEARD = """
import signal, time
from bushcli.runtime.interrupt import SAME, listen
listen()
from mpi4py import MPI
from petsc4py import PETSc
for sent in (signal.SIGHUP, signal.SIGTERM, signal.SIGINT):
    try:
        signal.raise_signal(sent)
    except KeyboardInterrupt:
        print(sent.name)
    time.sleep(SAME)
"""


def test_signals_are_heard_when_the_solver_is_loaded():
    """PETSc would abort on SIGHUP, and the transport of Open MPI swallow it."""
    done = subprocess.run(
        [sys.executable, "-c", HEARD],
        capture_output=True,
        text=True,
        check=True,
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),
    )
    assert done.stdout.split() == ["SIGHUP", "SIGTERM", "SIGINT"]


def test_a_signal_is_held_back_while_a_result_is_written(listening):
    hold()
    os.kill(os.getpid(), signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt):
        let_go()
    let_go()
    # A second one does not wait.
    hold()
    listening[0] += 2 * SAME
    os.kill(os.getpid(), signal.SIGINT)
    listening[0] += 2 * SAME
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)


class Ranks:
    """A communicator of several ranks, of which others have received a number of signals."""

    def __init__(self, size, others=0):
        self.size, self.others = size, others

    def allreduce(self, own):
        return own + self.others


@pytest.fixture
def together():
    """Listen for signals as one of several cooperating ranks."""
    before = {one: signal.getsignal(one) for one in STOPS}
    now = [100.0]
    listen(lambda: now[0], together=True)
    yield now
    listen(together=False)
    for one, handler in before.items():
        signal.signal(one, handler)


def test_ranks_raise_a_signal_where_they_meet_and_once(together):
    meet(Ranks(2))
    os.kill(os.getpid(), signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt):
        meet(Ranks(2))
    meet(Ranks(2))


def test_a_rank_that_works_alone_raises_its_own_signal(together):
    meet(Ranks(1))
    os.kill(os.getpid(), signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt):
        meet(Ranks(1))
    meet(Ranks(1))


def test_a_signal_of_another_rank_is_raised_too(together):
    with pytest.raises(KeyboardInterrupt):
        meet(Ranks(2, others=1))


def test_a_second_signal_is_raised_at_once(together):
    os.kill(os.getpid(), signal.SIGINT)
    together[0] += 1.1 * SAME
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.parametrize(
    ("environment", "ranks"),
    [({}, 1), ({"OMPI_COMM_WORLD_SIZE": "3"}, 3), ({"PMI_SIZE": "2"}, 2), ({"PMI_SIZE": ""}, 1)],
)
def test_ranks_are_known_without_mpi(monkeypatch, environment, ranks):
    for name in ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert ranks_started() == ranks


def test_an_interruption_in_a_callback_of_petsc_is_one():
    from petsc4py import PETSc

    def interrupt(*_):
        raise KeyboardInterrupt

    snes = PETSc.SNES().create(PETSc.COMM_SELF)
    x = PETSc.Vec().createSeq(1)
    snes.setFunction(interrupt, x.duplicate())
    snes.setUseMF(True)
    # Called as by Newton's method of a simulation; the exception may appear as either.
    with pytest.raises((PETSc.Error, KeyboardInterrupt)) as raised:
        snes.solve(None, x)
    assert is_interrupt(raised.value)


def test_an_interruption_in_a_conversion_of_ctypes_is_one():
    class Interrupted:
        @property
        def _as_parameter_(self):
            raise KeyboardInterrupt

    with pytest.raises((ctypes.ArgumentError, KeyboardInterrupt)) as raised:
        ctypes.pythonapi.Py_IncRef(Interrupted())
    assert is_interrupt(raised.value)


def test_an_interruption_in_another_form_is_raised_as_such():
    with pytest.raises(KeyboardInterrupt), unwrapped_interrupts():
        raise ctypes.ArgumentError("argument 1: KeyboardInterrupt: ")
    with pytest.raises(ValueError, match="another"), unwrapped_interrupts():
        raise ValueError("another")


def test_other_errors_are_none():
    other = RuntimeError("one")
    other.__cause__ = ValueError("another")
    assert not is_interrupt(other)
    assert not is_interrupt(None)


COMPILING = """
def compile_forms(forms, cache_dir, inside):
    module_name = "libffcx_forms_1"
    inside()
def get_cached_module(inside):
    inside()
"""


@pytest.fixture
def compiler():
    """A module that looks like the one that compiles kernels."""
    module = ModuleType("ffcx.codegeneration.jit")
    exec(COMPILING, module.__dict__)
    return module


def test_the_source_of_an_unfinished_kernel_is_removed(compiler, tmp_path):
    mine, other = tmp_path / "libffcx_forms_1.c", tmp_path / "libffcx_forms_2.c"
    for file in (mine, other):
        file.touch()
    compiler.compile_forms([], tmp_path, lambda: abandon_compilation(sys._getframe()))
    assert not mine.exists()
    # Another process is compiling this kernel.
    assert other.exists()


def test_the_source_of_a_finished_kernel_and_of_anothers_is_kept(compiler, tmp_path):
    source = tmp_path / "libffcx_forms_1.c"
    source.touch()
    compiler.compile_forms(
        [], tmp_path, lambda: compiler.get_cached_module(lambda: abandon_compilation(sys._getframe()))
    )
    assert source.exists()
    (tmp_path / "libffcx_forms_1.c.cached").touch()
    compiler.compile_forms([], tmp_path, lambda: abandon_compilation(sys._getframe()))
    assert source.exists()


def test_ffcx_has_the_names_that_are_looked_for():
    from inspect import signature

    from ffcx.codegeneration import jit

    for function in (jit.compile_forms, jit.compile_expressions):
        assert "cache_dir" in signature(function).parameters
        assert "module_name" in function.__code__.co_varnames
    assert jit.get_cached_module.__name__ == "get_cached_module"
