"""Frozen decks: drawn recordings, the simulated logger, digests, the ledger, and the rules of the scores."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.concealed.truth import Specimen
from benchmarks.decks import drawing, fresh, ledger, manifest, outside, plan, report, score, summary, why
from benchmarks.decks.answer import UNKNOWN, answer_of
from benchmarks.decks.foreign import component
from benchmarks.decks.foreign.formulas import FORMULAS
from benchmarks.decks.foreign.halfplane import Bond, HalfPlane, curve
from benchmarks.decks.foreign.rubbers import (
    BergstroemBoyce,
    Damage,
    DorfmannOgden,
    Holzapfel,
    Law,
    Simo,
    det,
    inverse,
)
from benchmarks.decks.manifest import Entry, Program, Sensor
from benchmarks.decks.odds import frequencies, independent_odds, reweigh, tool_odds
from benchmarks.decks.run import run_all
from benchmarks.decks.sensing import compare_digests, correlated_noise, digest, logged_signals
from bushcli.effects.effect import effects, effects_on
from bushcli.evidence.prior import FILLED

Array = NDArray[np.float64]

BODY = Specimen(
    "plain",
    {"inner_radius": 10.0, "outer_radius": 18.0, "length": 30.0},
    "yeoh",
    {"C10": 0.5},
    2000.0,
    {"axial": 4.0},
)
SENSOR = Sensor(1.004, 0.4, 0.5, 2e-4, (1, 2, 3))
ENTRY = Entry(
    "007", "own", "single", "rich", (1, 2), BODY, (Program("axial", ((1.0, 1.0), (0.0, 1.0)), 60.0, 100),), (SENSOR,),
    effects={"friction": {"g": 0.2}}, truth=("friction",), strength={"friction": 20.0}, look_alikes=(),
)  # fmt: skip


# -- what is drawn -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("deck", "count"),
    [
        ("own", 100),
        ("foreign", 60),
        ("nothing", 40),
        ("dev", 60),
        ("poor", 54),
        ("second", 63),
        ("third", 69),
    ],
)
def test_a_deck_has_its_number_of_recordings_whose_plan_does_not_change(deck: str, count: int) -> None:
    cards = plan.cards(deck)
    assert len(cards) == count
    assert cards == plan.cards(deck)
    assert len({card.seed for card in cards.values()}) == count


def test_the_own_deck_has_each_effect_of_its_day_five_times_alone() -> None:
    names = [entry.truth[0] for entry in manifest.read("own").values() if entry.kind == "single"]
    assert len(set(names)) == 16
    assert {names.count(name) for name in set(names)} == {5}
    assert set(names) <= set(effects())


def test_foreign_formulas_are_there_and_name_effects_of_the_catalogue() -> None:
    names = {
        card.names[0]
        for deck in ("foreign", "dev", "poor")
        for card in plan.cards(deck).values()
        if card.part == "foreign"
    }
    assert names <= set(FORMULAS)
    for formula in FORMULAS.values():
        assert set(formula.truth) <= set(effects())


def test_sensors_are_drawn_from_the_seed_alone() -> None:
    one, two = (drawing.sensors(np.random.default_rng(5), (5,), ("axial", "radial")) for _ in range(2))
    assert one == two
    assert one != drawing.sensors(np.random.default_rng(6), (6,), ("axial", "radial"))


def test_a_manifest_is_read_as_it_was_written(tmp_path: Path) -> None:
    manifest.put("some", ENTRY, tmp_path)
    manifest.put("some", replace(ENTRY, name="008", look_alikes=None), tmp_path)
    assert manifest.read("some", tmp_path) == {
        "007": ENTRY,
        "008": replace(ENTRY, name="008", look_alikes=None),
    }


@pytest.mark.parametrize("deck", manifest.DECKS)
def test_the_manifests_in_git_are_whole(deck: str) -> None:
    # The plan may draw another deck today, because the catalogue has grown; the manifest stays.
    entries = manifest.read(deck)
    assert len(entries) == len(plan.cards(deck))
    for entry in entries.values():
        assert set(entry.digest) >= {f"{c}.csv" for c in entry.channels}
        assert len(entry.sensors) == len(entry.programs)


# -- the simulated logger ----------------------------------------------------------------------------------------


def _line() -> tuple[Array, Array, Array]:
    t = np.linspace(0.0, 100.0, 400)
    return t, 4 * np.sin(0.1 * t), 1000 * np.sin(0.1 * t)


def test_the_same_sensor_writes_the_same() -> None:
    for one, two in zip(logged_signals(SENSOR, *_line()), logged_signals(SENSOR, *_line()), strict=True):
        assert np.array_equal(one, two)


def test_a_calibration_factor_is_applied_and_noise_is_of_its_size() -> None:
    t, q, f = _line()
    found = logged_signals(replace(SENSOR, noise=0.0), t, q, f)[2]
    assert found == pytest.approx(1.004 * f, abs=0.02)
    noise = logged_signals(replace(SENSOR, correlation=0.0), t, q, f)[2] - found
    assert np.std(noise) == pytest.approx(0.004 * np.ptp(f), rel=0.1)


def test_noise_remembers_the_sample_before() -> None:
    x = correlated_noise(np.random.default_rng(1).standard_normal(20_000), 0.7)
    assert np.std(x) == pytest.approx(1.0, abs=0.03)
    assert np.corrcoef(x[1:], x[:-1])[0, 1] == pytest.approx(0.7, abs=0.02)


def test_faults_are_what_they_say() -> None:
    t, q, f = _line()
    clean = replace(SENSOR, noise=0.0, calibration=1.0)
    span = np.ptp(f)
    assert len(logged_signals(replace(clean, lost=0.1), t, q, f)[0]) == pytest.approx(360, abs=20)
    steps = logged_signals(replace(clean, quantum=0.5), t, q, f)[2] / (0.005 * span)
    assert steps == pytest.approx(np.round(steps), abs=0.01)
    spiked = logged_signals(replace(clean, spikes={"share": 0.01, "size": 20.0}), t, q, f)[2]
    assert 1 <= np.sum(np.abs(spiked - f) > 0.05 * span) <= 12
    hum = logged_signals(replace(clean, hum={"size": 0.4, "period": 7.0, "phase": 0.0}), t, q, f)[2] - f
    assert np.abs(hum).max() == pytest.approx(0.004 * span, rel=0.05)
    assert replace(clean, quantum=0.5, lost=0.1).faults == {"quantised", "lost"}


def test_a_digest_knows_its_data_and_forgives_rounding() -> None:
    t, q, f = _line()
    known = json.loads(json.dumps(digest(t, q, f)))
    assert compare_digests(known, digest(t, q, f)) == "same"
    assert compare_digests(known, digest(t, q, f + 3e-4 * np.ptp(f))) == "near"
    assert compare_digests(known, digest(t, q, f * 1.01)) == "different"
    assert compare_digests(known, digest(t, q, f + 10 * np.sin(t))) == "different"


# -- foreign physics ---------------------------------------------------------------------------------------------

LAW = Law("yeoh", {"C10": 0.5, "C20": -0.02, "C30": 0.01})
SMALL = {"inner_radius": 10.0, "outer_radius": 18.0, "length": 30.0}


def test_a_turned_annulus_is_as_stiff_as_the_closed_form_says() -> None:
    law = Law("neo_hookean", {"C10": 0.5}, bulk=5000.0)
    moment = curve(HalfPlane(SMALL, True, law), [0.1, 0.2])
    a, b, L = (SMALL[k] for k in ("inner_radius", "outer_radius", "length"))
    # T = 4 pi mu L phi / (1/a^2 - 1/b^2), exact with ends held plane; here they are free to bulge: a percent.
    assert moment == pytest.approx(4 * np.pi * L * np.array([0.1, 0.2]) / (a**-2 - b**-2), rel=0.01)


def test_a_bond_that_is_off_softens_and_its_end_matters() -> None:
    whole, top, bottom = (
        curve(HalfPlane(SMALL, False, LAW, outer=bond), [2.0])[0]
        for bond in (Bond(), Bond(5.0, "top"), Bond(5.0, "bottom"))
    )
    # The outer bond carries little load at its ends.
    assert 0.8 * whole < top < 0.99 * whole
    assert top != pytest.approx(bottom, rel=1e-3)


def test_shrinkage_and_swaging_leave_no_axial_force_at_rest() -> None:
    for changes in ({"shrinkage": lambda R: 0.01 + 0 * R}, {"reduction": lambda z: 0.2 + 0 * z}):
        body = HalfPlane(SMALL, False, LAW, **changes)
        rest = body.march(np.arange(2.0), np.array([0.0, 1.0]))
        assert abs(rest[0]) < 1e-4 * rest[1]


@pytest.mark.parametrize(
    "rubber",
    [
        Simo(LAW, (0.3,), (10.0,)),
        Holzapfel(LAW, (0.3,), (10.0,)),
        Holzapfel(LAW, (0.3,), (0.1,), True),
        BergstroemBoyce(LAW, 0.3, 0.05, 3.0),
        Damage(LAW, 0.3, 0.05),
        DorfmannOgden(LAW, 0.3, 0.05, 0.05),
    ],
    ids=lambda rubber: type(rubber).__name__,
)
def test_a_rubber_with_memory_loses_energy_in_simple_shear(rubber: Any) -> None:
    t = np.linspace(0.0, 60.0, 121)
    shear = np.interp(t, [0, 20, 40, 60], [0, 0.5, 0, 0.5])
    memory, stress = rubber.start(1), []
    for i, e in enumerate(shear):
        F = np.eye(3)[None] + 0.0
        F[0, 0, 2] = e
        P, memory = rubber.stress(F, memory, 0.0 if i == 0 else t[i] - t[i - 1])
        stress.append(P[0, 0, 2])
    there, back = slice(0, 41), slice(40, 81)
    work = np.trapezoid(np.array(stress)[there], shear[there]) + np.trapezoid(
        np.array(stress)[back], shear[back]
    )
    assert work > 0.005 * max(stress) * 0.5
    assert stress[0] == pytest.approx(0.0, abs=1e-12)


def test_small_matrices_are_inverted() -> None:
    A = np.eye(3) + 0.3 * np.random.default_rng(2).standard_normal((5, 3, 3))
    assert det(A) == pytest.approx(np.linalg.det(A))
    assert inverse(A) == pytest.approx(np.linalg.inv(A))


def test_component_friction_saturates_and_loses_energy_whatever_the_rate() -> None:
    q = np.interp(np.linspace(0, 3, 601), [0, 1, 2, 3], [0, 4, -4, 4])
    for force in (
        component.berg(q, 100.0, 0.2),
        component.bouc_wen(q, 100.0, 0.3, 1.5, 0.7),
        component.iwan(q, 100.0, 0.3),
    ):
        assert 90.0 < force.max() <= 100.001
        assert np.trapezoid(force[200:], q[200:]) > 0


def test_a_power_law_relaxes_with_a_power_of_time() -> None:
    t = np.concatenate([[0.0, 1e-3], np.geomspace(1e-2, 100.0, 300)])
    force = component.power_law(t, np.where(t > 0, 1000.0, 0.0), 0.2, 0.3, 0.1)
    late = t > 1.0
    slope = np.polyfit(np.log(t[late]), np.log(force[late]), 1)[0]
    # Steeper than -0.3, because relaxation beyond three times the recording counts as elastic.
    assert -0.55 < slope < -0.3
    assert np.all(np.diff(force[1:]) < 0)


def test_a_filter_is_late_and_forgets() -> None:
    t = np.linspace(0, 50, 501)
    found = component.low_pass(t, 10 * t, 2.0)
    assert found[-1] == pytest.approx(10 * (50 - 2.0), rel=1e-6)


def test_a_step_in_stiffness_begins_with_its_cycle() -> None:
    legs = ((0.5, 1.0), (-0.5, 1.0), (1.0, 1.0), (-0.5, 1.0), (1.0, 5.0), (0.0, 5.0))
    c = drawing.channel(Program("axial", legs, 60.0, 200), BODY)
    found = outside.step({"cycle": 3, "factor": 0.9}, c, np.ones(len(c.time)))
    assert set(found) == {1.0, 0.9}


# -- run and ledger ----------------------------------------------------------------------------------------------

TOOL = """
import json, sys
text = open(sys.argv[1]).read()
if "bad" in text: sys.exit(3)
if "ended" in text: sys.exit(130)
print(json.dumps({"verdict": "explained", "effects": [], "rivals": [], "misfit": {}, "mismatch": []}))
"""


def test_what_is_in_the_ledger_is_done(tmp_path: Path) -> None:
    tool = tmp_path / "tool.py"
    tool.write_text(TOOL)
    for name in ("000", "001"):
        case = tmp_path / "own" / "cases" / name
        case.mkdir(parents=True)
        (case / "case.toml").write_text("bad" if name == "001" else "good")
    go = {"workers": 1, "timeout": 20.0, "ledgers": tmp_path / "ledger"}
    command = [sys.executable, str(tool)]
    assert len(list(run_all("own", tmp_path / "own", command, "new", count=1, **go))) == 1
    assert len(list(run_all("own", tmp_path / "own", command, "new", **go))) == 1
    assert not list(run_all("own", tmp_path / "own", command, "new", **go))
    lines = ledger.read("own", "new", tmp_path / "ledger")
    assert lines["000"]["verdict"] == "explained"
    assert lines["001"]["code"] == 3
    assert len(list(run_all("own", tmp_path / "own", command, "new", again=True, **go))) == 1


def test_what_somebody_ended_is_not_done(tmp_path: Path) -> None:
    tool, case = tmp_path / "tool.py", tmp_path / "own" / "cases" / "000"
    tool.write_text(TOOL)
    case.mkdir(parents=True)
    (case / "case.toml").write_text("ended")
    list(run_all("own", tmp_path / "own", [sys.executable, str(tool)], "new", ledgers=tmp_path / "ledger"))
    assert not ledger.read("own", "new", tmp_path / "ledger")


# -- scores ------------------------------------------------------------------------------------------------------


def _old(verdict: str, named: list[str], rivals: list[list[str]]) -> dict[str, Any]:
    result = {
        "verdict": verdict,
        "effects": [
            {"name": n, "parameters": {"g": {"value": 0.2, "std": 0.01}}, "evidence": "decisive"}
            for n in named
        ],
        "rivals": rivals,
        "misfit": {},
        "mismatch": [],
    }
    return ledger.compact("007", result, seconds=1.0, code=0, stderr="")


def _new(
    verdict: str, models: list[tuple[list[str], float]], probability: dict[str, float]
) -> dict[str, Any]:
    result = _old(verdict, models[0][0], [])
    result |= {
        "models": [{"law": "yeoh", "effects": n, "probability": p} for n, p in models],
        "probability": probability,
    }
    return result


def _item(line: dict[str, Any], **changes: Any) -> score.Item:
    return score.Item(replace(ENTRY, **changes), answer_of(line))


def test_an_old_answer_is_spread_over_its_rivals() -> None:
    found = answer_of(_old("missing_physics", ["offset@axial"], [["offset"], ["free_play"]]))
    assert found.named == {"offset"}
    assert found.sets == ((frozenset({"offset"}), 0.5), (frozenset({"free_play"}), 0.5))
    assert found.stated_effects == frozenset()


def test_an_old_answer_without_rivals_is_sure() -> None:
    right = _item(_old("missing_physics", ["friction"], []))
    assert score.in_set(right)
    assert score.is_outright(right)
    assert score.log_score(right) == 0.0
    wrong = _item(_old("missing_physics", ["mullins"], []))
    assert not score.in_set(wrong)
    assert score.wrong_effects(wrong) == {"mullins"}
    assert score.log_score(wrong) == pytest.approx(np.log(score.FLOOR))


def test_what_is_in_all_old_sets_is_stated() -> None:
    item = _item(
        _old("missing_physics", ["friction", "offset"], [["friction", "offset"], ["friction", "mullins"]])
    )
    assert item.answer.stated_effects == {"friction"}
    assert not score.wrong_effects(item)


def test_an_old_unexplained_allows_for_the_unknown() -> None:
    found = answer_of(_old("unexplained", ["friction"], []))
    assert found.sets[0] == (UNKNOWN, 0.5)
    assert not score.is_outright(_item(_old("unexplained", ["friction"], [])))


def test_new_models_are_summed_over_laws_and_rigs_until_95_percent() -> None:
    models = [
        (["friction"], 0.5),
        (["friction", "offset@axial"], 0.3),
        (["friction"], 0.16),
        (["mullins"], 0.04),
    ]
    item = _item(
        _new(
            "missing_physics",
            models,
            {"friction": 0.96, "offset@axial": 0.3, "mullins": 0.04, "unknown": 0.0},
        )
    )
    assert item.answer.credible == (frozenset({"friction"}), frozenset({"friction", "offset"}))
    assert score.in_set(item)
    assert not score.is_outright(item)
    assert item.answer.stated_effects == {"friction"}
    assert score.log_score(item) == pytest.approx(np.log(0.66))


def test_also_right_sets_are_right_and_their_effects_are_not_judged() -> None:
    also = {"also_right": (("friction", "mullins"),)}
    item = _item(_old("missing_physics", ["friction", "mullins"], []), **also)
    assert score.in_set(item)
    assert score.is_outright(item)
    assert not score.wrong_effects(item)
    assert list(score.statements(item)) == [(1.0, True)]


def test_what_cannot_be_seen_may_be_left_out() -> None:
    line = _old("explained", [], [])
    assert score.in_set(_item(line, strength={"friction": 0.5}, program="ramp"))
    assert not score.in_set(_item(line))


def test_nothing_is_right_when_explained_and_a_refusal_is_not() -> None:
    none = {"kind": "none", "effects": {}, "truth": (), "strength": {}}
    assert score.is_explained(_item(_old("explained", [], []), **none))
    assert not score.is_explained(_item(_old("missing_physics", ["offset"], []), **none))
    assert not score.is_explained(_item(_old("faulty_data", [], []), **none))


def test_outside_is_right_where_it_is_located_or_by_its_later_name() -> None:
    outside_ = {
        "kind": "outside",
        "part": "nothing",
        "outside": True,
        "effects": {},
        "formulas": ({"name": "step"},),
    }
    step = outside_ | {"truth": (), "where": {"cycle": 4, "softer": True}}
    line = _old("unexplained", [], [])
    part = {
        "channel": "axial",
        "cycle": [1, 3],
        "displacement_from": 0.0,
        "displacement_to": 1.0,
        "share": 0.7,
    }
    assert score.outside_right(_item(line | {"mismatch": [part | {"sign": "too_soft"}]}, **step))
    assert not score.outside_right(_item(line | {"mismatch": [part | {"sign": "too_stiff"}]}, **step))
    warming = outside_ | {"truth": ("warming",), "where": {"falls_with": "time"}}
    assert score.outside_right(
        _item(_new("missing_physics", [(["warming"], 0.97)], {"warming": 0.97}), **warming)
    )
    assert not score.outside_right(
        _item(_new("missing_physics", [(["mullins"], 0.97)], {"mullins": 0.97}), **warming)
    )


def test_intervals_are_of_what_is_named() -> None:
    (one,) = score.intervals(_item(_old("missing_physics", ["friction"], [])))
    assert one.holds
    assert not score.intervals(_item(_old("missing_physics", ["mullins"], [])))


def test_no_result_is_wrong_everywhere() -> None:
    item = _item(ledger.compact("007", None, seconds=420.0, code=None, stderr="x"))
    assert not score.in_set(item)
    assert not score.is_outright(item)
    assert not score.is_explained(item)
    assert score.log_score(item) == pytest.approx(np.log(score.FLOOR))


def test_reliability_counts_what_is_true_in_each_bin() -> None:
    bins = score.reliability([(0.97, True), (0.96, False), (0.1, False), (1.0, True), (0.001, False)])
    assert [(b.low, b.true.good, b.true.all) for b in bins] == [(0.05, 0, 1), (0.95, 1, 2), (0.99, 1, 1)]
    assert score.calibration_error(bins) == pytest.approx((0.1 + 2 * 0.465 + 0.0) / 4)


def test_frequencies_are_counted_by_what_is_concealed() -> None:
    items = [
        _item(_old("explained", [], [])),
        _item(_old("explained", [], []), truth=(), effects={}),
        _item(_old("explained", [], []), truth=("friction", "mullins")),
        _item(_old("explained", [], []), truth=(), effects={}, kind="outside", outside=True),
    ]
    found = frequencies(items)
    assert (found.count, found.nothing, found.unknown, found.pairs) == (4, 1, 1, 1)
    assert found.of(frozenset()) == found.of(UNKNOWN) == 0.25
    assert found.of(frozenset({"friction"})) == 1.5 / 4
    assert found.of(frozenset({"offset"})) == 0.5 / 4
    # A quarter is divided among the pairs of the effects.
    count = len(effects_on("static"))
    assert found.of(frozenset({"offset", "gain"})) == pytest.approx(0.25 / math.comb(count, 2))
    assert found.of(frozenset({"offset", "unknown"})) < 1e-5
    assert found.of(frozenset({"offset", "gain", "mullins"})) < 1e-5
    three = frequencies(
        [*items, _item(_old("explained", [], []), truth=("friction", "mullins", "permanent_set"))]
    )
    assert three.of(frozenset({"offset", "gain", "mullins"})) == pytest.approx(0.2 / math.comb(count, 3))


def test_the_new_decks_are_scored_together_at_the_frequencies_of_the_others(monkeypatch) -> None:
    """Each answer is softening (60 %) or friction; the truths of one deck are softening, those of two are friction."""
    models = [(["mullins"], 0.6), (["friction"], 0.4)]
    line = _new("missing_physics", models, {"friction": 0.4, "mullins": 0.6})
    softening = {"second": 10, "third": 0, "fourth": 0}
    monkeypatch.setattr(fresh, "RUNS", [run for run in fresh.RUNS if run[0] in softening])

    def read(deck: str, label: str) -> list[score.Item]:
        truths = ["mullins"] * softening[deck] + ["friction"] * (10 - softening[deck])
        return [_item(line, truth=(truth,), part="own", strength={}) for truth in truths]

    text = fresh.section(read, {"named": lambda items: score.count(items, score.first)}, report.KINDS)
    rows = [row for row in text.splitlines() if row.startswith("| own formulas | named")]
    # At the tool's odds softening is the first of all answers. The two decks beside *second* know friction alone; those
    # beside the others both alike. By the frequencies of all three together friction would be first, and right in 20.
    assert len(rows) == 1
    assert "10 of 30" in rows[0].split("|")[3]
    assert rows[0].split("|")[4].strip().startswith("0 of 30")
    assert "| 0.6 to 0.8 | 0.60: 10 of 30" in text


def test_a_drawn_truth_is_right_where_it_is_said_and_nothing_else_is() -> None:
    line = _new("missing_physics", [(["friction", "unknown"], 0.7), ([], 0.3)], {"friction": 0.7})
    item = _item(line, truth=("mullins",))
    (both, _), (nothing, _) = item.answer.sets
    for names in (both, nothing):
        assert fresh._with_truth(item, names).right == {names}
    assert fresh._with_truth(item, UNKNOWN).right == {UNKNOWN}


def test_an_answer_with_other_odds_is_bayes_rule() -> None:
    """Odds of friction are 0.03: with a probability of 0.06 beside 0.94 its evidence is 2.13 times that of nothing."""
    line = _new("explained", [([], 0.94), (["friction"], 0.06)], {"friction": 0.06, "nothing": 0.94})
    item = _item(line)
    bayes = 0.06 / 0.03 / 0.94
    even = reweigh(item, lambda names: 0.5)
    assert even.answer.effects["friction"] == pytest.approx(bayes / (1.0 + bayes))
    assert even.answer.verdict == "missing_physics"
    assert even.answer.named == {"friction"}
    assert score.in_set(even)
    same = reweigh(item, tool_odds)
    assert dict(same.answer.sets) == pytest.approx(dict(item.answer.sets))
    assert same.answer.verdict == "explained"


def test_with_other_odds_the_verdict_follows_from_sums_over_sets() -> None:
    models = [([], 0.2), (["friction"], 0.3), (["mullins"], 0.2), (["unknown"], 0.3)]
    item = _item(_new("missing_physics", models, {"friction": 0.3, "mullins": 0.2, "unknown": 0.3}))
    assert reweigh(item, tool_odds).answer.verdict == "missing_physics"
    together = frozenset({"friction", "mullins"})
    assert tool_odds(together) == pytest.approx(FILLED * independent_odds(together))
    rare = reweigh(item, lambda names: tool_odds(names) * (10.0 if "unknown" in names else 1.0))
    assert rare.answer.verdict == "unexplained"
    assert not rare.answer.named


@pytest.mark.parametrize(
    ("nats", "reason"),
    [
        ((-5.0, 2.0, 0.0), "data"),
        ((10.0, -14.0, 0.0), "values"),
        ((1.0, 0.0, -2.0), "odds"),
        ((1.0, 0.0, 4.6), "rivals"),
    ],
)
def test_the_right_answer_lacks_what_is_least(nats: tuple[float, float, float], reason: str) -> None:
    line = dict(zip(("data", "values", "odds"), nats, strict=True)) | {"right": ["friction"]}
    assert why.reason(line) == reason


def test_what_is_explained_is_what_the_scores_count_as_missed() -> None:
    """With label 93c86ff 34 of 40 answers to *nothing* are right, and 52 of 90 to *own* outright (docs/decks.md)."""
    assert [item.entry.name for item in why.items_to_explain("nothing", "93c86ff")] == [
        "006",
        "019",
        "020",
        "021",
        "022",
        "033",
    ]
    assert len(list(why.items_to_explain("own", "93c86ff"))) == 90 - 52


def test_reasons_are_counted_by_deck(tmp_path: Path) -> None:
    assert why.section(["own"], ["new"], tmp_path) == ""
    line = {
        "name": "007",
        "right": ["friction"],
        "wrong": ["unknown"],
        "data": 9.99,
        "values": -13.8,
        "odds": 0.0,
    }
    line |= {"misfit": [1.04, 4.14], "in_set": False}
    ledger.append("own", "why-new", line, tmp_path)
    ledger.append("own", "why-new", {"name": "008", "right": None}, tmp_path)
    ledger.append("foreign", "why-new", line | {"name": "003", "data": -2.9}, tmp_path)
    ledger.append("foreign", "why-new", line | {"name": "001", "data": 2.9}, tmp_path)
    ledger.append("foreign", "why-new", line | {"name": "002", "data": 2.9, "in_set": True}, tmp_path)
    ledger.append("foreign", "why-new", line | {"name": "004", "data": -3.1}, tmp_path)
    text = why.section(["own", "foreign"], ["new", "newer"], tmp_path)
    assert f"| {why.REASONS['values']} | 1 | 4 |" in text
    assert f"| {why.REASONS['not fitted']} | 1 | 0 |" in text
    assert f"| {why.REASONS['data']} | 0 | 0 |" in text
    # Right answers that are not in the credible set; 002 is.
    assert f"| {why.MISSES['better']} | 007 | none |" in text
    assert f"| {why.MISSES['alike']} | none | 001, 003 |" in text
    assert f"| {why.MISSES['worse']} | none | 004 |" in text
    assert "| 007 | friction | unknown | +10.0 | -13.8 | +0.0 | 1.04, 4.14 | values |" in text


def test_the_page_stands_old_beside_new(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entries = tmp_path / "manifests"
    manifest.put("own", ENTRY, entries)
    monkeypatch.setattr(manifest, "read", lambda deck, folder=entries, read=manifest.read: read(deck, folder))
    lines = {
        "old": _old("missing_physics", ["mullins"], []),
        "new": _new("missing_physics", [(["friction"], 0.97)], {"friction": 0.97}),
    }
    monkeypatch.setattr(
        ledger, "read", lambda deck, label, *_: {"007": lines[label]} if label in lines else {}
    )
    text = report.document(["old", "new"], ["own"], tmp_path / "page.md")
    assert "| right set in the credible set | 0 of 1: 0 % (0 to 79) | 1 of 1: 100 % (21 to 100) |" in text
    right = "| own | right set in the credible set | 97 % or more | 0 of 1: 0 % (0 to 79) | 1 of 1: 100 % (21 to 100) |"
    assert right in text
    stated = "| own | recordings with an absent effect stated | 2 % or less |"
    assert f"{stated} 1 of 1: 100 % (21 to 100) | 0 of 1: 0 % (0 to 79) |" in text
    assert "| right set the most probable | 0 of 1: 0 % (0 to 79) | 1 of 1: 100 % (21 to 100) |" in text
    assert "| foreign |" not in text
    assert (tmp_path / "page-reliability.svg").exists()


# -- the short table -----------------------------------------------------------------------------------------------


def test_only_the_scores_of_a_page_are_renewed() -> None:
    """What stands before and after its marks stays; a page without marks is refused, not overwritten."""
    page = f"before\n{summary.BEGIN}\nold table\n{summary.END}\nafter\n"
    new = summary.with_new_scores(page, "new table")
    assert new == f"before\n{summary.BEGIN}\n\nnew table\n{summary.END}\nafter\n"
    assert summary.with_new_scores(new, "new table") == new
    with pytest.raises(ValueError, match="no place for the scores"):
        summary.with_new_scores("a page", "new table")
