"""Sine bursts of a rig become rows of a table of dynamic stiffness."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording.dynamic.read import read_dynamic
from bushcli.recording.dynamic.source import DynamicSource

#: Frequency in Hz, amplitude in mm, periods, K* in N/mm.
BURSTS = ((2.0, 0.1, 12, 450 + 40j), (10.0, 0.5, 15, 500 + 60j), (40.0, 0.05, 40, 550 + 90j))


def record(rate, noise=(0.0, 0.0), seed=1, bursts=BURSTS, third=0.02, preload=1.0):
    """Return time, displacement and force of bursts about a preload, each with a start-up, a rest and a drift."""
    rng = np.random.default_rng(seed)
    ramp = np.linspace(0.0, 1.0, int(0.5 * rate))
    moved, forces = [preload * ramp], [400.0 * preload * ramp]
    for frequency, amplitude, periods, stiffness in bursts:
        t = np.arange(int(periods / frequency * rate)) / rate
        size, phase = amplitude * np.minimum(0.5 * frequency * t, 1.0), 2.0 * np.pi * frequency * t
        first = np.abs(stiffness) * size * np.sin(phase + np.angle(stiffness))
        moved += [preload + size * np.sin(phase), np.full(int(0.2 * rate), preload)]
        drift = 400.0 * preload * (1.0 - 0.01 * t / t[-1])
        forces += [
            drift + first + third * np.abs(stiffness) * size * np.sin(3 * phase),
            np.full(int(0.2 * rate), 400.0 * preload),
        ]
    q, force = np.concatenate(moved), np.concatenate(forces)
    return (
        np.arange(len(q)) / rate,
        q + noise[0] * rng.normal(size=len(q)),
        force + noise[1] * rng.normal(size=len(q)),
    )


def written(path, columns):
    np.savetxt(
        path,
        np.column_stack(columns),
        delimiter=",",
        header="time_s,displacement_mm,force_N",
        comments="",
        fmt="%.7g",
    )
    return read_dynamic(DynamicSource("radial", (path,)))


@pytest.mark.parametrize("rate", [250.0, 2000.0, 10000.0])
def test_bursts_give_their_stiffness(tmp_path, rate):
    table = written(tmp_path / "loops.csv", record(rate))
    stiffness = np.array([burst[3] for burst in BURSTS])
    np.testing.assert_allclose(table.frequency, [burst[0] for burst in BURSTS], rtol=1e-4)
    np.testing.assert_allclose(table.amplitude, [burst[1] for burst in BURSTS], rtol=1e-3)
    np.testing.assert_allclose(table.storage + 1j * table.loss, stiffness, rtol=1e-3)
    np.testing.assert_allclose(table.third_harmonic[:2], 0.02, rtol=1e-2)
    np.testing.assert_allclose(table.preload, 1.0, atol=1e-3)
    np.testing.assert_allclose(table.preload_force, 398.0, atol=1.0)


def test_standard_errors_are_those_of_repeated_tests(tmp_path):
    bursts, errors, misfits = ((10.0, 0.1, 20, 500 + 60j),), [], []
    for seed in range(30):
        table = written(tmp_path / "loops.csv", record(500.0, (0.001, 1.0), seed, bursts))
        assert len(table) == 1
        misfits += [table.storage[0] - 500.0, table.loss[0] - 60.0]
        errors.append(table.storage_error[0])
    spread = np.sqrt(np.mean(np.square(misfits)))
    # Sixty values give a standard deviation to 9 %.
    assert spread == pytest.approx(np.mean(errors), rel=0.3)


def test_a_triangle_and_a_single_cycle_are_no_bursts(tmp_path):
    t = np.arange(0.0, 10.0, 0.01)
    triangle = np.abs((t % 2.0) - 1.0)
    with pytest.raises(RecordingError, match="no sine"):
        written(tmp_path / "a.csv", (t, triangle, 400.0 * triangle))
    ramp = np.minimum(t, 10.0 - t)
    with pytest.raises(RecordingError, match="no burst of at least three equal periods"):
        written(tmp_path / "b.csv", (t, ramp, 400.0 * ramp))


def test_a_reversed_force_is_refused(tmp_path):
    time, displacement, force = record(500.0, preload=0.0)
    with pytest.raises(RecordingError, match="runs against the motion"):
        written(tmp_path / "loops.csv", (time, displacement, -force))


def test_a_file_that_is_neither_names_both(tmp_path):
    path = tmp_path / "other.csv"
    path.write_text("a,b\n1,2\n2,3\n3,4\n")
    with pytest.raises(RecordingError, match=r"no table of dynamic stiffness.*as loops"):
        read_dynamic(DynamicSource("radial", (path,)))
