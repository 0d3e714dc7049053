"""Debonding: part of the bond to one of the sleeves is free, from one end on.

Over ``length`` from one end the rubber no longer follows the inner or the outer sleeve; ``bond`` says which bond, and
from which end: the top is that at the largest z. The bond is softer, and local strain rises at its new end. The
amplitude is the free length, in which the model is smooth. Free rubber may pass through the sleeve: nothing but the
bond holds it.

References
----------
Energy release rates of cracks near bonds of rubber to metal: Rubber Chem. Technol. (2023), doi:10.5254/rct-23.611182.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bushcli.effects.effect import Amplitude, Effect, EffectParameter
from bushcli.effects.prior import Prior

if TYPE_CHECKING:
    from cases.feature import Feature, Place, Values
    from forms.law import Scalar


BONDS = ("inner_top", "inner_bottom", "outer_top", "outer_bottom")
# Stiffness of the springs that are the bond, in shear moduli over the rubber's thickness: with them the bushing loses
# some 1e-7 of its stiffness, 5e-7 of a radial one.
BOND = 2e7
# Length over which the bond's compliance grows by a factor e, over the rubber's thickness. 0.03 brings the curve closer
# to that of a free boundary, but on the default mesh the derivative by the length then jumps between elements.
EDGE = 0.05
# Degree of the quadrature along the bond: the edge is narrower than an element.
DEGREE = 20
# Exponents beyond this add nothing to a bond that is free.
FREE = 60.0


def _bond(values: Values, place: Place, bond: str) -> list[Scalar]:
    """Return the energy of springs between rubber and sleeve; beyond the bond's edge their compliance grows.

    With s the distance from the end and d = EDGE times the thickness, the compliance (mm/MPa) that is added is
    d/mu (exp((length - s)/d) - exp(-s/d)): zero everywhere without a free length, and smooth in it. It is that of the
    rubber around the edge, d/mu, at s = length.
    """
    import ufl

    wall = place.shape.wall
    if wall is None:
        raise TypeError(f"a {type(place.shape).__name__} has no bond on a sleeve")
    sleeve, _, end = bond.partition("_")
    mu, width = place.shear_modulus, EDGE * wall.thickness
    height = place.x[2 if place.kinematics == "cartesian" else 1]
    low, high = wall.span(sleeve)
    s = high - height if end == "top" else height - low
    growth = ufl.exp(ufl.min_value((values["length"] - s) / width, FREE)) - ufl.exp(-s / width)
    stiffness = 1 / (wall.thickness / (BOND * mu) + width / mu * growth)
    slip = [u - m for u, m in zip(place.u, place.motion[sleeve], strict=True)]
    if place.kinematics == "axisymmetric_twist":
        slip[1] *= place.x[0]
    return [stiffness / 2 * sum(c * c for c in slip) * place.weight * place.ds(sleeve, DEGREE)]


def feature(bond: str) -> Feature:
    """Return the bond as springs."""
    from cases.feature import Feature

    sleeve = bond.partition("_")[0]
    return Feature(
        surface=lambda values, place: _bond(values, place, bond),
        released=(sleeve,),
        follows=sleeve,
        springs=BOND,
        breaks=frozenset({"z"}),
    )


EFFECT = Effect(
    name="debonding",
    title="Debonding",
    summary="The rubber has come off a sleeve over part of the bond, starting at one end.",
    acts="assembly",
    parameters=(
        # The derivative at zero is that of the bond's corner: it does not predict a length that reaches the bulk.
        Amplitude(
            "length",
            "mm",
            "length of the debonded part",
            (1.0, 0.0, 1000.0),
            sizes=(0.1, 0.4, 1.0),
            within=("length", 0.9),
            prior=Prior(
                "half_t",
                0.7,
                of="thickness",
                source="engineering judgement: a crack up to the thickness shows only in the "
                "curve, a longer one is visible",
            ),
        ),
        EffectParameter(
            "bond",
            "1",
            "which bond, and from which end",
            (0.0, 0.0, 3.0),
            of_mesh=True,
            choices=BONDS,
            twins=(("inner_top", "inner_bottom"), ("outer_top", "outer_bottom")),
            prior=Prior(
                "choice",
                4.0,
                source="engineering judgement: the stress on the inner bond is higher, the outer one sees the heat of "
                "swaging and corrosion",
            ),
        ),
    ),
    families=("stiffness that differs between the channels",),
    needs="two channels, such as torsional and radial: a debonded length softens them by different amounts",
    rivals=("batch_stiffness", "compressibility", "dimension"),
    source="Stress concentrations at bonds of rubber to metal (2023), doi:10.5254/rct-23.611182",
    needs_sleeves=True,
    rigid=(("inner_sleeve", BONDS[:2]), ("outer_sleeve", BONDS[2:])),
    feature=feature,
    shown=("radial", {"length": 8.0, "bond": 0.0}),
)
