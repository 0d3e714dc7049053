"""Volumetric energy kappa/2 (J - 1)^2 in mixed form, from compressible to exactly incompressible.

In the mixed form the volume is prescribed by the pressures, which are continuous and of a lower order than it: volumes
that change from point to point within a cell, or in one cell against the next, have no stiffness against them. A free
surface that is compressed then wrinkles, with waves as short as the cells, at strains at which rubber does not: the
bottom of a groove at a stretch of 0.74, where a half-space wrinkles at 0.54. `stabilising_energy` prevents it. In
tetrahedra there are five or six cells for each pressure, and a cell's own volume is prescribed only together with its
neighbours'. Where a surface folds, single cells were seen to lose more than half of their volume, beside others that
gained it, until Newton's method inverted them. `guard_energy` limits that.

Cells on bonds have neither (`cases.elements`): volumes at the edges of bonds, where strains are unbounded, are wrong on
any mesh, and a ring of default tetrahedra would be 1.3 % too stiff with the second at a tenth of its thickness.

References
----------
Auricchio, Beirao da Veiga, Lovadina and Reali (2010), The importance of the exact satisfaction of the incompressibility
constraint in nonlinear elasticity: mixed FEMs versus NURBS-based approximations, Comput. Methods Appl. Mech. Eng.
199:314-323, doi:10.1016/j.cma.2008.06.004 (mixed elements that are unstable where the body is not).
Biot (1963), Surface instability of rubber in compression, Appl. Sci. Res. A 12:168-182, doi:10.1007/BF03184638 (0.54).
"""

from __future__ import annotations

import ufl

from forms.law import Scalar

# Volumes at points that change by less than this have no further energy. The kidney STEP of the references, pressed
# radially, has ratios of 0.90 to 1.10 at 1.2 mm, where nothing folds, most of all at the edges of its bonds.
FREE = 0.1
# Stiffness over the initial shear modulus. The bushing above has volume ratios of 0.79 to 1.18 with it at 3.9 mm, and
# of 0.58 to 1.44 without; forces differ by 0.01 % at 1.5 mm and by 0.04 % at 2.1 mm, where creases begin.
GUARD = 100.0
# Stiffness of the stabilising energy over the initial shear modulus and half of I1 - 3. A section with a deep groove
# began to wrinkle at 0.85 mm without it and at 1.8 mm with a constant ratio of 1, which is 3 (I1 - 3) at a stretch of
# 0.75; with 3 (I1 - 3) it did not up to 2.4 mm. Its force differs by 0.02 % at 1.5 mm, that of a plain bushing of
# 12/22/40 mm by 0.07 % at 15 % of its thickness, and by 0.17 % with 10.
STABLE = 3.0


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


def stabilising_energy(J: Scalar, p: Scalar, I1: Scalar, compliance: Scalar, shear_modulus: Scalar) -> Scalar:
    """Return the energy of the difference of the volume from the one that the pressure stands for, in MPa.

    STABLE mu / 2 (I1 - 3) (J - 1 - compliance p)^2. The exact solution has no such difference, and none of this energy.
    It grows with the strain as the instability does that it prevents; without strain there is none either.

    Parameters
    ----------
    J : UFL scalar
        Determinant of the deformation gradient.
    p : UFL scalar
        Pressure-like multiplier, MPa.
    I1 : UFL scalar
        First isochoric invariant.
    compliance : UFL scalar
        1 / kappa in 1/MPa.
    shear_modulus : UFL scalar
        Initial shear modulus, MPa.

    References
    ----------
    Olshanskii and Reusken (2004), Grad-div stabilization for Stokes equations, Math. Comput. 73:1699-1718,
    doi:10.1090/S0025-5718-03-01629-6 (the same term for small strains).
    """
    return STABLE * shear_modulus / 2 * (I1 - 3) * (J - 1 - compliance * p) ** 2


def guard_energy(J: Scalar, shear_modulus: Scalar) -> Scalar:
    """Return the energy of volumes that the pressures do not prescribe, per reference volume in MPa.

    GUARD mu / 3 max(|ln J| - FREE, 0)^3, whose second derivative is continuous. The exact solution has |ln J| of the
    order of mu / kappa, and none of this energy.

    Parameters
    ----------
    J : UFL scalar
        Determinant of the deformation gradient.
    shear_modulus : UFL scalar
        Initial shear modulus, MPa.

    References
    ----------
    Case, Ervin, Linke and Rebholz (2011), A connection between Scott-Vogelius and grad-div stabilized Taylor-Hood FE
    approximations of the Navier-Stokes equations, SIAM J. Numer. Anal. 49:1461-1481, doi:10.1137/100794250 (a penalty
    on what the pressures leave of the divergence, there without the range that is free here).
    """
    return GUARD * shear_modulus / 3 * ufl.max_value(abs(ufl.ln(J)) - FREE, 0) ** 3
