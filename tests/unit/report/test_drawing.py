"""Plots drawn with Matplotlib and as SVG, and pictures of bodies: valid files, thinned curves, faces in their place."""

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.text import Text as MplText

from bushcli.report.document import Note, Panels, Plot, Region, Series, Stripe
from bushcli.report.drawing import projection
from bushcli.report.drawing.body import _Drawing, deformed_figure
from bushcli.report.drawing.bushing_map import map_figure
from bushcli.report.drawing.looks import LOOKS, style_sheet
from bushcli.report.drawing.picture import draw_panels, style
from bushcli.report.drawing.preparation import MOST, pane, position, prepare, thin_curve, ticks
from bushcli.report.drawing.results import diagnosis_pictures, direct_pictures, mesh_pictures
from bushcli.report.drawing.results import pictures_of as pictures_of
from bushcli.report.drawing.zoom import figure, svg
from bushcli.report.plots.diagnosis import curve_plot
from bushcli.report.plots.places import ring_cells
from bushcli.report.writers.tables import map_vtu
from bushcli.simulate.meshes import Meshed
from cases.stretches import Surface, mesh_surface
from geometry.mesh import build
from geometry.shape import Refinement, shapes

PARTS = Path(__file__).parents[2] / "verification" / "data" / "real"
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture
def drawn(answer, channel):
    def make(*channels, fit=None, title="a bushing"):
        found = answer(*(channels or (channel("axial", 130.0, 100.0),)), title=title, fit=fit)
        names = {c.name: c.name for c in found.response.channels}
        return {p.name: p for p in pictures_of(direct_pictures(found, names))}

    return make


def cube():
    """The six faces of a cube of 2 mm around (10, 0, 0)."""
    corners = np.array([[x, y, z] for x in (9.0, 11.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    # Counter-clockwise seen from outside.
    index = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = corners[np.array(index)]
    return Surface(faces, faces, np.ones((6, 4)), np.full(6, True), 0.0)


def test_every_picture_is_a_png_and_an_svg(drawn, fit):
    pictures = drawn(fit=fit)
    assert set(pictures) == {"axial-curve", "coupons", "axial-deformed", "axial-mesh"}
    for picture in pictures.values():
        assert picture.png.startswith(PNG)
        assert ET.fromstring(picture.svg).tag.endswith("svg")


def test_titles_say_what_is_seen(drawn, fit):
    pictures = drawn(fit=fit)
    assert pictures["axial-curve"].title == "Axial: simulation 30 % too stiff"
    assert pictures["coupons"].title == "yeoh fitted to 3 coupon tests: 20 % rms at worst"
    assert pictures["axial-deformed"].title == "Axial: deformed at 2 mm"


def test_channels_on_the_same_mesh_share_its_picture(drawn, channel):
    pictures = drawn(channel("axial"), channel("torsional"))
    assert [name for name in pictures if name.endswith("mesh")] == ["axial-mesh"]
    assert pictures["axial-mesh"].title == "Mesh for axial and torsional"


def test_other_ranks_draw_no_bodies(drawn, channel):
    assert set(drawn(channel("axial", surface=None))) == {"axial-curve"}


def test_dollar_signs_and_other_scripts_are_drawn_as_they_stand(drawn, channel):
    pictures = drawn(channel("axial", 130.0, 100.0, name=r"$\frac{ 試験 $5"))
    assert pictures[r"$\frac{ 試験 $5-curve"].png.startswith(PNG)


def test_the_same_result_gives_the_same_file(drawn):
    first, second = drawn(), drawn()
    assert all(first[name].svg == second[name].svg and first[name].png == second[name].png for name in first)


def test_meshes_have_pictures(ring, case):
    mesh = Meshed("section", ("axial",), 2, 2, 6, {}, {}, ring)
    assert [picture.name for picture in mesh_pictures(case().geometry, [mesh])] == ["mesh-section"]


def test_faces_between_points_of_a_circle_follow_it():
    angle = np.radians([150.0, 210.0])  # across the jump of the angle
    a, b = ([9 * np.cos(t), 9 * np.sin(t), 0.0] for t in angle)
    face = np.array([[a, b, [b[0], b[1], 5.0], [a[0], a[1], 5.0]]])
    surface = Surface(face, face, np.ones((1, 4)), np.array([True]), 0.0)
    grid = projection.lattice(surface, face + np.array([1.0, 0.0, 0.0]), 4)
    assert grid.shape == (1, 5, 5, 3)
    assert np.hypot(grid[..., 0] - 1.0, grid[..., 1]) == pytest.approx(9.0)


def test_cells_cover_a_face_and_sides_bound_it():
    square = np.array([[[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 1.0, 1.0], [0.0, 1.0, 1.0]]])
    grid = projection.bilinear(square, 3)
    cells = projection.cells(grid)
    area = np.cross(cells[:, 2] - cells[:, 0], cells[:, 3] - cells[:, 1])[:, 2] / 2
    assert area.sum() == pytest.approx(2.0)
    assert (area > 0).all()
    sides = projection.sides(grid)
    assert sides[:, [0, -1]] == pytest.approx(projection.face_edges(square))
    # The cell beside each segment touches it.
    beside = projection.sides(np.arange(9).reshape(1, 3, 3)).ravel()
    for segment, cell in zip(projection.segments(sides), beside, strict=True):
        assert all(any(np.allclose(end, corner) for corner in cells[cell]) for end in segment)


def test_the_outline_of_a_cube_is_its_edges():
    surface = cube()
    bold = projection.outline(surface)
    assert bold.all()
    assert len(projection.once(projection.face_edges(surface.reference))) == 12


def test_an_edge_within_a_plane_is_no_outline():
    left = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]])
    faces = np.stack([left, left + np.array([1.0, 0.0, 0.0])])
    flat = Surface(faces, faces, np.ones((2, 4)), np.array([True, True]), 0.0)
    assert projection.outline(flat).sum() == 6  # of 8 sides, the shared one counted twice
    parted = Surface(faces, faces, np.ones((2, 4)), np.array([True, False]), 0.0)
    assert projection.outline(parted).all()


