"""Misalignment: the inner sleeve is off centre at rest.

The rubber was moulded with the inner sleeve displaced by ``offset`` in the direction of the radial load (x) and by
``offset_across`` perpendicular to it (y): the rubber is thinner on one side, without stress at rest. The response
towards x then differs between + and - with the first, towards y with the second; a radial curve changes with the square
of ``offset_across`` only, so that it takes a path with both motions to identify it. The amplitudes are the offsets,
positive towards positive motion. Axial and torsional curves change only with their squares and are left as they are.

References
----------
Kadlowec, Wineman and Hulbert (2003), Elastomer bushing response: experiments and finite element modeling, Acta Mech.
163:25-38, doi:10.1007/s00707-003-1018-1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bushcli.effects.effect import Effect, EffectParameter
from bushcli.effects.prior import Prior
from geometry.shape import Shape

if TYPE_CHECKING:
    from cases.feature import Feature, Values
    from forms.kinematics import Moved
    from forms.law import Scalar


def _moved(values: Values, x: Scalar, shape: Shape) -> Moved:
    """Move the inner bond by the offset, the outer bond not at all, and the rubber between them in proportion."""
    import ufl

    from forms.kinematics import Moved

    wall = shape.wall
    if wall is None:
        raise TypeError(f"a {type(shape).__name__} has no inner sleeve to be off centre")
    r = ufl.sqrt(x[0] ** 2 + x[1] ** 2)
    share, steep = (wall.outer_radius - r) / wall.thickness, -1 / (wall.thickness * r)
    if shape.elastic_sleeves or not wall.straight:
        steep = ufl.conditional(ufl.And(share > 0, share < 1), steep, 0)
        share = ufl.min_value(ufl.max_value(share, 0), 1)
    # M = I + offset (x) grad(share), whose inverse is Sherman and Morrison's.
    offset = (values["offset"], values.get("offset_across", 0.0))
    slope = [steep * x[i] for i in (0, 1)]
    ratio = 1 + offset[0] * slope[0] + offset[1] * slope[1]
    (xx, xy), (yx, yy) = ([float(i == j) - offset[i] * slope[j] / ratio for j in (0, 1)] for i in (0, 1))
    inverse = ((xx, xy, 0), (yx, yy, 0), (0, 0, 1))
    return Moved(ufl.as_vector([offset[0] * share, offset[1] * share, 0]), inverse, ratio)


def feature() -> Feature:
    """Return the shape in which the rubber was moulded."""
    from cases.feature import Feature

    return Feature(
        stress_free=_moved, breaks=frozenset({"x"}), breaks_with=(("offset_across", frozenset({"y"})),)
    )


def _offset(name: str, meaning: str, within: float, motions: frozenset[str] = frozenset()) -> EffectParameter:
    return EffectParameter(
        name,
        "mm",
        meaning,
        0.2,
        -10.0,
        10.0,
        off=0.0,
        optional=bool(motions),
        motions=motions,
        within=("thickness", within),
        prior=Prior(
            "t",
            0.04,
            of="thickness",
            source="class M3 of ISO 3302-1 (0.3 to 0.4 mm for 6.3 to 16 mm of rubber) at one standard deviation",
        ),
    )


EFFECT = Effect(
    name="misalignment",
    title="Misalignment of the sleeves",
    summary="The inner sleeve is off centre at rest: radial loading differs between + and -.",
    acts="assembly",
    parameters=(
        _offset("offset", "in the direction of the radial load (x)", 0.8),
        # Both at their bounds are less than the thickness together.
        _offset("offset_across", "perpendicular to the radial load (y)", 0.5, frozenset({"uy"})),
    ),
    needs="a radial channel that goes to both sides; for an offset across the load a path in both directions",
    rivals=("bump_stop", "offset"),
    source="Kadlowec, Wineman and Hulbert (2003), Elastomer bushing response, doi:10.1007/s00707-003-1018-1",
    modes=frozenset({"radial", "conical", "path"}),
    needs_sleeves=True,
    feature=feature,
)
