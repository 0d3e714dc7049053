"""Branches, cycles and noise of synthetic recordings whose truth is known."""

from itertools import pairwise

import numpy as np
import pytest

from bushcli.curve.curve import Curve
from bushcli.curve.noise import converter_step, noise
from bushcli.curve.segment import displacement_noise as noise_of
from bushcli.curve.segment import excursions, segment


def program(*legs, dt=0.25):
    """Legs (target, rate) or ("hold", seconds), sampled every dt seconds: time, displacement, corners."""
    q, corners = [0.0], []
    for target, rate in legs:
        if target == "hold":
            q.extend([q[-1]] * round(rate / dt))
        else:
            steps = max(1, round(abs(target - q[-1]) / rate / dt))
            q.extend(np.linspace(q[-1], target, steps + 1)[1:])
        corners.append(len(q) - 1)
    return dt * np.arange(len(q)), np.array(q), corners


def code(found):
    """Branches as text: L loading, U unloading, H hold, with the cycle."""
    return " ".join(f"{b.kind[0].upper()}{b.cycle}" for b in found)


LEGS = ((2, 0.2), (0, 0.2), (4, 0.2), (0, 0.2), (-3, 0.2), (0, 0.2), (4, 4.0), ("hold", 20.0), (0, 0.2))


@pytest.mark.parametrize("sigma", [0.0, 1e-4, 3e-3, 2e-2])
@pytest.mark.parametrize("timed", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_branches_of_a_program_with_a_hold(sigma, timed, seed):
    t, q, corners = program(*LEGS)
    noisy = q + sigma * np.random.default_rng(seed).normal(size=len(q))
    found = segment(noisy, t if timed else None)
    assert code(found) == "L1 U1 L2 U2 L2 U2 L3 H3 U3"
    assert found[0].start == 0
    assert found[-1].stop == len(q)
    assert all(a.stop == b.start for a, b in pairwise(found))
    # Noise can hide a corner by a few samples, which are 0.05 mm apart.
    reach = 2 + int(8 * sigma / 0.05)
    assert np.abs(np.array([b.stop - 1 for b in found]) - corners).max() <= reach


@pytest.mark.parametrize("sigma", [0.0, 3e-3])
def test_cycles_are_full_reversals(sigma):
    t, q, _ = program((3, 0.5), (1, 0.5), (3, 0.5), (-3, 0.5), (3, 0.5), (0, 0.5))
    noisy = q + sigma * np.random.default_rng(7).normal(size=len(q))
    found = segment(noisy, t)
    assert code(found) == "L1 U1 L2 U2 L2 U2 L3 U3"
    assert code(excursions(noisy, t)) == "L1 U1 L2 U2 L3 U3 L4 U4"
    assert [b.direction for b in found] == [1, -1, 1, -1, -1, 1, 1, -1]


def test_a_sine_has_no_holds():
    t = np.linspace(0, 4, 801)
    for sigma in (0.0, 1e-3, 5e-3):
        q = 2 * np.sin(2 * np.pi * t / 2) + sigma * np.random.default_rng(1).normal(size=len(t))
        assert code(segment(q, t)) == "L1 U1 L1 U1 L2 U2 L2 U2"


def test_a_stepwise_relaxation():
    legs = [leg for q in (0.25, 0.5, 0.75, 0.5, 0.25) for leg in ((q, 0.05), ("hold", 100.0))]
    t, q, _ = program(*legs)
    for sigma in (0.0, 2e-4):
        noisy = q + sigma * np.random.default_rng(2).normal(size=len(q))
        assert code(segment(noisy, t)) == "L1 H1 L1 H1 L1 H1 U1 H1 U1 H1"


@pytest.mark.parametrize(
    ("step", "noise"), [(0.05, 0.0), (0.02, 0.0), (0.02, 0.2), (0.01, 1.0), (0.002, 0.33), (0.002, 0.25)]
)
@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("cycles", [1, 3])
def test_a_level_of_a_converter_is_no_hold_and_its_step_no_turning_point(step, noise, held, cycles):
    """Steps of 0.2 to 5 % of the amplitude, noise in steps; 0.002 mm a sample."""
    waits = [("hold", 150.0)] * held
    t, q, _ = program(*[(0.5, 0.02), *waits, (-0.5, 0.02), (0, 0.02)] * cycles, dt=0.1)
    for seed in range(3):
        noisy = q + noise * step * np.random.default_rng(seed).normal(size=len(q))
        found = segment(np.round(noisy / step) * step, t)
        assert max(branch.cycle for branch in found) == cycles
        durations = [t[branch.stop - 1] - t[branch.start] for branch in found if branch.kind == "hold"]
        # Ramps pass a step in up to 2.5 s: the level before and after a hold is part of it at most.
        assert durations == pytest.approx([150.0] * held * cycles, abs=6.0)


@pytest.mark.parametrize("step", [0.0005, 0.001, 0.002, 0.01, 0.05])
@pytest.mark.parametrize("samples", [50, 500, 2000])
def test_the_crest_of_a_sine_from_a_converter_is_no_hold(step, samples):
    t = np.arange(3 * samples + 1) / samples
    found = segment(np.round(np.sin(2 * np.pi * t) / step) * step, t)
    assert code(found) == "L1 U1 L1 U1 L2 U2 L2 U2 L3 U3 L3 U3"


def test_ten_steps_of_a_relaxation_are_no_levels_of_a_converter():
    assert converter_step(np.repeat([*range(11), *range(9, -1, -1)], 60) * 0.1) == 0.0


def test_waiting_before_the_start_is_a_hold():
    t, q, _ = program(("hold", 10.0), (2, 0.2), (0, 0.2))
    q = q + 3e-3 * np.random.default_rng(3).normal(size=len(q))
    assert code(segment(q, t)) == "H1 L1 U1"


@pytest.mark.parametrize("n", [2, 3, 5])
def test_short_and_constant_signals_are_one_branch(n):
    assert code(segment(np.linspace(0, 1, n))) == "L1"
    assert code(segment(np.linspace(0, -1, n))) == "L1"
    assert code(segment(np.linspace(1, 0, n))) == "U1"
    assert code(segment(np.full(n, 0.5))) == "H1"


@pytest.mark.parametrize("seed", range(20))
def test_any_signal_is_covered_without_gap_or_overlap(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 300))
    q = [rng.normal(size=n), np.cumsum(rng.normal(size=n)), rng.integers(0, 3, n).astype(float)][seed % 3]
    found = segment(q, np.cumsum(rng.exponential(size=n) + 1e-9) if seed % 2 else None)
    covered = np.concatenate([np.arange(b.start, b.stop) for b in found])
    np.testing.assert_array_equal(covered, np.arange(n))
    assert all(b.cycle - a.cycle in (0, 1) for a, b in pairwise(found))