def test_nearer_faces_are_deeper_towards_the_eye():
    view = projection.view_from(np.array([0.0, -1.0, 0.5]))
    assert view.depth(np.array([0.0, -5.0, 0.0])) > view.depth(np.array([0.0, 5.0, 0.0]))
    axes = np.array([view.right, view.up, view.towards])
    assert axes @ axes.T == pytest.approx(np.eye(3))
    assert np.linalg.det(axes) == pytest.approx(1.0)


@pytest.mark.parametrize(("side", "sign"), [((0.0, 8.0), -1.0), ((-8.0, 0.0), 1.0)])
def test_a_cut_model_is_seen_from_its_cut(side, sign):
    points = np.array([[-8.0, side[0], 0.0], [8.0, side[0], 1.0], [8.0, side[1], 1.0], [-8.0, side[1], 0.0]])
    assert np.sign(projection.cut_view(points[None]).towards[1]) == sign


def test_a_revolved_section_is_a_ring_with_a_quarter_left_open(ring):
    body = projection.body_of_revolution(ring)
    angle = np.degrees(np.arctan2(body.reference[..., 1], body.reference[..., 0])) % 360
    assert angle.max() == pytest.approx(270.0)
    assert np.hypot(body.reference[..., 0], body.reference[..., 1]).max() == pytest.approx(18.0)
    # 8 bounding sides in 18 steps of 15 degrees, and three faces at either end.
    assert len(body.reference) == 8 * 18 + 2 * 3


def test_a_twisted_section_is_drawn(ring):
    r, z, phi = ring.reference[..., 0], ring.reference[..., 2], 0.3
    twisted = Surface(
        ring.reference,
        np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1),
        ring.stretch,
        ring.rubber,
        phi,
    )
    assert projection.is_twisted(twisted)
    assert not projection.is_twisted(ring)
    assert len(deformed_figure(twisted, "twisted").axes) == 2


def test_dashes_cover_half_of_a_line():
    line = np.array([[[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [10.0, 0.0, 0.0]]])
    found = projection.dashes(line, 1.0)
    assert np.linalg.norm(found[:, 1] - found[:, 0], axis=1) == pytest.approx(10 / 11)
    assert len(found) == 6


def drawn_surface(surface, closed):
    """Picture of a body, as pixels, and how many polygons it is made of."""
    with style():
        view = projection.cut_view(surface.reference)
        figure = _Drawing(surface, surface.reference, view, None, closed=closed).figure("a body", "")
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba(), dtype=float), len(figure.axes[0].collections[0].get_paths())


def test_what_lies_behind_a_body_is_left_out_and_not_missed():
    shown, few = drawn_surface(cube(), closed=True)
    all_of_it, many = drawn_surface(cube(), closed=False)
    assert few == many / 2
    # Only smoothed pixels along the silhouette differ.
    assert (np.abs(shown - all_of_it).max(axis=-1) > 20).mean() < 0.005


