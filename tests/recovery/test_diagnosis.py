"""Whole diagnoses of recordings with known concealed effects, made here with other steps and noise on a small mesh."""

from __future__ import annotations

import json
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from bushcli.case import Case, load_case
from bushcli.diagnosis.diagnose import diagnose
from bushcli.effects.active import ActiveEffect, effects_on_channel
from bushcli.effects.effect import effect
from bushcli.report.json.diagnosis import diagnosis_json
from bushcli.report.views.diagnosis import diagnosis_document
from bushcli.report.writers.files import diagnosis_files, write
from bushcli.report.writers.terminal import terminal_text
from bushcli.selection.queue import LEFT
from bushcli.simulate.simulation import Simulation
from cases.mode import modes
from cases.simulate import Rubber
from forms.law import law

EXAMPLE = Path(__file__).parents[2] / "examples" / "concealed"
# MPa; a law that stiffens through its third constant.
YEOH = {"C10": 0.4, "C20": -0.03, "C30": 0.012}
NOISE = 0.003
TEXT = """
[geometry]
shape = "plain"
inner_radius = 10.0
outer_radius = 18.0
length = 28.0

[mesh]
elements_across = 2
elements_along = 4

[material]
law = "{law}"
bulk_modulus = 2000.0

[[recordings]]
mode = "axial"
file = "axial.csv"
"""


def path() -> tuple[Any, Any]:
    """Cycles to 3, 5 and 5 mm at two rates, to both sides."""
    time, q = [0.0], [0.0]
    for to, rate in ((3, 0.2), (-2, 0.2), (5, 0.2), (-2, 0.2), (5, 2.0), (-2, 2.0), (5, 2.0), (0, 2.0)):
        n = max(8, round(abs(to - q[-1]) / 0.35))
        time += list(time[-1] + abs(to - q[-1]) / rate * np.arange(1, n + 1) / n)
        q += list(np.linspace(q[-1], to, n + 1)[1:])
    return np.array(time), np.array(q)


def loop() -> tuple[Any, Any]:
    """Once to 4 mm and back."""
    q = np.concatenate([np.linspace(0.0, 4.0, 81), np.linspace(4.0, 0.0, 81)[1:]])
    return np.arange(len(q)) * 0.25, q


def case(
    folder: Path,
    secret: dict[str, dict[str, float]],
    model: str = "yeoh",
    change: Any = None,
    program: tuple[Any, Any] | None = None,
) -> Case:
    """A case whose recording conceals effects; `change` alters the force in a way that no effect does."""
    (folder / "case.toml").write_text(TEXT.format(law=model))
    (folder / "axial.csv").write_text("time_s,displacement_mm,force_N\n0,0,0\n1,1,1\n2,2,2\n3,3,3\n4,2,2\n")
    shaped = load_case(folder / "case.toml", ())
    time, q = program or path()
    fine = np.arange(4 * len(q) - 3) / 4
    active = [ActiveEffect(effect(name), values).with_start_values() for name, values in secret.items()]
    answer = Simulation(
        shaped.geometry,
        modes()["axial"],
        Rubber(law("yeoh"), YEOH, 2000.0),
        shaped.mesh.refinement,
        effects_on_channel(active, "axial", "axial"),
        # Four steps per sample, so that the truth has no error by its steps.
        np.interp(fine, np.arange(len(time)), time),
        np.interp(fine, np.arange(len(q)), q),
        None,
    ).solve(YEOH)
    force = answer.force[::4]
    force = force if change is None else change(time, q, force)
    rng = np.random.default_rng(11)
    force = force + NOISE * np.ptp(force) * rng.normal(size=len(q))
    rows = zip(time, q + 1e-3 * rng.normal(size=len(q)), force, strict=True)
    lines = ["time_s,displacement_mm,force_N", *(f"{t:.4f},{u:.5f},{f:.5g}" for t, u, f in rows)]
    (folder / "axial.csv").write_text("\n".join(lines) + "\n")
    return load_case(folder / "case.toml", ())


def names(found: Any) -> list[str]:
    return [one.name for one in found.effects]


def adds_up(found: Any) -> None:
    """Check that the models' probabilities sum to one, and that those of effects are sums over models."""
    # Models are listed down to a probability of a thousandth.
    assert 0.95 < sum(one.probability for one in found.models) < 1.0 + 1e-9
    for name, probability in found.probability.items():
        shown = sum(
            one.probability
            for one in found.models
            if name in [each.partition("@")[0] for each in one.effects]
            or (name == "nothing" and not one.effects)
        )
        assert shown - 1e-9 <= probability <= shown + 0.05
    assert found.searched.complete
    assert found.searched.left < LEFT


