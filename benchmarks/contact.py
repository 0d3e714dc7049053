"""Contact in slices of the kidney bushing against CalculiX and NGSolve.

``setup/enter python benchmarks/contact.py bump``, or ``void``.
The table goes to docs/contact.md. Data: tests/verification/data/real.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402

from cases.march import NotConverged  # noqa: E402
from cases.mode import modes  # noqa: E402
from cases.simulate import Rubber  # noqa: E402
from forms.law import laws  # noqa: E402
from tests.slices import LAYER, KidneySlice, slices  # noqa: E402

YEOH = Rubber(laws()["yeoh"], {"C10": 0.5, "C20": -0.05, "C30": 0.01}, 2000.0)
CASES = {
    "bump": ("slice_Abump_contact.csv", np.linspace(0.2, 2.0, 10)),
    "void": ("slice_A_void_closing.csv", np.linspace(0.25, 5.0, 20)),
}
# Of the elements in the plane, mm: 7,337 unknowns.
SIZE = 2.2


def main(name: str) -> None:
    """March one slice and print its deviation from the reference at each point."""
    file, path = CASES[name]
    q, force = np.loadtxt(ROOT / "tests/verification/data/real" / file, delimiter=",", skiprows=1)[:, :2].T
    begin = time.perf_counter()
    try:
        _, history = slices(KidneySlice(bump=name == "bump", size=SIZE), modes()["radial"], YEOH, path)
        found = history.force
    except NotConverged as stopped:
        print(stopped)
        history = stopped.history
        found = history.force / (2 * LAYER)
    print(f"{time.perf_counter() - begin:.1f} s, {len(history.attempts)} steps tried")
    for here, own in zip(history.displacement, found, strict=True):
        known = np.flatnonzero(np.abs(q - here) < 1e-9)
        off = f"{100 * (own / force[known[0]] - 1):+.2f} %" if len(known) else ""
        print(f"{here:.3f} mm  {own:.4f} N/mm  {off}")


if __name__ == "__main__":
    main(sys.argv[1])