RING = shapes()["plain"](inner_radius=10, outer_radius=20, length=30)
KIDNEY = shapes()["cad"](file=str(PARTS / "kidney_A.step"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "mirrors"), [(RING, "yz"), (KIDNEY, "yz")], ids=["hexahedra", "tetrahedra"]
)
def test_faces_of_a_solid_are_counter_clockwise_from_outside(shape, mirrors):
    surface = mesh_surface(build(shape, 3, frozenset(mirrors), Refinement(across=2)))
    a, b, c, d = np.moveaxis(surface.reference, 1, 0)
    # Gauss: the volume from the oriented faces; a quadrilateral is the mean of its two pairs of triangles.
    parts = [(a, b, c), (a, c, d), (a, b, d), (b, c, d)]
    weights = (0.5, 0.5, 0.5, 0.5) if shape is RING else (1.0, 0.0, 0.0, 0.0)
    volume = sum(
        w * np.einsum("ij,ij->", p, np.cross(q, r)) / 6 for w, (p, q, r) in zip(weights, parts, strict=True)
    )
    # Chords instead of arcs: a coarse mesh lacks some percent.
    assert 4 * volume == pytest.approx(shape.measures()["rubber"], rel=0.05)


# -- maps of the bushing -----------------------------------------------------------------------------------------------


def painted(one):
    """Return the collection that has the faces of a map."""
    (drawn,) = (c for c in map_figure(one).axes[0].collections if isinstance(c, PolyCollection))
    return drawn


def test_maps_on_triangles_and_tetrahedra_are_drawn_and_written(diagnoses):
    """The cells of sections and CAD parts: here a unit square and a unit cube, cut into simplices."""
    square, cube = diagnoses.half_plane(across=1, along=1), diagnoses.solid()
    corners = np.array([(x, y, z) for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
    # Six tetrahedra around the diagonal from corner 0 to corner 7.
    tets = np.array(
        [(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)], dtype=int
    )
    flat = replace(
        square, points=corners[:4, :2], cells=np.array([(0, 1, 2), (1, 3, 2)]), factor=np.array([0.1, -0.1])
    )
    solid = replace(cube, points=corners, cells=tets, factor=np.linspace(-0.2, 0.2, 6))
    # Three faces of the cube are turned towards the eye.
    for one, faces, kind in ((flat, 2 * 2, 5), (solid, 3 * 2, 10)):
        filled = painted(one).get_facecolors()[:, 3] > 0
        # Nine edges of the cube are seen, as lines.
        assert (filled.sum(), (~filled).sum()) == (faces, 0 if one is flat else 9)
        root = ET.fromstring(map_vtu(one))
        arrays = {a.get("Name"): np.array(a.text.split(), dtype=float) for a in root.iter("DataArray")}
        assert (arrays["types"] == kind).all()
        assert np.array_equal(arrays["connectivity"].reshape(one.cells.shape), one.cells)


@pytest.mark.slow
def test_a_channel_without_places_in_its_record_has_no_picture_of_them(case, diagnoses):
    """For example a channel that is held out."""
    found = diagnoses.diagnosis(case(), "missing_physics")
    names = {one.name: one.name for one in (*found.channels, *found.maps)}
    assert any(one.kind == "record_map" for one in diagnosis_pictures(found, names))
    bare = replace(found, location=replace(found.location, bins=()))
    assert not any(one.kind == "record_map" for one in diagnosis_pictures(bare, names))


@pytest.mark.parametrize("made", ["half_plane", "solid"])
def test_both_numberings_of_corners_are_understood(diagnoses, made):
    tensor = getattr(diagnoses, made)()
    order = [0, 1, 3, 2] if made == "half_plane" else [0, 1, 3, 2, 4, 5, 7, 6]
    ring = replace(tensor, cells=tensor.cells[:, order])
    for corners in (ring_cells(tensor), ring_cells(ring)):
        assert corners.tolist() == ring.cells.tolist()
    # Both give the same file, because VTK has one numbering.
    assert map_vtu(tensor) == map_vtu(ring)


@pytest.mark.parametrize(
    "names", [("axial",), ("axial", "radial"), ("axial", "radial", "torsional", "conical")], ids=len
)
def test_the_title_of_a_map_fits_its_picture(diagnoses, names):
    one = replace(diagnoses.half_plane(across=2, along=2, names=names), helps_locally=False)
    figure = map_figure(one)
    figure.draw_without_rendering()
    title = figure.axes[0].get_children()
    boxes = [t.get_window_extent() for t in title if isinstance(t, MplText) and names[0] in t.get_text()]
    assert len(boxes) == 1
    assert boxes[0].x1 <= figure.bbox.x1


def test_a_map_that_asks_for_nothing_is_pale(diagnoses):
    one = diagnoses.half_plane()
    nothing = replace(one, factor=1e-3 * one.factor / np.abs(one.factor).max())
    (drawn,) = (c for c in map_figure(nothing).axes[0].collections if isinstance(c, PolyCollection))
    # The scale ends at 2 %, although the map's largest change is a tenth of a per cent.
    assert np.ptp(drawn.get_facecolors()[:, :3]) < 0.15


def test_a_map_is_a_file_for_paraview(diagnoses):
    one = diagnoses.solid()
    root = ET.fromstring(map_vtu(one))
    arrays = {a.get("Name"): np.array(a.text.split(), dtype=float) for a in root.iter("DataArray")}
    points = arrays["points"].reshape(-1, 3)
    cells = arrays["connectivity"].astype(int).reshape(-1, 8)
    assert np.allclose(arrays["stiffness_change"], one.factor)
    assert (arrays["types"] == 12).all()
    # VTK's hexahedron: corners 0 to 3 go round the base, and corner 4 is above corner 0.
    x = points[cells]
    base = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])[:, 2] / 2
    volume = base * (x[:, 4] - x[:, 0])[:, 2]
    # Half a ring of 24 chords: 24/2 sin(pi/24) (18^2 - 9^2) 34 mm^3; no cell is inverted.
    assert volume.sum() == pytest.approx(12 * np.sin(np.pi / 24) * (18**2 - 9**2) * 34)
    assert (volume > 0).all()


