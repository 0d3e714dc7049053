"""Effects that may be there unnoticed beside the most probable model."""

from __future__ import annotations

import pytest

from bushcli.selection.unnoticed import unnoticed_effects
from tests.linear import World


@pytest.fixture
def world(coupon):
    return World(coupon)


def test_effects_that_change_the_recording_by_much_are_not_hidden(world, monkeypatch):
    found = world.search(monkeypatch)
    assert unnoticed_effects(found, found.plain) == {}


@pytest.mark.parametrize("name", ["drift", "permanent_set", "mullins"])
def test_an_effect_that_changes_it_by_less_than_noise_is_hidden(world, monkeypatch, name):
    """In the largest usual size, a few medians, its change is a thousandth of the others'."""
    for full in world.columns:
        if full.startswith(f"{name}."):
            world.columns[full] = 1e-4 * world.columns[full]
    found = world.search(monkeypatch)
    assert list(unnoticed_effects(found, found.plain)) == [name]


def test_an_effect_of_the_model_is_not_hidden(coupon, monkeypatch):
    world = World(coupon, **{"drift.rate": 2.5})
    found = world.search(monkeypatch)
    state = next(one for one in found.states.values() if one.model.identities == ("drift",))
    assert "drift" not in unnoticed_effects(found, state)
