"""The finite-element model of one load case: mesh, mode and law -> assembled residual and tangent.

Mixed displacement-pressure Taylor-Hood elements (second-order displacement, first-order continuous pressure).
The sleeves' motion is imposed strongly; all constrained unknowns always hold their prescribed values, so that
Newton's method works on the free ones only.

References
----------
Taylor and Hood (1973), Comput. Fluids 1:73-100, doi:10.1016/0045-7930(73)90027-3.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from numpy.typing import NDArray
from petsc4py import PETSc
from ufl.algorithms import expand_derivatives

from cases.feature import Installed, Place
from cases.internal import Internal
from cases.jit import options
from cases.matrix import reduced_matrix
from cases.mode import Mode, Setting
from forms import kinematics
from forms.law import Law
from forms.potential import Body, Potential
from geometry.dolfinx_api import collapsed, interpolation_points
from geometry.mesh import NamedMesh
from geometry.shape import Metal, Mirrors

Array = NDArray[np.float64]

# Gauss points in each direction: one more than the displacement's order; fewer leave modes without stiffness.
QUADRATURE_DEGREE_PER_ORDER = 2


@dataclass(frozen=True)
class _Constrained:
    """Constrained unknowns: local index, component, coordinates, whether it follows the sleeve, and boundary."""

    dofs: NDArray[np.int32]
    component: NDArray[np.int32]
    x: Array
    driven: NDArray[np.bool_]
    boundary: NDArray[np.str_]


def setting_for(mode: Mode, dimension: int) -> Setting:
    """The mode's setting in the half-plane (2) or in three dimensions (3)."""
    setting = mode.section if dimension == 2 else mode.solid
    if setting is None:
        raise ValueError(f"mode {mode.name} has no half-plane model")
    return setting


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
    constants
        Every parameter by name: the law's, "compliance", and "feature.parameter".
    marked
        The same as UFL variables, by which forms can be differentiated.
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
        # Where a surface energy refers to a sleeve, that sleeve's motion is one more field, prescribed everywhere: what
        # holds for the other prescribed unknowns (work, tangent, derivatives) then holds for it too.
        self._followed = sorted({item.feature.follows for item in self.features} - {""})
        self.space = fem.functionspace(mesh.mesh, _element(mesh, self.setting, len(self._followed)))
        self.state = fem.Function(self.space)
        values = dict(parameters) | {"compliance": 1.0 / bulk_modulus}
        for item in self.features:
            values |= {f"{item.name}.{key}": value for key, value in item.values.items()}
        self.constants = {name: _constant(mesh, value) for name, value in values.items()}
        self.duration, self.stage, self._q = (_constant(mesh, value) for value in (0.0, 1.0, 0.0))
        self.marked = {name: ufl.variable(constant) for name, constant in self.constants.items()}
        self._law_names = tuple(parameters)
        self._dimensions = {f"{item.name}.{key}" for item in self.features for key in item.feature.dimensions}
        self.potential = self._potential()
        self._residual = fem.form(self.potential.residual, jit_options=options())
        self._tangent = fem.form(self.potential.tangent, jit_options=options())
        self._energy = fem.form(self.potential.energy, jit_options=options())
        self._constrained = self._constraints()
        self._resizings: dict[str, Callable[[], Array]] = {}
        self._prescribed = fem.Function(self.space)
        self._bc = fem.dirichletbc(self._prescribed, self._constrained.dofs)
        # The modelled part is one of this many equal parts; equal faces of a coupon share the work.
        self.multiplicity = 2 ** len(mesh.mirrors) / mode.shares
        # Compiled derivatives by sets of parameters (`cases.sensitivity`), which outlive a march.
        self.sensitivities: dict[tuple[str, ...], Any] = {}

    # -- set-up --------------------------------------------------------------------------------------------------

    def _potential(self) -> Potential:
        mesh = self.mesh
        u, p, *motions = ufl.split(self.state)
        moved = self._stress_free(self.features)
        self.strain = strain(self.setting, u, mesh, moved)
        degree = self.quadrature_degree
        dx = ufl.Measure("dx", mesh.mesh, subdomain_data=mesh.cells, metadata={"quadrature_degree": degree})
        sleeves = {}
        for name, sleeve in mesh.sleeves.items():
            modulus = self._youngs_modulus(sleeve, self._values)
            if isinstance(modulus, float):
                modulus = _constant(mesh, modulus)
            shear = modulus / (2 * (1 + sleeve.poissons_ratio))
            bulk = modulus / (3 * (1 - 2 * sleeve.poissons_ratio))
            sleeves[dx(mesh.region[name])] = (shear, bulk)
        attached = [
            branch
            for item in self.features
            if item.feature.branches is not None
            for branch in item.feature.branches(self._values(item))
        ]
        self.internal = Internal(mesh, self.strain, attached, degree) if attached else None
        compliance, swelling = self.marked["compliance"], 1.0
        for item in self.features:
            if item.feature.compliance is not None:
                compliance += item.feature.compliance(self._values(item))
            if item.feature.swelling is not None:
                swelling *= item.feature.swelling(self._values(item))
        body = Body(
            state=self.state,
            strain=self.strain,
            law=self.law,
            parameters={name: self.marked[name] for name in self._law_names},
            pressure=p,
            compliance=compliance,
            # Without sleeves the rubber is everywhere: no subdomain in the kernel's signature.
            rubber=dx(mesh.region["rubber"]) if sleeves else dx,
            sleeves=sleeves,
            swelling=swelling,
            branches=attached,
            internal=None if self.internal is None else self.internal.values,
            duration=self.duration,
            surfaces=self._surfaces(u, dict(zip(self._followed, motions, strict=True)), moved, degree),
        )
        made = Potential(body)
        if self.internal is not None:
            self.internal.follow(made)
        return made

    def _values(self, item: Installed) -> dict[str, Any]:
        """A feature's parameters as UFL scalars; those of the assembly grow with the stage."""
        share = self.stage if item.feature.assembled else 1
        return {key: share * self.marked[f"{item.name}.{key}"] for key in item.values}

    @property
    def quadrature_degree(self) -> int:
        """Of the quadrature; what UFL estimates for a body that is not the mesh would be hundreds of points."""
        return QUADRATURE_DEGREE_PER_ORDER * self.mesh.displacement_order

    def _stress_free(self, features: Sequence[Installed]) -> kinematics.Moved | None:
        """Where the stress-free body is; None where it is the mesh."""
        x = ufl.SpatialCoordinate(self.mesh.mesh)
        moved = [
            item.feature.stress_free(self._values(item), x, self.mesh.shape)
            for item in features
            if item.feature.stress_free is not None
        ]
        if len(moved) < 2:
            return moved[0] if moved else None
        return kinematics.Moved.by(sum((one.displacement for one in moved[1:]), moved[0].displacement))

    def _youngs_modulus(self, sleeve: Metal, values: Callable[[Installed], Mapping[str, Any]]) -> Any:
        """A sleeve's modulus (MPa), of the kind that the values are."""
        for item in self.features:
            if item.feature.metal is not None:
                modulus = item.feature.metal(values(item), sleeve)
                if modulus is not None:
                    return modulus
        return sleeve.youngs_modulus

    def _surfaces(
        self, u: Any, motion: Mapping[str, Any], moved: kinematics.Moved | None, degree: int
    ) -> list[Any]:
        mesh = self.mesh
        x, normal = ufl.SpatialCoordinate(mesh.mesh), ufl.FacetNormal(mesh.mesh)
        weight: Any = 1
        if moved is not None:
            weight, x = moved.area(normal), x + moved.displacement
        if self.setting.kinematics != "cartesian":
            weight = 2 * ufl.pi * x[0] * weight

        def ds(name: str, degree: int = degree) -> Any:
            if name not in mesh.boundary:
                return None
            metadata = {"quadrature_degree": degree}
            return ufl.Measure("ds", mesh.mesh, subdomain_data=mesh.facets, metadata=metadata)(
                mesh.boundary[name]
            )

        made: list[Any] = []
        for item in self.features:
            if item.feature.surface is None:
                continue
            place = Place(
                u=u,
                motion=motion,
                x=x,
                normal=normal,
                ds=ds,
                weight=weight,
                kinematics=self.setting.kinematics,
                shear_modulus=self.law.shear_modulus(**{name: self.marked[name] for name in self._law_names}),
                shape=mesh.shape,
            )
            made += item.feature.surface(self._values(item), place)
        return made

    @property
    def shear_modulus(self) -> float:
        """The law's initial shear modulus at the present parameters, MPa."""
        return float(
            self.law.shear_modulus(**{name: float(self.constants[name].value) for name in self._law_names})
        )

    @property
    def metal_modulus(self) -> float:
        """Young's modulus of the stiffest sleeve at the present parameters, MPa; 0 without elastic sleeves."""

        def present(item: Installed) -> dict[str, float]:
            return {key: float(self.constants[f"{item.name}.{key}"].value) for key in item.values}

        return max((self._youngs_modulus(s, present) for s in self.mesh.sleeves.values()), default=0.0)

    @property
    def path_dependent(self) -> bool:
        """Whether the force depends on more than the displacement."""
        return self.internal is not None

    @property
    def assembled(self) -> bool:
        """Whether the rubber is deformed before the test begins."""
        return any(item.feature.assembled for item in self.features)

    def _constraints(self) -> _Constrained:
        mesh, space = self.mesh, self.space
        components = space.sub(0).num_sub_spaces
        released = {name for item in self.features for name in item.feature.released}
        held = {name: only for name, only in self.mode.held.items() if name not in released}
        driven_names = {name: only for name, only in self.mode.driven.items() if name not in released}
        planes = _mirror_components(mesh.mirrors, components)
        values: dict[int, tuple[int, Array, bool, str]] = {}
        for component in range(components):
            part = space.sub(0).sub(component)
            alone, _ = collapsed(part)
            points = alone.tabulate_dof_coordinates()
            for names, driven in ((held | planes, False), (driven_names, True)):
                for name, only in names.items():
                    if name not in mesh.boundary or (only is not None and component not in only):
                        continue
                    facets = mesh.facets.find(mesh.boundary[name])
                    dofs, own = fem.locate_dofs_topological((part, alone), mesh.dimension - 1, facets)
                    values.update(
                        {int(d): (component, points[o], driven, name) for d, o in zip(dofs, own, strict=True)}
                    )
        for field, name in enumerate(self._followed, start=2):
            driven = name in self.mode.driven
            for component in range(components):
                part = space.sub(field).sub(component)
                alone, dofs = collapsed(part)
                points = alone.tabulate_dof_coordinates()
                values |= {int(d): (component, points[i], driven, name) for i, d in enumerate(dofs)}
        # The pressure has no work to do in a metal sleeve, where the energy does not contain it.
        for dof in self._idle_pressures():
            values[dof] = (-1, np.zeros(3), False, "")
        dofs = np.array(sorted(values), dtype=np.int32)
        return _Constrained(
            dofs,
            np.array([values[d][0] for d in dofs], dtype=np.int32),
            np.array([values[d][1] for d in dofs]).reshape(-1, 3),
            np.array([values[d][2] for d in dofs], dtype=bool),
            np.array([values[d][3] for d in dofs], dtype=str),
        )

    def _idle_pressures(self) -> list[int]:
        mesh = self.mesh
        if not mesh.sleeves:
            return []
        part = self.space.sub(1)
        tdim = mesh.dimension
        mesh.mesh.topology.create_connectivity(tdim, tdim)
        idle = [
            fem.locate_dofs_topological(part, tdim, mesh.cells.find(mesh.region[name]))
            for name in mesh.sleeves
        ]
        busy = fem.locate_dofs_topological(part, tdim, mesh.cells.find(mesh.region["rubber"]))
        return [int(d) for d in np.setdiff1d(np.concatenate(idle), busy)]

    # -- the motion ----------------------------------------------------------------------------------------------

    def _along_sleeve(self, motion: Any, q: float, by: str = "") -> Array:
        """Motion of the constrained unknowns, or its derivative by a parameter that resizes the sleeve."""
        c = self._constrained
        dimension = 3 if self.setting.kinematics == "cartesian" else 2
        x = c.x[:, :dimension].T
        if self._resized is not None:
            x = x + self._resized()
        displacement = motion(x, q)
        if by:
            # A rigid motion is linear in the coordinates but for a constant.
            displacement = motion(x + self._resizing(by), q) - displacement
        return np.where(c.driven, displacement[c.component, np.arange(len(c.dofs))], 0.0)

    @cached_property
    def _resized(self) -> Callable[[], Array] | None:
        """Displacement (3, n) of the constrained points from mesh to resized body; where a rotation needs it."""
        moved = self._stress_free([item for item in self.features if item.feature.resizes])
        if moved is None or self.setting.kinematics != "cartesian" or not self.mode.rotational:
            return None
        return self._at_constrained(moved.displacement)

    def _resizing(self, name: str) -> Array:
        """Derivative of `_resized` by a parameter."""
        if name not in self._resizings:
            moved = self._stress_free([item for item in self.features if item.feature.resizes])
            assert moved is not None
            slope = expand_derivatives(ufl.diff(moved.displacement, self.marked[name]))
            self._resizings[name] = self._at_constrained(slope)
        return self._resizings[name]()

    def _at_constrained(self, vector: Any) -> Callable[[], Array]:
        """Return what evaluates a UFL vector at the constrained points, (3, n), with the present parameters."""
        dofs = self._constrained.dofs
        block = np.zeros(len(self.state.x.array), dtype=np.int64)
        for field in (0, *range(2, 2 + len(self._followed))):
            space, parent = collapsed(self.space.sub(field))
            block[parent] = np.arange(len(parent)) // 3
        function = fem.Function(space)
        points = interpolation_points(space.element)
        expression = fem.Expression(vector, points, jit_options=options())

        def values() -> Array:
            function.interpolate(expression)
            return np.asarray(function.x.array.reshape(-1, 3)[block[dofs]].T)

        return values

    def impose(self, q: float) -> None:
        """Give every constrained unknown of the state the value it has at q (mm or rad) and this stage of assembly."""
        values = self._along_sleeve(self.setting.motion, q)
        for name, rate in self._reductions.items():
            values = values + float(self.stage.value) * float(self.constants[name].value) * rate
        self.state.x.array[self._constrained.dofs] = values

    @cached_property
    def _reductions(self) -> dict[str, Array]:
        """Parameters that move a boundary: displacement of the constrained unknowns per unit of each."""
        c = self._constrained
        dimension = 3 if self.setting.kinematics == "cartesian" else 2
        found = {}
        for item in self.features:
            if item.feature.reduction is None:
                continue
            moved = item.feature.reduction(c.x[:, :dimension].T, self.setting.kinematics)
            there = c.boundary == item.feature.reduced
            rate = np.where(there, moved[np.maximum(c.component, 0), np.arange(len(c.dofs))], 0.0)
            found[f"{item.name}.{next(iter(item.values))}"] = rate
        return found

    def boundary_rate(self, name: str, q: float) -> Array | None:
        """Derivative of the constrained unknowns at q by a parameter, over all local unknowns; None for zero."""
        if name in self._reductions:
            return self._over_all(float(self.stage.value) * self._reductions[name])
        if self.resizes(name):
            return self._over_all(self._along_sleeve(self.setting.motion, q, by=name))
        return None

    def boundary_bend(self, name: str, q: float) -> Array | None:
        """Derivative of `rate` by a parameter, over all local unknowns; None for zero."""
        return (
            self._over_all(self._along_sleeve(self.setting.rate, q, by=name)) if self.resizes(name) else None
        )

    def resizes(self, name: str) -> bool:
        """Whether a sleeve's motion depends on a parameter because its size does."""
        return self._resized is not None and any(
            item.feature.resizes and name.startswith(f"{item.name}.") for item in self.features
        )

    def rate(self, q: float) -> Array:
        """Derivative of the constrained unknowns with respect to q, over all local unknowns (zero elsewhere)."""
        return self._over_all(self._along_sleeve(self.setting.rate, q))

    def _over_all(self, constrained: Array) -> Array:
        """Values of the constrained unknowns among all local ones, zero elsewhere."""
        values = np.zeros_like(self.state.x.array)
        values[self._constrained.dofs] = constrained
        return values

    def set_parameters(self, parameters: Mapping[str, float], bulk_modulus: float | None = None) -> None:
        """Change parameters by name ("compliance" and those of features too) without building anything again.

        Raises
        ------
        ValueError
            A parameter is a dimension of the mesh (`Feature.dimensions`).
        """
        for name, value in parameters.items():
            if name in self._dimensions and value != float(self.constants[name].value):
                raise ValueError(f"{name} is a dimension of the mesh: another value needs another model")
            self.constants[name].value = value
        if bulk_modulus is not None:
            self.compliance.value = 1.0 / bulk_modulus

    @property
    def compliance(self) -> Any:
        """1 / bulk modulus, 1/MPa; features may add to it."""
        return self.constants["compliance"]

    # -- assembly ------------------------------------------------------------------------------------------------

    def create_vector(self) -> PETSc.Vec:
        """A vector over the unknowns."""
        return self.state.x.petsc_vec.duplicate()

    def create_matrix(self) -> PETSc.Mat:
        """A matrix for `assemble_tangent`, marked symmetric."""
        return reduced_matrix(self._tangent, self.owned_constrained)

    def assemble_residual(self, b: PETSc.Vec) -> None:
        """Out-of-balance force at the present state in every unknown, constrained ones included."""
        with b.localForm() as local:
            local.set(0.0)
        petsc.assemble_vector(b, self._residual)
        b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)

    def clear_constrained(self, b: PETSc.Vec) -> float:
        """Zero the constrained entries of an owned vector; return the norm of what stood there (the reactions)."""
        owned = self.owned_constrained
        squares = float(np.sum(b.array_r[owned] ** 2))
        b.array_w[owned] = 0.0
        return float(np.sqrt(self.comm.allreduce(squares)))

    @cached_property
    def owned_pressures(self) -> NDArray[np.int32]:
        """Pressure unknowns that this rank owns."""
        size = self.space.dofmap.index_map.size_local * self.space.dofmap.index_map_bs
        _, dofs = collapsed(self.space.sub(1))
        return dofs[dofs < size]

    @cached_property
    def volume(self) -> float:
        """Volume of the modelled part (mm^3), metal included."""
        dx = ufl.dx(self.mesh.mesh, metadata={"quadrature_degree": self.quadrature_degree})
        form = fem.form(self.strain.weight * dx, jit_options=options())
        return float(self.comm.allreduce(fem.assemble_scalar(form)))

    @cached_property
    def owned_constrained(self) -> NDArray[np.int32]:
        """Constrained unknowns that this rank owns."""
        size = self.space.dofmap.index_map.size_local * self.space.dofmap.index_map_bs
        dofs = self._constrained.dofs
        return dofs[dofs < size]

    def assemble_tangent(self, matrix: PETSc.Mat) -> None:
        """Tangent at the present state; constrained rows and columns are those of the identity."""
        matrix.zeroEntries()
        petsc.assemble_matrix(matrix, self._tangent, bcs=[self._bc])
        matrix.assemble()

    def lift(self, b: PETSc.Vec, rate: Array) -> None:
        """Set b = -K_fc rate_c, the force that a motion of the sleeve exerts on the free unknowns."""
        self._prescribed.x.array[:] = rate
        with b.localForm() as local:
            local.set(0.0)
        petsc.apply_lifting(b, [self._tangent], bcs=[[self._bc]], alpha=1.0)
        b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        petsc.set_bc(b, [self._bc], alpha=1.0)

    def energy(self) -> float:
        """Stored energy of the whole bushing (N mm), or of one face's share of a coupon."""
        part = fem.assemble_scalar(self._energy)
        return float(self.comm.allreduce(part)) * self.multiplicity


