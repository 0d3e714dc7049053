"""A diagnosis in JSON, text, pictures and files."""

import io
import json
import math
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from bushcli.report.figures.diagnosis import diagnosis_figures, program, record_figure
from bushcli.report.figures.diagnosis_curves import curve_plot, diagnosed_figure, time_plot
from bushcli.report.figures.diagnosis_map import map_figure, numbering
from bushcli.report.figures.diagnosis_missing import missing_figure
from bushcli.report.figures.diagnosis_probability import prior_figure, probability_figure, strips
from bushcli.report.figures.plot import svg, ticks
from matplotlib.collections import PolyCollection
from matplotlib.text import Text as MplText
from rich.console import Console

from bushcli import report
from bushcli.case import Material
from bushcli.diagnosis.result import DiagnosedEffect, FormError, Group, Quantity
from bushcli.diagnosis.values import derived
from bushcli.diagnosis.words import sentences
from bushcli.effects.effect import effect
from bushcli.effects.titles import phrase, title
from bushcli.recording import Recording
from bushcli.report.views.diagnosis.document import bar, model_table, probability_table
from bushcli.report.views.diagnosis.paragraph import paragraph
from bushcli.report.views.diagnosis.values import parameters_text
from bushcli.report.views.diagnosis.words import (
    chance,
    form_error_line,
    headline,
    law_title,
    likely,
    missing_lines,
    model_title,
    next_test_lines,
    rival_lines,
    searched_lines,
    together,
    tone,
)
from bushcli.report.writers.files import map_vtu
from bushcli.report.writers.page import page
from bushcli.runtime.condition import Condition
from bushcli.selection.searched import NOT_SIMULATED

KINDS = ("explained", "missing_physics", "law_too_poor", "unexplained", "faulty_data")


def text_of(found, width=100):
    stream = io.StringIO()
    Console(width=width, no_color=True, file=stream).print(
        report.terminal_text(report.diagnosis_document(found))
    )
    return stream.getvalue()


def page_of(found, pictures=()):
    return page(report.diagnosis_document(found, pictures), report.diagnosis_json(found, {}))


def section_of(found, heading, pictures=()):
    """Return the paragraphs and tables of a section of the document; None if there is no such section."""
    known = {one.heading: one for one in report.diagnosis_document(found, pictures).sections}
    return known[heading].blocks if heading in known else None


def flat(found):
    """Return the text without line breaks."""
    return " ".join(text_of(found).split())


# -- JSON ------------------------------------------------------------------------------------------------------------


def test_json_is_what_scripts_rely_on(case, diagnoses):
    found = diagnoses.rivalling(case())
    document = report.diagnosis_json(found, {"total": 1.0})
    json.dumps(document, allow_nan=False)
    assert document["command"] == "diagnose"
    assert document["verdict"] == "missing_physics"
    effect = document["effects"][0]
    assert (effect["name"], effect["title"]) == ("mullins", "Mullins softening")
    assert (effect["probability"], effect["evidence"]) == (0.994, 412.0)
    inverse_r = effect["parameters"]["inverse_r"]
    assert (inverse_r["value"], inverse_r["std"], inverse_r["unit"]) == (0.312, 0.008, "1")
    assert inverse_r["derived"] == {"r": {"value": 3.205, "unit": "1"}}
    assert inverse_r["prior"] == {"lower": 0.02, "upper": 0.6, "tail": 0.62, "source": diagnoses.LEE}
    assert document["probability"]["friction"] == 0.67
    assert {"unknown", "nothing"} <= document["probability"].keys()
    best = document["models"][0]
    assert best.keys() == {
        "law",
        "effects",
        "probability",
        "log_evidence",
        "misfit",
        "form_error",
        "variants",
    }
    assert best["effects"] == ["mullins", "friction"]
    # Rivals do not include the most probable set; effects have their names in the catalogue.
    assert document["rivals"] == [["mullins", "viscoelasticity"], ["mullins", "friction", "offset"]]
    assert document["groups"][0]["effects"] == ["friction", "viscoelasticity"]
    assert document["form_error"]["percent"] == {"axial": 0.4, "radial": 0.4}
    assert document["missing"]["probability"] == 0.021
    assert document["searched"]["complete"] is False
    assert (document["searched"]["left"], document["searched"]["ended"]) == (0.12, "budget")
    assert document["searched"]["trials"][0]["predicted"] is None
    assert document["searched"]["untestable"]["time_lag"].startswith("one rate only")
    (fault,) = document["data_faults"]
    assert (fault["channel"], fault["kind"], fault["samples"]) == ("axial", "spikes", 3)
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
    misfit = document["misfit"]
    assert misfit["before"] == {"axial": axial.before_percent, "radial": radial.before_percent}
    assert misfit["after"]["axial"] == axial.after_percent
    assert misfit["noise"]["radial"] == radial.noise_percent
    assert misfit["held_out_before"] == {"axial": None, "radial": radial.before_percent}
    assert misfit["held_out_after"] == {"axial": None, "radial": radial.after_percent}
    assert document["next_test"]["points"] == [0.0, 6.0, 0.0, 6.0, 0.0]
    assert document["next_test"]["unit"] == "mm"
    assert (document["next_test"]["information"], document["next_test"]["possible"]) == (0.83, 1.05)
    assert document["problems"][0]["name"] == "coarse_noise"
    assert document["maps"][0]["helps_locally"] is True
    assert document["maps"][0]["channel"] == "axial + radial"
    assert document["maps"][0]["channels"] == ["axial", "radial"]


@pytest.mark.parametrize("kind", KINDS)
def test_every_verdict_is_json(case, diagnoses, kind):
    document = report.diagnosis_json(diagnoses.diagnosis(case(), kind), {})
    json.dumps(document, allow_nan=False)
    assert document["verdict"] == kind
    assert document["text"].startswith(("The ", "A diagnosis is possible only after"))


