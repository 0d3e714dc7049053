"""Where the misfit is: a misfit that is put into one place of a toy curve is found there, and noise nowhere."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import binom

from bushcli.curve.misfit import correlation_time
from bushcli.diagnosis.words import sentence, sentences
from bushcli.likelihood.noise import (
    Compared,
    NoiseModel,
    noise_model,
)
from bushcli.mismatch.bins import bins
from bushcli.mismatch.record import _mismatch, locate
from bushcli.mismatch.scan import Box
from bushcli.recording import Recording, select_cycles

SIGMA = 5.0
SEEDS = 200
# So many false alarms in 200 trials at 5 % occur once in a thousand tests.
MOST_FALSE = int(binom.ppf(0.999, SEEDS, 0.05))


def ramps(*points, rates=1.0, step=0.2):
    rates = np.broadcast_to(rates, len(points) - 1)
    time, q = [0.0], [float(points[0])]
    for (a, b), rate in zip(pairwise(points), rates, strict=True):
        n = max(2, round(abs(b - a) / step))
        if a == b:  # a hold of 30 s
            n = 30
            time += list(time[-1] + np.arange(1, n + 1))
        else:
            time += list(time[-1] + abs(b - a) / rate * np.arange(1, n + 1) / n)
        q += list(np.linspace(a, b, n + 1)[1:])
    return np.array(time), np.array(q)


def law(q):
    return 100 * q + 2 * q**3


def recording(time, q, force, name="axial", mode="axial"):
    return Recording(mode, q, force, time, name=name)


def which(time, q, kind=None, cycles=None):
    """Mask of the samples in branches of this kind and in these cycles."""
    mask = np.zeros(len(q), dtype=bool)
    for b in recording(time, q, law(q)).branches:
        mask[b.start : b.stop] = (kind is None or b.kind == kind) and (cycles is None or b.cycle in cycles)
    return mask


def found(time, q, truth, seed=0, noise=None):
    """Locate the misfit of `law` against a recording of the truth with noise."""
    force = truth + SIGMA * np.random.default_rng(seed).normal(size=len(q))
    return locate([Compared(recording(time, q, force), law(q), noise or NoiseModel(SIGMA))])


ONE_SIDED = ramps(0, 6, 0, 6, 0, 8, 0, 8, 0, 8, 0)
BOTH_SIDES = ramps(0, 8, 0, -8, 0, 8, 0, -8, 0, 8, 0, -8, 0)


def test_the_sentence_of_the_issue():
    """In unloading below 4 mm in cycles 1 to 3 the recording has 1 / 1.21 of the simulated force."""
    time, q = ONE_SIDED
    place = which(time, q, "unloading", (1, 2, 3)) & (q < 4)
    location = found(time, q, np.where(place, law(q) / 1.21, law(q)))
    (one,) = location.mismatch
    assert (one.channel, one.branch, one.cycle, one.sign) == ("axial", "unloading", (1, 3), "too_stiff")
    assert (one.displacement_from, one.displacement_to) == (0.0, 4.0)
    assert one.relative == pytest.approx(0.21, abs=0.01)
    assert one.share > 0.95
    (text,) = sentences(location)
    assert text.endswith(
        "of the misfit above the noise is on unloading below 4 mm in cycles 1 to 3: "
        "the simulation is 21 % too stiff there"
    )


def test_a_coupon_has_strain():
    """A strain has no unit, so that the sentence must name the quantity."""
    time, q = ONE_SIDED
    place = which(time, q, "unloading") & (q < 4)
    (one,) = found(time, q, np.where(place, law(q) / 1.21, law(q))).mismatch
    below = replace(one, mode="uniaxial", displacement_to=0.5)
    assert "on unloading below a strain of 0.5:" in sentence(below)
    between = replace(below, displacement_from=0.25, side="negative", whole=one.whole - {"side"})
    assert "between strains of 0.25 and 0.5 at negative strain:" in sentence(between)


def test_a_factor_is_everywhere():
    """The whole recording, both sides: no branch, cycle, side or band is named."""
    time, q = BOTH_SIDES
    location = found(time, q, law(q) / 1.3)
    assert location.mismatch[0].whole >= {"cycle", "branch", "side", "displacement"}
    assert sentences(location)[0].startswith(
        "100 % of the misfit above the noise is spread over the whole recording"
    )
    assert "30 % too stiff" in sentences(location)[0]


def test_a_share_that_rounds_to_nothing_is_told_as_less_than_one():
    time, q = BOTH_SIDES
    (one, *_) = found(time, q, law(q) / 1.3).mismatch
    assert sentence(replace(one, share=0.004)).startswith("less than 1 % of the misfit above the noise")
    assert sentence(replace(one, share=0.012)).startswith("1 % of")


def test_an_offset_is_too_low_on_both_sides_and_not_stiff_on_one_and_soft_on_the_other():
    time, q = BOTH_SIDES
    (one,) = found(time, q, law(q) + 12).mismatch
    assert (one.sign, one.side) == ("too_low", "both")
    assert one.relative is None
    assert one.difference == pytest.approx(-12, abs=1)


def test_one_side():
    time, q = BOTH_SIDES
    (one,) = found(time, q, np.where(q < -5, 1.2 * law(q), law(q))).mismatch
    assert (one.side, one.sign, one.displacement_from) == ("negative", "too_soft", 5.0)
    assert one.relative == pytest.approx(1 / 1.2 - 1, abs=0.01)


def test_the_first_loading_beyond_which_all_is_softer():
    """A fit to softened rubber is too soft on the virgin path only."""
    time, q = ramps(0, 8, 0, 8, 0, 8, 0, 8, 0)
    (one,) = found(time, q, np.where(which(time, q, "loading", (1,)), 1.15 * law(q), law(q))).mismatch
    assert (one.branch, one.cycle, one.sign) == ("loading", (1, 1), "too_soft")
    assert one.whole >= {"displacement", "side"}


def test_cycles_that_were_selected_keep_their_numbers_and_their_rates():
    """Of six cycles at one rate 2, 3 and 6 are used, and in the last one the rubber is softer."""
    time, q = ramps(0, 6, 0, 6, 0, 6, 0, 6, 0, 6, 0, 6, 0)
    softer = np.where(which(time, q, cycles={6}), 0.85, 1.0)
    force = softer * law(q) + SIGMA * np.random.default_rng(4).normal(size=len(q))
    used = select_cycles(recording(time, q, force), [2, 3, 6])
    assert sorted({branch.cycle for branch in used.branches}) == [2, 3, 6]
    grid = bins(used)
    assert grid.cycles == ((2, 2), (3, 3), (6, 6))
    assert grid.rates == ((pytest.approx(1.0, rel=0.05), pytest.approx(1.0, rel=0.05)),)
    (text,) = sentences(locate([Compared(used, law(used.displacement), NoiseModel(SIGMA))]))
    assert "in cycle 6" in text


def test_a_hold():
    time, q = ramps(0, 6, 6, 0, 6, 6, 0)
    held = which(time, q, "hold")
    (one,) = found(time, q, np.where(held, 0.9 * law(q), law(q))).mismatch
    assert (one.branch, one.sign) == ("hold", "too_stiff")
    assert one.relative == pytest.approx(1 / 0.9 - 1, abs=0.01)


def test_a_rate():
    """Slow and fast cycles alternate, so that no range of cycles describes the place."""
    fast = np.tile([1.0, 1.0, 20.0, 20.0], 3)
    time, q = ramps(*[0, 8] * 6, 0, rates=fast)
    location = found(time, q, np.where(which(time, q, None, (2, 4, 6)), 1.1 * law(q), law(q)))
    (one,) = location.mismatch
    assert one.rate == pytest.approx((20.0, 20.0), rel=0.05)
    assert "at 20 mm/s" in sentences(location)[0]
    assert one.cycle == (1, 6) or one.cycle == (2, 6)


def test_two_places_are_two_sentences():
    time, q = ONE_SIDED
    early = which(time, q, "loading", (1,))
    late = which(time, q, "unloading", (4, 5)) & (q > 5)
    truth = np.where(early, 1.2 * law(q), np.where(late, 0.9 * law(q), law(q)))
    location = found(time, q, truth)
    assert {(m.branch, m.sign) for m in location.mismatch} == {
        ("loading", "too_soft"),
        ("unloading", "too_stiff"),
    }
    assert sum(one.share for one in location.mismatch) > 0.9


def test_disjoint_parts_share_at_most_the_whole_where_the_rest_is_closer_than_the_noise():
    """The rest of the recording has less than the assumed noise: what stands out exceeds the whole by half of it."""
    time, q = ONE_SIDED
    stiff, soft = which(time, q, "unloading", (1, 2)) & (q < 4), which(time, q, "loading", (4, 5)) & (q > 5)
    truth = law(q) - 60.0 * stiff + 60.0 * soft
    location = found(time, q, truth, noise=NoiseModel(4 * SIGMA))
    assert len(location.mismatch) == 2
    assert sum(one.share for one in location.mismatch) == pytest.approx(1.0)
    squares = [one.rms**2 - 1.0 for one in location.mismatch] * np.array(
        [one.samples.sum() for one in location.mismatch]
    )
    assert squares.sum() > 1.2 * location.excess
    shares = [one.share for one in location.mismatch]
    assert shares == pytest.approx(list(squares / squares.sum()))


def test_channels_share_the_excess():
    time, q = BOTH_SIDES
    rng = np.random.default_rng(3)
    right = Compared(recording(time, q, law(q) + rng.normal(size=len(q)) * SIGMA), law(q), NoiseModel(SIGMA))
    wrong = Compared(
        recording(time, q, 2 * law(q) + rng.normal(size=len(q)) * SIGMA, "radial", "radial"),
        2.2 * law(q),
        NoiseModel(SIGMA),
    )
    location = locate([right, wrong])
    assert {one.channel for one in location.mismatch} == {"radial"}
    assert "in the radial channel" in sentences(location)[0]
    wrong_bins = sum(one.excess for one in location.bins if one.channel == "radial")
    assert wrong_bins == pytest.approx(location.excess, rel=0.01)
    assert sum(one.excess for one in location.bins) == pytest.approx(location.excess)
    assert sum(one.share for one in location.mismatch) == pytest.approx(1.0, abs=0.01)


def test_angles_are_told_in_degrees():
    time, q = ONE_SIDED
    angle = np.radians(q)
    force = np.where(q > 4, 1.2, 1.0) * law(q) + SIGMA * np.random.default_rng(4).normal(size=len(q))
    location = locate(
        [Compared(recording(time, angle, force, "torsion", "torsional"), law(q), NoiseModel(SIGMA))]
    )
    assert "above 4 degrees" in sentences(location)[0]
    assert location.mismatch[0].displacement_from == pytest.approx(np.radians(4))


def test_what_the_simulation_has_not_reached_is_left_out():
    time, q = ONE_SIDED
    simulated = np.where(q > 6, np.nan, law(q))
    force = law(q) / 1.2 + SIGMA * np.random.default_rng(5).normal(size=len(q))
    location = locate([Compared(recording(time, q, force), simulated, NoiseModel(SIGMA))])
    assert not location.mismatch[0].samples[q > 6].any()
    assert np.isfinite(location.excess)


def test_every_bin_is_accounted_for():
    time, q = BOTH_SIDES
    location = found(time, q, 0.97 * law(q))
    assert sum(one.samples for one in location.bins) == len(q)
    assert sum(one.excess for one in location.bins) == pytest.approx(location.excess)
    assert any(one.significant for one in location.bins)


def test_bands_have_round_edges_and_cover_all():
    time, q = ramps(0, 7.3, 0)
    grid = bins(recording(time, q, law(q)))
    assert grid.edges.tolist() == [0, 1, 2, 3, 4, 5, 6, 7.3]
    assert grid.total(np.ones(len(q))).sum() == len(q)


# -- noise -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("estimated", [False, True])
def test_noise_gives_no_region(estimated):
    """The family-wise rate over all boxes is 5 %, also when the noise is estimated from the recording."""
    time, q = BOTH_SIDES
    rng = np.random.default_rng(6)
    false = bins_called = 0
    for _ in range(SEEDS):
        measured = recording(time, q, law(q) + SIGMA * rng.normal(size=len(q)))
        noise = noise_model(measured) if estimated else NoiseModel(SIGMA)
        location = locate([Compared(measured, law(q), noise)])
        false += bool(location.mismatch)
        bins_called += any(one.significant for one in location.bins)
    assert false <= MOST_FALSE
    assert bins_called <= MOST_FALSE
    if not estimated:
        # Without any false alarm the test would not be at its stated level.
        assert false >= 1


def test_noise_with_a_memory_gives_no_region():
    """Correlation 0.7 between neighbours; treated as white, this noise would nearly always give a region."""
    time, q = BOTH_SIDES
    e = np.random.default_rng(7).normal(size=(SEEDS, len(q)))
    for i in range(1, len(q)):
        e[:, i] = 0.7 * e[:, i - 1] + np.sqrt(1 - 0.49) * e[:, i]

    def alarms(noise, rows):
        measured = [recording(time, q, law(q) + SIGMA * row) for row in rows]
        return sum(bool(locate([Compared(one, law(q), noise)]).mismatch) for one in measured)

    assert alarms(NoiseModel(SIGMA, 0.7), e) <= MOST_FALSE
    assert alarms(NoiseModel(SIGMA), e[:20]) > 10


def test_a_misfit_below_the_noise_is_found_where_many_samples_share_it():
    """Half a standard deviation on all 120 loading samples: 5.5 standard errors of their mean; no bin of 5 shows it."""
    time, q = BOTH_SIDES
    loading = which(time, q, "loading")
    location = [
        found(time, q, law(q) + np.where(loading, -0.5 * SIGMA * np.sign(q), 0), seed) for seed in range(20)
    ]
    named = [one.mismatch[0].branch for one in location if one.mismatch]
    assert len(named) >= 14
    assert named.count("loading") >= 0.7 * len(named)


def test_noise_model_sees_white_noise_as_white():
    time, q = BOTH_SIDES
    models = [
        noise_model(recording(time, q, law(q) + SIGMA * np.random.default_rng(i).normal(size=len(q))))
        for i in range(50)
    ]
    assert np.mean([m.sigma for m in models]) == pytest.approx(SIGMA, rel=0.05)
    # Ten cycles determine the correlation to some 0.1.
    assert np.median([m.correlation for m in models]) < 0.2


def test_noise_model_sees_a_memory():
    """Correlation 0.7 in 8,000 samples, in which the estimate scatters by 0.06 (0.25 in 400)."""
    rng = np.random.default_rng(8)
    time = np.arange(8000.0)
    q = 8 * np.sin(2 * np.pi * time / 200)
    e = rng.normal(size=8000)
    for i in range(1, 8000):
        e[i] = 0.7 * e[i - 1] + np.sqrt(1 - 0.49) * e[i]
    model = noise_model(recording(time, q, law(q) + SIGMA * e))
    assert model.correlation == pytest.approx(0.7, abs=0.17)
    assert model.sigma == pytest.approx(SIGMA, rel=0.3)


def test_coarse_sampling_without_noise_is_not_taken_for_a_memory():
    q = 8 * np.sin(np.linspace(0, 6 * np.pi, 100))
    found = noise_model(recording(np.arange(100.0), q, law(q)))
    # Fourth differences make noise of the curvature, higher ones do not: there is none.
    assert found.correlation == 0.0
    assert found.sigma == found.least


def test_a_recording_without_noise_is_not_trusted_beyond_what_models_are():
    time, q = ONE_SIDED
    model = noise_model(recording(time, q, 100 * q))
    assert model == NoiseModel(1e-3 * 800, least=1e-3 * 800)
    with pytest.raises(ValueError, match="impossible values"):
        NoiseModel(0.0)


def test_correlation_time():
    """It is (1 + r) / (1 - r) for an autoregression and 1 for white noise."""
    rng = np.random.default_rng(9)
    e = rng.normal(size=20_000)
    assert correlation_time(e) == pytest.approx(1.0, abs=0.1)
    for i in range(1, len(e)):
        e[i] = 0.6 * e[i - 1] + 0.8 * e[i]
    assert correlation_time(e) == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize(
    ("share", "sign", "words"),
    [
        (
            lambda q: np.where(np.abs(q) < 6.0, 0.1, -0.1),
            "both_ways",
            "wrong in both directions, by 14.4 times the noise",
        ),
        (lambda q: np.full(len(q), 0.15), "too_stiff", "18 % too stiff"),
    ],
    ids=["senseless", "stiff"],
)
def test_a_misfit_whose_mean_a_fit_has_made_zero_has_no_sense(share, sign, words):
    """Over a whole recording the factor on the force is what a fit makes zero: it says nothing of what is left."""
    time, q = ramps(0, 8, -8, 8, -8, 0)
    force, wave = law(q), share(q)
    if sign == "both_ways":
        wave = wave - float((wave * force) @ force / (force @ force))
    whole = recording(time, q, force * (1.0 - wave))
    channel, grid = Compared(whole, force, NoiseModel(SIGMA)), bins(whole)
    rates, kinds, _, cycles, bands = grid.shape
    box = Box(tuple(range(rates)), tuple(range(kinds)), (1.0, -1.0), (0, cycles - 1), (0, bands - 1), 9.0)
    one = _mismatch(channel, grid, box, np.ones(len(q), dtype=bool), 1.0, 1e-6)
    assert one.sign == sign
    assert words in sentence(one)


def test_a_misfit_above_the_noise_that_is_in_no_place_is_not_called_noise():
    time, q = ramps(0, 8, -8, 0)
    location = replace(found(time, q, law(q)), mismatch=(), ratio=2.27)
    assert sentences(location) == (
        "the misfit, 2.3 times the noise, stands out in no part of the recordings",
    )
    assert sentences(replace(location, ratio=1.1)) == ("the misfit nowhere exceeds the noise",)
