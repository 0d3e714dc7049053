"""Neo-Hookean law, the Gaussian network."""

from __future__ import annotations

from forms.law import Law, Parameter, Scalar, Strain


def energy(strain: Strain, *, C10: Scalar) -> Scalar:
    """Return W = C10 (I1 - 3).

    Parameters
    ----------
    strain : Strain
        Isochoric measures of the deformation.
    C10 : Scalar
        Coefficient of I1 - 3, MPa.

    References
    ----------
    Treloar (1943), The elasticity of a network of long-chain molecules I, Trans. Faraday Soc. 39:36-41,
    doi:10.1039/TF9433900036. Rivlin (1948), doi:10.1098/rsta.1948.0002.
    """
    return C10 * (strain.I1 - 3)


def shear_modulus(*, C10: float) -> float:
    """Return mu = 2 C10."""
    return 2 * C10


LAW = Law(
    name="neo_hookean",
    summary="W = C10 (I1 - 3)",
    parameters=(Parameter("C10", "MPa", "half the shear modulus", 0.5, 1e-6, 1e3),),
    energy=energy,
    shear_modulus=shear_modulus,
    basis="I1",
    linear=("C10",),
    source="Rivlin (1948), Large elastic deformations of isotropic materials I, doi:10.1098/rsta.1948.0002",
)