def test_a_choice_is_a_word(case, diagnoses):
    bond = Quantity(1.0, np.nan, "1", "which end is free", np.nan, np.nan, word="outer_top")
    free = DiagnosedEffect("debonding", "Debonding", "A bond is free.", {"bond": bond}, 0.97, 30.0, True)
    found = diagnoses.diagnosis(case(), effects=(free,), parameters={"debonding.bond": bond})
    value = report.diagnosis_json(found, {})["effects"][0]["parameters"]["bond"]
    assert (value["value"], value["std"], value["prior"]) == ("outer_top", None, None)
    assert "(Debonding: bond: outer top)" in paragraph(found)
    assert strips(found) == []


def test_angles_are_reported_in_degrees(case, diagnoses):
    found = diagnoses.torsional(case())
    document = report.diagnosis_json(found, {})
    # 0.02 rad = 1.1459 degrees; the moment stays in N mm.
    offset = document["effects"][0]["parameters"]
    assert offset["displacement"]["value"] == pytest.approx(1.1459, abs=1e-4)
    assert offset["displacement"]["std"] == pytest.approx(0.11459, abs=1e-5)
    # 0.01 rad.
    assert offset["displacement"]["prior"]["upper"] == pytest.approx(0.57296, abs=1e-5)
    assert offset["displacement"]["unit"] == "degrees"
    assert (offset["force"]["value"], offset["force"]["unit"]) == (-90.0, "N mm")
    # 0.4 rad = 22.9 degrees is the largest displacement.
    assert max(entry["displacement_to"] for entry in document["mismatch"]) == pytest.approx(22.918, abs=1e-3)
    assert curve_plot(found, found.channels[0]).x[1] == pytest.approx(22.918 * 1.03, rel=1e-4)
    profile = document["missing"]["profiles"][0]
    assert (profile["along"], profile["unit"]) == ("displacement", "deg")
    assert profile["x"][-1] == pytest.approx(22.918, abs=1e-3)
    assert "1.15 ± 0.11 degrees 0.917 to 1.38 0 to 0.573" in flat(found)


def test_rates_of_the_next_test_are_of_its_own_mode(case, diagnoses):
    # Torsion has not been recorded; 0.1 rad/s is 5.73 degrees/s.
    test = replace(diagnoses.NEXT, channel="torsional", rates=(0.1,) * 4)
    document = report.diagnosis_json(diagnoses.diagnosis(case(), next_test=test), {})
    assert document["next_test"]["unit"] == "deg"
    assert document["next_test"]["rates"] == pytest.approx([5.7296] * 4, abs=1e-4)


def test_rivals_in_another_rig_are_told_by_it(case, diagnoses):
    models = diagnoses.ranked(("yeoh", ("offset",), 0.5))
    rivals = (("offset@radial",), ("offset@radial", "friction"))
    found = report.diagnosis_json(diagnoses.diagnosis(case(), models=models, rivals=rivals), {})
    assert found["rivals"] == [["offset@radial"], ["offset", "friction"]]


# -- names and numbers -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("probability", "words"),
    [
        (1.0, "more than 99 %"),
        (0.994, "more than 99 %"),
        (0.99, "99 %"),
        (0.974, "97 %"),
        (0.01, "1 %"),
        (0.0099, "less than 1 %"),
        (0.0, "less than 1 %"),
    ],
)
def test_no_probability_is_said_to_be_certain(probability, words):
    assert chance(probability) == words


def test_names_are_for_people():
    assert law_title("neo_hookean") == "neo-Hookean"
    assert law_title("mooney_rivlin") == "Mooney-Rivlin"
    assert title("offset@radial").endswith(" (radial)")
    assert phrase("mullins").startswith("Mullins")
    assert phrase("viscoelasticity") == "viscoelasticity"
    assert model_title("yeoh", ()) == "Yeoh alone"
    assert model_title("yeoh", ("viscoelasticity", "unknown")) == "Yeoh + viscoelasticity + unknown physics"
    assert together(()) == "no effect"
    a, b, c = map(phrase, ("mullins", "friction", "offset"))
    assert together(("mullins", "friction", "offset")) == f"{a} with {b} and {c}"
    # An effect that is not in the catalogue of this revision.
    assert title("soft_stop") == "Soft stop"


@pytest.mark.parametrize(
    ("share", "drawn"), [(0.0, ""), (1e-6, "▏"), (0.5, "█" * 12), (0.3, "███████▎"), (1.0, "█" * 24)]
)
def test_bars_are_as_long_as_their_share(share, drawn):
    assert bar(share) == drawn


# -- words -----------------------------------------------------------------------------------------------------------


def test_the_verdict_comes_first(case, diagnoses):
    starts = {
        "explained": "Explained: the Yeoh law alone describes the recordings (97 %).",
        "missing_physics": "Missing physics: Mullins softening (more than 99 %), with nothing else (97 %).",
        "law_too_poor": "Law too poor: neo-Hookean; the Yeoh law describes",
        "unexplained": "Unexplained: something is missing that is not in the catalogue of effects (more than 99 %).",
        "faulty_data": "Faulty data: wrong sign in the axial channel, to be corrected first.",
    }
    tones = {"explained": "good", "unexplained": "bad", "faulty_data": "bad"}
    for kind in KINDS:
        found = diagnoses.diagnosis(case(), kind)
        assert flat(found).startswith(starts[kind])
        assert " ".join(paragraph(found).split()) in flat(found)
        assert tone(found) == tones.get(kind, "plain")


def test_nothing_is_said_to_be_certain(case, diagnoses):
    sure = diagnoses.diagnosis(
        case(),
        models=diagnoses.ranked(("yeoh", ("mullins",), 1.0)),
        probability={"mullins": 1.0, "nothing": 0.0},
        effects=(replace(diagnoses.MULLINS, probability=1.0),),
    )
    for text in (text_of(sure), page_of(sure)):
        assert "100 %" not in text
        assert "(0 %)" not in text