def test_a_section_is_mirrored_and_a_solid_shows_what_is_turned_to_the_eye(diagnoses):
    section, half = diagnoses.half_plane(), diagnoses.solid()
    # Of the half the inside but for two of 24 faces around, where the outside is seen; one end; two cuts at y = 0.
    for one, faces in ((section, 2 * 8 * 20), (half, 24 * 8 + 24 * 4 + 2 * 4 * 8)):
        assert (painted(one).get_facecolors()[:, 3] > 0).sum() == faces


def test_a_whole_body_is_cut_in_a_plane(diagnoses):
    """The cut is straight whatever the cells: no part of it lies before the plane beside y = 0."""
    one = diagnoses.solid(whole=True)
    turned = np.array([[np.cos(0.1), np.sin(0.1), 0.0], [-np.sin(0.1), np.cos(0.1), 0.0], [0.0, 0.0, 1.0]])
    one = replace(one, points=one.points @ turned)
    view = projection.cut_view(one.points[one.points[:, 1] >= 0.0][None])
    shown = np.concatenate([path.vertices for path in painted(one).get_paths()])
    # To the right of the axis the cut is the lowest part of the picture: the plane y = 0 at the lower end.
    low = one.points[:, 2].min()
    radius = np.hypot(*one.points[:, :2].T).max()
    corner = view.project(np.array([[radius, 0.0, low], [-radius, 0.0, low]]))
    assert shown[:, 1].min() >= corner[:, 1].min() - 0.1


def test_colours_of_a_map_say_softer_and_stiffer(diagnoses):
    one = replace(diagnoses.half_plane(), helps_locally=True)
    softer = painted(one).get_facecolors()[int(np.argmin(one.factor))]
    assert softer[0] > 1.3 * softer[2]  # orange, as everywhere where the model is too stiff
    pale = painted(replace(one, helps_locally=False)).get_facecolors()
    # Colours fade where no place is significant.
    assert np.ptp(pale[:, :3]) < 0.4 * np.ptp(painted(one).get_facecolors()[:, :3])


def test_a_tetrahedron_is_cut_in_triangles_and_quadrilaterals():
    corners = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]])
    x = np.eye(3)[0]
    (triangle,), _ = projection.cut(corners, x, 0.25, above=False)
    area = np.linalg.norm(np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])) / 2
    assert area == pytest.approx(0.75**2 / 2)
    assert triangle[:, 0] == pytest.approx(0.25)
    quadrilateral, _ = projection.cut(corners, np.array([1.0, 1.0, 0.0]) / np.sqrt(2), 0.3, above=False)
    assert len(np.unique(quadrilateral.round(9), axis=1)[0]) == 4


