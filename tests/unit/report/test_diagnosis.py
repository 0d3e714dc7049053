"""A diagnosis in JSON, text, pictures and files."""

import io
import json
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.text import Text as MplText
from rich.console import Console

from bushcli import report
from bushcli.condition import Condition
from bushcli.diagnosis.result import Hypothesis, Named, Quantity
from bushcli.diagnosis.words import sentences
from bushcli.recording import Recording
from bushcli.report.diagnosis_field import map_vtu
from bushcli.report.diagnosis_html import diagnosis_html
from bushcli.report.diagnosis_paragraph import paragraph
from bushcli.report.diagnosis_words import amplitude_text, headline, strength, tone
from bushcli.report.figures.diagnosis import diagnosis_figures, program, record_figure
from bushcli.report.figures.diagnosis_curves import curve_plot, diagnosed_figure, time_plot
from bushcli.report.figures.diagnosis_map import map_figure, numbering
from bushcli.report.figures.plot import svg, ticks

KINDS = ("explained", "missing_physics", "law_too_poor", "unexplained")


def said(found, width=100):
    stream = io.StringIO()
    Console(width=width, no_color=True, file=stream).print(report.diagnosis_text(found))
    return stream.getvalue()


# -- JSON ------------------------------------------------------------------------------------------------------------


def test_json_is_what_scripts_rely_on(case, diagnoses):
    found = diagnoses.rivalling(case())
    document = report.diagnosis_json(found, {"total": 1.0})
    json.dumps(document, allow_nan=False)
    assert document["command"] == "diagnose"
    assert document["verdict"] == "missing_physics"
    (effect,) = document["effects"]
    assert effect["name"] == "mullins"
    assert effect["evidence"] == 412.0
    inverse_r = effect["parameters"]["inverse_r"]
    assert (inverse_r["value"], inverse_r["std"], inverse_r["unit"]) == (0.312, 0.008, "1")
    assert inverse_r["derived"] == {"r": {"value": 3.205, "unit": "1"}}
    assert document["rivals"] == [["mullins"], ["friction", "viscoelasticity"]]
    assert {
        "channel",
        "cycle",
        "branch",
        "displacement_from",
        "displacement_to",
        "share",
        "sign",
    } <= document["mismatch"][0].keys()
    axial, radial = found.channels
    assert document["misfit"]["before"] == {"axial": axial.before_percent, "radial": radial.before_percent}
    assert document["misfit"]["after"]["axial"] == axial.after_percent
    assert document["misfit"]["noise"]["radial"] == radial.noise_percent
    assert document["misfit"]["held_out_before"] == {"axial": axial.held_out_before, "radial": None}
    assert document["misfit"]["held_out_after"]["axial"] == axial.held_out_after
    assert document["next_test"]["points"] == [0.0, 6.0, 0.0, 6.0, 0.0]
    assert document["next_test"]["unit"] == "mm"
    assert [entry["name"] for entry in document["hypotheses"]][-1] == "time_lag"
    assert document["hypotheses"][-1]["z"] is None
    assert document["problems"][0]["name"] == "coarse_noise"
    assert document["maps"][0]["helps_locally"] is True
    assert document["maps"][0]["channel"] == "axial + radial"
    assert document["maps"][0]["channels"] == ["axial", "radial"]


def test_angles_are_degrees_at_the_door(case, diagnoses):
    found = diagnoses.torsional(case())
    document = report.diagnosis_json(found, {})
    # 0.02 rad = 1.1459 degrees; the moment stays in N mm.
    offset = document["effects"][0]["parameters"]
    assert offset["displacement"]["value"] == pytest.approx(1.1459, abs=1e-4)
    assert offset["displacement"]["std"] == pytest.approx(0.11459, abs=1e-5)
    assert offset["displacement"]["unit"] == "degrees"
    assert (offset["force"]["value"], offset["force"]["unit"]) == (90.0, "N mm")
    # 0.4 rad = 22.9 degrees is the largest displacement.
    assert max(entry["displacement_to"] for entry in document["mismatch"]) == pytest.approx(22.918, abs=1e-3)
    assert curve_plot(found, found.channels[0]).x[1] == pytest.approx(22.918 * 1.03, rel=1e-4)
    assert "displacement 1.15 ± 0.11 degrees" in said(found)