def test_nothing_is_found_where_nothing_is_concealed(tmp_path: Path) -> None:
    found = diagnose(case(tmp_path, {}), effects=["friction", "offset", "free_play"], maps=False)
    assert found.verdict == "explained"
    assert not found.effects
    assert found.probability["nothing"] > 0.9
    assert not found.missing
    # The law alone is printed with the numbers of `bushcli inverse`, not with those of a fit under another weighting.
    assert found.material.parameters == found.plain.parameters
    assert {name: one.value for name, one in found.parameters.items()} == pytest.approx(
        found.plain.parameters
    )
    adds_up(found)


@pytest.mark.slow
def test_what_fillers_do_is_found_together(tmp_path: Path) -> None:
    """Virgin filled rubber relaxes, softens and sets; of these the first alone leaves several times the noise."""
    virgin = {
        "viscoelasticity": {"g1": 0.2, "tau1": 5.0},
        "mullins": {"inverse_r": 0.4, "m": 0.05, "beta": 0.1},
        "permanent_set": {"set": 0.06},
    }
    found = diagnose(
        case(tmp_path, virgin), effects=[*virgin, "friction", "rig_compliance", "drift"], maps=False
    )
    assert sorted(found.models[0].effects) == sorted(virgin)
    assert found.models[0].probability > 0.5
    assert found.channels[0].after_percent < 1.2 * 100 * NOISE < 0.3 * found.channels[0].before_percent
    value, known = found.parameters["permanent_set.set"], virgin["permanent_set"]["set"]
    assert abs(value.value - known) < 3.0 * value.std
    adds_up(found)


def test_a_force_of_the_other_sign_is_not_blamed_on_the_rubber(tmp_path: Path) -> None:
    told: list[tuple[str, ...]] = []
    reversed_force = case(tmp_path, {}, change=lambda time, q, force: -force)
    found = diagnose(reversed_force, progress=lambda *parts: told.append(parts))
    assert found.verdict == "faulty_data"
    # Nothing is fitted.
    assert [parts[:2] for parts in told] == [("data", "axial")]
    assert (found.forward_solves, found.searched.ended) == (0, "faulty data")
    assert not found.probability
    assert not found.location.mismatch
    stream = StringIO()
    Console(width=200, file=stream).print(terminal_text(diagnosis_document(found)))
    text = " ".join(stream.getvalue().split())
    assert "reverse the sign of the force" in text
    assert "too stiff" not in text
    assert "law:" not in text


def test_exchanged_columns_need_no_solution(tmp_path: Path) -> None:
    # The law cannot be simulated to 3 m of travel; the remedy must come all the same, with a journal of an earlier run.
    exchanged = case(tmp_path, {})
    file = tmp_path / "axial.csv"
    head, *rows = file.read_text().splitlines()
    cells = [row.split(",") for row in rows]
    file.write_text("\n".join([head, *(f"{t},{force},{q}" for t, q, force in cells)]) + "\n")
    (tmp_path / "history").mkdir()
    found = diagnose(exchanged, journal=tmp_path / "history", resume=True)
    assert found.verdict == "faulty_data"
    assert "name the columns" in found.faults[0].remedy
    document = diagnosis_json(found)
    assert document["plain"]["parameters"] == {}
    assert document["misfit"]["before"] == document["misfit"]["after"] == {"axial": None}
    files = diagnosis_files(found)
    written = write(tmp_path / "out", document, files, lambda: diagnosis_document(found))
    page = next(path for path in written if path.name == "report.html").read_text()
    assert "Recorded curves" in page
    assert "Misfit over time" not in page


def test_a_poor_law_is_named_before_any_physics(tmp_path: Path) -> None:
    # A zero that was set under a preload would explain this misfit, too: 0.6 % of the force.
    found = diagnose(
        case(tmp_path, {}),
        model="neo_hookean",
        effects=["rig_compliance", "bump_stop", "free_play"],
        maps=False,
    )
    assert found.verdict == "law_too_poor"
    assert not found.effects
    # The posterior decides among the laws with two or more parameters: the true one is in the credible set.
    assert sum(one.probability for one in found.models if one.law == "yeoh") > 0.05
    assert found.channels[0].after_percent < 1.2 * 100 * NOISE < found.channels[0].before_percent
    adds_up(found)