def test_the_paragraph_says_what_was_left_out_how_much_better_it_is_and_what_cannot_be_told(case, diagnoses):
    text = paragraph(diagnoses.rivalling(case()))
    assert text.startswith(
        "The Yeoh law alone, fitted to the axial recording, leaves something out: Mullins softening (more than "
        "99 %) and dissipation (98 %); internal friction or viscoelasticity, which one rate cannot tell; perhaps also "
    )
    # Parameters have their names in the literature; an effect that is not certain always has its probability.
    assert "Mullins softening: r = 3.205 ± 0.082, m = 0.102 ± 0.011 MPa" in text
    assert "(Internal friction, 67 %: g = 0.140 ± 0.020" in text
    assert "With them the misfit falls: axial from " in text
    assert "radial, held out, from 3" in text
    assert f"These recordings cannot tell {together(('mullins', 'friction'))} (62 %) from: " in text
    assert f"Next test: {diagnoses.NEXT.text}." in text
    assert text.endswith(
        "the others predicted; fitting these too could shift 12 % of the probability: the time limit was reached."
    )


def test_the_paragraph_has_what_is_added_and_the_total(case, diagnoses):
    # 1/2000 added to the case's 1/1500 per MPa makes 857 MPa, whose error is 857**2 times that of the compliance.
    added = Quantity(
        5e-4,
        1e-5,
        "1/MPa",
        "",
        0.0,
        1.0,
        {"bulk_modulus": (2000.0, "MPa"), "total_bulk_modulus": (857.143, "MPa")},
    )
    soft = DiagnosedEffect(
        "compressibility", "Compressibility", "It gives", {"compliance": added}, 0.99, 30.0, True
    )
    text = paragraph(
        diagnoses.diagnosis(case(), effects=(soft,), parameters={"compressibility.compliance": added})
    )
    assert "bulk_modulus = 2000 ± 40 MPa, total_bulk_modulus = 857.1 ± 7.3 MPa" in text


def test_the_paragraph_has_angles_in_degrees(case, diagnoses):
    text = paragraph(diagnoses.torsional(case()))
    assert "degrees" in text
    assert " rad" not in text


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (
            "explained",
            "The Yeoh law alone, fitted to the axial recording, describes it (97 %): nothing is missing",
        ),
        (
            "law_too_poor",
            "the law is too poor: Yeoh describes the same rubber without any further physics (more than 99 %). ",
        ),
        (
            "unexplained",
            "leaves a misfit larger than the noise. With a probability of more than 99 % something is",
        ),
        (
            "unexplained",
            "83 % of the misfit of the plain law (squared, above the noise) is explained by no known effect",
        ),
        ("unexplained", "The force falls with time, whatever the displacement."),
        (
            "faulty_data",
            "Axial: wrong sign, the force falls where the displacement grows, in all 6 cycles. What to do",
        ),
    ],
)
def test_the_paragraph_of_a_verdict_without_effects(case, diagnoses, kind, words):
    assert words in paragraph(diagnoses.diagnosis(case(), kind))


def test_the_paragraph_says_what_became_of_the_law(case, diagnoses):
    other = replace(diagnoses.YEOH, law="mooney_rivlin")
    assert "the Yeoh law in place of Mooney-Rivlin" in paragraph(diagnoses.diagnosis(case(), plain=other))
    free = diagnoses.diagnosis(case(), law_from="coupons")
    assert "no longer that of the coupons" in paragraph(free)
    assert "(fixed" not in text_of(free)
    assert "identified from the recordings" in page_of(free)


def test_a_better_law_that_does_not_reach_the_noise_is_no_more_than_that(case, diagnoses):
    doubt = Condition("misfit_above_noise", "the final model still misses", "see where it remains")
    found = diagnoses.diagnosis(case(), "law_too_poor", conditions=(doubt,))
    assert (
        "Yeoh fits better without any further physics (more than 99 %), but not to within the noise"
        in paragraph(found)
    )


def test_nothing_helps_means_nothing_that_was_asked_for(case, diagnoses):
    found = diagnoses.diagnosis(case(), "unexplained", asked=("viscoelasticity", "time_lag"))
    asked = f"not among the effects asked for (viscoelasticity and {phrase('time_lag')})"
    assert asked in headline(found)
    assert asked in paragraph(found)
    assert report.diagnosis_json(found, {})["asked"] == ["viscoelasticity", "time_lag"]
    assert report.diagnosis_json(diagnoses.diagnosis(case()), {})["asked"] is None


def test_a_law_of_coupons_is_said_to_be_theirs(case, diagnoses):
    text = paragraph(diagnoses.diagnosis(case(), law_from="coupons", law_fixed=True))
    assert text.startswith(
        "The Yeoh law, fitted to the coupon tests and compared with the axial recording, leaves "
    )


