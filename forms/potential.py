"""Total energy of a body -> residual, tangent, and the derivatives with respect to parameters and memory.

The energy is the only thing written down; everything else is derived from it by UFL (`forms.chain` says how). Branches
enter by the incremental energy of a step (`forms.branch`): the derivative with respect to the state at its end.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import ufl

from forms.branch import Branch, Internal, Step
from forms.chain import first_variation, made_of, second_variation
from forms.kinematics import Kinematics
from forms.law import Law, Scalar
from forms.symmetric import Symmetric, unpacked
from forms.volumetric import mixed_energy


@dataclass(frozen=True)
class Attached:
    """A branch and its parameters, UFL scalars by the branch's names for them."""

    branch: Branch
    parameters: Mapping[str, Scalar]


@dataclass(frozen=True)
class _Term:
    """An energy density per area or volume of the mesh, the scalars that it depends on the state by, and where."""

    density: Scalar
    measures: tuple[Scalar, ...]
    # The same without measures that depend on parameters or memory.
    plain_measures: tuple[Scalar, ...]
    dx: Scalar


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


@dataclass(frozen=True)
class Body:
    """What an energy is made of.

    Attributes
    ----------
    state : Function
        The mixed function (u, p).
    strain : Kinematics
        Of u.
    law : Law
    parameters : mapping
        Law parameter -> ufl.variable (MPa or 1).
    pressure : UFL scalar
    compliance : UFL scalar
        1 / bulk modulus, 1/MPa; zero is exactly incompressible.
    rubber : Measure
    sleeves : mapping
        Measure of a sleeve -> its shear and bulk modulus (MPa).
    swelling : UFL scalar
        Volume ratio of the stress-free rubber to the mesh; 1 where it has not shrunk.
    branches : sequence of Attached
    internal : Function or None
        All internal variables at the beginning of the step, at the quadrature points, shape (k,).
    duration : UFL scalar
        Of the step, s.
    surfaces : sequence of UFL form, rank 0
        Energies of surfaces, N mm.
    """

    state: Scalar
    strain: Kinematics
    law: Law
    parameters: Mapping[str, Scalar]
    pressure: Scalar
    compliance: Scalar
    rubber: Scalar
    sleeves: Mapping[Scalar, tuple[Scalar, Scalar]]
    swelling: Scalar = 1.0
    branches: Sequence[Attached] = ()
    internal: Scalar = None
    duration: Scalar = None
    surfaces: Sequence[Scalar] = ()


