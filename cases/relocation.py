"""A model that goes on with other coordinates of its mesh: nothing else of it is built again."""

from __future__ import annotations

from cases.model import Array, Model
from geometry.mesh import NamedMesh


def relocate(model: Model, mesh: NamedMesh, constrained: Array) -> None:
    """Bring a model to other coordinates of the same mesh, which its nodes have already.

    Parameters
    ----------
    model
        Without features but those of the rubber; others know the mesh as it was.
    mesh
        The mesh, with the shape that it has now.
    constrained : shape (n, 3)
        Where the constrained unknowns are now, mm.

    Raises
    ------
    ValueError
        The model has other features.
    """
    if not all(item.feature.of_rubber for item in model.features):
        raise ValueError("a model with features of the assembly cannot be moved to another shape")
    model.mesh = mesh
    for part in model.body.parts:
        part.points.locate(mesh)
    model.motion.relocate(constrained)
    # What was computed of the shape before.
    model.__dict__.pop("volume", None)
    model._taken = ()
    model.take_parameters()
