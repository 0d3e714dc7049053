"""Parameters of a model by name, and the numbers computed from them that kernels take as input.

A kernel knows its own parameters only. What it takes from others (the law's initial shear modulus, the compliance to
which features add, the swelling) is computed here, and so are the derivatives of all that with respect to a parameter:
exactly, by a complex step.

References
----------
Squire and Trapp (1998), Using complex variables to estimate derivatives of real functions, SIAM Rev. 40:110-112,
doi:10.1137/S003614459631241X.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray
from petsc4py import PETSc

from cases.feature import Installed
from forms.law import Law
from forms.potential import Attached
from geometry.mesh import NamedMesh
from geometry.metal import Metal

Array = NDArray[np.float64]

# Imaginary part of a complex step: so small that nothing but the first derivative is left in double precision.
STEP = 1e-30


@dataclass(frozen=True)
class Numbers:
    """Input of the kernels, or its derivative.

    Attributes
    ----------
    law : shape (m,)
        The law's parameters.
    volumetric : shape (2,) or (3,)
        Compliance (1/MPa), swelling (1), and the law's initial shear modulus (MPa).
    branches : tuple of Array
        For each branch: its parameters, the law's initial shear modulus (MPa) and the duration of the step (s), both as
        the temperature changes them for the branches.
    metals : tuple of Array
        For each elastic sleeve: shear and bulk modulus (MPa).
    shear_modulus : float
        The law's initial shear modulus, MPa.
    """

    law: Array
    volumetric: Array
    branches: tuple[Array, ...]
    metals: tuple[Array, ...]
    shear_modulus: float


class Parameters:
    """Parameters of a model.

    Parameters
    ----------
    mesh, law, parameters, bulk_modulus, features
        As in `cases.model.Model`.

    Attributes
    ----------
    constants
        Every parameter by name: the law's, "compliance", "feature.parameter", and "temperature" (degrees C) where a
        feature depends on it.
    marked
        The same as UFL variables, by which forms can be differentiated.
    duration, stage : Constant
        Duration of the present step (s), and share of the assembly that is done, 0 to 1.
    before : float or None
        Temperature (degrees C) at the beginning of the present step, if it is another than at its end.
    """

    def __init__(
        self,
        mesh: NamedMesh,
        law: Law,
        parameters: Mapping[str, float],
        bulk_modulus: float,
        features: Sequence[Installed],
    ) -> None:
        self._law, self._features, self._sleeves = law, features, tuple(mesh.sleeves.values())
        self.law_names = tuple(parameters)
        self._moduli = {name for name in parameters if law.parameter(name).unit == "MPa"}
        values = dict(parameters) | {"compliance": 1.0 / bulk_modulus}
        for installed in features:
            values |= {f"{installed.name}.{key}": value for key, value in installed.values.items()}
            values |= {"temperature": installed.temperature} if installed.feature.heated is not None else {}
        self.constants = {name: _constant(mesh, value) for name, value in values.items()}
        self.duration, self.stage = _constant(mesh, 0.0), _constant(mesh, 1.0)
        self.marked = {name: ufl.variable(constant) for name, constant in self.constants.items()}
        self._dimensions = {
            f"{installed.name}.{key}" for installed in features for key in installed.feature.dimensions
        }
        self.before: float | None = None
        # Views of the constants' memory: reading a constant's value takes longer than all the rest.
        self._views = [c.value for c in (*self.constants.values(), self.stage, self.duration)]
        self._kept: tuple[tuple[float, ...], Numbers] | None = None

    def begin_step(self, temperature: float | None) -> None:
        """Take the temperature (degrees C) at the beginning of a step; None where it is that at its end."""
        self.before = temperature

    @property
    def state(self) -> tuple[float, ...]:
        """All values, the stage and the duration: what `numbers` depends on."""
        return (0.0 if self.before is None else self.before, *[view.item() for view in self._views])

    def ufl_values(self, installed: Installed) -> dict[str, Any]:
        """A feature's parameters as UFL scalars; those of the assembly grow with the stage."""
        share = self.stage if installed.feature.assembled else 1
        return {key: share * self.marked[f"{installed.name}.{key}"] for key in installed.values}

    def set(self, values: Mapping[str, float]) -> None:
        """Change parameters by name.

        Raises
        ------
        ValueError
            A parameter is a dimension of the mesh (`Feature.dimensions`).
        """
        for name, value in values.items():
            if name in self._dimensions and value != float(self.constants[name].value):
                raise ValueError(f"{name} is a dimension of the mesh: another value needs another model")
            self.constants[name].value = value

    def attached_branches(self) -> list[Attached]:
        """Branches of all features, with numbers as their parameters."""
        return self._branches(self._values())

    def numbers(self) -> Numbers:
        """Return the present input of the kernels."""
        state = self.state
        if self._kept is None or self._kept[0] != state:
            self._kept = (state, _parts(self._material_numbers(self._values()), np.real, 1.0))
        return self._kept[1]

    def rates(self, name: str) -> Numbers:
        """Derivative of `numbers` with respect to a parameter."""
        values = self._values()
        if name in values:
            values[name] = values[name] + 1j * STEP
        return _parts(self._material_numbers(values), np.imag, STEP)

    @property
    def metal_modulus(self) -> float:
        """Young's modulus of the stiffest sleeve, MPa; 0 without elastic sleeves."""
        values = self._values()
        return max((float(self._youngs_modulus(sleeve, values)) for sleeve in self._sleeves), default=0.0)

    def _values(self) -> dict[str, Any]:
        return {name: float(constant.value) for name, constant in self.constants.items()}

    def _feature_values(self, installed: Installed, values: Mapping[str, Any]) -> dict[str, Any]:
        share = float(self.stage.value) if installed.feature.assembled else 1.0
        return {key: share * values[f"{installed.name}.{key}"] for key in installed.values}

    def _branches(self, values: Mapping[str, Any]) -> list[Attached]:
        return [
            branch
            for installed in self._features
            if installed.feature.branches is not None
            for branch in installed.feature.branches(self._feature_values(installed, values))
        ]

    def _youngs_modulus(self, sleeve: Metal, values: Mapping[str, Any]) -> Any:
        for installed in self._features:
            if installed.feature.metal is not None:
                modulus = installed.feature.metal(self._feature_values(installed, values), sleeve)
                if modulus is not None:
                    return modulus
        return sleeve.youngs_modulus

    def _material_numbers(self, values: Mapping[str, Any]) -> list[Any]:
        """Law, volumetric, branches, metals, shear modulus, computed from floats or from complex numbers."""
        stiffer, bonded, slower = 1.0, 1.0, 1.0
        for installed in self._features:
            if installed.feature.heated is not None:
                feature_values = self._feature_values(installed, values)
                stiffer, bonded, slower = installed.feature.heated(feature_values, values["temperature"])
                if self.before is not None:
                    # The clock dt / a_T over the step, by the trapezoidal rule.
                    slower = 2.0 / (
                        1.0 / slower + 1.0 / installed.feature.heated(feature_values, self.before)[2]
                    )
        law = {
            name: values[name] * stiffer if name in self._moduli else values[name] for name in self.law_names
        }
        shear = self._law.shear_modulus(**law)
        compliance, swelling = values["compliance"], 1.0
        for installed in self._features:
            if installed.feature.compliance is not None:
                compliance = compliance + installed.feature.compliance(
                    self._feature_values(installed, values)
                )
            if installed.feature.swelling is not None:
                swelling = swelling * installed.feature.swelling(self._feature_values(installed, values))
        branches = [
            [
                *(attached.parameters[name] for name in attached.branch.parameters),
                shear * bonded,
                float(self.duration.value) / slower,
            ]
            for attached in self._branches(values)
        ]
        metals = []
        for sleeve in self._sleeves:
            E, nu = self._youngs_modulus(sleeve, values), sleeve.poissons_ratio
            metals.append([E / (2 * (1 + nu)), E / (3 * (1 - 2 * nu))])
        return [list(law.values()), [compliance, swelling, shear], branches, metals, shear]


def _parts(numbers: Sequence[Any], part: Any, scale: float) -> Numbers:
    def array(values: Sequence[Any]) -> Array:
        return np.ascontiguousarray(part(np.array(values, dtype=np.complex128)) / scale)

    law, volumetric, branches, metals, shear = numbers
    return Numbers(
        array(law),
        array(volumetric),
        tuple(map(array, branches)),
        tuple(map(array, metals)),
        float(part(complex(shear)) / scale),
    )


def _constant(mesh: NamedMesh, value: float) -> Any:
    return fem.Constant(mesh.mesh, PETSc.ScalarType(value))