def test_rivals_are_in_the_headline_with_their_probabilities(case, diagnoses):
    one = phrase("friction")
    assert headline(diagnoses.doubtful(case())) == (
        f"Missing physics: {one} (62 %), or viscoelasticity (30 %), or {together(('compressibility', 'offset'))} "
        "(5 %); these recordings cannot tell them apart"
    )
    # Where every set has a member of the group, the group's name replaces the rivals.
    assert headline(diagnoses.dissipating(case())) == (
        "Missing physics: dissipation (97 %); internal friction or viscoelasticity, which one rate cannot tell"
    )
    # Unknown physics is named beside the group.
    beside = diagnoses.ranked(
        ("yeoh", ("friction",), 0.6), ("yeoh", ("viscoelasticity",), 0.3), ("yeoh", ("unknown",), 0.08)
    )
    found = replace(diagnoses.dissipating(case()), models=beside, rivals=(("viscoelasticity",), ("unknown",)))
    assert headline(found).endswith("which one rate cannot tell; not ruled out: unknown physics (8 %)")
    # But not where one of the sets has both.
    both = ("yeoh", ("friction", "viscoelasticity"), 0.7), ("yeoh", ("friction",), 0.27)
    together_ = replace(
        diagnoses.dissipating(case()), models=diagnoses.ranked(*both), rivals=(("friction",),)
    )
    assert "dissipation" not in headline(together_)
    assert "with viscoelasticity (70 %), or with nothing else (27 %)" in headline(together_)
    # Another channel's instance of a member is not another effect.
    gains = ("yeoh", ("rig_compliance",), 0.5), ("yeoh", ("gain@radial",), 0.47)
    group = Group("", ("rig_compliance", "gain"), 0.97, "rig or gain, which one channel cannot tell")
    found = replace(
        diagnoses.dissipating(case()),
        models=diagnoses.ranked(*gains),
        rivals=(("gain@radial",),),
        groups=(group,),
    )
    assert headline(found) == "Missing physics: rig or gain, which one channel cannot tell (97 %)"
    names = ("friction", "offset", "swaging", "free_play")
    many = diagnoses.ranked(*(("yeoh", (name,), 0.2) for name in ("viscoelasticity", *names)))
    found = diagnoses.diagnosis(case(), models=many, rivals=tuple((name,) for name in names))
    assert headline(found) == (
        f"Missing physics: viscoelasticity (20 %), or {one} (20 %), or others; these recordings cannot tell them apart"
    )


def test_a_single_improbable_rival_of_the_credible_set_is_named(case, diagnoses):
    models = diagnoses.ranked(("yeoh", ("viscoelasticity",), 0.93), ("yeoh", ("friction",), 0.03))
    found = diagnoses.diagnosis(case(), models=models, rivals=(("friction",),))
    assert "internal friction (3 %)" in headline(found)
    # There is no test that would tell them apart.
    (line,) = next_test_lines(found)
    assert line.startswith("No test is proposed: none of those considered")
    models = diagnoses.ranked(("yeoh", ("viscoelasticity",), 0.9), ("yeoh", ("unknown",), 0.08))
    found = diagnoses.diagnosis(case(), models=models, rivals=(("unknown",),))
    assert next_test_lines(found) == ["No test is proposed: of unknown physics nothing can be predicted"]
    assert next_test_lines(diagnoses.diagnosis(case(), models=models)) == []


def test_an_effect_and_the_set_of_it_alone_have_each_their_probability(case, diagnoses):
    models = diagnoses.ranked(("yeoh", ("mullins",), 0.96), ("yeoh", ("mullins", "offset"), 0.03))
    found = diagnoses.diagnosis(case(), models=models, rivals=())
    more = replace(found, probability={**found.probability, "mullins": 0.99})
    assert headline(more) == "Missing physics: Mullins softening (99 %), with nothing else (96 %)"
    same = replace(found, probability={**found.probability, "mullins": 0.96})
    assert headline(same) == "Missing physics: Mullins softening (96 %)"


def test_recordings_that_can_show_nothing_are_said_to(case, diagnoses):
    found = diagnoses.diagnosis(case(), "explained")
    blind = replace(found.searched, untestable=dict.fromkeys(found.probability, "hidden"))
    assert "which can show none of the effects" in headline(replace(found, searched=blind))
    assert "can show none of the effects considered" in paragraph(replace(found, searched=blind))
    assert "can show none" not in headline(found) + paragraph(found)


def test_effects_that_cannot_be_simulated_are_not_in_the_catalogue_that_is_ruled_out(case, diagnoses):
    found = diagnoses.diagnosis(case(), "unexplained")
    lost = replace(found.searched, untestable={"mullins": NOT_SIMULATED})
    said = headline(replace(found, searched=lost))
    assert "not among the effects with which the bushing can be simulated" in said
    assert "in the catalogue of effects" in headline(found)


def test_a_misfit_within_the_noise_leaves_nothing_to_account_for(case, diagnoses):
    found = diagnoses.diagnosis(case())
    for times, says in (
        (1.2, "this accounts for all of the remaining misfit"),
        (0.9, "no larger than the noise"),
    ):
        channels = tuple(replace(one, after_percent=times * one.noise_percent) for one in found.channels)
        erring = replace(found, channels=channels, form_error=FormError(0.1, {"axial": 0.2}, 1.0))
        assert says in form_error_line(erring)


def test_what_all_rivals_have_is_said_once(case, diagnoses):
    models = diagnoses.ranked(("yeoh", ("mullins",), 0.6), ("yeoh", ("mullins", "friction"), 0.36))
    found = diagnoses.diagnosis(case(), models=models, rivals=(("mullins", "friction"),))
    assert headline(found) == (
        f"Missing physics: Mullins softening (more than 99 %), with nothing else (60 %), or with {phrase('friction')} "
        "(36 %); these recordings cannot tell them apart"
    )


def test_a_set_has_the_probability_of_all_its_laws(case, diagnoses):
    found = diagnoses.rivalling(case())
    # 0.58 with Yeoh, 0.04 with Ogden.
    assert [one.probability for one in likely(found)] == pytest.approx([0.62, 0.29, 0.05])


def test_a_group_without_a_name_is_told_in_its_words(case, diagnoses):
    group = Group("", ("friction", "viscoelasticity"), 0.97, "friction or viscoelasticity, at one rate alike")
    found = replace(diagnoses.dissipating(case()), groups=(group,))
    assert headline(found) == "Missing physics: friction or viscoelasticity, at one rate alike (97 %)"


def test_what_is_not_ruled_out_stands_beside_an_explanation(case, diagnoses):
    models = diagnoses.ranked(("yeoh", (), 0.8), ("yeoh", ("viscoelasticity",), 0.16))
    found = diagnoses.diagnosis(case(), "explained", models=models, rivals=(("viscoelasticity",),))
    assert headline(found).endswith("describes the recordings (80 %); not ruled out: viscoelasticity (16 %)")
    assert "Not ruled out: viscoelasticity (16 %)." in paragraph(found)


