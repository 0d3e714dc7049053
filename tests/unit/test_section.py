"""Sections: outlines in case files and drawings, and the messages with which invalid ones are refused."""

from __future__ import annotations

import ezdxf
import ezdxf.path
import numpy as np
import pytest
from dolfinx.mesh import compute_midpoints
from scipy.interpolate import BSpline

from geometry.errors import GeometryError
from geometry.mesh import build
from geometry.shape import shapes

SECTION = shapes()["section"]
RING = [
    {"from": [10.0, -20.0], "to": [20.0, -20.0]},
    {"to": [20.0, 20.0], "name": "outer"},
    {"to": [10.0, 20.0]},
    {"to": [10.0, -20.0], "name": "inner"},
]


def without(edge, **changed):
    """Return the ring with one edge changed."""
    return [item | changed if i == edge else item for i, item in enumerate(RING)]


def box(low, high, bottom, top, left="free", right="free"):
    """Return the outline of a rectangle."""
    return [
        {"from": [low, bottom], "to": [high, bottom]},
        {"to": [high, top], "name": right},
        {"to": [low, top]},
        {"to": [low, bottom], "name": left},
    ]


@pytest.mark.parametrize(
    ("outline", "said"),
    [
        (RING[:3], r"the outline is open: it begins at \(10, -20\) and ends at \(10, 20\), 40 mm apart"),
        (
            without(2, **{"from": [15.0, 20.0]}),
            r"outline\[2\]: the outline has a gap of 5 mm between \(20, 20\)",
        ),
        (without(0, **{"from": None}), r"outline\[0\]: begins a new outline and has no `from`"),
        (without(1, to=[20.0, -20.0]), r"outline\[1\]: has no length: it begins and ends at \(20, -20\)"),
        (without(2, arc_through=[15, 18], spline_through=[[15, 18]]), "is given as an arc and as a spline"),
        (without(3, name="free"), 'no edge on the outside is named "inner"'),
        (without(2, name="inner"), r"the inner and the outer bond touch each other at \(20, 20\)"),
        (without(3, name="iner"), 'the name "iner" is given to 1 row of edges'),
        (
            [{"from": [10, -20], "to": [20, 20]}, {"to": [20, -20], "name": "outer"}, *RING[2:]],
            "crosses itself at",
        ),
        (without(2, to=[-10.0, 20.0]), "has a negative radius at"),
        ([*RING, *box(14, 20, -5, 5)], r'two outlines of "rubber" overlap near \(17, 0\)'),
        ([*RING, *box(14, 22, -5, 5)], r'two outlines of "rubber" overlap near \(17, 0\)'),
        (
            [*RING, *box(12, 18, -9, 9), *box(14, 15, -2, 2)],
            'a body of "rubber" is held by no bond.*gap is 2 mm',
        ),
        ([*RING, *box(12, 14, 30, 34)], 'a body of "rubber" is held by no bond.*gap is 10 mm'),
        (
            [*box(10, 14, -20, 20, left="inner"), *box(16, 20, -20, 20, right="outer")],
            r"nothing joins the inner bond to the outer one; the narrowest gap is 2 mm",
        ),
    ],
)
def test_what_is_no_section_is_refused(outline, said):
    with pytest.raises(GeometryError, match=said):
        SECTION.model_validate({"outline": outline}).interpretation  # noqa: B018 - asking is the test


def test_measures_are_those_of_the_ring():
    found = SECTION(outline=RING).interpretation
    assert found.symmetric
    assert found.regions == ("rubber",)
    assert found.measures["rubber"] == pytest.approx(np.pi * (20**2 - 10**2) * 40)
    assert found.measures["inner_bond"] == pytest.approx(2 * np.pi * 10 * 40)
    # A straight "arc" is a line, and the area of a square hole does not count as rubber.
    square = [
        {"from": [13.0, -2.0], "to": [17.0, -2.0]},
        {"to": [17.0, 2.0], "arc_through": [17.0, 0.0]},
        {"to": [13.0, 2.0]},
        {"to": [13.0, -2.0]},
    ]
    holed = SECTION(outline=[*RING, *square]).interpretation
    assert holed.measures["rubber"] == pytest.approx(np.pi * (20**2 - 10**2) * 40 - 2 * np.pi * 15 * 16)
    assert holed.symmetric


