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

from cases.body import Body, MaterialCells
from cases.contact.contact import Contact, contact_of
from cases.drawn_in import DrawnIn
from cases.elements import QuadratureRule, apart_from_bonds, cells_may_fold, mixed_element
from cases.feature import Installed
from cases.internal import Internal
from cases.material import RubberAtPoints
from cases.metal import MetalAtPoints
from cases.mode import Mode, setting_for
from cases.motion import Motion, PoseMotion
from cases.parameters import Parameters
from cases.points import Points
from cases.ranks import sum_over_ranks
from cases.result_cache import ResultCache
from cases.strain_gradient import strain_gradient
from cases.stress_free import MovedPoints, StressFree
from cases.surfaces import SurfaceForms, surface_energies
from cases.system import System
from forms.kinematics import Kinematics, kinematics_of
from forms.law import Law
from forms.setting import SETTINGS, KinematicDescription
from geometry.mesh import NamedMesh

Array = NDArray[np.float64]

# It gives one Gauss point more in each direction than the displacement's order; fewer leave modes without stiffness.
QUADRATURE_DEGREE_PER_ORDER = 2


class FiniteElementModel:
    """A bushing under one mode, ready to be marched.

    Parameters
    ----------
    mesh
        Named mesh, cut at the mirror planes of the mode's setting.
    mode
        Mode of deformation.
    law, parameters
        The rubber's law and its parameters (MPa).
    bulk_modulus
        MPa; infinite = exactly incompressible.
    features
        Further changes of the rubber and the assembly.

    Attributes
    ----------
    parameters : Parameters
    constants
        Every parameter by name: the law's, "compliance", and "feature.parameter".
    system : System
        Residual and tangent at the present state.
    internal : Internal or None
        Memory of the rubber; None where the force depends on the displacement alone.
    duration, stage : Constant
        Duration of the present step (s), and share of the assembly that is done, 0 to 1.
    curves : ResultCache
        Its last two histories: of a bushing with an effect and without it, which are often compared.
    sampled : ResultCache
        Points at which its stretches were evaluated, by region, with the mesh for which they were located.
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
        self.curves: ResultCache[Any] = ResultCache(2)
        self.sampled: ResultCache[tuple[NamedMesh, Points]] = ResultCache(4)
        self.features = tuple(features)
        self.setting = setting_for(mode, mesh.dimension)
        self.comm = mesh.mesh.comm
        # The motion of a sleeve that a surface energy refers to is one more field, prescribed everywhere.
        followed = sorted({installed.feature.follows for installed in self.features} - {""})
        self.space = fem.functionspace(
            mesh.mesh, mixed_element(mesh, self._gradients.components, len(followed))
        )
        self.state = fem.Function(self.space)
        self.parameters = Parameters(mesh, law, parameters, bulk_modulus, self.features)
        self.constants, self.marked = self.parameters.constants, self.parameters.marked
        self.duration, self.stage = self.parameters.duration, self.parameters.stage
        self._stress_free = StressFree(mesh, self.features, self.parameters)
        self.body = self._body()
        self.internal = Internal(self.body) if self.body.material.families else None
        touching = contact_of(mesh, self.space, mode, self._stress_free)
        self.surfaces = self._surfaces(followed, touching)
        self.motion = (Motion if self.setting.six is None else PoseMotion)(
            mesh,
            mode,
            self.setting,
            self.space,
            followed,
            self.features,
            self.parameters,
            self._stress_free.arms,
        )
        self._prescribed = fem.Function(self.space)
        constrained = self.motion.constrained.dofs
        bc = fem.dirichletbc(self._prescribed, constrained)
        self.system = System(self.state, self.parameters, self.body, self.surfaces, constrained, bc)
        # The modelled part is one of this many equal parts; equal faces of a coupon share the work.
        self.multiplicity = 2 ** len(mesh.mirrors) / mode.shares
        self.take_parameters()

    # -- set-up --------------------------------------------------------------------------------------------------

    def _body(self) -> Body:
        mesh = self.mesh
        branches = [attached.branch for attached in self.parameters.attached_branches()]

        def part(
            region: str,
            material: Callable[[int], RubberAtPoints | MetalAtPoints],
            drawn_in: DrawnIn | None = None,
        ) -> MaterialCells:
            points = Points(mesh, self.space, self._gradients, self.cells(region), self.rule)
            moved = self.moved_points(region, self.rule)
            return MaterialCells(self.setting.kinematics, points, material(points.number), moved, drawn_in)

        def rubber(points: int) -> RubberAtPoints:
            return RubberAtPoints(
                self._gradients, self.law, self.parameters.law_names, branches, points, self._guard(points)
            )

        def metal(points: int) -> MetalAtPoints:
            return MetalAtPoints(self._gradients, points)

        drawn_in = {
            name: DrawnIn(mesh, name, self.features, self.parameters, self.state, self.setting.kinematics)
            for name in mesh.sleeves
        }
        return Body(part("rubber", rubber), {name: part(name, metal, drawn_in[name]) for name in drawn_in})

    def _guard(self, points: int) -> NDArray[np.float64]:
        """Return which points have further energies of volumes, (points, 2): those of cells that touch no bond."""
        cells = self.cells("rubber")
        free = apart_from_bonds(self.mesh, self.space, cells, self._bonds)
        guards = np.outer(free, [1.0, float(cells_may_fold(self.mesh))])
        return np.repeat(guards, points // max(len(cells), 1), axis=0)

    @property
    def _bonds(self) -> tuple[str, ...]:
        """Names of the boundaries on which sleeves are prescribed."""
        return (*self.mode.driven, *self.mode.held)

    @property
    def _gradients(self) -> KinematicDescription:
        return SETTINGS[self.setting.kinematics]

    @cached_property
    def rule(self) -> QuadratureRule:
        """Quadrature of the energy."""
        return QuadratureRule.gauss(self.mesh, self.quadrature_degree)

    @property
    def quadrature_degree(self) -> int:
        """Degree of the quadrature; UFL's own estimate would take hundreds of points where the body is not the mesh."""
        return QUADRATURE_DEGREE_PER_ORDER * self.mesh.displacement_order

    def cells(self, region: str) -> NDArray[np.int32]:
        """Numbers of a region's cells on this rank."""
        return np.asarray(self.mesh.cells.find(self.mesh.region[region]), dtype=np.int32)

    def moved_points(self, region: str, rule: QuadratureRule) -> MovedPoints | None:
        """Return the position of the stress-free body at points of a region's cells; None where it is the mesh.

        Parameters
        ----------
        region
            Name of the region: "rubber" or that of a sleeve.
        rule
            Quadrature rule whose points are taken in every cell.
        """
        return self._stress_free.at(self.cells(region), rule.points)

    def _surfaces(self, followed: Sequence[str], contact: Contact | None) -> SurfaceForms:
        shear_constant = fem.Constant(self.mesh.mesh, PETSc.ScalarType(0.0))
        energies, shear = list[Any](), ufl.variable(shear_constant)
        if any(installed.feature.surface is not None for installed in self.features):
            u, _, *motions = ufl.split(self.state)
            place_values = {
                "u": u,
                "motion": dict(zip(followed, motions, strict=True)),
                "kinematics": self.setting.kinematics,
                "shear_modulus": shear,
            }
            moved = self._stress_free.together(self.features)
            degree = self.quadrature_degree
            energies = surface_energies(
                self.mesh, self.features, self.parameters, place_values, moved, degree
            )
        gradient = strain_gradient(self.mesh, self.space, self.cells("rubber"), self._bonds)
        return SurfaceForms(self.state, energies, self.parameters, (shear, shear_constant), contact, gradient)

    @cached_property
    def strain(self) -> Kinematics:
        """Kinematics of the state in UFL, for further forms."""
        x, moved = ufl.SpatialCoordinate(self.mesh.mesh), self._stress_free.together(self.features)
        return kinematics_of(self.setting.kinematics, ufl.split(self.state)[0], x, moved)

    # -- parameters ----------------------------------------------------------------------------------------------

    def take_parameters(self) -> None:
        """Update everything that depends on parameters, stage and duration to their present values."""
        self.system.take_parameters()

    def set_parameters(self, parameters: Mapping[str, float], bulk_modulus: float | None = None) -> None:
        """Change parameters without building anything again.

        Parameters
        ----------
        parameters
            Values by name, in the units of the parameters: the law's (MPa), "compliance" (1/MPa), "feature.parameter".
        bulk_modulus
            MPa; None leaves it as it is.

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
    def has_assembly(self) -> bool:
        """Whether the rubber is deformed before the test begins."""
        return any(installed.feature.assembled for installed in self.features)

    def commit(self) -> None:
        """Accept the present state as the end of the step: the rubber remembers it."""
        if self.internal is not None:
            self.take_parameters()
            self.internal.commit(self.state.x.array)

    # -- the motion ----------------------------------------------------------------------------------------------

    def impose(self, q: float) -> None:
        """Give every constrained unknown of the state the value it has at q (mm or rad) and this stage of assembly."""
        self.state.x.array[self.motion.constrained.dofs] = self.motion.values(q)

    def put(self, unknowns: Array) -> None:
        """Set the state to this rank's unknowns, and the sleeve's free motions to the entries that follow them."""
        state = self.state.x.array
        state[:] = unknowns[: len(state)]
        self.motion.take(unknowns[len(state) :])

    def rate(self, q: float, ahead: bool = False) -> Array:
        """Derivative of the constrained unknowns with respect to q, over all local unknowns (`Motion.rate`).

        Parameters
        ----------
        q
            Generalised displacement, mm or rad.
        ahead
            At a turning point of the path: take the derivative on the way from q on, not that on the way to q.

        Returns
        -------
        shape (n,)
            mm/mm or mm/rad; zero in the free unknowns.
        """
        return self.motion.rate(q, ahead)

    def relocate(self, mesh: NamedMesh, constrained: Array) -> None:
        """Take over new coordinates of the same mesh, whose nodes have been moved.

        Parameters
        ----------
        mesh
            The mesh, with the shape that it has now.
        constrained
            Positions of the constrained unknowns, mm, shape (n, 3).

        Raises
        ------
        ValueError
            The model has features of the assembly, which depend on the mesh as it was.
        """
        if not all(installed.feature.of_rubber for installed in self.features):
            raise ValueError("a model with features of the assembly cannot be moved to another shape")
        self.mesh = mesh
        for part in self.body.parts:
            part.points.locate(mesh)
        self.motion.relocate(constrained)
        self.surfaces.relocate(mesh, self.mode)
        # It was computed for the previous shape.
        self.__dict__.pop("volume", None)
        self.system.take_parameters(moved=True)

    # -- measures ------------------------------------------------------------------------------------------------

    @cached_property
    def volume(self) -> float:
        """Volume of the modelled part (mm^3), metal included."""
        self.take_parameters()
        return float(sum_over_ranks(self.comm, self.body.volume))

    def energy(self) -> float:
        """Stored energy of the whole bushing (N mm), or of one face's share of a coupon."""
        self.take_parameters()
        part = self.body.energy(self.state.x.array) + self.surfaces.energy()
        return float(sum_over_ranks(self.comm, part)) * self.multiplicity
