"""Programs: ramps, paths with cycles and holds, times."""

from __future__ import annotations

import numpy as np
import pytest

from cases.program import Program, path, ramp


def test_ramp():
    np.testing.assert_allclose(ramp(-2.0, 4).displacement, [0, -0.5, -1, -1.5, -2])
    assert ramp(1.0, 1).time is None


def test_path_passes_its_corners_in_steps_of_like_size():
    q = path([0.0, 4.0, -4.0, 0.0], 8).displacement
    # The number of steps is that of the longest segment (8 mm); shorter ones get fewer in proportion.
    np.testing.assert_allclose(q[:5], [0, 1, 2, 3, 4])
    np.testing.assert_allclose(q[4:13], np.linspace(4, -4, 9))
    np.testing.assert_allclose(q[12:], np.linspace(-4, 0, 5))


def test_path_starts_at_rest():
    np.testing.assert_array_equal(path([3.0], 3).displacement, path([0.0, 3.0], 3).displacement)


def test_short_segments_get_two_steps():
    np.testing.assert_allclose(path([0.0, 10.0, 9.9], 5).displacement[-3:], [10.0, 9.95, 9.9])


def test_rate_gives_the_time():
    program = path([0.0, 2.0, -1.0], 4, rate=0.5)
    assert program.time[0] == 0.0
    assert program.time[-1] == pytest.approx(5.0 / 0.5)
    np.testing.assert_allclose(np.abs(np.diff(program.displacement)), 0.5 * np.diff(program.time))


def test_a_hold_needs_times():
    assert list(path([0.0, 1.0, 1.0], 2).displacement) == [0.0, 0.5, 1.0, 1.0, 1.0]
    with pytest.raises(ValueError, match="hold"):
        path([0.0, 1.0, 1.0], 2, rate=1.0)


@pytest.mark.parametrize(
    ("displacement", "time"),
    [(np.zeros(0), None), (np.zeros((2, 2)), None), (np.zeros(3), np.zeros(2))],
)
def test_impossible_programs_are_refused(displacement, time):
    with pytest.raises(ValueError, match="a program needs"):
        Program(displacement, time)
