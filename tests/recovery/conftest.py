"""Pseudo-experiments: recordings by a finer mesh of third-order elements, so that no inverse crime is committed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bushcli.case import Case, load_case
from bushcli.curve.curve import Curve
from bushcli.recording import write_curve_csv
from cases.march import march
from cases.mode import modes, setting_for
from cases.model import FiniteElementModel
from cases.program import ramp
from forms.law import law
from geometry.mesh import build
from geometry.shape import Refinement, shapes

TRUTH = {"C10": 0.5, "C20": -0.04, "C30": 0.007}
DIMENSIONS = {"inner_radius": 9.0, "outer_radius": 18.0, "length": 34.0}
# Largest displacement of each recording, mm or rad: 0.67 and 0.22 of the rubber's thickness, and 15 degrees.
REACH = {"axial": 6.0, "radial": 2.0, "torsional": np.radians(15.0)}
FINER = {"axial": 1.5, "torsional": 1.5, "radial": 1.0}
SAMPLES = 60

CASE = """
title = "pseudo-experiment"
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0
[material]
law = "yeoh"
bulk_modulus = 2000.0
"""


def third_order_curve(mode: str) -> Curve:
    """Curve by third-order displacement and second-order pressure, on a mesh at least as fine as the default."""
    shape = shapes()["plain"](**DIMENSIONS)
    chosen = modes()[mode]
    dimension = 2 if chosen.section is not None else 3
    mesh = build(shape, dimension, setting_for(chosen, dimension).mirrors, Refinement(factor=FINER[mode]))
    model = FiniteElementModel(replace(mesh, displacement_order=3), chosen, law("yeoh"), TRUTH, 2000.0)
    history = march(model, ramp(REACH[mode], 12))
    fine = np.linspace(0.0, REACH[mode], SAMPLES)
    return Curve(mode, fine, Curve(mode, history.displacement, history.force).at(fine))


@pytest.fixture(scope="session")
def truth_curves() -> dict[str, Curve]:
    """Noise-free curves of the pseudo-experiment by mode."""
    return {mode: third_order_curve(mode) for mode in REACH}


@pytest.fixture
def experiment(truth_curves: dict[str, Curve], tmp_path: Path) -> Callable[..., Case]:
    """Case with recordings of the given modes, with noise in percent of the peak force."""

    def make(*names: str, noise: float = 0.0, seed: int = 1, extra: str = "") -> Case:
        text = CASE + extra
        rng = np.random.default_rng(seed)
        for name in names:
            curve = truth_curves[name]
            error = noise / 100 * np.abs(curve.force).max() * rng.standard_normal(len(curve.force))
            write_curve_csv(tmp_path / f"{name}.csv", Curve(name, curve.displacement, curve.force + error))
            text += f'[[recordings]]\nmode = "{name}"\nfile = "{name}.csv"\n'
        file = tmp_path / "case.toml"
        file.write_text(text, encoding="utf-8")
        return load_case(file)

    return make
