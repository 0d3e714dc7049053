"""Pictures: valid files, and a projection that puts faces where they belong."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from bushcli.report.figures.body import _Drawing, deformed_figure
from bushcli.report.figures.curves import curve_figure, smooth
from bushcli.report.figures.picture import style
from bushcli.report.figures.six import six_figure
from matplotlib.backends.backend_agg import FigureCanvasAgg

from bushcli.curve.curve import Curve
from bushcli.report.figures import direct_figures, fit_figures, mesh_figures, projection
from bushcli.report.quantity import largest_reactions
from bushcli.simulate.meshes import Meshed
from bushcli.simulate.six import SixCurve
from cases.stretches import Surface, mesh_surface
from geometry.mesh import build
from geometry.shape import Refinement, shapes

PARTS = Path(__file__).parents[2] / "verification" / "data" / "real"
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture
def drawn(answer, channel):
    def make(*channels, fit=None, title="a bushing"):
        found = answer(*(channels or (channel("axial", 130.0, 100.0),)), title=title)
        names = {c.name: c.name for c in found.response.channels}
        return {p.name: p for p in direct_figures(found.response, found.misfits, fit, names)}

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


def test_a_stopped_march_is_marked(channel):
    figure = curve_figure(channel("axial", 100.0, stopped="DIVERGED_MAX_IT"), None)
    assert "simulation stopped" in [text.get_text() for text in figure.axes[0].get_legend().get_texts()]


def test_the_band_lies_ten_percent_of_the_force_range_around_the_recording(answer, channel):
    found = answer(channel("axial", 130.0, 100.0))
    (simulated,) = found.response.channels
    axes = curve_figure(simulated, found.misfits["axial"]).axes[0]
    # Recorded from -400 to 400 N: the band is 80 N on either side.
    heights = np.concatenate([path.vertices for band in axes.collections for path in band.get_paths()])
    assert heights[:, 1].max() == pytest.approx(480.0)
    assert heights[:, 1].min() == pytest.approx(-480.0)


def test_axes_carry_units(channel):
    axes = curve_figure(channel("conical"), None).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("rotation [deg]", "moment [N mm]")


def test_instability_is_shaded(fit):
    assert fit_figures(fit)[0].kind == "coupons"
    from bushcli.report.figures.coupons import coupon_figure

    panels = coupon_figure(fit).axes
    labels = [[text.get_text() for text in axes.get_legend().get_texts()] for axes in panels]
    assert ["law unstable" in found for found in labels] == [True, True, False]


def test_a_curve_that_turns_back_is_drawn_through_its_own_points():
    curve = Curve("axial", [0.0, 1.0, 0.0], [0.0, 2.0, 0.5])
    q, force = smooth(curve)
    assert q.tolist() == [0.0, 1.0, 0.0]
    assert force.tolist() == [0.0, 2.0, 0.5]


def test_meshes_have_pictures(ring):
    mesh = Meshed("section", ("axial",), 2, 2, 6, {}, {}, ring)
    assert [picture.name for picture in mesh_figures([mesh])] == ["mesh-section"]


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
    beside = projection.side_cells(np.arange(9.0), 3).astype(int)
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
    body = projection.revolved(ring)
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


def test_reactions_that_are_rounding_errors_are_not_drawn():
    """Of a path with a free tilt the only moment is what Newton's method leaves of zero."""
    time = np.array([0.0, 1.0, 2.0])
    motion, force = np.zeros((3, 6)), np.zeros((3, 6))
    motion[:, 0], motion[:, 4] = time, 0.01 * time
    force[:, 0], force[:, 4] = 1000.0 * time, [0.0, 1.5e-6, -0.8e-6]
    drawn = [
        [line.get_label() for line in axes.get_lines() if not line.get_label().startswith("_")]
        for axes in six_figure("path", SixCurve(time, motion, force, free=(4,), lead=0)).axes
    ]
    assert drawn == [["ux"], ["ry (free)"], ["fx"], []]
    force[:, 4] = 1.0 * time
    assert largest_reactions(force) == (2000.0, 2.0)