def strain(
    setting: Setting, u: Any, mesh: NamedMesh, moved: kinematics.Moved | None = None
) -> kinematics.Kinematics:
    """The kinematics that a setting asks for, of a displacement on a mesh whose stress-free shape may be moved."""
    if setting.kinematics == "cartesian":
        return kinematics.cartesian(u, moved)
    radius = ufl.SpatialCoordinate(mesh.mesh)[0]
    if setting.kinematics == "axisymmetric":
        return kinematics.axisymmetric(u, radius, moved)
    return kinematics.axisymmetric_twist(u, radius, moved)


def _constant(mesh: NamedMesh, value: float) -> Any:
    return fem.Constant(mesh.mesh, PETSc.ScalarType(value))


def _element(mesh: NamedMesh, setting: Setting, followed: int) -> Any:
    cell = mesh.mesh.basix_cell()
    order = mesh.displacement_order
    components = 2 if setting.kinematics == "axisymmetric" else 3
    displacement = basix.ufl.element("Lagrange", cell, order, shape=(components,))
    pressure = ("DG", 0) if order == 1 else ("Lagrange", order - 1)
    fields = [displacement, basix.ufl.element(pressure[0], cell, pressure[1])]
    return basix.ufl.mixed_element([*fields, *[displacement] * followed])


def _mirror_components(mirrors: Mirrors, components: int) -> dict[str, tuple[int, ...] | None]:
    """Mirror boundary -> the displacement component normal to it; the last component is along the axis."""
    normal = {"x": 0, "y": 1, "z": components - 1}
    return {f"mirror_{plane}": (normal[plane],) for plane in mirrors}
