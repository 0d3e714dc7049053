"""CAD parts made by script (tests/parts.py): meshed, or refused with the right sentence and a picture."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem

from bushcli.report.drawing.geometry import geometry_figure
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import Rubber, prepare
from forms.law import laws
from geometry.cad.meshing import refuse_flat
from geometry.dolfinx_api import mesh_order
from geometry.errors import GeometryError
from geometry.mesh import build
from geometry.raw import TETRAHEDRON4, RawMesh
from geometry.shape import Refinement, shapes
from tests.parts import PARTS, _kidney, _named, _occ, _without, draw_to, make, ring

CAD = shapes()["cad"]
COARSE = Refinement(across=2)
PLANES = {
    "plain": "xyz",
    "two_kidneys": "xyz",
    "turned_kidneys": "xyz",
    "chamfers": "xyz",
    "fillets": "xyz",
    "flange": "xy",
    "one_void": "yz",
    "offset_voids": "z",
    "three_voids": "yz",
    "plate": "xyz",
    "sleeves": "xyz",
    "layers": "xyz",
    "tiny_faces": "xyz",
    "metres": "xyz",
    "tilted": "xyz",
    "cone": "xy",
    "eccentric": "yz",
    "coloured": "xy",
    "three_colours": "xy",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("parts")


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANES)
def test_a_sound_part_is_understood_and_meshed(name, folder, capfd):
    shape = CAD(file=str(make(name, folder)))
    capfd.readouterr()  # discard OpenCASCADE's output about its exports
    assert shape.mirror_planes == frozenset(PLANES[name])
    mesh = build(shape, 3, shape.mirror_planes & {"y", "z"}, COARSE)
    assert capfd.readouterr() == ("", "")
    whole = 2 ** len(mesh.mirrors)
    dx = ufl.dx(mesh.mesh, subdomain_data=mesh.cells)
    ds = ufl.ds(mesh.mesh, subdomain_data=mesh.facets)
    one = fem.Constant(mesh.mesh, 1.0)
    for part, exact in shape.measures().items():
        bond = part.removesuffix("_bond")
        measure = dx(mesh.region[part]) if part in mesh.region else ds(mesh.boundary[bond])
        assert whole * fem.assemble_scalar(fem.form(one * measure)) == pytest.approx(exact, rel=2e-3)
    # Every outer facet has a name.
    topology = mesh.mesh.topology
    topology.create_connectivity(2, 3)
    connected = topology.connectivity(2, 3)
    outside = [f for f in range(topology.index_map(2).size_local) if len(connected.links(f)) == 1]
    named = np.concatenate([mesh.facets.find(tag) for tag in mesh.boundary.values()])
    assert sorted(named) == outside


@pytest.mark.parametrize("name", [name for name, (_, _, said) in PARTS.items() if said])
def test_what_is_no_bushing_is_refused_with_a_sentence_and_a_picture(name, folder):
    shape = CAD(file=str(make(name, folder)))
    with pytest.raises(GeometryError, match=PARTS[name][2]) as error:
        shape.interpretation  # noqa: B018 - asking is the test
    assert error.value.view is not None or PARTS[name][2].startswith("which is impossible")


def test_every_part_is_tried():
    assert {name for name, (_, _, said) in PARTS.items() if not said} == set(PLANES)


def test_a_drawn_sleeve_is_met_beyond_its_bond_as_far_as_it_goes(folder):
    """The bolt is longer than the rubber by 10 mm at both ends, the housing by 6 mm at the upper end only."""

    def drawn():
        ring(10, 22, 40)
        ring(8, 10, 60)
        ring(22, 24, 46, at=(0.0, 0.0, 3.0))

    file = draw_to(folder / "long.step", drawn)
    file.write_text(_named("rubber", "bolt", "housing")(file.read_text()))
    shape = shapes()["cad"](file=str(file))
    assert shape.beyond == {"inner": pytest.approx((10, 10)), "outer": pytest.approx((0, 6), abs=1e-6)}
    assert shape.mirror_planes == {"x", "y"}
    rubber = Rubber(laws()["neo_hookean"], {"C10": 0.5}, 2000.0)
    contact = prepare(shape, modes()["radial"], rubber, Refinement(across=1)).surfaces.contact
    x, y, z = contact.bodies.X.T
    r = np.hypot(x, y)
    for radius, ends in ((10, (-30, 30)), (22, (-20, 26))):
        own = z[np.isclose(r, radius, rtol=0.02)]
        assert (own.min(), own.max()) == pytest.approx(ends, abs=0.01)
    flush = shapes()["cad"](file=str(make("layers", folder)))
    assert flush.beyond == {}


def test_between_two_spokes_no_tangent_of_a_drawn_sleeve_leaves_it(folder):
    """Beside a spoke the sleeve bends around the axis: its tangent there would lie in the void, and be met."""

    def drawn():
        _without(ring(10, 22, 40), _kidney(0.0, 0.6, 9.0, 18.0), _kidney(np.pi, 0.6, 9.0, 18.0))
        ring(8, 10, 60)

    file = draw_to(folder / "spokes.step", drawn)
    file.write_text(_named("rubber", "bolt")(file.read_text()))
    shape = shapes()["cad"](file=str(file))
    assert shape.beyond == {"inner": pytest.approx((10, 10))}
    rubber = Rubber(laws()["neo_hookean"], {"C10": 0.5}, 2000.0)
    contact = prepare(shape, modes()["radial"], rubber, Refinement(across=1)).surfaces.contact
    x, y, z = contact.bodies.X.T
    r = np.hypot(x, y)
    sleeve = (np.abs(z) > 20.01) & (r < 30.0)  # farther out are the planes of symmetry
    assert sleeve.any()
    np.testing.assert_allclose(r[sleeve], 10.0, rtol=0.02)
    # The void reaches from the sleeve to a radius of 18 mm: nothing is in it.
    inside = (r > 10.2) & (r < 17.8) & (np.abs(np.arctan2(y, np.abs(x))) < 0.5) & (np.abs(z) < 19.0)
    assert not inside.any()


@pytest.mark.slow
def test_what_names_do_not_tell_the_case_says(folder):
    file = str(make("nameless_sleeves", folder))
    roles = {"1": "inner_sleeve", "2": "rubber", "3": "outer_sleeve"}
    rigid = CAD(file=file, solids=roles)
    assert rigid.interpretation.regions == ("rubber",)
    assert rigid.measures()["inner_bond"] == pytest.approx(2 * np.pi * 10 * 40)
    elastic = CAD(file=file, solids=roles, plates={"outer_sleeve": {}})
    assert elastic.interpretation.regions == ("rubber", "outer_sleeve")
    assert elastic.measures()["outer_bond"] == pytest.approx(2 * np.pi * 24 * 40)
    stiff = CAD(file=file, solids=roles, plates={"outer_sleeve": {"rigid": True}})
    assert any("outer_sleeve, rigid, 11561 mm3" in note for note in stiff.notes)
    for shape, state in ((rigid, "rigid"), (elastic, "elastic"), (stiff, "rigid")):
        figure = geometry_figure(shape.view, "sleeves", shape.measures())
        legend = {
            text.get_text(): patch.get_facecolor()
            for text, patch in zip(
                figure.legends[0].get_texts(), figure.legends[0].get_patches(), strict=True
            )
        }
        assert {"inner sleeve, rigid, 7370.2 mm³", "rubber, 48255 mm³"} < set(legend)
        assert f"outer sleeve, {state}, 11561 mm³" in legend
        assert len(set(legend.values())) == len(legend)
    with pytest.raises(GeometryError, match='there is no solid "7"'):
        CAD(file=file, solids={"7": "rubber"}).interpretation  # noqa: B018


@pytest.mark.slow
def test_units_rules_and_axis_of_the_case(folder):
    metres = CAD(file=str(make("wrong_unit", folder)), unit="m")
    assert metres.measures()["rubber"] == pytest.approx(np.pi * (22**2 - 10**2) * 40)
    brep = CAD(file=str(make("plain", folder, ".brep")))
    assert brep.measures() == pytest.approx(metres.measures())
    assert [note for note in brep.notes if "states no unit" in note]
    assert "the file states the unit of length mm" in metres.notes
    assert not [note for note in metres.notes if "states no unit" in note]
    flanged = str(make("flange", folder))
    ruled = CAD(
        file=flanged,
        bonds={
            "inner": {"radius": 10.0},
            "outer": [{"radius": 22.0}, {"normal": [0, 0, -1], "box": [[-28, -28, 19], [28, 28, 21]]}],
        },
    )
    collar = np.pi * (27**2 - 22**2)
    assert ruled.measures()["outer_bond"] == pytest.approx(2 * np.pi * 22 * 40 + collar)
    given = CAD(file=flanged, axis=(0, 0, -1), origin=(0, 0, 3), direction=(0, 1, 0))
    assert given.interpretation.frame.rows[2] == (0.0, 0.0, -1.0)
    assert given.interpretation.frame.centre == (0.0, 0.0, 3.0)
    assert given.interpretation.frame.rows[0] == (0.0, 1.0, 0.0)
    for wrong, said in (
        ({"direction": (0, 0, 1)}, "geometry.direction: is along the axis"),
        ({"axis": (1, 0, 0)}, r"about the given axis; most curved faces are about \(0, 0, 1\)"),
        (
            {"bonds": {"inner": [{"radius": 10.0}, {"radius": 11.0}]}},
            r"rule 2 of 2 \(radius = 11.0\) selects no face .*of radius 10, 22, 27 mm",
        ),
        ({"bonds": {"inner": {"radius": 10.0}, "outer": {"radius": 10.0}}}, "have 1 face in common"),
        (
            {"bonds": {"inner": {"radius": 10.0}, "outer": [{"radius": 22.0}, {"normal": [0, 0, -1]}]}},
            r"the inner and the outer bond touch each other at \(-10, 0, -20\)",
        ),
        (
            {"bonds": {"inner": {"radius": 22.0}, "outer": {"radius": 10.0}}},
            "inner bond is farther from the axis",
        ),
    ):
        with pytest.raises(GeometryError, match=said):
            CAD(file=flanged, **wrong).interpretation  # noqa: B018


@pytest.mark.slow
def test_measures_of_spline_faces_are_exact(folder):
    """Gmsh stretches cylinders into B-splines, over which OpenCASCADE integrates with an error of up to 1 %."""

    def stretched():
        _occ().dilate([(3, ring(length=20.0))], 0, 0, 0, 1, 1, 2)

    part = CAD(file=str(draw_to(folder / "stretched.brep", stretched)))
    exact = {"rubber": np.pi * (22**2 - 10**2) * 40, "inner_bond": 2 * np.pi * 10 * 40}
    exact["outer_bond"] = 2 * np.pi * 22 * 40
    assert part.measures() == pytest.approx(exact, rel=1e-5)


def test_colours_that_are_not_used_are_named(folder):
    two, three = (CAD(file=str(make(name, folder))).notes for name in ("coloured", "three_colours"))
    assert not any("not used" in note for note in two)
    said = "colours of faces (#0000ff, #00ff00, #ff0000) were not used: there are not two of them"
    assert any(said in note for note in three)


def test_a_part_whose_file_states_a_wrong_unit_is_that_of_a_right_file(folder):
    """At 44,000 mm Gmsh made triangles without area at the voids' tips: the session has the part in mm."""
    part = CAD(file=str(make("voids_in_metres", folder)), unit="mm")
    voids = 2 * 0.6 * (18**2 - 14**2)
    assert part.measures()["rubber"] == pytest.approx((np.pi * (22**2 - 10**2) - voids) * 40)
    assert part.interpretation.size == pytest.approx(44.0)
    build(part, 3, frozenset({"y"}), part.coarse)


