"""Make ``axial.csv`` of this example from ``truth.json``: ``setup/enter python -m examples.concealed.truth.make``.

Third-order elements on a mesh of half as many again in each direction, a step per sample, and noise: another model
than the one that a diagnosis uses.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.concealed.programs import Leg, path
from benchmarks.concealed.simulate import Channel, force
from benchmarks.concealed.truth import Specimen
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent


def recording(truth: Mapping[str, Any]) -> tuple[Array, Array, Array]:
    """Simulate what a truth file says, and add noise.

    Parameters
    ----------
    truth : mapping
        As read from the file.

    Returns
    -------
    time, displacement, force : shape (n,) each
        s, mm, N.
    """
    program = truth["program"]
    amplitude = program["amplitude"]
    legs = tuple(Leg(*leg) for leg in program["legs"])
    time, q = path(legs, amplitude, program["slow"], program["samples"])
    specimen = Specimen(
        truth["shape"],
        truth["dimensions"],
        truth["law"],
        truth["parameters"],
        truth["bulk_modulus"],
        {"axial": amplitude},
    )
    active = [ActiveEffect(effect(name), values) for name, values in truth["effects"].items()]
    exact, _ = force(specimen, Channel("axial", time, q), active, finer=True)
    rng = np.random.default_rng(truth["seed"])
    measured = exact + truth["noise_percent"] / 100 * np.ptp(exact) * rng.standard_normal(len(exact))
    return time, q + truth["displacement_noise"] * rng.standard_normal(len(q)), measured


def main() -> None:
    """Simulate, add noise, write with the digits of a rig."""
    truth = json.loads((HERE / "truth.json").read_text(encoding="utf-8"))
    columns = recording(truth)
    rows = [f"{t:.3f},{x:.4f},{f:.2f}" for t, x, f in zip(*columns, strict=True)]
    text = "\n".join(["time_s,displacement_mm,force_N", *rows, ""])
    (HERE.parent / "axial.csv").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
