"""The Payne effect in time against an independent one-dimensional integration, its steady sine, and differences.

In small tension e the amount of local shear is sqrt(3) e and the stress of a branch 3 g mu times what is left of e.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from bushcli.effects.active import ActiveEffect, in_state
from bushcli.effects.effect import effect
from cases.feature import Installed
from cases.march import march
from cases.mode import modes
from cases.program import Program
from cases.series import Extension, SeriesSpring
from cases.simulate import prepare
from cases.sine import ThinnedSpectrum
from forms.branches.payne import spectrum
from geometry.shape import Refinement, shapes

SPECTRUM = {"g": 0.2, "tau": 20.0, "decades": 4.0, "slope": -0.1}
CLOCK = {"path": 300.0, "offset": 0.01, "exponent": 1.3, "pace": 8.0}
RECOVERY = 30.0
ACTIVATED = {"g1": 0.3, "tau1": 5.0, "exponent": 2.5}
MU = 1.0  # of LAWS["yeoh"] in tests/conftest.py
SHARP = 1e-11
DIMENSIONS = {"inner_radius": 9.0, "outer_radius": 18.0, "length": 20.0}


@pytest.fixture(scope="module")
def model(rubber):
    """Return a function from a mode to a model with the effect, with a second clock or without; each is built once."""

    @cache
    def make(mode, second_clock=False):
        coupon = mode in ("uniaxial", "equibiaxial", "planar")
        shape = shapes()["coupon"]() if coupon else shapes()["plain"](**DIMENSIONS)
        values = SPECTRUM | CLOCK | {"recovery": RECOVERY}
        features = [Installed("payne", effect("payne").feature(), values)]
        if second_clock:
            features.append(Installed("viscoelasticity", effect("viscoelasticity").feature(), ACTIVATED))
        law = rubber("yeoh", np.inf if coupon else 500.0)
        return prepare(shape, modes()[mode], law, Refinement(2, 4, 8), features=features)

    return make


def added(coupon, e, time, **values):
    """Stress over 3 mu that the effect adds at small strains, (n,): the mean over +-e drops the squares."""
    coupon.set_parameters({f"payne.{key}": value for key, value in values.items()})
    forces = []
    for g in (SPECTRUM["g"], 0.0):
        coupon.set_parameters({"payne.g": g})
        up, down = (march(coupon, Program(sign * e, time), tolerance=1e-12).force for sign in (1, -1))
        forces.append((up - down) / 2)
    coupon.set_parameters({"payne.g": SPECTRUM["g"]})
    return (forces[0] - forces[1]) / (3 * MU)


def integrated(e, time, recovery):
    """The law in one dimension, by steps so small that no rule for a step matters."""
    moduli, times = spectrum(**SPECTRUM)
    fine = np.linspace(0, len(time) - 1, 200 * (len(time) - 1) + 1)
    e, time = (np.interp(fine, np.arange(len(time)), values) for values in (e, time))
    h, centre, radius, stress = np.zeros(len(times)), 0.0, 0.0, [0.0]
    for i in range(1, len(e)):
        dt, de, shear = time[i] - time[i - 1], e[i] - e[i - 1], np.sqrt(3) * e[i]
        centre += (np.sqrt(3) * e[i - 1] - centre) * dt / recovery
        radius -= radius * dt / recovery
        beyond = max(abs(shear - centre) - radius, 0.0)
        centre += np.sign(shear - centre) * beyond / 2
        radius += beyond / 2
        thinning = (CLOCK["offset"] + radius) ** CLOCK["exponent"]
        z = dt + thinning * (CLOCK["pace"] * dt + CLOCK["path"] * np.sqrt(3) * abs(de))
        h = (h + de / 2) * np.exp(-z / times) + de / 2
        stress.append(moduli @ h)
    return np.array(stress)[::200]


@pytest.mark.parametrize("recovery", [RECOVERY, 1e9])
def test_loops_and_holds_are_those_of_the_law_in_one_dimension(recovery, model):
    """Ramp, hold, unload, a small cycle and one beyond the range so far, in one to eight steps each."""
    corners = 1e-3 * np.array([0.0, 4.0, 4.0, 1.0, 2.0, -6.0, 0.0])
    at = np.array([0.0, 1.0, 9.0, 9.5, 12.0, 13.0, 30.0])
    exact, errors = integrated(*rows(corners, at, 8), recovery)[::8], []
    for count in (1, 2, 4, 8):
        found = added(model("uniaxial"), *rows(corners, at, count), recovery=recovery)[::count]
        errors.append(np.abs(found - exact).max() / np.abs(exact).max())
    assert errors[0] < 2e-3
    assert errors[-1] < 1.5e-4


def rows(corners, at, count):
    """Return `count` equal steps between corners, beginning with the first corner."""
    return tuple(
        np.append(ends[0], np.concatenate([np.linspace(a, b, count + 1)[1:] for a, b in pairwise(ends)]))
        for ends in (corners, at)
    )


@pytest.mark.parametrize("shear", [1e-5, 1e-3, 1e-2, 5e-2])
def test_a_steady_sine_has_the_harmonics_of_the_thinned_spectrum(shear, model):
    """At the smallest amplitude it is linear: the sum of g i omega tau / (1 + i omega tau)."""
    moduli, times = spectrum(**SPECTRUM)
    cycles, steps, frequency = 6, 64, 2.0
    turn = 2 * np.pi * np.arange(cycles * steps + 1) / steps
    e = shear / np.sqrt(3) * np.sin(turn)
    last = slice(-steps, None)
    clock = CLOCK | ({"path": 1e-3, "pace": 0.0} if shear < 1e-4 else {})
    found = added(model("uniaxial"), e, turn / (2 * np.pi * frequency), recovery=1e9, **clock)
    harmonic = 2 / steps * (found[last] @ (np.sin(turn[last]) + 1j * np.cos(turn[last]))) * np.sqrt(3) / shear
    exact = ThinnedSpectrum(moduli, times, *clock.values()).harmonics(np.array([shear]), frequency)[0][0]
    assert abs(harmonic) == pytest.approx(abs(exact), rel=0.01)
    assert np.degrees(np.angle(harmonic / exact)) == pytest.approx(0.0, abs=0.5)
    if shear < 1e-4:
        x = 2j * np.pi * frequency * times
        assert exact == pytest.approx(moduli @ (x / (1 + x)), rel=1e-3)


def test_the_unrelaxed_state_is_that_of_a_sudden_step(model):
    """Its path thins it as in a step of a nanosecond; recovery and relaxation need time."""
    payne = ActiveEffect(effect("payne"), SPECTRUM | CLOCK | {"recovery": RECOVERY})
    (unrelaxed,) = in_state([payne], unrelaxed=True)
    e = np.linspace(0.0, 0.2, 21)
    forces = []
    for one, duration in ((payne, 1e-9), (unrelaxed, 1.0)):
        chosen = model("uniaxial")
        chosen.set_parameters({f"payne.{key}": value for key, value in one.values.items()})
        forces.append(march(chosen, Program(e, np.linspace(0.0, duration, 21)), tolerance=SHARP).force)
    assert forces[1] == pytest.approx(forces[0], rel=1e-6)


@pytest.mark.parametrize("mode", ["uniaxial", "equibiaxial", "planar"])
def test_dissipation_is_never_negative(mode, model):
    """Work minus the rise of the stored energy on random legs at random rates, for each pair of steps."""
    rng, pairs = np.random.default_rng(3), 20
    corners = np.append(0.0, rng.uniform(-0.2, 0.5, 6))
    durations = np.abs(np.diff(corners)) / 10.0 ** rng.uniform(-2, 1, 6)
    q, time = rows(corners, np.append(0.0, np.cumsum(durations)), 2 * pairs)
    chosen = model(mode)
    chosen.set_parameters({f"payne.{key}": value for key, value in (SPECTRUM | CLOCK).items()})
    history = march(chosen, Program(q, time), tolerance=SHARP)
    Q, energy = history.force, history.energy
    work = (Q[:-2:2] + 4 * Q[1:-1:2] + Q[2::2]) * (q[2::2] - q[:-2:2]) / 6
    dissipated = work - np.diff(energy[::2])
    assert dissipated.sum() > 0.05 * energy.max()
    assert dissipated.min() > -1e-3 * dissipated.sum()


# Up, hold, reversal, beyond the earlier peak, and back, in shares of the amplitude; s.
CYCLE = np.array([0.5, 1.0, 1.0, 0.2, -0.7, 1.2, 0.4])
TIME = np.array([1.0, 2.0, 9.0, 9.5, 12.0, 13.0, 20.0])
BODIES = {"axial": 3.0, "torsional": 0.15, "radial": 1.5}


@pytest.mark.parametrize(("mode", "second_clock"), [*((mode, False) for mode in BODIES), ("radial", True)])
def test_the_tangent_with_its_skew_part_is_the_derivative_of_the_forces(mode, second_clock, model):
    chosen, errors = model(mode, second_clock), []
    direction = np.random.default_rng(0).normal(size=len(chosen.state.x.array))

    def compare(solver):
        system, x = chosen.system, chosen.state.x.array
        system.stiffen()
        found, here, ends = system.pulls(direction[None])[0], x.copy(), []
        for sign in (1, -1):
            x[:] = here + sign * 1e-7 * direction
            b = system.create_vector()
            system.residual(b)
            ends.append(b.array_r.copy())
            b.destroy()
        x[:] = here
        expected = (ends[0] - ends[1]) / 2e-7
        errors.append(np.abs(found - expected).max() / np.abs(expected).max())

    march(chosen, Program(BODIES[mode] * CYCLE[:4], TIME[:4]), tolerance=SHARP, observer=compare)
    assert not chosen.system.symmetric
    assert max(errors) < 1e-6


# A spring is in series with any model; one in space with it says no more, and takes as long as all others.
@pytest.mark.parametrize(
    ("mode", "spring", "second_clock"),
    [("axial", 0.0, False), ("axial", 1e-3, False), ("radial", 0.0, False), ("axial", 0.0, True)],
)
def test_derivatives_are_exact(mode, spring, second_clock, model):
    """Through a hold and reversals, at a given travel and with a spring in series (whose travel is found to 1e-7)."""
    chosen = model(mode, second_clock)
    values = {"C10": 0.5} | {f"payne.{k}": v for k, v in (SPECTRUM | CLOCK | {"recovery": RECOVERY}).items()}
    if second_clock:
        values |= {f"viscoelasticity.{k}": v for k, v in ACTIVATED.items()}
    drive = None
    if spring:
        drive = SeriesSpring(lambda q, force, time: Extension(spring * force, 0.0, spring))

    def curve(changed, names=()):
        chosen.set_parameters(values | changed)
        program = Program(BODIES[mode] * CYCLE, TIME)
        return march(chosen, program, tolerance=SHARP, sensitivity=names, drive=drive)

    found = curve({}, tuple(values)).sensitivity
    close = 1e-5 if spring else 2e-6
    for (name, value), slope in zip(values.items(), found.T, strict=True):
        errors = []
        # A difference errs where a point reaches the edge of its range so far within the step.
        for step in (1e-3, 1e-4, 1e-5):
            ends = [curve({name: value * (1 + sign * step)}).force for sign in (1, -1)]
            expected = (ends[0] - ends[1]) / (2 * step * value)
            errors.append(np.abs(slope - expected).max() / np.abs(expected).max())
            if errors[-1] < close:
                break
        assert min(errors) < close, (name, errors)