def test_an_element_without_volume_is_refused(folder):
    """Each facet of the boundary belongs to one element: else DOLFINx ends the process."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    cells = {"rubber": np.array([[0, 1, 2, 3]])}
    sides = np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])
    refuse_flat(RawMesh(points, TETRAHEDRON4, cells, {"free": sides}), "part.step", None)
    with pytest.raises(
        GeometryError, match=r"an element near \(0.3333, 0.3333, 0.3333\) mm .* has no volume"
    ):
        refuse_flat(RawMesh(points, TETRAHEDRON4, cells, {"free": sides[[0, 1, 2, 3, 3]]}), "part.step", None)


def test_a_block_between_two_plane_bonds_is_cut_at_its_planes_of_symmetry(folder):
    """Its bonds have no length along the axis."""
    block = CAD(
        file=str(make("box", folder)),
        axis=(0, 0, 1),
        origin=(0, 0, 0),
        bonds={"inner": {"normal": [0, 0, 1]}, "outer": {"normal": [0, 0, -1]}},
    )
    assert block.mirror_planes >= {"x", "y"}
    mesh = build(block, 3, frozenset({"x", "y"}), block.coarse)
    assert set(mesh.boundary) == {"inner", "outer", "free", "mirror_x", "mirror_y"}


def test_an_eccentric_bore_turns_about_its_own_axis(folder):
    """The curved area is mostly that of the outside, 2 mm beside the bore."""
    file = str(make("eccentric", folder))
    found = CAD(file=file)
    assert found.interpretation.frame.centre == pytest.approx((2.0, 0.0, 0.0), abs=1e-6)
    assert any("an axis of its own, 2 mm from that of most faces" in note for note in found.notes)
    given = CAD(file=file, axis=(0, 0, 1), origin=(0, 0, 0))
    assert given.interpretation.frame.centre == (0.0, 0.0, 0.0)
    assert any("the given origin is 2 mm from the inner bond's own axis" in note for note in given.notes)
    assert not any("torsion" in note for note in CAD(file=str(make("plain", folder))).notes)
    # A radius about a line beside the axis, and a box that also contains the bore.
    around = [[-23, -23, -19], [23, 23, 19]]
    ruled = CAD(file=file, bonds={"inner": {"radius": 10.0}, "outer": {"box": around}})
    assert ruled.measures() == pytest.approx(found.measures())
    assert found.measures()["inner_bond"] == pytest.approx(2 * np.pi * 10 * 40)


def test_a_radius_about_the_axis_goes_before_one_beside_it(folder):
    """Voids of the same radius are not taken for the bond."""
    void = CAD(file=str(make("one_void", folder)))
    ruled = CAD(file=void.file, bonds={"inner": {"radius": 10.0}, "outer": {"radius": 22.0}})
    assert ruled.measures() == pytest.approx(void.measures())


@pytest.mark.parametrize(
    ("order", "suffix", "version"),
    [(1, ".msh", 4.1), (2, ".msh", 4.1), (2, ".msh", 2.2), (1, ".inp", 4.1), (2, ".inp", 4.1)],
)
def test_meshes_are_taken_as_they_are(order, suffix, version, folder):
    shape = CAD(file=str(_written(folder / f"mesh{order}{suffix}", order, version=version)))
    assert shape.mirror_planes == frozenset()
    mesh = build(shape, 3)
    assert mesh_order(mesh.mesh) == order
    ds = ufl.ds(mesh.mesh, subdomain_data=mesh.facets)
    area = fem.assemble_scalar(fem.form(fem.Constant(mesh.mesh, 1.0) * ds(mesh.boundary["inner"])))
    assert area == pytest.approx(2 * np.pi * 10 * 40, rel=0.02 if order == 1 else 1e-3)
    volume = fem.assemble_scalar(fem.form(fem.Constant(mesh.mesh, 1.0) * ufl.dx(mesh.mesh)))
    assert volume == pytest.approx(np.pi * (22**2 - 10**2) * 40, rel=0.01 if order == 1 else 1e-3)


def test_a_mesh_without_bonds_is_refused(folder):
    file = _written(folder / "nobonds.msh", 1, names=("bore", "rim"))
    with pytest.raises(GeometryError, match=r'no outer facets are in a group "inner".*there are: bore, rim'):
        CAD(file=str(file)).interpretation  # noqa: B018


@pytest.mark.parametrize(
    ("rings", "said"),
    [
        (((10, 15), (16, 22)), "nothing joins the inner bond to the outer one"),
        (((10, 22), (30, 32)), "are held by no bond"),
    ],
)
def test_bodies_of_a_mesh_share_nodes(rings, said, folder):
    file = _written(folder / "loose.msh", 1, rings=rings)
    with pytest.raises(GeometryError, match=said) as error:
        CAD(file=str(file)).interpretation  # noqa: B018
    assert error.value.view is not None


def test_bonds_of_a_mesh_share_no_nodes(folder):
    file = _written(folder / "touching.msh", 1, ends="inner")
    with pytest.raises(GeometryError, match=r"bond touch each other at \(22, 0, -?20\)") as error:
        CAD(file=str(file)).interpretation  # noqa: B018
    assert error.value.view is not None


def test_measures_of_a_mesh_have_its_curved_sides(folder):
    """Flat sides of 16 elements around leave 2.6 % of a circle's area, second-order ones almost nothing."""
    flat, curved = (
        CAD(file=str(_written(folder / f"measured{order}.msh", order))).measures() for order in (1, 2)
    )
    exact = {"rubber": np.pi * (22**2 - 10**2) * 40, "inner_bond": 2 * np.pi * 10 * 40}
    for name, value in exact.items():
        assert curved[name] == pytest.approx(value, rel=1e-4)
        assert flat[name] != pytest.approx(value, rel=2e-3)


