"""A prescribed force: the travel that the march finds, its derivatives, and the ends of what a bushing carries."""

from __future__ import annotations

import numpy as np
import pytest

from cases.history import NotConverged
from cases.load import CLOSE, LIMIT_POINT, ForceSearch, PrescribedForce
from cases.march import march
from cases.mode import modes
from cases.program import Program, path
from cases.simulate import prepare
from geometry.shape import Refinement

COARSE = Refinement(across=2, along=6, around=8)
FINER = Refinement(across=4, along=8)
# N or N mm: a shear strain of the rubber of about a half in each mode.
LOADS = {"axial": 2000.0, "torsional": 40000.0, "radial": 4000.0}


@pytest.mark.parametrize("mode", LOADS)
def test_a_march_to_the_travel_found_has_the_prescribed_force(reference_bushing, rubber, mode):
    model = prepare(reference_bushing, modes()[mode], rubber("yeoh"), COARSE)
    program = path((0.0, LOADS[mode], -0.5 * LOADS[mode]), 4)
    found = march(model, program, drive=PrescribedForce(), sensitivity=("C10",))
    np.testing.assert_allclose(found.force, program.displacement, atol=2.0 * CLOSE * LOADS[mode])
    again = march(model, Program(found.displacement), sensitivity=("C10",))
    np.testing.assert_allclose(again.force, found.force, atol=1e-7 * LOADS[mode])
    # At a fixed force dq/dc = -(dQ/dc)/K, against marches with other parameters.
    value, ends = float(model.constants["C10"].value), []
    for side in (1.001, 0.999):
        model.set_parameters({"C10": side * value})
        ends.append(march(model, path((0.0, LOADS[mode]), 4), drive=PrescribedForce()).displacement[-1])
    top = int(np.argmax(program.displacement))
    assert found.path_sensitivity is not None
    assert found.path_sensitivity[top, 0] == pytest.approx((ends[0] - ends[1]) / (0.002 * value), rel=1e-4)
    assert found.sensitivity is not None
    assert np.abs(found.sensitivity).max() < 1e-9 * LOADS[mode]


def test_the_force_of_a_law_that_softens_ends_at_its_limit_point(reference_bushing, rubber):
    model = prepare(
        reference_bushing, modes()["torsional"], rubber("yeoh", C10=0.5, C20=-0.5, C30=0.0), FINER
    )
    with pytest.raises(NotConverged) as stopped:
        march(model, path((0.0, 10682.0), 8), drive=PrescribedForce())
    assert stopped.value.reason == LIMIT_POINT
    assert stopped.value.largest is not None
    q, largest = stopped.value.largest
    # The march by travel has its maximum there.
    curve = march(model, Program(np.linspace(0.0, q, 12)))
    assert largest == pytest.approx(curve.force[-1], rel=1e-6)
    assert np.all(np.diff(curve.force) > -1e-3 * largest)
    assert march(model, path((0.0, 0.9 * largest), 5), drive=PrescribedForce()).force[-1] == pytest.approx(
        0.9 * largest, rel=1e-6
    )


@pytest.mark.parametrize(
    ("curve", "load", "expected"),
    [
        (lambda q: 3.0 * q + q**3, 14.0, 2.0),
        # A stop from 1 mm on, a thousand times as stiff.
        (lambda q: q + 1000.0 * max(q - 1.0, 0.0), 11.01, 1.01),
        (lambda q: np.tanh(q) + 0.05 * q, 1.0, 1.5917),
        (lambda q: q, -2.0, -2.0),
    ],
)
def test_the_search_finds_the_root(curve, load, expected):
    slope = (curve(1e-6) - curve(-1e-6)) / 2e-6
    search = ForceSearch(PrescribedForce(), abs(load), 0.0, 0.0, slope)
    q = search.first_trial(load)
    while (better := search.better(q, float(curve(q)), 0.0, load)) is not None:
        q = better
    assert curve(q) == pytest.approx(load, rel=2e-7)
    assert q == pytest.approx(expected, abs=2e-3)


def test_the_search_ends_where_the_force_falls():
    search = ForceSearch(PrescribedForce(), 1.2, 0.0, 0.0, 1.0)
    q = search.first_trial(1.2)
    while (better := search.better(q, float(np.sin(q)), 0.0, 1.2)) is not None and np.isfinite(better):
        q = better
    assert search.reason == LIMIT_POINT
    assert search.largest[1] == pytest.approx(1.0, abs=0.1)