def test_rates_of_the_next_test_are_of_its_own_mode(case, diagnoses):
    # Torsion has not been recorded: 0.1 rad/s is 5.73 degrees/s.
    test = replace(diagnoses.NEXT, channel="torsional", rates=(0.1,) * 4)
    document = report.diagnosis_json(diagnoses.diagnosis(case(), next_test=test), {})
    assert document["next_test"]["unit"] == "deg"
    assert document["next_test"]["rates"] == pytest.approx([5.7296] * 4, abs=1e-4)


# -- words -----------------------------------------------------------------------------------------------------------


def test_the_verdict_comes_first(case, diagnoses):
    starts = {
        "explained": "Explained: yeoh meets the recordings to their noise.",
        "missing_physics": "Missing physics: mullins.",
        "law_too_poor": "Law too poor: neo_hookean; yeoh does better",
        "unexplained": "Unexplained: nothing in the catalogue",
    }
    tones = {"explained": "good", "missing_physics": "plain", "law_too_poor": "plain", "unexplained": "bad"}
    for kind in KINDS:
        found = diagnoses.diagnosis(case(), kind)
        text = said(found)
        assert text.startswith(starts[kind])
        # Without the line breaks the paragraph follows word by word.
        assert paragraph(found) in " ".join(text.split())
        assert tone(found) == tones[kind]


def test_the_paragraph_says_what_was_left_out_how_much_better_it_is_and_what_cannot_be_told(case, diagnoses):
    text = paragraph(diagnoses.rivalling(case()))
    assert text.startswith(
        "The yeoh law alone, fitted to the axial and radial recordings, leaves out mullins. "
    )
    # The field's name of a parameter where it has one, the size of the misfit, rivals, and what to do next.
    assert "mullins: r = 3.205 ± 0.082, m = 0.102 ± 0.011 MPa" in text
    assert "With it the misfit falls: axial from " in text
    assert "These recordings cannot tell it from: friction with viscoelasticity." in text
    assert text.endswith(f"Next test: {diagnoses.NEXT.text}")


def test_the_paragraph_has_what_is_added_and_the_total(case, diagnoses):
    # 1/2000 beside the case's 1/1500 per MPa: 857 MPa, whose error is 857**2 times that of the compliance.
    added = Quantity(
        5e-4,
        1e-5,
        "1/MPa",
        "",
        0.0,
        1.0,
        {"bulk_modulus": (2000.0, "MPa"), "total_bulk_modulus": (857.143, "MPa")},
    )
    soft = Named("compressibility", "The rubber is compressible", {"compliance": added}, 30.0, True, "", None)
    text = paragraph(
        diagnoses.diagnosis(case(), effects=(soft,), parameters={"compressibility.compliance": added})
    )
    assert "bulk_modulus = 2000 ± 40 MPa, total_bulk_modulus = 857.1 ± 7.3 MPa" in text


def test_rivals_in_another_rig_are_told_by_it(case, diagnoses):
    found = report.diagnosis_json(
        diagnoses.diagnosis(case(), rivals=(("offset",), ("offset@radial",), ("offset@radial", "friction"))),
        {},
    )
    assert found["rivals"] == [["offset"], ["offset (radial)"], ["offset", "friction"]]


def test_the_paragraph_has_angles_in_degrees(case, diagnoses):
    text = paragraph(diagnoses.torsional(case()))
    assert "degrees" in text
    assert " rad" not in text


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (
            "explained",
            "The yeoh law alone, fitted to the axial recording, reaches the noise: nothing is missing",
        ),
        ("law_too_poor", "the law is too poor: yeoh describes the same rubber without any further physics. "),
        ("unexplained", "Nothing in the catalogue of effects, alone or with others, explains it."),
    ],
)
def test_the_paragraph_of_a_verdict_without_effects(case, diagnoses, kind, words):
    assert words in paragraph(diagnoses.diagnosis(case(), kind))


def test_the_paragraph_says_what_became_of_the_law(case, diagnoses):
    other = replace(diagnoses.YEOH, law="mooney_rivlin")
    assert "the law yeoh in place of mooney_rivlin" in paragraph(diagnoses.diagnosis(case(), plain=other))
    free = diagnoses.diagnosis(case(), law_from="coupons")
    assert "no longer that of the coupons" in paragraph(free)
    assert "(fixed" not in said(free)
    assert "identified from the recordings" in diagnosis_html(report.diagnosis_json(free, {}), free, ())


