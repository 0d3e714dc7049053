"""How large each effect is drawn: usual parameters for a bushing and a program, and the range of its size.

A *size* multiplies all amplitudes of an effect; shape parameters stay as drawn. The search for the size (`make`) stays
within the range, which is known from the literature and from practice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effect


@dataclass(frozen=True)
class Situation:
    """Quantities on which usual values depend.

    Attributes
    ----------
    thickness, length : float
        Of the rubber, mm.
    amplitude : float
        Amplitude of the first channel on which the effect acts, mm (rad in torsion).
    force : float
        Largest plain force of that channel, N (N mm).
    stiffness : float
        Largest secant stiffness of a channel in translation, N/mm.
    duration, fast : float
        Duration of the first channel's program, and of its fastest leg over the amplitude, s.
    shear : float
        The law's initial shear modulus, MPa.
    strain : float
        Approximate largest mean shear strain.
    """

    thickness: float
    length: float
    amplitude: float
    force: float
    stiffness: float
    duration: float
    fast: float
    shear: float
    strain: float


@dataclass(frozen=True)
class Sizes:
    """Usual values, and the factors by which they may be smaller and larger."""

    values: Callable[[np.random.Generator, Situation], Mapping[str, float]]
    least: float
    most: float


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _mullins(rng: np.random.Generator, s: Situation) -> Mapping[str, float]:
    # Energy of the mean shear; local energies are several times as large.
    energy = 0.5 * s.shear * s.strain**2
    return {"inverse_r": 0.3, "m": energy * _log(rng, 0.15, 0.8), "beta": float(rng.uniform(0.0, 0.2))}


def _viscoelasticity(rng: np.random.Generator, s: Situation) -> Mapping[str, float]:
    # Between the durations of fast and slow legs, so that the forces depend on the rate.
    return {"g1": 0.2, "tau1": s.fast * _log(rng, 0.7, 12.0)}


def _friction(rng: np.random.Generator, s: Situation) -> Mapping[str, float]:
    return {"g": 0.2, "slip": s.strain * _log(rng, 0.04, 0.25)}


def _bump_stop(rng: np.random.Generator, s: Situation) -> Mapping[str, float]:
    # Cycles reach the whole amplitude on the positive side only.
    gap = float(rng.uniform(0.5, 0.8))
    return {"stiffness": s.force / s.amplitude, "gap": gap * s.amplitude}


def _offset(rng: np.random.Generator, s: Situation) -> Mapping[str, float]:
    # Drawn independently: with equal shares and signs they would cancel.
    force, displacement = (_sign(rng) * _log(rng, 0.005, 0.04) for _ in range(2))
    return {"force": force * s.force, "displacement": displacement * s.amplitude}


SIZES: Mapping[str, Sizes] = {
    "batch_stiffness": Sizes(lambda r, s: {"log_factor": _sign(r) * 0.1}, 0.1, 6.0),
    "bump_stop": Sizes(_bump_stop, 0.05, 10.0),
    # Bulk over shear modulus 200; values of 50 to 10,000 are known.
    "compressibility": Sizes(lambda r, s: {"compliance": 1 / (200 * s.shear)}, 0.02, 4.0),
    "cure_shrinkage": Sizes(lambda r, s: {"shrinkage": 0.01}, 0.1, 3.0),
    "debonding": Sizes(lambda r, s: {"length": 0.1 * s.length}, 0.15, 3.0),
    "free_play": Sizes(lambda r, s: {"half_width": 0.02 * s.amplitude}, 0.05, 5.0),
    "friction": Sizes(_friction, 0.05, 4.0),
    "misalignment": Sizes(lambda r, s: {"offset": _sign(r) * 0.03 * s.thickness}, 0.05, 4.0),
    "mullins": Sizes(_mullins, 0.05, 2.3),
    "offset": Sizes(_offset, 0.05, 4.0),
    "permanent_set": Sizes(lambda r, s: {"set": 0.03}, 0.05, 5.0),
    "rig_compliance": Sizes(lambda r, s: {"compliance": 0.03 / s.stiffness}, 0.05, 8.0),
    # Polyamide has size 1; steel has 0.01, soft plastics have 5.
    "sleeve_compliance": Sizes(
        lambda r, s: {"compliance": 2e-4, "thickness": float(r.choice([1.0, 2.0, 4.0]))}, 0.02, 5.0
    ),
    "swaging": Sizes(lambda r, s: {"reduction": 0.02 * s.thickness}, 0.05, 3.0),
    "time_lag": Sizes(lambda r, s: {"lag": _sign(r) * 0.02 * s.fast}, 0.02, 5.0),
    "viscoelasticity": Sizes(_viscoelasticity, 0.03, 4.0),
}


def effect_of_size(name: str, values: Mapping[str, float], size: float) -> ActiveEffect:
    """An effect with `size` times its usual amplitudes, within what the catalogue admits."""
    known = effect(name)
    scaled = dict(values)
    for parameter in known.amplitudes:
        if parameter.name in scaled:
            value = float(parameter.off or 0.0) + size * (
                values[parameter.name] - float(parameter.off or 0.0)
            )
            scaled[parameter.name] = float(np.clip(value, parameter.lower, parameter.upper))
    return ActiveEffect(known, scaled)
