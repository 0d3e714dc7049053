"""The finite-element model of one load case: mesh, mode and law -> residual and tangent.

Mixed displacement-pressure Taylor-Hood elements (second-order displacement, first-order continuous pressure).
The sleeves' motion is imposed strongly; all constrained unknowns always hold their prescribed values, so that
Newton's method works on the free ones only.

References
----------
Taylor and Hood (1973), Comput. Fluids 1:73-100, doi:10.1016/0045-7930(73)90027-3.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray
from petsc4py import PETSc

from cases.body import Body, Part
from cases.contact.contact import Contact, contact_of
from cases.elements import Rule, mixed_element
from cases.feature import Installed
from cases.internal import Internal
from cases.material import Rubber
from cases.matrix import Pattern
from cases.metal import Metal
from cases.mode import Mode, setting_for
from cases.motion import Motion
from cases.moved import MovedPoints, StressFree
from cases.parameters import Parameters
from cases.points import Points
from cases.ranks import summed
from cases.surfaces import SurfaceForms, surface_energies
from forms.kinematics import Kinematics, kinematics_of
from forms.law import Law
from forms.setting import SETTINGS
from forms.setting import Setting as GradientSetting
from geometry.dolfinx_api import collapsed
from geometry.mesh import NamedMesh

Array = NDArray[np.float64]

# Gauss points in each direction: one more than the displacement's order; fewer leave modes without stiffness.
QUADRATURE_DEGREE_PER_ORDER = 2


class Model:
    """A bushing under one mode, ready to be marched.

    Parameters
    ----------
    mesh
        Named mesh, cut at the mirror planes of the mode's setting.
    mode
        What is done to it.
    law, parameters
        The rubber (MPa).
    bulk_modulus
        MPa; infinite = exactly incompressible.
    features
        What else there is to rubber and assembly.

    Attributes
    ----------
    parameters : Parameters
    constants
        Every parameter by name: the law's, "compliance", and "feature.parameter".
    internal : Internal or None
        What the rubber remembers; None where the force depends on the displacement alone.
    duration, stage : Constant
        Of the present step (s), and the share of the assembly that is done, 0 to 1.
    """

    def __init__(
        self,
        mesh: NamedMesh,
        mode: Mode,
        law: Law,
        parameters: Mapping[str, float],
        bulk_modulus: float = np.inf,
        features: Sequence[Installed] = (),
    ) -> None:
        self.mesh, self.mode, self.law = mesh, mode, law
        self.features = tuple(features)
        self.setting = setting_for(mode, mesh.dimension)
        self.comm = mesh.mesh.comm
        # A sleeve that a surface energy refers to is one more field, its motion, prescribed everywhere like the others.
        followed = sorted({item.feature.follows for item in self.features} - {""})
        self.space = fem.functionspace(
            mesh.mesh, mixed_element(mesh, self._gradients.components, len(followed))
        )
        self.state = fem.Function(self.space)
        self.parameters = Parameters(mesh, law, parameters, bulk_modulus, self.features)
        self.constants, self.marked = self.parameters.constants, self.parameters.marked
        self.duration, self.stage = self.parameters.duration, self.parameters.stage
        self._stress_free = StressFree(mesh, self.features, self.parameters)
        self.body = self._body()
        self.internal = Internal(self.body) if self.body.material.branches else None
        touching = contact_of(mesh, self.space, mode, self._stress_free)
        self.surfaces = self._surfaces(followed, touching)
        self.motion = Motion(
            mesh,
            mode,
            self.setting,
            self.space,
            followed,
            self.features,
            self.parameters,
            self._stress_free.together,
        )
        self._prescribed = fem.Function(self.space)
        self._bc = fem.dirichletbc(self._prescribed, self.motion.constrained.dofs)
        # The modelled part is one of this many equal parts; equal faces of a coupon share the work.
        self.multiplicity = 2 ** len(mesh.mirrors) / mode.shares
        self._taken: tuple[float, ...] = ()
        self.take_parameters()

    # -- set-up --------------------------------------------------------------------------------------------------

    def _body(self) -> Body:
        mesh = self.mesh
        branches = [one.branch for one in self.parameters.attached()]

        def part(region: str, material: Callable[[int], Rubber | Metal]) -> Part:
            points = Points(mesh, self.space, self._gradients, self.cells(region), self.rule)
            moved = self.moved_points(region, self.rule)
            return Part(self.setting.kinematics, points, material(points.number), moved)

        def rubber(points: int) -> Rubber:
            return Rubber(self._gradients, self.law, self.parameters.law_names, branches, points)

        def metal(points: int) -> Metal:
            return Metal(self._gradients, points)

        return Body(part("rubber", rubber), {name: part(name, metal) for name in mesh.sleeves})

    @property
    def _gradients(self) -> GradientSetting:
        return SETTINGS[self.setting.kinematics]

    @cached_property
    def rule(self) -> Rule:
        """Quadrature of the energy."""
        return Rule.gauss(self.mesh, self.quadrature_degree)

    @property
    def quadrature_degree(self) -> int:
        """Of the quadrature; what UFL estimates for a body that is not the mesh would be hundreds of points."""
        return QUADRATURE_DEGREE_PER_ORDER * self.mesh.displacement_order

    def cells(self, region: str) -> NDArray[np.int32]:
        """Numbers of a region's cells on this rank."""
        return np.asarray(self.mesh.cells.find(self.mesh.region[region]), dtype=np.int32)

    def moved_points(self, region: str, rule: Rule) -> MovedPoints | None:
        """The stress-free body at points of a region's cells; None where it is the mesh."""
        return self._stress_free.at(self.cells(region), rule.points)

    def _surfaces(self, followed: Sequence[str], contact: Contact | None) -> SurfaceForms:
        shear_constant = fem.Constant(self.mesh.mesh, PETSc.ScalarType(0.0))
        energies, shear = list[Any](), ufl.variable(shear_constant)
        if any(item.feature.surface is not None for item in self.features):
            u, _, *motions = ufl.split(self.state)
            given = {
                "u": u,
                "motion": dict(zip(followed, motions, strict=True)),
                "kinematics": self.setting.kinematics,
                "shear_modulus": shear,
            }
            moved = self._stress_free.together(self.features)
            degree = self.quadrature_degree
            energies = surface_energies(self.mesh, self.features, self.parameters, given, moved, degree)
        return SurfaceForms(self.state, energies, self.parameters, (shear, shear_constant), contact)

    @cached_property
    def strain(self) -> Kinematics:
        """Kinematics of the state, as UFL for forms of one's own."""
        x, moved = ufl.SpatialCoordinate(self.mesh.mesh), self._stress_free.together(self.features)
        return kinematics_of(self.setting.kinematics, ufl.split(self.state)[0], x, moved)

    # -- parameters ----------------------------------------------------------------------------------------------

    def take_parameters(self) -> None:
        """Bring what depends on parameters, stage and duration up to their present values."""
        state = self.parameters.state
        if state != self._taken:
            numbers = self.parameters.numbers()
            # All but the duration, by which nothing moves.
            self.body.take(numbers, anew=state[:-1] != self._taken[:-1])
            self.surfaces.take(numbers.shear_modulus)
            self._taken = state

    def set_parameters(self, parameters: Mapping[str, float], bulk_modulus: float | None = None) -> None:
        """Change parameters by name ("compliance" and those of features too) without building anything again.

        Raises
        ------
        ValueError
            A parameter is a dimension of the mesh (`Feature.dimensions`).
        """
        self.parameters.set(parameters)
        if bulk_modulus is not None:
            self.compliance.value = 1.0 / bulk_modulus

    @property
    def compliance(self) -> Any:
        """1 / bulk modulus, 1/MPa; features may add to it."""
        return self.constants["compliance"]

    @property
    def shear_modulus(self) -> float:
        """The law's initial shear modulus at the present parameters, MPa."""
        return self.parameters.numbers().shear_modulus

    @property
    def metal_modulus(self) -> float:
        """Young's modulus of the stiffest sleeve at the present parameters, MPa; 0 without elastic sleeves."""
        return self.parameters.metal_modulus

    @property
    def path_dependent(self) -> bool:
        """Whether the force depends on more than the displacement."""
        return self.internal is not None

    @property
    def assembled(self) -> bool:
        """Whether the rubber is deformed before the test begins."""
        return any(item.feature.assembled for item in self.features)

    def commit(self) -> None:
        """Accept the present state as the end of the step: the rubber remembers it."""
        if self.internal is not None:
            self.take_parameters()
            self.internal.commit(self.state.x.array)

    # -- the motion ----------------------------------------------------------------------------------------------

    def impose(self, q: float) -> None:
        """Give every constrained unknown of the state the value it has at q (mm or rad) and this stage of assembly."""
        self.state.x.array[self.motion.constrained.dofs] = self.motion.values(q)

    def rate(self, q: float, ahead: bool = False) -> Array:
        """Derivative of the constrained unknowns with respect to q, over all local unknowns (`Motion.rate`)."""
        return self.motion.rate(q, ahead)

    # -- assembly ------------------------------------------------------------------------------------------------

    def create_vector(self) -> PETSc.Vec:
        """A vector over the unknowns."""
        return self.state.x.petsc_vec.duplicate()

    @cached_property
    def _pattern(self) -> Pattern:
        unknowns = [part.points.unknowns.of_cells for part in self.body.parts]
        return Pattern(self.space.dofmap.index_map, self.comm, unknowns, self.motion.constrained.dofs)

    def create_matrix(self) -> PETSc.Mat:
        """A matrix for `assemble_tangent`, marked symmetric."""
        return self._pattern.matrix()

    def assemble_residual(self, b: PETSc.Vec) -> None:
        """Out-of-balance force at the present state in every unknown, constrained ones included."""
        self.take_parameters()
        with b.localForm() as local:
            forces = local.array_w
            forces[:] = 0.0
            self.body.add_forces(self.state.x.array, forces)
            self.surfaces.add_forces(forces)
        b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)

    def clear_constrained(self, b: PETSc.Vec) -> float:
        """Zero the constrained entries of an owned vector; return the norm of what stood there (the reactions)."""
        owned = self.owned_constrained
        squares = float(np.sum(b.array_r[owned] ** 2))
        b.array_w[owned] = 0.0
        return float(np.sqrt(summed(self.comm, squares)))

    @cached_property
    def owned_pressures(self) -> NDArray[np.int32]:
        """Pressure unknowns that this rank owns."""
        _, dofs = collapsed(self.space.sub(1))
        return dofs[dofs < self.owned]

    @property
    def owned(self) -> int:
        """Number of unknowns that this rank owns."""
        return int(self.space.dofmap.index_map.size_local * self.space.dofmap.index_map_bs)

    @cached_property
    def volume(self) -> float:
        """Volume of the modelled part (mm^3), metal included."""
        self.take_parameters()
        return float(summed(self.comm, self.body.volume))

    @cached_property
    def owned_constrained(self) -> NDArray[np.int32]:
        """Constrained unknowns that this rank owns."""
        dofs = self.motion.constrained.dofs
        return dofs[dofs < self.owned]

    def assemble_tangent(self, matrix: PETSc.Mat) -> None:
        """Tangent at the present state; constrained rows and columns are those of the identity."""
        self.stiffen()
        contact = self.surfaces.acting
        if contact is not None:
            self._pattern = contact.fitted(self._pattern, matrix)
        pattern = self._pattern
        pattern.values[:] = 0.0
        self.body.add_stiffness(pattern.places, pattern.values)
        if contact is not None and contact.touching:
            pattern.add(*contact.entries())
        matrix.zeroEntries()
        pattern.add_to(matrix)
        self.surfaces.add_stiffness(matrix, self._bc)
        matrix.assemble()

    def stiffen(self) -> None:
        """Compute the moduli at the present state, for `apply_tangent` and `lift`."""
        self.take_parameters()
        self.surfaces.look()
        self.body.stiffen(self.state.x.array)

    def apply_tangent(self, b: PETSc.Vec, direction: Array) -> None:
        """Set b to the tangent at the state of `stiffen`, applied to a direction over all local unknowns."""
        with b.localForm() as local:
            forces = local.array_w
            forces[:] = 0.0
            self.body.add_action(direction, forces)
            self.surfaces.add_action(direction, forces)
        b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)

    def lift(self, b: PETSc.Vec, rate: Array) -> None:
        """Set b = -K_fc rate_c, the force that a motion of the sleeve exerts on the free unknowns, and rate there.

        The tangent is that at the state of the last `assemble_tangent` or `stiffen`.
        """
        self.apply_tangent(b, rate)
        b.scale(-1.0)
        b.array_w[self.owned_constrained] = rate[self.owned_constrained]

    def energy(self) -> float:
        """Stored energy of the whole bushing (N mm), or of one face's share of a coupon."""
        self.take_parameters()
        part = self.body.energy(self.state.x.array) + self.surfaces.energy()
        return float(summed(self.comm, part)) * self.multiplicity
