"""Misalignment: the inner sleeve is off centre at rest, or tilted.

The rubber was moulded with the inner sleeve displaced by ``offset`` in the direction of the radial load (x), by
``offset_across`` perpendicular to it (y) and by ``offset_along`` along the axis (z), and tilted about y by ``tilt`` and
about x by ``tilt_across``: the rubber is thinner on one side, without stress at rest. The response towards x then
differs between + and - with the first, towards y with the second, along the axis with the third, and to conical motion
with the tilts; a radial curve changes with the squares of all but the first, so that it takes a path with the other
motions to identify them. The amplitudes are positive towards positive motion. A tilt is 2 tan(angle / 2), which is the
angle to 0.1 % up to 0.1 rad. Axial and torsional curves are left as they are.

References
----------
Kadlowec, Wineman and Hulbert (2003), Elastomer bushing response: experiments and finite element modeling, Acta Mech.
163:25-38, doi:10.1007/s00707-003-1018-1. Bauchau and Trainelli (2003), The vectorial parameterization of rotation,
Nonlinear Dyn. 32:71-92, doi:10.1023/A:1024265401576 (Cayley's parameters of a rotation).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bushcli.effects.effect import Amplitude, Effect, EffectParameter
from bushcli.effects.prior import Prior
from geometry.shape import Shape
from geometry.wall import Wall

if TYPE_CHECKING:
    from cases.feature import Feature, Values
    from forms.kinematics import Moved
    from forms.law import Scalar

TILTS = ("tilt_across", "tilt")


def _displacement(values: Values, x: Scalar, shape: Shape) -> Moved:
    """Move the inner bond by offsets and tilts, the outer one not at all, the rubber between them in proportion."""
    import ufl

    from forms.kinematics import Moved

    wall = _wall(shape)
    r = ufl.sqrt(x[0] ** 2 + x[1] ** 2)
    share, steep = (wall.outer_radius - r) / wall.thickness, -1 / (wall.thickness * r)
    if shape.elastic_sleeves or not wall.straight:
        steep = ufl.conditional(ufl.And(share > 0, share < 1), steep, 0)
        share = ufl.min_value(ufl.max_value(share, 0), 1)
    offset = [values.get(name, 0.0) for name in ("offset", "offset_across", "offset_along")]
    rotated = _tilt_displacement(values, x, shape)
    if rotated is not None:
        return Moved.by(share * (ufl.as_vector(offset) + rotated))
    # M = I + offset (x) grad(share), whose inverse is Sherman and Morrison's; share does not depend on z.
    slope = [steep * x[i] for i in (0, 1)]
    ratio = 1 + offset[0] * slope[0] + offset[1] * slope[1]
    rows = [[float(i == j) - offset[i] * slope[j] / ratio for j in (0, 1)] for i in range(3)]
    if "offset_along" not in values:
        rows[2] = [0, 0]
    inverse = tuple((*row, 1 if i == 2 else 0) for i, row in enumerate(rows))
    return Moved(share * ufl.as_vector(offset), inverse, ratio)


def _tilt_displacement(values: Values, x: Scalar, shape: Shape) -> Scalar | None:
    """Displacement of the inner sleeve's points by its tilts about its centre; None without tilts.

    With g half the tilts, as a vector, the rotation by 2 atan |g| about it is I + 2 (G + G G) / (1 + g . g), G being
    the matrix of the vector product with g.
    """
    import ufl

    if not any(name in values for name in TILTS):
        return None
    inner = _wall(shape).inner
    half = ufl.as_vector([*(values.get(name, 0.0) / 2 for name in TILTS), 0.0])
    arm = ufl.as_vector([x[0], x[1], x[2] - sum(inner) / 2])
    once = ufl.cross(half, arm)
    return 2 / (1 + ufl.dot(half, half)) * (once + ufl.cross(half, once))


def _wall(shape: Shape) -> Wall:
    wall = shape.wall
    if wall is None:
        raise TypeError(f"a {type(shape).__name__} has no inner sleeve to be off centre")
    return wall


def feature() -> Feature:
    """Return the shape in which the rubber was moulded."""
    from cases.feature import Feature

    return Feature(
        stress_free=_displacement,
        arms=_tilt_displacement,
        breaks=frozenset({"x"}),
        breaks_with=(
            ("offset_across", frozenset({"y"})),
            ("offset_along", frozenset({"z"})),
            ("tilt", frozenset({"x", "z"})),
            ("tilt_across", frozenset({"y", "z"})),
        ),
    )


def _offset(name: str, meaning: str, within: float, motions: frozenset[str] = frozenset()) -> EffectParameter:
    return Amplitude(
        name,
        "mm",
        meaning,
        (0.2, -10.0, 10.0),
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


def _tilt(name: str, meaning: str, motion: str) -> EffectParameter:
    return Amplitude(
        name,
        "rad",
        meaning,
        (0.01, -0.5, 0.5),
        optional=True,
        motions=frozenset({motion}),
        # An end of a sleeve as long as the bond then comes closer to the outer one by 0.15 of the thickness at most.
        within=("thickness/length", 0.3),
        prior=Prior(
            "t",
            0.057,
            of="thickness/length",
            source="both ends of the inner sleeve off centre as `offset`, each by itself: sqrt(2) times 0.04",
        ),
    )


EFFECT = Effect(
    name="misalignment",
    title="Misalignment of the sleeves",
    summary="The inner sleeve is off centre or tilted at rest: radial or conical loading differs between + and -.",
    acts="assembly",
    parameters=(
        _offset("offset", "in the direction of the radial load (x)", 0.8),
        # Both at their bounds are less than the thickness together.
        _offset("offset_across", "perpendicular to the radial load (y)", 0.5, frozenset({"uy"})),
        _offset("offset_along", "along the axis (z)", 0.5, frozenset({"uz"})),
        _tilt("tilt", "about y: the sleeve's upper end is displaced towards x", "ry"),
        _tilt("tilt_across", "about x: the sleeve's upper end is displaced towards -y", "rx"),
    ),
    how_often="occasional",
    families=("zero error of the rig",),
    needs="a radial channel that goes to both sides; a conical one for `tilt`, a path for the others",
    rivals=("bump_stop", "offset"),
    source="Kadlowec, Wineman and Hulbert (2003), Elastomer bushing response, doi:10.1007/s00707-003-1018-1",
    modes=frozenset({"radial", "conical", "path"}),
    needs_sleeves=True,
    feature=feature,
    shown=("radial", {"offset": 1.0}),
)
