"""Energies of a model beside that of its materials: of surfaces, of their contact, and of strain gradients."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from numpy.typing import NDArray
from petsc4py import PETSc
from ufl.algorithms import expand_derivatives
from ufl.constantvalue import FloatValue
from ufl.corealg.traversal import unique_pre_traversal

from cases.contact.contact import DEEPEST, Contact, contact_of
from cases.feature import Installed, Place
from cases.jit import options
from cases.mode import Mode
from cases.parameters import Parameters
from cases.strain_gradient import StrainGradient
from forms.kinematics import Moved
from forms.potential import Surfaces
from geometry.mesh import NamedMesh

Array = NDArray[np.float64]


class SurfaceForms:
    """Energies beside that of the materials, and their derivatives; there may be none.

    Parameters
    ----------
    state
        The mixed function (u, p, ...).
    energies
        UFL forms of rank 0, N mm.
    parameters
        Parameters of the model.
    shear
        ufl.variable of the law's initial shear modulus, which the energies may contain, and its constant.
    contact
        Contact of the surfaces with each other; its energy is added to the others.
    gradient
        Energy of the rubber's strain gradients; it is added, too.
    """

    def __init__(
        self,
        state: Any,
        energies: Sequence[Any],
        parameters: Parameters,
        shear: tuple[Any, Any],
        contact: Contact | None = None,
        gradient: StrainGradient | None = None,
    ) -> None:
        self._state, self._parameters, self.contact, self.gradient = state, parameters, contact, gradient
        # Whether no surfaces met in the last equilibrium, and whether contact is left out at present.
        self.apart, self._resting = True, False
        self._shear, self._shear_constant = shear
        self._surfaces = Surfaces(state, energies)
        self._direction = fem.Function(state.function_space)
        self._slopes: dict[str, Any] = {}
        self._formed = bool(energies)
        if self._formed:
            self._energy = self._compile(self._surfaces.energy)
            self._residual = self._compile(self._surfaces.residual)
            self._tangent = self._compile(self._surfaces.tangent)

    def take(self, shear_modulus: float) -> None:
        """Take the law's present initial shear modulus, MPa."""
        self._shear_constant.value = shear_modulus
        if self.contact is not None:
            self.contact.take(shear_modulus)
        if self.gradient is not None:
            self.gradient.take(shear_modulus)

    def relocate(self, mesh: NamedMesh, mode: Mode) -> None:
        """Take over new coordinates of the mesh.

        Parameters
        ----------
        mesh
            The mesh, with the shape that it has now.
        mode
            Mode of the model.
        """
        if self.contact is None or not self.contact.relocate(mesh):
            self.contact = contact_of(mesh, self._state.function_space, mode, None)
        if self.gradient is not None:
            self.gradient.locate(mesh)

    @property
    def any_present(self) -> bool:
        """Whether there are any of these energies at the present state."""
        self.look()
        touching = self.active_contact is not None and self.active_contact.is_touching
        return self._formed or touching or self.gradient is not None

    @contextmanager
    def without_contact(self) -> Iterator[bool]:
        """Leave contact out where the last equilibrium had none; `is_refuted` says whether the next one has it.

        An equilibrium without contact in which no surfaces meet is one with contact too, whose energy is zero around
        that state. Surfaces that stay apart therefore cost one search at each equilibrium, and none at the states tried
        on the way.
        """
        self._resting = self.contact is not None and self.apart
        try:
            yield self._resting
        finally:
            self._resting = False

    def soften(self, share: float) -> AbstractContextManager[None]:
        """Reduce the contact stiffness to this share; meanwhile penetration is not limited."""
        assert self.contact is not None
        return self.contact.soften(share)

    @property
    def active_contact(self) -> Contact | None:
        """Contact at the present state, where it takes part."""
        return None if self._resting else self.contact

    def is_refuted(self) -> bool:
        """Whether the present state is not an equilibrium although it balances.

        That is the case where a surface lies deeper in another than contact allows, or where surfaces meet although
        contact was left out (`without_contact`); it is not left out any more from then on.
        """
        contact = self.contact
        if contact is None or contact.share < 1.0:
            return False
        contact.look(self._state.x.array)
        is_too_deep = contact.penetration > DEEPEST
        if self._resting:
            self.apart = not (contact.is_touching or is_too_deep)
            return not self.apart
        # Where surfaces are about to meet, contact remains included.
        self.apart = not contact.near
        return is_too_deep

    def near(self) -> bool:
        """Whether surfaces are near each other at the present state; contact takes part from then on."""
        if self.contact is not None:
            self.contact.look(self._state.x.array)
            self.apart = not self.contact.near
        return not self.apart

    def look(self) -> None:
        """Find what is in contact at the present state."""
        if self.active_contact is not None:
            self.active_contact.look(self._state.x.array)

    def energy(self) -> float:
        """Return the energy on this rank, N mm."""
        total = float(fem.assemble_scalar(self._energy)) if self._formed else 0.0
        if self.active_contact is not None:
            self.look()
            total += self.active_contact.energy()
        if self.gradient is not None:
            total += self.gradient.energy(self._state.x.array)
        return total

    def add_forces(self, forces: Array) -> None:
        """Add the derivative of the energy at the present state, over all local unknowns."""
        if self._formed:
            fem.assemble_vector(forces, self._residual)
        if self.active_contact is not None:
            self.look()
            self.active_contact.add_forces(forces)
        if self.gradient is not None:
            self.gradient.add_forces(self._state.x.array, forces)

    def add_stiffness(self, matrix: PETSc.Mat, bc: Any) -> None:
        """Add the second derivative of the forms to a matrix, except for constrained unknowns.

        Parameters
        ----------
        matrix : PETSc.Mat
            The tangent; changed in place.
        bc : Any
            Constrained unknowns.
        """
        if self._formed:
            petsc.assemble_matrix(matrix, self._tangent, bcs=[bc])

    def add_action(self, direction: Array, forces: Array) -> None:
        """Add the product of the second derivative and a direction.

        Parameters
        ----------
        direction : Array
            Vector over this rank's unknowns, shape (m,).
        forces : Array
            Vector over this rank's unknowns, shape (m,); changed in place.
        """
        if self._formed:
            self._direction.x.array[:] = direction
            fem.assemble_vector(forces, self._action)
        if self.active_contact is not None:
            self.active_contact.add_action(direction, forces)
        if self.gradient is not None:
            self.gradient.add_action(self._state.x.array, direction, forces)

    def add_slope(self, name: str, shear_rate: float, forces: Array) -> None:
        """Add the derivative of the forces by a parameter, on which the shear modulus may depend.

        Parameters
        ----------
        name : str
            Full name of the parameter.
        shear_rate : float
            Derivative of the shear modulus by the parameter, MPa per unit of it.
        forces : Array
            Vector over this rank's unknowns, shape (m,); changed in place.
        """
        if self.contact is not None:
            self.look()
            self.contact.add_slope(name, shear_rate, forces)
        if self.gradient is not None and shear_rate != 0.0:
            self.gradient.add_forces(self._state.x.array, forces, shear_rate)
        if not self._formed:
            return
        form = self._slope(name, self._parameters.marked[name])
        if form is not None:
            fem.assemble_vector(forces, form)
        if shear_rate != 0.0:
            form = self._slope("", self._shear)
            if form is not None:
                slope = np.zeros_like(forces)
                fem.assemble_vector(slope, form)
                forces += shear_rate * slope

    @cached_property
    def _action(self) -> Any:
        return self._compile(self._surfaces.action(self._direction))

    def _slope(self, name: str, variable: Any) -> Any:
        if name not in self._slopes:
            form = expand_derivatives(self._surfaces.parameter_force(variable))
            self._slopes[name] = None if form.empty() else self._compile(form)
        return self._slopes[name]

    def _compile(self, form: Any) -> Any:
        form = without_literals(expand_derivatives(form), self._state.function_space.mesh)
        return fem.form(form, jit_options=options(light=True))