def test_a_quarter_of_a_mesh_is_refused(folder):
    file = _written(folder / "quarter.msh", 2, share=0.25)
    with pytest.raises(GeometryError, match="holds 90 of 360 degrees of a bushing"):
        CAD(file=str(file)).interpretation  # noqa: B018


@pytest.mark.parametrize("suffix", [".msh", ".inp"])
def test_elements_of_rubber_are_rubber_although_each_body_has_a_group(suffix, folder):
    """Gmsh names the elements of every volume in an .inp file (Volume1), beside the groups; these were all metal."""
    rings = ((10, 16), (16, 17), (17, 22))
    groups = {"Rubber": (0, 2), "Shim": (1,)}
    shape = CAD(file=str(_written(folder / f"shim{suffix}", 2, rings=rings, groups=groups)))
    assert shape.interpretation.regions == ("rubber", "shim")
    exact = np.pi * 40 * np.array([22**2 - 10**2 - (17**2 - 16**2), 17**2 - 16**2])
    assert [shape.measures()[name] for name in shape.interpretation.regions] == pytest.approx(exact, rel=1e-3)


def test_a_mesh_without_rubber_is_refused(folder):
    groups = {"Housing": (0,), "Shim": (1,)}
    file = _written(folder / "metal.msh", 1, rings=((10, 16), (16, 22)), groups=groups)
    with pytest.raises(GeometryError, match="all elements are in groups of metal: housing, shim"):
        CAD(file=str(file)).interpretation  # noqa: B018


