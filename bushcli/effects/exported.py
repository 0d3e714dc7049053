"""What an effect is in files of other programs: a part of a material card, a state of a force law."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

#: States of a force law (`bushcli.export.fmu.force_law`) that an effect can be; "curve" is within its curves.
ForceLawPart = Literal["curve", "maxwell", "clock", "sliders", "softening", "set", "warming"]


@dataclass(frozen=True)
class OgdenRoxburgh:
    """Mullins effect after Ogden and Roxburgh.

    Attributes
    ----------
    inverse_r, beta : float
        Dimensionless.
    m : float
        MPa.
    """

    inverse_r: float
    m: float
    beta: float


@dataclass(frozen=True)
class CardPart:
    """What an effect adds to a material card.

    Attributes
    ----------
    factor : float
        On the energy of the rubber.
    compliance : float
        1/MPa, added to 1 / bulk modulus.
    series : tuple of (float, float)
        Maxwell branches (g_i, tau_i): ratio of modulus to the law's initial shear modulus, relaxation time in s.
    softening : OgdenRoxburgh or None
    """

    factor: float = 1.0
    compliance: float = 0.0
    series: tuple[tuple[float, float], ...] = ()
    softening: OgdenRoxburgh | None = None
