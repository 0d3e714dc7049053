"""Features: changes of a model, such as memory of the rubber or another assembly, that their off values switch off.

A feature is data and small functions in UFL, with parameters of its own that can be changed, differentiated and set to
their off values without building anything again. Each effect of `bushcli` that acts on the rubber or on the assembly
consists of one feature.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cases.sine import ThinnedSpectrum
from forms.kinematics import Moved
from forms.law import Scalar
from forms.potential import Attached
from geometry.metal import Metal
from geometry.shape import Mirrors, Shape

Array = NDArray[np.float64]
Values = Mapping[str, Scalar]
"""A feature's parameters by name, as UFL scalars."""


@dataclass(frozen=True)
class Place:
    """Where a surface energy acts.

    Attributes
    ----------
    u : UFL vector
        Displacement unknowns of the setting.
    motion : mapping of str to UFL vector
        Motion of each boundary, "inner" or "outer", that features ask for (`Feature.follows`), continued over the whole
        mesh, in the components of u.
    x : UFL vector
        Coordinates in the stress-free body, mm.
    normal : UFL vector
        Outward unit normal of the mesh's boundary.
    ds : callable
        Measure of a named boundary: ``ds("outer")``, or ``ds("outer", degree)`` for a quadrature of that degree; None
        where the mesh has no such boundary.
    weight : UFL scalar
        Area of the stress-free boundary per length (or area) of its mesh.
    kinematics : str
        Kinematics of the setting (`cases.mode.Setting`).
    shear_modulus : UFL scalar
        The law's initial shear modulus, MPa.
    shape : Shape
        The meshed shape.
    """

    u: Scalar
    motion: Mapping[str, Scalar]
    x: Scalar
    normal: Scalar
    ds: Callable[..., Any]
    weight: Scalar
    kinematics: str
    shear_modulus: Scalar
    shape: Shape


@dataclass(frozen=True)
class Feature:
    """A change of the model.

    Attributes
    ----------
    branches : callable, optional
        Parameters -> branches of the rubber's energy.
    thinned : callable, optional
        Parameters -> constants of a relaxation that amplitude thins, for vibrations.
    compliance : callable, optional
        Parameters -> addition to 1 / bulk modulus, 1/MPa.
    heated : callable, optional
        Parameters and temperature (degrees C) -> factors on the moduli of the law, on those of the branches beyond
        these, and on all relaxation times.
    swelling : callable, optional
        Parameters -> volume ratio of the stress-free rubber to the mesh.
    shape : callable, optional
        Shape and values of the parameters -> shape that is meshed in its place.
    metal : callable, optional
        Parameters and an elastic sleeve -> its Young's modulus (MPa) with the feature; None where it does not change.
    stress_free : callable, optional
        Parameters, coordinates on the mesh (UFL vector, (r, z) in the half-plane) and meshed shape -> where the
        stress-free body is.
    arms : callable, optional
        As ``stress_free`` -> displacement from the mesh (UFL vector, mm) of the points of sleeves that are longer,
        wider or turned in the stress-free body, without that of their centres: they then turn as such bodies. None
        where they are those of the mesh.
    dimensions : tuple of str
        Parameters that are dimensions of the mesh: they change with the model only, and have no derivative.
    reductions : mapping of str to callable
        Parameter -> function from coordinates (d, n) in mm and kinematics to the displacement of the boundary
        `reduced`, at which an elastic sleeve there is free of stress, per unit of the parameter; shape (c, n), one row
        per component of the unknown displacement.
    reduced : str
        Boundary that `reductions` move: "inner" or "outer".
    surface : callable, optional
        Parameters and `Place` -> surface energies, UFL forms of rank 0.
    released : tuple of str
        Boundaries that the surface energy holds, not a prescribed displacement.
    follows : str
        Boundary whose motion a surface energy needs: "inner", "outer", or empty.
    springs : float
        Stiffness per area of its stiffest springs, in shear moduli per thickness: rounding of their forces limits the
        residual.
    breaks : frozenset of str
        Planes of symmetry that the feature breaks: "x", "y", "z".
    breaks_with : tuple of (str, frozenset of str)
        Names of optional parameters, each with the planes that the feature breaks in addition where it has a value.
    assembled : bool
        The parameters act before the test: they are brought to their values in steps, at rest, and time-dependent
        branches relax.
    """

    branches: Callable[[Values], Sequence[Attached]] | None = None
    thinned: Callable[[Mapping[str, float]], ThinnedSpectrum] | None = None
    compliance: Callable[[Values], Scalar] | None = None
    heated: Callable[[Values, Scalar], tuple[Scalar, Scalar, Scalar]] | None = None
    swelling: Callable[[Values], Scalar] | None = None
    shape: Callable[[Shape, Mapping[str, float]], Shape] | None = None
    metal: Callable[[Values, Metal], Scalar | None] | None = None
    stress_free: Callable[[Values, Scalar, Shape], Moved] | None = None
    arms: Callable[[Values, Scalar, Shape], Scalar | None] | None = None
    reductions: Mapping[str, Callable[[Array, str], Array]] = field(default_factory=dict)
    reduced: str = "outer"
    surface: Callable[[Values, Place], Sequence[Scalar]] | None = None
    dimensions: tuple[str, ...] = ()
    released: tuple[str, ...] = ()
    follows: str = ""
    springs: float = 0.0
    breaks: Mirrors = frozenset()
    breaks_with: tuple[tuple[str, Mirrors], ...] = ()
    assembled: bool = False

    @property
    def of_rubber(self) -> bool:
        """Whether it concerns the rubber alone: it then does not depend on the mesh, and serves any shape."""
        return replace(self, branches=None, compliance=None, heated=None) == Feature()


@dataclass(frozen=True)
class Installed:
    """A feature with the values of its parameters, whose full names are "name.parameter".

    A feature that heats the rubber has its temperature, degrees C, which the model has as the parameter "temperature".
    """

    name: str
    feature: Feature
    values: Mapping[str, float]
    temperature: float = math.nan

    @property
    def reductions(self) -> Mapping[str, Callable[[Array, str], Array]]:
        """`Feature.reductions` of the parameters that have values, by their full names."""
        by_name = self.feature.reductions.items()
        return {f"{self.name}.{name}": rate for name, rate in by_name if name in self.values}

    @property
    def breaks(self) -> Mirrors:
        """Planes of symmetry that the feature breaks with these parameters: "x", "y", "z"."""
        return self.feature.breaks.union(
            *(planes for name, planes in self.feature.breaks_with if name in self.values)
        )