@pytest.mark.parametrize("sigma", [0.5, 5.0, 20.0])
def test_noise_of_force_and_displacement_is_found(sigma):
    """Estimates from 400 samples scatter by 7 % (variance of difference estimators): 25 % is 3.5 sigma."""
    t, q, _ = program(*LEGS)
    for seed in range(5):
        rng = np.random.default_rng(seed)
        force = 300 * q + 5 * q**3 + 40 * np.sign(np.gradient(q)) + sigma * rng.normal(size=len(q))
        curve = Curve("axial", q + 3e-3 * rng.normal(size=len(q)), force, t)
        assert curve.force_noise == pytest.approx(sigma, rel=0.25)
        assert curve.displacement_noise == pytest.approx(3e-3, rel=0.25)


def test_noise_is_independent_of_the_spacing():
    """White noise on a parabola, irregular sampling: third differences annihilate the parabola exactly."""
    rng = np.random.default_rng(11)
    x = np.cumsum(rng.uniform(0.1, 5.0, 2000))
    y = 3 + 0.1 * x - 2e-4 * x**2
    assert noise(y, x) < 1e-9
    # 2000 samples scatter by 3 %: 10 % is more than 3 sigma.
    assert noise(y + 0.7 * rng.normal(size=len(x)), x) == pytest.approx(0.7, rel=0.10)


def test_noise_is_robust_to_outliers():
    rng = np.random.default_rng(12)
    y = rng.normal(size=1000)
    y[::50] += 100.0
    # Four of fifty windows contain an outlier: the estimate rises a little, the plain standard deviation to 14.
    assert noise(y, np.arange(1000.0)) == pytest.approx(1.0, rel=0.15)


def test_noise_of_very_few_samples_is_a_number():
    for n in range(1, 6):
        assert np.isfinite(noise(np.arange(n) ** 2.0, np.arange(float(n))))


@pytest.mark.parametrize("samples", [8, 10, 16, 40])
def test_the_curvature_of_sparse_sines_is_no_noise(samples):
    """Third differences alone give 0.27, 0.15, 0.04 and 0.003 mm: a march within five times that cut the peaks off."""
    t = 1.0013 * np.arange(12 * samples + 1) / samples
    q = 4.0 * np.sin(2 * np.pi * t) + 8e-4 * np.random.default_rng(0).standard_normal(len(t))
    assert 6e-4 < noise_of(q, t) < 2e-3


def test_displacement_noise_of_exact_steps_is_zero():
    t, q, _ = program(*LEGS)
    assert noise_of(q, t) < 1e-12