def test_a_better_law_that_does_not_reach_the_noise_is_no_more_than_that(case, diagnoses):
    doubt = Condition("misfit_above_noise", "the final model still misses", "see where it remains")
    found = diagnoses.diagnosis(case(), "law_too_poor", conditions=(doubt,))
    assert "yeoh comes nearer without any further physics, though not to the noise" in paragraph(found)


def test_what_could_not_be_shown_is_no_rival_of_nothing(case, diagnoses):
    found = diagnoses.diagnosis(case(), "unexplained", rivals=((), ("offset",), ("friction",)))
    assert report.diagnosis.rival_lines(found) == [
        "What these recordings could not show if it were there: offset, friction."
    ]


def test_nothing_helps_means_nothing_that_was_asked_for(case, diagnoses):
    found = diagnoses.diagnosis(case(), "unexplained", asked=("mullins", "friction"))
    assert headline(found) == (
        "Unexplained: nothing among the effects asked for (mullins, friction) accounts for the misfit"
    )
    assert "Nothing among the effects asked for (mullins, friction), alone or with others" in paragraph(found)
    assert report.diagnosis_json(found, {})["asked"] == ["mullins", "friction"]
    assert report.diagnosis_json(diagnoses.diagnosis(case()), {})["asked"] is None


def test_a_law_of_coupons_is_said_to_be_theirs(case, diagnoses):
    text = paragraph(diagnoses.diagnosis(case(), law_from="coupons", law_fixed=True))
    assert text.startswith(
        "The yeoh law, fitted to the coupon tests and held against the axial recording, leaves "
    )


def test_rivals_are_in_the_headline_as_many_as_fit(case, diagnoses):
    assert headline(diagnoses.rivalling(case())) == (
        "Missing physics: mullins, or friction + viscoelasticity: these recordings cannot tell"
    )
    many = tuple((name,) for name in ("mullins", "friction", "offset", "swaging", "free_play"))
    assert headline(diagnoses.diagnosis(case(), rivals=many)).endswith(
        "mullins, or friction, or offset, or others: these recordings cannot tell"
    )


def test_text_says_where_what_how_much_better_and_what_next(case, diagnoses):
    found = diagnoses.rivalling(case())
    text = said(found)
    flat = " ".join(text.split())
    assert max(map(len, text.splitlines())) <= 100
    for words in (
        "in the axial channel, on loading above 3 mm: the simulation is 8.6 % too soft there",
        "In the rubber (axial and radial together): a local change takes away 71 % of the misfit",
        "inverse_r 0.3120 ± 0.0080 (r = 3.21), m 0.102 ± 0.011 MPa",
        "evidence 412, decisive",
        "cannot tell apart: mullins; or friction + viscoelasticity",
        "Next test: axial to 6 mm",
        "yeoh + mullins + friction",
        "2 that cannot be tested with these recordings",
        "problem coarse_noise",
    ):
        assert words in flat, words


def test_a_map_of_what_has_a_cause_says_so(case, diagnoses):
    words = "It is the plain law's misfit that is mapped: mullins was found to explain it."
    found = diagnoses.diagnosis(case())
    assert words in " ".join(said(found).split())
    nowhere = replace(found.maps[0], helps_locally=False)
    assert "that is mapped" not in said(replace(found, maps=(nowhere,)))
    assert "that is mapped" not in said(diagnoses.diagnosis(case(), "unexplained"))


def test_rivals_of_an_explained_misfit_are_what_could_not_be_seen(case, diagnoses):
    found = diagnoses.diagnosis(case(), "explained", rivals=((), ("offset",), ("time_lag",)))
    text = " ".join(said(found).split())
    assert "What these recordings could not show if it were there: offset, time_lag." in text
    assert "cannot tell apart" not in text


def test_a_table_of_nothing_is_left_out(case, diagnoses):
    untested = tuple(one for one in diagnoses.hypotheses() if not one.testable)
    text = said(diagnoses.diagnosis(case(), "explained", hypotheses=untested))
    assert "score test" not in text
    assert "2 that cannot be tested with these recordings: see result.json" in text


def test_titles_of_narrow_tables_are_not_wrapped(case, diagnoses):
    assert "Rms misfit, % of the force range\n" in said(diagnoses.diagnosis(case()))


def test_what_remains_is_told_only_when_there_is_something(case, diagnoses):
    assert "What is left" not in said(diagnoses.diagnosis(case()))
    partly = diagnoses.diagnosis(case(), channels=(diagnoses.channel(explained=False),))
    assert "What is left after the final model" in said(partly)


