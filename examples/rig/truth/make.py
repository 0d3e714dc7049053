"""Make ``axial_bushing_07.mf4`` of this example from ``truth.json``: ``setup/enter python -m examples.rig.truth.make``.

As the recordings of the other example (`examples.concealed.truth.make`), written as a rig's measurement system does:
MDF 4, German names, force in kN, all channels with their own unit.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from asammdf import MDF, Signal

from examples.concealed.truth.make import recording

HERE = Path(__file__).resolve().parent
FILE = HERE.parent / "axial_bushing_07.mf4"


def main() -> None:
    """Simulate, add noise, write."""
    truth = json.loads((HERE / "truth.json").read_text(encoding="utf-8"))
    time, q, force = recording(truth)
    channels = [
        Signal(q.round(4), time.round(3), name="Weg_axial", unit="mm"),
        Signal((1e-3 * force).round(5), time.round(3), name="Kraft_axial", unit="kN"),
        Signal(np.full(len(time), 23.0), time.round(3), name="Temperatur", unit="degC"),
    ]
    with MDF(version="4.10") as file:
        file.append(channels, comment="PrfStd 3, axial")
        file.save(FILE, overwrite=True, compression=2)


if __name__ == "__main__":
    main()
