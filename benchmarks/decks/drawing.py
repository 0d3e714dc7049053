"""Draw what every recording of every deck has: specimen, programs, sensors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.concealed import draw, programs
from benchmarks.concealed.simulate import Channel
from benchmarks.concealed.truth import Specimen
from benchmarks.decks.manifest import Entry, Program, Sensor
from cases.mode import modes

Array = NDArray[np.float64]

# Noise of the force, percent of the recorded range; its correlation from sample to sample.
NOISE, CORRELATION = (0.1, 1.0), (0.0, 0.8)
# Noise of the displacement's transducer, as a share of the amplitude.
TRAVEL_NOISE = 2e-4
# Standard deviation of the factor on a channel's force: half-plane, three dimensions.
CALIBRATION = {False: 0.005, True: 0.01}
# Share of the recordings with each fault of the data.
FAULTY = 0.1
SAMPLES = {"rich": (240, 400), "short": (130, 200), "ramp": (200, 300), "loop": (200, 300)}
# Seconds of a slow leg over the amplitude, also for channels in three dimensions.
SLOW = (30.0, 120.0)


class Unsuitable(Exception):
    """The drawn physics cannot be computed, or cannot be seen."""


def specimen(rng: np.random.Generator, channels: Sequence[str], laws: Sequence[str] = ()) -> Specimen:
    """Draw a bushing as `concealed.draw` does, with one of these laws; empty = any law."""
    while True:
        body = draw.specimen(rng, tuple(channels))
        if not laws or body.law in laws:
            return body


def channel_programs(
    rng: np.random.Generator, program: str, channels: Sequence[str]
) -> tuple[tuple[Program, ...], float]:
    """Draw the channels' programs; return also the seconds of the first one's fastest leg over the amplitude."""
    slow = math.exp(rng.uniform(*np.log(SLOW)))
    by_channel, fast = [], slow
    for i, channel in enumerate(channels):
        kind = "short" if program == "rich" and i > 0 else program
        legs = programs.PROGRAMS[kind](rng)
        if i == 0:
            fast = slow / max(leg.pace for leg in legs)
        count = int(rng.integers(*SAMPLES[kind]))
        pairs = tuple((round(leg.to, 4), round(leg.pace, 4)) for leg in legs)
        by_channel.append(Program(channel, pairs, round(slow, 2), count))
    return tuple(by_channel), fast


def channel(program: Program, specimen: Specimen) -> Channel:
    """Time and displacement of a program."""
    legs = tuple(programs.Leg(to, pace) for to, pace in program.legs)
    t, q = programs.path(legs, specimen.amplitude[program.mode], program.slow, program.samples)
    return Channel(program.mode, t, q)


def sensors(
    rng: np.random.Generator, seed: tuple[int, ...], modes_: Sequence[str], least: float = NOISE[0]
) -> tuple[Sensor, ...]:
    """Draw the sensors of each channel; a fault belongs to one channel."""
    level = math.exp(rng.uniform(math.log(least), math.log(NOISE[1])))
    by_channel = []
    for i, mode in enumerate(modes_):
        solid = modes()[mode].section is None
        by_channel.append(
            Sensor(
                calibration=round(1.0 + CALIBRATION[solid] * float(rng.standard_normal()), 5),
                noise=round(level * float(rng.uniform(0.7, 1.4)), 4),
                correlation=round(float(rng.uniform(*CORRELATION)), 3),
                travel_noise=TRAVEL_NOISE,
                seed=(*seed, 7, i),
            )
        )
    for fault in ("spikes", "quantum", "hum", "lost"):
        if rng.random() < FAULTY:
            at = int(rng.integers(len(by_channel)))
            by_channel[at] = with_fault(rng, by_channel[at], fault)
    return tuple(by_channel)


def with_fault(rng: np.random.Generator, sensor: Sensor, fault: str) -> Sensor:
    """Draw a fault of the data and give it to a sensor."""
    if fault == "spikes":
        share, size = float(rng.uniform(0.003, 0.01)), float(rng.uniform(5.0, 30.0))
        return replace(sensor, spikes={"share": round(share, 5), "size": round(size, 2)})
    if fault == "quantum":
        return replace(sensor, quantum=round(float(rng.uniform(0.2, 0.5)), 3))
    if fault == "hum":
        size, period = float(rng.uniform(0.1, 0.4)), math.exp(rng.uniform(math.log(0.5), math.log(20.0)))
        phase = float(rng.uniform(0, 2 * math.pi))
        return replace(
            sensor, hum={"size": round(size, 3), "period": round(period, 4), "phase": round(phase, 3)}
        )
    if fault == "lost":
        return replace(sensor, lost=round(float(rng.uniform(0.01, 0.08)), 4))
    if fault == "drift":
        return replace(sensor, drift=round(float(rng.uniform(0.1, 0.3)) * float(rng.choice([-1.0, 1.0])), 3))
    raise ValueError(fault)


def channels_of(entry: Entry) -> list[Channel]:
    """Channels of a recording: time and displacement."""
    return [channel(program, entry.specimen) for program in entry.programs]
