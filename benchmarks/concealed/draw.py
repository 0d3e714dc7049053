"""Draw specimens and concealed effects: everything depends on the seed only, not on earlier draws.

Every 25 consecutive seeds are a shuffled deck, so that every effect of the catalogue occurs equally often: each once
alone, five recordings without any, three pairs, and one effect from outside the catalogue.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.concealed.sizes import SIZES
from benchmarks.concealed.truth import Kind, Specimen
from bushcli.effects.effect import effects
from cases.stability import coupon_limits
from forms.law import law

NOTHINGS, PAIRS, OUTSIDERS = 5, 3, 1
# Effects that are concealed: those of the catalogue when the seeds were first used. A new effect must not change what a
# seed conceals.
CONCEALED = tuple(sorted(SIZES))
# Share of poor programs among the recordings with one effect or none.
POOR = 0.3
# Channels that an effect needs (`Effect.needs`); other effects need only one.
NEEDS: Mapping[str, tuple[tuple[str, ...], ...]] = {
    "compressibility": (("axial", "radial"), ("axial", "torsional", "radial")),
    "cure_shrinkage": (("axial", "radial"), ("axial", "torsional", "radial")),
    "sleeve_compliance": (("axial", "radial"), ("axial", "torsional", "radial")),
    "swaging": (("axial", "radial"), ("axial", "torsional", "radial")),
    "misalignment": (("radial",), ("axial", "radial")),
    "debonding": (("axial", "torsional"), ("axial", "radial")),
    "rig_compliance": (("axial", "torsional"), ("axial", "radial")),
    "batch_stiffness": (("axial",), ("axial", "torsional")),
}
ANY = (("axial",), ("axial",), ("axial", "torsional"), ("axial", "radial"))
# With memory the path is marched step by step, which takes minutes in three dimensions, here and in every refit.
MEMORY = ("friction", "mullins", "viscoelasticity")
FLAT = (*(("axial",),) * 3, *(("axial", "torsional"),) * 2, ("axial", "radial"))
# Channels for effects of the rig, which has other values in each channel.
ALONE = (("axial",), ("axial",), ("radial",))
# Stretches between which a law has to be stable; local stretches in the bushings below reach 0.6 and 1.7.
STABLE = (0.45, 2.4)


@dataclass(frozen=True)
class Concealed:
    """What a seed conceals.

    Attributes
    ----------
    kind
    names : tuple of str
        Of the effects.
    program : str
    channels : tuple of str
    coupons : bool
    """

    kind: Kind
    names: tuple[str, ...]
    program: str
    channels: tuple[str, ...]
    coupons: bool


def deck() -> list[tuple[Kind, str]]:
    """Kinds of 25 recordings, with the effect of those that have one."""
    singles: list[tuple[Kind, str]] = [("single", name) for name in CONCEALED]
    others: dict[Kind, int] = {"none": NOTHINGS, "pair": PAIRS, "outside": OUTSIDERS}
    return singles + [(kind, "") for kind, times in others.items() for _ in range(times)]


def draw_concealed(seed: int) -> Concealed:
    """Draw what a seed conceals."""
    cards = deck()
    order = np.random.default_rng([seed // len(cards), 1]).permutation(len(cards))
    kind, name = cards[order[seed % len(cards)]]
    rng = np.random.default_rng([seed, 2])
    if kind == "pair":
        return _pair(rng)
    if kind == "outside":
        return Concealed(kind, (), "rich", ("axial",), False)
    coupons = name == "batch_stiffness" or (kind == "none" and rng.random() < 0.2)
    if not coupons and rng.random() < POOR:
        channel = "axial" if not name or effects()[name].acts_on("axial") else "radial"
        program = str(rng.choice(["ramp", "loop"]))
        return Concealed(kind, (name,) if name else (), program, (channel,), False)
    return Concealed(kind, (name,) if name else (), "rich", _channels(rng, (name,) if name else ()), coupons)


def _pair(rng: np.random.Generator) -> Concealed:
    """Two effects that are not each other's rivals, on channels that serve both."""
    names = [name for name in CONCEALED if name != "batch_stiffness"]
    while True:
        first, second = sorted(str(name) for name in rng.choice(names, 2, replace=False))
        rivals = second in effects()[first].rivals or first in effects()[second].rivals
        lonely = effects()[first].of_channel or effects()[second].of_channel
        many = [n for n in (first, second) if n in NEEDS and all(len(c) > 1 for c in NEEDS[n])]
        if rivals or (lonely and many):
            continue
        channels = _channels(rng, (first, second))
        if all(any(effects()[name].acts_on(c) for c in channels) for name in (first, second)):
            return Concealed("pair", (first, second), "rich", channels, False)


