"""The rubber of a case as other programs can express it: law, series of Maxwell branches, Mullins softening."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bushcli.case import Material
from bushcli.case.case import DENSITY
from bushcli.effects.active import ActiveEffect
from forms.law import law as law_called


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
class ExportedRubber:
    """A rubber, in MPa and s.

    Attributes
    ----------
    law : str
    parameters : mapping of str to float
        By name; of the long-term curve.
    bulk_modulus : float
        MPa; ``inf`` = incompressible.
    series : tuple of (float, float)
        Maxwell branches (g_i, tau_i): ratio of modulus to the law's initial shear modulus, relaxation time in s.
    softening : OgdenRoxburgh or None
    inexpressible : tuple of str
        Names of effects of the rubber that no material card can express.
    beside : tuple of str
        Names of effects of the assembly and the rig, which do not belong to the rubber.
    density : float
        kg/m3.
    """

    law: str
    parameters: Mapping[str, float]
    bulk_modulus: float
    series: tuple[tuple[float, float], ...] = ()
    softening: OgdenRoxburgh | None = None
    inexpressible: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    density: float = Material.density / DENSITY

    @property
    def shear_modulus(self) -> float:
        """Initial shear modulus of the law, after a long rest, MPa."""
        return float(law_called(self.law).shear_modulus(**self.parameters))

    @property
    def instantaneous(self) -> float:
        """Ratio of the initial shear modulus in a sudden step to that after a long rest."""
        return 1.0 + sum(g for g, _ in self.series)

    def stiffened(self, factor: float) -> Mapping[str, float]:
        """Return the law's parameters for an energy ``factor`` times as large."""
        linear = law_called(self.law).linear
        return {name: value * factor if name in linear else value for name, value in self.parameters.items()}


def rubber_of(material: Material, active: Sequence[ActiveEffect]) -> ExportedRubber:
    """Return the rubber of a material with the effects that act on it.

    Another batch scales the law, the bulk modulus and the softening's energy; compressibility adds to 1/kappa.
    An effect whose amplitudes are off counts as absent.

    Parameters
    ----------
    material : Material
        With parameters.
    active : sequence of ActiveEffect
        Effects of the case, all with values.
    """
    values = {one.effect.name: one.values for one in active if _acts(one)}
    factor = math.exp(values.get("batch_stiffness", {}).get("log_factor", 0.0))
    compliance = 1.0 / material.bulk_modulus + values.get("compressibility", {}).get("compliance", 0.0)
    viscous, mullins = values.get("viscoelasticity", {}), values.get("mullins")
    pairs = [(viscous.get(f"g{i}", 0.0), viscous.get(f"tau{i}", 1.0)) for i in (1, 2, 3)]
    plain = ExportedRubber(material.law, dict(material.parameters), math.inf)
    left = [one for one in active if _acts(one) and not one.effect.on_card]
    return ExportedRubber(
        law=material.law,
        parameters=plain.stiffened(factor),
        bulk_modulus=factor / compliance if compliance else math.inf,
        series=tuple((g, tau) for g, tau in pairs if g > 0.0),
        softening=None
        if mullins is None
        else OgdenRoxburgh(mullins["inverse_r"], mullins["m"] * factor, mullins["beta"]),
        inexpressible=tuple(one.name for one in left if one.effect.acts == "rubber"),
        beside=tuple(one.name for one in left if one.effect.acts != "rubber"),
        density=material.density / DENSITY,
    )


def _acts(one: ActiveEffect) -> bool:
    return any(one.values.get(p.name, p.off) != p.off for p in one.effect.amplitudes)
