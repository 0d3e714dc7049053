"""Results with known answers, made by hand: no mesh, no march."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.case import Material, load_case
from bushcli.curve.curve import Curve
from bushcli.inverse import Combination, Estimate, Fit, FittedCurve
from bushcli.recording import Recording
from bushcli.report.results import DirectResult
from bushcli.runtime.condition import Condition
from bushcli.simulate.misfit import misfits
from bushcli.simulate.response import Response, Simulated
from bushcli.simulate.strains import Strains
from cases.march import Attempt
from cases.stretches import Surface

CASE = """\
title = '{title}'
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0
[material]
law = "yeoh"
[material.parameters]
C10 = 0.5
C20 = -0.05
C30 = 0.01
[[load_cases]]
mode = "axial"
amplitude = 4.0
[[recordings]]
mode = "axial"
file = "axial.csv"
name = "measured"
"""


@pytest.fixture
def case(tmp_path):
    """Make a case with this title and a recording beside it."""

    def make(title="a bushing"):
        folder = tmp_path / "case"
        folder.mkdir(exist_ok=True)
        rows = "".join(f"{q},{100 * q}\n" for q in range(6))
        (folder / "axial.csv").write_text("displacement_mm,force_N\n" + rows)
        (folder / "case.toml").write_text(CASE.format(title=title))
        return load_case(folder / "case.toml")

    return make


def section():
    """Four faces of a half-plane, sheared along the axis by 2 mm at the inner radius, with an inner sleeve."""
    r, z = np.array([7.0, 9.0, 13.5, 18.0]), np.array([-17.0, 17.0])
    corners = [[(r[i], z[0]), (r[i + 1], z[0]), (r[i + 1], z[1]), (r[i], z[1])] for i in range(3)]
    reference = np.array([[(a, 0.0, b) for a, b in face] for face in corners])
    deformed = reference.copy()
    deformed[..., 2] += 2.0 * np.clip((18.0 - reference[..., 0]) / 9.0, 0.0, 1.0)
    stretch = np.where(reference[..., 0] < 9.5, 1.4, 1.1)
    return Surface(reference, deformed, stretch, np.array([False, True, True]), 2.0)


def line(mode="axial", stiffness=100.0, measured=None, name="", reach=4.0, **changes):
    """A straight line of known stiffness (N/mm or N mm/rad), recorded as another one if `measured` is given."""
    q = np.linspace(-reach, reach, 21)
    name = name or mode
    recording = None
    if measured is not None:
        at = np.linspace(-4.0, 4.0, 41)
        recording = Recording(mode, at, measured * at, None, name=name)
    given = {
        "name": name,
        "mode": mode,
        "curve": Curve(mode, q, stiffness * q),
        "recording": recording,
        "attempts": (
            Attempt(0.0, 4.0, 25, "DIVERGED_MAX_IT", 0.1),
            Attempt(0.0, 2.0, 3, "CONVERGED_FNORM_RELATIVE", 0.1),
        ),
        "stopped": "",
        "reach": reach,
        "target": reach,
        "unknowns": 682,
        "strained": Strains((0.6, 1.7)),
        "seconds": {"mesh_and_forms": 0.1, "march": 0.2},
        "surface": section(),
    }
    return Simulated(**(given | changes))


@pytest.fixture
def channel():
    """Make a simulated channel, see `line`."""
    return line


@pytest.fixture
def ring():
    """The faces of a sheared half-plane with a sleeve inside."""
    return section()


@pytest.fixture
def answer(case):
    """Make a prediction of channels beside their recordings."""

    def make(*channels, title="a bushing", conditions=(), fit=None):
        used = case(title)
        response = Response(used, used.material, channels, tuple(conditions))
        return DirectResult(response, misfits(response), fit)

    return make


@pytest.fixture
def fit():
    """A law fitted to three coupons, two of them in the same mode, with every kind of doubt about it."""
    curves = []
    for name, mode, off in (
        ("uniaxial", "uniaxial", 1.0),
        ("second", "uniaxial", 1.1),
        ("planar", "planar", 1.2),
    ):
        strain = np.linspace(0.0, 2.0, 9)
        recorded = Recording(mode, strain, strain, None, name=name)
        curves.append(FittedCurve(name, recorded, Curve(mode, strain, off * strain), 100 * (off - 1.0)))
    return Fit(
        material=Material("yeoh", float("inf"), {"C10": 0.2, "C20": -0.002}),
        parameters={
            "C10": Estimate(0.2, 0.005, 1e-6, float("inf"), False),
            "C20": Estimate(-0.002, float("nan"), -100.0, 100.0, True),
        },
        correlation=np.array([[1.0, np.nan], [np.nan, 1.0]]),
        curves=tuple(curves),
        stability={"uniaxial": (0.5, 2.5), "planar": (0.0, float("inf"))},
        weighting="relative",
        forward_solves=12,
        sweeps=4,
        failed_solves=1,
        iterations=3,
        converged=True,
        singular_values=np.array([1.0, 1e-5]),
        undetermined=(Combination({"C20": 1.0}, 1e-5, "C20 alone is not determined"),),
        seconds=0.5,
        conditions=(Condition("at_bound", "C20 lies on its bound", "choose another law"),),
    )
