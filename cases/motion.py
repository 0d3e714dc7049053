"""Constrained unknowns and how a mode moves them, with the derivatives by q and by parameters that move a boundary."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.la import InsertMode
from numpy.typing import NDArray
from typing_extensions import override
from ufl.algorithms import expand_derivatives
from ufl.constantvalue import Zero

from cases.compiling import bare
from cases.feature import Installed
from cases.jit import options
from cases.mode import Mode, Setting
from cases.parameters import Parameters
from cases.six import displacement, possible, rotation, twist_of, twists
from forms.law import Scalar
from geometry.dolfinx_api import collapse, interpolation_points
from geometry.mesh import NamedMesh
from geometry.shape import Mirrors

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Constrained:
    """Constrained unknowns: local index, component, coordinates, whether it follows the sleeve, and boundary."""

    dofs: NDArray[np.int32]
    component: NDArray[np.int32]
    x: Array
    driven: NDArray[np.bool_]
    boundary: NDArray[np.str_]


class Motion:
    """Motion of the constrained unknowns of a model.

    Parameters
    ----------
    mesh, mode, setting
        Those of the model.
    space
        The mixed space (u, p, and the motion of each boundary in ``followed``).
    features, parameters
        Those of the model.
    arms
        Returns the displacement by which the sleeves turn as other bodies than on the mesh, in UFL; None if by none.

    Attributes
    ----------
    constrained : Constrained
    free : shape (k,)
        Motions of the sleeve that are unknowns like any others, mm and rad; only a path of six motions has any.
    """

    #: Numbers of these motions (`cases.six.MOTIONS`).
    free_numbers: tuple[int, ...] = ()

    def __init__(
        self,
        mesh: NamedMesh,
        mode: Mode,
        setting: Setting,
        space: Any,
        followed: Sequence[str],
        features: Sequence[Installed],
        parameters: Parameters,
        arms: Callable[[], Scalar | None],
    ) -> None:
        self._mesh, self._mode, self._setting, self._space = mesh, mode, setting, space
        self._followed, self._features, self._parameters, self._arms = followed, features, parameters, arms
        self._size = (space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts) * (
            space.dofmap.index_map_bs
        )
        self.constrained = self._find_constrained()
        self._shift_slopes: dict[str, Callable[[], Array] | None] = {}
        self.free: Array = np.zeros(len(self.free_numbers))

    # -- constrained unknowns -----------------------------------------------------------------------------------

    def _find_constrained(self) -> Constrained:
        values = self._on_boundaries()
        components = self._space.sub(0).num_sub_spaces
        for field, name in enumerate(self._followed, start=2):
            driven = name in self._mode.driven
            for component in range(components):
                subspace, dofs = collapse(self._space.sub(field).sub(component))
                points = subspace.tabulate_dof_coordinates()
                values |= {int(d): (component, points[i], driven, name) for i, d in enumerate(dofs)}
        # The energy of a metal sleeve does not contain the pressure.
        for dof in self._idle_pressures():
            values[dof] = (-1, np.zeros(3), False, "")
        dofs = np.array(sorted(values), dtype=np.int32)
        return Constrained(
            dofs,
            np.array([values[d][0] for d in dofs], dtype=np.int32),
            np.array([values[d][1] for d in dofs]).reshape(-1, 3),
            np.array([values[d][2] for d in dofs], dtype=bool),
            np.array([values[d][3] for d in dofs], dtype=str),
        )

    def _on_boundaries(self) -> dict[int, tuple[int, Array, bool, str]]:
        """Displacements that are held or driven."""
        mesh, mode, space = self._mesh, self._mode, self._space
        components = space.sub(0).num_sub_spaces
        released = {name for installed in self._features for name in installed.feature.released}
        held_names = {name: only for name, only in mode.held.items() if name not in released}
        driven_names = {name: only for name, only in mode.driven.items() if name not in released}
        planes = _mirror_components(mesh.mirrors, components)
        values: dict[int, tuple[int, Array, bool, str]] = {}
        for component in range(components):
            part = space.sub(0).sub(component)
            subspace, _ = collapse(part)
            points = subspace.tabulate_dof_coordinates()
            for names, driven in ((held_names | planes, False), (driven_names, True)):
                for name, components_held in names.items():
                    if name not in mesh.boundary or (
                        components_held is not None and component not in components_held
                    ):
                        continue
                    facets = mesh.facets.find(mesh.boundary[name])
                    dofs, indices = fem.locate_dofs_topological((part, subspace), mesh.dimension - 1, facets)
                    values.update(
                        {
                            int(d): (component, points[index], driven, name)
                            for d, index in zip(dofs, indices, strict=True)
                        }
                    )
        return values

    def _idle_pressures(self) -> list[int]:
        mesh = self._mesh
        if not mesh.sleeves:
            return []
        part = self._space.sub(1)
        tdim = mesh.dimension
        mesh.mesh.topology.create_connectivity(tdim, tdim)
        idle = [
            fem.locate_dofs_topological(part, tdim, mesh.cells.find(mesh.region[name]))
            for name in mesh.sleeves
        ]
        # The rubber beside an unknown may be on another rank.
        in_rubber = fem.Function(self._space)
        in_rubber.x.array[fem.locate_dofs_topological(part, tdim, mesh.cells.find(mesh.region["rubber"]))] = (
            1.0
        )
        in_rubber.x.scatter_reverse(InsertMode.add)
        in_rubber.x.scatter_forward()
        return [int(d) for d in np.unique(np.concatenate(idle)) if in_rubber.x.array[d] == 0.0]

    def relocate(self, x: Array) -> None:
        """Move the constrained unknowns to other points, shape (n, 3), mm."""
        self.constrained = replace(self.constrained, x=x)

    # -- how they move -------------------------------------------------------------------------------------------

    def values(self, q: float) -> Array:
        """Constrained unknowns at q (mm or rad) and this stage of assembly, in the order of `constrained`."""
        values = self._along_sleeve(self._motion, q)
        for name, rate in self._reductions.items():
            values = values + self._stage * float(self._parameters.constants[name].value) * rate
        return values

    def rate(self, q: float, ahead: bool = False) -> Array:
        """Derivative of the constrained unknowns with respect to q, over all local unknowns (zero elsewhere).

        Parameters
        ----------
        q
            mm or rad; for a path of six motions s, with the free motions at rest.
        ahead
            At a corner of such a path: take the rate along the line after it.
        """
        return self.over_all(self._along_sleeve(self._setting.rate, q))

    def rigid(self, x: Array, q: float) -> Array:
        """Rigid motions of the whole body as it is deformed, in the directions in which the sleeve can move.

        Parameters
        ----------
        x
            Where its points are now, shape (d, n), mm.
        q
            mm or rad; s of a path of six motions.

        Returns
        -------
        shape (m, components, n)
            Per mm or rad: one motion, or all six.
        """
        return np.asarray(self._setting.rate(x, 0.0))[None]

    def take(self, free: Array) -> None:
        """Set the free motions of the sleeve, mm and rad."""
        self.free = np.array(free)

    def pose(self, q: float) -> Array | None:
        """Where the sleeve is, (6,) in mm and rad; None except on a path of six motions."""
        return None

    def over_all(self, constrained: Array) -> Array:
        """Values of the constrained unknowns among all local ones, zero elsewhere; shape (..., constrained)."""
        values = np.zeros((*constrained.shape[:-1], self._size))
        values[..., self.constrained.dofs] = constrained
        return values

    def _motion(self, x: Array, q: float) -> Array:
        return self._setting.motion(x, q)

    def boundary_rate(self, name: str, q: float) -> Array | None:
        """Derivative of the constrained unknowns at q by a parameter, over all local unknowns; None for zero.

        Parameters
        ----------
        name : str
            Full name of the parameter.
        q : float
            Generalised displacement, mm or rad.
        """
        if name in self._reductions:
            return self.over_all(self._stage * self._reductions[name])
        if self.arms_depend_on(name):
            return self.over_all(self._along_sleeve(self._motion, q, by=name))
        return None

    def boundary_bend(self, name: str, q: float) -> Array | None:
        """Derivative of `rate` by a parameter, over all local unknowns; None for zero.

        Parameters
        ----------
        name : str
            Full name of the parameter.
        q : float
            Generalised displacement, mm or rad.
        """
        if not self.arms_depend_on(name):
            return None
        return self.over_all(self._along_sleeve(self._setting.rate, q, by=name))

    def arms_depend_on(self, name: str) -> bool:
        """Whether a sleeve's motion depends on a parameter because its size or direction does."""
        return self._shift_slope(name) is not None

    @property
    def _turns(self) -> bool:
        """Whether the sleeve may turn."""
        return self._mode.rotational

    @property
    def _stage(self) -> float:
        return float(self._parameters.stage.value)

    def _along_sleeve(self, motion: Any, q: float, by: str = "") -> Array:
        """Motion of the constrained unknowns, or its derivative by a parameter of the sleeve's size or direction."""
        c = self.constrained
        dimension = 3 if self._setting.kinematics == "cartesian" else 2
        x = c.x[:, :dimension].T
        if self._shifts is not None:
            x = x + self._shifts()
        displacement = motion(x, q)
        slope = self._shift_slope(by)
        assert slope is not None or not by
        if slope is not None:
            # A rigid motion is affine in the coordinates: the difference drops the constant.
            displacement = motion(x + slope(), q) - displacement
        return np.where(c.driven, displacement[c.component, np.arange(len(c.dofs))], 0.0)

    @cached_property
    def _shift(self) -> Scalar | None:
        """Displacement from the mesh of the sleeves' points about their centres, in UFL; None unless one turns."""
        return self._arms() if self._turns and self._setting.kinematics == "cartesian" else None

    @cached_property
    def _shifts(self) -> Callable[[], Array] | None:
        """Values of `_shift` at the constrained points, (3, n)."""
        return None if self._shift is None else self._at_constrained(self._shift)

    def _shift_slope(self, name: str) -> Callable[[], Array] | None:
        """Derivative of `_shifts` by a parameter; None where it is zero."""
        if self._shift is None or name not in self._parameters.marked:
            return None
        if name not in self._shift_slopes:
            slope = expand_derivatives(ufl.diff(self._shift, self._parameters.marked[name]))
            self._shift_slopes[name] = None if isinstance(slope, Zero) else self._at_constrained(slope)
        return self._shift_slopes[name]

    def _at_constrained(self, vector: Any) -> Callable[[], Array]:
        """Return a function that evaluates a UFL vector at the constrained points, (3, n), at present parameters."""
        dofs = self.constrained.dofs
        block = np.zeros(self._size, dtype=np.int64)
        for field in (0, *range(2, 2 + len(self._followed))):
            space, parent = collapse(self._space.sub(field))
            block[parent] = np.arange(len(parent)) // 3
        function = fem.Function(space)
        points = interpolation_points(space.element)
        expression = fem.Expression(bare(vector), points, jit_options=options(light=True))

        def values() -> Array:
            function.interpolate(expression)
            return np.asarray(function.x.array.reshape(-1, 3)[block[dofs]].T)

        return values

    @cached_property
    def _reductions(self) -> Mapping[str, Array]:
        """Parameters that move a boundary: displacement of the constrained unknowns per unit of each."""
        c = self.constrained
        dimension = 3 if self._setting.kinematics == "cartesian" else 2
        reductions = {}
        for installed in self._features:
            on_boundary = c.boundary == installed.feature.reduced
            for name, draw_in in installed.reductions.items():
                rates = draw_in(c.x[:, :dimension].T, self._setting.kinematics)
                own = rates[np.maximum(c.component, 0), np.arange(len(c.dofs))]
                reductions[name] = np.where(on_boundary, own, 0.0)
        return reductions