@pytest.mark.slow
def test_two_effects_are_found_one_after_the_other(tmp_path: Path) -> None:
    secret = {
        "viscoelasticity": {"g1": 0.15, "tau1": 6.0},
        "mullins": {"inverse_r": 0.4, "m": 0.05, "beta": 0.05},
    }
    found = diagnose(
        case(tmp_path, secret),
        effects=["friction", "viscoelasticity", "free_play", "offset", "mullins"],
        maps=False,
    )
    assert found.verdict == "missing_physics"
    assert sorted(names(found)) == sorted(secret)
    # Both change this recording equally: either is large for an error of form of the other, which keeps a tenth.
    assert min(found.probability[name] for name in secret) > 0.8
    adds_up(found)
    assert found.channels[0].after_percent < 1.3 * 100 * NOISE < found.channels[0].before_percent
    # Within three standard deviations; the seed was not chosen to fit.
    for one in found.effects:
        for key, truth in secret[one.name].items():
            assert abs(one.parameters[key].value - truth) < 3 * one.parameters[key].std


@pytest.mark.slow
def test_an_effect_that_grows_into_another_form_is_found_from_finite_sizes(tmp_path: Path) -> None:
    """At zero, the derivative by the debonded length is that of the bond's corner, which has the opposite sign here."""
    found = diagnose(
        case(tmp_path, {"debonding": {"length": 3.0}}), effects=["debonding", "offset"], maps=False
    )
    assert names(found) == ["debonding"]
    # An axial recording hardly tells which of the four bonds has come off; each is a separate model.
    assert found.effects[0].parameters["bond"].word in (
        "inner_top",
        "inner_bottom",
        "outer_top",
        "outer_bottom",
    )
    # It changes the force by 0.18 % of its range. The error of a law may be as large and resemble it, and so may a zero
    # that was set under a preload: a third.
    assert found.probability["debonding"] > 0.5
    assert sum(found.probability[name] for name in ("debonding", "nothing", "offset")) > 0.99
    assert 1.0 < found.effects[0].parameters["length"].value < 6.0


@pytest.mark.slow
def test_a_stop_is_fitted_where_the_plain_law_imitates_it_at_its_edge_of_stability(tmp_path: Path) -> None:
    """The fit begins with the plain law's parameters, at the edge of stability; a trust region alone ends there."""
    stop = {"stiffness": 2000.0, "gap": 2.2}
    found = diagnose(case(tmp_path, {"bump_stop": stop}, program=loop()), effects=["bump_stop"], maps=False)
    # The plain law needs a C10 that is a small part of the true one.
    assert found.plain.parameters["C10"] < 0.5 * YEOH["C10"]
    trials = [one for one in found.searched.trials if one.law == "yeoh" and one.effects == ("bump_stop",)]
    assert min(one.misfit for one in trials) < 1.3


def with_torsion(folder: Path, secret: dict[str, dict[str, float]], zero: float = 0.0) -> Case:
    """An axial recording with a concealed effect, and torsion in another rig: N mm (not zero at rest) over degrees."""
    whole = case(folder, secret)
    time, q = path()
    turn = np.radians(2.0) * q
    body = Rubber(law("yeoh"), YEOH, 2000.0)
    active = [ActiveEffect(effect(name), values).with_start_values() for name, values in secret.items()]
    assembled = [one for one in active if one.effect.acts == "assembly"]
    answer = Simulation(
        whole.geometry, modes()["torsional"], body, whole.mesh.refinement, assembled, time, turn, None
    ).solve(YEOH)
    moment = (
        zero + answer.force + NOISE * np.ptp(answer.force) * np.random.default_rng(12).normal(size=len(q))
    )
    rows = zip(time, np.degrees(turn), moment, strict=True)
    lines = ["time_s,rotation_deg,moment_Nmm", *(f"{t:.4f},{u:.6f},{m:.6g}" for t, u, m in rows)]
    (folder / "torsional.csv").write_text("\n".join(lines) + "\n")
    with (folder / "case.toml").open("a") as file:
        file.write('\n[[recordings]]\nmode = "torsional"\nfile = "torsional.csv"\n')
    return load_case(folder / "case.toml", ())


ASYMMETRIC = {"offset": {"zeroed": 1.0, "preload": 3.0}, "debonding": {"length": 6.0, "bond": 0.0}}


