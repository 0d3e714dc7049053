"""Writes displacement, pressure and largest principal stretch along the march to files for ParaView."""

from __future__ import annotations

from pathlib import Path

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, io
from numpy.typing import NDArray

from cases.jit import options
from cases.model import FiniteElementModel
from geometry.dolfinx_api import interpolation_points, mesh_order
from geometry.mesh import NamedMesh

Array = NDArray[np.float64]


def write_fields(model: FiniteElementModel, displacements: Array, states: Array, file: Path) -> None:
    """Write an XDMF time series (with its HDF5 file beside it).

    "Time" in it is the generalised displacement where the path visits each value only once, else the number of the
    step: the file format keeps one field per time.

    Parameters
    ----------
    model : FiniteElementModel
        The model, ready to be marched.
    displacements : Array, shape (n,)
        mm or rad.
    states : Array, shape (n, m)
        This rank's unknowns, as kept by the march.
    file : Path
        Ends in .xdmf.
    """
    mesh = model.mesh.mesh
    # XDMF stores nodal values on the mesh's own nodes: fields are interpolated to its degree.
    cell = mesh.basix_cell()
    degree = mesh_order(mesh)
    vectors = fem.functionspace(mesh, basix.ufl.element("Lagrange", cell, degree, shape=(3,)))
    scalars = fem.functionspace(mesh, basix.ufl.element("Lagrange", cell, degree))
    cellwise = fem.functionspace(mesh, ("DG", 0))
    u, p = ufl.split(model.state)[:2]
    fields = [
        (fem.Function(vectors, name="displacement_mm"), _cartesian(model, u)),
        (fem.Function(scalars, name="pressure_MPa"), p),
        (fem.Function(cellwise, name="largest_principal_stretch"), None),
    ]
    expressions = [
        None
        if expression is None
        else fem.Expression(
            expression, interpolation_points(function.function_space.element), jit_options=options(light=True)
        )
        for function, expression in fields
    ]
    distinct = len(np.unique(displacements)) == len(displacements)
    times = displacements if distinct else np.arange(len(displacements), dtype=float)
    with io.XDMFFile(mesh.comm, file, "w") as out:
        out.write_mesh(mesh)
        for time, state in zip(times, states, strict=True):
            model.state.x.array[:] = state
            for (function, _), expression in zip(fields, expressions, strict=True):
                if expression is None:
                    _stretch(model, function)
                else:
                    function.interpolate(expression)
                function.x.scatter_forward()
                out.write_function(function, float(time))


def _cartesian(model: FiniteElementModel, u: ufl.core.expr.Expr) -> ufl.core.expr.Expr:
    if model.setting.kinematics == "cartesian":
        return u
    if model.setting.kinematics == "axisymmetric":
        return ufl.as_vector([u[0], u[1], 0.0])
    radius = ufl.SpatialCoordinate(model.mesh.mesh)[0]
    r = radius + u[0]
    # The half-plane is drawn in x (radius) and y (axis); motion out of it is along z.
    return ufl.as_vector([r * ufl.cos(u[1]) - radius, u[2], r * ufl.sin(u[1])])


def _stretch(model: FiniteElementModel, function: fem.Function) -> None:
    from cases.stretches import principal_stretches

    for name, tag in model.mesh.region.items():
        cells = model.mesh.cells.find(tag)
        function.x.array[cells] = (
            principal_stretches(model, region=name)[..., -1].max(axis=1) if name == "rubber" else 1.0
        )


def write_mesh(mesh: NamedMesh, file: Path) -> None:
    """Write a mesh with its region and boundary tags as XDMF.

    Parameters
    ----------
    mesh
        Named mesh.
    file
        Ends in .xdmf.
    """
    inner = mesh.mesh
    inner.topology.create_connectivity(mesh.dimension - 1, mesh.dimension)
    mesh.cells.name, mesh.facets.name = "regions", "boundaries"
    with io.XDMFFile(inner.comm, file, "w") as out:
        out.write_mesh(inner)
        out.write_meshtags(mesh.cells, inner.geometry)
        out.write_meshtags(mesh.facets, inner.geometry)
