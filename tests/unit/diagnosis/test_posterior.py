"""From evidence to probabilities: of models, effects and groups of them."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from bushcli.diagnosis.posterior import WeighedModel, credible_sets, groups, posterior, probabilities
from bushcli.effects.effect import effects

ALL = list(effects())


def state(*names, log=0.0, unknown=-5.0, fixed=False):
    return SimpleNamespace(
        model=SimpleNamespace(identities=tuple(sorted(names)), fixed=fixed, effects=()),
        evidence=SimpleNamespace(log=log, log_unknown=unknown),
    )


def test_a_law_set_free_stands_among_the_effects():
    """With a law from coupons, a model that refits the law to the recordings has no effect, but is not "nothing"."""
    states = {0: state(fixed=True), 1: state(log=3.0), 2: state("batch_stiffness", log=4.0, fixed=True)}
    search = SimpleNamespace(
        states=states,
        weights=lambda one: (one.evidence.log, one.evidence.log_unknown),
        counted_models=[],
        smallest_equivalent=lambda key: key,
        total=math.log(sum(math.exp(w) for one in states.values() for w in (one.evidence.log, -5.0))),
        plain=states[0],
        catalogue=ALL,
        uniform=False,
    )
    found = posterior(search)
    free = next(one for one in found if one.state is states[1] and not one.unknown)
    assert free.effects == ("free_law",)
    probability = probabilities(found, ["batch_stiffness"])
    assert probability["free_law"] > 0.2
    assert probability["nothing"] < 0.05


def weighed(*pairs):
    """Models by their effects, with probabilities; "unknown" among the effects is the unknown one."""
    made = [
        WeighedModel(state(*(n for n in names if n != "unknown")), "unknown" in names, p, 0.0)
        for names, p in pairs
    ]
    return tuple(sorted(made, key=lambda one: -one.probability))


def grouped(*pairs):
    models = weighed(*pairs)
    return groups(models, probabilities(models, ALL))


def test_probabilities_sum_to_one_and_go_by_evidence_times_odds():
    states = {i: state(*names, log=log) for i, (names, log) in enumerate([((), 0.0), (("mullins",), 8.0)])}
    odds = {0: 0.0, 1: math.log(0.03)}
    known = {id(one): odds[i] for i, one in states.items()}

    def weights(one):
        return one.evidence.log + known[id(one)], one.evidence.log_unknown + known[id(one)] - 4.0

    # A third model is included by its prediction alone.
    queued = SimpleNamespace(
        base=states[1],
        model=SimpleNamespace(identities=("mullins", "offset"), fixed=False),
        predicted_weight=0.5,
        log_evidence=5.1,
        is_silent=False,
    )
    total = math.log(sum(math.exp(w) for one in states.values() for w in weights(one)) + math.exp(0.5))
    search = SimpleNamespace(
        states=states,
        weights=weights,
        counted_models=[queued],
        smallest_equivalent=lambda key: key,
        total=total,
        plain=states[0],
        catalogue=ALL,
        uniform=False,
    )
    found = posterior(search)
    assert sum(one.probability for one in found) == pytest.approx(1.0, abs=1e-12)
    assert [one.probability for one in found] == sorted((one.probability for one in found), reverse=True)
    best = found[0]
    second = next(one for one in found if one.effects == ())
    assert best.effects == ("mullins",)
    assert best.probability / second.probability == pytest.approx(0.03 * math.exp(8.0))
    assert {one.effects for one in found} == {
        (),
        ("mullins",),
        ("unknown",),
        ("mullins", "unknown"),
        ("mullins", "offset"),
    }


def test_names_of_people_keep_their_capital_in_the_text_of_a_group():
    (one,) = grouped((("friction",), 0.5), (("mullins",), 0.4), ((), 0.1))
    assert one.text.endswith(
        "internal friction or Mullins softening, which these recordings cannot tell apart"
    )


def test_an_effect_has_the_sum_over_its_models():
    models = weighed((("mullins",), 0.6), (("mullins", "offset"), 0.25), (("unknown",), 0.1), ((), 0.05))
    found = probabilities(models, ["mullins", "offset", "friction"])
    assert found == pytest.approx(
        {"mullins": 0.85, "offset": 0.25, "friction": 0.0, "unknown": 0.1, "nothing": 0.05}
    )


def test_an_effect_of_a_rig_counts_as_the_catalogue_s():
    models = weighed((("offset@axial",), 0.5), (("offset@axial", "offset@torsional"), 0.4), ((), 0.1))
    assert probabilities(models, ["offset"])["offset"] == pytest.approx(0.9)


def test_the_credible_set_is_the_smallest_that_holds_95_percent():
    models = weighed((("mullins",), 0.7), (("friction",), 0.2), (("swaging",), 0.06), ((), 0.04))
    assert credible_sets(models) == [("mullins",), ("friction",), ("swaging",)]
    assert credible_sets(weighed((("mullins",), 0.96), ((), 0.04))) == [("mullins",)]


def test_laws_of_one_set_of_effects_are_one_rival():
    models = weighed((("mullins",), 0.5), (("mullins",), 0.3), (("friction",), 0.2))
    assert credible_sets(models) == [("mullins",), ("friction",)]


def test_friction_or_viscosity_is_dissipation():
    (one,) = grouped((("friction",), 0.5), (("viscoelasticity",), 0.48), ((), 0.02))
    assert one.name == "dissipation"
    assert one.effects == ("friction", "viscoelasticity")
    assert one.probability == pytest.approx(0.98)
    assert one.text.startswith("dissipation: ")
    assert "which these recordings cannot tell apart" in one.text


def test_a_group_is_the_same_beside_another_effect():
    (one,) = grouped((("friction", "offset"), 0.5), (("offset", "viscoelasticity"), 0.5))
    assert one.effects == ("friction", "viscoelasticity")


def test_what_is_certain_is_in_no_group():
    assert grouped((("friction",), 0.96), (("viscoelasticity",), 0.04)) == ()
    assert grouped((("friction",), 0.45), (("viscoelasticity",), 0.03), ((), 0.52)) == ()
    # Beside one that is nearly certain, an improbable effect is named where only the two together are certain.
    (one,) = grouped((("friction",), 0.93), (("viscoelasticity",), 0.04), ((), 0.03))
    assert one.effects == ("friction", "viscoelasticity")
    assert one.probability == pytest.approx(0.97)


def test_the_unknown_effect_is_in_no_group():
    assert grouped((("friction",), 0.5), (("unknown",), 0.5)) == ()


def test_three_rivals_are_one_group_and_strangers_have_no_family():
    (one,) = grouped((("friction",), 0.4), (("viscoelasticity",), 0.3), (("time_lag",), 0.3))
    assert (one.name, set(one.effects)) == ("dissipation", {"friction", "viscoelasticity", "time_lag"})
    (one,) = grouped((("swaging",), 0.6), (("mullins",), 0.4))
    assert one.name == ""
    assert one.probability == pytest.approx(1.0)
