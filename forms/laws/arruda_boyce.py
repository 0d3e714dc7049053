"""Arruda-Boyce eight-chain law, as its five-term series."""

from __future__ import annotations

from forms.law import Law, Parameter, Scalar, Strain

#: Coefficients of the inverse Langevin series in powers of I1 / lambda_m^2.
SERIES = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)


def energy(strain: Strain, *, mu: Scalar, lambda_m: Scalar) -> Scalar:
    """Return W = mu sum_i c_i / lambda_m^(2i-2) (I1^i - 3^i), c = 1/2, 1/20, 11/1050, 19/7000, 519/673750.

    ``mu`` is n k T of the network, the coefficient of the Gaussian term; the initial shear modulus is higher
    by the terms in 1 / lambda_m^2, see `shear_modulus`.

    Parameters
    ----------
    strain : Strain
        Isochoric measures of the deformation.
    mu : Scalar
        Shear modulus of the Gaussian network, MPa.
    lambda_m : Scalar
        Stretch at which the chains lock, a ratio.

    References
    ----------
    Arruda and Boyce (1993), A three-dimensional constitutive model for the large stretch behavior of rubber
    elastic materials, J. Mech. Phys. Solids 41:389-412, doi:10.1016/0022-5096(93)90013-6.
    """
    locking = 1 / lambda_m**2
    x, x0 = strain.I1 * locking, 3 * locking
    # Horner's scheme in I1 / lambda_m^2; I1^i - 3^i as the difference of two such sums.
    return mu / locking * (_horner(x) - _horner(x0))


def _horner(x: Scalar) -> Scalar:
    """Return sum_i c_i x^i."""
    total = SERIES[-1] * x
    for coefficient in SERIES[-2::-1]:
        total = (total + coefficient) * x
    return total


def shear_modulus(*, mu: float, lambda_m: float) -> float:
    """Return mu (1 + 3/(5 l^2) + 99/(175 l^4) + 513/(875 l^6) + 42039/(67375 l^8)), l = lambda_m.

    Parameters
    ----------
    mu : float
        Shear modulus of the Gaussian network, MPa.
    lambda_m : float
        Stretch at which the chains lock, a ratio.
    """
    x = 3 / lambda_m**2
    return mu * sum(2 * i * coefficient * x ** (i - 1) for i, coefficient in enumerate(SERIES, start=1))


LAW = Law(
    name="arruda_boyce",
    summary="W = mu sum_i c_i/lambda_m^(2i-2) (I1^i - 3^i), i = 1 to 5",
    parameters=(
        Parameter("mu", "MPa", "modulus of the Gaussian network", 1.0, 1e-6, 1e3),
        Parameter("lambda_m", "1", "locking stretch of the chains", 3.0, 1.05, 1e2),
    ),
    energy=energy,
    shear_modulus=shear_modulus,
    basis="I1",
    linear=("mu",),
    source="Arruda and Boyce (1993), doi:10.1016/0022-5096(93)90013-6",
)
