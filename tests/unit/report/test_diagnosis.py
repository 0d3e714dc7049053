"""A diagnosis in JSON, text, pictures and files."""

import io
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from bushcli import report
from bushcli.case import Material
from bushcli.diagnosis.result import DiagnosedEffect, FormError, Group, Quantity
from bushcli.diagnosis.values import derived_values
from bushcli.diagnosis.words import sentences
from bushcli.effects.effect import effect
from bushcli.effects.titles import phrase, title
from bushcli.faults import DataFault
from bushcli.report.document import Paragraph, on
from bushcli.report.drawing.results import diagnosis_pictures, pictures_of
from bushcli.report.plots.certainty import prior_panels, probability_panels
from bushcli.report.plots.diagnosis import curve_plot
from bushcli.report.views.diagnosis.document import bar, model_table, probability_table
from bushcli.report.views.diagnosis.paragraph import paragraph, short_paragraphs
from bushcli.report.views.diagnosis.values import parameters_text
from bushcli.report.views.diagnosis.words import (
    chance,
    form_error_line,
    headline,
    law_title,
    likely,
    model_title,
    next_test_lines,
    together,
    tone,
)
from bushcli.report.writers.files import write
from bushcli.report.writers.page import page
from bushcli.report.writers.terminal import terminal_text
from bushcli.runtime.condition import Condition
from bushcli.selection.search_extent import NOT_SIMULATED

KINDS = ("explained", "missing_physics", "law_too_poor", "unexplained", "faulty_data")


def text_of(found, width=100):
    stream = io.StringIO()
    Console(width=width, no_color=True, file=stream).print(terminal_text(report.as_document(found)))
    return stream.getvalue()


def page_of(found, pictures=()):
    return page(report.as_document(found), report.as_json(found), pictures)


def section_of(found, heading, pictures=()):
    """Return the paragraphs and tables of a section of the document; None if there is no such section."""
    known = {one.heading: one for one in report.as_document(found).with_pictures(pictures).sections}
    return known[heading].blocks if heading in known else None


def flat(found):
    """Return the text without line breaks."""
    return " ".join(text_of(found).split())


# -- JSON ------------------------------------------------------------------------------------------------------------


def test_json_is_what_scripts_rely_on(case, diagnoses):
    found = diagnoses.rivalling(case())
    document = report.as_json(found)
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
    document = report.as_json(diagnoses.diagnosis(case(), kind))
    json.dumps(document, allow_nan=False)
    assert document["verdict"] == kind
    assert document["text"].startswith(("The ", "A diagnosis is possible only after"))


def test_a_choice_is_a_word(case, diagnoses):
    bond = Quantity(1.0, np.nan, "1", "which end is free", np.nan, np.nan, word="outer_top")
    free = DiagnosedEffect("debonding", "Debonding", "A bond is free.", {"bond": bond}, 0.97, 30.0, True)
    found = diagnoses.diagnosis(case(), effects=(free,), parameters={"debonding.bond": bond})
    value = report.as_json(found)["effects"][0]["parameters"]["bond"]
    assert (value["value"], value["std"], value["prior"]) == ("outer_top", None, None)
    assert "(Debonding: bond: outer top)" in paragraph(found)
    assert prior_panels(found) is None


def test_angles_are_reported_in_degrees(case, diagnoses):
    found = diagnoses.torsional(case())
    document = report.as_json(found)
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
    document = report.as_json(diagnoses.diagnosis(case(), next_test=test))
    assert document["next_test"]["unit"] == "deg"
    assert document["next_test"]["rates"] == pytest.approx([5.7296] * 4, abs=1e-4)


def test_rivals_in_another_rig_are_told_by_it(case, diagnoses):
    models = diagnoses.ranked(("yeoh", ("offset",), 0.5))
    rivals = (("offset@radial",), ("offset@radial", "friction"))
    found = report.as_json(diagnoses.diagnosis(case(), models=models, rivals=rivals))
    assert found["rivals"] == [["offset@radial"], ["offset", "friction"]]


def test_equal_prior_odds_are_told(case, diagnoses):
    found = diagnoses.rivalling(case())
    for given in (False, True):
        asked = replace(found, uniform_odds=given)
        said = [one.text for one in section_of(asked, "How probable each effect is") if hasattr(one, "text")]
        assert any("the same prior odds" in text for text in said) == given
        assert report.as_json(asked)["uniform_odds"] is given


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
    found = diagnoses.rivalling(case())
    what, _, effects, gain, rivals, test, searched = short_paragraphs(found)
    assert headline(found).removeprefix("Missing physics: ") in what
    # Parameters have their names in the literature; an effect that is not certain always has its probability.
    assert "Mullins softening: r = 3.205 ± 0.082, m = 0.102 ± 0.011 MPa" in effects
    assert "(Internal friction, 67 %: g = 0.140 ± 0.020" in effects
    assert "radial, held out, from 3" in gain
    assert f"{together(('mullins', 'friction'))} (62 %)" in rivals
    assert diagnoses.NEXT.text in test
    assert "12 %" in searched


