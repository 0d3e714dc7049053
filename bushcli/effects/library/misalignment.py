"""Misalignment: the inner sleeve is off centre at rest.

The rubber was moulded with the inner sleeve displaced by ``offset`` in the direction of the radial load: the rubber is
thinner on one side, without stress at rest. The radial response then differs between + and -. The amplitude is the
offset, positive towards positive radial load. Axial and torsional curves change only with its square and are left as
they are.

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
    # M = I + offset e_x (x) grad(share), whose inverse is Sherman and Morrison's.
    slope = [values["offset"] * steep * x[i] for i in (0, 1)]
    ratio = 1 + slope[0]
    inverse = ((1 / ratio, -slope[1] / ratio, 0), (0, 1, 0), (0, 0, 1))
    return Moved(ufl.as_vector([values["offset"] * share, 0, 0]), inverse, ratio)


def feature() -> Feature:
    """Return the shape in which the rubber was moulded."""
    from cases.feature import Feature

    return Feature(stress_free=_moved, breaks=frozenset({"x"}))


EFFECT = Effect(
    name="misalignment",
    title="Misalignment of the sleeves",
    summary="The inner sleeve is off centre at rest: radial loading differs between + and -.",
    acts="assembly",
    parameters=(
        EffectParameter(
            "offset",
            "mm",
            "in the direction of the radial load",
            0.2,
            -10.0,
            10.0,
            off=0.0,
            within=("thickness", 0.8),
            prior=Prior(
                "t",
                0.04,
                of="thickness",
                source="class M3 of ISO 3302-1 (0.3 to 0.4 mm for 6.3 to 16 mm of rubber) at one standard "
                "deviation",
            ),
        ),
    ),
    needs="a radial channel that goes to both sides",
    rivals=("bump_stop", "offset"),
    source="Kadlowec, Wineman and Hulbert (2003), Elastomer bushing response, doi:10.1007/s00707-003-1018-1",
    modes=frozenset({"radial", "conical", "path"}),
    needs_sleeves=True,
    feature=feature,
)
