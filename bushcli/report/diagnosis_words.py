"""A diagnosis in words: its headline, names of models, and parameters in the units of the case file."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from bushcli.casefile.unit import outside, unit
from bushcli.diagnosis.result import DiagnosedChannel, Diagnosis, Hypothesis, Named, Quantity
from bushcli.effect import EffectParameter, effect_name, effects, spoken
from bushcli.report.quantity import listed, number, with_std
from cases.mode import modes

# So many rivals go into the headline.
_RIVALS = 3
# Kass and Raftery (1995), Bayes factors, doi:10.1080/01621459.1995.10476572: 2 ln of the Bayes factor.
_DECISIVE, _STRONG, _POSITIVE = 10.0, 6.0, 2.0


@dataclass(frozen=True)
class ShownQuantity:
    """A parameter in the units of the case file.

    Attributes
    ----------
    value, std, lower, upper : float
    unit : str
        "1" where there is none.
    """

    value: float
    std: float
    lower: float
    upper: float
    unit: str

    @property
    def text(self) -> str:
        """Value, standard error and unit: "0.31 ± 0.01 MPa"."""
        return with_std(self.value, self.std) + tail(self.unit)


def headline(found: Diagnosis) -> str:
    """One sentence, without its full stop."""
    names = listed(effect_names(found))
    match found.verdict:
        case "explained":
            return f"Explained: {found.material.law} meets the recordings to their noise"
        case "missing_physics":
            others = [model_name(rival) for rival in found.rivals[1:]]
            if len(others) > _RIVALS:
                others = [*others[: _RIVALS - 1], "others"]
            either = "".join(f", or {name}" for name in others)
            return f"Missing physics: {names}{either}" + (": these recordings cannot tell" if others else "")
        case "law_too_poor":
            return f"Law too poor: {found.plain.law}; {found.material.law} does better without any effect"
        case "unexplained":
            return f"Unexplained: {nothing(found)} accounts for the misfit" + (
                f"; {names} helps, but not enough" if names else ""
            )


def effect_names(found: Diagnosis) -> list[str]:
    """The effects that were found; with their channels where one is there twice."""
    names = [effect_name(one.name) for one in found.effects]
    return [
        one.label if names.count(name) > 1 else name for one, name in zip(found.effects, names, strict=True)
    ]


def nothing(found: Diagnosis) -> str:
    """What has been tried, where none of it helped."""
    if found.asked is None:
        return "nothing in the catalogue of effects"
    return f"nothing among the effects asked for ({', '.join(found.asked)})"


def tone(found: Diagnosis) -> Literal["good", "bad", "plain"]:
    """How good the news is."""
    tones: dict[str, Literal["good", "bad", "plain"]] = {"explained": "good", "unexplained": "bad"}
    return tones.get(found.verdict, "plain")


def model_name(names: Sequence[str]) -> str:
    """A set of effects: "mullins + friction", or "no effect"."""
    return " + ".join(map(spoken, names)) or "no effect"


def strength(evidence: float) -> str:
    """What a difference of BIC is called."""
    if not math.isfinite(evidence):
        return "not weighed"
    if evidence >= _DECISIVE:
        return "decisive"
    return "strong" if evidence >= _STRONG else "positive" if evidence >= _POSITIVE else "weak"


def shown(name: str, quantity: Quantity, channels: Iterable[DiagnosedChannel]) -> ShownQuantity:
    """A parameter of the final model at the door: angles in degrees.

    Parameters
    ----------
    name
        Full name, "mullins.m"; of the law without a point.
    quantity
    channels
        Those of the diagnosis: a displacement of a rotational channel is an angle.
    """
    found = _parameter(name)
    if found is not None and found.of_channel and _is_rotational(name, quantity, channels):
        ends = [outside(found, v, rotational=True) for v in (quantity.value, quantity.std)]
        ends += [outside(found, v, rotational=True) for v in (quantity.lower, quantity.upper)]
        return ShownQuantity(ends[0], ends[1], ends[2], ends[3], unit(found, rotational=True))
    factor, name_of_unit = _degrees(quantity.unit)
    return ShownQuantity(
        factor * quantity.value,
        factor * quantity.std,
        factor * quantity.lower,
        factor * quantity.upper,
        name_of_unit,
    )


def derived(quantity: Quantity) -> dict[str, tuple[float, str]]:
    """The same parameter under the names by which the field knows it, at the door."""
    return {
        name: (_degrees(of)[0] * value, _degrees(of)[1]) for name, (value, of) in quantity.derived.items()
    }


def derived_text(quantity: Quantity) -> str:
    """The same in words: "r = 3.2"."""
    return ", ".join(f"{name} = {number(value)}{tail(of)}" for name, (value, of) in derived(quantity).items())


def parameters_text(effect: Named, channels: Sequence[DiagnosedChannel]) -> str:
    """All parameters of an effect in a line: "inverse_r 0.31 ± 0.01 (r = 3.2), m 0.10 ± 0.02 MPa"."""
    parts = []
    for name, quantity in effect.parameters.items():
        also = derived_text(quantity)
        text = shown(f"{effect.name}.{name}", quantity, channels).text
        parts.append(f"{name} {text}" + (f" ({also})" if also else ""))
    return ", ".join(parts)


def amplitudes(hypothesis: Hypothesis, channels: Sequence[DiagnosedChannel]) -> dict[str, ShownQuantity]:
    """First-order estimates of the score test by the effect's own names, at the door; without errors."""
    doors = {}
    for name, value in hypothesis.amplitude.items():
        own = name.rpartition(".")[2]
        full = f"{hypothesis.name}.{own}"
        found = _parameter(full)
        unit_ = found.unit if found else "1"
        quantity = Quantity(value, math.nan, unit_, "", math.nan, math.nan, channels=hypothesis.channels)
        doors[own] = shown(full, quantity, channels)
    return doors


def amplitude_text(hypothesis: Hypothesis, channels: Sequence[DiagnosedChannel]) -> str:
    """The same in a line: "inverse_r 0.28"."""
    doors = amplitudes(hypothesis, channels)
    text = ", ".join(f"{name} {number(door.value, 2)}{tail(door.unit)}" for name, door in doors.items())
    return text + (f" ({', '.join(hypothesis.channels)})" if hypothesis.channels and text else "")


def _parameter(name: str) -> EffectParameter | None:
    effect, _, own = name.partition(".")
    if effect_name(effect) not in effects():
        return None
    return next((p for p in effects()[effect_name(effect)].parameters if p.name == own), None)


def _is_rotational(name: str, quantity: Quantity, channels: Iterable[DiagnosedChannel]) -> bool:
    effect, of = effects()[effect_name(name.partition(".")[0])], quantity.channels
    acting = [one for one in channels if effect.acts_on(one.mode) and (of is None or one.name in of)]
    return any(modes()[one.mode].rotational for one in acting)


def _degrees(of: str) -> tuple[float, str]:
    """Factor and unit at the door of a unit inside; "rad" may stand above or below the line."""
    above, _, below = of.partition("/")
    if above == "rad":
        return math.degrees(1.0), of.replace("rad", "degrees", 1)
    return (math.radians(1.0), f"{above}/degree") if below == "rad" else (1.0, of)


def tail(of: str) -> str:
    """A unit behind a number; nothing where there is none."""
    return "" if of == "1" else f" {of}"
