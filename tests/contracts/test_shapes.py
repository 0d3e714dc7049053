"""What every shape must do; a new file in geometry/shapes is tested on its `examples`, without a change here."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import ufl
from dolfinx import fem

from cases.march import march
from cases.mode import modes, setting_for
from cases.program import Program
from cases.simulate import prepare
from geometry.mesh import build
from geometry.shape import Refinement, Sleeve, shapes

COARSE = Refinement(across=2, along=4, around=8)
# Thin parts of a drawn section make thousands of elements in space.
COARSE_UNSTRUCTURED = Refinement(across=1, along=2, around=6)
FINE = Refinement(across=4, along=8, around=16)
SLEEVE = {"thickness": 2.0}


def specimens():
    """Yield name, shape: every example, and for bushings with sleeves also with elastic ones, in either grip."""
    for name, shape in shapes().items():
        for number, dimensions in enumerate(shape.examples):
            yield pytest.param(shape(**dimensions), id=f"{name}-{number}")
        if "inner_sleeve" in shape.model_fields:
            for grip in ("surface", "ends"):
                sleeves = {key: Sleeve(grip=grip, **SLEEVE) for key in ("inner_sleeve", "outer_sleeve")}
                yield pytest.param(shape(**shape.examples[0], **sleeves), id=f"{name}-sleeves-{grip}")


SPECIMENS = list(specimens())
BUSHINGS = [case for case in SPECIMENS if case.values[0].specimen == "bushing"]
MODES = [mode for mode in modes().values() if mode.specimen == "bushing"]


def cuts(shape):
    """Return dimension and mirror planes of every model that some mode needs of the shape, and of the whole solid."""
    found = {(3, frozenset())}
    for mode in modes().values():
        if mode.specimen == shape.specimen:
            dimension = 2 if mode.section is not None and shape.axisymmetric else 3
            found |= {(d, setting_for(mode, d).mirrors & shape.mirror_planes) for d in {dimension, 3}}
    if shape.specimen == "bushing":
        # A path along y leaves the planes x = 0 and z = 0, one that tilts about x as well x = 0 alone.
        found |= {(3, frozenset(planes) & shape.mirror_planes) for planes in ({"x"}, {"x", "z"})}
    return sorted(found, key=lambda cut: (cut[0], sorted(cut[1])))


@cache
def coarse_mesh(shape, dimension, mirrors):
    """Mesh that the tests of a shape share."""
    return build(shape, dimension, mirrors, COARSE)


def measure(mesh, name, facets=False):
    """Volume of a region or area of a boundary, of the whole solid."""
    x = ufl.SpatialCoordinate(mesh.mesh)
    weight = 2 * ufl.pi * x[0] if mesh.dimension == 2 else fem.Constant(mesh.mesh, 1.0)
    if facets:
        form = weight * ufl.ds(mesh.mesh, subdomain_data=mesh.facets)(mesh.boundary[name])
    else:
        form = weight * ufl.dx(mesh.mesh, subdomain_data=mesh.cells, metadata={"quadrature_degree": 8})(
            mesh.region[name]
        )
    return fem.assemble_scalar(fem.form(form)) * 2 ** len(mesh.mirrors)


@pytest.mark.parametrize("shape", SPECIMENS)
def test_volumes_and_bond_areas_are_those_of_the_formula(shape):
    """Exact where the boundary is a polynomial of second degree, else of fourth order in the element size."""
    exact = shape.measures()
    for dimension, mirrors in cuts(shape):
        meshes = [coarse_mesh(shape, dimension, mirrors), build(shape, dimension, mirrors, FINE)]
        if shape.structured and not shape.axisymmetric and dimension == 3:
            # Few elements of a graded arc are not halved: 2 and 4 have the lengths 0.5 and 0.38, 8 have 0.23.
            meshes = [meshes[1], build(shape, dimension, mirrors, replace(FINE, around=32))]
        for name, value in exact.items():
            bond = name.removesuffix("_bond")
            if name in meshes[0].region:
                found = [measure(mesh, name) for mesh in meshes]
            elif shape.elastic_sleeves:
                continue  # the bond is then inside the mesh; its area is tested with rigid sleeves
            else:
                found = [measure(mesh, bond, facets=True) for mesh in meshes]
            coarse, fine = (abs(v / value - 1) for v in found)
            # Elements of unstructured meshes are halved only on average.
            order = 3.5 if shape.structured else 2.0
            assert fine < 1e-11 or np.log2(coarse / fine) > order, (name, dimension, set(mirrors))
            assert fine < 2e-3


@pytest.mark.parametrize("shape", SPECIMENS)
def test_no_element_is_folded(shape):
    """The determinant of the chart keeps its sign inside every element, corners included."""
    for dimension, mirrors in cuts(shape):
        mesh = coarse_mesh(shape, dimension, mirrors)
        points = np.stack(np.meshgrid(*[[0.0, 0.5, 1.0]] * dimension), axis=-1).reshape(-1, dimension)
        cells = np.arange(mesh.mesh.topology.index_map(dimension).size_local, dtype=np.int32)
        jacobian = fem.Expression(ufl.JacobianDeterminant(mesh.mesh), points).eval(mesh.mesh, cells)
        assert np.all(jacobian.min(axis=1) * jacobian.max(axis=1) > 0)


@pytest.mark.parametrize("shape", SPECIMENS)
def test_every_cell_has_its_region_and_modes_find_their_boundaries(shape):
    for dimension, mirrors in cuts(shape):
        mesh = coarse_mesh(shape, dimension, mirrors)
        cells = mesh.mesh.topology.index_map(dimension).size_local
        assert sum(len(mesh.cells.find(tag)) for tag in mesh.region.values()) == cells
        assert set(mesh.region) == {"rubber", *shape.elastic_sleeves}
        assert all(len(mesh.facets.find(tag)) for tag in mesh.boundary.values())
        needed = {
            name
            for mode in modes().values()
            if mode.specimen == shape.specimen
            for name in (*mode.driven, *mode.held)
        }
        assert needed <= set(mesh.boundary)
        if shape.specimen == "bushing":
            assert {name for name in mesh.boundary if name.startswith("mirror_")} == {
                f"mirror_{m}" for m in mirrors
            }


@pytest.mark.parametrize("shape", SPECIMENS)
def test_every_outer_facet_is_named_and_mirrors_are_planes(shape):
    for dimension, mirrors in cuts(shape):
        mesh = coarse_mesh(shape, dimension, mirrors)
        topology = mesh.mesh.topology
        topology.create_connectivity(dimension - 1, dimension)
        named = np.concatenate([mesh.facets.find(tag) for tag in mesh.boundary.values()])
        connected = topology.connectivity(dimension - 1, dimension)
        outside = [
            f for f in range(topology.index_map(dimension - 1).size_local) if len(connected.links(f)) == 1
        ]
        assert sorted(named) == outside
        space = fem.functionspace(mesh.mesh, ("Lagrange", 2))
        normal = {"x": 0, "y": 1, "z": dimension - 1}
        for plane in mirrors:
            facets = mesh.facets.find(mesh.boundary[f"mirror_{plane}"])
            dofs = fem.locate_dofs_topological(space, dimension - 1, facets)
            np.testing.assert_allclose(space.tabulate_dof_coordinates()[dofs, normal[plane]], 0, atol=1e-9)


@pytest.mark.parametrize("shape", [case for case in SPECIMENS if not case.values[0].elastic_sleeves])
def test_a_mesh_is_not_cut_where_the_shape_is_not_symmetric(shape):
    for plane in {"x", "y", "z"} - shape.mirror_planes:
        with pytest.raises(ValueError, match=f"not symmetric about the planes normal to {plane}"):
            build(shape, 3, frozenset({plane}), COARSE)
    if not shape.axisymmetric:
        with pytest.raises(ValueError, match="no half-plane model"):
            build(shape, 2, frozenset(), COARSE)


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.name)
@pytest.mark.parametrize("shape", BUSHINGS)
def test_every_mode_meets_resistance(shape, mode, rubber):
    q = 0.01 if mode.rotational else 0.1
    refinement = COARSE if shape.structured else COARSE_UNSTRUCTURED
    model = prepare(shape, mode, rubber("neo_hookean"), refinement)
    history = march(model, Program(np.array([q, -q])), tolerance=1e-10)
    assert history.force[0] > 0 > history.force[1]
    if mode.reversed_by in shape.mirror_planes:
        assert history.force[1] == pytest.approx(-history.force[0], rel=1e-7)
    # Half the product of force and displacement: at this displacement the response is linear to a percent.
    assert history.energy[0] == pytest.approx(0.5 * q * history.force[0], rel=0.01)


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.name)
def test_sleeves_approach_rigid_ones_as_they_stiffen(mode, rubber):
    plain = shapes()["plain"]
    dimensions = plain.examples[0]
    program = Program(np.array([0.01 if mode.rotational else 0.1]))

    def force(**sleeves):
        shape = plain(**dimensions, **sleeves)
        return march(prepare(shape, mode, rubber("neo_hookean"), COARSE), program).force[0]

    rigid = force()
    short = [
        rigid
        - force(
            inner_sleeve=Sleeve(youngs_modulus=E, **SLEEVE), outer_sleeve=Sleeve(youngs_modulus=E, **SLEEVE)
        )
        for E in (1e4, 1e5)
    ]
    # A sleeve that is far stiffer than the rubber (mu = 1 MPa) deforms in proportion to 1 / E.
    assert 0 < short[0] < 0.02 * rigid
    assert short[0] / short[1] == pytest.approx(10.0, rel=0.02)


@pytest.mark.parametrize("name", shapes())
def test_a_shape_has_the_name_of_its_file(name):
    assert shapes()[name].name == name
    assert shapes()[name].__module__ == f"geometry.shapes.{name}"