def test_layers_of_one_element_are_computed(folder):
    """Every element of rubber touches a bond or metal, so none has an energy of strain gradients."""
    groups = {"Rubber": (0, 2), "Shim": (1,)}
    file = _written(folder / "thin.msh", 2, rings=((10, 16), (16, 17), (17, 22)), groups=groups)
    rubber = Rubber(laws()["neo_hookean"], {"C10": 0.5}, 2000.0)
    model = prepare(CAD(file=str(file)), modes()["torsional"], rubber)
    assert model.surfaces.gradient.unknowns.shape == (0, 30)
    # Two rings in simple shear, one after the other: 4 pi mu L / (1/a^2 - 1/b^2) each.
    springs = [4 * np.pi * 40 / (a**-2 - b**-2) for a, b in ((10, 16), (17, 22))]
    moment = march(model, Program(np.array([0.02]))).force[-1]
    assert moment == pytest.approx(0.02 / sum(1 / k for k in springs), rel=0.01)


def _written(
    file,
    order,
    names=("inner", "outer"),
    version=4.1,
    rings=((10, 22),),
    share=1.0,
    ends=None,
    groups=None,
):
    import gmsh

    from tests.parts import quarter, ring

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.model.add("mesh")
        bodies = [ring(*radii) for radii in rings] if share == 1.0 else [quarter()]
        gmsh.model.occ.synchronize()
        if groups is not None:  # touching rings, of which each is a body of its own
            _occ().fragment([(3, bodies[0])], [(3, body) for body in bodies[1:]])
            _occ().synchronize()
            bodies = sorted((tag for _, tag in gmsh.model.getEntities(3)), key=_reach)
        # The faces at 10 and 22 mm have these areas.
        areas = {name: share * 2 * np.pi * r * 40 for name, r in zip(names, (10, 22), strict=True)}
        faces_of = {name: [] for name in areas}
        for _, face in gmsh.model.getEntities(2):
            if ends is not None and gmsh.model.getType(2, face) == "Plane":
                faces_of[ends].append(face)
            for name, area in areas.items():
                if gmsh.model.getType(2, face) == "Cylinder" and gmsh.model.occ.getMass(
                    2, face
                ) == pytest.approx(area):
                    faces_of[name].append(face)
        for name, faces in faces_of.items():
            if faces:
                gmsh.model.addPhysicalGroup(2, faces, name=name)
        for name, members in (groups or {"rubber": range(len(bodies))}).items():
            gmsh.model.addPhysicalGroup(3, [bodies[i] for i in members], name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 6.0)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 16)
        gmsh.option.setNumber("Mesh.SaveGroupsOfNodes", 1)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(str(file))
    finally:
        gmsh.finalize()
    return file


def _reach(body):
    import gmsh

    return gmsh.model.getBoundingBox(3, body)[3]


def test_a_part_of_very_many_faces_is_refused_before_it_takes_minutes(folder, monkeypatch):
    monkeypatch.setattr("geometry.isolated._reader", None)
    monkeypatch.setattr("geometry.cad.find_part.MOST_FACES", 3)
    with pytest.raises(GeometryError, match="solids have 4 faces, of which at most 3 are interpreted"):
        CAD(file=str(make("plain", folder).rename(folder / "many.step"))).notes  # noqa: B018