@pytest.mark.parametrize("level", [-0.5, 0.2, 0.5, 0.8, 2.0])
def test_what_lies_above_a_plane_keeps_its_area(level):
    triangle = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    kept, owner = projection.cut(triangle, np.eye(3)[0], level, above=True)
    area = np.linalg.norm(np.cross(kept[:, 1] - kept[:, 0], kept[:, 2] - kept[:, 0]), axis=1).sum() / 2
    assert area == pytest.approx((1 - min(max(level, 0.0), 1.0)) ** 2 / 2)
    assert (kept[..., 0] >= level - 1e-12).all()
    assert set(owner) <= {0}


# -- plots -------------------------------------------------------------------------------------------------------------


def everything(**changes):
    """A plot with one of each that can be drawn."""
    x = np.linspace(0.0, 10.0, 11)
    given = {
        "series": [
            Series("recorded", "<b>recorded", x, x**2),
            Series("after", "model", x, x**2 + 5.0, "both", error=np.ones(11)),
            Series("left_out", "left out", x[3:4], x[3:4], "crosses"),
        ],
        "regions": [
            Region(
                "soft",
                "too soft",
                [np.array([(1.0, 0.0), (2.0, 0.0), (2.0, 50.0)])],
                1,
                np.array([(1.5, 20.0)]),
            ),
            Region("tolerance", "accepted", [np.array([(0.0, 0.0), (10.0, 90.0), (10.0, 110.0)])]),
        ],
        "bands": [
            Stripe("noise", y=(-5.0, 5.0), label="noise"),
            Stripe("limit", x=(9.0, 9.0), label="limit"),
        ],
        "notes": [Note("a & b", (5.0, 25.0))],
    }
    return Plot("all", ("x", "y"), **given | changes)


def test_both_drawings_show_the_same_plot():
    shown = ET.fromstring(svg(everything()))
    keys = [e.text or "".join(e.itertext()) for e in shown.iter("button") if "key" in (e.get("class") or "")]
    picture = draw_panels(Panels("all", "curve", "All", [[everything()]]))
    assert picture.png.startswith(PNG)
    legend = ET.fromstring(picture.svg)
    assert legend.tag.endswith("svg")
    assert keys == ["noise", "limit", "accepted", "<b>recorded", "model", "left out"]
    # On the page of results the same plots are zoomable.
    assert figure(picture).count('<figure class="plot"') == 1
    assert "<img" not in figure(picture)


def test_every_role_has_a_colour_on_light_and_on_dark():
    sheet = style_sheet()
    for key, look in LOOKS.items():
        assert f".as-{key}{{--look:{look.colours[0]}" in sheet
        assert f".as-{key}{{--look:{look.colours[1]}" in sheet


def test_gaps_interrupt_the_line():
    y = np.linspace(0.0, 1.0, 20)
    y[8:10] = np.nan
    text = svg(Plot("gap", ("x", "y"), [Series("before", "", np.arange(20.0), y)]))
    path = ET.fromstring(text).find(".//path[@class='line as-before']")
    assert path is not None
    assert path.get("d").lower().count("m") == 2
    assert "nan" not in path.get("d")


def test_a_plot_is_well_formed_and_names_are_escaped(case, diagnoses):
    found = diagnoses.diagnosis(case())
    one = replace(found.channels[0], name='<b a="1">&')
    text = svg(curve_plot(replace(found, channels=(one,)), one))
    assert "<b a" not in text
    assert ET.fromstring(text).tag == "figure"


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.0, 10.0, [0, 2, 4, 6, 8, 10]),
        (-0.18, 6.18, [0, 1, 2, 3, 4, 5, 6]),
        (-1e-3, 1e-3, [-1e-3, -5e-4, 0, 5e-4, 1e-3]),
        # Steps of 50 would leave the zero alone.
        (-0.48, 0.48, [-0.4, -0.2, 0, 0.2, 0.4]),
    ],
)
def test_ticks_are_round(low, high, expected):
    most = 7 if high > 7 else 9 if high > 1 else 4 if high > 0.1 else 5
    assert ticks(low, high, most) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [(0.9, 30.0, [1, 2, 5, 10, 20]), (0.5, 2e4, [1, 10, 100, 1000, 1e4]), (1.1, 1.4, [1.1, 1.2, 1.3, 1.4])],
)
def test_ticks_of_a_logarithmic_axis_are_round(low, high, expected):
    assert ticks(low, high, 4, logarithmic=True) == pytest.approx(expected)


