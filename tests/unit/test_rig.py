"""The changes of the rig against closed forms."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from bushcli.effects.active import ActiveEffect
from bushcli.effects.change import Signal
from bushcli.effects.effect import effect
from bushcli.effects.rig import (
    NoEquilibrium,
    bushing_path,
    elastic_response,
    extension,
    force_reading,
    has_springs,
    parallel,
)

SWEEP = np.linspace(-5.0, 5.0, 2001)


def active(name: str, **values: float) -> ActiveEffect:
    return ActiveEffect(effect(name), values)


def linear(stiffness: float = 300.0):
    return lambda q: (stiffness * q, np.full(len(q), stiffness), np.zeros((len(q), 0)))


def force(
    *acting: ActiveEffect, q: np.ndarray = SWEEP, time: np.ndarray | None = None, response=None
) -> np.ndarray:
    return elastic_response(acting, q, time, response or linear(), ()).value


def test_springs_in_series_add_their_compliances():
    expected = SWEEP / (1 / 300.0 + 2e-3)
    np.testing.assert_allclose(force(active("rig_compliance", compliance=2e-3)), expected, rtol=1e-14)


def test_the_derivative_by_the_compliance_is_that_of_springs_in_series():
    columns = ["rig_compliance.compliance"]
    plain = lambda q: (300.0 * q, np.full(len(q), 300.0), np.zeros((len(q), 1)))  # noqa: E731
    got = elastic_response([active("rig_compliance", compliance=2e-3)], SWEEP, None, plain, columns)
    np.testing.assert_allclose(got.slope[:, 0], -SWEEP / (1 / 300.0 + 2e-3) ** 2, rtol=1e-12)


def test_a_stiff_bushing_behind_a_soft_spring_and_with_a_stop_is_solved():
    # Stiffness from 300 to 1.5e5 N/mm and a knee behind a spring of 20 N/mm: Newton's method alone would oscillate.
    def hard(q):
        return 300.0 * np.sinh(q), 300.0 * np.cosh(q), np.zeros((len(q), 0))

    acting = [active("rig_compliance", compliance=0.05), active("bump_stop", stiffness=1e5, gap=0.3)]
    got = elastic_response(acting, SWEEP, None, hard, ()).value
    q = SWEEP - 0.05 * got
    np.testing.assert_allclose(300.0 * np.sinh(q) + 1e5 * np.maximum(q - 0.3, 0), got, rtol=1e-9, atol=1e-9)


def test_a_bushing_with_a_force_at_rest_shares_it_with_the_spring():
    shifted = lambda q: (300.0 * (q + 0.2), np.full(len(q), 300.0), np.zeros((len(q), 0)))  # noqa: E731
    got = force(active("rig_compliance", compliance=2e-3), response=shifted)
    np.testing.assert_allclose(got, (SWEEP + 0.2) / (1 / 300.0 + 2e-3), rtol=1e-13, atol=1e-10)


def test_a_response_that_is_not_finite_is_no_equilibrium():
    broken = lambda q: (np.full(len(q), np.nan), np.ones(len(q)), np.zeros((len(q), 0)))  # noqa: E731
    with pytest.raises(NoEquilibrium):
        force(active("rig_compliance", compliance=2e-3), response=broken)


def test_a_dead_band_takes_its_half_width_from_the_travel():
    got = force(active("free_play", half_width=0.5))
    expected = np.where(np.abs(SWEEP) <= 0.5, 0.0, 300.0 * (SWEEP - np.sign(SWEEP) * 0.5))
    np.testing.assert_allclose(got, expected, atol=1e-10)


@pytest.mark.parametrize("gap", [2.0, -2.0, 0.0])
def test_a_stop_makes_a_knee_on_its_side(gap):
    got = force(active("bump_stop", stiffness=500.0, gap=gap)) - 300.0 * SWEEP
    over = SWEEP - gap
    expected = 500.0 * (np.maximum(over, 0) if gap >= 0 else np.minimum(over, 0))
    np.testing.assert_allclose(got, expected, atol=1e-9)
    assert np.all(got * SWEEP >= 0)  # a stop pushes back


@pytest.mark.parametrize("gap", [2.0, -2.0])
def test_a_stop_with_an_onset_stiffens_in_proportion_until_it_is_engaged(gap):
    """Its stiffness is an integral: a half of the onset later it is as if it had engaged at once."""
    onset = 0.8
    got = force(active("bump_stop", stiffness=500.0, gap=gap, onset=onset)) - 300.0 * SWEEP
    over = np.maximum(np.sign(gap) * SWEEP - abs(gap), 0.0)
    expected = 500.0 * np.where(over < onset, over**2 / (2 * onset), over - onset / 2)
    np.testing.assert_allclose(got, np.sign(gap) * expected, atol=1e-9)
    knee = force(active("bump_stop", stiffness=500.0, gap=gap))
    abrupt = force(active("bump_stop", stiffness=500.0, gap=gap, onset=1e-9))
    np.testing.assert_allclose(abrupt, knee, atol=1e-6)


def test_derivatives_of_a_gradual_stop_are_those_of_differences():
    at = {"stiffness": 500.0, "gap": -1.5, "onset": 0.8}
    q = Signal(SWEEP, np.zeros((len(SWEEP), len(at))))
    still = Signal(np.zeros(len(SWEEP)), np.zeros((len(SWEEP), len(at))))

    def solved(**change: float) -> Signal:
        rows = zip((at | change).items(), np.eye(len(at)), strict=True)
        given = {name: Signal(np.array(value), row) for (name, value), row in rows}
        return effect("bump_stop").rig.parallel(q, still, None, given)

    found = solved()
    for i, (name, value) in enumerate(at.items()):
        two = (solved(**{name: value + 1e-6}).value - solved(**{name: value - 1e-6}).value) / 2e-6
        np.testing.assert_allclose(found.slope[:, i], two, rtol=1e-5, atol=1e-5 * np.abs(two).max())


def test_a_stop_carried_by_a_spring_is_behind_it():
    acting = [active("bump_stop", stiffness=500.0, gap=1.0), active("rig_compliance", compliance=2e-3)]
    got = force(*acting, q=np.array([4.0]))
    # (q - 4) + 0.002 (300 q + 500 (q - 1)) = 0
    q = 5.0 / 2.6
    np.testing.assert_allclose(got, 300 * q + 500 * (q - 1), rtol=1e-13)


def test_the_batch_scales_the_bushing_but_not_the_stop():
    got = force(
        active("batch_stiffness", log_factor=np.log(0.56)), active("bump_stop", stiffness=500.0, gap=1.0)
    )
    np.testing.assert_allclose(got, 0.56 * 300 * SWEEP + 500 * np.maximum(SWEEP - 1, 0), atol=1e-9)


def test_set_grows_with_the_largest_excursion_and_returns_to_zero_force_there():
    q = np.array([0.0, 2.0, 1.0, 0.2, 4.0, 0.4, 0.0, -1.0, 0.0])
    path = bushing_path([active("permanent_set", set=0.1)], q, ["permanent_set.set"])
    high, low = np.maximum.accumulate(np.maximum(q, 0)), np.minimum.accumulate(np.minimum(q, 0))
    np.testing.assert_allclose(path.value, q - 0.1 * (high + low), atol=1e-15)
    np.testing.assert_allclose(path.slope[:, 0], -(high + low), atol=1e-15)
    assert path.value[3] == pytest.approx(0.0, abs=1e-15)
    assert path.value[5] == pytest.approx(0.0, abs=1e-15)


def test_set_that_grows_lags_behind_in_closed_form_however_the_path_is_sampled():
    """A first loading leaves w / (1 + w) of it behind, w = 2 cycles; each cycle over the range exp(-1 / cycles)."""
    legs = [0.0, 4.0, 0.0, 4.0, 0.0, -2.0, 4.0, 4.0, 0.0]
    names = ["permanent_set.set", "permanent_set.cycles"]

    def path(parts, set_=0.1, cycles=0.4):
        q = np.concatenate([np.linspace(a, b, parts, endpoint=False) for a, b in pairwise(legs)])
        found = bushing_path(
            [active("permanent_set", set=set_, cycles=cycles)], np.append(q, legs[-1]), names
        )
        return found.value[::parts], found.slope[::parts]

    few, slope = path(1)
    lag = 0.4 * 0.8 / 1.8 * np.exp(-np.arange(4) / 0.8)
    np.testing.assert_allclose(few[1:5] - legs[1:5], lag - 0.4, rtol=1e-12)
    np.testing.assert_allclose(path(7)[0], few, atol=1e-12)
    assert few[6] == few[7]  # nothing sets without motion
    for column, name, value in zip(slope.T, ("set_", "cycles"), (0.1, 0.4), strict=True):
        difference = path(1, **{name: value + 1e-6})[0] - path(1, **{name: value - 1e-6})[0]
        np.testing.assert_allclose(difference / 2e-6, column, atol=1e-8)
    at_once, _ = path(1, cycles=0.02)
    np.testing.assert_allclose(at_once[4], -0.4, atol=1e-12)


def test_offsets_shift_the_curve():
    np.testing.assert_allclose(
        force(active("offset", force=7.0, displacement=0.1)), 300 * (SWEEP - 0.1) + 7, atol=1e-10
    )


def test_a_rig_zeroed_under_a_preload_counts_from_there():
    """Through a compliant rig and a stop beside the bushing; the preload is that of the rig's own displacement."""
    acting = [active("bump_stop", stiffness=500.0, gap=1.0), active("rig_compliance", compliance=2e-3)]
    zeroed = active("offset", zeroed=1.0, preload=1.7)
    expected = force(*acting, q=SWEEP + 1.7) - force(*acting, q=np.array([1.7]))
    np.testing.assert_allclose(force(*acting, zeroed), expected, atol=1e-9)
    np.testing.assert_allclose(force(*acting, zeroed, active("gain", error=0.1)), 1.1 * expected, atol=1e-9)


