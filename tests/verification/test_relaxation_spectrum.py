"""Viscoelasticity with a spectrum: its branches in vibrations, on cards, along a path and in a sudden step."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.effects.active import ActiveEffect, in_state
from bushcli.effects.effect import effect
from bushcli.selection.additions import unthinned
from bushcli.selection.model import Model
from bushcli.simulate.vibrations import branches_of
from cases.feature import Installed
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.simulate import prepare
from forms.branches.payne import spectrum
from geometry.shape import Refinement, shapes

CATALOGUE = [effect(name) for name in ("payne", "viscoelasticity", "gain")]
SPECTRUM = {"g1": 0.1, "tau1": 30.0, "decades": 5.0, "slope": -0.2}
PAYNE = {"g": 0.1, "tau": 30.0, "decades": 5.0, "slope": -0.2, "path": 0.0}


def test_modulus_of_a_wide_spectrum_is_that_of_a_power_law():
    """g tau^slope per decade: the storage modulus is g int x^2 / (1 + x^2) tau^slope d(lg tau), x = omega tau."""
    branches = branches_of([ActiveEffect(effect("viscoelasticity"), SPECTRUM)])
    g, tau = np.array(branches).T
    times = np.logspace(np.log10(30.0) - 5.0, np.log10(30.0), 20001)
    for frequency in (0.05, 1.0, 20.0):
        x = 2j * np.pi * frequency * times
        exact = np.trapezoid(0.1 * times**-0.2 * x / (1 + x), np.log10(times))
        found = g @ (2j * np.pi * frequency * tau / (1 + 2j * np.pi * frequency * tau))
        assert abs(found - exact) < 0.02 * abs(exact)


def test_a_further_branch_and_the_card_stand_beside_it():
    values = {**SPECTRUM, "g2": 0.3, "tau2": 1e-4}
    branches = branches_of([ActiveEffect(effect("viscoelasticity"), values)])
    assert branches[:-1] == branches_of([ActiveEffect(effect("viscoelasticity"), SPECTRUM)])
    assert branches[-1] == (0.3, 1e-4)
    on_card = effect("viscoelasticity").on_card
    assert on_card is not None
    assert list(on_card(values).series) == branches


def test_along_a_path_it_is_the_payne_effect_without_thinning(rubber):
    q = np.concatenate([np.linspace(0.0, 2.0, 9), np.full(4, 2.0), np.linspace(2.0, -1.0, 9)[1:]])
    time = np.concatenate(
        [np.linspace(0.0, 1.0, 9), 1.0 + np.geomspace(0.1, 20.0, 4), 21.0 + np.linspace(0, 5, 9)[1:]]
    )
    forces = []
    for name, values in (("viscoelasticity", SPECTRUM), ("payne", PAYNE)):
        shape = shapes()["plain"](inner_radius=9.0, outer_radius=18.0, length=20.0)
        features = [Installed(name, effect(name).feature(), values)]
        model = prepare(
            shape, modes()["axial"], rubber("yeoh", 500.0), Refinement(2, 4, 8), features=features
        )
        forces.append(march(model, Program(q, time), tolerance=1e-11).force)
    assert forces[0] == pytest.approx(forces[1], rel=1e-7, abs=1e-6 * np.abs(forces[1]).max())


def test_in_a_sudden_step_no_branch_has_relaxed():
    active = ActiveEffect(effect("viscoelasticity"), SPECTRUM)
    (unrelaxed,) = in_state([active], unrelaxed=True)
    moduli, times = np.array(branches_of([unrelaxed])).T
    assert moduli == pytest.approx(spectrum(0.1, 30.0, 5.0, -0.2)[0], rel=1e-9)
    assert times.min() > 1e12


def test_unthinned_the_payne_effect_is_viscoelasticity_of_its_spectrum():
    payne = ActiveEffect(effect("payne"), {**PAYNE, "path": 100.0})
    gain = ActiveEffect(effect("gain"), {"error": 0.01}, ("axial",))
    (model,) = unthinned(Model("yeoh", {}, False, (payne, gain)), CATALOGUE)
    assert (
        model.identities
        == Model("yeoh", {}, False, (gain, ActiveEffect(effect("viscoelasticity"), SPECTRUM))).identities
    )
    relaxing = next(active for active in model.effects if active.effect.name == "viscoelasticity")
    assert dict(relaxing.values) == SPECTRUM
    # Nothing in its place where viscoelasticity acts already, or is not in the catalogue.
    both = Model("yeoh", {}, False, (payne, relaxing))
    assert not list(unthinned(both, CATALOGUE))
    assert not list(unthinned(Model("yeoh", {}, False, (payne,)), CATALOGUE[:1]))


@pytest.mark.parametrize("given", ["decades", "slope"])
def test_width_and_slope_belong_together(given):
    active = ActiveEffect(effect("viscoelasticity"), {name: SPECTRUM[name] for name in ("g1", "tau1", given)})
    (missing,) = {"decades", "slope"} - {given}
    assert active.parameters_without_value == (f"viscoelasticity.{missing}",)
    assert active.with_start_values().variant == "with decades"
