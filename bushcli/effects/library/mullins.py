"""Mullins effect: rubber that was stretched before is softer up to its largest earlier deformation.

The stress of the law is multiplied by eta = 1 - (1/r) erf((W_max - W) / (m + beta W_max)), with W the isochoric energy
and W_max its largest value so far at that point. On the virgin path W = W_max and eta = 1; the unloaded rubber is left
with the factor 1 - (1/r) erf(W_max / (m + beta W_max)). The amplitude is 1/r; r = inf means no Mullins effect.

References
----------
Ogden and Roxburgh (1999), A pseudo-elastic model for the Mullins effect in filled rubber, Proc. R. Soc. Lond. A
455:2861-2877, doi:10.1098/rspa.1999.0431. The scale m + beta W_max: Mars (2004), Evaluation of a pseudo-elastic model
for the Mullins effect, Tire Sci. Technol. 32:120-145, doi:10.2346/1.2186778.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from bushcli.effects.effect import Amplitude, Effect, EffectParameter
from bushcli.effects.exported import CardPart, OgdenRoxburgh
from bushcli.effects.prior import Prior

if TYPE_CHECKING:
    from cases.feature import Feature


def feature() -> Feature:
    """Return one branch of softening."""
    from cases.feature import Feature
    from forms.branches.ogden_roxburgh import BRANCH
    from forms.potential import Attached

    return Feature(branches=lambda values: [Attached(BRANCH, values)])


def card(values: Mapping[str, float]) -> CardPart:
    """Return the softening."""
    return CardPart(softening=OgdenRoxburgh(values["inverse_r"], values["m"], values["beta"]))


EFFECT = Effect(
    name="mullins",
    title="Mullins softening",
    of_a_person=True,
    summary="Reloading below the largest earlier deformation is softer than the first loading.",
    acts="rubber",
    parameters=(
        Amplitude(
            "inverse_r",
            "1",
            "largest share of the stress that is lost",
            (0.3, 0.0, 0.95),
            reciprocal=("r", "1"),
            prior=Prior(
                "half_t",
                0.4,
                source="engineering judgement from published fits with r of 1.5 to 5 of the model of Ogden and "
                "Roxburgh (1999), doi:10.1098/rspa.1999.0431",
            ),
        ),
        EffectParameter(
            "m",
            "MPa",
            "energy below W_max at which softening sets in",
            (0.1, 1e-4, 100.0),
            scan=(0.01, 0.03, 0.1, 0.3),
            prior=Prior(
                "log_normal",
                0.08,
                1.3,
                of="shear",
                source="engineering judgement: softening sets in at shear strains of 10 to 100 %, energies "
                "of 0.005 to 0.5 shear moduli",
            ),
        ),
        EffectParameter(
            "beta",
            "1",
            "growth of that energy with W_max",
            (0.1, 0.0, 1.0),
            scan=(0.05,),
            prior=Prior(
                "half_t",
                0.1,
                source="engineering judgement from published fits with beta of 0 to 0.1; the parameter is that of "
                "Mars (2004), doi:10.2346/1.2186778",
            ),
        ),
    ),
    how_often="usual",
    families=("softening in use",),
    of_fillers="softening",
    in_force_law="softening",
    on_card=card,
    needs="a reload below an earlier peak; first loadings to growing amplitudes determine m and beta",
    rivals=("friction", "viscoelasticity", "warming"),
    source="Ogden and Roxburgh (1999), A pseudo-elastic model for the Mullins effect, doi:10.1098/rspa.1999.0431",
    specimens=frozenset({"bushing", "coupon"}),
    has_memory=True,
    feature=feature,
    shown=("axial", {"inverse_r": 0.4, "m": 0.03, "beta": 0.1}),
)