def test_the_centre_is_the_middle_of_the_inner_bond_or_given():
    shifted = [
        {k: [v[0], v[1] + 7.0] if k in ("from", "to") else v for k, v in edge.items()} for edge in RING
    ]
    found = SECTION(outline=shifted).interpretation
    assert (found.centre, found.symmetric) == (7.0, True)
    assert not SECTION(outline=shifted, centre=6.0).interpretation.symmetric


def test_four_sides_make_quadrilaterals_and_others_triangles():
    assert build(SECTION(outline=RING), 2).simplices is False
    assert build(SECTION(**SECTION.examples[1]), 2).simplices
    assert build(SECTION(**SECTION.examples[1]), 3, frozenset("y")).simplices is False


@pytest.mark.parametrize("length", [40.0, 12.0])
def test_bonds_are_where_the_outline_has_them(length):
    """A symmetric section is meshed by halves, also when revolved; the inner bond must be at the inner radius."""
    half = length / 2
    outline = [
        {"from": [10.0, -half], "to": [20.0, -half]},
        {"to": [20.0, half], "name": "outer"},
        {"to": [10.0, half]},
        {"to": [10.0, -half], "name": "inner"},
    ]
    for dimension, mirrors in ((2, ""), (3, "yz"), (3, "y")):
        mesh = build(SECTION(outline=outline), dimension, frozenset(mirrors))
        for name, radius in (("inner", 10.0), ("outer", 20.0)):
            facets = mesh.facets.find(mesh.boundary[name])
            x = compute_midpoints(mesh.mesh, dimension - 1, facets)
            across = x[:, 0] if dimension == 2 else np.hypot(x[:, 0], x[:, 1])
            # Facets around the axis are curved, 30 degrees each, so that the mean of their corners lies nearer to the
            # axis.
            assert across == pytest.approx(radius, rel=0.05), (name, dimension, mirrors)


def test_metal_is_given_to_what_is_there():
    plate = SECTION.examples[2]["outline"]
    section = SECTION(outline=plate, plates={"plate": {"youngs_modulus": 70000.0}})
    assert section.elastic_sleeves["plate"].youngs_modulus == 70000.0
    assert "plate (metal, E = 70000 MPa)" in section.notes[0]
    stiff = SECTION(outline=plate, plates={"plate": {"rigid": True}})
    assert "plate (rigid, computed with E = 1e+07 MPa)" in stiff.notes[0]
    assert stiff.view.captions["plate"].startswith("plate, rigid, ")
    with pytest.raises(GeometryError, match='there is no plate or sleeve "plat"'):
        SECTION(outline=plate, plates={"plat": {"rigid": True}}).notes  # noqa: B018


def test_a_section_on_the_axis_is_computed_in_the_half_plane_only():
    mount = [
        {"from": [0.0, -10.0], "to": [20.0, -10.0], "name": "outer"},
        {"to": [20.0, 10.0]},
        {"to": [0.0, 10.0], "name": "inner"},
        {"to": [0.0, -10.0]},
    ]
    assert build(SECTION(outline=mount), 2).boundary
    with pytest.raises(GeometryError, match="touches the axis"):
        build(SECTION(outline=mount), 3)


def drawing(path, unit=4, gap=0.0, layer="outer"):
    """Write a ring with rounded corners as a polyline, lines, an arc, a spline and an ellipse."""
    document = ezdxf.new()
    document.header["$INSUNITS"] = unit
    space = document.modelspace()
    space.add_line((10, 20), (10, -20), dxfattribs={"layer": "inner"})
    space.add_lwpolyline([(10, -20), (15, -20, 0, 0, -0.1), (20, -19)], dxfattribs={"layer": "0"})
    space.add_line((20 + gap, -19), (20, 18), dxfattribs={"layer": layer})
    space.add_ellipse((18, 18), (2, 0), 1.0, 0.0, np.pi / 2, dxfattribs={"layer": "free"})
    space.add_spline([(18, 20), (14, 19.5), (10, 20)], dxfattribs={"layer": "free"})
    document.saveas(path)
    return str(path)


