"""The combined path and the 6 x 6 stiffness against another code, on default meshes: errors, time, memory.

python benchmarks/six.py NAME      one march in a process of its own; prints one line of JSON
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

DATA = Path(__file__).resolve().parents[1] / "tests" / "verification" / "data"
_PLAIN = {"shape": "plain", "inner_radius": 12.0, "outer_radius": 22.0, "length": 40.0}
_KIDNEY = {"shape": "cad", "file": "kidney_A.step"}
#: Name -> geometry, entry of six.json, and the part of it that is compared.
CASES = {
    "plain, path": (_PLAIN, "plain", "path"),
    "plain, 6 x 6": (_PLAIN, "plain", "matrices"),
    "kidney STEP, 6 x 6": (_KIDNEY, "kidney_A", "matrices"),
}
#: Couplings below this share of the geometric mean of their diagonal entries are not compared.
COUPLED = 1e-4


def six(runs: int) -> Iterator[str]:
    """Yield a table of all cases; it shows the march with the median time of the runs."""
    yield "| case | unknowns | solve, s | memory, MB | diagonal or main reactions, % | couplings, % |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for name in CASES:
        measurements = sorted(
            (_measurement(name) for _ in range(runs)), key=lambda measurement: float(measurement["solve"])
        )
        median = measurements[len(measurements) // 2]
        yield (
            f"| {name} | {median['unknowns']} | {median['solve']:.2f} | {median['memory']:.0f} "
            f"| {median['main']:.2f} | {median['coupled']:.2f} |"
        )


def _measurement(name: str) -> dict[str, Any]:
    here = Path(__file__).resolve()
    done = subprocess.run(
        [sys.executable, str(here), name],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": str(here.parents[1])},
    )
    return dict(json.loads(done.stdout.strip().splitlines()[-1]))


def march_once(name: str) -> dict[str, Any]:
    """Follow the path of a case, and compare."""
    from cases.march import march
    from cases.mode import modes
    from cases.program import Program
    from cases.rigid import tangent
    from cases.simulate import Rubber, prepare
    from cases.six import SixPath
    from forms.law import laws
    from geometry.shape import shapes

    geometry, entry, kind = CASES[name]
    known = json.loads((DATA / "six.json").read_text(encoding="utf-8"))[entry]
    rest = {key: value for key, value in geometry.items() if key != "shape"}
    shape = shapes()[str(geometry["shape"])].model_validate(rest, context={"folder": str(DATA / "real")})
    if kind == "path":
        rows = known["path"]
        poses, targets, corners = [rows[1]["q"], rows[-1]["q"]], [0.5, 1.0, 1.25, 1.5, 1.75, 2.0], {1}
    else:
        poses, targets, corners = [[1.0, 0, 0, 0, 0, 0]], [0.0, 1.0], set()
    motion = np.array([np.zeros(6), *poses], dtype=float)
    six_path = SixPath(np.arange(float(len(motion))), motion, (), kind == "matrices")
    follow = modes()["path"].follow
    assert follow is not None
    rubber = Rubber(laws()["yeoh"], {"C10": 0.5, "C20": -0.05, "C30": 0.01}, 2000.0)
    model = prepare(shape, follow(six_path), rubber)
    matrices = []

    def observe(solver: Any) -> None:
        if kind == "matrices":
            solver.factorise()
            matrices.append(tangent(model, solver.factor, solver.q).symmetric)

    begin = time.perf_counter()
    history = march(model, Program(np.array(targets), None, frozenset(corners)), observer=observe)
    done = time.perf_counter()
    if kind == "path":
        assert history.reactions is not None
        main, coupled = _path_errors(history.reactions, np.array([row["f"] for row in known["path"]]))
    else:
        pairs = [
            _matrix_errors(own, np.array(known[k])) for own, k in zip(matrices, ("K0", "K1"), strict=True)
        ]
        main, coupled = (max(column) for column in zip(*pairs, strict=True))
    return {
        "unknowns": model.space.dofmap.index_map.size_global,
        "solve": done - begin,
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "main": main,
        "coupled": coupled,
    }


def _path_errors(own: Any, theirs: Any) -> tuple[float, float]:
    """Largest errors (%) of fx, fz and mz, and of the coupled my, at points where they are not zero."""

    def worst(columns: list[int]) -> float:
        a, b = own[:, columns], theirs[:, columns]
        there = np.abs(b) > 1e-6 * np.abs(b).max(axis=0)
        return float(100 * np.abs(a[there] / b[there] - 1).max())

    return worst([0, 2, 5]), worst([4])


def _matrix_errors(own: Any, theirs: Any) -> tuple[float, float]:
    """Largest errors (%) of the diagonal, and of the couplings."""
    diagonal = np.diag(theirs)
    scale = np.sqrt(np.outer(diagonal, diagonal))
    coupled = (np.abs(theirs) > COUPLED * scale) & ~np.eye(6, dtype=bool)
    off = 100 * np.abs(own[coupled] / theirs[coupled] - 1) if coupled.any() else np.zeros(1)
    return float(100 * np.abs(np.diag(own) / diagonal - 1).max()), float(off.max())


if __name__ == "__main__":
    print(json.dumps(march_once(sys.argv[1])))