def test_text_says_where_what_how_sure_and_what_next(case, diagnoses):
    found = diagnoses.rivalling(case())
    assert max(map(len, text_of(found).splitlines())) <= 100
    text = flat(found)
    for words in (
        "axial: single bad samples, at 41.2, 66.0 and 88.7 s. What to do: nothing",
        "in the axial channel, on loading above 3 mm: the simulation is 8.6 % too soft there",
        "In the rubber (axial and radial together): a local change takes away 71 % of the misfit",
        "inverse_r 0.3120 ± 0.0080 0.296 to 0.328 0.0200 to 0.600",
        "m 0.102 ± 0.011 MPa",
        "Mullins softening (more than 99 %): Reloading below",
        "Dissipation (98 %): internal friction or viscoelasticity, which one rate cannot tell.",
        "These recordings cannot tell apart: ",
        "Axial to 6 mm",
        "0.83 of the 1.05 bits of information that are still open.",
        "assumed to err by 0.40 % in axial and 0.40 % in radial (rms, of the force range); this accounts for 96 % of "
        "the remaining misfit above the noise.",
        "radial (held out)",
        "7 models were fitted, the others predicted; fitting these too could shift 12 % of the probability",
        "Could not be solved from any start: Yeoh + swaging: the mesh folds at 0.8 mm.",
        f"Not detectable in these recordings: {phrase('batch_stiffness')} and {phrase('time_lag')} (reasons:",
        "problem coarse_noise",
    ):
        assert words in text, words


def test_probabilities_are_bars_the_largest_first(case, diagnoses):
    table = probability_table(diagnoses.rivalling(case()))
    assert [row[2] for row in table.rows] == ["> 99 %", "67 %", "31 %", "5 %", "2 %", "< 1 %", "-"]
    assert [row[0] for row in table.rows][-3:] == ["Unknown physics", "11 others, each", "2 not detectable"]
    lengths = [len(row[1]) for row in table.rows]
    assert lengths == sorted(lengths, reverse=True)
    # Certainty is 24 characters: 0.67 of that is 16 and an eighth.
    assert lengths[1] == 17


def test_a_value_in_the_paragraph_has_the_digits_of_the_table(case, diagnoses):
    found = diagnoses.rivalling(case())
    (known,) = [one for one in found.effects if one.name == "mullins"]
    stiff = replace(known.parameters["inverse_r"], value=8.1e-5, std=1.31e-6, derived={"r": (12345.0, "1")})
    text = parameters_text(replace(known, parameters={"inverse_r": stiff}), found.channels)
    assert text == "r = 12345 ± 200"
    loose = replace(known.parameters["m"], value=4.4659, std=1.6, derived={})
    assert parameters_text(replace(known, parameters={"m": loose}), found.channels) == "m = 4.5 ± 1.6 MPa"


def test_a_logarithm_is_given_as_the_factor_that_people_think_of(case, diagnoses):
    """To first order the error of exp(x) is exp(x) times that of x: 0.564 * 0.0048 = 0.0027."""
    log = Quantity(-0.5725, 0.0048, "1", "factor", -0.582, -0.563)
    (parameter,) = effect("batch_stiffness").parameters
    found = replace(log, derived=derived(parameter, log.value, Material("yeoh", math.inf, {})))
    batch = replace(diagnoses.MULLINS, name="batch_stiffness", parameters={"log_factor": found})
    assert parameters_text(batch, ()) == "factor = 0.5641 ± 0.0027"


def test_an_effect_that_cannot_be_shown_is_not_called_improbable(case, diagnoses):
    found = diagnoses.rivalling(case())
    found = replace(found, probability=found.probability | {"batch_stiffness": 0.0, "time_lag": 0.0})
    rows = {row[0]: row[2] for row in probability_table(found).rows}
    assert (rows["11 others, each"], rows["2 not detectable"]) == ("< 1 %", "-")
    note = " ".join(probability_figure(found).get_supxlabel().split())
    excluded, hidden = note.split(" not detectable in these recordings: ")
    assert phrase("permanent_set") in excluded
    assert phrase("batch_stiffness") not in excluded
    assert hidden == f"{phrase('batch_stiffness')}, {phrase('time_lag')}"
    # Beside another effect it may show, and then it has a bar.
    shown = replace(found, probability=found.probability | {"time_lag": 0.3})
    rows = {row[0]: row[2] for row in probability_table(shown).rows}
    assert (rows[title("time_lag")], rows[title("batch_stiffness")]) == ("30 %", "-")


def test_the_rows_of_probabilities_count_unknown_physics(case, diagnoses):
    found = diagnoses.rivalling(case())
    found = replace(found, probability=found.probability | {"unknown": 1e-4})
    assert probability_table(found).rows[-2][0] == "12 others, each"


def test_the_table_of_models_ends_at_95_percent(case, diagnoses):
    table = model_table(diagnoses.rivalling(case()))
    rows = table.rows
    assert [row[2] for row in rows] == ["58 %", "87 %", "92 %", "96 %"]
    assert rows[0][0] == model_title("yeoh", ("mullins", "friction"))
    short = table.shortened(2)
    assert ([row[2] for row in short.rows], short.title) == (["58 %", ""], f"{table.title} (4 in all)")


def test_unknown_physics_is_told_where_it_is_probable(case, diagnoses):
    found = diagnoses.diagnosis(case(), "unexplained")
    assert "What is missing With a probability of more than 99 %" in flat(found)
    hardly = diagnoses.rivalling(case())
    assert "What is missing" not in text_of(hardly)
    page = page_of(hardly)
    assert "Misfit that the most probable model leaves" in page