def test_an_offset_is_taken_off_before_the_dead_band():
    got = force(active("free_play", half_width=0.5), active("offset", force=0.0, displacement=0.5))
    assert np.all(got[(SWEEP >= 0.0) & (SWEEP <= 1.0)] == 0.0)


def test_a_lag_delays_a_sine():
    time = np.linspace(0.0, 10.0, 2001)
    got = force(active("time_lag", lag=0.1234), q=np.sin(time), time=time)
    later = time > 0.13
    # Parabolic slopes: the error of the cubic is of third order, h^3/(9 sqrt 3) 0.005^3 300 = 2.4e-6.
    np.testing.assert_allclose(got[later], 300 * np.sin(time - 0.1234)[later], atol=3e-6)
    assert np.all(got[time < 0.1234] == 0.0)  # nothing moved before the start


def test_the_false_loop_of_a_lag_goes_with_the_rate():
    # Area of the ellipse q = a sin wt, F = k a sin w(t - lag): -pi k a^2 sin(w lag).
    for period in (4.0, 8.0):
        time = np.linspace(0.0, 2 * period, 4001)
        w = 2 * np.pi / period
        q = 3.0 * np.sin(w * time)
        got = force(active("time_lag", lag=0.2), q=q, time=time)
        last = time >= period
        # Negative: a force that comes late seems to give energy; one that comes early (lag < 0), to lose it.
        area = np.trapezoid(got[last], q[last])
        assert area == pytest.approx(-np.pi * 300 * 9 * np.sin(w * 0.2), rel=1e-4)