@pytest.mark.slow
@pytest.mark.parametrize("name", ASYMMETRIC)
def test_a_preload_zeroed_out_and_a_lost_bond_are_told_apart(tmp_path: Path, name: str) -> None:
    """Either makes the axial stiffness differ between + and -; only the bond also softens torsion."""
    concealed = with_torsion(tmp_path, {name: ASYMMETRIC[name]})
    found = diagnose(concealed, effects=[*ASYMMETRIC, "permanent_set", "free_play"], maps=False)
    assert names(found) == [name]
    assert found.probability[name] > 0.9
    if name == "offset":
        preload = found.effects[0].parameters["preload"]
        assert found.effects[0].channels == ("axial",)
        assert abs(preload.value - 3.0) < 3 * preload.std < 2.0


@pytest.mark.slow
def test_a_set_that_grows_is_no_drift_and_no_viscosity(tmp_path: Path) -> None:
    concealed = case(tmp_path, {"permanent_set": {"set": 0.08, "cycles": 1.5}})
    found = diagnose(concealed, effects=["permanent_set", "drift", "viscoelasticity", "mullins"], maps=False)
    assert names(found) == ["permanent_set"]
    assert found.probability["permanent_set"] > 0.95
    cycles = found.effects[0].parameters["cycles"]
    assert cycles.lower < 1.5 < cycles.upper < 6.0


@pytest.mark.slow
def test_a_rate_that_grows_with_the_stress_is_told_from_several_branches(tmp_path: Path) -> None:
    concealed = case(tmp_path, {"viscoelasticity": {"g1": 0.4, "tau1": 15.0, "exponent": 3.0}})
    found = diagnose(concealed, effects=["viscoelasticity", "friction", "payne"], maps=False)
    assert names(found) == ["viscoelasticity"]
    assert found.probability["viscoelasticity"] > 0.95
    exponent = found.effects[0].parameters["exponent"]
    assert exponent.lower < 3.0 < exponent.upper < 5.0


@pytest.mark.slow
def test_a_stop_that_engages_little_by_little_is_a_stop(tmp_path: Path) -> None:
    concealed = case(tmp_path, {"bump_stop": {"stiffness": 900.0, "gap": 1.5, "onset": 2.5}})
    found = diagnose(concealed, effects=["bump_stop", "free_play", "permanent_set"], maps=False)
    assert names(found) == ["bump_stop"]
    assert found.probability["bump_stop"] > 0.95
    onset = found.effects[0].parameters["onset"]
    assert onset.lower < 2.5 < onset.upper < 5.0


RIGS = ["offset", "free_play", "bump_stop", "rig_compliance"]


@pytest.mark.slow
def test_what_is_loose_in_one_rig_is_found_beside_a_recording_of_another(tmp_path: Path) -> None:
    found = diagnose(with_torsion(tmp_path, {"free_play": {"half_width": 0.12}}), effects=RIGS, maps=False)
    assert [one.label for one in found.effects] == ["Free play in the rig (axial)"]
    width = found.effects[0].parameters["half_width"]
    assert abs(width.value - 0.12) < 3 * width.std < 0.05
    assert found.effects[0].plausible


@pytest.mark.slow
def test_both_rigs_may_be_off_zero_each_by_its_own(tmp_path: Path) -> None:
    zeros = {"axial": 25.0, "torsional": -400.0}
    concealed = {"offset": {"force": zeros["axial"], "displacement": 0.05}}
    found = diagnose(with_torsion(tmp_path, concealed, zeros["torsional"]), effects=RIGS, maps=False)
    assert found.verdict == "missing_physics"
    assert sorted(one.label for one in found.effects) == ["Zero offset (axial)", "Zero offset (torsional)"]
    for one in found.effects:
        assert one.channels is not None
        force = one.parameters["force"]
        # Offsets of force and displacement are hard to distinguish: 25 N are 0.13 mm of this bushing.
        assert abs(force.value - zeros[one.channels[0]]) < 3 * force.std
        assert one.plausible
    for channel in found.channels:
        assert channel.after_percent < 1.1 * 100 * NOISE < 0.3 * channel.before_percent
    document = diagnosis_json(found)
    assert [one["name"] for one in document["effects"]] == ["offset", "offset"]
    assert document["probability"]["offset"] > 0.95
    # The plain law is fitted outside the search.
    assert 0 < sum(one["solves"] for one in document["searched"]["trials"]) < document["forward_solves"]
    # The second offset's parameters carry the name of its rig, in the order of the channels' names.
    assert {"offset.force", "offset@torsional.force"} <= set(document["parameters"])


