"""The kidney bushing's STEP file in bushcli and in NGSolve: the same steps, the error of each, in one run."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks import install
from benchmarks.measure import Result, Subject, side_by_side, table
from benchmarks.real import DATA

HERE = Path(__file__).resolve().parent
CASE, FILE, REFERENCE = "kidney STEP, radial x, 10 steps", "kidney_A.step", "kidney_A_radial_x.csv"
REACH, STEPS = 2.5, 10
#: Largest elements of Netgen's meshes, mm: the coarsest is about as large as bushcli's default mesh.
SIZES = (5.0, 3.5, 2.5)
#: Beyond this displacement (mm) the tips of the voids close, and the codes disagree.
SURE = 1.4


def subjects() -> Iterator[Subject]:
    """Both programs, NGSolve on several meshes; if it cannot be installed, stderr says so."""
    environment = {"PYTHONPATH": str(HERE.parent)}
    yield Subject("bushcli, default mesh", [sys.executable, str(HERE / "real.py"), CASE], environment)
    try:
        python = install.interpreter("ngsolve")
    except RuntimeError as missing:
        print(f"left out: {missing}", file=sys.stderr)
        return
    for size in SIZES:
        arguments = [str(DATA / FILE), str(REACH), str(STEPS), str(size)]
        command = [str(python), str(HERE / "peers" / "ngsolve_step.py"), *arguments]
        yield Subject(f"ngsolve, {size:g} mm", command)


def step(runs: int) -> Iterator[str]:
    """Yield the table; times are medians of the runs."""
    q, force, own = np.loadtxt(DATA / REFERENCE, delimiter=",", skiprows=2).T
    points = [at for at in q if abs(at * STEPS / REACH - round(at * STEPS / REACH)) < 1e-6]
    head = ["program, mesh", "unknowns", "solve, s", "memory, MB", f"error to {SURE:g} mm, %", "beyond, %"]
    rows = []
    for name, result in side_by_side(list(subjects()), runs).items():
        if not isinstance(result, Result):
            rows.append([name, "failed: " + " ".join(result.split())[:60], *[""] * (len(head) - 2)])
            continue
        forces = dict(zip(np.round(result.printed["displacement"], 9), result.printed["force"], strict=True))
        errors = {at: 100 * abs(forces[round(at, 9)] / force[q == at][0] - 1) for at in points}
        near = [error for at, error in errors.items() if at <= SURE]
        rows.append(
            [
                name,
                str(result.printed["unknowns"]),
                f"{result.solve:.2f}",
                f"{result.memory:.0f}",
                f"{max(near):.2f}" if near else "",
                f"{max(error for at, error in errors.items() if at > SURE):.2f}",
            ]
        )
    yield (
        f"kidney STEP, radial x, {STEPS} steps to {REACH:g} mm; the reference's own error is up to "
        f"{own[q <= SURE].max():.2g} % to {SURE:g} mm and {own.max():.2g} % beyond\n\n{table(head, rows)}\n"
    )
