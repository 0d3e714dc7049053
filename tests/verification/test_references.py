"""Default meshes against converged curves of another finite-element code, at every point of the curves.

The data and their origin: tests/verification/data/README.md.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import prepare

FILES = sorted((Path(__file__).parent / "data").glob("*.csv"))
# What the project promises of its default mesh, relative to the reference at the same displacement.
PROMISE = 0.01


def test_every_reference_is_of_a_mode_that_there_is():
    assert {file.stem.split("-")[0] for file in FILES} <= {
        mode.name for mode in modes().values() if mode.specimen == "bushing"
    }


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_default_mesh_meets_the_converged_curve(file, reference_bushing, rubber, record_property):
    name, law = file.stem.split("-")
    displacement, force = np.loadtxt(file, delimiter=",", skiprows=1, unpack=True)
    q = np.radians(displacement) if modes()[name].rotational else displacement
    history = march(prepare(reference_bushing, modes()[name], rubber(law)), Program(q))
    deviation = history.force[1:] / force[1:] - 1
    record_property("largest_deviation", float(np.abs(deviation).max()))
    assert history.force[0] == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(history.force[1:], force[1:], rtol=PROMISE)
