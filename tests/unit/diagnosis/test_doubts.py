"""Doubts about a diagnosis that follow from its recordings alone."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bushcli.diagnosis.answer import _held_out, _long_memory, _search_doubts, _unrelaxed_start, form_error
from bushcli.effects.effect import effects as catalogue
from bushcli.likelihood.features import features
from bushcli.likelihood.noise import Compared, NoiseModel, noise_model
from bushcli.recording import Recording

TIME = np.linspace(0.0, 200.0, 401)
Q = 5.0 * np.interp(TIME % 40.0, [0.0, 10.0, 30.0, 40.0], [0.0, 1.0, -1.0, 0.0])
LAW = 100.0 * Q + 2.0 * Q**3


def asked(misfit: Any, taken: NoiseModel | None = None) -> Any:
    """The best model and the common data of a diagnosis of one recording with noise of 3 N."""
    noise = 3.0 * np.random.default_rng(4).normal(size=len(Q))
    recording = Recording("axial", Q, LAW + misfit + noise, TIME, name="axial")
    used, own = np.ones(len(Q), dtype=bool), taken or noise_model(recording)
    compared = Compared(recording, LAW, own)
    problem = SimpleNamespace(
        used=(used,),
        compared_recordings=lambda simulated: (compared,),
        likelihood=SimpleNamespace(features=(features(recording, own, used, 0.005),)),
    )
    best = SimpleNamespace(state=SimpleNamespace(fitted=SimpleNamespace(simulated=(LAW,))))
    return best, problem


def test_a_table_that_was_held_out_and_is_missed_is_said():
    loop = SimpleNamespace(
        name="loop", held_out=True, after_percent=0.9, noise_percent=0.1, of="of the force range"
    )
    table = SimpleNamespace(name="sweep", held_out=True, after_percent=4.0, noise_percent=0.5, of="of K*")
    (condition,) = _held_out((loop, table))
    assert "sweep by 4 % of K*, noise 0.5 %" in condition.message
    assert "loop" not in condition.message


@pytest.mark.parametrize(
    ("left", "words"), [(1e-4, "less than 1 %"), (0.33, "33 %"), (0.9999, "more than 99 %")]
)
def test_what_a_budget_left_open_is_never_nothing_and_never_all(left, words):
    best = SimpleNamespace(state=SimpleNamespace(fitted=SimpleNamespace(converged=True)))
    (doubt,) = _search_doubts(best, SimpleNamespace(not_simulated=(), lost=(), ended="budget", left=left))
    assert doubt.message.endswith(f"further fits could shift {words} of the probability")


def test_noise_as_short_windows_show_it_is_not_doubted():
    assert list(_long_memory(*asked(0.0))) == []


@pytest.mark.parametrize("timed", [True, False])
def test_noise_that_only_the_misfit_suggests_is_doubted_and_described(timed):
    """The zero goes up and down by 20 N in 130 s; noise of 12 N that lasts for 15 samples would explain it as well."""
    best, problem = asked(20.0 * np.sin(TIME / 20.0), NoiseModel(12.0, 0.875, 20.0))
    if not timed:
        (compared,) = problem.compared_recordings(())
        compared = replace(compared, recording=replace(compared.recording, time=None))
        problem.compared_recordings = lambda simulated: (compared,)
    (doubt,) = _long_memory(best, problem)
    assert doubt.name == "noise_with_memory"
    assert ("that is correlated over 15 samples (7.5 s)" in doubt.message) == timed
    # 3 N of a range of 1500 N.
    assert "windows of some 24 samples show noise of 0.2 %" in doubt.message
    if timed:
        assert "(the zero of the force " in doubt.message


@pytest.mark.parametrize(("first", "words"), [(20, "the first cycle, once more"), (60, "a ramp from zero")])
def test_a_recording_not_from_rest_is_doubted_where_the_model_remembers(first, words):
    stop = first + 81 if first == 20 else first + 41
    part = slice(first, stop)
    recording = Recording("axial", Q[part], LAW[part], TIME[part], name="axial")
    problem = SimpleNamespace(
        recordings=(recording, Recording("axial", Q[:81], LAW[:81], TIME[:81], name="axial"))
    )
    for name, remembers in (("friction", True), ("time_lag", False), ("swaging", False)):
        effects = (SimpleNamespace(effect=catalogue()[name]),)
        best = SimpleNamespace(state=SimpleNamespace(model=SimpleNamespace(effects=effects)))
        found = _unrelaxed_start(best, problem)
        assert [one.name for one in found] == ["not_from_rest"] * remembers
        assert not remembers or words in found[0].message


def test_the_unknown_force_has_the_size_that_is_drawn():
    """The misfit is a wave of 20 N along the path and noise of 3 N: nearly all of it above the noise is smooth."""
    best, problem = asked(20.0 * np.sin(TIME / 20.0))
    best = SimpleNamespace(
        unknown=True,
        state=SimpleNamespace(evidence=SimpleNamespace(judgement=None), fitted=best.state.fitted),
    )
    found = form_error(best, problem.likelihood, problem.compared_recordings(()))
    span = float(np.ptp(LAW + 20.0 * np.sin(TIME / 20.0)))
    assert found.percent["axial"] == pytest.approx(100.0 * 20.0 / np.sqrt(2.0) / span, rel=0.1)
    assert found.share == 0.0
    assert found.covers > 0.95
    # Ripples are too fine to be drawn as a whole: what is not drawn is not covered.
    _, problem = asked(20.0 * np.sin(2 * np.pi * Q / 0.7), NoiseModel(3.0))
    found = form_error(best, problem.likelihood, problem.compared_recordings(()))
    assert found.covers < 0.7
    drawn = found.percent["axial"] / (100.0 * 20.0 / np.sqrt(2.0) / span)
    assert found.covers == pytest.approx(drawn**2, abs=0.15)


@pytest.mark.parametrize("hum", [0.0, 20.0])
def test_what_is_too_fast_for_the_features_is_told_and_is_no_error_of_form(hum):
    """A hum of 2.3 samples a period; noise of 3 N."""
    _, problem = asked(hum * np.sin(2 * np.pi * TIME / 1.163), NoiseModel(3.0))
    none = SimpleNamespace(excess=np.zeros(1))
    evidence = SimpleNamespace(judgement=SimpleNamespace(scale=(1.0,), phi=0.14), left=none)
    best = SimpleNamespace(
        unknown=False, state=SimpleNamespace(evidence=evidence, model=SimpleNamespace(effects=()))
    )
    likelihood = SimpleNamespace(features=problem.likelihood.features, effective=np.ones(1))
    found = form_error(best, likelihood, problem.compared_recordings(()))
    (compared,) = problem.compared_recordings(())
    size = 100.0 * hum / np.sqrt(2.0) / float(np.ptp(compared.recording.force))
    assert found.percent["axial"] == 0.0
    assert found.fast == ({"axial": pytest.approx(size, rel=0.1)} if hum else {})
