"""Give a model other coordinates of the same mesh without building it again."""

from __future__ import annotations

from cases.contact.contact import contact_of
from cases.model import Array, FiniteElementModel
from geometry.mesh import NamedMesh


def relocate(model: FiniteElementModel, mesh: NamedMesh, constrained: Array) -> None:
    """Update a model after the nodes of its mesh have been moved.

    Parameters
    ----------
    model
        Model whose features, if any, concern the rubber alone; others depend on the mesh as it was.
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
    contact = model.surfaces.contact
    if contact is None or not contact.relocated(mesh):
        model.surfaces.contact = contact_of(mesh, model.space, model.mode, None)
    if model.surfaces.gradient is not None:
        model.surfaces.gradient.locate(mesh)
    # It was computed for the previous shape.
    model.__dict__.pop("volume", None)
    model.system.take_parameters(moved=True)
