"""Free ends that meet a plate: frictionless contact with a snubber, as an energy of the end faces.

The plate is rigid and fixed to one of the sleeves. What is beyond it is pushed back by springs, an energy
k/2 <penetration>^2 per area of the undeformed end face (penalty): the force of the sleeve that moves is the derivative
of the whole energy, and work and stored energy stay equal.

References
----------
Wriggers (2006), Computational Contact Mechanics, 2nd ed., Springer, section 6.3, doi:10.1007/978-3-540-32609-0.
"""

from __future__ import annotations

from typing import Literal

import ufl

from cases.feature import Feature, Installed, Place, Values
from forms.law import Scalar
from geometry.shape import Shape

# Stiffness of a plate over mu / thickness: a pressure of mu pushes an end beyond it by a thousandth of the thickness.
STIFF = 1e3


def plates(shape: Shape) -> tuple[Installed, ...]:
    """Return the contact with a shape's plates; "snubber.gap" is its parameter."""
    stops = shape.stops
    if stops is None:
        return ()
    ends = ("top", "bottom") if stops.snubber.ends == "both" else (stops.snubber.ends,)
    rides = stops.snubber.fixed_to == "inner"
    stiffness, half = STIFF / stops.thickness, stops.height

    def surface(values: Values, place: Place) -> list[Scalar]:
        densities = []
        for end in ends:
            ds = place.ds(f"end_{end}")
            if ds is not None:
                beyond = _height(place, rides, 1.0 if end == "top" else -1.0) - (half + values["gap"])
                densities.append(pushed_back(beyond, stiffness * place.shear_modulus) * place.weight * ds)
        return densities

    one_end = frozenset[Literal["x", "y", "z"]]({"z"} if len(ends) == 1 else ())
    return (
        Installed(
            "snubber",
            Feature(surface=surface, follows="inner" if rides else "", breaks=one_end),
            {"gap": stops.snubber.gap},
        ),
    )


def pushed_back(beyond: Scalar, stiffness: Scalar) -> Scalar:
    """Return the energy per area (N/mm) of a surface that is ``beyond`` (mm) a plate of a stiffness (MPa/mm).

    Parameters
    ----------
    beyond : Scalar
        How far the surface is behind the plate, mm.
    stiffness : Scalar
        Stiffness of the plate, MPa/mm.
    """
    return stiffness / 2 * ufl.max_value(beyond, 0) ** 2


def _height(place: Place, rides: bool, sign: float) -> Scalar:
    """Height above the mid-plane of the plates, in the direction of one end; they ride on the inner sleeve, or not."""
    axis = len(place.x) - 1
    last = len(place.u) - 1
    if not rides:
        return sign * (place.x[axis] + place.u[last])
    if place.kinematics != "cartesian":
        return sign * (place.x[axis] + place.u[last] - place.motion["inner"][last])
    # The motion is rigid, X -> R X + t, and continued over the mesh: R and t are read off it anywhere.
    motion = place.motion["inner"]
    slope = ufl.grad(motion)
    if not isinstance(place.x, ufl.SpatialCoordinate):
        slope = ufl.dot(slope, ufl.inv(ufl.grad(place.x)))
    R = ufl.Identity(3) + slope
    t = place.x + motion - ufl.dot(R, place.x)
    return sign * ufl.dot(ufl.dot(R, ufl.as_vector([0, 0, 1])), place.x + place.u - t)
