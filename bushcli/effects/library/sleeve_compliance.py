"""Sleeve compliance: the sleeves deform with the rubber.

Sleeves of ``thickness`` and Young's modulus 1/compliance stand where the case has rigid ones; the rig holds them at
their end faces, and between these they bend and change their section. (A sleeve held over its whole surface could only
get thinner; it is given as ``[geometry.outer_sleeve]``.) Steel has 4.8e-6 1/MPa, aluminium 1.4e-5, polyamide 1e-4 to
1e-3. Formulas for bushings take the sleeves as rigid, which is compliance 0.

References
----------
Adkins and Gent (1954), Load-deflexion relations of rubber bush mountings, Br. J. Appl. Phys. 5:354-358,
doi:10.1088/0508-3443/5/10/303.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from bushcli.effects.effect import Amplitude, Effect, EffectParameter
from bushcli.effects.prior import Prior
from geometry.metal import Metal
from geometry.shape import Shape, Sleeve

if TYPE_CHECKING:
    from cases.feature import Feature, Values
    from forms.law import Scalar


# Compliance of a sleeve that counts as rigid, 1/MPa: 240 times as stiff as steel, which changes a radial force by 3e-6.
# With a quarter of it, rounding (beside the rubber's tangent) prevents equilibrium of a sleeve turned by 7 degrees.
RIGID = 2e-8


class Compliant(Sleeve):
    """A sleeve whose modulus is given by the effect."""


def _sleeves(shape: Shape, values: Mapping[str, float]) -> Shape:
    """Give a bushing the sleeves that it lacks, held at their ends."""
    sleeve = Compliant(thickness=values["thickness"], grip="ends")
    sleeved = shape.with_sleeves(sleeve, sleeve)
    if sleeved is None:
        raise TypeError(f"a {type(shape).__name__} has no sleeves")
    return sleeved


def _modulus(values: Values, sleeve: Metal) -> Scalar | None:
    return 1 / (values["compliance"] + RIGID) if isinstance(sleeve, Compliant) else None


def feature() -> Feature:
    """Return elastic sleeves."""
    from cases.feature import Feature

    return Feature(shape=_sleeves, metal=_modulus, dimensions=("thickness",))


EFFECT = Effect(
    name="sleeve_compliance",
    title="Compliant sleeves",
    summary="The sleeves are not rigid: confined rubber pushes them out of shape.",
    acts="assembly",
    parameters=(
        Amplitude(
            "compliance",
            "1/MPa",
            "1 / Young's modulus of the sleeves",
            (1.4e-5, 0.0, 0.01),
            reciprocal=("youngs_modulus", "MPa"),
            prior=Prior(
                "log_uniform",
                4.8e-6,
                1e-3,
                source="materials of sleeves: steel 210,000 MPa, aluminium 70,000, polyamide 10,000 (filled) to 1,000",
            ),
        ),
        EffectParameter(
            "thickness",
            "mm",
            "of the sleeves",
            (2.0, 0.1, 50.0),
            scan=(1.0, 2.0, 4.0),
            of_mesh=True,
            prior=Prior("log_normal", 2.2, 0.4, source="engineering judgement: tubes of 1 to 5 mm"),
        ),
    ),
    families=("stiffness that differs between the channels",),
    needs="a radial channel and an axial or torsional one",
    rivals=("compressibility", "rig_compliance"),
    source="Adkins and Gent (1954), Load-deflexion relations of rubber bushes, doi:10.1088/0508-3443/5/10/303",
    needs_sleeves=True,
    adds_sleeves=True,
    feature=feature,
    shown=("radial", {"compliance": 0.001, "thickness": 2.0}),
)
