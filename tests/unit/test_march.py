"""The march: paths that it follows, how it cuts and grows steps, where it stops, and what it then reports."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from cases.equilibrium import MAX_BROYDEN
from cases.history import Interrupted
from cases.limit import LIMITED_NEWTON, MAX_NEWTON, SOON, limit
from cases.march import NotConverged, march
from cases.mode import modes
from cases.program import Program, path, ramp
from cases.simulate import prepare, sweep
from cases.stretches import principal_stretches
from geometry.shape import Refinement, shapes

COARSE = Refinement(across=2, along=6, around=8)
SHARP = 1e-11


@pytest.fixture(scope="module")
def axial(reference_bushing, rubber):
    return prepare(reference_bushing, modes()["axial"], rubber("yeoh"), COARSE)


@pytest.fixture(scope="module")
def radial(reference_bushing, rubber):
    return prepare(reference_bushing, modes()["radial"], rubber("yeoh"), COARSE)


@pytest.fixture(scope="module")
def locking(reference_bushing, rubber):
    """Return Gent's law with chains that lock at a shear of one."""
    return prepare(reference_bushing, modes()["torsional"], rubber("gent", mu=1.0, Jm=1.0), COARSE)


def accepted(history):
    return [attempt for attempt in history.attempts if attempt.accepted]


def test_equal_displacements_have_equal_forces_on_a_path_with_cycles_and_holds(axial):
    q = np.array([1.0, 3.0, 3.0, 3.0, 0.0, -3.0, -1.0, -1.0, 0.0, 2.0, 3.0, 1.0, 0.0])
    time = np.arange(len(q), dtype=float)
    history = march(axial, Program(q, time), tolerance=SHARP)
    np.testing.assert_array_equal(history.displacement, q)
    np.testing.assert_array_equal(history.time, time)
    scale = np.abs(history.force).max()
    for value in np.unique(np.abs(q)):
        same = history.force[np.abs(q) == value] * np.sign(q[np.abs(q) == value])
        np.testing.assert_allclose(same, same[0], atol=1e-8 * scale)
    assert history.energy[q == 0.0] == pytest.approx(0.0, abs=1e-8 * history.energy.max())


def test_first_target_at_rest_gives_no_force(axial):
    history = march(axial, ramp(1.0, 2))
    assert history.force[0] == pytest.approx(0.0, abs=1e-8)
    assert history.time is None
    assert history.states is None


def test_accepted_attempts_lead_without_gap_through_all_targets(radial):
    program = path([0.0, 2.0, -1.0], 3)
    history = march(radial, program)
    steps = accepted(history)
    assert steps[0].start == 0.0
    assert all(a.stop == b.start for a, b in pairwise(steps))
    np.testing.assert_array_equal(history.displacement, program.displacement)
    assert set(program.displacement) <= {attempt.stop for attempt in steps}
    assert history.newton.sum() == sum(attempt.newton for attempt in history.attempts)
    assert all(attempt.seconds >= 0 for attempt in history.attempts)


def test_a_step_too_far_is_cut_back_and_arrives_all_the_same(radial):
    """A radial displacement by 40 % of the rubber's thickness at once, against the same in 16 steps."""
    at_once = march(radial, Program(np.array([4.0])), tolerance=SHARP)
    failed = [attempt for attempt in at_once.attempts if not attempt.accepted]
    assert failed
    assert all(attempt.reason.startswith("DIVERGED") for attempt in failed)
    for attempt, following in pairwise(at_once.attempts):
        if not attempt.accepted:
            # From the same state, half as far.
            assert following.start == attempt.start
            assert following.stop - following.start == pytest.approx(0.5 * (attempt.stop - attempt.start))
    by_steps = march(radial, ramp(4.0, 16), tolerance=SHARP)
    assert at_once.force[-1] == pytest.approx(by_steps.force[-1], rel=1e-7)


def test_steps_grow_again_once_they_are_easy(locking):
    """Near locking the step is cut; unloading is easy, and the cut must not slow it down."""
    history = march(locking, Program(np.array([0.59, 0.0])))
    sizes = np.array([abs(attempt.stop - attempt.start) for attempt in accepted(history)])
    assert not all(attempt.accepted for attempt in history.attempts)
    assert sizes.min() < 0.2
    assert np.any(sizes[1:] > 1.9 * sizes[:-1])
    assert history.force[-1] == pytest.approx(0.0, abs=1e-5 * history.force[0])