def test_the_paragraph_says_what_became_of_the_law(case, diagnoses):
    other = replace(diagnoses.YEOH, law="mooney_rivlin")
    assert "Yeoh law in place of Mooney-Rivlin" in paragraph(diagnoses.diagnosis(case(), plain=other))
    fixed, free = (
        diagnoses.diagnosis(case(), law_from="coupons", law_fixed=known) for known in (True, False)
    )
    assert "identified from the recordings" not in paragraph(fixed)
    assert "identified from the recordings" in paragraph(free)
    assert "C10 0.5000, C20 -0.05000, C30 0.01000 (fixed, from the coupons)" in text_of(fixed)


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


def test_nothing_helps_means_nothing_that_was_asked_for(case, diagnoses):
    found = diagnoses.diagnosis(case(), "unexplained", asked=("viscoelasticity", "time_lag"))
    asked = f"not among the effects asked for (viscoelasticity and {phrase('time_lag')})"
    assert asked in headline(found)
    assert asked in paragraph(found)
    assert report.as_json(found)["asked"] == ["viscoelasticity", "time_lag"]
    assert report.as_json(diagnoses.diagnosis(case()))["asked"] is None


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


def test_a_set_has_the_probability_of_all_its_laws(case, diagnoses):
    found = diagnoses.rivalling(case())
    # 0.58 with Yeoh, 0.04 with Ogden.
    assert [one.probability for one in likely(found)] == pytest.approx([0.62, 0.29, 0.05])


def test_what_is_not_ruled_out_stands_beside_an_explanation(case, diagnoses):
    models = diagnoses.ranked(("yeoh", (), 0.8), ("yeoh", ("viscoelasticity",), 0.16))
    found = diagnoses.diagnosis(case(), "explained", models=models, rivals=(("viscoelasticity",),))
    assert headline(found).endswith("describes the recordings (80 %); not ruled out: viscoelasticity (16 %)")
    assert "Not ruled out: viscoelasticity (16 %)." in paragraph(found)


def test_the_document_says_where_what_how_sure_and_what_next(case, diagnoses):
    found = diagnoses.rivalling(case())
    assert max(map(len, text_of(found).splitlines())) <= 100
    document = report.as_document(found)
    sections = {one.heading: on("terminal", [one]) for one in document.sections}
    kept = {heading: one[0].blocks for heading, one in sections.items() if one}
    said = {
        heading: [one.text for one in blocks if isinstance(one, Paragraph)]
        for heading, blocks in kept.items()
    }
    rows = {
        one.title: one.without_detail().rows
        for blocks in kept.values()
        for one in blocks
        if hasattr(one, "rows")
    }
    assert list(kept) == [
        "How probable each effect is",
        "The most probable models",
        "What was left out",
        "Before and after",
        "Where in the record",
        "Where in the bushing",
        "Parameters",
        "Next test",
        "How far the search went",
    ]
    group, sets = said["How probable each effect is"]
    assert group == "Dissipation (98 %): internal friction or viscoelasticity, which one rate cannot tell."
    assert sets.count("%)") == len(likely(found))
    assert [text.split(":")[0] for text in said["What was left out"]] == [
        f"{one.label} ({chance(one.probability)})" for one in found.effects
    ]
    values = rows["Values with 95 % intervals: posterior and prior"]
    assert values[0] == (
        "Mullins softening",
        "inverse_r",
        "0.3120 ± 0.0080",
        "0.296 to 0.328",
        "0.0200 to 0.600",
    )
    assert values[1][:3] == ("", "m", "0.102 ± 0.011 MPa")
    assert [row[0] for row in rows["Rms misfit, % of the force range"]] == ["axial", "radial (held out)"]
    assert said["Before and after"][0].count("0.40 %") == 2
    # Each place of the misfit, by its number.
    places = list(sentences(found.location))
    assert said["Where in the record"][: len(places)] == [
        f"{n}. {place}" for n, place in enumerate(places, 1)
    ]
    assert said["Where in the bushing"][0].startswith("In the rubber (axial and radial together): ")
    assert diagnoses.NEXT.text[1:] in said["Next test"][0]
    assert "0.83 of the 1.05 bits" in said["Next test"][1]
    fitted, lost, hidden, solved = said["How far the search went"]
    assert fitted.startswith(f"{len(found.searched.trials)} models were fitted")
    assert found.searched.lost[0] in lost
    assert all(phrase(name) in hidden for name in found.searched.untestable)
    assert solved.startswith(f"{found.forward_solves} simulations")
    (fault,) = (one.text for one in document.warning.blocks if isinstance(one, Paragraph))
    assert fault.startswith("axial: single bad samples, at 41.2, 66.0 and 88.7 s. What to do: ")
    assert [one.name for one in document.problems] == ["coarse_noise"]


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
    found = replace(log, derived=derived_values(parameter, log.value, Material("yeoh", math.inf, {})))
    batch = replace(diagnoses.MULLINS, name="batch_stiffness", parameters={"log_factor": found})
    assert parameters_text(batch, ()) == "factor = 0.5641 ± 0.0027"