@pytest.mark.slow
def test_a_logger_may_be_late_in_one_channel_only(tmp_path: Path) -> None:
    """The force of the axial rig is 0.6 s late; that of the torsional rig is not."""
    concealed = with_torsion(tmp_path, {"time_lag": {"lag": 0.6}})
    found = diagnose(concealed, effects=["time_lag", "viscoelasticity", "offset", "gain"], maps=False)
    assert [one.label for one in found.effects] == ["Time lag between the signals (axial)"]
    assert found.effects[0].probability > 0.95
    lag = found.effects[0].parameters["lag"]
    assert abs(lag.value - 0.6) < 3 * lag.std < 0.2


def test_what_is_in_no_catalogue_is_unexplained_and_located(tmp_path: Path) -> None:
    """A tear: in the middle of the recording the bushing suddenly becomes softer by a quarter."""

    def torn(time: Any, q: Any, force: Any) -> Any:
        late = np.arange(len(q)) > np.argmax(time > 0.55 * time[-1])
        return np.where(late & (np.abs(q) > 1.0), 0.75 * force, force)

    found = diagnose(case(tmp_path, {}, change=torn), effects=["offset", "time_lag", "free_play"], maps=False)
    assert found.verdict == "unexplained"
    assert found.probability["unknown"] > 0.5
    assert found.missing is not None
    assert found.missing.share > 0.9
    assert found.missing.text
    # The model is too stiff where the bushing has become softer: in the second half, from cycle 3 on.
    assert any(one.sign == "too_stiff" and one.cycle[1] >= 3 for one in found.location.mismatch)


@pytest.mark.slow
def test_a_channel_that_is_held_out_is_predicted_and_took_part_in_nothing(tmp_path: Path) -> None:
    concealed = {"free_play": {"half_width": 0.12}}
    whole = with_torsion(tmp_path, concealed)
    found = diagnose(whole, effects=RIGS, hold_out=("torsional",), maps=False)
    alone = diagnose(case(tmp_path, concealed), effects=RIGS, maps=False)
    assert found.probability == pytest.approx(alone.probability, abs=1e-9)
    held = found.channels[1]
    assert held.held_out
    assert not found.channels[0].held_out
    # The law of the axial recording predicts the torsional one, since both shear the same rubber.
    assert held.after_percent < held.before_percent + 0.1
    assert held.after_percent < 5.0


@pytest.mark.slow
def test_a_budget_gives_an_answer_that_says_what_was_not_looked_at(tmp_path: Path) -> None:
    found = diagnose(
        case(tmp_path, {"free_play": {"half_width": 0.12}}), effects=RIGS, budget=1e-3, maps=False
    )
    assert found.searched.ended == "budget"
    assert not found.searched.complete
    assert found.searched.left > 0.5
    assert "budget" in [one.name for one in found.conditions]
    # Nothing is named, nor said to be missing, before most models have been looked at.
    assert found.is_unsearched
    assert (found.models, found.effects, found.groups, found.missing) == ((), (), (), None)
    assert found.next_test is None


@pytest.mark.slow
def test_uniform_odds_do_not_change_what_the_recording_decides(tmp_path: Path) -> None:
    secret = case(tmp_path, {"free_play": {"half_width": 0.12}})
    for uniform in (False, True):
        found = diagnose(secret, effects=RIGS, uniform=uniform, maps=False)
        assert names(found) == ["free_play"]
        assert found.probability["free_play"] > 0.95


@pytest.mark.slow
def test_another_batch_is_told_from_a_law_that_is_identified_anew() -> None:
    """Of the README: both explain a misfit 125 times the noise; the one factor is the simpler cause."""
    batch = load_case(EXAMPLE.parent / "batch" / "case.toml", ())
    found = diagnose(batch, effects=["batch_stiffness", "offset"], maps=False)
    assert found.probability["batch_stiffness"] > 0.95
    value = found.effects[0].parameters["log_factor"]
    # exp(-0.5725) = 0.564, the value that README.md shows.
    assert abs(value.value + 0.5725) < value.std


@pytest.mark.slow
def test_the_example_conceals_what_its_truth_says() -> None:
    """The bundled recording, made with third-order elements and a step per sample."""
    found = diagnose(load_case(EXAMPLE / "case.toml", ()), effects=["mullins", "friction"], maps=False)
    truth = json.loads((EXAMPLE / "truth" / "truth.json").read_text(encoding="utf-8"))
    assert names(found) == ["mullins"] == list(truth["effects"])
    assert found.probability["mullins"] > 0.95 > 0.5 > found.probability["friction"]
    for key, value in truth["effects"]["mullins"].items():
        assert abs(found.effects[0].parameters[key].value - value) < 3 * found.effects[0].parameters[key].std
