"""Effects of the assembly act on the outline of a plain ring as on the ring itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bushcli.effects.active import ActiveEffect
from bushcli.effects.assembly import features_of
from bushcli.effects.effect import effect, effects, reasons_against
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import Rubber, prepare
from forms.law import law
from geometry.shape import Refinement, Shape, shapes

YEOH = Rubber(law("yeoh"), {"C10": 0.5, "C20": -0.05, "C30": 0.01}, 2000.0)
INNER, OUTER, LENGTH = 10.0, 20.0, 24.0
OUTLINE = [
    {"from": [INNER, -LENGTH / 2], "to": [OUTER, -LENGTH / 2]},
    {"to": [OUTER, LENGTH / 2], "name": "outer"},
    {"to": [INNER, LENGTH / 2]},
    {"to": [INNER, -LENGTH / 2], "name": "inner"},
]
PLAIN = shapes()["plain"](inner_radius=INNER, outer_radius=OUTER, length=LENGTH)
BONDS = effect("debonding").parameter("bond").choices
VALUES: dict[str, dict[str, float]] = {
    "swaging": {"reduction": 0.4},
    "cure_shrinkage": {"shrinkage": 0.02},
    "debonding": {"length": 3.0, "bond": float(BONDS.index("outer_top"))},
    "dimension": {"thickness": 0.5, "length": 1.0},
    "misalignment": {"offset": 0.8},
}


def by_outline() -> Shape:
    return shapes()["section"].model_validate({"outline": OUTLINE})


def forces(shape: Shape, mode: str, name: str, q: list[float], **mesh: Any) -> np.ndarray:
    """Return the ratio of the force with an effect to the force without it."""
    found = []
    for active in ([], [ActiveEffect(effect(name), VALUES[name])]):
        model = prepare(shape, modes()[mode], YEOH, Refinement(**mesh), features=features_of(active))
        found.append(march(model, Program(np.array(q))).force)
    return found[1] / found[0]


@pytest.mark.parametrize(
    ("name", "mode", "q"),
    [
        ("swaging", "axial", [1.0, 2.0]),
        ("cure_shrinkage", "axial", [1.0, 2.0]),
        ("debonding", "axial", [1.0, 2.0]),
        ("dimension", "torsional", [0.05, 0.1]),
        ("dimension", "axial", [1.0, 2.0]),
    ],
)
def test_an_outline_has_the_effects_of_the_ring_that_it_draws(name: str, mode: str, q: list[float]) -> None:
    ratio = forces(PLAIN, mode, name, q, across=8, along=40)
    assert np.all(np.abs(ratio - 1.0) > 3e-3)
    np.testing.assert_allclose(forces(by_outline(), mode, name, q, across=8, along=40), ratio, rtol=3e-3)


def test_an_outline_has_its_sleeve_off_centre_in_space() -> None:
    ratio = forces(PLAIN, "radial", "misalignment", [-0.5, 0.5], across=2, along=4, around=8)
    assert ratio[1] - ratio[0] > 0.02
    np.testing.assert_allclose(
        forces(by_outline(), "radial", "misalignment", [-0.5, 0.5], across=2, around=8), ratio, rtol=5e-3
    )


@pytest.mark.slow
def test_a_contoured_section_turns_no_bond_out_of_shape() -> None:
    """The inner bond bulges from 10 to 11.5 mm: it moves as a body, and the outer one stays."""
    shape = shapes()["section"].model_validate(shapes()["section"].examples[1])
    wall = shape.wall
    assert wall is not None
    assert (wall.inner_radius, wall.outer_radius) == pytest.approx((11.5, 20.0))
    assert wall.span("inner") == pytest.approx((-22.0, 22.0))
    assert wall.span("outer") == pytest.approx((-16.0, 16.0))
    ratio = forces(shape, "radial", "misalignment", [-0.3, 0.3], across=2, around=8)
    assert ratio[1] - ratio[0] > 0.01


def test_what_has_no_coaxial_sleeves_is_refused() -> None:
    mount = shapes()["mount"].model_validate(shapes()["mount"].examples[0])
    flat = shapes()["section"].model_validate(
        {
            "outline": [
                {"from": [10.0, -10.0], "to": [20.0, -10.0], "name": "outer"},
                {"to": [20.0, 10.0]},
                {"to": [10.0, 10.0], "name": "inner"},
                {"to": [10.0, -10.0]},
            ]
        }
    )
    for shape in (mount, flat):
        assert shape.wall is None
        for one in effects().values():
            assert bool(reasons_against(one, shape)) == one.needs_sleeves
    # The rigid sleeves of a section are not meshed, so there is no metal whose modulus could change.
    ((what, instead),) = reasons_against(effect("sleeve_compliance"), by_outline())
    assert "section" in what
    assert "geometry.plates" in instead
    assert not reasons_against(effect("sleeve_compliance"), PLAIN)
