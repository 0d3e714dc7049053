"""Intervals of values over several models, against quantiles of samples and closed forms."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bushcli.diagnosis import intervals
from bushcli.diagnosis.intervals import Component, components, interval, scanned_interval
from bushcli.diagnosis.values import IMPLAUSIBLE, held_quantity
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effects
from bushcli.evidence.prior import ParameterPrior


def test_one_model_gives_its_own_interval() -> None:
    low, high = interval([Component(0.3, 5.0, 0.5, False)])
    assert (low, high) == pytest.approx((5.0 - 1.959964 * 0.5, 5.0 + 1.959964 * 0.5), rel=1e-6)


@pytest.mark.parametrize("value", [4.0, -4.0])
def test_a_logarithmic_value_keeps_its_sign(value: float) -> None:
    found = interval([Component(1.0, value, 4.0, True)])
    ends = [value * math.exp(sign * 1.959964) for sign in (-1.0, 1.0)]
    assert found == pytest.approx((min(ends), max(ends)), rel=1e-6)


def test_models_are_weighted_with_their_probabilities() -> None:
    """Quantiles of two million samples of the mixture; their standard error is some 0.004."""
    parts = [Component(0.6, 2.0, 0.2, False), Component(0.3, 4.0, 1.0, True)]
    random = np.random.default_rng(1)
    first = random.random(2_000_000) < 2.0 / 3.0
    samples = np.where(
        first, random.normal(2.0, 0.2, first.size), 4.0 * np.exp(random.normal(0.0, 0.25, first.size))
    )
    assert interval(parts) == pytest.approx(tuple(np.quantile(samples, [0.025, 0.975])), abs=0.01)


def test_a_value_without_width_is_a_step() -> None:
    assert interval([Component(1.0, 2.0, 0.0, False)]) == (2.0, 2.0)


def test_a_scanned_value_stands_for_its_surroundings() -> None:
    """With 1, 2, 4 mm, the value 2 stands for sqrt(2) to sqrt(8) mm."""
    effect = effects()["sleeve_compliance"]
    values = {p.name: p.start for p in effect.parameters} | {"thickness": 2.0}
    active = ActiveEffect(effect, values)
    one = SimpleNamespace(model=SimpleNamespace(values={"sleeve_compliance.thickness": 2.0}), probability=0.4)
    low, high = scanned_interval(active, effect.parameter("thickness"), [one])  # type: ignore[list-item]
    assert low == pytest.approx(math.sqrt(2.0) * 2.0**0.025)
    assert high == pytest.approx(math.sqrt(2.0) * 2.0**0.975)
    other = SimpleNamespace(
        model=SimpleNamespace(values={"sleeve_compliance.thickness": 4.0}), probability=0.4
    )
    low, high = scanned_interval(active, effect.parameter("thickness"), [one, other])  # type: ignore[list-item]
    assert (low, high) == pytest.approx((math.sqrt(2.0) * 2.0**0.05, math.sqrt(8.0) * 2.0**0.95))


def test_a_fixed_value_far_out_in_its_prior_is_called_so() -> None:
    """Sleeves of 2 mm, where 2.2 mm are usual, and where foils of 0.1 mm are."""
    effect = effects()["sleeve_compliance"]
    parameter = effect.parameter("thickness")
    active = ActiveEffect(effect, {p.name: p.start for p in effect.parameters} | {"thickness": 2.0})
    model: Any = SimpleNamespace(
        model=SimpleNamespace(values={"sleeve_compliance.thickness": 2.0}), probability=1.0
    )
    usual, foils = (
        held_quantity(active, parameter, ParameterPrior(prior, {}, one_sided=True), [model])
        for prior in (parameter.prior, replace(parameter.prior, low=0.1))
    )
    assert usual.prior_source == parameter.prior.source
    assert usual.prior_tail > 0.5
    assert foils.prior_tail < IMPLAUSIBLE


def weighed(active: ActiveEffect, probability: float) -> SimpleNamespace:
    """A model with one effect, all of whose values are fitted."""
    fitted = SimpleNamespace(
        names=tuple(f"{active.name}.{name}" for name in active.values),
        x=np.array(list(active.values.values())),
        model=SimpleNamespace(effects=(active,), law="yeoh"),
    )
    state = SimpleNamespace(fitted=fitted, priors={}, evidence=None)
    return SimpleNamespace(state=state, predicted=None, probability=probability)


@pytest.mark.parametrize(
    ("name", "stem", "first"), [("viscoelasticity", "tau", "1"), ("friction", "slip", "")]
)
def test_branches_are_matched_in_the_order_of_their_times(monkeypatch, name, stem, first) -> None:
    """The same two branches, numbered the other way round, and three of them, of which none is one of the two."""

    def model(probability: float, **values: float) -> SimpleNamespace:
        named = {key.replace("x", stem).replace("_", first): value for key, value in values.items()}
        return weighed(ActiveEffect(effects()[name], named), probability)

    monkeypatch.setattr(intervals, "standard_errors", lambda names, _: dict.fromkeys(names, 0.01))
    models = [
        model(0.5, g_=0.1, x_=0.3, g2=0.2, x2=4.0),
        model(0.3, g_=0.22, x_=4.1, g2=0.11, x2=0.31),
        model(0.2, g_=0.05, x_=0.1, g2=0.1, x2=1.0, g3=0.1, x3=9.0),
    ]
    found = {
        key: [one.value for one in components(key, models, effect=name)]
        for key in (f"g{first}", f"{stem}{first}", "g2", f"{stem}2")
    }
    assert list(found.values()) == [[0.1, 0.11], [0.3, 0.31], [0.2, 0.22], [4.0, 4.1]]


def test_the_gain_of_one_channel_is_not_that_of_another(monkeypatch) -> None:
    """Either is called gain.error in a model that has no other gain."""
    gain = effects()["gain"]

    def model(channel: str, value: float) -> SimpleNamespace:
        active = ActiveEffect(gain, {"error": value}, (channel,)).with_start_values()
        fitted = SimpleNamespace(
            names=("gain.error",), x=np.array([value]), model=SimpleNamespace(effects=(active,), law="yeoh")
        )
        return SimpleNamespace(
            state=SimpleNamespace(fitted=fitted, priors={}, evidence=None), predicted=None, probability=0.5
        )

    monkeypatch.setattr(intervals, "standard_errors", lambda names, _: dict.fromkeys(names, 0.008))
    both = [model("axial", 0.119), model("torsional", -0.1)]
    (one,) = components(gain.amplitudes[0].name, both, effect="gain@axial")
    assert one.value == 0.119