def test_the_form_error_says_how_much_it_covers(case, diagnoses):
    found = diagnoses.diagnosis(case())
    assert "do not show beside the noise" in form_error_line(
        replace(found, form_error=FormError(0.0, {}, 1.0))
    )
    half = {"axial": 0.5, "radial": 0.0}
    assert form_error_line(replace(found, form_error=FormError(0.1, half, 0.3))).endswith(
        "assumed to err by 0.50 % in axial (rms, of the force range); this accounts for only 30 % of the remaining "
        "misfit above the noise"
    )
    # With unknown physics the remaining misfit is not noise.
    unknown = diagnoses.diagnosis(case(), "unexplained")
    assert form_error_line(replace(unknown, form_error=FormError(0.0, half, 1.0))) == (
        "The unknown force, of 0.50 % in axial (rms, of the force range), accounts for all of the remaining misfit "
        "above the noise"
    )


def test_the_search_says_whether_it_was_complete(case, diagnoses):
    found = diagnoses.diagnosis(case())
    assert searched_lines(found)[0].endswith(
        "fitted, the others predicted; fitting these too could shift less than 1 % of the probability"
    )
    stopped = replace(found.searched, complete=False, left=0.004, ended="interrupted")
    assert searched_lines(replace(found, searched=stopped))[0] == (
        "4 models were fitted, the others predicted; fitting these too could shift less than 1 % of the probability"
        ": the search was interrupted"
    )
    assert searched_lines(diagnoses.diagnosis(case(), "faulty_data")) == []


def test_a_search_that_ended_early_names_its_best_model(case, diagnoses):
    found = diagnoses.diagnosis(case(), "unexplained")
    early = replace(
        found, searched=replace(diagnoses.diagnosis(case()).searched, left=0.9, ended="budget"), models=()
    )
    assert early.unsearched
    said = flat(early)
    assert "Not diagnosed: the search ended before it could tell which effects are probable" in said
    solved = [one for one in early.searched.trials if np.isfinite(one.log_evidence)]
    assert f"Of the {len(solved)} models fitted so far Yeoh + " in said
    only_law = replace(early.searched, trials=early.searched.trials[:1])
    assert "models fitted so far" not in flat(replace(early, searched=only_law))


def test_faults_of_the_data_are_told_once(case, diagnoses):
    """Even where they are also conditions of the result; the JSON has both."""
    doubt = Condition("bad_samples", "axial: at 41.2, 66.0 and 88.7 s", "nothing: they are left out")
    found = replace(diagnoses.rivalling(case()), conditions=(doubt,))
    document = report.diagnosis_json(found, {})
    assert document["problems"][0]["name"] == "bad_samples"
    assert text_of(found).count("at 41.2") == 1
    assert page_of(found).count("at 41.2") == 1


def test_a_map_of_what_has_a_cause_says_so(case, diagnoses):
    words = "The map shows the misfit of the plain law; the most probable cause is Mullins softening."
    found = diagnoses.diagnosis(case())
    assert words in flat(found)
    nowhere = replace(found.maps[0], helps_locally=False)
    assert "The map shows" not in text_of(replace(found, maps=(nowhere,)))
    assert "The map shows" not in text_of(diagnoses.diagnosis(case(), "unexplained"))


def test_where_one_model_holds_95_percent_there_are_no_rivals(case, diagnoses):
    found = diagnoses.diagnosis(case())
    assert rival_lines(found) == []
    assert "cannot tell apart" not in text_of(found)


def test_titles_of_narrow_tables_are_not_wrapped(case, diagnoses):
    assert "Rms misfit, % of the force range\n" in text_of(diagnoses.diagnosis(case()))


def test_what_remains_is_told_only_when_there_is_something(case, diagnoses):
    assert "After the most probable model:" not in text_of(diagnoses.diagnosis(case()))
    partly = diagnoses.diagnosis(case(), channels=(diagnoses.channel(explained=False),))
    assert "After the most probable model:" in text_of(partly)


def test_a_fixed_law_is_told_with_its_source(case, diagnoses):
    assert "Yeoh law: C10 0.5000, C20 -0.05000, C30 0.01000 (fixed, from the coupons)" in text_of(
        diagnoses.diagnosis(case(), law_from="coupons", law_fixed=True)
    )


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
    # The outlines of loading and unloading would have opposite senses, and cut holes into each other.
    found = diagnoses.diagnosis(case())
    for region in curve_plot(found, found.channels[0]).regions:
        for x, y in (outline.T for outline in region.outlines):
            assert x @ np.roll(y, -1) - y @ np.roll(x, -1) >= 0


