"""bushcli beside its peers: the same bushing, the same steps, the error of each, in one run."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from benchmarks import install
from benchmarks.measure import Result, Subject, side_by_side, table
from benchmarks.problem import TASKS, errors

HERE = Path(__file__).resolve().parent
# Elements across the rubber, along its length (for radial load half of it), around half the circumference.
MESHES = {
    "axial": {"bushcli": ["6x12"], "ngsolve": ["6x12"], "felupe": ["6x12"], "calculix": ["6x12"]},
    "radial": {
        "bushcli": ["3x3x6", "3x4x6", "4x4x8"],
        "ngsolve": ["3x3x6", "3x4x6", "4x4x8"],
        "felupe": ["3x3x6", "3x4x6", "4x4x8"],
        "calculix": ["4x4x8"],
    },
}
SHOWN = {"axial": (0.4, 4.0, 8.0), "radial": (1.5, 2.1, 3.0)}


def subjects(mode: str) -> Iterator[Subject]:
    """All programs on all meshes; a program that cannot be installed is named on stderr."""
    task = TASKS[mode]
    for program, meshes in MESHES[mode].items():
        try:
            python = install.interpreter(program) if program in install.PACKAGES else Path(sys.executable)
            extra = [install.calculix()] if program == "calculix" else []
        except RuntimeError as missing:
            print(f"left out: {missing}", file=sys.stderr)
            continue
        for mesh in meshes:
            if program == "bushcli":
                command = [str(HERE / "own.py"), mode, "--stop", str(task.stop), "--steps", str(task.steps)]
                command += ["--elements", whole(mode, mesh)]
            else:
                command = [str(HERE / "peers" / f"{program}_bushing.py"), mode, mesh, *extra]
            yield Subject(f"{program} {mesh}", [str(python), *command])


def whole(mode: str, mesh: str) -> str:
    """Convert a mesh to bushcli's numbers, which count the whole bushing."""
    across, along, *around = (int(n) for n in mesh.split("x"))
    if mode == "axial":
        return f"{across}x{along}"
    return f"{across}x{2 * along}x{2 * around[0]}"


def compare(runs: int) -> Iterator[str]:
    """One table per task."""
    for mode, task in TASKS.items():
        programs = list(subjects(mode))
        head = ["program, mesh", "unknowns", "solve, s", "x bushcli", "process, s"]
        head += [f"error at {q:g} mm, %" for q in SHOWN[mode]]
        rows = []
        results = side_by_side(programs, runs)
        first = next(result.solve for result in results.values() if isinstance(result, Result))
        for name, result in results.items():
            if isinstance(result, str):
                rows.append([name, "failed: " + " ".join(result.split())[:60], *[""] * (len(head) - 2)])
                continue
            deviation = errors(mode, result.printed["displacement"], result.printed["force"])
            own = results.get(f"bushcli {name.split()[1]}")
            ratio = result.solve / (own.solve if isinstance(own, Result) else first)
            rows.append(
                [
                    name,
                    str(result.printed["unknowns"]),
                    f"{result.solve:.3f}",
                    f"{ratio:.1f}",
                    f"{result.wall:.2f}",
                    *(f"{deviation[q]:.2f}" if q in deviation else "" for q in SHOWN[mode]),
                ]
            )
        yield f"{mode}, {task.steps} steps to {task.stop:g} mm\n\n{table(head, rows)}\n"
