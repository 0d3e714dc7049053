"""One march of bushcli in a separate process, with the times of its phases and parts.

    python benchmarks/own.py MODE [--stop Q] [--steps N] [--factor F] [--elements AxLxC] [--repeat N]

Prints one line of JSON; under mpirun rank 0 prints it.
"""

import time

begin = time.perf_counter()

import argparse  # noqa: E402
import json  # noqa: E402
import math  # noqa: E402
import resource  # noqa: E402
import statistics  # noqa: E402
import sys  # noqa: E402
from pathlib import Path  # noqa: E402

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1])]

from petsc4py import PETSc  # noqa: E402

PETSc.Log.begin()

import dolfinx  # noqa: E402
import gmsh  # noqa: E402, F401
import numpy as np  # noqa: E402
from mpi4py import MPI  # noqa: E402
from problem import C10, C20, C30, INNER_RADIUS, KAPPA, LENGTH, OUTER_RADIUS  # noqa: E402

from cases.march import march  # noqa: E402
from cases.mode import modes, setting_for  # noqa: E402
from cases.model import FiniteElementModel  # noqa: E402
from cases.program import Program  # noqa: E402
from cases.system import System  # noqa: E402
from forms.law import law  # noqa: E402
from geometry.mesh import build  # noqa: E402
from geometry.shape import Refinement, shapes  # noqa: E402

imported = time.perf_counter()


class Clock:
    """Count the calls of a function and the seconds spent in it."""

    def __init__(self, owner, name):
        self.calls, self.seconds, self.function = 0, 0.0, getattr(owner, name)
        setattr(owner, name, self)

    def __call__(self, *args, **kwargs):
        """Call the function."""
        start = time.perf_counter()
        try:
            return self.function(*args, **kwargs)
        finally:
            self.calls += 1
            self.seconds += time.perf_counter() - start

    def __get__(self, instance, owner):
        return self if instance is None else lambda *args, **kwargs: self(instance, *args, **kwargs)


def events():
    """Calls and seconds of PETSc's own events: numeric factorisation, its analysis, back-substitution."""
    names = {"factorisation": "MatCholFctrNum", "analysis": "MatCholFctrSym", "back-substitution": "MatSolve"}
    info = {name: PETSc.Log.Event(event).getPerfInfo() for name, event in names.items()}
    return {name: (i["count"], i["time"]) for name, i in info.items()}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("mode")
    parser.add_argument("--stop", type=float)
    parser.add_argument("--steps", type=int)
    parser.add_argument("--factor", type=float, default=1.0)
    parser.add_argument("--elements")
    parser.add_argument("--repeat", type=int, default=1)
    options = parser.parse_args()
    mode = modes()[options.mode]
    degree = math.pi / 180 if mode.rotational else 1.0
    plain = shapes()["plain"](inner_radius=INNER_RADIUS, outer_radius=OUTER_RADIUS, length=LENGTH)
    if options.elements:
        refinement = Refinement(*(int(n) for n in options.elements.split("x")))
    else:
        refinement = Refinement(factor=options.factor)
    clocks = {
        "tangent": Clock(System, "tangent"),
        "residual": Clock(System, "residual"),
        "matrix": Clock(System, "create_matrix"),
    }
    start = time.perf_counter()
    dimension = 2 if mode.section is not None else 3
    mesh = build(plain, dimension, setting_for(mode, dimension).mirrors, refinement)
    meshed = time.perf_counter()
    model = FiniteElementModel(mesh, mode, law("yeoh"), {"C10": C10, "C20": C20, "C30": C30}, KAPPA)
    formed = time.perf_counter()
    targets = np.linspace(0.0, options.stop, options.steps + 1)[1:]
    times = []
    for _ in range(options.repeat):
        for clock in clocks.values():
            clock.calls, clock.seconds = 0, 0.0
        before, start_of_march = events(), time.perf_counter()
        history = march(model, Program(targets * degree))
        times.append(time.perf_counter() - start_of_march)
    parts = {name: (clock.calls, clock.seconds) for name, clock in clocks.items()}
    parts |= {name: (n - before[name][0], t - before[name][1]) for name, (n, t) in events().items()}
    parts["rest"] = (1, times[-1] - sum(seconds for _, seconds in parts.values()))
    if MPI.COMM_WORLD.rank == 0:
        json.dump(
            {
                "version": f"dolfinx {dolfinx.__version__}, PETSc {'.'.join(map(str, PETSc.Sys.getVersion()))}",
                "unknowns": model.space.dofmap.index_map.size_global,
                "newton": int(history.newton.sum()),
                "import": imported - begin,
                "mesh": meshed - start,
                "forms": formed - meshed,
                "setup": formed - begin,
                "solve": statistics.median(times),
                "parts": parts,
                "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
                "displacement": (history.displacement / degree).tolist(),
                "force": history.force.tolist(),
            },
            sys.stdout,
        )
        print()


if __name__ == "__main__":
    main()