def test_a_force_is_read_between_its_times_and_corners_are_kept():
    time = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    tent = Signal(np.array([0.0, 1.0, 2.0, 1.0, 0.0]), np.zeros((5, 0)))
    at = np.linspace(0.0, 4.0, 41)
    got = force_reading([], time, tent, (), at=at, corners=[2])
    np.testing.assert_allclose(got.value, 2 - np.abs(at - 2), atol=1e-14)
    # Without the corner the cubic rounds it off, by a quarter of a step at most.
    rounded = force_reading([], time, tent, (), at=at).value
    assert 0.01 < np.abs(rounded - got.value).max() < 0.25


def test_at_a_corner_the_derivative_by_the_lag_is_the_mean_of_both_sides():
    time = np.array([0.0, 1.0, 2.0, 3.0])
    bent = Signal(np.array([0.0, 2.0, 4.0, 3.0]), np.zeros((4, 1)))
    got = force_reading([active("time_lag", lag=0.0)], time, bent, ["time_lag.lag"], corners=[2])
    np.testing.assert_allclose(got.slope[:, 0], [-1.0, -2.0, -0.5, 0.5], atol=1e-14)
    np.testing.assert_array_equal(got.value, bent.value)


def test_a_lag_without_time_is_refused():
    with pytest.raises(ValueError, match="without time"):
        force(active("time_lag", lag=0.1))


