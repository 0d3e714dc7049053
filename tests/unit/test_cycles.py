"""Energy, stiffness and relaxation of curves with closed-form answers, and of recordings with a known truth."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from bushcli.curve.curve import Curve
from bushcli.curve.cycles import Noise, cycles, cycles_along, noise_of
from bushcli.curve.holds import holds, holds_along
from bushcli.curve.segment import segment
from bushcli.recording import Recording, read_recording, select_cycles
from bushcli.recording.source import Source


def sine(samples, turns=2, amplitude=4.0, stiffness=100.0, loss=30.0, mode="axial"):
    """A linear element with viscous loss: an ellipse of half axes `amplitude` and `loss`."""
    phase = np.linspace(0.0, 2 * np.pi * turns, samples)
    q = amplitude * np.sin(phase)
    return Curve(mode, q, stiffness * q + loss * np.cos(phase), phase)


def ramps(*corners, rate=0.1, step=0.05):
    """Displacement through corners at a constant rate: time, displacement; every corner is a sample."""
    pieces = [np.array([corners[0]], dtype=float)]
    for a, b in pairwise(corners):
        pieces.append(np.linspace(a, b, round(abs(b - a) / step) + 1)[1:])
    q = np.concatenate(pieces)
    return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q)) / rate)]), q


# -- loops -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("samples", [81, 83, 87, 91, 4001])
def test_an_ellipse_takes_pi_a_b_a_turn(samples):
    """Whether or not there are samples at zero and at the turning points."""
    found = cycles(sine(samples))
    assert [cycle.number for cycle in found] == [1, 2]
    assert all(cycle.closed for cycle in found)
    # The trapezoidal rule gives the polygon inscribed in the ellipse, with sin(x) / x of its area at 2 pi / x points a
    # turn.
    x = 2 * np.pi / ((samples - 1) / 2)
    polygon = np.pi * 4.0 * 30.0 * np.sin(x) / x
    assert [cycle.energy.value for cycle in found] == pytest.approx([polygon, polygon])


def test_the_other_way_round_energy_is_negative():
    assert sum(c.energy.value for c in cycles(sine(4001, loss=-30.0))) == pytest.approx(
        -2 * np.pi * 120.0, rel=1e-3
    )


def test_secant_rate_and_peak_of_an_ellipse():
    (found,) = cycles(sine(4001, turns=1))
    assert (found.lowest, found.highest) == pytest.approx((-4.0, 4.0), abs=0.01)
    # Near the peaks the ellipse's force is the spring's.
    assert found.secant.value == pytest.approx(100.0, rel=0.005)
    # 4 mm there and back in half a period of 2 pi s.
    assert found.rate == pytest.approx(8.0 / np.pi, rel=0.01)
    assert abs(found.peak_force.value) == pytest.approx(np.hypot(400.0, 30.0), rel=1e-3)


def test_loss_is_the_share_of_the_work_done_while_loading():
    """Loading at 110 N/mm q, unloading at 90 N/mm q over 4 mm: (880 - 720) / 880."""
    _, q = ramps(0.0, 4.0, 0.0)
    up = np.arange(len(q)) <= np.argmax(q)
    (found,) = cycles(Curve("axial", q, np.where(up, 110.0, 90.0) * q))
    # The jump by 80 N at the tip is spread over a step of 0.05 mm: 2 N mm less.
    assert found.loss.value == pytest.approx((160.0 - 2.0) / 880.0)
    assert found.rate is None


def test_cycles_of_growing_amplitude_each_have_their_own():
    """Friction of 5 N on a spring: an excursion to a dissipates the parallelogram 2 x 5 a."""
    time, q = ramps(0.0, 1.0, 0.0, 2.0, 0.0, 4.0, 0.0)
    friction = 5.0 * np.sign(np.diff(q, prepend=-0.05))
    found = cycles(Curve("axial", q, 50.0 * q + friction, time))
    assert [cycle.highest for cycle in found] == pytest.approx([1.0, 2.0, 4.0])
    # Jumps by 10 N, at the tip and at the start of all cycles but the first, are spread over a step of 0.05 mm:
    # 0.25 N mm less each.
    assert [cycle.energy.value for cycle in found] == pytest.approx([10.0 - 0.25, 20.0 - 0.5, 40.0 - 0.5])
    assert [cycle.rate for cycle in found] == pytest.approx([0.1, 0.1, 0.1])


def test_a_cycle_after_others_that_are_left_out_sets_out_from_its_own_first_sample():
    # At 0.1 mm/s throughout; between the second cycle and the sixth the file has 160 s that are not used.
    time, q = ramps(0, 4, 0, 4, 0)
    late = np.where(np.arange(len(q)) > len(q) // 2, time + 160.0, time)
    path = Curve("axial", q, 100.0 * q, late)
    found = [replace(b, cycle={1: 2, 2: 6}[b.cycle]) for b in segment(q, late)]
    assert [b.kind for b in found] == ["loading", "unloading"] * 2
    first, second = cycles_along(path, path.force, segments=found)
    assert (first.number, second.number) == (2, 6)
    assert first.rate == pytest.approx(0.1)
    assert second.rate == pytest.approx(0.1)


def test_an_open_cycle_says_so_and_has_the_net_work():
    """A spring that is loaded to 4 mm and returns to 3 mm still stores 100 * 9 / 2 N mm."""
    _, q = ramps(0.0, 4.0, 3.0)
    (found,) = cycles(Curve("axial", q, 100.0 * q))
    assert not found.closed
    # The work is stored, not lost.
    assert found.loss.value == pytest.approx(0.0, abs=1e-9)
    assert found.energy.value == pytest.approx(450.0)


def test_a_motion_in_one_direction_has_no_loss():
    _, q = ramps(0.0, 4.0, 0.0, 4.0)
    closed, one_way = cycles(Curve("axial", q, 100.0 * q))
    assert closed.loss.value == pytest.approx(0.0, abs=1e-9)
    assert np.isnan(one_way.loss.value)


def test_cycles_about_a_preload_close_where_they_began():
    time, q = ramps(0.0, 4.0, 2.0, 4.0, 2.0)
    first, second = cycles(Curve("axial", q, 100.0 * q, time))
    assert not first.closed
    assert second.closed
    assert (second.lowest, second.highest) == (2.0, 4.0)
    assert second.energy.value == pytest.approx(0.0, abs=1e-9)


def test_what_relaxes_in_a_hold_is_no_secant_stiffness():
    """A spring of 100 N/mm whose force falls to half while it is held at 4 mm."""
    rise = np.linspace(0.0, 4.0, 21)
    q = np.concatenate([rise, np.full(40, 4.0), rise[-2::-1]])
    force = 100.0 * q * np.concatenate([np.ones(21), np.linspace(1.0, 0.5, 40), np.full(20, 0.5)])
    (found,) = cycles(Curve("axial", q, force, np.arange(len(q), dtype=float)))
    assert found.secant.value == pytest.approx(100.0)
    # 800 N mm up, 400 back: a hold does no work.
    assert found.energy.value == pytest.approx(400.0)


def test_where_the_force_is_unknown_there_is_no_cycle():
    curve = sine(401)
    force = np.where(np.arange(401) < 250, curve.force, np.nan)
    assert [found is None for found in cycles_along(curve, force)] == [False, True]


# -- noise -----------------------------------------------------------------------------------------------------------


def noisy(seed, curve, force=4.0, displacement=0.003):
    random = np.random.default_rng(seed)
    q = curve.displacement + displacement * random.standard_normal(len(curve.displacement))
    return Curve(curve.mode, q, curve.force + force * random.standard_normal(len(q)), curve.time)


def test_standard_errors_are_the_scatter_of_repeated_recordings():
    """200 recordings: the scatter is known to 5 %, four standard errors of it are allowed."""
    curve = Curve("axial", *_spring())
    noise = Noise(4.0, 0.003)
    drawn = [cycles(noisy(seed, curve), noise) for seed in range(200)]
    for name in ("energy", "secant", "loss"):
        for k in range(2):
            values = [getattr(found[k], name) for found in drawn]
            scatter, said = np.std([v.value for v in values], ddof=1), np.mean([v.std for v in values])
            assert said == pytest.approx(scatter, rel=0.2), (name, k)


def _spring():
    time, q = ramps(0.0, 2.0, 0.0, 4.0, 0.0, -3.0, 0.0, step=0.2)
    return q, 200.0 * q + 2.0 * q**3, time


def test_a_linear_spring_takes_nothing_beyond_its_noise():
    off = []
    for seed in range(30):
        measured = noisy(seed, Curve("axial", *_spring()))
        off += [found.energy.value / found.energy.std for found in cycles(measured, noise_of(measured))]
    # 60 values of a standard normal: none beyond 4 (1 in 16,000), and their rms 1 within four of its errors.
    assert np.abs(off).max() < 4.0
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=4 / np.sqrt(2 * 60))


# -- holds -----------------------------------------------------------------------------------------------------------


def maxwell(tau=8.0, share=0.4, seconds=400.0, samples=4000, sigma=0.0):
    """A step to 4 mm and a hold: Q = 800 (1 - share + share exp(-t / tau)) N, samples closer at first."""
    held = np.geomspace(1.0, 1.0 + seconds, samples) - 1.0
    time = np.concatenate([[0.0, 0.001, 0.002, 0.003, 0.004], 0.005 + held])
    q = np.concatenate([np.linspace(0.0, 3.2, 5), np.full(samples, 4.0)])
    force = np.concatenate([200.0 * q[:5], 800.0 * (1 - share + share * np.exp(-held / tau))])
    return Curve("axial", q, force + sigma * np.random.default_rng(1).standard_normal(len(q)), time)


def test_a_maxwell_element_relaxes_as_on_paper():
    (found,) = holds(maxwell())
    assert (found.displacement, found.cycle) == (pytest.approx(4.0), 1)
    assert found.duration == pytest.approx(400.0)
    assert found.force_start.value == pytest.approx(800.0)
    assert found.force_end.value == pytest.approx(480.0, abs=0.1)
    assert list(found.after) == [1.0, 10.0, 100.0]
    for at, relaxation in found.after.items():
        # 0.2 % of the amplitude, as the module says.
        assert relaxation.value == pytest.approx(0.4 * (1 - np.exp(-at / 8.0)), abs=0.002 * 0.4)
    assert found.relaxation.value == pytest.approx(0.4, abs=0.001)


def test_few_samples_are_interpolated():
    (found,) = holds(maxwell(samples=40))
    assert found.after[10.0].value == pytest.approx(0.4 * (1 - np.exp(-10.0 / 8.0)), abs=0.01)


def test_noise_of_a_relaxation_is_that_of_its_forces():
    noise = Noise(4.0)
    drawn = []
    for seed in range(200):
        curve = maxwell(samples=60)
        force = curve.force + 4.0 * np.random.default_rng(seed).standard_normal(len(curve.force))
        drawn += [found for found in holds_along(curve, force, noise) if found is not None]
    assert len(drawn) == 200
    for pick in (lambda h: h.relaxation, lambda h: h.after[10.0], lambda h: h.force_end):
        values = [pick(found) for found in drawn]
        scatter = np.std([v.value for v in values], ddof=1)
        assert np.mean([v.std for v in values]) == pytest.approx(scatter, rel=0.2)


def test_without_force_there_is_nothing_to_relax():
    curve = maxwell(samples=60)
    (found,) = holds_along(curve, 0.01 * curve.force, Noise(4.0))
    assert np.isnan(found.relaxation.value)


def test_without_time_a_hold_has_no_duration():
    curve = maxwell(samples=60)
    (found,) = holds(Curve("axial", curve.displacement, curve.force))
    assert found.duration is None
    assert found.after == {}
    assert found.force_end.value < found.force_start.value


# -- computed recordings with a known effect --------------------------------------------------------------------------


DATA = Path(__file__).parent / "data"
FILES = {
    # The example's bushing is elastic: another batch of rubber.
    "elastic": Path(__file__).parents[2] / "examples" / "batch" / "axial.csv",
    "mullins": DATA / "mullins.csv",
    "viscoelastic": DATA / "viscoelastic.csv",
    "both": DATA / "mullins-viscoelastic.csv",
}


@pytest.fixture(scope="module")
def practice():
    return {name: read_recording(Source("axial", file)) for name, file in FILES.items()}


def sure(found):
    return found.value > 5 * found.std


def test_an_elastic_recording_has_no_loops(practice):
    found = cycles(practice["elastic"], noise_of(practice["elastic"]))
    assert len(found) == 8
    assert not any(sure(cycle.energy) for cycle in found)
    held, _ = holds(practice["elastic"], noise_of(practice["elastic"]))
    assert not sure(held.relaxation)


def test_mullins_takes_energy_only_where_the_amplitude_is_new(practice):
    """0-2 mm three times, 0-4 mm three times, once from 6 to -5 mm, and 4 mm."""
    found = cycles(practice["mullins"], noise_of(practice["mullins"]))
    assert [cycle.number for cycle in found if sure(cycle.energy)] == [1, 4, 7]
    # The eighth cycle goes to 4 mm after the seventh has softened the rubber to 6 mm; the sixth, to 4 mm, came before
    # that.
    assert found[7].secant.value < 0.75 * found[5].secant.value
    held, _ = holds(practice["mullins"], noise_of(practice["mullins"]))
    assert not sure(held.relaxation)


@pytest.mark.parametrize("name", ["viscoelastic", "both"])
def test_viscoelasticity_takes_energy_in_every_cycle_and_relaxes(practice, name):
    found = cycles(practice[name], noise_of(practice[name]))
    assert all(cycle.closed and sure(cycle.energy) for cycle in found)
    held, released = holds(practice[name], noise_of(practice[name]))
    assert (held.displacement, released.displacement) == pytest.approx((4.0, 0.0), abs=0.01)
    assert sure(held.relaxation)
    assert 0 < held.after[1.0].value < held.after[10.0].value < held.relaxation.value
    # After unloading the bushing pushes back, and that relaxes too.
    assert released.force_start.value < 0


def test_without_noise_there_are_no_errors():
    for cycle in cycles(sine(401)):
        assert {cycle.energy.std, cycle.loss.std, cycle.secant.std, cycle.peak_force.std} == {0.0}


def test_the_work_of_a_cycle_does_not_depend_on_which_others_are_selected():
    time = np.linspace(0.0, 24.0, 121)
    q = np.interp(time, [0, 2, 4, 6, 8, 11, 14, 19, 24], [0, 2, 0, 2, 0, 3, 0, -3, 0])
    force = 100.0 * q + 20.0 * np.sign(np.gradient(q, time))
    whole = Recording("axial", q, force, time, name="axial")
    (own,), expected = cycles(select_cycles(whole, [3])), cycles(whole)[2]
    for quantity in ("energy", "loss", "secant"):
        one, other = getattr(own, quantity), getattr(expected, quantity)
        assert one.value == pytest.approx(other.value, rel=1e-12)
