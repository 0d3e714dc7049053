"""Volumetric energy kappa/2 (J - 1)^2 in mixed form, from compressible to exactly incompressible."""

from __future__ import annotations

from forms.law import Scalar


def mixed_energy(J: Scalar, p: Scalar, compliance: Scalar) -> Scalar:
    """Return the perturbed Lagrangian p (J - 1) - compliance p^2 / 2, per reference volume in MPa.

    Its stationary point in p is p = kappa (J - 1) with kappa = 1 / compliance, where it equals kappa/2 (J - 1)^2. A
    compliance of zero leaves the constraint J = 1, with p its multiplier; nothing is divided by the compliance.

    Parameters
    ----------
    J : UFL scalar
        Determinant of the deformation gradient.
    p : UFL scalar
        Pressure-like multiplier in MPa, positive in tension.
    compliance : UFL scalar
        1 / kappa in 1/MPa, zero or positive.

    References
    ----------
    Simo, Taylor and Pister (1985), Variational and projection methods for the volume constraint in finite
    deformation elasto-plasticity, Comput. Methods Appl. Mech. Eng. 51:177-208,
    doi:10.1016/0045-7825(85)90033-7. Brink and Stein (1996), On some mixed finite element methods for
    incompressible and nearly incompressible finite elasticity, Comput. Mech. 19:105-119,
    doi:10.1007/BF02824849.
    """
    return p * (J - 1) - compliance / 2 * p**2
