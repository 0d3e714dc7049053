"""bushcli's times: against targets, by part of the program, with finer meshes, with threads and ranks."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.measure import Result, Subject, side_by_side, table
from benchmarks.problem import C10, C20, C30, INNER_RADIUS, KAPPA, LENGTH, OUTER_RADIUS, errors

OWN = str(Path(__file__).resolve().parent / "own.py")
# Mode -> end (mm or degrees) and steps; for the last two modes the reference curves end there.
LOADS = {"axial": (8.0, 20), "radial": (2.1, 10), "torsional": (20.0, 10), "conical": (3.5, 7)}
GROWING = ("tangent", "factorisation", "back-substitution", "residual")
COMMAND = "from bushcli.cli import main; main()"
CASE = f"""
[geometry]
shape = "plain"
inner_radius = {INNER_RADIUS}
outer_radius = {OUTER_RADIUS}
length = {LENGTH}
[material]
law = "yeoh"
bulk_modulus = {KAPPA}
[material.parameters]
C10 = {C10}
C20 = {C20}
C30 = {C30}
"""


def march(mode: str, name: str, *options: str, ranks: int = 1, threads: int = 1) -> Subject:
    """A march to the end of the mode's load in a separate process."""
    stop, steps = LOADS[mode]
    command = [
        sys.executable,
        OWN,
        mode,
        "--stop",
        str(stop),
        "--steps",
        str(steps),
        "--repeat",
        "3",
        *options,
    ]
    if ranks > 1:
        command = ["mpirun", "-n", str(ranks), *command]
    return Subject(name, command, {"OMP_NUM_THREADS": str(threads)})


def largest_error(mode: str, printed) -> str:
    """Largest deviation from the reference at points that both have, percent."""
    deviations = errors(mode, printed["displacement"], printed["force"])
    return f"{max(deviations.values(), key=abs):.2f}" if deviations else ""


def whole_process(folder: Path) -> Iterator[Subject]:
    """Time `bushcli direct` on a case file as a user runs it."""
    for mode in ("axial", "radial"):
        stop, steps = LOADS[mode]
        case = folder / f"{mode}.toml"
        case.write_text(f'{CASE}[[load_cases]]\nmode = "{mode}"\namplitude = {stop}\nsteps = {steps}\n')
        yield Subject(mode, [sys.executable, "-c", COMMAND, "direct", str(case), "--quiet"])


def targets(runs: int) -> Iterator[str]:
    """Times and memory of all modes with the default mesh; the command line as a whole process."""
    with tempfile.TemporaryDirectory() as folder:
        processes = side_by_side(list(whole_process(Path(folder))), runs)
    results = side_by_side([march(mode, mode) for mode in LOADS], runs)
    rows = []
    for mode, result in results.items():
        if isinstance(result, str):
            raise SystemExit(result)
        process = processes.get(mode)
        if isinstance(process, str):
            raise SystemExit(process)
        stop, steps = LOADS[mode]
        rows.append(
            [
                f"{mode}, {steps} steps to {stop:g}",
                str(result.printed["unknowns"]),
                f"{result.solve:.3f}",
                f"{process.wall:.2f}" if process else "",
                f"{result.memory:.0f}",
                largest_error(mode, result.printed),
            ]
        )
    head = [
        "load (mm, degrees)",
        "unknowns",
        "solve, s",
        "`bushcli direct`, s",
        "memory, MB",
        "largest error, %",
    ]
    yield "Default mesh\n\n" + table(head, rows) + "\n"
    yield where_it_goes(results)


def where_it_goes(results) -> str:
    """Milliseconds, and calls, of the parts of a process."""
    modes = list(results)
    rows = []
    for part in ("import", "mesh", "forms"):
        rows.append([part, *(f"{1000 * results[m].printed[part]:.0f}" for m in modes)])
    for part in results[modes[0]].printed["parts"]:
        cells = []
        for mode in modes:
            calls, seconds = results[mode].printed["parts"][part]
            cells.append(f"{1000 * seconds:.1f}" + (f" ({calls})" if part != "rest" else ""))
        rows.append([part, *cells])
    return "Where the time goes, ms (calls)\n\n" + table(["part", *modes], rows) + "\n"


def growth(runs: int) -> Iterator[str]:
    """Times of finer and coarser meshes, by the factor on the number of elements in each direction."""
    for mode, factors in (("axial", (0.5, 1, 2, 4)), ("radial", (0.75, 1, 1.5, 2))):
        results = side_by_side([march(mode, f"{f:g}", "--factor", str(f)) for f in factors], runs)
        rows = []
        for factor, result in results.items():
            if isinstance(result, str):
                rows.append([factor, " ".join(result.split())[-60:], *[""] * 6])
                continue
            parts = result.printed["parts"]
            rows.append(
                [
                    factor,
                    str(result.printed["unknowns"]),
                    f"{result.solve:.3f}",
                    *(f"{1000 * parts[part][1]:.0f}" for part in GROWING),
                    f"{result.memory:.0f}",
                ]
            )
        head = [
            "elements x",
            "unknowns",
            "solve, s",
            "tangent, ms",
            "factorisation",
            "back-subst.",
            "residual",
            "MB",
        ]
        yield f"Growth with the mesh, {mode}\n\n{table(head, rows)}\n"


def threads(runs: int) -> Iterator[str]:
    """Times with one or two threads and one or two ranks."""
    ways = {"1 thread": {}, "2 threads": {"threads": 2}, "2 ranks": {"ranks": 2}}
    if (os.cpu_count() or 1) < 2:
        return
    head, rows = ["solve, s", *ways], []
    for mode in ("axial", "radial", "conical"):
        results = side_by_side([march(mode, name, **way) for name, way in ways.items()], runs)
        rows.append(
            [mode, *(f"{r.solve:.3f}" if isinstance(r, Result) else "failed" for r in results.values())]
        )
    yield "Threads and ranks\n\n" + table(head, rows) + "\n"