def test_a_value_that_is_not_given_is_refused():
    with pytest.raises(ValueError, match=r"bump_stop\.gap"):
        force(active("bump_stop", stiffness=1.0))


def test_the_pieces_for_a_march_make_the_same_force():
    """The path and compliance that a march with memory is given, driven here by a spring without memory."""
    acting = [
        active("free_play", half_width=0.2),
        active("rig_compliance", compliance=1e-3),
        active("bump_stop", stiffness=400.0, gap=1.5),
        active("offset", force=5.0, displacement=0.1),
    ]
    columns = ["rig_compliance.compliance", "offset.force"]
    path = bushing_path(acting, SWEEP, columns)
    got = force(*acting)
    zero = np.zeros((len(SWEEP), 2))
    springs = extension(acting, Signal(got - 5.0, zero), columns)
    q = path.value - springs.value
    carried = parallel(acting, Signal(q, zero), Signal(300.0 * q, zero), columns)
    np.testing.assert_allclose(force_reading(acting, None, carried, columns).value, got, atol=1e-9)
    np.testing.assert_allclose(springs.slope, np.column_stack([got - 5.0, np.zeros(len(q))]), atol=1e-12)


def test_a_spring_counts_where_it_gives_way_or_its_derivative_is_wanted():
    off = [active("rig_compliance", compliance=0.0)]
    assert not has_springs(off, ["C10"])
    assert has_springs(off, ["rig_compliance.compliance"])
    assert has_springs([active("rig_compliance", compliance=1e-3)], ())


