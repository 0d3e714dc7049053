"""Make the recordings of this example from ``truth.toml``: ``setup/enter python -m examples.vibration.truth.make``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bushcli.case import load_case
from bushcli.simulate.dynamic import vibrate
from bushcli.simulate.predict import predict
from bushcli.simulate.vibrations import DynamicCurve

Complex = NDArray[np.complex128]

HERE = Path(__file__).resolve().parent
# Standard errors of the rig: of the stiffness, of the loss angle (degrees), of the static force (N).
STIFFNESS, ANGLE, FORCE = 0.01, 0.3, 4.0
# Peak to peak, mm.
AMPLITUDE = 0.1


def table(curves: list[DynamicCurve], mass: float, rng: np.random.Generator) -> str:
    """Return a rig's table of curves, with a mass of the fixture (kg) and noise."""
    by_force = curves[0].test.by_force
    preload = "preload [N]" if by_force else "preload [mm]"
    lines = [f"frequency [Hz];{preload};amplitude peak-to-peak [mm];|K*| [N/mm];loss angle [deg]"]
    for curve in curves:
        seen: Complex = curve.stiffness - 1e-3 * mass * (2.0 * np.pi * curve.frequency) ** 2
        size = np.abs(seen) * (1.0 + STIFFNESS * rng.standard_normal(len(seen)))
        angle = np.degrees(np.angle(seen)) + ANGLE * rng.standard_normal(len(seen))
        held = f"{curve.force:.0f}" if by_force else f"{curve.preload:.2f}"
        lines += [
            f"{f:.2f};{held};{AMPLITUDE};{k:.1f};{a:.2f}"
            for f, k, a in zip(curve.frequency, size, angle, strict=True)
        ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Simulate, add the mass and noise, write with the digits of a rig."""
    case, rng = load_case(HERE / "truth.toml"), np.random.default_rng(20261128)
    (mass,) = (one.values["mass"] for one in case.effects if one.effect.name == "fixture_mass")
    curves = vibrate(case).curves
    for mode in ("axial", "radial"):
        own = [one for one in curves if one.test.mode == mode]
        text = table(own, mass if mode == "radial" else 0.0, rng)
        (HERE.parent / f"{mode}.csv").write_text(text, encoding="utf-8")
    (loop,) = (one.curve for one in predict(case).channels)
    assert loop.time is not None
    force = loop.force + FORCE * rng.standard_normal(len(loop.force))
    rows = [f"{t:.3f};{q:.4f};{f:.1f}" for t, q, f in zip(loop.time, loop.displacement, force, strict=True)]
    text = "\n".join(["time [s];displacement [mm];force [N]", *rows, ""])
    (HERE.parent / "axial-loop.csv").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