class Potential:
    """Energy of a body and its derivatives, as UFL forms of the state (u, p).

    Attributes
    ----------
    energy : UFL form, rank 0
        Stored energy, N mm, of the modelled part of the body.
    residual : UFL form, rank 1
        Derivative of the (incremental) energy with respect to the state: out-of-balance force (N) and volume (mm^3).
    tangent : UFL form, rank 2
        Derivative of the residual; symmetric.
    update : UFL vector, shape (k,), or None
        Internal variables at the end of the step.
    """

    def __init__(self, body: Body) -> None:
        self.body = body
        self._test = ufl.TestFunction(body.state.function_space)
        self._trial = ufl.TrialFunction(body.state.function_space)
        # Without `variable` UFL takes a function for one that nothing depends on.
        self._pressure = ufl.variable(body.pressure)
        self._terms, stored, updated = self._rubber()
        for measure, (shear, bulk) in body.sleeves.items():
            metal = sleeve_energy(body.strain, shear, bulk) * body.strain.weight
            self._terms.append(_Term(metal, body.strain.measures, body.strain.measures, measure))
            stored += metal * measure
        self.energy = stored + sum(body.surfaces)
        self.update = ufl.as_vector(updated) if updated else None

    def _rubber(self) -> tuple[list[_Term], Scalar, list[Scalar]]:
        body = self.body
        # Energy is per volume of the stress-free rubber.
        strain, weight = body.strain, body.strain.weight * body.swelling
        law_energy = body.law.energy(strain, **body.parameters)
        J = strain.J if body.swelling == 1.0 else strain.J / body.swelling
        own = law_energy + mixed_energy(J, self._pressure, body.compliance)
        stored, separate, updated = own, [], []
        isochoric = law_energy
        plain = (
            ()
            if strain.metric is None
            else tuple(c for c in strain.metric.components if not isinstance(c, int))
        )
        for attached, internal in self._internal():
            step = Step(
                strain,
                law_energy,
                body.law.shear_modulus(**body.parameters),
                internal,
                body.duration,
            )
            branch = attached.branch
            made = branch.contribution(step, **attached.parameters)
            end = branch.update(step, **attached.parameters)
            updated += [c for name in branch.internal for c in _components(end[name])]
            stored += made.stored
            if made.measures is None:
                own += made.incremental
                isochoric += made.incremental
            else:
                separate.append(
                    _Term(
                        made.incremental * weight,
                        made.measures,
                        (*strain.volume_measures, *plain),
                        body.rubber,
                    )
                )
        self._isochoric = [
            _Term(isochoric * weight, strain.measures, strain.measures, body.rubber),
            *separate,
        ]
        measures = (*strain.measures, self._pressure)
        terms = [_Term(own * weight, measures, measures, body.rubber), *separate]
        return terms, stored * weight * body.rubber, updated

    def _internal(self) -> Iterator[tuple[Attached, Internal]]:
        """Each branch with its part of the vector of internal variables."""
        first = 0
        for attached in self.body.branches:
            places = memory_places(self.body.strain)
            values: dict[str, Scalar | Symmetric] = {}
            for name, kind in attached.branch.internal.items():
                size = 1 if kind == "scalar" else len(places)
                parts = [self.body.internal[first + i] for i in range(size)]
                values[name] = parts[0] if kind == "scalar" else unpacked(parts, places)
                first += size
            yield attached, values

    @cached_property
    def residual(self) -> Scalar:
        """Derivative of the energy with respect to the state."""
        state, test = self.body.state, self._test
        inside = sum(first_variation(t.density, t.measures, state, test) * t.dx for t in self._terms)
        return inside + sum(ufl.derivative(surface, state, test) for surface in self.body.surfaces)

    @cached_property
    def tangent(self) -> Scalar:
        """Derivative of the residual with respect to the state."""
        state, test, trial = self.body.state, self._test, self._trial
        inside = sum(second_variation(t.density, t.measures, state, test, trial) * t.dx for t in self._terms)
        return inside + sum(
            ufl.derivative(ufl.derivative(surface, state, test), state, trial)
            for surface in self.body.surfaces
        )

    def action(self, direction: Scalar) -> Scalar:
        """The tangent applied to a function of the state's space: UFL form, rank 1."""
        return ufl.derivative(self.residual, self.body.state, direction)

    def parameter_force(self, parameter: Scalar, direction: Scalar | None = None) -> Scalar:
        """Derivative of the residual with respect to a ufl.variable.

        Parameters
        ----------
        parameter
            A ufl.variable that the energy contains.
        direction
            Function of the state's space: the result is a form of rank 0, the work on it. None: of rank 1.
        """
        state, along = self.body.state, self._test if direction is None else direction
        parts = []
        for term in self._terms:
            if any(made_of(measure, parameter) for measure in term.plain_measures):
                # The deformation itself depends on the parameter: first the variation, then its slope.
                varied = first_variation(term.density, term.measures, state, along)
                parts.append(ufl.diff(varied, parameter) * term.dx)
            else:
                slope = ufl.diff(term.density, parameter)
                parts.append(first_variation(slope, term.plain_measures, state, along) * term.dx)
        parts += [
            ufl.derivative(_form_slope(surface, parameter), state, along) for surface in self.body.surfaces
        ]
        return sum(parts)

    def stiffness_force(self, direction: Scalar, factor: Scalar) -> Scalar:
        """Work on a direction of the residual's change with a factor on law and branches, their memory as it is.

        Parameters
        ----------
        direction
            Function of the state's space.
        factor
            Change of the factor from place to place; a test function makes a form of rank 1.
        """
        return sum(
            factor * first_variation(t.density, t.measures, self.body.state, direction) * t.dx
            for t in self._isochoric
        )

    def memory_force(self, change: Scalar) -> Scalar:
        """Derivative of the residual along a change of the internal variables: UFL form, rank 1."""
        return ufl.derivative(self.residual, self.body.internal, change)

    def memory_change(self, direction: Scalar, change: Scalar) -> Scalar:
        """Derivative of `update` along a change of the state and one of the internal variables, shape (k,)."""
        return ufl.derivative(self.update, self.body.state, direction) + ufl.derivative(
            self.update, self.body.internal, change
        )

    def memory_slope(self, parameter: Scalar) -> Scalar:
        """Derivative of `update` with respect to a parameter, a ufl.variable, shape (k,)."""
        assert self.update is not None
        return ufl.as_vector([ufl.diff(component, parameter) for component in self.update])


def memory_places(strain: Kinematics) -> tuple[int, ...]:
    """Components of a symmetric tensor that do not vanish in these kinematics."""
    assert strain.metric is not None
    return tuple(i for i, c in enumerate(strain.metric.components) if not isinstance(c, int))


def _components(value: Scalar | Symmetric) -> list[Scalar]:
    if isinstance(value, Symmetric):
        return [c for c in value.components if not isinstance(c, int)]
    return [value]


def _form_slope(form: Scalar, parameter: Scalar) -> Scalar:
    return ufl.Form(
        [item.reconstruct(integrand=ufl.diff(item.integrand(), parameter)) for item in form.integrals()]
    )
