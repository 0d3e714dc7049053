"""Ogden law: one to three powers of the principal stretches."""

from __future__ import annotations

from collections.abc import Mapping

from forms.law import Law, Parameter, Scalar, Strain


def energy(strain: Strain, **parameters: Scalar) -> Scalar:
    """Return W = sum_i mu_i / alpha_i (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3).

    ``mu1``, ``alpha1`` are required; the pairs ``mu2``, ``alpha2`` and ``mu3``, ``alpha3`` may be absent.

    Parameters
    ----------
    strain : Strain
        Isochoric measures of the deformation.
    **parameters : Scalar
        Moduli mu1, mu2, mu3 in MPa and exponents alpha1, alpha2, alpha3 (numbers without unit).

    Raises
    ------
    ValueError
        When only one parameter of a pair is given.

    References
    ----------
    Ogden (1972), Large deformation isotropic elasticity - on the correlation of theory and experiment for
    incompressible rubberlike solids, Proc. R. Soc. A 326:565-584, doi:10.1098/rspa.1972.0026.
    """
    return sum(
        mu / _nonzero(alpha) * (strain.power_trace(_nonzero(alpha)) - 3) for mu, alpha in _terms(parameters)
    )


def shear_modulus(**parameters: float) -> float:
    """Return mu = 1/2 sum_i mu_i alpha_i."""
    return sum(mu * alpha for mu, alpha in _terms(parameters)) / 2


def _terms(parameters: Mapping[str, Scalar]) -> list[tuple[Scalar, Scalar]]:
    """Return the pairs (mu_i, alpha_i) that are given."""
    terms = []
    for i in (1, 2, 3):
        mu, alpha = parameters.get(f"mu{i}"), parameters.get(f"alpha{i}")
        if (mu is None) != (alpha is None) or (i == 1 and mu is None):
            present, lacking = (f"mu{i}", f"alpha{i}") if alpha is None else (f"alpha{i}", f"mu{i}")
            raise ValueError(f"ogden: {lacking} is missing; term {i} needs {present} and {lacking}")
        if mu is not None:
            terms.append((mu, alpha))
    return terms


def _nonzero(alpha: Scalar) -> Scalar:
    """Return ``alpha``, moved off zero where the quotient 1/alpha has a removable singularity.

    The shift is constant, so that the derivative with respect to alpha stays right; 2e-7 changes the energy
    by less than what a solve resolves.
    """
    import ufl  # here, because the registry of laws is read before the finite-element stack is loaded

    return alpha + ufl.conditional(ufl.lt(abs(alpha), 1e-7), 2e-7, 0.0)


def _term(i: int, mu: float, alpha: float) -> tuple[Parameter, Parameter]:
    return (
        Parameter(
            f"mu{i}", "MPa", f"modulus of term {i}, of the sign of alpha{i}", mu, -1e3, 1e3, optional=i > 1
        ),
        Parameter(f"alpha{i}", "1", f"exponent of term {i}", alpha, -25.0, 25.0, optional=i > 1),
    )


LAW = Law(
    name="ogden",
    summary="W = sum_i mu_i/alpha_i (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3), i = 1 to 3",
    # Start: Ogden's (1972) set for Treloar's vulcanised natural rubber, with the negative exponent second: a fit of two
    # terms of the same sign to uniaxial and equibiaxial tests together ends in a valley.
    parameters=(*_term(1, 0.63, 1.3), *_term(2, -0.01, -2.0), *_term(3, 0.0012, 5.0)),
    energy=energy,
    shear_modulus=shear_modulus,
    basis="stretches",
    linear=("mu1", "mu2", "mu3"),
    source="Ogden (1972), Large deformation isotropic elasticity, doi:10.1098/rspa.1972.0026",
)
