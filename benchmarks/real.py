"""Sections and CAD parts against other codes' curves: error at every point, time and memory, on default meshes.

python benchmarks/real.py NAME      one march in a process of its own; prints one line of JSON
"""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

DATA = Path(__file__).resolve().parents[1] / "tests" / "verification" / "data" / "real"
_SECTION = {"shape": "section", "file": "contoured_A_halfsection.dxf"}
_CONTOURED = {"shape": "cad", "file": "contoured_A.step"}
_KIDNEY = {"shape": "cad", "file": "kidney_A.step"}
#: Name -> geometry, mode, reference, and number of steps to its last point (None = steps at its points).
CASES = {
    "section, axial, 20 steps": (_SECTION, "axial", "contoured_A_axial.csv", 20),
    "section, axial, negative": (_SECTION, "axial", "contoured_A_axialneg.csv", None),
    "section, torsional": (_SECTION, "torsional", "contoured_A_torsional.csv", None),
    "section, radial": (_SECTION, "radial", "contoured_A_radial.csv", None),
    "section, conical": (_SECTION, "conical", "contoured_A_conical.csv", None),
    "contoured STEP, axial": (_CONTOURED, "axial", "contoured_A_axial.csv", None),
    "contoured STEP, radial": (_CONTOURED, "radial", "contoured_A_radial.csv", None),
    "contoured STEP, torsional": (_CONTOURED, "torsional", "contoured_A_torsional.csv", None),
    "contoured STEP, conical": (_CONTOURED, "conical", "contoured_A_conical.csv", None),
    "kidney STEP, axial": (_KIDNEY, "axial", "kidney_A_axial.csv", None),
    "kidney STEP, radial x, 10 steps": (_KIDNEY, "radial", "kidney_A_radial_x.csv", 10),
    "kidney STEP, radial x": (_KIDNEY, "radial", "kidney_A_radial_x.csv", None),
    "kidney STEP, radial y": (_KIDNEY | {"direction": [0, 1, 0]}, "radial", "kidney_A_radial_y.csv", None),
}


def real(runs: int) -> Iterator[str]:
    """Yield a table of all cases; times are medians of the runs."""
    yield "| case | unknowns | mesh, s | solve, s | memory, MB | error, % | reference's own, % |"
    yield "| --- | --- | --- | --- | --- | --- | --- |"
    for name in CASES:
        measurements = [_measurement(name) for _ in range(runs)]
        first = measurements[0]
        mesh, solve = (statistics.median(item[key] for item in measurements) for key in ("mesh", "solve"))
        yield (
            f"| {name} | {first['unknowns']} | {mesh:.2f} | {solve:.2f} | {first['memory']:.0f} "
            f"| {first['error']:.2f} | {first['reference']:.2f} |"
        )


def _measurement(name: str) -> dict[str, float]:
    command = [sys.executable, str(Path(__file__).resolve()), name]
    folder = str(Path(__file__).resolve().parents[1])
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": folder},
    )
    return dict(json.loads(done.stdout.strip().splitlines()[-1]))


def march_once(name: str) -> dict[str, float]:
    """March to the reference's points and compare; with other steps compare at the points that both have."""
    from cases.march import march
    from cases.mode import modes
    from cases.program import Program
    from cases.simulate import Rubber, prepare
    from forms.law import laws
    from geometry.shape import shapes

    geometry, mode_name, file, steps = CASES[name]
    mode = modes()[mode_name]
    rest = {key: value for key, value in geometry.items() if key != "shape"}
    shape = shapes()[str(geometry["shape"])].model_validate(rest, context={"folder": str(DATA)})
    q, force, own = np.loadtxt(DATA / file, delimiter=",", skiprows=2).T
    path = np.radians(q) if mode.rotational else q
    targets = path if steps is None else np.linspace(0.0, path[-1], steps + 1)[1:]
    rubber = Rubber(laws()["yeoh"], {"C10": 0.5, "C20": -0.05, "C30": 0.01}, 2000.0)
    begin = time.perf_counter()
    model = prepare(shape, mode, rubber)
    ready = time.perf_counter()
    history = march(model, Program(targets))
    done = time.perf_counter()
    share = [(i, int(np.argmin(np.abs(targets - at)))) for i, at in enumerate(path)]
    pairs = [(i, j) for i, j in share if abs(targets[j] - path[i]) < 1e-9 * abs(path[-1])]
    errors = [(100 * abs(history.force[j] / force[i] - 1), own[i]) for i, j in pairs]
    # The point at which the error exceeds the reference's own error most.
    error, reference = max(errors, key=lambda item: item[0] - item[1])
    return {
        "unknowns": model.space.dofmap.index_map.size_global,
        "mesh": ready - begin,
        "solve": done - ready,
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "error": float(error),
        "reference": float(reference),
        "displacement": targets.tolist(),
        "force": history.force.tolist(),
    }


if __name__ == "__main__":
    print(json.dumps(march_once(sys.argv[1])))
