"""Total energy of a body -> residual, tangent, and the energy's derivative with respect to any parameter.

The energy is the only thing written down; everything else is derived from it by UFL (`forms.chain` says how).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import ufl

from forms.chain import first_variation, second_variation
from forms.kinematics import Kinematics
from forms.law import Law, Scalar
from forms.volumetric import mixed_energy


@dataclass(frozen=True)
class Potential:
    """Energy of the body and its derivatives, as UFL forms of the state (u, p).

    Attributes
    ----------
    energy : UFL form, rank 0
        N mm, of the modelled part of the body.
    residual : UFL form, rank 1
        Derivative of the energy with respect to the state: out-of-balance force (N) and volume (mm^3).
    tangent : UFL form, rank 2
        Derivative of the residual; symmetric.
    parameter_force : callable
        ``parameter_force(name, direction)`` is a UFL form, rank 0: the work on a direction (a function of the
        state's space) of the residual's derivative with respect to a law parameter or to "compliance".
    """

    energy: Scalar
    residual: Scalar
    tangent: Scalar
    parameter_force: Callable[[str, Scalar], Scalar]


def rubber_energy(
    strain: Kinematics, law: Law, parameters: Mapping[str, Scalar], p: Scalar, compliance: Scalar
) -> Scalar:
    """Return the rubber's energy density (MPa): isochoric law plus the mixed volumetric part."""
    return law.energy(strain, **parameters) + mixed_energy(strain.J, p, compliance)


def sleeve_energy(strain: Kinematics, shear_modulus: Scalar, bulk_modulus: Scalar) -> Scalar:
    """Return the energy density (MPa) of a metal sleeve: small strain, any rotation.

    Neo-Hookean with kappa/2 (J - 1)^2 in the displacement alone; metals are far from incompressible.
    """
    return shear_modulus / 2 * (strain.I1 - 3) + bulk_modulus / 2 * (strain.J - 1) ** 2


def potential(
    state: Scalar,
    strain: Kinematics,
    law: Law,
    parameters: Mapping[str, Scalar],
    pressure: Scalar,
    compliance: Scalar,
    rubber: Scalar,
    sleeves: Mapping[Scalar, tuple[Scalar, Scalar]],
) -> Potential:
    """Derive the forms of a body of rubber and metal.

    Parameters
    ----------
    state
        The mixed function (u, p) of which `strain` and `pressure` are made.
    parameters
        Law parameter -> UFL scalar (MPa or 1).
    compliance
        1 / bulk modulus, 1/MPa; zero is exactly incompressible.
    rubber
        Measure of the rubber.
    sleeves
        Measure of a sleeve -> its shear and bulk modulus (MPa).
    """
    # `variable` marks what can be differentiated; without it UFL takes a constant for a constant.
    marked = {name: ufl.variable(value) for name, value in parameters.items()}
    marked_compliance = ufl.variable(compliance)
    marked_pressure = ufl.variable(pressure)
    test, trial = ufl.TestFunction(state.function_space), ufl.TrialFunction(state.function_space)
    density = rubber_energy(strain, law, marked, marked_pressure, marked_compliance) * strain.weight
    measures = (*strain.measures, marked_pressure)
    energy = density * rubber
    residual = first_variation(density, measures, state, test) * rubber
    tangent = second_variation(density, measures, state, test, trial) * rubber
    for measure, (shear, bulk) in sleeves.items():
        metal = sleeve_energy(strain, shear, bulk) * strain.weight
        energy += metal * measure
        residual += first_variation(metal, strain.measures, state, test) * measure
        tangent += second_variation(metal, strain.measures, state, test, trial) * measure

    def parameter_force(name: str, direction: Scalar) -> Scalar:
        parameter = marked_compliance if name == "compliance" else marked[name]
        return first_variation(ufl.diff(density, parameter), measures, state, direction) * rubber

    return Potential(energy, residual, tangent, parameter_force)
