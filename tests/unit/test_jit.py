"""The files that a killed compilation leaves in the kernels' folder do not stop later runs."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import sysconfig
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

from cases import jit
from cases.checksum import READY, checksum, checksum_file, watch_compiler

LIBRARY = sysconfig.get_config_var("EXT_SUFFIX")

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
    """A source without a library, and one with a whole library; locks are released after the test."""
    opened = []

    def kept(*given):
        opened.append(os.open(*given))
        return opened[-1]

    monkeypatch.setattr(jit, "os", SimpleNamespace(**{**vars(os), "open": kept}))
    (tmp_path / "killed.c").write_text("")
    (tmp_path / "whole.c").write_text("")
    (tmp_path / "whole.c.cached").write_text("")
    (tmp_path / f"whole{LIBRARY}").write_bytes(b"\x7fELF".ljust(64, b"\0"))
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


def test_a_truncated_library_is_removed_before_it_can_be_loaded(left):
    os.truncate(left / f"whole{LIBRARY}", 10)
    jit._enter(left)
    assert [file.name for file in left.iterdir()] == ["in-use.lock"]


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


COMPILES = """
import numpy as np, ufl, basix.ufl
from mpi4py import MPI
from cases import jit, kernels
domain = ufl.Mesh(basix.ufl.element("Lagrange", "interval", 1, shape=(1,)))
number = ufl.Coefficient(ufl.FunctionSpace(domain, basix.ufl.element("DG", "interval", 0)))
jit.compiled_expression(ufl.exp(number), np.array([[0.5]]), MPI.COMM_SELF)
kernels.loops()
"""


def compiled(cache: Path) -> list[Path]:
    """Compile or load a kernel of the form compiler and one of our own in another process; return their libraries."""
    done = subprocess.run(
        [sys.executable, "-c", COMPILES],
        cwd=Path(jit.__file__).parents[1],
        env=os.environ | {"BUSHCLI_CACHE": str(cache)},
        check=False,
    )
    assert done.returncode == 0
    return sorted(cache.rglob("*.so"))


@pytest.mark.slow
def test_damaged_kernels_are_compiled_anew(tmp_path):
    """Loading a truncated one would end the process with a bus error; one with other bytes may do anything."""
    whole = compiled(tmp_path)
    assert len(whole) == 2
    folder = whole[0].parent
    assert jit.damaged_kernels(folder) == []
    contents = [library.read_bytes() for library in whole]
    sums = [checksum_file(library).read_text() for library in whole]
    assert sums == [checksum(content) for content in contents]
    for library in whole:
        # Only the first page is left, as after a full disk.
        os.truncate(library, 4096)
    assert jit.damaged_kernels(folder) == whole
    assert compiled(tmp_path) == whole
    assert jit.damaged_kernels(folder) == []
    for library, content in zip(whole, contents, strict=True):
        assert library.stat().st_size == len(content)
        # Zeros in place of the code, and the length as before.
        library.write_bytes(content[:4096] + bytes(len(content) - 8192) + content[-4096:])
        assert jit.is_whole(library)
    assert jit.damaged_kernels(folder) == whole
    assert compiled(tmp_path) == whole
    assert jit.damaged_kernels(folder) == []
    # Kernels of an earlier version have no checksum; they are loaded, and not compiled again.
    times = [library.stat().st_mtime_ns for library in whole]
    for library in whole:
        checksum_file(library).unlink()
    assert jit.damaged_kernels(folder) == []
    assert [library.stat().st_mtime_ns for library in compiled(tmp_path)] == times


def test_a_damaged_kernel_that_cannot_be_replaced_is_not_loaded(tmp_path, monkeypatch):
    """As on a file system that is read-only: the form compiler, which opens the source first, must not go on."""
    for name in ("libffcx_one.c", f"libffcx_one{READY}"):
        (tmp_path / name).write_text("")
    (tmp_path / f"libffcx_one{LIBRARY}").write_bytes(b"half")

    def refused(self, missing_ok=False):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(self))

    watch_compiler(tmp_path)
    monkeypatch.setattr(Path, "unlink", refused)
    with pytest.raises(OSError, match="Read-only file system, and it is damaged") as error:
        (tmp_path / "libffcx_one.c").open("x")
    assert error.value.filename == str(tmp_path / f"libffcx_one{LIBRARY}")


def test_what_is_under_way_is_left_alone(tmp_path):
    """A source without its end mark belongs to a process that is compiling it."""
    (tmp_path / "libffcx_one.c").write_text("")
    (tmp_path / f"libffcx_one{LIBRARY}").write_bytes(b"half")
    jit.remove_damaged(tmp_path, "libffcx_one")
    assert len(list(tmp_path.iterdir())) == 2


def test_forms_that_differ_in_numbers_share_their_code():
    """Otherwise every bushing with a plate of another height would compile forms of its own."""
    import ufl
    from dolfinx import fem, mesh
    from mpi4py import MPI

    from cases.surfaces import without_literals

    square = mesh.create_unit_square(MPI.COMM_SELF, 2, 2)
    x, ds = ufl.SpatialCoordinate(square), ufl.Measure("ds", square)
    forms = [height * ufl.max_value(x[0] - gap, 0) ** 2 * ds for height, gap in ((3.5, 0.25), (0.7, 0.6))]
    assert forms[0].signature() != forms[1].signature()
    found = [without_literals(form, square) for form in forms]
    assert found[0].signature() == found[1].signature()
    for one, other in zip(forms, found, strict=True):
        values = [fem.assemble_scalar(fem.form(form)) for form in (one, other)]
        assert values[0] == pytest.approx(values[1], rel=1e-14)
        assert values[0] > 0.0
