"""Gent law: neo-Hookean at small strain, locking at a largest I1."""

from __future__ import annotations

from forms.law import Law, Parameter, Scalar, Strain


def energy(strain: Strain, *, mu: Scalar, Jm: Scalar) -> Scalar:
    """Return W = -mu Jm / 2 ln(1 - (I1 - 3) / Jm).

    Beyond the locking limit I1 - 3 = Jm there is no energy: the logarithm gives NaN there, by which the solver
    recognises a step that is too long.

    Parameters
    ----------
    strain : Strain
        Isochoric measures of the deformation.
    mu : Scalar
        Initial shear modulus, MPa.
    Jm : Scalar
        Largest I1 - 3, at which the chains lock; dimensionless.

    References
    ----------
    Gent (1996), A new constitutive relation for rubber, Rubber Chem. Technol. 69:59-61,
    doi:10.5254/1.3538357.
    """
    import ufl  # here, because the registry of laws is read before the finite-element stack is loaded

    return -mu * Jm / 2 * ufl.ln(1 - (strain.I1 - 3) / Jm)


def shear_modulus(*, mu: float, Jm: float) -> float:
    """Return mu.

    Parameters
    ----------
    mu : float
        Initial shear modulus, MPa.
    Jm : float
        Largest I1 - 3, at which the chains lock; dimensionless.
    """
    return mu


LAW = Law(
    name="gent",
    summary="W = -mu Jm/2 ln(1 - (I1 - 3)/Jm)",
    parameters=(
        Parameter("mu", "MPa", "initial shear modulus", 1.0, 1e-6, 1e3),
        Parameter("Jm", "1", "largest I1 - 3, where the chains lock", 100.0, 0.1, 1e5),
    ),
    energy=energy,
    shear_modulus=shear_modulus,
    basis="I1",
    linear=("mu",),
    source="Gent (1996), A new constitutive relation for rubber, doi:10.5254/1.3538357",
)