def test_a_fixed_law_is_told_with_its_source(case, diagnoses):
    assert "Law yeoh: C10 0.5000, C20 -0.05000, C30 0.01000 (fixed, from the coupons)" in said(
        diagnoses.diagnosis(case(), law_from="coupons", law_fixed=True)
    )


@pytest.mark.parametrize(
    ("evidence", "word"),
    [(10.0, "decisive"), (6.0, "strong"), (2.0, "positive"), (1.9, "weak"), (float("nan"), "not weighed")],
)
def test_evidence_has_kass_and_rafterys_names(evidence, word):
    assert strength(evidence) == word


def test_a_first_estimate_may_name_parameters_in_full(diagnoses):
    one = Hypothesis("offset", True, "", 1.0, 1.0, 0.1, {"offset.displacement": np.pi / 180})
    assert amplitude_text(one, [diagnoses.channel("torsional")]) == "displacement 1.0 degrees"
    assert amplitude_text(one, [diagnoses.channel("axial")]) == "displacement 0.017 mm"


# -- plots -----------------------------------------------------------------------------------------------------------


def test_areas_lie_between_recording_and_plain_law(case, diagnoses):
    found = diagnoses.diagnosis(case())
    (one,) = found.channels
    regions = curve_plot(found, one).regions
    assert [region.number for region in regions] == list(range(1, len(found.location.mismatch) + 1))
    assert {region.key for region in regions} == {"stiff", "soft"}
    first = found.location.mismatch[0]
    points = np.concatenate(regions[0].outlines)
    force = np.concatenate([one.recording.force, one.before])
    assert np.isin(points[:, 1], force).all()
    # Areas begin and end with the mismatch.
    assert points[:, 0].max() == pytest.approx(first.displacement_to)
    assert points[:, 0].min() >= first.displacement_from


def test_areas_that_overlap_are_one(case, diagnoses):
    # Of loading and unloading the outlines would run in opposite senses, and cut holes into each other.
    found = diagnoses.diagnosis(case())
    for region in curve_plot(found, found.channels[0]).regions:
        for x, y in (outline.T for outline in region.outlines):
            assert x @ np.roll(y, -1) - y @ np.roll(x, -1) >= 0


def enclosed(region):
    """Area of all outlines, each by itself."""
    return sum((x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2 for x, y in (part.T for part in region.outlines))


def test_an_area_on_the_way_there_and_back_is_not_cancelled(case, diagnoses):
    """Twice as stiff everywhere: the outline of the whole path would enclose nothing."""
    _, q = diagnoses.program([3.0, 6.0], 0.5)
    force = 100.0 * q
    one = replace(
        diagnoses.channel(),
        recording=Recording("axial", q, force, name="axial"),
        before=2 * force,
        after=force,
        held_out=np.zeros(len(q), dtype=bool),
        path=q,
    )
    found = diagnoses.diagnosis(case(), channels=(one,))
    (region,) = curve_plot(found, one).regions
    assert found.location.mismatch[0].samples.all()
    # Two triangles, on the way there and back: q * 100 q / 2.
    assert enclosed(region) == pytest.approx(2 * (50 * 3**2 + 50 * 6**2))


def test_curves_of_several_channels_are_told_apart(case, diagnoses):
    found = diagnoses.rivalling(case())
    for plot in (curve_plot, time_plot):
        assert "<strong>radial</strong>" in svg(plot(found, found.channels[1]))
    alone = diagnoses.diagnosis(case())
    assert "<strong>" not in svg(curve_plot(alone, alone.channels[0]))


def test_the_misfit_is_in_percent_and_held_out_samples_are_marked(case, diagnoses):
    found = diagnoses.diagnosis(case())
    (one,) = found.channels
    plot = time_plot(found, one)
    before, after = plot.series
    for series, expected in ((before, one.before_percent), (after, one.after_percent)):
        assert np.sqrt(np.mean(series.y**2)) == pytest.approx(expected)
    noise, held = plot.bands
    assert noise[2:4] == pytest.approx((-2 * one.noise_percent, 2 * one.noise_percent))
    assert held[:2] == (one.recording.time[-48], one.recording.time[-1])


def test_one_curve_is_drawn_where_nothing_was_changed(case, diagnoses):
    found = diagnoses.diagnosis(case(), "explained")
    assert [s.key for s in curve_plot(found, found.channels[0]).series] == ["before", "recorded"]
    assert curve_plot(found, found.channels[0]).regions == []


def test_a_plot_without_time_counts_samples(case, diagnoses):
    found = diagnoses.torsional(case())
    plot = time_plot(found, found.channels[0])
    assert plot.x_label == "sample"
    assert plot.series[0].x[0] == 1


def test_gaps_in_the_simulation_interrupt_the_line(case, diagnoses):
    found = diagnoses.diagnosis(case())
    (one,) = found.channels
    gone = one.before.copy()
    gone[100:110] = np.nan
    broken = replace(found, channels=(replace(one, before=gone),))
    path = ET.fromstring(svg(curve_plot(broken, broken.channels[0]))).find(".//path[@class='line before']")
    assert path is not None
    assert path.get("d").count("M") == 2
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
    ],
)
def test_ticks_are_round(low, high, expected):
    assert ticks(low, high, 7 if high > 7 else 9 if high > 1 else 5) == pytest.approx(expected, abs=1e-12)


