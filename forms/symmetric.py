"""Symmetric 3 x 3 tensors as their six components, as most branches store them.

UFL's own matrices carry structural zeros into the generated code; here a component that is the number 0 costs nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import ufl
from ufl.classes import Zero

from forms.law import Scalar

#: A distance much shorter than this shear strain is rounded to none, so that a hold has a derivative.
ROUNDED = 1e-7


@dataclass(frozen=True)
class Symmetric:
    """A symmetric tensor: xx, yy, zz, yz, xz, xy.

    Attributes
    ----------
    components : tuple of six UFL scalars, or the number 0 where they vanish
    """

    components: tuple[Scalar, ...]

    def __add__(self, other: Symmetric) -> Symmetric:
        return Symmetric(tuple(a + b for a, b in zip(self.components, other.components, strict=True)))

    def __rmul__(self, factor: Scalar) -> Symmetric:
        return Symmetric(tuple(0 if _zero(a) else factor * a for a in self.components))

    def dot(self, other: Symmetric) -> Scalar:
        """Double contraction a : b."""
        weights = (1, 1, 1, 2, 2, 2)
        products = [
            w * a * b
            for w, a, b in zip(weights, self.components, other.components, strict=True)
            if not (_zero(a) or _zero(b))
        ]
        return sum(products[1:], products[0])

    def rows(self) -> tuple[tuple[Scalar, ...], ...]:
        """All nine components."""
        xx, yy, zz, yz, xz, xy = self.components
        return ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))

    def adjugate(self) -> Symmetric:
        """The inverse times the determinant."""
        xx, yy, zz, yz, xz, xy = self.components
        return Symmetric(
            (
                yy * zz - yz * yz,
                xx * zz - xz * xz,
                xx * yy - xy * xy,
                xy * xz - xx * yz,
                xy * yz - yy * xz,
                xz * yz - zz * xy,
            )
        )

    def det(self) -> Scalar:
        """Determinant."""
        xx, yy, zz, yz, xz, xy = self.components
        return xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)


def unpack(values: Sequence[Scalar], places: Sequence[int]) -> Symmetric:
    """The tensor whose components at `places` are `values`, all others zero.

    Parameters
    ----------
    values : Sequence[Scalar]
        UFL vector of numbers.
    places : Sequence[int]
        Indices of the components, in the order of `forms.symmetric`.
    """
    components: list[Scalar] = [0] * 6
    for place, value in zip(places, values, strict=True):
        components[place] = value
    return Symmetric(tuple(components))


def _zero(component: Scalar) -> bool:
    return (isinstance(component, int) and component == 0) or isinstance(component, Zero)


def cube_root(x: Scalar) -> Scalar:
    """Return x^(1/3) of a positive scalar."""
    return ufl.exp(ufl.ln(x) / 3)


def interpolate(A: Symmetric, B: Symmetric, share: Scalar) -> Symmetric:
    """Return the unimodular tensor between A (share 0) and B (share 1)."""
    mixed = (1 - share) * A + share * B
    return (1 / cube_root(mixed.det())) * mixed


def distance(A: Symmetric, B: Symmetric) -> Scalar:
    """Return how far two isochoric right Cauchy-Green tensors are apart, as an amount of shear.

    |A, B|^2 = (tr(A^-1 B) + tr(B^-1 A)) / 2 - 3 = tr(A^-1 (B - A) B^-1 (B - A)) / 2 is the square of the difference of
    the amounts of shear in simple shear, and 2 e : e for a small isochoric strain e.

    Parameters
    ----------
    A, B : Symmetric
        Of determinant 1.
    """
    # The form without differences of large numbers.
    change = (B + -1 * A).rows()
    first, second = (
        [
            [_sum(row[k] * change[k][j] for k in range(3)) for j in range(3)]
            for row in tensor.adjugate().rows()
        ]
        for tensor in (A, B)
    )
    square = _sum(first[i][j] * second[j][i] for i in range(3) for j in range(3)) / 2
    return ufl.sqrt(square + ROUNDED**2) - ROUNDED


def _sum(terms: Iterable[Scalar]) -> Scalar:
    """Sum without the terms that are the number 0."""
    return sum(term for term in terms if not (isinstance(term, int) and term == 0))
