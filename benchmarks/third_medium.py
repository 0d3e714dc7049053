"""Contact by a third medium, beside contact by search: the bump stop in a void, in plane strain.

``setup/enter python benchmarks/third_medium.py`` marches the bump stop of ``benchmarks/contact.py bump`` with both and
prints a table; with ``--scan`` for more media. The slice is meshed with curved triangles above y = 0, its plane of
symmetry; the medium (`medium.py`) fills the void with the stop. The results are in docs/contact.md.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
from mpi4py import MPI  # noqa: E402

from benchmarks.contact import CASES, YEOH  # noqa: E402
from benchmarks.medium import CURVATURES, MEDIUM, RUBBER, Medium, Problem, march_path  # noqa: E402
from cases.equilibrium import Equilibrium  # noqa: E402
from cases.march import NotConverged  # noqa: E402
from cases.mode import modes  # noqa: E402
from geometry.dolfinx_api import model_to_mesh  # noqa: E402
from geometry.session import session  # noqa: E402
from tests.slices import LAYER, KidneySlice, slices  # noqa: E402

FILE, SHAPE, _ = CASES["bump"]
STEP = 0.2  # mm, of the reference and of the march
# The media of the table: gamma, curvature, variant, size of the triangles around the gap (mm).
CHOSEN = (
    (3e-5, 10.0, "hessian", 0.4),
    (1e-4, 1.0, "hessian", 0.4),
    (1e-4, 10.0, "hessian", 0.4),
    (3e-4, 10.0, "hessian", 0.4),
    (1e-4, 100.0, "damped", 0.4),
    (1e-4, 1.0, "rotation", 0.4),
    (1e-4, 0.0, "hessian", 0.4),
    (1e-4, 1.0, "hessian", 0.2),
    (1e-4, 10.0, "hessian", 0.2),
)


@dataclass(frozen=True)
class March:
    """Result of a march in steps of `STEP`.

    Attributes
    ----------
    force, gap : sequence of float
        Force of the whole slice (N/mm) and distance from the stop to the wall at y = 0 (mm) at each step reached.
    tried, cut, unknowns : int
        Steps tried and cut back; unknowns that are not constrained.
    seconds : float
        Processor time, mesh and set-up included, but not the compilation of kernels.
    """

    force: Sequence[float]
    gap: Sequence[float]
    tried: int
    cut: int
    unknowns: int
    seconds: float


def bump_mesh(size: float, near: float, filled: bool = True) -> tuple[Any, Any]:
    """Return a mesh of the upper half of the slice, and the tags of its cells: `RUBBER`, and `MEDIUM` in the +x void.

    Parameters
    ----------
    size, near : float
        Size of the triangles, mm: elsewhere, and around the bump stop's gap.
    filled : bool
        Whether the void is meshed.
    """
    with session():
        import gmsh

        occ = gmsh.model.occ
        rubber = (2, KidneySlice(bump=True).draw())
        half = (2, occ.addRectangle(0, 0, 0, 200, 100)), (2, occ.addRectangle(-100, 0, 0, 100, 100))
        annulus, _ = occ.cut([(2, occ.addDisk(0, 0, 0, 22, 22))], [(2, occ.addDisk(0, 0, 0, 10, 10))])
        voids, _ = occ.cut(annulus, [rubber], removeTool=False)
        medium, _ = occ.intersect(voids, [half[0]], removeTool=False)
        upper, _ = occ.intersect([rubber], list(half))
        _, parts = occ.fragment(upper, medium)
        occ.synchronize()
        tags = [
            sorted({tag for part in some for _, tag in part})
            for some in (parts[: len(upper)], parts[len(upper) :])
        ]
        for name, some in zip((RUBBER, MEDIUM) if filled else (RUBBER,), tags, strict=False):
            gmsh.model.addPhysicalGroup(2, some, name)
        box = gmsh.model.mesh.field.add("Box")
        values = {
            "VIn": near,
            "VOut": size,
            "XMin": 16.5,
            "XMax": 18.7,
            "YMax": 4.5,
            "YMin": -1.0,
            "Thickness": 4.0,
        }
        for key, value in values.items():
            gmsh.model.mesh.field.setNumber(box, key, value)
        gmsh.model.mesh.field.setAsBackgroundMesh(box)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
        gmsh.option.setNumber("Mesh.Algorithm", 6)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(2)
        mesh, cells, _ = model_to_mesh(gmsh.model, MPI.COMM_SELF, 2)
    return mesh, cells


def bump_problem(mesh: Any, cells: Any, medium: Medium) -> Problem:
    """Return the problem of the slice whose inner sleeve moves along x.

    Parameters
    ----------
    mesh, cells
        Of `bump_mesh`.
    medium : Medium
        The third medium.
    """
    inner, outer = (lambda x, r=r: np.isclose(np.hypot(x[0], x[1]), r) for r in (10.0, 22.0))
    held = [(inner, 0, 1.0), (inner, 1, 0.0), (outer, 0, 0.0), (outer, 1, 0.0)]
    return Problem(mesh, cells, medium, [*held, (lambda x: np.isclose(x[1], 0.0), 1, 0.0)])


def by_medium(medium: Medium, path: Sequence[float], near: float, size: float = 1.5) -> March:
    """March the bump stop with a third medium; without stiffness the stop passes through the wall.

    Parameters
    ----------
    medium : Medium
        The third medium.
    path : sequence of float
        Displacements of the inner sleeve, mm.
    near, size : float
        See `bump_mesh`.
    """
    begin = time.process_time()
    problem = bump_problem(*bump_mesh(size, near, filled=medium.gamma > 0), medium)
    horizontal, places = problem.space.sub(0).sub(0).collapse()
    points = horizontal.tabulate_dof_coordinates()
    ends = [places[np.linalg.norm(points - [x, 0, 0], axis=1).argmin()] for x in (17.2, 18.0)]
    force: list[float] = []
    gap: list[float] = []

    def tell() -> None:
        stop, wall = problem.state.x.array[ends]
        force.append(2 * problem.reaction())
        gap.append(float(0.8 + wall - stop))

    tried, cut = march_path(problem, path, tell)
    return March(force, gap, tried, cut, problem.unknowns, time.process_time() - begin)


def by_search(path: Sequence[float]) -> March:
    """March the bump stop with the program's own contact; the gap is not evaluated."""
    begin = time.process_time()
    force: list[float] = []
    unknowns = 0

    def tell(solver: Equilibrium) -> None:
        nonlocal unknowns
        unknowns = solver.model.space.dofmap.index_map.size_global
        if np.isclose(path, solver.q).any():
            force.append(solver.force / (2 * LAYER))

    try:
        _, history = slices(SHAPE, modes()["radial"], YEOH, path, observer=tell)
    except NotConverged as stopped:
        history = stopped.history
    cut = sum(not attempt.accepted for attempt in history.attempts)
    return March(force, [], len(history.attempts), cut, unknowns, time.process_time() - begin)


