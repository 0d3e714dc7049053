"""From displacement to deformation: F, C, J and the isochoric measures that the laws are written in.

Everything is written out in components. UFL would otherwise expand ``det``, ``inv`` and ``tr(C*C)`` into sums
with structural zeros and repeated factors, and the generated kernels grow with them. The scalars that the
energy depends on are ``ufl.variable``, by which `forms.chain` differentiates; ``ufl.derivative`` sees through
them. Powers of J are exponentials, because their derivatives then share one logarithm; each derivative of a
power is one more ``pow``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import ufl

from forms.law import Scalar
from forms.setting import HALF_PLANE, SETTINGS
from forms.spectral import pair_power_trace
from forms.spectral import power_trace as tensor_power_trace
from forms.symmetric import Symmetric


@dataclass(frozen=True)
class Moved:
    """Position of the stress-free body, given on the mesh: X + displacement(X).

    Attributes
    ----------
    displacement : UFL vector
        mm, in the coordinates of the mesh: (R, Z) of the half-plane, or x, y, z.
    inverse : tuple of tuples of UFL scalars
        Rows of M^-1, with M the gradient of X + displacement(X); plain zeros where it vanishes.
    ratio : UFL scalar
        det M: area (or volume) of the stress-free body over that of the mesh.
    """

    displacement: Scalar
    inverse: tuple[tuple[Scalar, ...], ...]
    ratio: Scalar

    @classmethod
    def by(cls, displacement: Scalar) -> Moved:
        """Return the motion with its gradient derived, which makes larger kernels than a gradient in closed form."""
        n = len(displacement)
        M = ufl.Identity(n) + ufl.grad(displacement)
        inverse = ufl.inv(M)
        return cls(displacement, tuple(tuple(inverse[i, j] for j in range(n)) for i in range(n)), ufl.det(M))

    def gradient(self, u: Scalar) -> tuple[tuple[Scalar, ...], ...]:
        """Gradient of a vector by the coordinates of the stress-free body, row by row."""
        G, n = ufl.grad(u), range(len(self.inverse))
        return tuple(
            tuple(sum(G[i, k] * self.inverse[k][j] for k in n if not _is_zero(self.inverse[k][j])) for j in n)
            for i in range(len(u))
        )

    def area(self, normal: Scalar) -> Scalar:
        """Area of a piece of the stress-free surface over that of the mesh with this unit normal (Nanson)."""
        n = range(len(self.inverse))
        turned = [
            sum(self.inverse[k][j] * normal[k] for k in n if not _is_zero(self.inverse[k][j])) for j in n
        ]
        return self.ratio * ufl.sqrt(sum(part * part for part in turned))


@dataclass(frozen=True)
class Kinematics:
    """A deformation and its measures, all UFL expressions.

    Attributes
    ----------
    F : UFL tensor, shape (3, 3), or None where only strains are given
        Deformation gradient; components in (r, theta, Z) or (x, y, z) order.
    J : UFL scalar
        det F.
    weight : UFL scalar or float
        Volume per area of the mesh: 2 pi R (mm) in an axisymmetric half-plane, 1 in 3-D.
    measures : tuple of ufl.variable
        The few scalars through which J, I1, I2 and the power traces depend on the displacement.
    I1, I2 : UFL scalar
        Invariants of the isochoric right Cauchy-Green tensor J^(-2/3) F^T F.
    power_trace : callable
        ``power_trace(alpha)`` is the sum of the isochoric principal stretches to the power ``alpha``.
    metric : Symmetric of ufl.variable, or None where there is no body
        Right Cauchy-Green tensor, volume included, for branches with a memory of direction.
    volume_measures : tuple of ufl.variable
        The measures that make up J.
    variables : tuple of ufl.variable
        The strain variables that all measures are made of, where they are known (`strain_of`).
    """

    F: Scalar
    J: Scalar
    weight: Scalar
    measures: tuple[Scalar, ...]
    I1: Scalar
    I2: Scalar
    power_trace: Callable[[Scalar], Scalar] = field(repr=False)
    metric: Symmetric | None = None
    volume_measures: tuple[Scalar, ...] = ()
    variables: tuple[Scalar, ...] = ()

    @property
    def C(self) -> Scalar:
        """Right Cauchy-Green tensor F^T F, shape (3, 3)."""
        return self.F.T * self.F


def axisymmetric(u: Scalar, R: Scalar, moved: Moved | None = None) -> Kinematics:
    """Return the kinematics of an axisymmetric deformation without twist.

    Parameters
    ----------
    u : UFL vector, shape (2,)
        Displacement (u_r, u_z) in mm over a mesh of the (R, Z) half-plane.
    R : UFL scalar
        Radius on the mesh, mm.
    moved : Moved, optional
        The stress-free half-plane, where it is not the mesh's.
    """
    G, R, weight = _half_plane(u, R, moved)
    return _kinematics_of("axisymmetric", (*G[0], u[0] / R, *G[1]), weight)


def axisymmetric_twist(u: Scalar, R: Scalar, moved: Moved | None = None) -> Kinematics:
    """Return the kinematics of an axisymmetric deformation with finite twist about the axis.

    The point (R, Theta, Z) moves to r = R + u_r, theta = Theta + phi, z = Z + u_z; F maps the cylindrical
    basis at the reference place to the one at the current place, and is exact for any twist.

    Parameters
    ----------
    u : UFL vector, shape (3,)
        (u_r in mm, phi in rad, u_z in mm) over a mesh of the (R, Z) half-plane.
    R : UFL scalar
        Radius on the mesh, mm.
    moved : Moved, optional
        The stress-free half-plane, where it is not the mesh's.

    References
    ----------
    Ogden (1997), Non-Linear Elastic Deformations, Dover, section 2.2 (deformation in cylindrical
    coordinates).
    """
    G, R, weight = _half_plane(u, R, moved)
    turned = [R * slope for slope in G[1]]
    return _kinematics_of("axisymmetric_twist", (*G[0], u[0] / R, *turned, *G[2]), weight)


def kinematics_of(name: str, u: Scalar, x: Scalar, moved: Moved | None = None) -> Kinematics:
    """Return the kinematics by their name in `forms.setting.SETTINGS`, of a displacement over coordinates x.

    Parameters
    ----------
    name : str
        Name of the kinematics in `SETTINGS`.
    u : Scalar
        Displacement, mm.
    x : Scalar
        Coordinates of the mesh, mm.
    moved : Moved | None
        Stress-free body; None where it is the mesh.
    """
    if name == "cartesian":
        return cartesian(u, moved)
    return (axisymmetric if name == "axisymmetric" else axisymmetric_twist)(u, x[0], moved)


def _half_plane(
    u: Scalar, R: Scalar, moved: Moved | None
) -> tuple[tuple[tuple[Scalar, ...], ...], Scalar, Scalar]:
    """Gradient by the coordinates of the stress-free half-plane, radius there, and its volume per area of the mesh."""
    if moved is None:
        return _rows(u, 2), R, 2 * ufl.pi * R
    R = R + moved.displacement[0]
    return moved.gradient(u), R, 2 * ufl.pi * R * moved.ratio


def _rows(u: Scalar, dimension: int) -> tuple[tuple[Scalar, ...], ...]:
    """Gradient of a vector on the mesh, row by row."""
    G = ufl.grad(u)
    return tuple(tuple(G[i, j] for j in range(dimension)) for i in range(len(u)))


def _is_zero(value: Scalar) -> bool:
    return isinstance(value, int) and value == 0


def cartesian(u: Scalar, moved: Moved | None = None) -> Kinematics:
    """Return the kinematics of a 3-D displacement ``u``, shape (3,), in mm.

    Parameters
    ----------
    u
        Displacement from the stress-free shape.
    moved : Moved, optional
        The stress-free shape, where it is not the mesh's.
    """
    G = _rows(u, 3) if moved is None else moved.gradient(u)
    return _kinematics_of("cartesian", (*G[0], *G[1], *G[2]), 1.0 if moved is None else moved.ratio)


def principal(e1: Scalar, e2: Scalar) -> Kinematics:
    """Return the isochoric kinematics of the principal log strains ``e1``, ``e2`` and -e1-e2.

    For calculations with a law but without a body: stability checks and coupon stresses.

    Parameters
    ----------
    e1 : Scalar
        First principal logarithmic strain, dimensionless.
    e2 : Scalar
        Second principal logarithmic strain, dimensionless.
    """
    e1, e2 = ufl.variable(e1), ufl.variable(e2)
    e = (e1, e2, -e1 - e2)
    return Kinematics(
        F=ufl.diag(ufl.as_vector([ufl.exp(x) for x in e])),
        J=ufl.as_ufl(1.0),
        weight=1.0,
        measures=(e1, e2),
        I1=sum(ufl.exp(2 * x) for x in e),
        I2=sum(ufl.exp(-2 * x) for x in e),
        power_trace=lambda alpha: sum(ufl.exp(alpha * x) for x in e),
    )


def strain_of(y: Sequence[Scalar]) -> Kinematics:
    """Return the measures made of the strain variables of a `forms.setting.KinematicDescription`, without F.

    Parameters
    ----------
    y : sequence of ufl.variable
        In the order of `KinematicDescription.strain`.
    """
    strain = _half_plane_strain(*y) if len(y) == len(HALF_PLANE) else _solid_strain(*y)
    return replace(strain, variables=tuple(y))


def _kinematics_of(name: str, g: Sequence[Scalar], weight: Scalar) -> Kinematics:
    F = SETTINGS[name].deformation(g)
    strain = strain_of([ufl.variable(component) for component in SETTINGS[name].strain(F)])
    return replace(strain, F=ufl.as_matrix(F), weight=weight)


def _half_plane_strain(area: Scalar, h: Scalar, rr: Scalar, zz: Scalar, rz: Scalar) -> Kinematics:
    """Measures from the area ratio of the half-plane, the hoop stretch and the half-plane's block of C."""
    trace = ufl.variable(rr + zz)
    J = ufl.variable(area * h)
    log_J = ufl.ln(J)
    s = ufl.exp(-2 / 3 * log_J)

    def power_trace(alpha: Scalar) -> Scalar:
        # The hoop direction is principal: only the pair in the half-plane is left, and there is no cubic equation to
        # solve.
        pair = pair_power_trace(trace / 2, trace * trace / 4 - area * area, alpha / 2)
        return ufl.exp(-alpha / 3 * log_J) * (pair + ufl.exp(alpha * ufl.ln(h)))

    return Kinematics(
        F=None,
        J=J,
        weight=1.0,
        measures=(area, trace, h),
        I1=s * (trace + h * h),
        I2=s * s * (area * area + h * h * trace),
        power_trace=power_trace,
        metric=Symmetric((rr, h * h, zz, 0, rz, 0)),
        volume_measures=(J,),
    )


