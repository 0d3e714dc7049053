"""What a killed compilation leaves in the kernels' folder does not stop later runs."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

from cases import jit

USER = """
import sys, time
from pathlib import Path
from cases import jit
jit._enter(Path(sys.argv[1]))
print("in", flush=True)
time.sleep(60)
"""


@pytest.fixture
def left(tmp_path, monkeypatch):
    """A source without a kernel, and one with it; locks are given back after the test."""
    opened = []

    def kept(*given):
        opened.append(os.open(*given))
        return opened[-1]

    monkeypatch.setattr(jit, "os", SimpleNamespace(**{**vars(os), "open": kept}))
    (tmp_path / "killed.c").write_text("")
    (tmp_path / "whole.c").write_text("")
    (tmp_path / "whole.c.cached").write_text("")
    yield tmp_path
    for one in opened:
        os.close(one)


@contextmanager
def another(folder: Path) -> Iterator[subprocess.Popen]:
    """Run another process that uses the folder, until it is killed."""
    root = Path(jit.__file__).parents[1]
    with subprocess.Popen(
        [sys.executable, "-c", USER, str(folder)], cwd=root, stdout=subprocess.PIPE, text=True
    ) as other:
        try:
            assert other.stdout.readline() == "in\n"
            yield other
        finally:
            other.kill()


def sources(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob("*.c"))


def test_the_first_process_removes_it_at_once(left):
    jit._enter(left)
    assert sources(left) == ["whole.c"]


def test_beside_another_process_it_may_be_under_way(left):
    (left / "killed.c").unlink()
    with another(left):
        (left / "fresh.c").write_text("")
        (left / "old.c").write_text("")
        long_ago = time.time() - jit.ABANDONED - 1
        os.utime(left / "old.c", (long_ago, long_ago))
        jit._enter(left)
        assert sources(left) == ["fresh.c", "whole.c"]


def test_a_killed_process_no_longer_uses_the_folder(left):
    with another(left):
        (left / "killed.c").write_text("")
    jit._enter(left)
    assert sources(left) == ["whole.c"]


def test_a_file_system_without_locks_will_do(left, monkeypatch):
    def refuse(*_):
        raise OSError("no locks here")

    monkeypatch.setattr(jit.fcntl, "flock", refuse)
    jit._enter(left)
    assert sources(left) == ["killed.c", "whole.c"]
