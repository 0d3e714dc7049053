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


def stepped(frequencies, amplitudes, periods=20, rate=1000.0, noise=2e-5, rest=0.0):
    """Return time, displacement and force of sines that follow one another; 400 + 60i N/mm at 10 Hz, rising."""
    rng, moved, forces = np.random.default_rng(4), [], []
    for frequency, amplitude in zip(frequencies, amplitudes, strict=True):
        wave = amplitude * np.exp(2j * np.pi * frequency * np.arange(int(periods / frequency * rate)) / rate)
        still = np.zeros(int(rest * rate))
        moved += [wave.imag, still]
        forces += [((400.0 * (frequency / 10.0) ** 0.1 + 60j) * wave).imag, still]
    q = np.concatenate(moved)
    return np.arange(len(q)) / rate, q + noise * rng.normal(size=len(q)), np.concatenate(forces)


@pytest.mark.parametrize(
    ("frequencies", "amplitudes"),
    [
        (np.arange(10.0, 20.1, 2.0), np.full(6, 0.1)),
        (np.arange(10.0, 14.1, 1.0), np.full(5, 0.1)),
        (np.full(8, 10.0), 0.1 * 1.1 ** np.arange(8)),
    ],
)
def test_steps_without_rests_are_a_row_each(tmp_path, frequencies, amplitudes):
    """None of them is a mean of two steps, which no one has measured."""
    table = written(tmp_path / "steps.csv", stepped(frequencies, amplitudes))
    np.testing.assert_allclose(table.frequency, frequencies, rtol=1e-3)
    np.testing.assert_allclose(table.amplitude, amplitudes, rtol=2e-3)
    np.testing.assert_allclose(table.storage, 400.0 * (frequencies / 10.0) ** 0.1, rtol=5e-3)


@pytest.mark.parametrize("periods", [3, 4, 10])
def test_a_rest_after_a_burst_is_not_part_of_it(tmp_path, periods):
    table = written(tmp_path / "loops.csv", stepped((1.0, 2.0), (0.1, 0.1), periods, 500.0, 1e-4, 0.5))
    np.testing.assert_allclose(table.frequency[0], 1.0, rtol=3e-3)
    np.testing.assert_allclose(table.amplitude, 0.1, rtol=5e-3)


def test_a_motion_that_never_stays_as_it_is_gives_no_row(tmp_path):
    """A sweep of one decade in a second, and an amplitude that grows by 3 % per period; a steady burst beside it."""
    t = np.arange(0.0, 1.0, 1e-3)
    sweep = 0.1 * np.sin(2.0 * np.pi * 10.0 / np.log(10.0) * (10.0**t - 1.0))
    with pytest.raises(RecordingError, match="no sine that stays as it is"):
        written(tmp_path / "a.csv", (t, sweep, 400.0 * sweep))
    growing = 0.1 * 1.03 ** (10.0 * t) * np.sin(20.0 * np.pi * t)
    _, steady, _ = stepped((40.0,), (0.3,))
    q = np.concatenate([growing, np.zeros(500), steady])
    table = written(tmp_path / "b.csv", (np.arange(len(q)) * 1e-3, q, 400.0 * q))
    np.testing.assert_allclose(table.frequency, 40.0, rtol=1e-3)
    assert any("1 periodic motion whose frequency or amplitude changes" in text for text in table.remarks)


def test_a_triangle_and_a_single_cycle_are_no_bursts(tmp_path):
    t = np.arange(0.0, 10.0, 0.01)
    triangle = np.abs((t % 2.0) - 1.0)
    with pytest.raises(RecordingError, match="no sine"):
        written(tmp_path / "a.csv", (t, triangle, 400.0 * triangle))
    ramp = np.minimum(t, 10.0 - t)
    with pytest.raises(RecordingError, match="no burst of at least three equal periods"):
        written(tmp_path / "b.csv", (t, ramp, 400.0 * ramp))


@pytest.mark.parametrize(
    ("above", "between", "said"),
    [
        ("Room temperature: 60 °C\n", "", ""),
        ("# Temperature: 60 °C\n", "# Temperature: 60 °C\n", ""),
        ("Storage temperature: 40 °C\n", "", "remark"),
        ("Temperature: 60-80 °C\n", "", "temperature = ..."),
        ("", "Temperature: 60 °C\n", "where the rows before have 3"),
        ("", "# Temperature: 60 °C\n", "a part of the samples only"),
        ("Temperature: 23 °C\n", "# Temperature: 60 °C\n", "a part of the samples only"),
    ],
)
def test_no_line_about_the_temperature_of_loops_is_lost(tmp_path, above, between, said):
    path = tmp_path / "loops.csv"
    samples = [f"{a:.6g},{b:.6g},{c:.6g}\n" for a, b, c in zip(*record(500.0), strict=True)]
    half = len(samples) // 2
    head = f"{above}time_s,displacement_mm,force_N\n"
    path.write_text(f"{head}{''.join(samples[:half])}{between}{''.join(samples[half:])}", encoding="utf-8")
    if said not in ("", "remark"):
        with pytest.raises(RecordingError) as error:
            read_dynamic(DynamicSource("radial", (path,)))
        assert said in str(error.value)
        return
    table = read_dynamic(DynamicSource("radial", (path,)))
    np.testing.assert_array_equal(table.temperature, np.nan if said else 60.0)
    assert any("temperature = ..." in remark for remark in table.remarks) == bool(said)


def test_a_reversed_force_is_refused(tmp_path):
    time, displacement, force = record(500.0, preload=0.0)
    with pytest.raises(RecordingError, match="runs against the motion"):
        written(tmp_path / "loops.csv", (time, displacement, -force))


def test_a_file_that_is_neither_names_both(tmp_path):
    path = tmp_path / "other.csv"
    path.write_text("a,b\n1,2\n2,3\n3,4\n")
    with pytest.raises(RecordingError, match=r"no table of dynamic stiffness.*as loops"):
        read_dynamic(DynamicSource("radial", (path,)))
