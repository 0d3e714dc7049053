"""Bounds of the stiffness of a bushing or a coupon with a shear modulus of 1 MPa, from the closed forms of its mode."""

from __future__ import annotations

from cases.mode import modes
from geometry.shape import Shape

# Least stiffness with voids over that without: voids may take most of the rubber out of the load's path.
_VOIDED = 0.2


def unit_stiffness(shape: Shape, mode: str) -> tuple[float, float] | None:
    """Return bounds of the stiffness over the shear modulus."""
    kind, annulus = modes()[mode], shape.annulus
    if kind.specimen == "coupon":
        return None if kind.unit_slope is None else (kind.unit_slope, kind.unit_slope)
    if annulus is None or kind.unit_stiffness is None:
        return None
    low, _ = kind.unit_stiffness(annulus.inner_radius, annulus.outer_radius, annulus.shortest)
    _, high = kind.unit_stiffness(annulus.inner_radius, annulus.outer_radius, annulus.longest)
    return low * (1.0 if annulus.whole else _VOIDED), high