def _solid_strain(J: Scalar, *metric: Scalar) -> Kinematics:
    """Measures from det F and the six components of C."""
    stretches, (yz, xz, xy) = metric[:3], metric[3:]
    xx, yy, zz = (stretch - sum(stretches) / 3 for stretch in stretches)
    # From the components of the deviator of C: from the invariants of C they would be small differences of large
    # numbers.
    J2 = ufl.variable((xx * xx + yy * yy + zz * zz) / 2 + yz * yz + xz * xz + xy * xy)
    J3 = ufl.variable(xx * yy * zz + 2 * yz * xz * xy - xx * yz * yz - yy * xz * xz - zz * xy * xy)
    trace = ufl.variable(sum(stretches))
    m = trace / 3
    log_J = ufl.ln(J)
    s = ufl.exp(-2 / 3 * log_J)

    def power_trace(alpha: Scalar) -> Scalar:
        return ufl.exp(-alpha / 3 * log_J) * tensor_power_trace(m, J2, J3, alpha / 2)

    return Kinematics(
        F=None,
        J=J,
        weight=1.0,
        measures=(J, trace, J2, J3),
        I1=s * trace,
        I2=s * s * (3 * m * m - J2),
        power_trace=power_trace,
        metric=Symmetric(metric),
        volume_measures=(J,),
    )
