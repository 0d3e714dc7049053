"""Times that are repaired, constructed or refused; channels that were logged more slowly than the others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.faults import sample_faults
from bushcli.recording import Recording, read_recording
from bushcli.recording.source import Source

N = 400
TIME = np.arange(N) * 0.02
Q = 4.0 * np.sin(0.9 * TIME)
F = 120.0 * Q + Q**3


def record(path: Path, time: np.ndarray, q: np.ndarray = Q, f: np.ndarray = F, **keys: object) -> Recording:
    rows = "\n".join(f"{a:.9g},{b:.9g},{c:.9g}" for a, b, c in zip(time, q, f, strict=True))
    path.write_text(f"time_s,displacement_mm,force_N\n{rows}\n", encoding="utf-8")
    return read_recording(Source("axial", path, **keys))  # type: ignore[arg-type]


@pytest.mark.parametrize("cut", [np.floor, np.round, np.ceil])
@pytest.mark.parametrize("digit", [0.1, 0.05, 1.0])
def test_stamps_with_too_few_digits_get_equal_intervals(tmp_path, cut, digit):
    recording = record(tmp_path / "a.csv", cut(TIME / digit) * digit)
    assert recording.time is not None
    assert len(recording.time) == N
    np.testing.assert_allclose(np.diff(recording.time), 0.02, rtol=0.03)
    assert [repair.kind for repair in recording.repairs] == ["time"]
    assert "time stamps repeat the one before" in recording.repairs[0].text
    faults = [fault for fault in sample_faults(recording) if fault.kind == "time"]
    assert len(faults) == 1
    assert not faults[0].fatal


def test_unequal_intervals_with_too_few_digits_are_refused(tmp_path):
    rng = np.random.default_rng(1)
    time = np.cumsum(rng.lognormal(0.0, 1.5, N)) * 0.02
    with pytest.raises(RecordingError, match="the time does not increase"):
        record(tmp_path / "a.csv", np.floor(time / 0.1) * 0.1)


def test_single_stamps_out_of_line_are_interpolated(tmp_path):
    time = TIME.copy()
    time[57], time[200] = 0.0, time[199]
    recording = record(tmp_path / "a.csv", time)
    np.testing.assert_allclose(recording.time, TIME, atol=1e-9)
    assert "2 isolated time stamps" in recording.repairs[0].text


def test_a_clock_that_starts_again_is_refused(tmp_path):
    time = np.concatenate([TIME[:200], TIME[:200]])
    with pytest.raises(RecordingError, match=r"does not increase.*each recording into a file of its own"):
        record(tmp_path / "a.csv", time)


def test_a_clock_that_stands_for_long_is_refused(tmp_path):
    time = TIME.copy()
    time[100:140] = time[100]
    with pytest.raises(RecordingError, match="does not increase"):
        record(tmp_path / "a.csv", time)


def headless(path: Path, q: np.ndarray, f: np.ndarray, **keys: object) -> Recording:
    rows = "\n".join(f"{a:.9g},{b:.9g}" for a, b in zip(q, f, strict=True))
    path.write_text(f"displacement_mm,force_N\n{rows}\n", encoding="utf-8")
    return read_recording(Source("axial", path, **keys))  # type: ignore[arg-type]


def test_sample_rate_makes_the_time(tmp_path):
    recording = headless(tmp_path / "a.csv", Q, F, sample_rate=50.0)
    np.testing.assert_allclose(recording.time, TIME, atol=1e-12)
    assert "50 samples per second" in recording.repairs[0].text


def test_rate_makes_the_time_of_the_way(tmp_path):
    q = np.concatenate([np.linspace(0, 4, 41), np.linspace(3.9, -4, 80), np.linspace(-3.9, 0, 40)])
    recording = headless(tmp_path / "a.csv", q, 100 * q, rate=0.5)
    assert recording.time is not None
    assert recording.time[-1] == pytest.approx(16.0 / 0.5)
    assert recording.time[40] == pytest.approx(8.0)


def test_rate_is_refused_in_a_hold_and_in_noise(tmp_path):
    with pytest.raises(RecordingError, match="does not move"):
        headless(
            tmp_path / "a.csv",
            np.concatenate([Q[:50], np.full(20, Q[49]), Q[50:]]),
            np.append(F, F[:20]),
            rate=1.0,
        )
    noisy = Q + np.random.default_rng(0).normal(0, 0.05, N)
    with pytest.raises(RecordingError, match="noise makes the travelled path"):
        headless(tmp_path / "b.csv", noisy, F, rate=1.0)


def test_a_rate_beside_a_time_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="sample_rate has no meaning: column 1"):
        record(tmp_path / "a.csv", TIME, sample_rate=50.0)


@pytest.mark.parametrize("stride", [2, 5, 10])
def test_a_channel_that_was_logged_more_slowly_is_thinned(tmp_path, stride):
    held = F[np.arange(N) // stride * stride]
    recording = record(tmp_path / "a.csv", TIME, f=held)
    assert len(recording.force) == -(-N // stride)
    np.testing.assert_allclose(recording.force, F[::stride], rtol=1e-6)
    np.testing.assert_allclose(recording.displacement, Q[::stride], rtol=1e-6, atol=1e-6)
    assert recording.repairs[-1].kind == "stuck"
    assert f"{N - len(recording.force)} of {N} rows" in recording.repairs[-1].text


def test_a_coarse_converter_is_not_thinned(tmp_path):
    q = np.linspace(0, 4, N)
    steps = np.floor(q / 0.04) * 0.04
    recording = record(tmp_path / "a.csv", TIME, q=steps, f=100 * q)
    assert len(recording.force) == N


def test_lost_telegrams_are_not_thinned(tmp_path):
    held = F.copy()
    for start in (50, 120, 260, 300):
        held[start : start + 6] = held[start]
    assert len(record(tmp_path / "a.csv", TIME, f=held).force) == N


def test_a_channel_that_is_stuck_most_of_the_time_is_a_fatal_fault(tmp_path):
    rng = np.random.default_rng(2)
    # In the presence of noise five equal samples are no coincidence.
    held = F + rng.normal(0.0, 1.0, N)
    start = 12
    while start < N - 30:
        length = int(rng.integers(14, 30))
        held[start : start + length] = held[start]
        start += length + int(rng.integers(8, 12))
    recording = record(tmp_path / "a.csv", TIME, f=held)
    assert len(recording.force) == N
    [fault] = [fault for fault in sample_faults(recording) if fault.kind == "stuck"]
    assert fault.fatal
    assert fault.samples.mean() > 0.5
