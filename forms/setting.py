"""For each kinematics, the gradients that give the deformation, and the strain variables that give the energy.

A setting is data and arithmetic, used both with UFL, from which kernels are made, and with NumPy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from forms.law import Scalar

Table = Literal["d0", "d1", "d2", "over_radius", "radius_d0", "radius_d1"]
"""Function made of a shape function N: dN/dX_i, N / R, R dN/dX_i, all in the stress-free body."""

#: Strain variables in the half-plane without twist: area ratio, hoop stretch, and the other nonzero components of C in
#: the order of `forms.symmetric`. Elsewhere: det F and all components of C.
HALF_PLANE = ("area", "hoop", "rr", "zz", "rz")
SOLID = ("J", "xx", "yy", "zz", "yz", "xz", "xy")


@dataclass(frozen=True)
class KinematicDescription:
    """How a deformation follows from gradients g, which are linear in the unknown displacement.

    Attributes
    ----------
    components : int
        Number of components of the displacement.
    gradients : tuple of (int, Table)
        For each gradient, the component of the displacement and the function of it (`Table`).
    deformation : callable
        Gradients -> rows of F; arithmetic only, for UFL scalars and NumPy arrays.
    strain : callable
        F -> strain variables in the order of `names`, from which `strain_of` makes the measures.
    names : tuple of str
    """

    components: int
    gradients: tuple[tuple[int, Table], ...]
    deformation: Callable[[Sequence[Scalar]], tuple[tuple[Scalar, ...], ...]]
    strain: Callable[[tuple[tuple[Scalar, ...], ...]], tuple[Scalar, ...]]
    names: tuple[str, ...]


def _axisymmetric_F(g: Sequence[Scalar]) -> tuple[tuple[Scalar, ...], ...]:
    return ((1 + g[0], 0, g[1]), (0, 1 + g[2], 0), (g[3], 0, 1 + g[4]))


def _twisted_F(g: Sequence[Scalar]) -> tuple[tuple[Scalar, ...], ...]:
    hoop = 1 + g[2]  # r / R
    return ((1 + g[0], 0, g[1]), (hoop * g[3], hoop, hoop * g[4]), (g[5], 0, 1 + g[6]))


def _cartesian_F(g: Sequence[Scalar]) -> tuple[tuple[Scalar, ...], ...]:
    return tuple(tuple(g[3 * i + j] + (1 if i == j else 0) for j in range(3)) for i in range(3))


def _half_plane_variables(F: tuple[tuple[Scalar, ...], ...]) -> tuple[Scalar, ...]:
    (a, _, b), (_, h, _), (c, _, d) = F
    return (a * d - b * c, h, a * a + c * c, b * b + d * d, a * b + c * d)


def _solid_variables(F: tuple[tuple[Scalar, ...], ...]) -> tuple[Scalar, ...]:
    columns = list(zip(*F, strict=True))
    J = (
        F[0][0] * (F[1][1] * F[2][2] - F[1][2] * F[2][1])
        - F[0][1] * (F[1][0] * F[2][2] - F[1][2] * F[2][0])
        + F[0][2] * (F[1][0] * F[2][1] - F[1][1] * F[2][0])
    )
    pairs = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
    return (J, *(sum(f * g for f, g in zip(columns[i], columns[j], strict=True)) for i, j in pairs))


#: Kinematics by the name that `cases.mode.Setting` gives them.
SETTINGS: Mapping[str, KinematicDescription] = MappingProxyType(
    {
        "axisymmetric": KinematicDescription(
            2,
            ((0, "d0"), (0, "d1"), (0, "over_radius"), (1, "d0"), (1, "d1")),
            _axisymmetric_F,
            _half_plane_variables,
            HALF_PLANE,
        ),
        "axisymmetric_twist": KinematicDescription(
            3,
            (
                (0, "d0"),
                (0, "d1"),
                (0, "over_radius"),
                (1, "radius_d0"),
                (1, "radius_d1"),
                (2, "d0"),
                (2, "d1"),
            ),
            _twisted_F,
            _solid_variables,
            SOLID,
        ),
        "cartesian": KinematicDescription(
            3,
            tuple((i, table) for i in range(3) for table in ("d0", "d1", "d2")),
            _cartesian_F,
            _solid_variables,
            SOLID,
        ),
    }
)