@pytest.mark.parametrize("curvature", [2e-3, -2e-3, 0.0])
def test_a_rig_grows_softer_or_stiffer_under_load(curvature):
    """Against the extension that the recorded force has by the formula."""
    got = force(active("rig_compliance", compliance=2e-3, curvature=curvature))
    x = curvature * np.abs(got)
    taken = 2e-3 * got * (1 + x if curvature >= 0 else 1 / (1 - x))
    np.testing.assert_allclose(got / 300.0 + taken, SWEEP, atol=1e-11)
    # Its stiffness in series at the ends, over that at the centre.
    stiffness = np.gradient(got, SWEEP)
    ratio = stiffness[-2] / stiffness[len(SWEEP) // 2]
    assert np.sign(round(ratio - 1.0, 3)) == -np.sign(curvature)


@pytest.mark.parametrize("curvature", [2e-3, -2e-3])
def test_derivatives_of_a_curved_spring_are_those_of_differences(curvature):
    columns = ["rig_compliance.compliance", "rig_compliance.curvature", "k"]
    at = {"compliance": 2e-3, "curvature": curvature}

    def solved(k: float = 300.0, **change: float) -> Signal:
        slope = lambda q: np.column_stack([0 * q, 0 * q, np.sinh(q / 3)])  # noqa: E731
        hard = lambda q: (k * np.sinh(q / 3), k / 3 * np.cosh(q / 3), slope(q))  # noqa: E731
        return elastic_response([active("rig_compliance", **(at | change))], SWEEP, None, hard, columns)

    found = solved()
    for i, (name, step) in enumerate([("compliance", 1e-7), ("curvature", 1e-7), ("k", 1e-3)]):
        value = at.get(name, 300.0)
        two = (solved(**{name: value + step}).value - solved(**{name: value - step}).value) / (2 * step)
        np.testing.assert_allclose(found.slope[:, i], two, rtol=1e-6, atol=1e-6 * np.abs(two).max())


# -- effects that depend on time ---------------------------------------------------------------------------------------


def test_a_drift_and_a_wrong_scale_are_of_the_reading_alone():
    time = np.linspace(100.0, 140.0, 81)
    q = np.sin(time)
    acting = [
        active("gain", error=0.05),
        active("drift", rate=0.3),
        active("offset", force=7.0, displacement=0.0),
    ]
    found = elastic_response(acting, q, time, linear(), ())
    # The recording begins at 100 s.
    np.testing.assert_allclose(found.value, 1.05 * 300.0 * q + 7.0 + 0.3 * (time - 100.0), rtol=1e-12)


@pytest.mark.parametrize("settling", [1e-7, 0.1])
def test_a_drift_may_come_to_rest(settling):
    """Against the integral of its rate, on both sides of the switch from the series to the formula."""
    time = np.linspace(3.0, 43.0, 401)
    acting = [active("drift", rate=0.3, settling=settling)]
    columns = ["drift.rate", "drift.settling"]
    plain = lambda q: (300.0 * q, np.full(len(q), 300.0), np.zeros((len(q), 2)))  # noqa: E731
    found = elastic_response(acting, np.sin(time), time, plain, columns)
    t = time - 3.0
    # Gauss quadrature of exp(-settling s) and of -s exp(-settling s) from 0 to t.
    nodes, weights = np.polynomial.legendre.leggauss(20)
    s = 0.5 * t[:, None] * (nodes + 1.0)
    fading = np.exp(-settling * s)
    elapsed, slope = 0.5 * t * (fading @ weights), 0.5 * t * ((-s * fading) @ weights)
    np.testing.assert_allclose(found.value - 300.0 * np.sin(time), 0.3 * elapsed, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.slope, np.column_stack([elapsed, 0.3 * slope]), rtol=1e-11, atol=1e-11)


def test_warm_rubber_is_softer_but_its_stop_is_not():
    time = np.linspace(5.0, 25.0, 41)
    q = 2.0 * np.sin(time)
    warming = active("warming", amount=0.2, tau=4.0)
    left = 1.0 - 0.2 * (1.0 - np.exp(-(time - 5.0) / 4.0))
    found = elastic_response([active("bump_stop", stiffness=500.0, gap=1.0), warming], q, time, linear(), ())
    np.testing.assert_allclose(found.value, left * 300.0 * q + 500.0 * np.maximum(q - 1.0, 0.0), rtol=1e-12)
    # Behind a spring: q (1 + c k left) = q_rig.
    found = elastic_response([warming, active("rig_compliance", compliance=1e-3)], q, time, linear(), ())
    np.testing.assert_allclose(found.value, left * 300.0 * q / (1.0 + 0.3 * left), rtol=1e-10)


def test_a_factor_on_all_channels_is_the_laws():
    gain, batch, stop = (effect(name) for name in ("gain", "batch_stiffness", "bump_stop"))
    two = ["axial", "radial"]
    assert gain.differs_from_law(["axial"], two, law_held=False)
    assert not gain.differs_from_law(two, two, law_held=False)
    assert gain.differs_from_law(["axial"], ["axial"], law_held=True)
    assert not batch.differs_from_law(["axial"], two, law_held=False)
    assert stop.differs_from_law(["axial"], ["axial"], law_held=False)


@pytest.mark.parametrize(
    ("name", "values", "said"),
    [
        ("viscoelasticity", {"g1": 0.2, "tau1": 3.0}, ""),
        ("viscoelasticity", {"g1": 0.2, "tau1": 3.0, "g2": 0.1, "tau2": 30.0}, "2 branches"),
        ("debonding", {"length": 3.0, "bond": 2.0}, "outer top"),
        ("sleeve_compliance", {"compliance": 1e-4, "thickness": 4.0}, "thickness 4 mm"),
    ],
)
def test_an_effect_says_which_variant_it_is(name, values, said):
    assert ActiveEffect(effect(name), values).variant == said
