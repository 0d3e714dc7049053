"""Derivatives of the force with respect to the parameters against central differences, to six digits and more."""

from __future__ import annotations

import numpy as np
import pytest

from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import prepare
from forms.law import laws
from geometry.shape import Refinement, shapes

COARSE = Refinement(across=2, along=4, around=8)
# Every law in one bushing mode and in tension, every mode with one law.
PAIRS = [
    *((name, mode) for name in laws() for mode in ("axial", "uniaxial")),
    *(("yeoh", mode) for mode in modes() if mode not in ("axial", "uniaxial")),
]
# Relative steps: the largest ones err by truncation, the smallest by rounding; in between lies a plateau.
STEPS = 10.0 ** np.arange(-1, -5, -0.5)
KAPPA = 200.0


def program(mode):
    q = 0.1 if mode.rotational else 2.0 if mode.specimen == "bushing" else 0.3
    return Program(np.array([0.5 * q, q]))


@pytest.mark.parametrize(("name", "mode"), PAIRS)
def test_sensitivity_is_the_derivative_of_the_force(name, mode, rubber):
    chosen = rubber(name, KAPPA)
    kind = modes()[mode]
    shape = shapes()["coupon" if kind.specimen == "coupon" else "plain"]
    model = prepare(shape(**shape.examples[0]), kind, chosen, COARSE)
    names = (*chosen.parameters, "compliance")
    given = dict(chosen.parameters) | {"compliance": 1 / KAPPA}
    exact = march(model, program(kind), tolerance=1e-12, sensitivity=names)

    def force(changed):
        values = given | changed
        model.set_parameters({n: values[n] for n in chosen.parameters}, 1 / values["compliance"])
        return march(model, program(kind), tolerance=1e-12).force[-1]

    assert exact.sensitivity.shape == (2, len(names))
    for column, parameter in enumerate(names):
        found = exact.sensitivity[-1, column]
        value = given[parameter]
        differences = np.array(
            [
                (force({parameter: value * (1 + h)}) - force({parameter: value * (1 - h)})) / (2 * h * value)
                for h in STEPS
            ]
        )
        # The change of the force by the parameter's whole value; in a volumetric test the law's parameters change
        # nothing.
        scale = max(abs(found), 1e-7 * abs(exact.force[-1] / value))
        good = np.abs(differences - found) < 1e-6 * scale
        assert np.any(good[1:] & good[:-1]), (parameter, found, differences)


def test_no_parameters_asked_no_sensitivity(rubber):
    model = prepare(shapes()["coupon"](), modes()["uniaxial"], rubber("yeoh"))
    assert march(model, program(modes()["uniaxial"])).sensitivity is None