def test_a_drawing_is_read_with_layers_as_names(tmp_path):
    shape = SECTION(file=drawing(tmp_path / "part.dxf"))
    assert shape.interpretation.measures["inner_bond"] == pytest.approx(2 * np.pi * 10 * 40)
    assert shape.interpretation.measures["outer_bond"] == pytest.approx(2 * np.pi * 20 * 37)
    assert build(shape, 2).boundary.keys() == {"inner", "outer", "free"}
    inches = SECTION(file=drawing(tmp_path / "inches.dxf", unit=1))
    assert inches.interpretation.measures["rubber"] == pytest.approx(
        25.4**3 * shape.interpretation.measures["rubber"]
    )
    assert "the file states the unit of length mm" in shape.notes
    assert "the file states the unit of length inch" in inches.notes
    assert "the file states the unit of length inch" in SECTION(file=inches.file, unit="mm").notes


@pytest.mark.parametrize("number", [0, 13])
def test_the_case_gives_the_unit_of_a_drawing_that_states_none_or_a_wrong_one(tmp_path, number):
    path = drawing(tmp_path / "part.dxf", unit=number)
    inches = SECTION(file=path, unit="inch")
    assert inches.interpretation.measures["inner_bond"] == pytest.approx(2 * np.pi * 10 * 40 * 25.4**2)
    assert not [note for note in inches.notes if "unit" in note]


def test_a_drawing_without_a_unit_is_in_mm_and_a_note_says_so(tmp_path):
    shape = SECTION(file=drawing(tmp_path / "part.dxf", unit=0))
    assert shape.interpretation.measures["inner_bond"] == pytest.approx(2 * np.pi * 10 * 40)
    assert [note for note in shape.notes if "states no unit" in note]
    assert not [note for note in SECTION(outline=RING).notes if "unit" in note]


@pytest.mark.parametrize("beyond", [0.0, 2.0])
@pytest.mark.parametrize("layers", [("outer", "core", "inner", "0"), ("inner", "0", "outer", "core")])
def test_a_sleeve_is_drawn_with_its_bore_on_a_layer_of_its_own(tmp_path, layers, beyond):
    """The order of a drawing's curves is arbitrary; corners of sleeve and rubber coincide if it is not longer."""
    end = 20.0 + beyond
    lines = [("outer", (20, -20), (20, 20)), ("inner", (8, -end), (8, end))]
    lines += [("0", (10, -20), (20, -20)), ("0", (20, 20), (10, 20)), ("0", (10, 20), (10, -20))]
    lines += [("core", (8, -end), (10, -end)), ("core", (10, end), (8, end)), ("core", (10, -end), (10, end))]
    document = ezdxf.new(units=4)
    for name, start, to in sorted(lines, key=lambda line: layers.index(line[0])):
        document.modelspace().add_line(start, to, dxfattribs={"layer": name})
    document.saveas(tmp_path / "part.dxf")
    shape = SECTION(file=str(tmp_path / "part.dxf"), plates={"core": {"youngs_modulus": 70000.0}})
    assert shape.elastic_sleeves["core"].youngs_modulus == 70000.0
    measures = shape.interpretation.measures
    assert measures["rubber"] == pytest.approx(np.pi * (20**2 - 10**2) * 40)
    assert measures["core"] == pytest.approx(np.pi * (10**2 - 8**2) * 2 * end)
    assert measures["inner_bond"] == pytest.approx(2 * np.pi * 8 * 2 * end)


def test_rubber_whose_free_edges_have_a_name_is_refused_with_the_remedy():
    named = [edge if "name" in edge else edge | {"name": "gummi"} for edge in RING]
    with pytest.raises(GeometryError, match=r'there is no rubber.*no name, or "free", for the free edges'):
        SECTION(outline=named).interpretation  # noqa: B018


def test_a_unit_without_a_drawing_is_refused():
    with pytest.raises(ValueError, match="unit belongs to a file"):
        SECTION(outline=RING, unit="inch")


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"gap": 0.5}, r"an outline is open at \(20"),
        ({"unit": 13}, "has unit number 13"),
        ({"layer": "outside"}, 'the name "outside" is given to 1 row of edges'),
    ],
)
def test_a_drawing_that_is_no_section_is_refused(tmp_path, changed, said):
    with pytest.raises(GeometryError, match=said):
        SECTION(file=drawing(tmp_path / "part.dxf", **changed)).interpretation  # noqa: B018


def test_a_file_that_is_no_drawing_is_refused(tmp_path):
    file = tmp_path / "part.dxf"
    file.write_text("no drawing\n")
    with pytest.raises(GeometryError, match="DXF"):
        SECTION(file=str(file)).interpretation  # noqa: B018


