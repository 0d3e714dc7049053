"""Parameters of a diagnosis in the units of the case file: value, posterior, prior."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from operator import mul

from bushcli.case.unit import case_file_number, case_file_unit
from bushcli.diagnosis.result import DiagnosedChannel, DiagnosedEffect, DiagnosedTable, Quantity
from bushcli.effects.effect import EffectParameter, effects
from bushcli.effects.names import effect_name
from bushcli.report.quantity import number, with_std
from cases.mode import modes


@dataclass(frozen=True)
class ShownQuantity:
    """A parameter in the units of the case file."""

    value: float
    std: float
    lower: float
    upper: float
    unit: str  # "1" for a parameter without a unit
    prior: tuple[float, float] | None = None  # 95 % interval of the prior
    word: str = ""  # value of a choice, in words for people
    with_form_error: float | None = (
        None  # value of the fit that allows for the error of form, if it is another
    )

    @property
    def text(self) -> str:
        """Value, standard deviation and unit, "0.31 ± 0.01 MPa"; for a choice its word."""
        return self.word or with_std(self.value, self.std) + tail(self.unit)

    @property
    def interval(self) -> str:
        """95 % interval of the posterior."""
        return "-" if self.word else span(self.lower, self.upper)

    @property
    def prior_text(self) -> str:
        """95 % interval of the prior."""
        return "-" if self.word or self.prior is None else span(*self.prior)


def shown_quantity(
    name: str, quantity: Quantity, channels: Iterable[DiagnosedChannel | DiagnosedTable]
) -> ShownQuantity:
    """Return a parameter of the most probable model in the units of the case file: angles in degrees."""
    factor, unit_shown = _degrees(quantity.unit)
    scale: Callable[[float], float] = partial(mul, factor)
    if (parameter := _parameter(name)) is not None and parameter.of_channel:
        acts_on, own_channels = effects()[effect_name(name.partition(".")[0])].acts_on, quantity.channels
        acting = [
            channel
            for channel in channels
            if acts_on(channel.mode, channel.kind) and (own_channels is None or channel.name in own_channels)
        ]
        if any(modes()[channel.mode].rotational for channel in acting):
            scale = partial(case_file_number, parameter, rotational=True)
            unit_shown = case_file_unit(parameter, rotational=True)
    value, std, lower, upper = map(scale, (quantity.value, quantity.std, quantity.lower, quantity.upper))
    prior = None if quantity.prior is None else (scale(quantity.prior[0]), scale(quantity.prior[1]))
    with_form_error = None if quantity.with_form_error is None else scale(quantity.with_form_error)
    word = quantity.word.replace("_", " ")
    return ShownQuantity(value, std, lower, upper, unit_shown, prior, word, with_form_error)


def reciprocals(quantity: Quantity) -> dict[str, tuple[float, str]]:
    """Return the parameter under its reciprocal names, in the units of the case file."""
    return {
        name: (factor * value, shown_unit)
        for name, (value, unit_name) in quantity.derived.items()
        for factor, shown_unit in [_degrees(unit_name)]
    }


def reciprocals_text(quantity: Quantity) -> str:
    """Return the parameter under its reciprocal names as text: "r = 3.2"."""
    shown = reciprocals(quantity).items()
    return ", ".join(f"{name} = {number(value)}{tail(unit_name)}" for name, (value, unit_name) in shown)


def parameters_text(effect: DiagnosedEffect, channels: Sequence[DiagnosedChannel | DiagnosedTable]) -> str:
    """Return all parameters of an effect in one line; one with a reciprocal or exponential is shown as that.

    The errors are to first order: that of r = 1/x, or of r = 1/(x + y) with a given y, is r^2 times that of x, that of
    exp(x) is exp(x) times it.
    """
    parts = []
    for name, quantity in effect.parameters.items():
        derived_values, first_value = reciprocals(quantity), 0.0
        parameter = _parameter(f"{effect.name}.{name}")
        for symbol, (value, unit_name) in derived_values.items():
            first_value = first_value or value
            if parameter is not None and parameter.exponential == symbol:
                std = value * quantity.std
            else:
                std = value**2 / abs(first_value) * quantity.std / abs(quantity.value)
            parts.append(f"{symbol} = {with_std(value, std)}{tail(unit_name)}")
        if not derived_values:
            entry = shown_quantity(f"{effect.name}.{name}", quantity, channels)
            text = entry.text
            if entry.std == 0.0 and entry.upper > entry.lower:
                # A scanned dimension stands for the range half-way to the next one.
                text = f"{entry.value:.3g}{tail(entry.unit)} ({span(entry.lower, entry.upper)})"
            parts.append(f"{name}: {entry.word}" if entry.word else f"{name} = {text}")
    return ", ".join(parts)


def tail(unit_name: str) -> str:
    """Return a unit with the space before it; empty for the unit "1"."""
    return "" if unit_name == "1" else f" {unit_name}"


def span(lower: float, upper: float) -> str:
    """Return an interval in words: "0.1 to 0.3"."""
    return f"{number(lower)} to {number(upper)}"


def _parameter(name: str) -> EffectParameter | None:
    effect, _, parameter = name.partition(".")
    if effect_name(effect) not in effects():
        return None
    return next((p for p in effects()[effect_name(effect)].parameters if p.name == parameter), None)


def _degrees(unit_name: str) -> tuple[float, str]:
    """Return factor and unit in the case file of an internal unit; "rad" may be numerator or denominator."""
    above, _, below = unit_name.partition("/")
    if above == "rad":
        return math.degrees(1.0), unit_name.replace("rad", "degrees", 1)
    return (math.radians(1.0), f"{above}/degree") if below == "rad" else (1.0, unit_name)
