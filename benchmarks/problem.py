"""The problem that all programs solve, and its reference curves. It needs only NumPy, as the peers import it too.

Plain bushing, rubber 12/22 mm, 40 mm long, rigid sleeves, free ends; Yeoh rubber with kappa/2 (J - 1)^2.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

INNER_RADIUS, OUTER_RADIUS, LENGTH = 12.0, 22.0, 40.0
C10, C20, C30 = 0.5, -0.05, 0.01
KAPPA = 2000.0
REFERENCES = Path(__file__).resolve().parents[1] / "tests" / "verification" / "data"
# Radial force at 3 mm, beyond the end of the reference curve, where meshes still disagree by a percent. From the code
# of the references: third-order elements, mesh graded toward the bond edges, 15,200 unknowns.
RADIAL_3MM = 8120.0


@dataclass(frozen=True)
class Task:
    """A load: `steps` equal steps to `stop` (mm or degrees)."""

    mode: str
    stop: float
    steps: int

    @property
    def displacement(self) -> np.ndarray:
        """Targets, without rest."""
        return np.linspace(0.0, self.stop, self.steps + 1)[1:]


TASKS = {task.mode: task for task in (Task("axial", 8.0, 20), Task("radial", 3.0, 10))}


def reference(mode: str) -> tuple[np.ndarray, np.ndarray]:
    """Converged displacement and force of another finite-element code (tests/verification/data/README.md)."""
    table = np.loadtxt(REFERENCES / f"{mode}-yeoh.csv", delimiter=",", skiprows=1)
    if mode == "radial":
        table = np.vstack([table[:, :2], (3.0, RADIAL_3MM)])
    return table[:, 0], table[:, 1]


def errors(mode: str, displacement, force) -> dict[float, float]:
    """Percent above the reference at each of its displacements that was reached, except at rest."""
    q, Q = reference(mode)
    result = {}
    for target, value in zip(q, Q, strict=True):
        near = np.flatnonzero(np.abs(np.asarray(displacement) - target) < 1e-4)
        if target != 0 and len(near):
            result[round(float(target), 6)] = 100 * (float(np.asarray(force)[near[0]]) / float(value) - 1)
    return result


def graded_points(elements: int, ratio: float, fine: str) -> np.ndarray:
    """Vertices in [0, 1]; the longest element is `ratio` times the shortest, at the "stop" or at "both" ends."""
    k, n = np.arange(elements), max(elements - 1, 1)
    depth = {"stop": k, "both": np.abs(2 * k - n)}[fine] / n
    lengths = ratio**-depth
    return np.append(0.0, np.cumsum(lengths) / lengths.sum())


def radii(elements: int, ratio: float = 2.0) -> np.ndarray:
    """Radii of a mesh's vertices, short elements at both bonds."""
    return INNER_RADIUS + (OUTER_RADIUS - INNER_RADIUS) * graded_points(elements, ratio, "both")


def heights(elements: int, mode: str) -> np.ndarray:
    """Axial positions, short elements at the free ends: whole length for axial load, upper half for radial load."""
    if mode == "axial":
        return LENGTH * (graded_points(elements, 2.0, "both") - 0.5)
    return 0.5 * LENGTH * graded_points(elements, 6.0, "stop")


def arguments() -> tuple[Task, list[int]]:
    """Task and number of elements (radial, axial, around) from the command line of a peer."""
    return TASKS[sys.argv[1]], [int(n) for n in sys.argv[2].split("x")]