def with_void(path, draw):
    """Write a ring 10/20/40 with what `draw` adds to the drawing's space."""
    document = ezdxf.new()
    document.header["$INSUNITS"] = 4
    space = document.modelspace()
    corners = [(10, 20), (10, -20), (20, -20), (20, 20)]
    for i, name in enumerate(("INNER", "0", "Outer", "0")):
        space.add_line(corners[i], corners[(i + 1) % 4], dxfattribs={"layer": name})
    draw(document, space)
    document.saveas(path)
    return SECTION(file=str(path)).interpretation.measures["rubber"]


DIAMOND = [(13, -12), (15, -10), (17, -12), (15, -14)]


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("kind", ["spline", "closed control polygon", "ellipse", "block"])
def test_a_closed_curve_is_a_hole(tmp_path, kind, turn):
    """Splines by themselves and in blocks, whichever way they run; their areas are those of a fine polygon."""

    def draw(document, space):
        points = DIAMOND[::turn]
        if kind == "spline":
            space.add_spline([*points, points[0]])
        elif kind == "closed control polygon":
            space.add_spline().set_closed([(*point, 0) for point in points])
        elif kind == "ellipse":
            space.add_ellipse((15, -12), (2, 0), 0.5)
        else:
            block = document.blocks.new("void")
            block.add_lwpolyline(points, close=True)
            space.add_blockref("void", (0, 0))

    document = ezdxf.new()
    draw(document, document.modelspace())
    (entity,) = (
        one
        for item in document.modelspace()
        for one in (item.virtual_entities() if item.dxftype() == "INSERT" else [item])
    )
    r, z = path_of(entity).T
    cross = r * np.roll(z, -1) - np.roll(r, -1) * z
    area = 0.5 * abs(cross.sum())
    centre = ((r + np.roll(r, -1)) * cross).sum() / (6 * 0.5 * cross.sum())
    whole = np.pi * (20**2 - 10**2) * 40
    assert with_void(tmp_path / "void.dxf", draw) == pytest.approx(
        whole - 2 * np.pi * centre * area, rel=2e-5
    )


def path_of(entity):
    """Return points of a curve, shape (n, 2)."""
    if entity.dxftype() == "SPLINE":
        # By de Boor's formula: ezdxf's paths of splines that are not clamped leave the curve.
        tool = entity.construction_tool()
        knots, control = np.array(tool.knots()), np.array([(p.x, p.y) for p in tool.control_points])
        domain = np.linspace(knots[tool.degree], knots[-1 - tool.degree], 4000, endpoint=False)
        return BSpline(knots, control, tool.degree)(domain)
    return np.array([(p.x, p.y) for p in ezdxf.path.make_path(entity).flattening(1e-4)][:-1])


def test_hidden_layers_are_left_out_and_open_ones_named(tmp_path):
    def hidden(document, space):
        document.layers.add("notes").off()
        space.add_line((0, -40), (0, 40), dxfattribs={"layer": "notes"})

    assert with_void(tmp_path / "hidden.dxf", hidden) == pytest.approx(np.pi * (20**2 - 10**2) * 40)

    def centre(document, space):
        space.add_line((0, -40), (0, 40), dxfattribs={"layer": "CENTER"})

    with pytest.raises(GeometryError, match=r'1 curve of "CENTER" in no closed outline'):
        with_void(tmp_path / "centre.dxf", centre)


def test_a_damaged_drawing_is_refused(tmp_path):
    file = tmp_path / "part.dxf"
    file.write_bytes(b"AutoCAD Binary DXF\r\n\x1a\x00" + bytes(range(200)))
    with pytest.raises(GeometryError, match="DXF"):
        SECTION(file=str(file)).interpretation  # noqa: B018


def test_a_plate_on_a_layer_of_its_own_has_its_volume_not_the_area_of_its_edges(tmp_path):
    corners = [(14, 12), (14, -12), (16, -12), (16, 12)]

    def draw(_document, space):
        space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "ring"})

    with_void(tmp_path / "part.dxf", draw)
    found = SECTION(file=str(tmp_path / "part.dxf"), plates={"ring": {}}).interpretation
    assert found.measures["ring"] == pytest.approx(np.pi * (16**2 - 14**2) * 24)