def knee(force: Sequence[float]) -> float:
    """Return where the line through 0.2 and 0.6 mm meets the one through 1.0 and 1.2 mm; forces at each `STEP`."""
    early, late = (force[2] - force[0]) / 0.4, (force[5] - force[4]) / 0.2
    return float((force[4] - late - force[0] + 0.2 * early) / (early - late))


def row(name: str, result: March, free: Sequence[float], known: Sequence[float]) -> str:
    """Return a line of the table.

    Parameters
    ----------
    name : str
        What the line is about.
    result : March
        Its march.
    free, known : sequence of float
        Forces of the same mesh without medium, and of the reference, at each `STEP`, N/mm.
    """
    force = result.force
    errors = [100 * (a / b - 1) for a, b in zip(force, known, strict=False)]
    early = [100 * (a / b - 1) for a, b in zip(force, free, strict=False)]
    cells = [name, f"{STEP * len(force):.1f}", f"{result.tried} ({result.cut})"]
    cells.append(" ".join(f"{early[i]:+.2f}" for i in (1, 2) if i < len(early)) if free else "")
    cells.append(" ".join(f"{error:+.2f}" for error in errors[3:]))
    cells.append(f"{knee(force):.3f}" if len(force) > 5 and abs(errors[5]) < 10 else "")
    cells.append(" ".join(f"{1e3 * result.gap[i]:.0f}" for i in (3, 6) if i < len(result.gap)))
    return " | ".join(["", *cells, str(result.unknowns), f"{result.seconds:.1f}", ""]).strip()


def table(end: float, chosen: Sequence[tuple[float, float, str, float]]) -> None:
    """Print the table: search, no contact, and the media.

    Parameters
    ----------
    end : float
        Last displacement, mm.
    chosen : sequence of (gamma, curvature, variant, near)
        The media.
    """
    data = ROOT / "tests/verification/data/real" / FILE
    known = [float(force) for force in np.loadtxt(data, delimiter=",", skiprows=1)[1:, 1]]
    path = [STEP * (i + 1) for i in range(round(end / STEP))]
    print(
        "| contact | to, mm | steps (cut back) | before touch, 0.4 and 0.6 mm, % | error, 0.8 to 1.4 mm, % ",
        end="",
    )
    print("| knee, mm | gap at 0.8 and 1.4 mm, um | unknowns | s |")
    print("|" + " --- |" * 9, flush=True)
    print("| reference |" + " |" * 4 + f" {knee(known):.3f} |" + " |" * 3)
    print(row("search", by_search(path), [], known), flush=True)
    free = {near: by_medium(Medium(0.0), path, near) for near in sorted({near for *_, near in chosen})}
    for near, result in free.items():
        print(row(f"none, {near:g} mm", result, result.force, known), flush=True)
    for variant in {medium[2] for medium in chosen}:
        by_medium(Medium(1e-4, 1.0, variant), path[:1], near=1.5, size=3.0)  # compiles the kernels
    for gamma, curvature, variant, near in chosen:
        result = by_medium(Medium(gamma, curvature, variant), path, near)
        print(
            row(f"{variant} {gamma:g}, {curvature:g}, {near:g} mm", result, free[near].force, known),
            flush=True,
        )


def main() -> None:
    """Read the command line, and print the table."""
    parser = argparse.ArgumentParser(description="Contact by a third medium, beside contact by search.")
    parser.add_argument("--end", type=float, default=3.0, help="last displacement, mm (3.0)")
    parser.add_argument(
        "--scan", choices=sorted(CURVATURES), help="a grid of media with these second derivatives"
    )
    chosen = parser.parse_args()
    grid = [(a, b, chosen.scan, 0.4) for a, b in product((1e-6, 1e-5, 3e-5, 1e-4, 3e-4), (1.0, 10.0, 100.0))]
    table(chosen.end, grid if chosen.scan else CHOSEN)


if __name__ == "__main__":
    main()
