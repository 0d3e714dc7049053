"""The rubber of a case as other programs can express it: law, series of Maxwell branches, Mullins softening."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from bushcli.case import Material
from bushcli.case.case import DENSITY
from bushcli.effects.active import ActiveEffect
from bushcli.effects.exported import OgdenRoxburgh
from forms.law import law as law_called


@dataclass(frozen=True)
class ExportedRubber:
    """A rubber, in MPa and s."""

    law: str
    parameters: Mapping[str, float]  # of the long-term curve
    bulk_modulus: float  # MPa; inf = incompressible
    #: Maxwell branches (g_i, tau_i): ratio of modulus to the law's initial shear modulus, relaxation time in s.
    series: tuple[tuple[float, float], ...] = ()
    softening: OgdenRoxburgh | None = None
    #: Names of the effects that are "series" and "softening".
    effects: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    inexpressible: tuple[str, ...] = ()  # effects of the rubber that no material card can express
    beside: tuple[str, ...] = ()  # effects of the assembly and the rig, which do not belong to the rubber
    density: float = Material.density / DENSITY  # kg/m3

    @property
    def shear_modulus(self) -> float:
        """Initial shear modulus of the law, after a long rest, MPa."""
        return float(law_called(self.law).shear_modulus(**self.parameters))

    @property
    def instantaneous(self) -> float:
        """Ratio of the initial shear modulus in a sudden step to that after a long rest."""
        return 1.0 + sum(g for g, _ in self.series)

    @property
    def features(self) -> frozenset[str]:
        """What a card's remark can be about: the name of the law, "incompressible", "series", "softening"."""
        has = {
            self.law: True,
            "incompressible": math.isinf(self.bulk_modulus),
            "series": bool(self.series),
            "softening": self.softening is not None,
        }
        return frozenset(name for name, is_so in has.items() if is_so)

    def scaled_parameters(self, factor: float) -> Mapping[str, float]:
        """Return the law's parameters for an energy ``factor`` times as large."""
        linear = law_called(self.law).linear
        return {name: value * factor if name in linear else value for name, value in self.parameters.items()}


def rubber_of(material: Material, active: Sequence[ActiveEffect]) -> ExportedRubber:
    """Return the rubber of a material with the effects that act on it.

    A factor on the energy scales the law, the bulk modulus and the softening's energy; a compliance adds to 1/kappa.
    An effect whose amplitudes are off counts as absent.

    Parameters
    ----------
    material : Material
        With parameters.
    active : sequence of ActiveEffect
        Effects of the case, all with values.
    """
    present = [effect for effect in active if not effect.is_off]
    on_card = [
        (effect, None if effect.effect.on_card is None else effect.effect.on_card(effect.values))
        for effect in present
    ]
    parts = {effect.effect.name: part for effect, part in on_card if part is not None}
    inexpressible = [effect for effect, part in on_card if part is None]
    factor = math.prod(part.factor for part in parts.values())
    compliance = 1.0 / material.bulk_modulus + sum(part.compliance for part in parts.values())
    long_term = ExportedRubber(material.law, dict(material.parameters), math.inf)
    series = {name: part.series for name, part in parts.items() if part.series}
    softening = {name: part.softening for name, part in parts.items() if part.softening is not None}
    return ExportedRubber(
        law=material.law,
        parameters=long_term.scaled_parameters(factor),
        bulk_modulus=factor / compliance if compliance else math.inf,
        series=tuple(branch for part in series.values() for branch in part),
        softening=next((replace(mullins, m=mullins.m * factor) for mullins in softening.values()), None),
        effects={"series": tuple(series), "softening": tuple(softening)},
        inexpressible=tuple(effect.name for effect in inexpressible if effect.effect.acts == "rubber"),
        beside=tuple(effect.name for effect in inexpressible if effect.effect.acts != "rubber"),
        density=material.density / DENSITY,
    )
