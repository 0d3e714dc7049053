"""What every effect must do; a new file in bushcli/effects/library needs no change here to be tested.

Effects of the rig are tested on a curve with a known formula; `test_features.py` tests those of the finite-element
model.
"""

from __future__ import annotations

import ast
import json
import math
import re
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from bushcli.case import Material
from bushcli.case.catalogue import as_json
from bushcli.effects import library
from bushcli.effects.active import ActiveEffect, require_time, require_values
from bushcli.effects.effect import Effect, UnknownName, effect, effects
from bushcli.effects.rig import RigStiffness, elastic_response, measured_stiffness
from bushcli.effects.titles import phrase
from bushcli.errors import InputError
from bushcli.evidence.prior import ODDS, effect_odds
from bushcli.export.rubber import rubber_of
from cases.mode import modes

ALL = list(effects().values())
RIG = [one for one in ALL if one.rig is not None and "static" in one.kinds]
ROOT = Path(__file__).resolve().parents[2]
LAW = ("k", "c")
K, C = 290.0, 1.5  # N/mm, N/mm^3: the axial stiffness of a bushing of 10, 20, 40 mm and some stiffening

# Values other than `off` that fit the travel below, mm and N; parameters not listed here have their start value.
TYPICAL = {
    "bump_stop.gap": 2.43,
    "bump_stop.stiffness": 400.0,
    "free_play.half_width": 0.313,
    "offset.force": 35.0,
    "offset.displacement": 0.1234,
    "rig_compliance.compliance": 5e-4,
    "rig_twist.compliance": 5e-4,
    "time_lag.lag": 0.137,
    "permanent_set.set": 0.06,
    "drift.rate": 1.7,
    "drift.settling": 0.05,
    "warming.tau": 11.0,
    "rig_compliance.curvature": -1e-4,
    "fixture_mass.mass": -0.2,
}


def travel() -> tuple[np.ndarray, np.ndarray]:
    """Displacement and time of cycles of growing amplitude to 5 mm, 4 mm to the other side, sampled densely."""
    time = np.linspace(0.0, 40.0, 801)
    growth = np.interp(time, [0.0, 40.0], [2.0, 5.0])
    q = growth * np.sin(2 * np.pi * time / 8.0)
    return np.where(q < 0, 0.8 * q, q) + 1e-3, time


def cubic(q: np.ndarray, k: float = K, c: float = C) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return k * q + c * q**3, k + 3 * c * q**2, np.column_stack([q, q**3])


def typical(one: Effect) -> ActiveEffect:
    started = ActiveEffect(one).with_start_values()
    known = {
        p.name: TYPICAL[started.full_name(p)] for p in started.parameters if started.full_name(p) in TYPICAL
    }
    return ActiveEffect(one, dict(started.values) | known)


