"""Mooney-Rivlin law, linear in both invariants."""

from __future__ import annotations

from forms.law import Law, Parameter, Scalar, Strain


def energy(strain: Strain, *, C10: Scalar, C01: Scalar) -> Scalar:
    """Return W = C10 (I1 - 3) + C01 (I2 - 3).

    Parameters
    ----------
    strain : Strain
        Isochoric measures of the deformation.
    C10 : Scalar
        Coefficient of I1 - 3, MPa.
    C01 : Scalar
        Coefficient of I2 - 3, MPa.

    References
    ----------
    Mooney (1940), A theory of large elastic deformation, J. Appl. Phys. 11:582-592, doi:10.1063/1.1712836.
    Rivlin (1948), Large elastic deformations of isotropic materials IV, doi:10.1098/rsta.1948.0024.
    """
    return C10 * (strain.I1 - 3) + C01 * (strain.I2 - 3)


def shear_modulus(*, C10: float, C01: float) -> float:
    """Return mu = 2 (C10 + C01).

    Parameters
    ----------
    C10 : float
        Coefficient of I1 - 3, MPa.
    C01 : float
        Coefficient of I2 - 3, MPa.
    """
    return 2 * (C10 + C01)


LAW = Law(
    name="mooney_rivlin",
    summary="W = C10 (I1 - 3) + C01 (I2 - 3)",
    parameters=(
        Parameter("C10", "MPa", "coefficient of I1 - 3", 0.4, -1e3, 1e3),
        Parameter("C01", "MPa", "coefficient of I2 - 3", 0.1, -1e3, 1e3),
    ),
    energy=energy,
    shear_modulus=shear_modulus,
    basis="I1,I2",
    linear=("C10", "C01"),
    source="Mooney (1940), A theory of large elastic deformation, doi:10.1063/1.1712836",
)