@pytest.mark.parametrize("value", [np.nan, np.inf, 5.0])
def test_limits_hold_what_is_drawn_and_no_more(value):
    y = np.array([1.0, 3.0, value, 2.0])
    low, high = prepare(Plot("p", ("x", "y"), [Series("after", "", np.arange(4.0), y)])).y
    good = y[np.isfinite(y)]
    assert low < good.min() < good.max() < high
    assert high - low < 1.2 * np.ptp(good)


def test_a_loop_recorded_for_hours_is_drawn_by_few_points_with_its_envelope():
    """720,000 samples of a noisy loop, with two spikes and a gap: the page stays small and no extreme is lost."""
    rng = np.random.default_rng(1)
    t = np.arange(720_000) * 0.005
    q = 4.0 * np.sin(np.pi * t) * (1.0 + 0.1 * np.sin(0.003 * t))
    force = 300.0 * q + 100.0 * np.cos(np.pi * t) + rng.normal(0.0, 20.0, len(t))
    force[333_333], force[100_000] = 6000.0, -5000.0
    force[500_000:500_100] = np.nan
    for x in (q, t):
        at, y = thin_curve(x, force, MOST)
        assert len(at) <= MOST
        assert (np.nanmin(y), np.nanmax(y)) == (-5000.0, 6000.0)
        assert np.isin(y[np.isfinite(y)], force).all()
        # In each hundredth of the width the highest and the lowest sample are drawn.
        edges = np.linspace(x.min(), x.max(), 51)
        for drawn, whole in zip(binned(at, y, edges), binned(x, force, edges), strict=True):
            assert drawn == pytest.approx(whole)


def binned(x, y, edges):
    """Lowest and highest value in each interval; of samples exactly at an edge nothing is asked."""
    good = np.isfinite(y)
    places = np.digitize(x[good], edges[1:-1])
    return [(y[good][places == i].min(), y[good][places == i].max()) for i in range(len(edges) - 1)]


def test_a_short_curve_is_drawn_as_it_is():
    x = np.linspace(0.0, 1.0, MOST)
    one = Series("after", "", x, np.sin(9 * x))
    assert prepare(Plot("p", ("x", "y"), [one])).series[0] is one


def test_dots_are_thinned_without_their_extremes():
    rng = np.random.default_rng(2)
    x, y = rng.normal(size=(2, 300_000))
    at, drawn = thin_curve(x, y, MOST, dots=True)
    assert len(at) <= MOST
    assert (drawn.min(), drawn.max()) == (y.min(), y.max())


def test_areas_of_a_long_recording_are_drawn_by_few_points():
    x = np.linspace(0.0, 1.0, 50)
    pieces = [
        np.stack([np.append(x, x[::-1]), np.append(x + d, x[::-1] - d)], axis=1)
        for d in np.linspace(0, 0.01, 3000)
    ]
    (region,) = prepare(Plot("p", ("x", "y"), regions=[Region("soft", "", pieces)])).regions
    assert sum(map(len, region.outlines)) <= 20_000
    # The widest one is lost by less than a pixel.
    assert max(np.abs(np.diff(one, axis=1)).max() for one in region.outlines) > 0.01 - 1 / 200


def test_numbers_do_not_overlap():
    """Nine places, all of them with their largest misfit at the same point."""
    corner = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    places = [Region("soft", "", [corner], n, np.array([(0.5, 0.5)])) for n in range(1, 10)]
    plot = prepare(Plot("p", ("x", "y"), regions=places))
    at = np.stack(position(plot, *np.concatenate([one.at for one in plot.regions]).T), axis=1)
    apart = np.hypot(*(at[:, None] - at[None]).transpose(2, 0, 1)) + 1e3 * np.eye(9)
    assert apart.min() >= 18.0  # two radii


def test_a_number_prefers_another_sample_of_its_place():
    corner = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    first = Region("soft", "", [corner], 1, np.array([(0.5, 0.5)]))
    second = replace(first, number=2, at=np.array([(0.5, 0.5), (0.9, 0.2)]))
    plot = prepare(Plot("p", ("x", "y"), regions=[first, second]))
    assert plot.regions[1].at[0] == pytest.approx((0.9, 0.2))


def test_the_numbers_of_an_axis_have_room_beside_its_label():
    """-400000 has seven characters of some 8 pixels; the label takes 20."""
    line = Series("after", "", np.arange(2.0), np.array([-4e5, 4e5]))
    wide, narrow = (prepare(Plot("p", ("x", label), [line])) for label in ("moment", ""))
    assert pane(wide)[0] >= 7 * 7.2 + 20 + 7
    assert pane(narrow)[0] >= 7 * 7.2 + 7
