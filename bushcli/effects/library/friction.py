"""Friction inside filled rubber: one to three rate-independent branches beside the law.

In each branch a neo-Hookean spring of modulus g times the law's initial shear modulus follows the deformation behind a
slider, which gives way at the shear strain ``slip`` of the spring; after a reversal the branch is stiff again until it
slips the other way. In simple shear e at small strain its stress obeys s' = g mu e' while |s| < g mu slip, else it
stays at that bound (the knee is rounded a little). The loop is the same at every rate; cycles to +-e lose
4 g mu slip (e - slip) per volume. Rubber slips at many strains: branches with several slips are superposed.
The amplitudes are g, g2, g3.

References
----------
Austrell, Olsson and Jonsson (2001), A method to analyse the non-linear dynamic behaviour of carbon-black-filled rubber
components using standard FE codes, in Constitutive Models for Rubber II, Balkema: the overlay of such branches.
Garcia Tarrago, Kari, Vinolas and Gil-Negrete (2007), Torsion stiffness of a rubber bushing: a simple engineering
design formula including the amplitude dependence, J. Strain Anal. Eng. Des. 42, doi:10.1243/03093247JSA246.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bushcli.effects.effect import Amplitude, Effect, EffectParameter
from bushcli.effects.prior import Prior

if TYPE_CHECKING:
    from cases.feature import Feature, Values
    from forms.potential import Attached


def _branch(i: int, modulus: float, slip: float) -> tuple[EffectParameter, EffectParameter]:
    number, words = ("", "the branch") if i == 1 else (str(i), f"branch {i}")
    return (
        Amplitude(
            f"g{number}",
            "1",
            f"modulus of {words} over the law's",
            (modulus, 0.0, 10.0),
            optional=i > 1,
            prior=Prior(
                "half_t",
                0.3,
                source="engineering judgement: the modulus of bushing rubber falls by a tenth to a half from small "
                "to large amplitudes, as in Garcia Tarrago et al. (2007), doi:10.1243/03093247JSA246",
            ),
        ),
        EffectParameter(
            f"slip{number}",
            "1",
            "shear strain at which the branch slips",
            (slip, 1e-4, 1.0),
            optional=i > 1,
            scan=(0.01, 0.03, 0.1, 0.3),
            prior=Prior(
                "log_uniform",
                0.005,
                0.5,
                source="engineering judgement: the modulus of filled rubber falls between strains of 0.1 "
                "and 10 % (Payne effect); larger values let one branch stand for several",
            ),
        ),
    )


def _branches(values: Values) -> list[Attached]:
    """Return the branches whose parameters have values."""
    from forms.branches.elastoplastic import BRANCH
    from forms.potential import Attached

    numbers = [name.removeprefix("g") for name in values if name.startswith("g")]
    return [Attached(BRANCH, {"g": values[f"g{i}"], "slip": values[f"slip{i}"]}) for i in numbers]


def feature() -> Feature:
    """Return the branches, each a spring behind a slider."""
    from cases.feature import Feature

    return Feature(branches=_branches)


EFFECT = Effect(
    name="friction",
    title="Internal friction",
    summary="Filled rubber slips internally: the loop is the same at every rate, and stiff just after each reversal.",
    acts="rubber",
    parameters=(*_branch(1, 0.2, 0.05), *_branch(2, 0.1, 0.2), *_branch(3, 0.1, 0.02)),
    how_often="usual",
    families=("dissipation",),
    of_fillers="dissipation",
    fades=True,
    in_force_law="sliders",
    needs="reversals at two amplitudes; a second rate or a hold distinguishes it from viscoelasticity",
    rivals=("mullins", "viscoelasticity"),
    source="Garcia Tarrago et al. (2007), Torsion stiffness of a rubber bushing, doi:10.1243/03093247JSA246",
    specimens=frozenset({"bushing", "coupon"}),
    has_memory=True,
    feature=feature,
    shown=("axial", {"g": 0.5, "slip": 0.1}),
)
