"""Every effect on rubber or assembly leaves the finite-element model unchanged when off, and has exact slopes.

A new file in bushcli/effects/library needs no change here to be tested: under radial load where the effect shows only
there, else under axial load.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
import pytest

from bushcli.effects.active import ActiveEffect
from bushcli.effects.assembly import features_of
from bushcli.effects.effect import Effect, effects
from cases.march import march
from cases.mode import modes
from cases.model import FiniteElementModel
from cases.program import Program
from cases.simulate import Rubber, prepare
from forms.law import law
from geometry.shape import Refinement, shapes

COARSE = Refinement(across=2, along=4, around=8)
# Digits where more are not possible: at knees a difference has an error of first order in its step, and the rounding of
# stiff metal and bonds is 1e-5 of the change by a small parameter.
DIGITS = {"friction": 1e-5, "sleeve_compliance": 2e-5, "debonding": 5e-5}
# Where a bond begins to open, the slope changes within 1e-5 mm, which differences do not resolve: begin beyond that.
BARELY_ON = {"debonding": {"length": 0.1}}
# Rigid sleeves are 240 times as stiff as steel (`sleeve_compliance.RIGID`) and change the force by this share.
NOT_QUITE_OFF = {"sleeve_compliance": 4e-6}
# Each effect with each combination of its choices.
FEATURES = [
    (one, dict(zip((p.name for p in choices), words, strict=True)))
    for one in effects().values()
    if one.feature is not None
    for choices in [[p for p in one.parameters if p.choices]]
    for words in product(*(p.choices for p in choices))
]
RUBBER = Rubber(law("yeoh"), {"C10": 0.5, "C20": -0.05, "C30": 0.01}, 500.0)
# Tolerance of the march: the springs of a bond and metal cause more rounding than rubber does.
SHARP = 1e-10
# Shares of a parameter's typical value by which it is changed: large ones err by truncation, small ones by rounding.
STEPS = 10.0 ** np.arange(0.0, -5.0, -0.5)
# Shape of the bushing: short, so that few elements serve.
DIMENSIONS = {"inner_radius": 9.0, "outer_radius": 18.0, "length": 20.0}


def mode_of(one: Effect) -> str:
    return "radial" if one.needs.startswith("a radial channel") else "axial"


def program(timed: bool) -> Program:
    """Up, further, back and to the other side, at two rates; without memory two points are enough."""
    if not timed:
        return Program(np.array([0.8, 1.6]))
    return Program(np.array([0.8, 1.6, 0.4, -0.6, 1.0]), np.array([0.8, 1.6, 4.0, 10.0, 11.0]))


def model_with(active: list[ActiveEffect], mode: str) -> FiniteElementModel:
    return prepare(
        shapes()["plain"](**DIMENSIONS), modes()[mode], RUBBER, COARSE, features=features_of(active)
    )


def full(one: Effect, values: dict[str, float]) -> dict[str, float]:
    """Values by full names, without choices, which are fixed when the model is made."""
    return {f"{one.name}.{key}": value for key, value in values.items() if not one.parameter(key).choices}


def each(case: tuple[Effect, dict[str, str]]) -> str:
    return "-".join([case[0].name, *case[1].values()])


@dataclass(frozen=True)
class Prepared:
    """An effect in a model, its typical values and those where it is off."""

    one: Effect
    model: FiniteElementModel
    typical: dict[str, float]
    off: dict[str, float]

    def force(self, values: dict[str, float]) -> np.ndarray:
        self.model.set_parameters(full(self.one, values))
        return march(self.model, program(self.model.path_dependent), tolerance=SHARP).force

    def slopes(self, values: dict[str, float], names: list[str]) -> np.ndarray:
        self.model.set_parameters(full(self.one, values))
        path = program(self.model.path_dependent)
        return march(
            self.model, path, tolerance=SHARP, sensitivity=[f"{self.one.name}.{n}" for n in names]
        ).sensitivity

    @property
    def free(self) -> list[str]:
        """Parameters that can be changed without a new mesh."""
        return [p.name for p in self.one.parameters if p.name in self.typical and not p.of_mesh]


@cache
def prepared_by_name(name: str, *words: str) -> Prepared:
    one = effects()[name]
    codes = dict(zip((p.name for p in one.parameters if p.choices), words, strict=True))
    started = (
        ActiveEffect(one, {key: float(one.parameter(key).choices.index(word)) for key, word in codes.items()})
        .with_start_values()
        .at(60.0)
    )
    return Prepared(
        one, model_with([started], mode_of(one)), dict(started.values), dict(started.off().values)
    )


def prepared(case: tuple[Effect, dict[str, str]]) -> Prepared:
    return prepared_by_name(case[0].name, *case[1].values())


@cache
def plain_force(mode: str, timed: bool) -> np.ndarray:
    return march(model_with([], mode), program(timed), tolerance=SHARP).force


def difference(case: Prepared, at: dict[str, float], name: str, step: float) -> np.ndarray:
    """Derivative by differences: central, or forward where the value is at its lower bound (third order)."""

    def force(steps: int) -> np.ndarray:
        return case.force(at | {name: at[name] + steps * step})

    if at[name] - step >= case.one.parameter(name).lower:
        return (force(1) - force(-1)) / (2 * step)
    return (-11 * force(0) + 18 * force(1) - 9 * force(2) + 2 * force(3)) / (6 * step)


def check_slopes(case: Prepared, at: dict[str, float], digits: float) -> None:
    exact = case.slopes(at, case.free)
    scale_of_force = np.abs(case.force(at)).max()
    for column, name in enumerate(case.free):
        size = abs(case.typical[name]) or 1.0
        # Size of the derivative; a floor of 1e-7 of the force per typical value for shape parameters of an effect that
        # is off.
        scale = max(np.abs(exact[:, column]).max(), 1e-7 * scale_of_force / size)
        found, good = [], []
        for h in STEPS:
            found.append(difference(case, at, name, h * size))
            good.append(np.abs(found[-1] - exact[:, column]).max() < digits * scale)
            if good[-2:] == [True, True]:
                break
        assert good[-2:] == [True, True], (name, exact[:, column], found)


EACH = pytest.mark.parametrize("chosen", FEATURES, ids=each)


@EACH
def test_an_effect_that_is_off_leaves_the_plain_model(chosen: tuple[Effect, dict[str, str]]) -> None:
    case, one = prepared(chosen), chosen[0]
    plain = plain_force(mode_of(one), case.model.path_dependent)
    digits = NOT_QUITE_OFF.get(one.name, 1e-6)
    np.testing.assert_allclose(case.force(case.off), plain, atol=digits * np.abs(plain).max(), rtol=0)


@EACH
def test_an_effect_acts(chosen: tuple[Effect, dict[str, str]]) -> None:
    case = prepared(chosen)
    plain = plain_force(mode_of(chosen[0]), case.model.path_dependent)
    assert np.abs(case.force(case.typical) - plain).max() > 1e-4 * np.abs(plain).max()


@EACH
def test_slopes_where_it_is_off(chosen: tuple[Effect, dict[str, str]]) -> None:
    case, name = prepared(chosen), chosen[0].name
    check_slopes(case, case.off | BARELY_ON.get(name, {}), DIGITS.get(name, 1e-6))


@EACH
def test_slopes_where_it_acts(chosen: tuple[Effect, dict[str, str]]) -> None:
    case = prepared(chosen)
    check_slopes(case, case.typical, DIGITS.get(chosen[0].name, 1e-6))
