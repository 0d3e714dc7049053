"""Temperature: all relaxation times shift with it, and the law's moduli follow the absolute temperature.

A rubber at the temperature T behaves as at the reference temperature with all times divided by a_T, whatever its
branches. WLF: log10 a_T = -C1 (T - Tr) / (C2 + T - Tr). Arrhenius: ln a_T = (E/R) (1/T - 1/Tr), which is WLF with
C2 = Tr and C1 = E / (R Tr ln 10), in kelvins. The moduli, the branches' included, are multiplied by (T/Tr)^exponent,
in kelvins: 1 for an ideal network, whose elasticity is that of entropy. The branches' moduli may have a factor of their
own, exp((network/R) (1/T - 1/Tr)): bonds of the filler network, which heat opens. The amplitudes are C1 (E), the
exponent and the energy of the network; at the reference temperature there is no effect.

References
----------
Williams, Landel and Ferry (1955), The temperature dependence of relaxation mechanisms in amorphous polymers and other
glass-forming liquids, J. Am. Chem. Soc. 77:3701-3707, doi:10.1021/ja01619a008.
Wang (1998), Effect of polymer-filler and filler-filler interactions on dynamic properties of filled vulcanizates,
Rubber Chem. Technol. 71:520-589, doi:10.5254/1.3538492: filler networks.
Chadwick (1974), Thermo-mechanics of rubberlike materials, Philos. Trans. R. Soc. A 276:371-403,
doi:10.1098/rsta.1974.0026: entropic elasticity.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from bushcli.effects.effect import Amplitude, Effect, EffectParameter
from bushcli.effects.prior import Prior

if TYPE_CHECKING:
    from cases.feature import Feature, Values
    from forms.law import Scalar

#: Degrees C in kelvins; gas constant, kJ/(mol K).
ZERO, GAS = 273.15, 8.314462618e-3
#: Kelvins of C2 + T - Tr below which WLF is continued with a constant divisor, and largest |ln a_T|: beyond either the
#: rubber is glass, and numbers would overflow (judgement).
_GLASS, _LARGEST = 5.0, 100.0


def factors_at_temperature(values: Values, temperature: Scalar, shift: str) -> tuple[Scalar, Scalar, Scalar]:
    """Return the factors on the law's moduli, on the branches' moduli beyond these, and on the relaxation times."""
    above = temperature - values["reference"]
    absolute = values["reference"] + ZERO
    # (1/T - 1/Tr) / R, mol/kJ.
    colder = -above / (absolute * (absolute + above)) / GAS
    if shift == "wlf":
        divisor = values["C2"] + above
        log = -math.log(10.0) * values["C1"] * above / (divisor if divisor.real > _GLASS else _GLASS)
    else:
        log = values["E"] * colder
    log = log if abs(log.real) < _LARGEST else math.copysign(_LARGEST, log.real)
    bonded = np.exp(values["network"] * colder) if "network" in values else 1.0
    return (1.0 + above / absolute) ** values["exponent"], bonded, np.exp(log)


def feature(shift: str) -> Feature:
    """Return the change of moduli and times."""
    from cases.feature import Feature

    return Feature(heated=partial(factors_at_temperature, shift=shift))


EFFECT = Effect(
    name="temperature",
    title="Temperature",
    summary="Warm rubber relaxes sooner: rate and frequency count as others, and its modulus follows the temperature.",
    acts="rubber",
    parameters=(
        EffectParameter(
            "shift",
            "1",
            "law of the shift of all relaxation times",
            (0.0, 0.0, 1.0),
            of_mesh=True,
            choices=("wlf", "arrhenius"),
            prior=Prior(
                "choice", 2.0, source="WLF is the polymer's near its glass transition, Arrhenius the filler's"
            ),
        ),
        EffectParameter(
            "reference",
            "degC",
            "temperature at which all other numbers hold",
            (20.0, -100.0, 200.0),
            of_mesh=True,
            prior=Prior("t", 30.0, source="a convention: the same rubber can be stated at any temperature"),
        ),
        Amplitude(
            "C1",
            "1",
            "WLF: decades between the reference and far above it",
            (6.0, 0.0, 50.0),
            under="wlf",
            prior=Prior(
                "half_t", 10.0, source="8.86 some 50 K above the glass transition (Williams et al. 1955)"
            ),
        ),
        EffectParameter(
            "C2",
            "K",
            "WLF: from the reference down to where times become infinite",
            (100.0, 20.0, 1000.0),
            under="wlf",
            prior=Prior(
                "log_normal",
                101.6,
                0.4,
                source="101.6 K some 50 K above the glass transition (Williams et al. 1955)",
            ),
        ),
        Amplitude(
            "E",
            "kJ/mol",
            "Arrhenius: activation energy",
            (40.0, 0.0, 500.0),
            under="arrhenius",
            prior=Prior(
                "half_t",
                60.0,
                source="engineering judgement: some tens of kJ/mol for filler networks (Wang 1998)",
            ),
        ),
        Amplitude(
            "exponent",
            "1",
            "power of the absolute temperature with which moduli grow: 1 for an ideal network",
            (1.0, -30.0, 30.0),
            prior=Prior(
                "t", 2.0, source="1 for entropic elasticity (Chadwick 1974); filled rubber softens instead"
            ),
        ),
        Amplitude(
            "network",
            "kJ/mol",
            "energy with which heat lowers the branches' moduli beyond the law's",
            (20.0, -100.0, 200.0),
            optional=True,
            prior=Prior(
                "t", 20.0, source="21 kJ/mol: strain sweeps of a carbon-black compound (benchmarks/payne.md)"
            ),
        ),
    ),
    how_often="usual",
    families=("dissipation",),
    needs="recordings at two temperatures, and two rates or a hold for the shift",
    rivals=(),
    source="Williams, Landel and Ferry (1955), The temperature dependence of relaxation mechanisms, "
    "doi:10.1021/ja01619a008",
    specimens=frozenset({"bushing", "coupon"}),
    needs_temperature=True,
    feature=feature,
)