def response(
    active: list[ActiveEffect], k: float = K, c: float = C
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    names = [f"{one.name}.{name}" for one in active for name in one.values]
    columns = [*LAW, *names]

    def plain(q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        force, stiffness, slope = cubic(q, k, c)
        return force, stiffness, np.column_stack([slope, np.zeros((len(q), len(names)))])

    signal = elastic_response(active, *travel(), plain, columns)
    return signal.value, signal.slope, columns


def moved(active: list[ActiveEffect], column: str, step: float) -> np.ndarray:
    """Force with one parameter changed by a step."""
    if column in LAW:
        return response(active, **{"k": K, "c": C} | {column: {"k": K, "c": C}[column] + step})[0]
    name, parameter = column.split(".")
    changed = [
        ActiveEffect(one.effect, one.values | {parameter: one.values[parameter] + step})
        if one.name == name
        else one
        for one in active
    ]
    return response(changed)[0]


def check_derivatives(active: list[ActiveEffect]) -> None:
    force, slope, columns = response(active)
    for number, column in enumerate(columns):
        # Small against every scale of the curve, large against the rounding of the force.
        step = 1e-5 * {"k": K, "c": C, "bump_stop.stiffness": 400.0, "offset.force": 35.0}.get(column, 1.0)
        # A spring of 1e-9 mm/N is 3e-7 of the bushing; the rate of a curve bends within a sample, 0.05 s.
        # The largest force is some 5 kN.
        fine = {
            "rig_compliance.compliance": 1e-9,
            "rig_twist.compliance": 1e-9,
            "rig_compliance.curvature": 1e-10,
            "time_lag.lag": 1e-7,
        }
        step = fine.get(column, step)
        up, down = moved(active, column, step), moved(active, column, -step)
        exact, difference = slope[:, number], (up - down) / (2 * step)
        # Six digits of the largest derivative, plus the rounding of the force in the difference.
        noise = 1e-15 * np.abs(force).max() / step
        # Samples within a step of a knee have no derivative; there are at most a few of them.
        wrong = np.abs(exact - difference) > 1e-6 * np.abs(exact).max() + 20 * noise
        assert wrong.sum() <= 3, (
            column,
            np.flatnonzero(wrong)[:10],
            exact[wrong][:10],
            difference[wrong][:10],
        )


@pytest.mark.parametrize("one", RIG, ids=lambda one: one.name)
def test_an_effect_that_is_off_leaves_the_curve_exactly(one: Effect) -> None:
    off = ActiveEffect(one).off()
    np.testing.assert_array_equal(response([off])[0], cubic(travel()[0])[0])


@pytest.mark.parametrize("one", RIG, ids=lambda one: one.name)
def test_derivatives_where_it_is_off(one: Effect) -> None:
    check_derivatives([typical(one).off()])


def test_derivatives_of_a_rig_that_was_zeroed_under_a_preload() -> None:
    zeroed = ActiveEffect(effect("offset"), {"zeroed": 1.0, "preload": 1.234})
    others = [typical(one) for one in RIG if one.name != "offset"]
    check_derivatives([zeroed])
    check_derivatives([*others, zeroed])
    check_derivatives([zeroed.off()])


@pytest.mark.parametrize("one", RIG, ids=lambda one: one.name)
def test_derivatives_where_it_acts(one: Effect) -> None:
    active = [typical(one)]
    # The effect does act; otherwise its derivatives would mean nothing.
    assert np.abs(response(active)[0] - cubic(travel()[0])[0]).max() > 1.0
    check_derivatives(active)


def test_derivatives_of_all_together_and_of_the_law_through_them() -> None:
    check_derivatives([typical(one) for one in RIG])
    check_derivatives([typical(one).off() for one in RIG])


FREQUENCY = np.array([0.5, 20.0, 300.0])
STIFFNESS = np.array([290.0 + 10.0j, 310.0 + 30.0j, 350.0 + 20.0j])
VIBRATING = [one for one in ALL if one.acts == "rig" and "dynamic" in one.kinds]


def measured(active: list[ActiveEffect], part: np.ndarray = STIFFNESS) -> RigStiffness:
    """Return K* on the rig about a preload of 3 mm and 900 N."""
    names = [one.full_name(p) for one in active for p in one.parameters]
    return measured_stiffness(active, part, FREQUENCY, 3.0, 900.0, names)


@pytest.mark.parametrize("one", VIBRATING, ids=lambda one: one.name)
def test_an_effect_that_is_off_leaves_a_vibration_exactly(one: Effect) -> None:
    np.testing.assert_array_equal(measured([ActiveEffect(one).off()]).value, STIFFNESS)


def test_derivatives_of_a_vibration_with_all_effects_together() -> None:
    active = [replace(typical(one), rig="") for one in VIBRATING]
    found = measured(active)
    column = 0
    for i, one in enumerate(active):
        for p in one.parameters:
            step = 1e-6 * max(abs(one.values[p.name]), 1e-4)
            ends = []
            for moved in (one.values[p.name] + step, one.values[p.name] - step):
                changed = replace(one, values={**one.values, p.name: moved})
                ends.append(measured([*active[:i], changed, *active[i + 1 :]]).value)
            expected = (ends[0] - ends[1]) / (2.0 * step)
            tolerance = 1e-6 * np.abs(expected).max() + 1e-12 / step
            np.testing.assert_allclose(found.slope[:, column], expected, atol=tolerance, err_msg=p.name)
            column += 1
    ahead, behind = (measured(active, STIFFNESS + step).value for step in (1e-3, -1e-3))
    np.testing.assert_allclose(found.by_part, (ahead - behind) / 2e-3, rtol=1e-6)


def test_the_order_in_which_effects_are_named_plays_no_part() -> None:
    active = [typical(one) for one in RIG]
    forwards, backwards = response(active)[0], response(active[::-1])[0]
    np.testing.assert_array_equal(forwards, backwards)


@pytest.mark.parametrize("one", ALL, ids=lambda one: one.name)
def test_an_effect_says_what_it_is(one: Effect) -> None:
    assert one.summary.endswith(".")
    assert one.title[0].isupper()
    assert not one.title.endswith(".")
    assert "doi:10." in one.source
    assert one.needs
    assert one.amplitudes
    assert len({p.name for p in one.parameters}) == len(one.parameters)
    assert any(one.acts_on(mode, None) for mode in modes())
    for rival in one.rivals:
        assert rival != one.name
        assert one.name in effect(rival).rivals
    if one.acts == "rig":
        assert one.rig is not None


# Keys of the FMU's data and of its JSON, columns of recordings, and English words that are effects' names as well.
_OTHER_MEANINGS = {
    "bushcli/effects/exported.py": {"warming"},
    "bushcli/export/law.py": {"warming"},
    "bushcli/export/reduce.py": {"warming"},
    "bushcli/export/fmu/force_law.py": {"warming", "offset"},
    "bushcli/recording/dynamic/columns.py": {"offset"},
    "bushcli/inverse/thinned.py": {"offset"},
}


def test_only_its_own_file_names_an_effect() -> None:
    # A temperature is a condition of every test, too.
    names = "|".join(effects().keys() - {"temperature"})
    # The name alone or with a parameter ("gain.error"), as a case file has it, or in a sentence.
    naming = re.compile(rf'^({names})(?:[.@]\w+)?$|name = "(?:{names})"|the effect (?:{names})\b')
    found: dict[str, set[str]] = {}
    # In `forms` a branch of the rubber may have the name of the effect that adds it.
    for file in (f for root in ("bushcli", "cases", "geometry") for f in (ROOT / root).rglob("*.py")):
        place = file.relative_to(ROOT).as_posix()
        if place.startswith("bushcli/effects/library/"):
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and naming.search(node.value):
                found.setdefault(place, set()).add(node.value)
    assert found == _OTHER_MEANINGS


def test_a_title_keeps_the_capital_of_a_name_within_a_sentence() -> None:
    assert [phrase(name) for name in ("mullins", "payne", "friction", "unknown", "offset@radial")] == [
        *("Mullins softening", "Payne effect", "internal friction", "unknown physics", "zero offset (radial)")
    ]


def test_one_file_adds_an_effect(tmp_path, monkeypatch) -> None:
    factor = Path(library.__file__).with_name("batch_stiffness.py").read_text(encoding="utf-8")
    text = factor.replace('name="batch_stiffness"', 'name="ageing"').replace('"debonding", ', '"friction", ')
    (tmp_path / "ageing.py").write_text(text, encoding="utf-8")
    monkeypatch.setattr(library, "__path__", [*library.__path__, str(tmp_path)])
    effects.cache_clear()
    try:
        assert "ageing" in effect("friction").rivals
        assert effect_odds("ageing") == ODDS["usual"]
        ageing = ActiveEffect(effect("ageing"), {"log_factor": math.log(2.0)})
        material = Material("neo_hookean", 1000.0, {"C10": 0.5})
        assert rubber_of(material, [ageing]).parameters == {"C10": pytest.approx(1.0)}
        assert rubber_of(material, [ageing]).bulk_modulus == pytest.approx(2000.0)
        assert "ageing" in [one["name"] for one in as_json("effects")]
    finally:
        effects.cache_clear()
        sys.modules.pop("bushcli.effects.library.ageing", None)


@pytest.mark.parametrize("one", ALL, ids=lambda one: one.name)
def test_parameters_are_within_their_bounds(one: Effect) -> None:
    for parameter in one.parameters:
        assert parameter.admits(parameter.start)
        assert not parameter.admits(float("nan"))
        assert all(a < b for a, b in pairwise(parameter.scan))
        if parameter.off is None:
            continue
        assert parameter.admits(parameter.off)
        assert parameter.start != parameter.off
        assert not parameter.scan
    for parameter in one.parameters:
        if parameter.reciprocal is not None:
            assert parameter.lower == parameter.off == 0.0  # 1/0 is "absent", and nothing is beyond it
            assert parameter.reciprocal[0] not in {p.name for p in one.parameters}


# Scales of a recording of 100 s to 5 mm and 2 kN, of a bushing with 9 mm of rubber.
SCALES = {
    "duration": 100.0,
    "interval": 0.1,
    "travel": 5.0,
    "force": 2000.0,
    "stiffness": 400.0,
    "compliance": 1 / 400.0,
    "thickness": 9.0,
    "length": 34.0,
    "shear": 1.0,
    "squared arm": 1.0,
}


@pytest.mark.parametrize("one", ALL, ids=lambda one: one.name)
def test_every_parameter_has_a_prior_with_its_source(one: Effect) -> None:
    for parameter in one.parameters:
        prior = parameter.prior
        assert prior is not None, parameter.name
        # Long enough to be a reference, a standard, or the statement that there is none.
        assert len(prior.source) > 20, parameter.name
        # Start value, range of the prior and bounds must not contradict each other.
        assert parameter.of_mesh or not parameter.choices
        assert len(parameter.choices) == (prior.low if prior.shape == "choice" else 0)
        assert prior.tail(parameter.start, SCALES) > 1e-4, parameter.name
        assert math.isfinite(prior.log_density(parameter.start, SCALES)), parameter.name
        low, high = prior.range(SCALES)
        assert parameter.admits(low), parameter.name
        assert parameter.admits(high), parameter.name
        if parameter.lower < 0.0 < parameter.upper:
            assert prior.signed or prior.shape in ("t", "normal"), parameter.name
        if parameter.lower >= 0.0:
            assert not prior.signed, parameter.name
            assert prior.shape not in ("t", "normal"), parameter.name
        if prior.of in ("travel", "force", "stiffness", "force/duration", "squared arm"):
            assert parameter.of_channel, parameter.name


@pytest.mark.parametrize("one", ALL, ids=lambda one: one.name)
def test_values_go_through_json(one: Effect) -> None:
    active = ActiveEffect(one).with_start_values()
    again = ActiveEffect(effect(one.name), json.loads(json.dumps(dict(active.values))))
    assert again == active
    assert active.parameters_without_value == ()
    needed = {active.full_name(p) for p in active.parameters}
    assert set(ActiveEffect(one).parameters_without_value) == needed
    off = active.off().values
    assert all(off[p.name] == p.off for p in active.parameters if p.off is not None)


def test_an_unknown_effect_names_the_nearest() -> None:
    with pytest.raises(UnknownName, match='did you mean "mullins"'):
        effect("mulins")
    with pytest.raises(UnknownName, match='did you mean "inverse_r"'):
        effect("mullins").parameter("inverser")


def test_the_registry_needs_none_of_the_finite_element_stack() -> None:
    code = (
        "import sys\nfrom bushcli.effects.effect import effects\nassert len(effects()) > 3\n"
        "heavy = {'dolfinx', 'petsc4py', 'gmsh', 'ufl', 'matplotlib'} & set(sys.modules)\nassert not heavy, heavy\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_a_branch_is_complete_or_absent() -> None:
    one = ActiveEffect(effect("viscoelasticity"), {"g1": 0.3, "tau2": 4.0})
    assert one.parameters_without_value == ("viscoelasticity.tau1", "viscoelasticity.g2")
    assert one.with_start_values().values == {"g1": 0.3, "tau1": 10.0, "g2": 0.1, "tau2": 4.0}
    assert one.off().values == {"g1": 0.0, "tau1": 10.0, "g2": 0.0, "tau2": 4.0}


def test_values_and_time_are_asked_for_where_they_are_needed() -> None:
    one = ActiveEffect(effect("viscoelasticity"), {"g1": 0.3}, channels=("axial",))
    with pytest.raises(InputError, match=r"case\.toml: effects\.viscoelasticity\.tau1 is not given"):
        require_values([one], "case.toml")
    require_values([one.with_start_values()], "case.toml")
    with pytest.raises(InputError, match=r"axial\.csv: has no time, which the effect viscoelasticity needs"):
        require_time([one], "axial", "axial", "axial.csv")
    require_time([one], "torsional", "torsional", "torsional.csv")  # the effect does not act in this mode
