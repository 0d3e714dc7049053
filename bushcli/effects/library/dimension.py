"""Dimension: the rubber is thicker or longer than drawn.

The stress-free rubber is the meshed one with every radius beyond the inner bond moved outwards in proportion, by
``thickness`` at the outer bond, and with every height in proportion, so that the bushing is longer by ``length``. The
inner radius stays; sleeves change with the bonds that they carry. The amplitudes are the two differences.

References
----------
Adkins and Gent (1954), Load-deflexion relations of rubber bush mountings, Br. J. Appl. Phys. 5:354-358,
doi:10.1088/0508-3443/5/10/303: stiffness by radii and length.
ISO 3302-1:2014, Rubber - Tolerances for products - Part 1: Dimensional tolerances, table 1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bushcli.effects.effect import Amplitude, Effect
from bushcli.effects.prior import Prior
from geometry.shape import Shape

if TYPE_CHECKING:
    from cases.feature import Feature, Values
    from forms.kinematics import Moved
    from forms.law import Scalar


def _displacement(values: Values, x: Scalar, shape: Shape) -> Moved:
    """Move the outer bond by the change of thickness, the inner bond not at all, and heights in proportion."""
    import ufl

    from forms.kinematics import Moved

    wall = shape.wall
    if wall is None:
        raise TypeError(f"a {type(shape).__name__} has no rubber of a thickness and a length")
    solid = len(x) == 3
    r, z = (ufl.sqrt(x[0] ** 2 + x[1] ** 2), x[2]) if solid else (x[0], x[1])
    share, steep = (r - wall.inner_radius) / wall.thickness, 1 / wall.thickness
    if shape.elastic_sleeves or not wall.straight:
        steep = ufl.conditional(ufl.And(share > 0, share < 1), steep, 0)
        share = ufl.min_value(ufl.max_value(share, 0), 1)
    longest = wall.extent
    # Stretches from the mesh along r, around the axis, and along z.
    across, along = 1 + values["thickness"] * steep, 1 + values["length"] / longest
    around = 1 + values["thickness"] * share / r
    if not solid:
        displacement = ufl.as_vector([values["thickness"] * share, values["length"] * z / longest])
        return Moved(displacement, ((1 / across, 0), (0, 1 / along)), across * along)
    c, s = x[0] / r, x[1] / r
    displacement = ufl.as_vector([(around - 1) * x[0], (around - 1) * x[1], values["length"] * z / longest])
    shear = (1 / across - 1 / around) * c * s
    inverse = (
        (c**2 / across + s**2 / around, shear, 0),
        (shear, s**2 / across + c**2 / around, 0),
        (0, 0, 1 / along),
    )
    return Moved(displacement, inverse, across * around * along)


def feature() -> Feature:
    """Return the true shape of the stress-free rubber."""
    from cases.feature import Feature

    return Feature(
        stress_free=_displacement, arms=lambda values, x, shape: _displacement(values, x, shape).displacement
    )


EFFECT = Effect(
    name="dimension",
    title="Off-nominal dimensions",
    summary="The rubber is thicker or longer than the case says.",
    acts="assembly",
    parameters=(
        Amplitude(
            "thickness",
            "mm",
            "actual minus nominal thickness of the rubber; the outer radius changes",
            (0.2, -10.0, 10.0),
            within=("thickness", 0.5),
            prior=Prior(
                "t",
                0.2,
                source="half the limit of class M3 of ISO 3302-1, 0.3 to 0.5 mm for fixed dimensions of 6.3 to 25 mm",
            ),
        ),
        Amplitude(
            "length",
            "mm",
            "actual minus nominal length of the bushing, in proportion along it",
            (0.3, -50.0, 50.0),
            within=("length", 0.5),
            prior=Prior(
                "t",
                0.4,
                source="half the limit of class M3 of ISO 3302-1, 0.6 to 1.3 mm for closure dimensions of 16 to 63 mm "
                "and fixed ones of 25 to 63 mm",
            ),
        ),
    ),
    how_often="occasional",
    families=("prestress",),
    needs="three channels; two where one of the dimensions is known",
    rivals=("batch_stiffness", "debonding", "gain", "swaging"),
    source="Adkins and Gent (1954), Load-deflexion relations of rubber bushes, doi:10.1088/0508-3443/5/10/303",
    needs_sleeves=True,
    feature=feature,
    shown=("radial", {"thickness": 1.0, "length": 0.0}),
)