# -- pictures --------------------------------------------------------------------------------------------------------


def test_the_record_is_mapped_before_and_after_on_one_scale(case, diagnoses):
    found = diagnoses.diagnosis(case())
    figure = record_figure(found, found.channels[0])
    titles = [axes.get_title(loc="left") for axes in figure.axes[:4]]
    assert titles == [
        "axial, plain law: loading",
        "axial, plain law: unloading",
        "axial, final model: loading",
        "axial, final model: unloading",
    ]
    cells = [len(axes.collections) for axes in figure.axes[:4]]
    assert cells[0] == cells[2] == sum(b.branch == "loading" for b in found.location.bins)
    # Where the misfit is noise, nearly nothing is marked.
    dots = [len(axes.lines) - 1 for axes in figure.axes[:4]]
    assert dots[0] > 10 * dots[2]


def test_a_section_is_mirrored_and_a_solid_shows_its_outside(diagnoses):
    section, half, whole = diagnoses.half_plane(), diagnoses.solid(), diagnoses.solid(whole=True)
    for one, faces in (
        (section, 2 * 8 * 20),
        # Outside and inside, two ends, and the two cuts at y = 0.
        (half, 2 * 24 * 8 + 2 * 24 * 4 + 2 * 4 * 8),
        (whole, 2 * 12 * 8 + 2 * 12 * 4 + 2 * 4 * 8),
    ):
        (drawn,) = (c for c in map_figure(one).axes[0].collections if isinstance(c, PolyCollection))
        assert len(drawn.get_paths()) == faces


def test_colours_of_a_map_say_softer_and_stiffer(diagnoses):
    one = diagnoses.half_plane()
    (drawn,) = (c for c in map_figure(one).axes[0].collections if isinstance(c, PolyCollection))
    red, _, blue, _ = drawn.get_facecolors()[int(np.argmin(one.factor))]
    assert blue > 1.5 * red  # purple: softer
    red, green, blue, _ = drawn.get_facecolors()[int(np.argmax(one.factor))]
    assert max(red, green, blue) - min(red, green, blue) < 0.05


@pytest.mark.parametrize("made", ["half_plane", "solid"])
def test_both_numberings_of_corners_are_understood(diagnoses, made):
    tensor = getattr(diagnoses, made)()
    order = [0, 1, 3, 2] if made == "half_plane" else [0, 1, 3, 2, 4, 5, 7, 6]
    ring = replace(tensor, cells=tensor.cells[:, order])
    assert (numbering(tensor), numbering(ring)) == ("tensor", "ring")
    # The same file: VTK has one numbering.
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
    # The scale ends at 2 %, not at the tenth of a per cent that is asked for.
    assert np.ptp(drawn.get_facecolors()[:, :3]) < 0.15


def test_a_map_is_a_file_for_paraview(diagnoses):
    one = diagnoses.solid()
    root = ET.fromstring(map_vtu(one))
    arrays = {a.get("Name"): np.array(a.text.split(), dtype=float) for a in root.iter("DataArray")}
    points = arrays["points"].reshape(-1, 3)
    cells = arrays["connectivity"].astype(int).reshape(-1, 8)
    assert np.allclose(arrays["stiffness_change"], one.factor)
    assert (arrays["types"] == 12).all()
    # VTK's hexahedron: the base goes round, and the first edge upwards joins corners 0 and 4.
    x = points[cells]
    base = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])[:, 2] / 2
    volume = base * (x[:, 4] - x[:, 0])[:, 2]
    # Half a ring of 24 chords: 24/2 sin(pi/24) (18^2 - 9^2) 34 mm^3; none of its cells is inside out.
    assert volume.sum() == pytest.approx(12 * np.sin(np.pi / 24) * (18**2 - 9**2) * 34)
    assert (volume > 0).all()