def test_no_state_beyond_the_locking_is_ever_returned(locking):
    """In fully locked rubber the shear is sqrt(Jm) at every radius: the twist cannot exceed sqrt(Jm) ln(b/a)."""
    limit = np.log(22.0 / 12.0)
    targets = np.array([0.3, 0.5, 0.55, 1.0, 1.2])
    with pytest.raises(NotConverged) as caught:
        march(locking, Program(targets, np.arange(5.0)), keep_states=True)
    stopped = caught.value
    assert (stopped.target, stopped.reason[:8]) == (1.0, "DIVERGED")
    assert 0.97 * limit < stopped.last < limit
    history = stopped.history
    # The targets reached, and the last equilibrium on the way to the next target, with its time.
    np.testing.assert_array_equal(history.displacement, [*targets[:3], stopped.last])
    assert len(history.time) == len(history.states) == len(history.newton) == 4
    assert history.time[-1] == pytest.approx(2.0 + (stopped.last - 0.55) / 0.45)
    assert np.all(np.isfinite(history.energy))
    assert np.all(np.diff(history.force) > 0)
    assert max(attempt.stop for attempt in accepted(history)) == stopped.last
    for part in (f"{stopped.last:.6g}", "1", stopped.reason):
        assert part in str(stopped)
    corners = np.array([[x, y] for x in (0.11, 0.5, 0.89) for y in (0.11, 0.5, 0.89)])
    for state in history.states:
        locking.state.x.array[:] = state
        isochoric = principal_stretches(locking, corners)
        isochoric = isochoric / np.prod(isochoric, axis=-1, keepdims=True) ** (1 / 3)
        assert np.max(np.sum(isochoric**2, axis=-1)) - 3 < 1.0


def test_a_state_is_returned_for_every_target(axial):
    history = march(axial, ramp(3.0, 3), keep_states=True)
    assert history.states.shape == (4, len(axial.state.x.array))
    np.testing.assert_array_equal(history.states[0], 0.0)
    for state, energy in zip(history.states, history.energy, strict=True):
        axial.state.x.array[:] = state
        assert axial.energy() == pytest.approx(energy, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10])
def test_what_is_left_out_of_balance_is_within_the_tolerance(axial, tolerance):
    history = march(axial, ramp(4.0, 4), tolerance=tolerance, keep_states=True)
    residual = axial.system.create_vector()
    for state in history.states[1:]:
        axial.state.x.array[:] = state
        axial.system.residual(residual)
        reactions = axial.system.clear_constrained(residual)
        assert residual.norm() <= 1.001 * tolerance * reactions
    residual.destroy()
    exact = march(axial, ramp(4.0, 4), tolerance=1e-12)
    # The error of the force is quadratic in the residual, at worst proportional to it.
    np.testing.assert_allclose(history.force, exact.force, rtol=10 * tolerance, atol=1e-9)


def test_progress_is_told_after_every_target(axial):
    told = []
    program = path([0.0, 1.0, -1.0], 2)
    history = march(axial, program, progress=lambda *news: told.append(news))
    steps, total, newton, q = (np.array(column) for column in zip(*told, strict=True))
    np.testing.assert_array_equal(steps, np.arange(len(program.displacement)) + 1)
    assert set(total) == {len(program.displacement)}
    np.testing.assert_array_equal(newton, history.newton)
    np.testing.assert_array_equal(q, program.displacement)


def test_a_model_can_be_marched_again_with_other_parameters(axial, rubber, reference_bushing):
    before = march(axial, ramp(2.0, 2)).force
    axial.set_parameters({"C10": 1.0, "C20": -0.1, "C30": 0.02}, 4000.0)
    # All moduli twice as large: all forces too.
    np.testing.assert_allclose(march(axial, ramp(2.0, 2)).force, 2 * before, rtol=1e-6, atol=1e-8)
    axial.set_parameters(rubber("yeoh").parameters, 2000.0)
    np.testing.assert_allclose(march(axial, ramp(2.0, 2)).force, before, rtol=1e-9, atol=1e-8)


def test_size_does_not_matter(rubber):
    """A bushing ten times as large under a rubber a thousand times as stiff: the same stretches, 1e5 the force."""
    small = shapes()["plain"](inner_radius=12.0, outer_radius=22.0, length=40.0)
    large = shapes()["plain"](inner_radius=120.0, outer_radius=220.0, length=400.0)
    soft = march(prepare(small, modes()["axial"], rubber("neo_hookean", C10=0.5), COARSE), ramp(3.0, 2))
    stiff = rubber("neo_hookean", 2e6, C10=500.0)
    hard = march(prepare(large, modes()["axial"], stiff, COARSE), ramp(30.0, 2))
    np.testing.assert_allclose(hard.force, 1e5 * soft.force, rtol=1e-7, atol=1e-3)


