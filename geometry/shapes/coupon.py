"""Coupon: a unit cube in homogeneous deformation, one element."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

from typing_extensions import override

from geometry.blocks import Blocks, Interval
from geometry.shape import Mirrors, Refinement, Shape


class Coupon(Shape):
    """Unit specimen; a displacement is a strain and a force a nominal stress."""

    name: ClassVar[str] = "coupon"
    summary: ClassVar[str] = "unit specimen in homogeneous deformation"
    specimen: ClassVar[Literal["bushing", "coupon"]] = "coupon"
    # The field is linear: first-order displacement and one pressure represent it exactly.
    displacement_order: ClassVar[int] = 1

    @override
    def blocks(self, dimension: int, mirrors: Mirrors, refinement: Refinement) -> Blocks:
        """Return one block with one element: the deformation is homogeneous.

        Parameters
        ----------
        dimension : int
            2 for the half-plane, 3 for the solid.
        mirrors : Mirrors
            Planes of symmetry at which the solid is cut, by their normals.
        refinement : Refinement
            Number of elements in each direction.
        """
        return Blocks(
            ((Interval(0.0, 1.0, 1),),) * 3,
            lambda middle: "rubber",
            lambda axis, middle: f"{'mirror' if middle[axis] < 0.5 else 'face'}_{'xyz'[axis]}",
            lambda p: p,
        )

    @override
    def measures(self) -> Mapping[str, float]:
        return {"rubber": 1.0}