def test_an_effect_that_cannot_be_shown_is_not_called_improbable(case, diagnoses):
    found = diagnoses.rivalling(case())
    found = replace(found, probability=found.probability | {"batch_stiffness": 0.0, "time_lag": 0.0})
    rows = {row[0]: row[2] for row in probability_table(found).rows}
    assert (rows["11 others, each"], rows["2 not detectable"]) == ("< 1 %", "-")
    excluded, hidden = probability_panels(found).note.split(" Not detectable in these recordings: ")
    assert phrase("permanent_set") in excluded
    assert phrase("batch_stiffness") not in excluded
    assert hidden == f"{phrase('batch_stiffness')}, {phrase('time_lag')}."
    # Beside another effect it may show, and then it has a bar (`answer.search_extent`).
    searched = replace(found.searched, untestable={"batch_stiffness": "hidden"})
    shown = replace(found, probability=found.probability | {"time_lag": 0.3}, searched=searched)
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
    short = table.without_middle(2)
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
    fast = "0.33 % in axial changes too fast along the branches to count, as hum or rounding does"
    hum = form_error_line(replace(found, form_error=FormError(0.1, {"axial": 0.001}, 1.0, {"axial": 0.33})))
    assert hum == (
        f"Errors of the formulas do not show beside the noise: of the misfit of the most probable model {fast}"
    )
    both = form_error_line(replace(found, form_error=FormError(0.1, half, 1.0, {"axial": 0.33})))
    assert both.endswith(f"above the noise that is smooth along the branches; {fast}")
    # With unknown physics the remaining misfit is not noise.
    unknown = diagnoses.diagnosis(case(), "unexplained")
    assert form_error_line(replace(unknown, form_error=FormError(0.0, half, 1.0))) == (
        "The unknown force, of 0.50 % in axial (rms, of the force range), accounts for all of the remaining misfit "
        "above the noise"
    )


def test_a_search_that_ended_early_names_its_best_model(case, diagnoses):
    found = diagnoses.diagnosis(case(), "unexplained")
    early = replace(
        found, searched=replace(diagnoses.diagnosis(case()).searched, left=0.9, ended="budget"), models=()
    )
    assert early.is_unsearched
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
    document = report.as_json(found)
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


def test_what_remains_is_told_only_when_there_is_something(case, diagnoses):
    assert "After the most probable model:" not in text_of(diagnoses.diagnosis(case()))
    partly = diagnoses.diagnosis(case(), channels=(diagnoses.channel(explained=False),))
    assert "After the most probable model:" in text_of(partly)


# -- files -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_folder_holds_all_that_the_report_shows(case, diagnoses, tmp_path):
    # As if there were an axial channel, too.
    together = diagnoses.half_plane(across=2, along=2, names=("axial", "torsional"))
    found = replace(diagnoses.torsional(case()), maps=(together,))
    document = report.as_json(found)
    files = report.as_files(found)
    paths = write(tmp_path / "out", document, files, lambda: report.as_document(found))
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
    assert all(line in text for line in short_paragraphs(found))
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
    pictures = pictures_of(diagnosis_pictures(replace(found, maps=()), {"axial": "axial"}))
    text = page_of(found, pictures)
    assert text.count("<script>") == 1
    assert "script-src &#39;sha256-" in text or "script-src 'sha256-" in text
    # What is drawn of plots is in the page as plots, not as pictures.
    assert "<img " not in text
    assert text.count('<figure class="plot') > 4
    assert "http://" not in text
    assert "https://" not in text
    assert "url(" not in text


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


def test_the_headline_says_that_what_was_held_out_is_missed(case, diagnoses):
    found = diagnoses.rivalling(case())
    missed = replace(
        found, conditions=(Condition("held_out_missed", "radial by 3.5 %", "do not rely on it"),)
    )
    assert "held out" not in headline(replace(found, conditions=()))
    assert headline(missed).endswith("; but it does not predict what was held out")


def test_a_law_that_explains_doubtful_data_is_no_good_news(case, diagnoses):
    """Rubber a thousand times too soft is described by a law a thousand times too soft."""
    found = diagnoses.diagnosis(case(), "explained")
    doubt = DataFault(found.channels[0].name, "unit", "soft", "units", False, probability=0.97)
    document = report.as_document(replace(found, faults=(doubt,)))
    assert report.as_document(found).tone == "good"
    assert document.tone == "plain"
    assert document.lines[0].startswith("Doubtful data: wrong unit in the ")
    assert "(97 %)" in document.lines[0]