def enclosed(region):
    """Area of all outlines, each by itself."""
    return sum((x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2 for x, y in (part.T for part in region.outlines))


def test_an_area_on_the_way_there_and_back_is_not_cancelled(case, diagnoses):
    """If the model is twice as stiff everywhere, the outline of the whole path would enclose nothing."""
    _, q = diagnoses.program([3.0, 6.0], 0.5)
    force = 100.0 * q
    one = replace(
        diagnoses.channel(),
        recording=Recording("axial", q, force, name="axial"),
        before=2 * force,
        after=force,
        path=q,
        faulty=np.zeros(len(q), dtype=bool),
    )
    found = diagnoses.diagnosis(case(), channels=(one,))
    (region,) = curve_plot(found, one).regions
    assert found.location.mismatch[0].samples.all()
    # A triangle of area q * 100 q / 2 on loading and one on unloading.
    assert enclosed(region) == pytest.approx(2 * (50 * 3**2 + 50 * 6**2))


def test_curves_of_several_channels_are_told_apart(case, diagnoses):
    found = diagnoses.rivalling(case())
    for plot in (curve_plot, time_plot):
        assert "<strong>radial (held out)</strong>" in svg(plot(found, found.channels[1]))
    alone = diagnoses.diagnosis(case())
    assert "<strong>" not in svg(curve_plot(alone, alone.channels[0]))


def test_the_misfit_is_in_percent(case, diagnoses):
    found = diagnoses.diagnosis(case())
    (one,) = found.channels
    plot = time_plot(found, one)
    before, after = plot.series
    for series, expected in ((before, one.before_percent), (after, one.after_percent)):
        assert np.sqrt(np.mean(series.y**2)) == pytest.approx(expected)
    (noise,) = plot.bands
    assert noise[2:4] == pytest.approx((-2 * one.noise_percent, 2 * one.noise_percent))


def test_faulty_samples_are_marked_and_belong_to_no_line(case, diagnoses):
    found = diagnoses.rivalling(case())
    one = found.channels[0]
    curve, misfit = curve_plot(found, one), time_plot(found, one)
    assert [series.key for series in curve.series] == ["before", "after", "recorded", "faulty"]
    assert np.isnan(curve.series[2].y[one.faulty]).all()
    assert np.isfinite(curve.series[3].y).sum() == 3
    assert all(np.isnan(series.y[one.faulty]).all() for series in misfit.series)
    # A single sample and two neighbours, marked from the midpoint before them to the midpoint after them.
    t = one.recording.time
    ends = [band[:2] for band in misfit.bands if band[4] == "faulty"]
    assert ends == [
        pytest.approx((t[a - 1 : a + 1].mean(), t[b : b + 2].mean())) for a, b in ((40, 40), (90, 91))
    ]
    # The spikes do not extend the axis.
    assert misfit.y[1] < 20.0


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
        "axial, most probable model: loading",
        "axial, most probable model: unloading",
    ]
    cells = [sum(len(one.get_paths()) for one in axes.collections) for axes in figure.axes[:4]]
    assert cells[0] == cells[2] == sum(b.branch == "loading" for b in found.location.bins)
    # Where the misfit is noise, hardly any bin is marked.
    dots = [
        sum(len(line.get_xdata()) for line in axes.lines if line.get_marker() == "o")
        for axes in figure.axes[:4]
    ]
    assert dots[0] > 10 * dots[2]


def test_a_bar_is_as_long_as_its_probability(case, diagnoses):
    axes = probability_figure(diagnoses.rivalling(case())).axes[0]
    # Behind each bar lies a background as wide as the picture.
    drawn = [patch.get_width() for patch in axes.patches if patch.get_width() < 100.0]
    assert drawn == pytest.approx([99.4, 67.0, 31.0, 5.0, 2.1])
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert labels == [title(name) for name in ("mullins", "friction", "viscoelasticity", "offset", "unknown")]
    assert [text.get_text() for text in axes.texts] == ["> 99 %", "67 %", "31 %", "5 %", "2 %"]


def test_each_value_lies_beside_its_prior(case, diagnoses):
    figure = prior_figure(diagnoses.rivalling(case()))
    assert len(figure.axes) == 5
    prior, posterior = figure.axes[0].patches
    assert (prior.get_x(), prior.get_x() + prior.get_width()) == pytest.approx((0.02, 0.6))
    assert (posterior.get_x(), posterior.get_x() + posterior.get_width()) == pytest.approx((0.296, 0.328))
    assert [axes.get_xscale() for axes in figure.axes[:3]] == ["log", "log", "linear"]


def test_a_prior_of_the_absolute_value_lies_on_both_sides(case, diagnoses):
    figure = prior_figure(diagnoses.torsional(case()))
    one, other, _ = figure.axes[0].patches
    assert (one.get_width(), other.get_x()) == (60.0, -60.0)
    # 0.01 rad; a value that is positive has no second side.
    assert len(figure.axes[1].patches) == 2
    assert figure.axes[1].patches[0].get_width() == pytest.approx(0.57296, abs=1e-5)


def test_what_is_missing_is_drawn_by_all_that_it_may_depend_on(case, diagnoses):
    found = diagnoses.diagnosis(case(), "unexplained")
    (one,) = found.channels
    figure = missing_figure(one, found.missing.profiles)
    assert [axes.get_xlabel() for axes in figure.axes] == [
        "displacement [mm]",
        "time [s]",
        "cycle",
        "rate [mm/s]",
    ]
    loading = found.missing.profiles[0]
    (band, _) = figure.axes[0].collections
    reach = band.get_paths()[0].vertices[:, 1]
    assert reach.max() == pytest.approx((loading.mean + 2 * loading.std).max())
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == ["loading", "unloading"]


@pytest.mark.parametrize("alongs", [("cycle",), ("displacement", "time", "cycle")])
def test_panels_without_a_profile_are_left_out(case, diagnoses, alongs):
    found = diagnoses.diagnosis(case(), "unexplained")
    own = [one for one in found.missing.profiles if one.along in alongs]
    figure = missing_figure(found.channels[0], own)
    assert sum(axes.get_visible() for axes in figure.axes) == len(alongs)


def test_angles_of_what_is_missing_are_degrees(case, diagnoses):
    found = diagnoses.torsional(case())
    axes = missing_figure(found.channels[0], found.missing.profiles).axes[0]
    assert axes.get_xlabel() == "rotation [deg]"
    assert axes.lines[1].get_xdata().max() == pytest.approx(22.918, abs=1e-3)


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
    for one, faces, kind in ((flat, 2 * 2, 5), (solid, 6 * 2, 10)):
        (drawn,) = (c for c in map_figure(one).axes[0].collections if isinstance(c, PolyCollection))
        assert len(drawn.get_paths()) == faces
        root = ET.fromstring(map_vtu(one))
        arrays = {a.get("Name"): np.array(a.text.split(), dtype=float) for a in root.iter("DataArray")}
        assert (arrays["types"] == kind).all()
        assert np.array_equal(arrays["connectivity"].reshape(one.cells.shape), one.cells)


