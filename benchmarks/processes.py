"""Whole processes: bushcli's commands as a user runs them, beside a process that only loads the libraries."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks import install
from benchmarks.compare import HERE, MESHES
from benchmarks.direct import COMMAND, whole_process
from benchmarks.measure import Result, Subject, side_by_side, table

STACK = "from mpi4py import MPI; import dolfinx.fem.petsc, gmsh"
BATCH = Path(__file__).resolve().parents[1] / "examples" / "batch" / "case.toml"
# Targets: seconds on quiet cores, or multiples of the process that only loads the libraries.
WANTED = {"direct, axial": "1.45 x", "direct, radial": "1.9 x", "check": "0.35 s"}


def processes(runs: int) -> Iterator[str]:
    """Seconds of each process, also as a multiple of the process that only loads the libraries."""
    with tempfile.TemporaryDirectory() as folder:
        results = side_by_side(list(_subjects(Path(folder))), runs)
    rows = []
    for name, result in results.items():
        if isinstance(result, str):
            raise SystemExit(result)
        stack = results["the stack alone"]
        assert isinstance(stack, Result)
        rows.append([name, f"{result.wall:.2f}", f"{result.wall / stack.wall:.2f}", WANTED.get(name, "")])
    yield "Whole processes\n\n" + table(["process", "seconds", "x the stack", "wanted"], rows) + "\n"


def _subjects(folder: Path) -> Iterator[Subject]:
    yield Subject("the stack alone", [sys.executable, "-c", STACK])
    for name, arguments in {
        "--help": ["--help"],
        "list effects": ["list", "effects"],
        "check": ["check", str(BATCH)],
    }.items():
        yield Subject(name, [sys.executable, "-c", COMMAND, *arguments])
    for subject in whole_process(folder):
        yield Subject(f"direct, {subject.name}", [*subject.command, "--json"])
    try:
        python = install.interpreter("ngsolve")
    except RuntimeError as missing:
        print(f"left out: {missing}", file=sys.stderr)
        return
    for mode in ("axial", "radial"):
        script = str(HERE / "peers" / "ngsolve_bushing.py")
        mesh = MESHES[mode]["ngsolve"][0]
        yield Subject(f"NGSolve, {mode} {mesh}", [str(python), script, mode, mesh])
