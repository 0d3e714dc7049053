"""Tables as channels of a diagnosis: the law's constants to first order about marches, and rows of all temperatures."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.case import load_case
from bushcli.effects.active import ActiveEffect
from bushcli.effects.effect import effects
from bushcli.selection.model import Model
from bushcli.selection.model_cache import ModelCache

CASE = """
temperature = 20.0
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[mesh]
elements_across = 2
[material]
law = "yeoh"
bulk_modulus = 2000.0
[[recordings]]
mode = "axial"
kind = "dynamic"
name = "rig"
file = "table.csv"
"""
YEOH = {"C10": 0.5, "C20": -0.05, "C30": 0.01}


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("table")
    rows = ["frequency_Hz,preload_mm,temperature_C,stiffness_N_per_mm,loss_angle_deg"]
    rows += [f"{f},{q},{T},{300 + f},5" for q in (0, 3) for T in (20, 60) for f in (1, 10, 100)]
    (folder / "table.csv").write_text("\n".join(rows) + "\n")
    (folder / "case.toml").write_text(CASE)
    return load_case(folder / "case.toml")


def channel(case, effects=()):
    """A cache of its own has no marches yet."""
    (found,) = ModelCache().channels(Model("yeoh", YEOH, effects=tuple(effects)).task(case))
    return found


@pytest.mark.parametrize(
    "moved", [{"C10": 0.56, "C20": -0.056, "C30": 0.0112}, {"C10": 0.53}, {"C20": -0.045}], ids=str
)
def test_constants_near_a_march_are_followed_to_first_order(case, moved):
    """Values within 0.1 % of those of a march with these constants, derivatives within 5 % (by C20: 4.6 % off)."""
    relaxing = ActiveEffect(effects()["viscoelasticity"], {"g1": 0.3, "tau1": 0.01})
    values = YEOH | {"viscoelasticity.g1": 0.3, "viscoelasticity.tau1": 0.01}
    names = (*YEOH, "viscoelasticity.g1")
    near, far = channel(case, [relaxing]), channel(case, [relaxing])
    near.solve(values, names)
    followed, exact = (one.solve(values | moved, names) for one in (near, far))
    assert not np.array_equal(followed.force, exact.force)
    assert near.recording.stiffness(followed.force) == pytest.approx(
        near.recording.stiffness(exact.force), rel=1e-3
    )
    sizes = np.linalg.norm(exact.slope, axis=0)
    assert np.linalg.norm(followed.slope - exact.slope, axis=0) == pytest.approx(
        0.0 * sizes, abs=0.05 * sizes.max()
    )


@pytest.mark.parametrize("relaxing", ["viscoelasticity", "payne"])
@pytest.mark.parametrize(
    "moved", [{"C1": 7.0, "C2": 80.0}, {"exponent": 1.6}, {"exponent": 0.2}, {"network": 12.0}], ids=str
)
def test_a_temperature_near_that_of_a_march_changes_branches_once(case, moved, relaxing):
    """Its constants shift the times of branches exactly, and the law's moduli by a power that is followed."""
    shown = effects()["temperature"]
    values = {"shift": 0.0, "reference": 20.0, "C1": 6.0, "C2": 100.0, "exponent": 1.0, "network": 5.0}
    warm = ActiveEffect(shown, values).with_start_values()
    branch = ActiveEffect(effects()[relaxing]).with_start_values()
    near, far = channel(case, [branch, warm]), channel(case, [branch, warm])
    values = YEOH | {
        active.full_name(p): active.values[p.name] for active in (branch, warm) for p in active.parameters
    }
    values = {name: value for name, value in values.items() if name not in {"temperature.shift"}}
    free = tuple(f"temperature.{name}" for name in ("C1", "C2", "exponent", "network"))
    near.solve(values, free)
    changed = values | {f"temperature.{name}": value for name, value in moved.items()}
    followed, exact = (one.solve(changed, free) for one in (near, far))
    assert not np.array_equal(followed.force, exact.force)
    np.testing.assert_allclose(followed.force, exact.force, atol=2e-3 * np.abs(exact.force).max())
    sizes = np.abs(exact.slope).max(axis=0)
    np.testing.assert_allclose(followed.slope / sizes, exact.slope / sizes, atol=0.03)


def test_constants_far_from_every_march_are_marched(case):
    one, other = channel(case), channel(case)
    one.solve(YEOH, tuple(YEOH))
    far = {"C10": 0.8, "C20": -0.02, "C30": 0.0}
    assert np.array_equal(one.solve(far, ()).force, other.solve(far, ()).force)


def test_warm_rows_relax_sooner_and_have_moduli_of_their_own(case):
    """Times over a_T, all moduli times (T / Tr)^exponent: with 40 K above the reference."""
    warm = ActiveEffect(
        effects()["temperature"], {"shift": 1.0, "reference": 20.0, "E": 40.0, "exponent": 1.0}
    )
    relaxing = ActiveEffect(effects()["viscoelasticity"], {"g1": 0.3, "tau1": 0.01})
    plain, heated = channel(case, [relaxing]), channel(case, [relaxing, warm])
    g1 = {"viscoelasticity.g1": 0.3}
    slower = np.exp(40.0 / 8.314462618e-3 * (1 / 333.15 - 1 / 293.15))
    hot = heated.recording.table.temperature > 40.0
    K = heated.recording.stiffness(
        heated.solve(
            YEOH | g1 | {"viscoelasticity.tau1": 0.01, "temperature.E": 40.0, "temperature.exponent": 1.0}, ()
        ).force
    )
    cold, sooner = (
        plain.recording.stiffness(plain.solve(YEOH | g1 | {"viscoelasticity.tau1": tau}, ()).force)
        for tau in (0.01, 0.01 * slower)
    )
    assert K[~hot] == pytest.approx(cold[~hot], rel=1e-6)
    # The bulk modulus stays.
    assert K[hot] == pytest.approx(sooner[hot] * 333.15 / 293.15, rel=2e-3)
