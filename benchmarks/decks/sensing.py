"""Simulate a rig's logger: calibration, drift, hum, correlated noise, spikes, lost samples.

Everything is drawn from the sensor's seed, so that the same curve gives the same file.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from benchmarks.decks.manifest import Sensor

Array = NDArray[np.float64]

# Resolution of the logged force as a share of its range; the digest uses one or two digits less. Results of two
# machines differ by some 1e-8 of the range, which changes a digit of the digest once in 10^3 values.
LOGGED, COMPARED = 1e-5, 1e-4
# Number of values in the sketch, by which data are compared where the digest differs, and their tolerance.
SKETCH, NEAR = 16, 1e-3


def logged_signals(
    sensor: Sensor, time: Array, displacement: Array, force: Array
) -> tuple[Array, Array, Array]:
    """Time, displacement and force as logged; fewer samples where some are lost."""
    rng = np.random.default_rng(sensor.seed)
    n, span = len(force), float(np.ptp(force))
    percent = span / 100
    # Always drawn, in this order: a sensor without spikes has the same noise as one with spikes.
    white, travel = rng.standard_normal(n), rng.standard_normal(n)
    chance, sign, uniform = rng.random(n), rng.choice([-1.0, 1.0], n), rng.random(n)
    f = sensor.calibration * force
    f = f + sensor.drift * percent * time / time[-1]
    if sensor.hum:
        turn = 2 * np.pi * time / sensor.hum["period"] + sensor.hum["phase"]
        f = f + sensor.hum["size"] * percent * np.sin(turn)
    f = f + sensor.noise * percent * correlated_noise(white, sensor.correlation)
    if sensor.spikes:
        size = sensor.spikes["size"] * percent
        f = f + np.where(chance < sensor.spikes["share"], sign * size * (0.5 + uniform), 0.0)
    if sensor.quantum:
        f = np.round(f / (sensor.quantum * percent)) * sensor.quantum * percent
    q = displacement + sensor.travel_noise * float(np.abs(displacement).max()) * travel
    there = uniform >= sensor.lost
    # The first sample is never lost, because it defines rest.
    there[0] = True
    return time[there], q[there], np.round(f[there] / (LOGGED * span)) * LOGGED * span


def correlated_noise(white: Array, correlation: float) -> Array:
    """Autoregressive noise of first order and unit variance."""
    start = white[:1]
    rest = lfilter([np.sqrt(1 - correlation**2)], [1.0, -correlation], white[1:], zi=correlation * start)[0]
    return np.concatenate([start, rest])


def digest(time: Array, displacement: Array, force: Array) -> dict[str, Any]:
    """Return the digest of a channel's file, and the sketch of its forces over their range."""
    hasher = hashlib.sha256()
    for column in (time, displacement, force):
        # Steps are powers of ten, so that a column with a range larger by a percent has another digest.
        step = COMPARED * 10.0 ** np.floor(np.log10(float(np.ptp(column))))
        hasher.update(np.round(column / step).astype(np.int64).tobytes())
    at = np.linspace(0, len(force) - 1, SKETCH).round().astype(int)
    span = float(np.ptp(force))
    sketch = [round(float(f), 4) for f in force[at] / span]
    return {"sha256": hasher.hexdigest(), "range": float(f"{span:.6g}"), "sketch": sketch}


def compare_digests(known: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """Compare digests: "same", "near" (other last digits) or "different"."""
    if known["sha256"] == new["sha256"]:
        return "same"
    if abs(new["range"] / known["range"] - 1) > NEAR:
        return "different"
    away = np.abs(np.subtract(known["sketch"], new["sketch"]))
    return "near" if float(away.max()) <= NEAR else "different"


def read_csv(file: Path) -> tuple[Array, Array, Array]:
    """Columns of a channel's file: time, displacement, force."""
    table = np.loadtxt(file, delimiter=",", skiprows=1)
    return table[:, 0], table[:, 1], table[:, 2]