def surface_energies(
    mesh: NamedMesh,
    features: Sequence[Installed],
    parameters: Parameters,
    place_values: Mapping[str, Any],
    moved: Moved | None,
    degree: int,
) -> list[Any]:
    """UFL forms of the energies of all features.

    Parameters
    ----------
    mesh : NamedMesh
        The mesh with its named boundaries.
    features : Sequence[Installed]
        Further changes of the rubber and the assembly.
    parameters : Parameters
        Parameters of the model.
    place_values : Mapping[str, Any]
        Of `cases.feature.Place`: u, motion, kinematics, shear_modulus.
    moved : Moved | None
        Where the stress-free body is.
    degree : int
        Degree of the quadrature.
    """
    x, normal = ufl.SpatialCoordinate(mesh.mesh), ufl.FacetNormal(mesh.mesh)
    weight: Any = 1
    if moved is not None:
        weight, x = moved.area(normal), x + moved.displacement
    if place_values["kinematics"] != "cartesian":
        weight = 2 * ufl.pi * x[0] * weight
    place = Place(
        **place_values, x=x, normal=normal, ds=_measure(mesh, degree), weight=weight, shape=mesh.shape
    )
    return [
        energy
        for installed in features
        if installed.feature.surface is not None
        for energy in installed.feature.surface(parameters.ufl_values(installed), place)
    ]


def _measure(mesh: NamedMesh, default_degree: int) -> Callable[..., Any]:
    def ds(name: str, degree: int = default_degree) -> Any:
        if name not in mesh.boundary:
            return None
        metadata = {"quadrature_degree": degree}
        return ufl.Measure("ds", mesh.mesh, subdomain_data=mesh.facets, metadata=metadata)(
            mesh.boundary[name]
        )

    return ds


def without_literals(form: Any, mesh: Any) -> Any:
    """Return the form with a constant in place of each floating-point number; integers, such as exponents, stay.

    A thickness or the height of a plate in an energy would be written into the generated code, and every other bushing
    would compile forms of its own.

    Parameters
    ----------
    form
        UFL form.
    mesh
        DOLFINx mesh of the form.
    """
    numbers = dict.fromkeys(
        node
        for integral in form.integrals()
        for node in unique_pre_traversal(integral.integrand())
        if isinstance(node, FloatValue)
    )
    # In the order in which they occur: the order in which constants are made is part of a form's signature.
    return ufl.replace(form, {number: fem.Constant(mesh, float(number)) for number in numbers})
