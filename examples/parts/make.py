"""Make the twenty recordings: one curve, a factor for each part, noise, and what is wrong with five of them.

Run in this folder: python make.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bushcli.case import load_case
from bushcli.simulate.predict import predict

FOLDER = Path(__file__).parent
# The rubber, and the standard deviation of the logarithm of the stiffness factors.
LAW, SPREAD = "{C10 = 0.5, C20 = -0.05, C30 = 0.01}", 0.04


def main() -> None:
    """Write the recordings."""
    program = '[{mode = "axial", amplitude = 6.0}]'
    case = load_case(
        FOLDER / "case.toml", (f"material.parameters={LAW}", f"load_cases={program}", "specimens=[]")
    )
    curve = predict(case, pictures=False).channels[0].curve
    draw = np.random.default_rng(3)
    time = np.arange(0.0, 20.001, 0.1)
    programmed = 5.0 * np.sin(2.0 * np.pi * time / 10.0)

    def force(q: np.ndarray) -> np.ndarray:
        return np.sign(q) * curve.at(np.abs(q))

    for number, factor in enumerate(np.exp(SPREAD * draw.standard_normal(20)), start=1):
        q = np.clip(programmed, -3.2, 3.2) if number == 14 else programmed
        scale = {5: 1.35, 17: -factor}.get(number, factor)
        F = scale * force(q - (0.4 if number == 19 else 0.0))
        F += (35.0 if number == 10 else 0.0) * np.sign(np.gradient(programmed))
        noisy = q + 0.002 * draw.standard_normal(len(q)), F + 1.5 * draw.standard_normal(len(q))
        rows = np.column_stack([time, *noisy])
        head = "time_s,displacement_mm,force_N"
        file = FOLDER / "parts" / f"part_{number:02d}.csv"
        np.savetxt(file, rows, fmt=("%.1f", "%.4f", "%.2f"), delimiter=",", header=head, comments="")


if __name__ == "__main__":
    main()
