"""The problem in CalculiX: 20-node bricks (8-node axisymmetric quadrilaterals), reduced integration.

    python calculix_bushing.py axial|radial RADIALxAXIALxAROUND CCX [THREADS]

CCX is the program. Elements: across the rubber; along its length (half of it for radial load); around half the
circumference. CalculiX has no mixed element, so that the compressibility is a term of the law. Prints one line of JSON.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from itertools import product
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import numpy as np
from problem import C10, C20, C30, KAPPA, arguments, heights, radii

# Nodes of an element in steps of half an element, in CalculiX's order: corners, then mid-sides.
QUADRILATERAL = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
BRICK = [
    *((x, y, 0) for x, y in QUADRILATERAL[:4]),
    *((x, y, 2) for x, y in QUADRILATERAL[:4]),
    *((x, y, 0) for x, y in QUADRILATERAL[4:]),
    *((x, y, 2) for x, y in QUADRILATERAL[4:]),
    *((x, y, 1) for x, y in QUADRILATERAL[:4]),
]


def with_middles(vertices):
    """Vertices and the middles between them."""
    return np.interp(np.arange(2 * len(vertices) - 1) / 2, np.arange(len(vertices)), vertices)


def deck(task, elements):
    """Input deck, and the component of the force in it."""
    across, along, *around = elements
    axes = [with_middles(radii(across)), with_middles(heights(along, task.mode))]
    template, kind = QUADRILATERAL, "CAX8R"
    if task.mode == "radial":
        axes.insert(1, with_middles(np.linspace(0, np.pi, around[0] + 1)))
        template, kind = BRICK, "C3D20R"
    number, cells = {}, []
    for corner in product(*(range(0, len(axis) - 1, 2) for axis in axes)):
        keys = [tuple(np.add(corner, step)) for step in template]
        cells.append([number.setdefault(key, len(number) + 1) for key in keys])
    nodes, sets = [], {"inner": [], "outer": [], "side": [], "middle": []}
    for key, n in number.items():
        place = [axis[k] for axis, k in zip(axes, key, strict=True)]
        if task.mode == "axial":
            nodes.append(f"{n}, {place[0]:.12g}, {place[1]:.12g}, 0")
        else:
            r, angle, z = place
            nodes.append(f"{n}, {r * np.cos(angle):.12g}, {r * np.sin(angle):.12g}, {z:.12g}")
            if key[1] in (0, len(axes[1]) - 1):
                sets["side"].append(n)
            if key[2] == 0:
                sets["middle"].append(n)
        if key[0] in (0, len(axes[0]) - 1):
            sets["inner" if key[0] == 0 else "outer"].append(n)
    lines = ["*NODE, NSET=all", *nodes, f"*ELEMENT, TYPE={kind}, ELSET=rubber"]
    for n, cell in enumerate(cells, 1):
        text = [str(c) for c in (n, *cell)]
        lines += [
            ", ".join(text[i : i + 10]) + ("," if i + 10 < len(text) else "") for i in range(0, len(text), 10)
        ]
    for name, members in sets.items():
        if members:
            lines += [f"*NSET, NSET={name}", *(f"{n}," for n in members)]
    component = 2 if task.mode == "axial" else 1
    other = [c for c in ((1, 2) if task.mode == "axial" else (1, 2, 3)) if c != component]
    # Hyperelastic constants of the reduced polynomial: C10, C20, C30, D1, D2, D3 with 1 / D1 = kappa / 2.
    lines += [
        "*MATERIAL, NAME=yeoh",
        "*HYPERELASTIC, YEOH",
        f"{C10}, {C20}, {C30}, {2 / KAPPA}, 0, 0",
        "*SOLID SECTION, ELSET=rubber, MATERIAL=yeoh",
        "*BOUNDARY",
        *(f"outer, {c}, {c}" for c in sorted([component, *other])),
        *(f"inner, {c}, {c}" for c in other),
        *(["side, 2, 2", "middle, 3, 3"] if task.mode == "radial" else []),
        "*AMPLITUDE, NAME=ramp",
        "0, 0, 1, 1",
        "*TIME POINTS, NAME=targets, GENERATE",
        f"{1 / task.steps}, 1, {1 / task.steps}",
        f"*STEP, NLGEOM, INC={10 * task.steps}",
        "*STATIC",
        f"{1 / task.steps}, 1, 1e-6, {1 / task.steps}",
        "*BOUNDARY, AMPLITUDE=ramp",
        f"inner, {component}, {component}, {task.stop}",
        "*NODE PRINT, NSET=inner, TOTALS=ONLY, TIME POINTS=targets",
        "RF",
        "*END STEP",
    ]
    return "\n".join(lines) + "\n", component


def main():
    task, elements = arguments()
    begin = time.perf_counter()
    text, component = deck(task, elements)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "job.inp").write_text(text)
        setup = time.perf_counter()
        run = subprocess.run(
            [sys.argv[3], "-i", "job"],
            cwd=folder,
            capture_output=True,
            text=True,
            env=os.environ | {"OMP_NUM_THREADS": sys.argv[4] if len(sys.argv) > 4 else "1"},
        )
        end = time.perf_counter()
        if run.returncode or "*ERROR" in run.stdout:
            raise SystemExit(run.stdout[-2000:] + run.stderr[-1000:])
        printed = (Path(folder) / "job.dat").read_text()
    # CalculiX expands axisymmetric elements to a wedge of two degrees.
    share = 180 if task.mode == "axial" else 4
    times, forces = [], []
    for block in re.split(r"total force", printed)[1:]:
        numbers = [float(v) for v in re.findall(r"[-+]?\d+\.\d+E[-+]\d+", block)]
        times.append(numbers[0] * task.stop)
        forces.append(share * numbers[component])
    print(
        json.dumps(
            {
                "version": re.search(r"Version ([\d.]+)", run.stdout).group(1),
                "unknowns": int(re.search(r"number of equations\s+(\d+)", run.stdout).group(1)),
                "newton": len(re.findall(r"iteration \d+", run.stdout)),
                "setup": setup - begin,
                "solve": end - setup,
                "displacement": times,
                "force": forces,
            }
        )
    )


if __name__ == "__main__":
    main()