@pytest.mark.parametrize("what", ["residual", "tangent"])
def test_an_interruption_comes_out_as_one_wherever_the_solver_is(axial, what, monkeypatch):
    """Some of these calls come from SNES, which would turn the interruption into an error of its own."""
    genuine, calls, last = getattr(axial.system, what), 0, 0

    def interrupted(*arguments):
        nonlocal calls
        calls += 1
        if calls == last:
            raise KeyboardInterrupt
        return genuine(*arguments)

    monkeypatch.setattr(axial.system, what, interrupted)
    march(axial, ramp(3.0, 3))
    whole = calls
    assert whole > 0
    for last in range(1, whole + 1):  # noqa: B007  (interrupted reads it)
        calls = 0
        with pytest.raises(KeyboardInterrupt):
            march(axial, ramp(3.0, 3))


def test_an_interrupted_march_carries_the_targets_reached(axial):
    def stop(step, *_):
        if step == 3:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as raised:
        march(axial, ramp(4.0, 8), progress=stop, keep_states=True)
    whole = march(axial, ramp(4.0, 8))
    found = raised.value.history
    np.testing.assert_array_equal(found.displacement, whole.displacement[:3])
    np.testing.assert_allclose(found.force, whole.force[:3], rtol=1e-6)
    assert found.states is not None
    assert len(found.states) == 3
    assert raised.value.target == pytest.approx(whole.displacement[2])


def test_a_march_interrupted_before_its_second_target_is_an_interruption_only(axial):
    def stop(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as raised:
        march(axial, ramp(4.0, 8), progress=stop)
    assert not isinstance(raised.value, Interrupted)


def test_an_interrupted_sweep_has_both_sides_as_far_as_they_went(axial):
    def stop(step, *_):
        if step == 7:
            raise KeyboardInterrupt

    targets = np.linspace(-2.0, 2.0, 9)
    with pytest.raises(Interrupted) as raised:
        sweep(axial, targets, progress=stop)
    found = raised.value.history.displacement
    assert (found[0], found[-1]) == pytest.approx((-2.0, 0.5))


def test_a_march_with_little_patience_has_little_with_newton_too(locking):
    for failure_limit, least, most in ((None, MAX_NEWTON, MAX_NEWTON), (3, SOON, LIMITED_NEWTON)):
        with pytest.raises(NotConverged) as stopped:
            march(locking, ramp(3.0, 3), failure_limit=failure_limit)
        tried = [one for one in stopped.value.history.attempts if one.reason == "DIVERGED_MAX_IT"]
        # Broyden's iterations count too; Newton's method gives up after a few.
        assert all(least <= one.newton <= most + 2 * MAX_BROYDEN for one in tried)


def test_newton_is_given_up_early_only_by_a_limited_march_and_only_without_any_progress():
    falling, wandering = np.logspace(0, -8, 9), np.array([1.0, 0.4, 2.0, 0.3, 0.9, 0.2, 0.5, 0.3, 0.4])
    for norms, unlimited, limited in ((falling, None, None), (wandering, None, SOON)):
        for failure_limit, expected in ((None, unlimited), (3, limited)):
            one = limit(failure_limit)
            for _ in range(2):  # A new solution forgets the last one.
                ended = [i for i, norm in enumerate(norms) if one.ends(i, norm)]
                assert ended == ([] if expected is None else [expected])
    assert limit(None).ends(MAX_NEWTON, 1e-7)
    assert limit(3).ends(LIMITED_NEWTON, 1e-7)


def test_a_march_is_given_up_when_patience_is_out(locking):
    """With locking chains; otherwise the step would be cut back to the smallest."""
    failed = []
    for failure_limit in (None, 3):
        with pytest.raises(NotConverged) as stopped:
            march(locking, ramp(3.0, 3), failure_limit=failure_limit)
        failed.append(sum(not one.accepted for one in stopped.value.history.attempts))
    assert failed[1] == 4 < failed[0]


def test_a_march_ends_where_too_many_steps_fail_on_the_way_to_a_target(locking, monkeypatch):
    """Steps that fail on the way to earlier targets do not count, nor does one that failed and then arrived."""
    monkeypatch.setattr("cases.stepper.MOST_FAILED", 3)
    with pytest.raises(NotConverged) as stopped:
        march(locking, Program(np.array([0.59, 0.0, 0.59, 1.2])))
    history = stopped.value.history
    np.testing.assert_array_equal(history.displacement[:3], [0.59, 0.0, 0.59])
    failed = [attempt for attempt in history.attempts if not attempt.accepted]
    assert sum(attempt.start >= 0.59 for attempt in failed) == 4
    assert len(failed) > 4
