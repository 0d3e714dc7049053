"""Energies of metal sleeves and of surfaces, with all derivatives that a solution needs.

The rubber's and the metal's energies are differentiated at a point (`forms.answers`). An energy of a surface depends in
its own way on the displacement there, on coordinates and on the motion of a sleeve; it remains a separate form, added
in assembly.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import ufl

from forms.branch import Branch
from forms.law import Scalar


@dataclass(frozen=True)
class Attached:
    """A branch and the values of its parameters by name."""

    branch: Branch
    parameters: Mapping[str, Scalar]


def sleeve_energy(strain: Scalar, shear_modulus: Scalar, bulk_modulus: Scalar) -> Scalar:
    """Return the energy density (MPa) of a metal sleeve: small strain, any rotation.

    Neo-Hookean with kappa/2 (J - 1)^2, without a pressure unknown: metals are far from incompressible.

    Parameters
    ----------
    strain : forms.kinematics.Kinematics
    shear_modulus, bulk_modulus : UFL scalar
        MPa.
    """
    return shear_modulus / 2 * (strain.I1 - 3) + bulk_modulus / 2 * (strain.J - 1) ** 2


@dataclass(frozen=True)
class Surfaces:
    """Energies of surfaces, and their derivatives.

    Attributes
    ----------
    state : Function
        The mixed function (u, p, ...).
    energies : sequence of UFL form, rank 0
        Energies, N mm.
    """

    state: Scalar
    energies: Sequence[Scalar]

    @property
    def energy(self) -> Scalar:
        """UFL form of rank 0, N mm."""
        return sum(self.energies)

    @property
    def residual(self) -> Scalar:
        """Derivative of the energy with respect to the state: UFL form of rank 1, N."""
        return ufl.derivative(self.energy, self.state, ufl.TestFunction(self.state.function_space))

    @property
    def tangent(self) -> Scalar:
        """Derivative of the residual; symmetric."""
        return ufl.derivative(self.residual, self.state, ufl.TrialFunction(self.state.function_space))

    def action(self, direction: Scalar) -> Scalar:
        """Return the product of the tangent and a function of the state's space: UFL form, rank 1."""
        return ufl.derivative(self.residual, self.state, direction)

    def parameter_force(self, parameter: Scalar) -> Scalar:
        """Derivative of the residual with respect to a ufl.variable: UFL form, rank 1."""
        test = ufl.TestFunction(self.state.function_space)
        return sum(ufl.derivative(_slope(energy, parameter), self.state, test) for energy in self.energies)


def _slope(form: Scalar, parameter: Scalar) -> Scalar:
    return ufl.Form(
        [
            integral.reconstruct(integrand=ufl.diff(integral.integrand(), parameter))
            for integral in form.integrals()
        ]
    )
