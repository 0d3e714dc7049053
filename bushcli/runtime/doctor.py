"""Examination of the installation: versions, BLAS, MPI, compiler and compiled forms."""

from __future__ import annotations

import importlib
import importlib.metadata
import os
import platform
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from bushcli.errors import count_of
from bushcli.runtime.condition import Condition
from bushcli.runtime.dolfinx_version import untried_dolfinx
from cases.jit import cache_directory, damaged_kernels

#: Modules that must be importable, with their purpose.
MODULES = {
    "dolfinx": "finite elements",
    "petsc4py": "nonlinear and linear solvers",
    "gmsh": "meshes",
    "mpi4py": "parallel runs",
    "numpy": "arrays",
    "scipy": "identification and statistics",
    "matplotlib": "plots",
}
_SET_UP = "run `make setup` in the checkout, or create the conda environment of environment.yml"


@dataclass(frozen=True)
class Examination:
    """Result of an examination.

    Attributes
    ----------
    facts : mapping of str to str
        Name -> finding, in the order in which to show them.
    problems : tuple of Condition
        Defects that stop or slow down the program, each with its remedy.
    """

    facts: Mapping[str, str]
    problems: tuple[Condition, ...]


def examine() -> Examination:
    """Examine the environment of this process."""
    facts = {"python": f"{platform.python_version()} ({sys.executable})", "system": platform.platform()}
    problems: list[Condition] = []
    modules: dict[str, ModuleType] = {}
    for name, purpose in MODULES.items():
        try:
            modules[name] = importlib.import_module(name)
            facts[name] = _version(modules[name])
        except (ImportError, OSError) as error:  # OSError: a shared library of it is missing
            facts[name] = "missing"
            message = f"{name} ({purpose}) cannot be imported: {error}"
            problems.append(Condition(f"no_{name}", message, _SET_UP))
    problems += untried_dolfinx(_version(modules["dolfinx"])) if "dolfinx" in modules else ()
    for part in (_blas(modules), _mpi(modules), _compiler(), _cache(), _threads()):
        facts |= part.facts
        problems += part.problems
    return Examination(facts, tuple(problems))


def _version(module: ModuleType) -> str:
    version = getattr(module, "__version__", None)
    return str(version) if version else importlib.metadata.version(module.__name__)


def blas_among(libraries: Iterable[str]) -> str:
    """Name the BLAS that PETSc works with, given the paths of the loaded shared libraries.

    NumPy and SciPy from PyPI carry a BLAS of their own, which the factorisations do not use.
    """
    shared = [p for p in libraries if "numpy" not in p and "scipy" not in p]
    kinds = {
        "OpenBLAS": ("openblas",),
        "MKL": ("mkl_",),
        "BLIS": ("blis",),
        "ATLAS": ("atlas",),
        # Debian has the reference BLAS in a folder of the first name, conda-forge in files of the second.
        "reference": ("/blas/libblas.so", "librefblas", "/libcblas.so", "/libblas.so"),
    }
    return next(
        (kind for kind, patterns in kinds.items() if any(m in p for m in patterns for p in shared)), ""
    )


def _blas(modules: Mapping[str, ModuleType]) -> Examination:
    if "petsc4py" not in modules:
        return Examination({}, ())
    importlib.import_module("petsc4py.PETSc")
    try:
        lines = Path("/proc/self/maps").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return Examination({"BLAS": "unknown (no /proc)"}, ())
    kind = blas_among({line.split(maxsplit=5)[-1] for line in lines if ".so" in line})
    if kind != "reference":
        return Examination({"BLAS": kind or "not recognised"}, ())
    problem = Condition(
        "reference_blas",
        "the reference BLAS is loaded, with which a factorisation takes about four times as long",
        "install OpenBLAS: apt-get install libopenblas0-pthread, or conda install 'libblas=*=*openblas'",
    )
    return Examination({"BLAS": "reference"}, (problem,))


def _mpi(modules: Mapping[str, ModuleType]) -> Examination:
    if "mpi4py" not in modules:
        return Examination({}, ())
    mpi = importlib.import_module("mpi4py.MPI")
    library = mpi.Get_library_version().strip("\0").splitlines()[0].split(",")[0]
    size = mpi.COMM_WORLD.size
    facts = {"MPI": f"{library}, {count_of(size, 'rank')}"}
    started = max(int(os.environ.get(name, "1")) for name in ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE"))
    if started == size:
        return Examination(facts, ())
    problem = Condition(
        "foreign_mpirun",
        f"mpirun started {started} ranks, and each of them runs alone: it belongs to another MPI",
        "use the mpirun of the environment: bushcli-env mpirun -n 2 bushcli ...",
    )
    return Examination(facts, (problem,))


def _compiler() -> Examination:
    """Compile what the form compiler would: a C file that includes Python.h."""
    command = (os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc").split()
    include = sysconfig.get_path("include")
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "probe.c"
        source.write_text('#include "Python.h"\ndouble probe(double x) { return 2.0 * x; }\n')
        arguments = [*command, "-fPIC", "-shared", f"-I{include}", str(source), "-o", f"{source}.so"]
        try:
            run = subprocess.run(arguments, capture_output=True, text=True, errors="replace", check=False)
            message = "" if run.returncode == 0 else (run.stderr.strip().splitlines() or ["no message"])[0]
        except OSError as error:
            message = str(error)
    if not message:
        return Examination({"C compiler": f"{command[0]}, works"}, ())
    problem = Condition(
        "no_compiler",
        f"the C compiler, which every form needs, does not work: {message}",
        "apt-get install gcc libc6-dev python3-dev, or conda install c-compiler",
    )
    return Examination({"C compiler": "does not work"}, (problem,))


def _cache() -> Examination:
    cache = cache_directory()
    files = [p for p in cache.rglob("*") if p.is_file()] if cache.is_dir() else []
    size = sum(p.stat().st_size for p in files)
    forms = sum(1 for p in files if p.suffix == ".so")
    facts = {"form cache": f"{cache}: {forms} compiled forms, {size / 1e6:.1f} MB"}
    existing = next(p for p in (cache, *cache.parents) if p.exists())
    writable = existing.is_dir() and os.access(existing, os.W_OK)
    problems = []
    if broken := damaged_kernels(cache):
        names = ", ".join(file.name for file in broken[:3])
        message = f"{len(broken)} compiled forms are truncated or differ from their checksum, such as {names}"
        remedy = "they are not used, and cannot be compiled again in this folder (below)"
        if writable:
            remedy = "nothing to do: they are compiled again when needed; check whether the disk is full or failing"
        problems.append(Condition("damaged_kernels", message, remedy))
    if not writable:
        what = "not writable" if existing.is_dir() else "a file"
        remedy = "make it writable, or choose another folder with BUSHCLI_CACHE=/path"
        message = f"compiled forms cannot be saved: {existing} is {what}"
        problems.append(Condition("cache_not_writable", message, remedy))
    return Examination(facts, tuple(problems))


def _threads() -> Examination:
    threads = os.environ.get("OMP_NUM_THREADS", "")
    facts = {"OMP_NUM_THREADS": threads or "not set", "processors": str(os.cpu_count())}
    if threads:
        return Examination(facts, ())
    problem = Condition(
        "threads_not_set",
        "OMP_NUM_THREADS is not set: every factorisation of small matrices starts a thread per processor",
        "set OMP_NUM_THREADS=1 (the launchers that `make install` writes do it)",
    )
    return Examination(facts, (problem,))
