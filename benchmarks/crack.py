"""Errors of the radial stiffness over the length that is off, with several meshes."""

from __future__ import annotations

from time import process_time

import numpy as np

from benchmarks.measure import table
from bushcli.effects.active import ActiveEffect
from bushcli.effects.assembly import features_of
from bushcli.effects.effect import effect
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import Rubber, prepare
from forms.law import law
from geometry import ring
from geometry.shape import Refinement, Shape, shapes

RUBBER = Rubber(law("yeoh"), {"C10": 0.5, "C20": -0.04, "C30": 0.007}, 4000.0)
BUSHINGS = (
    {"inner_radius": 8.48, "outer_radius": 18.4, "length": 35.1},
    {"inner_radius": 12.0, "outer_radius": 22.0, "length": 60.0},
)
#: Free lengths, thicknesses.
OFF = (0.1, 0.3, 0.6, 0.8, 1.0, 1.3, 1.7)
#: Elements along and across, and the grading along.
REFERENCE = (32, 4, 4.0)
MESHES = ((8, 3, 6.0), (10, 3, 3.0), (12, 3, 6.0), (12, 3, 3.0), (12, 3, 2.0), (16, 3, 6.0), (16, 3, 3.0))


def forces(shape: Shape, along: int, across: int, grading: float) -> tuple[np.ndarray, float]:
    """Return the force at 2 % of the thickness for each free length, and the processor time, s."""
    ring.SOLID_GRADING, ring.PARTLY_BONDED = (2.0, grading), (1.0, 1.0)
    wall = shape.wall
    assert wall is not None
    off = features_of([ActiveEffect(effect("debonding"), {"length": 1.0, "bond": 2.0})])
    model = prepare(shape, modes()["radial"], RUBBER, Refinement(along=along, across=across), features=off)
    program = Program(np.array([0.02 * wall.thickness]))
    march(model, program)  # compiles
    start, found = process_time(), []
    for share in OFF:
        model.set_parameters({"debonding.length": share * wall.thickness})
        found.append(march(model, program).force[0])
    return np.array(found), process_time() - start


def main() -> None:
    """Print a table for each bushing."""
    for dimensions in BUSHINGS:
        shape = shapes()["plain"](**dimensions)
        exact, _ = forces(shape, *REFERENCE)
        rows = []
        for mesh in MESHES:
            found, seconds = forces(shape, *mesh)
            rows.append(
                [f"{mesh[0]}, {mesh[2]:g}", *(f"{100 * e:.1f}" for e in found / exact - 1), f"{seconds:.1f}"]
            )
        print(", ".join(f"{v:g}" for v in dimensions.values()))
        print(table(["elements along, grading", *map(str, OFF), "s"], rows))


if __name__ == "__main__":
    main()
