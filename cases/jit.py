"""Compiling generated kernels, and the folder in which they are saved."""

from __future__ import annotations

import fcntl
import hashlib
import importlib.metadata
import os
import platform
import sys
import sysconfig
import time
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from importlib import util
from pathlib import Path
from typing import Any

from cases.checksum import READY, is_sound, is_whole, note_checksum, remove_damaged, watch_compiler

# -O3 with vectorised reductions assembles a Q2-Q1 tangent 2.4 times faster than the default. Of -ffast-math only
# the parts that allow reordering are taken: NaN must stay NaN, for the march recognises an inverted element by it.
FLAGS = [
    "-O3",
    "-march=native",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fno-signed-zeros",
    "-fassociative-math",
    "-fno-semantic-interposition",
]

# For what is evaluated at few points or seldom: energies of surfaces, the place of the stress-free body, fields of the
# results. The compiler takes 0.2 to 1.6 s for each form of a snubber in three dimensions, and 6 to 15 s with the flags
# above; its march takes 5 % longer at most.
LIGHT = ["-O1", *FLAGS[1:]]

# Seconds after which a compilation without a result counts as killed; the longest take two minutes.
ABANDONED = 900.0


def _processor() -> str:
    """Fingerprint of the instruction set: a cache made with -march=native must not move to another processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        text = next((line for line in lines if line.startswith(("flags", "Features"))), "")
    except OSError:
        text = platform.processor()
    return hashlib.sha256(f"{platform.machine()} {text}".encode()).hexdigest()[:12]


def _stack() -> str:
    """Fingerprint of Python and form compiler: a kernel that one version compiled cannot be loaded by another."""
    try:
        compiler = importlib.metadata.version("fenics-ffcx")
    except importlib.metadata.PackageNotFoundError:
        compiler = "unknown"
    return f"{sys.implementation.cache_tag}-ffcx-{compiler}"


@cache
def _machine() -> str:
    return f"{_processor()}-{_stack()}"


def cache_directory() -> Path:
    """Return the folder of compiled kernels: $BUSHCLI_CACHE, or the user's cache directory.

    One folder for each processor, Python and form compiler.
    """
    root = os.environ.get("BUSHCLI_CACHE")
    base = Path(root) if root else Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "bushcli"
    return base / "kernels" / _machine()


def _enter(folder: Path) -> None:
    """Lock the folder until this process ends, and remove the remains of interrupted compilations.

    A compilation that was killed leaves a source, and other processes would wait in vain for it to be compiled. While
    another process uses the folder it may be compiling, so that only old sources count as abandoned.

    Truncated libraries are removed too: loading a file that a full disk or a power cut has truncated ends the process
    with a bus error. Their contents are checked one by one when they are needed (`cases.checksum.watch_compiler`).
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Never closed, which is what keeps it locked.
        in_use = os.open(folder / "in-use.lock", os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(in_use, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            # Waits while another process, which has just started, removes remains.
            fcntl.flock(in_use, fcntl.LOCK_SH)
            _clear_remains(folder, ABANDONED)
        else:
            _clear_remains(folder, 0.0)
            fcntl.flock(in_use, fcntl.LOCK_SH)
    except OSError:
        # A file system without locks, or a read-only folder.
        _clear_remains(folder, ABANDONED)


def _clear_remains(folder: Path, oldest: float) -> None:
    """Remove sources that are at least `oldest` seconds old and not compiled, and modules that are damaged."""
    for source in folder.glob("*.c"):
        finished = source.with_suffix(".c.cached").exists() or source.with_suffix(".c.failed").exists()
        try:
            if not finished and time.time() - source.stat().st_mtime >= oldest:
                source.unlink()
        except OSError:
            continue  # another process was faster
    for ready_file in folder.glob(f"*{READY}"):
        with suppress(OSError):
            remove_damaged(folder, ready_file.name.removesuffix(READY), is_whole)


@cache
def _locked_folder() -> Path:
    """Return the folder of the kernels, locked and cleared of remains."""
    folder = cache_directory()
    _enter(folder)
    watch_compiler(folder)
    return folder


def options(*, light: bool = False) -> dict[str, Any]:
    """Keyword `jit_options` of DOLFINx forms and expressions.

    Parameters
    ----------
    light : bool
        Compile fast (`LIGHT`) what is evaluated at few points or seldom.
    """
    # A process waits for another one that compiles the same kernel; the default of 10 s is less than some take.
    return {
        "cffi_extra_compile_args": LIGHT if light else FLAGS,
        "cffi_libraries": ["m"],
        "cache_dir": _locked_folder(),
        "timeout": 300,
    }


# -- compilation -----------------------------------------------------------------------------------------------------


def compiled_expression(expression: Any, points: Any, comm: Any) -> tuple[Any, Any]:
    """Compile a UFL expression at reference points without a DOLFINx expression around it: object and cffi module.

    Parameters
    ----------
    expression : Any
        UFL expression.
    points : Any
        Reference coordinates in the cell, shape (points, dimension).
    comm : Any
        Ranks that take part.
    """
    from dolfinx import jit

    compiled, module, _ = jit.ffcx_jit(comm, (expression, points), jit_options=options())
    return compiled, module


def compiled_source(name: str, folder: Path, sources: Sequence[str], declarations: str) -> Any:
    """Compile C of our own as a cffi module, or load it from the kernels' folder.

    Parameters
    ----------
    name
        Name of the module.
    folder
        Folder of the sources.
    sources
        The C files, which become one, and the headers that they include; names relative to the folder.
    declarations
        Declarations of what Python may call, in cffi's syntax.
    """
    from _cffi_backend import __version__ as cffi_version  # importing cffi itself would load a parser of C

    text = "\n".join((folder / source).read_text() for source in sources)
    digest = hashlib.sha256(f"{text}{declarations}{FLAGS}{cffi_version}".encode()).hexdigest()[:16]
    module = f"bushcli_{name}_{digest}"
    file = cache_directory() / f"{module}{sysconfig.get_config_var('EXT_SUFFIX')}"
    if not is_sound(file):
        import tempfile

        import cffi

        file = _locked_folder() / file.name
        builder = cffi.FFI()
        builder.cdef(declarations)
        code = "".join(f'#include "{source}"\n' for source in sources if source.endswith(".c"))
        options = {
            "extra_compile_args": ["-std=c17", *FLAGS],
            "include_dirs": [str(folder)],
            "libraries": ["m"],
        }
        builder.set_source(module, code, **options)
        # Built beside its final place and moved there: another process sees all of it or nothing.
        with tempfile.TemporaryDirectory(dir=file.parent) as build_folder:
            built_file = Path(builder.compile(tmpdir=build_folder))
            note_checksum(built_file, file)
            built_file.replace(file)
    return load(file)


def load(library: Path) -> Any:
    """Load a compiled cffi module."""
    spec = util.spec_from_file_location(library.name.partition(".")[0], library)
    if spec is None or spec.loader is None:
        raise ImportError(f"{library} is not a compiled module")
    module = util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def damaged_kernels(folder: Path | None = None) -> list[Path]:
    """Return the kernels that are truncated or differ from their checksum; by default in the present folder."""
    libraries = sorted((folder or cache_directory()).glob("*.so"))
    return [library for library in libraries if not is_sound(library)]