def _mirror_components(mirrors: Mirrors, components: int) -> dict[str, tuple[int, ...] | None]:
    """Mirror boundary -> the displacement component normal to it; the last component is along the axis."""
    normal = {"x": 0, "y": 1, "z": components - 1}
    return {f"mirror_{plane}": (normal[plane],) for plane in mirrors}


class PoseMotion(Motion):
    """Motion along a path of six motions, of which some may be free; the parameters are those of `Motion`.

    Attributes
    ----------
    path : SixPath
        q is its time, s.
    """

    def __init__(self, mesh: NamedMesh, mode: Mode, setting: Setting, *model: Any) -> None:
        assert setting.six is not None
        self.path = setting.six
        self.free_numbers = self.path.free
        super().__init__(mesh, mode, setting, *model)

    def twist(self, q: float, ahead: bool = False) -> Array:
        """Twist per unit of q, (6,), on the way to q or of what lies ahead, with the free motions at rest."""
        return np.asarray(twist_of(self.pose(q)) @ self.path.rate(q, ahead))

    @override
    def rate(self, q: float, ahead: bool = False) -> Array:
        return self.over_all(self.twist(q, ahead) @ self.twists(q))

    @override
    def rigid(self, x: Array, q: float) -> Array:
        motions = twists(x - self.pose(q)[:3, None], np.zeros(6))
        return motions[list(possible(self._mesh.mirrors))]

    @override
    def boundary_bend(self, name: str, q: float) -> Array | None:
        return self.over_all(self.twist(q) @ self.twists(q, by=name)) if self.arms_depend_on(name) else None

    @override
    def pose(self, q: float) -> Array:
        pose = self.path.pose(q)
        pose[list(self.free_numbers)] = self.free
        return pose

    def twists(self, q: float, by: str = "") -> Array:
        """Motion of the constrained unknowns per unit of each further motion of the sleeve, (6, constrained).

        Parameters
        ----------
        q
            Path's parameter, s.
        by
            Parameter of the sleeve's size or direction; if given, the derivative by it is returned.
        """
        c, pose = self.constrained, self.pose(q)
        x = c.x.T if self._shifts is None else c.x.T + self._shifts()
        fields = twists(x, pose)
        slope = self._shift_slope(by)
        assert slope is not None or not by
        if slope is not None:
            # Affine in the coordinates: the difference drops the constant.
            fields = twists(x + slope(), pose) - fields
        return np.where(c.driven, fields[:, c.component, np.arange(len(c.dofs))], 0.0)

    def arms(self, q: float) -> Array:
        """Vectors from the sleeve's centre to the constrained points, turned with the sleeve, (3, constrained), mm."""
        x = self.constrained.x.T if self._shifts is None else self.constrained.x.T + self._shifts()
        return rotation(self.pose(q)[3:]) @ x

    @override
    def _motion(self, x: Array, q: float) -> Array:
        return displacement(x, self.pose(q))

    @property
    @override
    def _turns(self) -> bool:
        return True


def pose_motion_of(motion: Motion) -> PoseMotion:
    """Return the motion of a model as that of a path of six motions, which its caller knows it to be."""
    if not isinstance(motion, PoseMotion):
        raise TypeError("the model has no path of six motions")
    return motion