@pytest.mark.slow
def test_a_channel_without_places_in_its_record_has_no_picture_of_them(case, diagnoses):
    """For example a channel that is held out."""
    found = diagnoses.diagnosis(case(), "missing_physics")
    names = {one.name: one.name for one in (*found.channels, *found.maps)}
    assert any(one.kind == "record_map" for one in diagnosis_figures(found, names))
    bare = replace(found, location=replace(found.location, bins=()))
    assert not any(one.kind == "record_map" for one in diagnosis_figures(bare, names))


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


@pytest.mark.slow
def test_the_folder_holds_all_that_the_report_shows(case, diagnoses, tmp_path):
    # As if there were an axial channel, too.
    together = diagnoses.half_plane(across=2, along=2, names=("axial", "torsional"))
    found = replace(diagnoses.torsional(case()), maps=(together,))
    document = report.diagnosis_json(found, {"total": 1.0})
    files = report.diagnosis_files(found)
    paths = report.write(
        tmp_path / "out", document, files, lambda seen: report.diagnosis_document(found, seen)
    )
    written = {path.name for path in paths}
    assert {"result.json", "report.html", "torsional-diagnosis.csv", "torsional-diagnosis.png"} <= written
    assert {"probabilities.png", "priors.svg", "torsional-missing.png"} <= written
    assert {f"axial_torsional-bushing-map.{ending}" for ending in ("vtu", "png", "svg")} <= written
    assert not any(set(name) & set(" +") for name in written)
    rows = (tmp_path / "out" / "torsional-diagnosis.csv").read_text().splitlines()
    assert rows[0] == (
        "rotation_deg,recorded_moment_Nmm,plain_moment_Nmm,final_moment_Nmm,missing_moment_Nmm,faulty"
    )
    last = [float(value) for value in rows[-1].split(",")]
    one = found.channels[0]
    assert last == pytest.approx(
        [
            np.degrees(one.recording.displacement[-1]),
            one.recording.force[-1],
            one.before[-1],
            one.after[-1],
            found.missing.force["torsional"][-1],
            0.0,
        ]
    )


@pytest.mark.parametrize("kind", KINDS)
def test_every_verdict_has_its_page(case, diagnoses, kind):
    found = diagnoses.diagnosis(case(), kind, maps=())
    text = page_of(found)
    assert headline(found) in text
    assert paragraph(found) in text
    assert ("What was left out" in text) == (kind == "missing_physics")
    assert "Where in the bushing" not in text
    assert ("What is missing" in text) == (kind == "unexplained")
    assert ("Data faults" in text) == (kind == "faulty_data")
    assert "Provenance" in text
    assert ("Before and after" in text) == (kind != "faulty_data")
    if found.models:
        assert "How far the search went" in text
        # Each model that was fitted, and each effect that cannot be seen with the reason.
        assert text.count("cannot be solved from any start") == 1
        assert "Not detectable in these recordings" in text
        assert "one rate only: a lag looks like friction" in text
    # The terminal has the places as text; the page has them beside the curves. Of faulty data nothing is said.
    places = section_of(found, "Where in the record")
    said = [one.text for one in places if one.on == "terminal"]
    assert [one.split(". ", 1)[-1] for one in said] == (
        list(sentences(found.location)) if found.location.mismatch and kind != "faulty_data" else []
    )
    assert not any(place in text for place in said)


def test_the_page_runs_its_own_script_and_no_other(case, diagnoses):
    doubt = Condition("strange", "<script>alert(1)</script>", "</script>")
    found = diagnoses.diagnosis(case('<script>alert("x")</script>'), conditions=(doubt,))
    found = replace(found, probability={})
    pictures = diagnosis_figures(replace(found, maps=()), {"axial": "axial"})
    text = page_of(found, pictures)
    assert text.count("<script>") == 1
    assert "script-src &#39;sha256-" in text or "script-src 'sha256-" in text
    # Curves are in the page as plots, not as pictures.
    assert text.count("<img ") == text.count('src="data:image/') == 2
    assert "http://" not in text
    assert "https://" not in text
    assert "url(" not in text


def test_models_with_the_same_effects_are_distinguished():
    assert model_title("yeoh", ("viscoelasticity",), {"viscoelasticity": "2 branches"}) == (
        "Yeoh + viscoelasticity (2 branches)"
    )
    assert model_title("yeoh", (), {}) == "Yeoh alone"


def test_no_effect_is_not_named_as_missing_physics(case, diagnoses):
    """Several effects may be probable together though none of them is: "no effect" is then what is not ruled out."""
    found = replace(
        diagnoses.rivalling(case()),
        models=diagnoses.ranked(
            ("yeoh", ("viscoelasticity",), 0.4), ("yeoh", (), 0.33), ("yeoh", ("friction",), 0.27)
        ),
        effects=(
            replace(diagnoses.FRICTION, name="viscoelasticity", title="Viscoelasticity", probability=0.4),
        ),
        rivals=((), ("friction",)),
        groups=(),
        probability={"viscoelasticity": 0.4, "friction": 0.27, "nothing": 0.33},
    )
    assert headline(found) == (
        "Missing physics: viscoelasticity (40 %), or internal friction (27 %); these recordings cannot tell them "
        "apart; not ruled out: no effect (33 %)"
    )
    assert "probably leaves something out (67 %): most probably viscoelasticity (40 %)." in paragraph(found)


def test_with_chosen_effects_the_rest_is_not_said_to_be_unknown(case, diagnoses):
    found = replace(diagnoses.diagnosis(case(), "unexplained"), asked=("offset",))
    text = " ".join(missing_lines(found))
    assert "is explained by none of the effects asked for" in text
    assert "no known effect" not in text


def test_the_headline_says_that_what_was_held_out_is_missed(case, diagnoses):
    found = diagnoses.rivalling(case())
    missed = replace(
        found, conditions=(Condition("held_out_missed", "radial by 3.5 %", "do not rely on it"),)
    )
    assert "held out" not in headline(replace(found, conditions=()))
    assert headline(missed).endswith("; but it does not predict what was held out")
