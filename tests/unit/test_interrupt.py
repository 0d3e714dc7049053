"""An interruption is recognised however it comes, and leaves no kernel that others would wait for."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from types import ModuleType

import pytest

from bushcli.runtime.interrupt import SAME, abandon_compilation, is_interrupt, listen


@pytest.fixture
def listening():
    """Listen for signals by a clock that stands still unless it is set."""
    before = {one: signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)}
    now = [100.0]
    listen(lambda: now[0])
    yield now
    for one, handler in before.items():
        signal.signal(one, handler)


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_signals_that_come_together_are_one_interruption(listening, sent):
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), sent)
    # What passes Ctrl-C on may send another signal.
    os.kill(os.getpid(), signal.SIGTERM)
    listening[0] += 1.1 * SAME
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), sent)


def test_an_interruption_in_a_callback_of_petsc_is_one():
    from petsc4py import PETSc

    def interrupt(*_):
        raise KeyboardInterrupt

    snes = PETSc.SNES().create(PETSc.COMM_SELF)
    x = PETSc.Vec().createSeq(1)
    snes.setFunction(interrupt, x.duplicate())
    snes.setUseMF(True)
    # As Newton's method of a simulation calls it; the exception may come out as either.
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
    # Another process compiles that one.
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