def _channels(rng: np.random.Generator, names: tuple[str, ...]) -> tuple[str, ...]:
    """Channels that serve all the effects: the longest of the sets that they need."""
    asked = []
    for name in names or ("",):
        lonely = bool(name) and effects()[name].of_channel
        menu = NEEDS.get(name, ALONE if lonely else FLAT if name in MEMORY else ANY)
        asked.append(menu[rng.integers(len(menu))])
    if "misalignment" in names and any(n and effects()[n].of_channel for n in names):
        return ("radial",)
    return max(asked, key=len)


def specimen(rng: np.random.Generator, channels: tuple[str, ...]) -> Specimen:
    """Draw a bushing, a stable law and amplitudes."""
    inner, thickness = float(rng.uniform(8.0, 14.0)), float(rng.uniform(6.0, 11.0))
    length = float(rng.uniform(2.8, 4.5)) * thickness
    dimensions = {"inner_radius": _round(inner), "outer_radius": _round(inner + thickness)}
    if rng.random() < 0.7:
        shape = "plain"
        dimensions["length"] = _round(length)
    else:
        shape = "tapered"
        dimensions |= {
            "inner_length": _round(length),
            "outer_length": _round(length * rng.uniform(0.75, 0.95)),
        }
    name, parameters = stable_law(rng)
    # Shear of the rubber: displacement over thickness, in torsion the shear at the inner bond.
    turn = 2 * (inner + thickness) ** 2 / ((inner + thickness) ** 2 - inner**2)
    reach = {
        "axial": rng.uniform(0.35, 0.65) * thickness,
        "radial": rng.uniform(0.08, 0.15) * thickness,
        "torsional": rng.uniform(0.3, 0.6) / turn,
    }
    bulk = math.inf if rng.random() < 0.3 else 2000.0
    return Specimen(shape, dimensions, name, parameters, bulk, {c: float(reach[c]) for c in channels})


def stable_law(rng: np.random.Generator) -> tuple[str, dict[str, float]]:
    """Draw a law and constants (MPa) that are stable in all coupon tests between the stretches STABLE."""
    name = str(rng.choice(["yeoh", "ogden", "mooney_rivlin", "gent"], p=[0.64, 0.12, 0.12, 0.12]))
    while True:
        mu = float(rng.uniform(0.5, 1.6))
        if name == "yeoh":
            values = {
                "C10": mu / 2,
                "C20": -mu / 2 * rng.uniform(0.01, 0.12),
                "C30": mu / 2 * rng.uniform(0.003, 0.03),
            }
        elif name == "ogden":
            share, first, second = rng.uniform(0.7, 0.95), rng.uniform(1.3, 3.5), -rng.uniform(1.5, 3.5)
            # The initial shear modulus is sum mu_i alpha_i / 2.
            values = {
                "mu1": 2 * mu * share / first,
                "alpha1": first,
                "mu2": 2 * mu * (1 - share) / second,
                "alpha2": second,
            }
        elif name == "mooney_rivlin":
            share = rng.uniform(0.03, 0.3)
            values = {"C10": mu / 2 * (1 - share), "C01": mu / 2 * share}
        else:
            values = {"mu": mu, "Jm": rng.uniform(8.0, 50.0)}
        values = {key: _round(float(value), 4) for key, value in values.items()}
        if stable(name, values):
            return name, values


def stable(name: str, parameters: Mapping[str, float]) -> bool:
    """Whether a law is stable in all coupon tests between the stretches STABLE."""
    limits = coupon_limits(law(name), parameters, lower=STABLE[0], upper=STABLE[1])
    return all(low == 0.0 and high == math.inf for low, high in limits.values())


def _round(value: float, digits: int = 3) -> float:
    """Round to significant digits, as in a drawing."""
    return float(f"{value:.{digits}g}")
