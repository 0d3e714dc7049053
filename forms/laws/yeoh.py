"""Yeoh law: a cubic in I1 - 3, for carbon-black filled rubber."""

from __future__ import annotations

from forms.law import Law, Parameter, Scalar, Strain


def energy(strain: Strain, *, C10: Scalar, C20: Scalar, C30: Scalar) -> Scalar:
    """Return W = C10 (I1 - 3) + C20 (I1 - 3)^2 + C30 (I1 - 3)^3.

    C20 is usually negative (the shear modulus falls at first), C30 positive (it rises at large strain).

    Parameters
    ----------
    strain : Strain
        Isochoric measures of the deformation.
    C10 : Scalar
        Coefficient of I1 - 3, MPa.
    C20 : Scalar
        Coefficient of (I1 - 3)^2, MPa.
    C30 : Scalar
        Coefficient of (I1 - 3)^3, MPa.

    References
    ----------
    Yeoh (1993), Some forms of the strain energy function for rubber, Rubber Chem. Technol. 66:754-771,
    doi:10.5254/1.3538343.
    """
    x = strain.I1 - 3
    return x * (C10 + x * (C20 + x * C30))


def shear_modulus(*, C10: float, C20: float, C30: float) -> float:
    """Return mu = 2 C10; C20 and C30 do not enter.

    Parameters
    ----------
    C10 : float
        Coefficient of I1 - 3, MPa.
    C20 : float
        Coefficient of (I1 - 3)^2, MPa.
    C30 : float
        Coefficient of (I1 - 3)^3, MPa.
    """
    return 2 * C10


LAW = Law(
    name="yeoh",
    summary="W = C10 (I1 - 3) + C20 (I1 - 3)^2 + C30 (I1 - 3)^3",
    parameters=(
        Parameter("C10", "MPa", "half the initial shear modulus", 0.5, 1e-6, 1e3),
        Parameter("C20", "MPa", "softening at moderate strain when negative", -0.05, -1e2, 1e2),
        Parameter("C30", "MPa", "stiffening at large strain", 0.01, -1e2, 1e2),
    ),
    energy=energy,
    shear_modulus=shear_modulus,
    basis="I1",
    linear=("C10", "C20", "C30"),
    source="Yeoh (1993), Some forms of the strain energy function for rubber, doi:10.5254/1.3538343",
)
