"""Free ends that meet a plate: frictionless contact with a snubber, as an energy of the end faces.

The plate is rigid and fixed to one of the sleeves. What is beyond it is pushed back by springs, an energy
k/2 <penetration>^2 per area of the undeformed end face (penalty): the force of the sleeve that moves is the derivative
of the whole energy, and work and stored energy stay equal.

References
----------
Wriggers (2006), Computational Contact Mechanics, 2nd ed., Springer, section 6.3, doi:10.1007/978-3-540-32609-0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import ufl

from cases.feature import Feature, Place, Values
from forms.law import Scalar
from geometry.ring import Ring
from geometry.shape import Shape

# Stiffness of a plate over mu / thickness: a pressure of mu pushes an end beyond it by a thousandth of the thickness.
STIFF = 1e3

End = Literal["top", "bottom"]


def snubber(
    ends: Sequence[End] = ("top", "bottom"), fixed_to: Literal["inner", "outer"] = "outer"
) -> Feature:
    """Return plates before the free ends; their parameter is "gap", mm from the furthest point of the end at rest.

    Parameters
    ----------
    ends
        Those that have a plate.
    fixed_to
        Sleeve that carries the plates. A plate on the inner sleeve moves as that does.
    """

    def surface(values: Values, place: Place) -> list[Scalar]:
        stiffness = STIFF * place.shear_modulus / _thickness(place.shape)
        half = _furthest(place.shape)
        found = []
        for end in ends:
            ds = place.ds(f"end_{end}")
            if ds is None:
                continue
            beyond = _height(place, fixed_to == "inner", 1.0 if end == "top" else -1.0) - (
                half + values["gap"]
            )
            found.append(pushed_back(beyond, stiffness) * place.weight * ds)
        return found

    both = {"top", "bottom"} <= set(ends)
    return Feature(
        surface=surface, follows=fixed_to == "inner", breaks=frozenset() if both else frozenset({"z"})
    )


def pushed_back(beyond: Scalar, stiffness: Scalar) -> Scalar:
    """Return the energy per area (N/mm) of what is ``beyond`` (mm) a plate of a stiffness (MPa/mm)."""
    return stiffness / 2 * ufl.max_value(beyond, 0) ** 2


def _height(place: Place, rides: bool, sign: float) -> Scalar:
    """Height above the mid-plane of the plates, in the direction of one end; they ride on the inner sleeve, or not."""
    axis = len(place.x) - 1
    last = len(place.u) - 1
    if not rides:
        return sign * (place.x[axis] + place.u[last])
    if place.kinematics != "cartesian":
        return sign * (place.x[axis] + place.u[last] - place.motion[last])
    # The motion is rigid, X -> R X + t, and continued over the mesh: R and t are read off it anywhere.
    R = ufl.Identity(3) + ufl.grad(place.motion)
    t = place.x + place.motion - ufl.dot(R, place.x)
    return sign * ufl.dot(ufl.dot(R, ufl.as_vector([0, 0, 1])), place.x + place.u - t)


def _furthest(shape: Shape) -> float:
    if not isinstance(shape, Ring):
        raise TypeError(f"a {type(shape).__name__} has no free ends between sleeves")
    return float(shape.half_length(np.linspace(0.0, 1.0, 201, dtype=np.float64)).max())


def _thickness(shape: Shape) -> float:
    assert isinstance(shape, Ring)
    return shape.thickness
