"""From a shape and a mode to the curve: targets, dimensions, sweeps over both sides."""

from __future__ import annotations

import numpy as np
import pytest

from cases.march import NotConverged, march
from cases.mode import modes
from cases.program import Program
from cases.simulate import even_targets, is_odd, prepare, sweep
from cases.stretches import principal_stretches
from geometry.shape import Refinement, shapes

COARSE = Refinement(across=2, along=4, around=8)


@pytest.fixture(scope="module")
def axial(reference_bushing, rubber):
    return prepare(reference_bushing, modes()["axial"], rubber("yeoh"), COARSE)


@pytest.mark.parametrize(
    ("lower", "upper", "expected"),
    [
        (0.0, 2.0, [0, 0.5, 1, 1.5, 2]),
        (-2.0, 2.0, [-2, -1.5, -1, -0.5, 0, 0.5, 1, 1.5, 2]),
        # A hundredth of the range beyond rest is noise and does not count as a side.
        (-0.01, 2.0, [0, 0.5, 1, 1.5, 2]),
        # The short side gets at least four steps too.
        (-0.4, 2.0, [-0.4, -0.3, -0.2, -0.1, 0, 0.5, 1, 1.5, 2]),
        (-2.0, 0.0, [-2, -1.5, -1, -0.5, 0]),
    ],
)
def test_even_targets(lower, upper, expected):
    np.testing.assert_allclose(even_targets(lower, upper, 4), expected)


def test_sweep_goes_outward_on_both_sides_and_returns_in_order(axial):
    targets = np.array([2.0, -1.0, 1.0, 2.0, -3.0])
    told = []
    history = sweep(
        axial, targets, keep_states=True, sensitivity=("C10",), progress=lambda *n: told.append(n)
    )
    np.testing.assert_array_equal(history.displacement, [-3, -1, 0, 1, 2])
    assert history.states.shape == (5, len(axial.state.x.array))
    assert history.sensitivity.shape == (5, 1)
    assert history.newton.shape == (5,)
    assert [news[3] for news in told] == [0, -1, -3, 0, 1, 2]
    assert [news[:2] for news in told] == [(i + 1, 6) for i in range(6)]
    each = [march(axial, Program(np.array([q]))).force[0] for q in history.displacement]
    np.testing.assert_allclose(history.force, each, rtol=1e-6, atol=1e-6)
    for stretches, end in zip(history.stretches, (-3.0, 2.0), strict=True):
        march(axial, Program(np.array([end])))
        np.testing.assert_allclose(stretches, principal_stretches(axial).reshape(-1, 3), atol=1e-6)


def test_sweep_keeps_both_sides_as_far_as_they_went(reference_bushing, rubber):
    gent = prepare(reference_bushing, modes()["torsional"], rubber("gent", mu=1.0, Jm=1.0), COARSE)
    with pytest.raises(NotConverged) as caught:
        sweep(gent, np.array([-2.0, -0.4, 0.2, 0.4]))
    assert caught.value.target == -2.0
    assert len(caught.value.history.stretches) == 1  # of the side that reached its end
    assert -0.61 < caught.value.last < -0.4
    np.testing.assert_array_equal(caught.value.history.displacement, [caught.value.last, -0.4, 0.0, 0.2, 0.4])


@pytest.mark.parametrize("name", [m.name for m in modes().values() if m.specimen == "bushing"])
@pytest.mark.parametrize("shape", [n for n, s in shapes().items() if s.specimen == "bushing" and s.examples])
def test_the_section_is_used_where_shape_and_mode_are_of_revolution(shape, name, rubber):
    chosen, mode = shapes()[shape](**shapes()[shape].examples[0]), modes()[name]
    model = prepare(chosen, mode, rubber("neo_hookean"), COARSE)
    assert model.mesh.dimension == (2 if chosen.axisymmetric and mode.section else 3)
    assert model.mesh.mirrors <= chosen.mirror_planes
    assert model.multiplicity == 2 ** len(model.mesh.mirrors)


def test_curves_are_odd_where_the_shape_mirrors_the_load():
    plain, mount = (shapes()[n](**shapes()[n].examples[0]) for n in ("plain", "mount"))
    assert all(is_odd(plain, mode) for mode in modes().values() if mode.reversed_by is not None)
    assert not is_odd(mount, modes()["axial"])
    assert not is_odd(shapes()["coupon"](), modes()["uniaxial"])
