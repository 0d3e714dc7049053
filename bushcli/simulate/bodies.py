"""Finite-element models that are reused for the next design: only what has changed is built again.

New parameters of the law, and of effects in the rubber, replace numbers in the model. New dimensions of a structured
shape move its nodes (`geometry.morph`): neither Gmsh nor the set-up of elements, constraints and matrices runs again.
Every other change, such as another number of elements or an effect on the assembly, needs another model.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from cases.feature import Installed
from cases.mode import Mode, modes, setting_for
from cases.model import FiniteElementModel
from cases.simulate import Rubber, prepare
from cases.snubber import plates
from geometry.morph import Morph, elements_of
from geometry.shape import Refinement, Shape

Array = NDArray[np.float64]

# Largest number of models kept: over a range of lengths each mode has some ten numbers of elements along the axis.
CACHED_MODELS = 24


class _MovableModel:
    """A model that can be moved to another shape."""

    def __init__(self, model: FiniteElementModel, refinement: Refinement) -> None:
        self.model, self._refinement = model, refinement

    def move(self, shape: Shape) -> bool:
        """Move the model to another shape of the same elements; return False if it has to be built."""
        model, points = self.model, self.model.motion.constrained.x.copy()
        morph, nodes, places = self._morph
        if nodes is None or places is None:
            return False
        model.mesh.mesh.geometry.x[:] = morph.points(shape, nodes)
        points[self._is_displacement] = morph.points(shape, places)
        model.relocate(replace(model.mesh, shape=shape), points)
        return True

    @property
    def _is_displacement(self) -> NDArray[np.bool_]:
        """Which constrained unknowns are displacements, shape (n,)."""
        return self.model.motion.constrained.component >= 0

    @cached_property
    def _morph(self) -> tuple[Morph, Array | None, Array | None]:
        """The morph, with the places of the nodes and of the constrained displacements in the box of elements."""
        mesh, constrained = self.model.mesh, self.model.motion.constrained
        morph = Morph(mesh, self._refinement)
        return morph, morph.places(mesh.mesh.geometry.x), morph.places(constrained.x[self._is_displacement])


class PreparedModels:
    """Prepares models as `cases.simulate.prepare` does, and reuses earlier ones.

    The next call may change a model that an earlier call returned: march each model before the next call.

    Attributes
    ----------
    made, moved : int
        Number of models that were built, and of calls that an existing model served.
    """

    def __init__(self) -> None:
        self._models: OrderedDict[Hashable, _MovableModel] = OrderedDict()
        self.made = self.moved = 0

    def __call__(
        self,
        shape: Shape,
        mode: Mode,
        rubber: Rubber,
        refinement: Refinement,
        comm: MPI.Comm,
        features: Sequence[Installed] = (),
    ) -> FiniteElementModel:
        """Return the model of a shape under a mode, with these parameters."""
        # A mode outside the catalogue belongs to one load case; its name does not identify it.
        of_rubber = all(item.feature.of_rubber for item in features)
        if not of_rubber or plates(shape) or modes().get(mode.name) is not mode:
            self.made += 1
            return prepare(shape, mode, rubber, refinement, comm, features)
        dimension = 2 if mode.section is not None and shape.axisymmetric else 3
        mirrors = setting_for(mode, dimension).mirrors & shape.mirror_planes
        elements = elements_of(shape, dimension, mirrors, refinement)
        sleeves = shape.elastic_sleeves.items()
        metals = tuple((name, metal.youngs_modulus, metal.poissons_ratio) for name, metal in sleeves)
        law = rubber.law.name, tuple(rubber.parameters)
        effects = tuple((item.name, tuple(item.values)) for item in features)
        # A shape that is not structured cannot be morphed.
        body = elements or f"{type(shape).name} {shape.model_dump_json()}"
        key = (body, mode.name, law, metals, refinement, effects)
        prepared = self._models.get(key)
        if prepared is None:
            self.made += 1
            model = prepare(shape, mode, rubber, refinement, comm, features)
            self._models[key] = _MovableModel(model, refinement)
            if len(self._models) > CACHED_MODELS:
                self._models.popitem(last=False)
            return model
        self._models.move_to_end(key)
        self.moved += 1
        if shape != prepared.model.mesh.shape and not prepared.move(shape):
            model = prepare(shape, mode, rubber, refinement, comm, features)
            prepared = self._models[key] = _MovableModel(model, refinement)
        of_effects = {f"{item.name}.{name}": v for item in features for name, v in item.values.items()}
        prepared.model.set_parameters(dict(rubber.parameters) | of_effects, rubber.bulk_modulus)
        return prepared.model

    def relocate(self, model: FiniteElementModel, shape: Shape, refinement: Refinement) -> bool:
        """Move one of these models to another shape; return False, and do nothing, if that needs other elements.

        Parameters
        ----------
        model : FiniteElementModel
            As this object returned it.
        shape : Shape
        refinement : Refinement
            Refinement of the model's mesh.
        """
        prepared = next(body for body in self._models.values() if body.model is model)
        mesh = model.mesh
        before, after = (
            elements_of(s, mesh.dimension, mesh.mirrors, refinement) for s in (mesh.shape, shape)
        )
        return shape == mesh.shape or (after is not None and after == before and prepared.move(shape))
