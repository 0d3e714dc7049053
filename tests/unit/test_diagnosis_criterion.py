"""When an effect pays, what is held out, and when nothing is left: on a cubic spring with known additions."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import binom

from bushcli.diagnosis.criterion import (
    bic_change,
    chi_square,
    effective_samples,
    least_chi_square,
    noise_test,
)
from bushcli.diagnosis.held_out import held_out
from bushcli.diagnosis.noise_model import Compared, NoiseModel
from bushcli.recording import Recording

SIGMA = 5.0
SEEDS = 200
# As many false alarms at 1 % in 200 trials come once in a thousand tests.
MOST_FALSE = int(binom.ppf(0.999, SEEDS, 0.01))
PHASE = np.linspace(0, 6 * np.pi, 300)
Q = 8 * np.sin(PHASE)


def law(q):
    return 100 * q + 2 * q**3


def channel(force, simulated, noise=None, q=Q):
    return Compared(
        Recording("axial", q, force, np.arange(float(len(q))), name="axial"),
        simulated,
        noise or NoiseModel(SIGMA),
    )


def fitted(force, columns):
    """Least squares: the channel, and the number of parameters."""
    j = np.column_stack(columns)
    return channel(force, j @ np.linalg.lstsq(j, force, rcond=None)[0]), j.shape[1]


def coloured(rng, r):
    n = len(Q)
    e = rng.normal(size=n)
    for i in range(1, n):
        e[i] = r * e[i - 1] + np.sqrt(1 - r**2) * e[i]
    return e


def ramps(*points, rates=1.0, hold=None, step=0.25):
    time, q = [0.0], [0.0]
    rates = np.broadcast_to(rates, len(points) - 1)
    for i, ((a, b), rate) in enumerate(zip(pairwise(points), rates, strict=True)):
        n = max(2, round(abs(b - a) / step))
        q += list(np.linspace(a, b, n + 1)[1:])
        time += list(time[-1] + abs(b - a) / rate * np.arange(1, n + 1) / n)
        if i == hold:
            q += [float(b)] * 30
            time += list(time[-1] + np.arange(1, 31.0))
    q = np.array(q)
    return Recording("axial", q, law(q), np.array(time), name="axial")


# -- stop at the noise -----------------------------------------------------------------------------------------------


def test_noise_is_called_noise_in_99_of_100():
    rng = np.random.default_rng(1)
    refused = 0
    for _ in range(SEEDS):
        one, p = fitted(law(Q) + SIGMA * rng.normal(size=len(Q)), (Q, Q**3))
        refused += not noise_test([one], p).is_noise
    assert refused <= MOST_FALSE


def test_noise_with_a_memory_is_noise_too():
    rng = np.random.default_rng(2)
    refused = {0.7: 0, 0.0: 0}
    for _ in range(SEEDS):
        force = law(Q) + SIGMA * coloured(rng, 0.7)
        for r in refused:
            refused[r] += not noise_test([channel(force, law(Q), NoiseModel(SIGMA, r))], 0).is_noise
    assert refused[0.7] <= MOST_FALSE
    # Who expects white noise sees the order.
    assert refused[0.0] == SEEDS


def test_a_smooth_misfit_is_seen_before_its_size_tells():
    """A third of the noise, smooth: the rms grows by 5 %, which 300 samples do not show, but their order does."""
    rng = np.random.default_rng(3)
    by_order = by_size = 0
    for _ in range(50):
        force = law(Q) + SIGMA * (rng.normal(size=len(Q)) + 0.45 * np.cos(2 * PHASE))
        found = noise_test([channel(force, law(Q))], 2)
        by_order += min(found.p_neighbours, found.p_runs) < 0.05
        by_size += found.p_size < 0.05
    assert by_order > by_size + 5
    assert by_order > 25


def test_a_noise_that_is_poorly_known_excuses_more():
    rng = np.random.default_rng(4)
    force = law(Q) + 1.15 * SIGMA * rng.normal(size=len(Q))
    known = noise_test([channel(force, law(Q), NoiseModel(SIGMA))], 2)
    guessed = noise_test([channel(force, law(Q), NoiseModel(SIGMA, freedom=20))], 2)
    assert known.p_size < 0.01 < guessed.p_size
    assert known.size == guessed.size == pytest.approx(1.15, rel=0.1)


def test_a_misfit_below_the_floor_is_as_good_as_noise():
    """Smooth, a tenth of what is taken for noise: a model is not asked for more."""
    assert noise_test([channel(law(Q) + 0.1 * SIGMA * np.cos(2 * PHASE), law(Q))], 2).is_noise
    assert not noise_test([channel(law(Q) + 1.4 * SIGMA * np.cos(2 * PHASE), law(Q))], 2).is_noise


# -- BIC -------------------------------------------------------------------------------------------------------------


def test_bic_asks_for_what_is_there_and_for_nothing_else():
    """ln 300 = 5.7 for a parameter: a superfluous one is taken with P(chi2_1 > 5.7) = 1.7 %."""

    def change(plain, more):
        drop = chi_square([plain[0]]) - chi_square([more[0]])
        return bic_change(drop, more[1] - plain[1], effective_samples([plain[0]]))

    rng = np.random.default_rng(5)
    taken = missed = 0
    for _ in range(SEEDS):
        e = SIGMA * rng.normal(size=len(Q))
        plain, more = fitted(law(Q) + e, (Q, Q**3)), fitted(law(Q) + e, (Q, Q**3, np.cos(PHASE)))
        taken += change(plain, more) < 0
        # Five standard errors of an amplitude whose column has the norm sqrt(150).
        force = law(Q) + 5 * SIGMA / np.sqrt(150) * np.cos(PHASE) + e
        plain, more = fitted(force, (Q, Q**3)), fitted(force, (Q, Q**3, np.cos(PHASE)))
        missed += change(plain, more) > 0
    assert taken <= binom.ppf(0.999, SEEDS, 0.017)
    # P(N(5, 1) < 2.4) = 0.5 %.
    assert missed <= binom.ppf(0.999, SEEDS, 0.005)


def test_samples_that_err_together_count_less():
    one = channel(law(Q), law(Q) + 1, NoiseModel(SIGMA, 0.5))
    assert effective_samples([one]) == pytest.approx(len(Q) / 3)
    assert chi_square([one]) == pytest.approx(len(Q) / 3 / SIGMA**2)


# -- held out --------------------------------------------------------------------------------------------------------


def test_the_last_cycle_that_has_its_like():
    assert held_out(ramps(0, 8, 0, 8, 0, 8, 0)).cycle == 3
    # The largest amplitude would be extrapolation; the one before it is held out.
    assert held_out(ramps(0, 4, 0, 4, 0, 8, 0)).cycle == 2
    # The only hold, at the peak of the last cycle, stays.
    assert held_out(ramps(0, 8, 0, 8, 0, 8, 0, hold=4)).cycle == 2
    # The only fast cycle stays.
    assert held_out(ramps(0, 8, 0, 8, 0, 8, 0, rates=[1, 1, 1, 1, 9, 9])).cycle == 2


def test_held_out_samples_are_the_cycles_own():
    recording = ramps(0, 8, 0, 8, 0, 8, 0)
    found = held_out(recording)
    assert found.text == "cycle 3"
    assert found.samples.sum() == 64
    assert found.samples[-64:].all()


@pytest.mark.parametrize("points", [(0, 8), (0, 8, 0), (0, 8, 0, 8, 0)])
def test_without_enough_cycles_blocks(points):
    """Neither end is held out, and a fifth to a third of the samples in all."""
    recording = ramps(*points, step=0.05)
    found = held_out(recording)
    assert found.cycle is None
    assert found.text.startswith("every fourth block")
    assert 0.18 < found.samples.mean() < 0.34
    assert not found.samples[0]
    assert not found.samples[-1]
    assert (held_out(recording).samples == found.samples).all()


def test_a_handful_of_points_is_all_needed():
    found = held_out(ramps(0, 2))
    assert not found.samples.any()
    assert found.text == "nothing"


def test_noise_leaves_less_than_its_least_once_in_a_hundred():
    """Also where the noise is known from few degrees of freedom; 200 recordings each."""
    for freedom in (np.inf, 60.0):
        below = 0
        for seed in range(SEEDS):
            rng = np.random.default_rng(seed)
            # What is taken for its standard deviation, estimated from so many degrees of freedom.
            known = SIGMA * (1.0 if np.isinf(freedom) else np.sqrt(rng.chisquare(freedom) / freedom))
            one, parameters = fitted(law(Q) + SIGMA * rng.normal(size=len(Q)), [Q, Q**3])
            one = channel(one.recording.force, one.simulated, NoiseModel(known, 0.0, freedom))
            below += chi_square([one]) < least_chi_square([one], parameters)
        assert below <= MOST_FALSE
    white = channel(law(Q), law(Q))
    assert 0.7 * 300 < least_chi_square([white], 2) < 298
    # As the worst known noise may be, so may be the sum.
    assert least_chi_square([replace(white, noise=NoiseModel(SIGMA, 0.0, 60.0))], 2) < least_chi_square(
        [white], 2
    )