def test_the_program_of_a_test_takes_its_time(diagnoses):
    time, q = program(diagnoses.NEXT)
    # 6 mm at 0.5 mm/s twice, at 5 mm/s twice, two holds of 60 s.
    assert time[-1] == pytest.approx(12 + 60 + 12 + 1.2 + 60 + 1.2)
    assert list(q) == [0, 6, 6, 0, 6, 6, 0]


def test_pictures_are_drawn_of_a_channel_in_which_the_law_runs_away(case, diagnoses):
    found = diagnoses.diagnosis(case())
    (one,) = found.channels
    wild = replace(one, before=50.0 * one.before)
    changed = replace(found, channels=(wild,))
    low, high = diagnosed_figure(changed, wild).axes[0].get_ylim()
    assert high - low < 2.5 * np.ptp(one.recording.force)


# -- files -----------------------------------------------------------------------------------------------------------


def test_the_folder_holds_all_that_the_report_shows(case, diagnoses, tmp_path):
    # As if there were an axial channel, too.
    together = diagnoses.half_plane(across=2, along=2, names=("axial", "torsional"))
    found = replace(diagnoses.torsional(case()), maps=(together,))
    document = report.diagnosis_json(found, {"total": 1.0})
    written = {path.name for path in report.write_diagnosis(tmp_path / "out", document, found)}
    assert {"result.json", "report.html", "torsional-diagnosis.csv", "torsional-diagnosis.png"} <= written
    assert {f"axial_torsional-bushing-map.{ending}" for ending in ("vtu", "png", "svg")} <= written
    assert not any(set(name) & set(" +") for name in written)
    rows = (tmp_path / "out" / "torsional-diagnosis.csv").read_text().splitlines()
    assert rows[0] == "rotation_deg,recorded_moment_Nmm,plain_moment_Nmm,final_moment_Nmm,held_out"
    last = [float(value) for value in rows[-1].split(",")]
    one = found.channels[0]
    assert last == pytest.approx(
        [
            np.degrees(one.recording.displacement[-1]),
            one.recording.force[-1],
            one.before[-1],
            one.after[-1],
            1.0,
        ]
    )


@pytest.mark.parametrize("kind", KINDS)
def test_every_verdict_has_its_page(case, diagnoses, kind):
    found = diagnoses.diagnosis(case(), kind, maps=())
    text = diagnosis_html(report.diagnosis_json(found, {}), found, ())
    assert headline(found) in text
    assert paragraph(found) in text
    assert ("What was left out" in text) == (kind == "missing_physics")
    assert "Where in the bushing" not in text
    for words in ("Before and after", "What was thought of", "How the model was selected", "Provenance"):
        assert words in text
    # Each step with its reason, each effect that cannot be tested with why.
    assert all(stage.text in text for stage in found.path)
    assert "Cannot be tested with these recordings" in text
    assert "one rate only: a lag looks like friction" in text
    # Where it misses stands beside the curves, once, besides the paragraph at the top.
    shown = text.replace(paragraph(found), "", 1)
    for place in sentences(found.location):
        assert shown.lower().count(f"{place}.") + shown.count(f" {place}</button>") == 1


def test_the_page_runs_its_own_script_and_no_other(case, diagnoses):
    doubt = Condition("strange", "<script>alert(1)</script>", "</script>")
    found = diagnoses.diagnosis(case('<script>alert("x")</script>'), conditions=(doubt,))
    pictures = diagnosis_figures(replace(found, maps=()), {"axial": "axial"})
    text = diagnosis_html(report.diagnosis_json(found, {}), found, pictures)
    assert text.count("<script>") == 1
    assert "script-src &#39;sha256-" in text or "script-src 'sha256-" in text
    # Curves are in the page as plots, not as pictures.
    assert text.count("<img ") == text.count('src="data:image/') == 1
    assert "http://" not in text
    assert "https://" not in text
    assert "url(" not in text
