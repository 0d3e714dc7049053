"""Noise-free forces of a foreign recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.concealed.simulate import Channel
from benchmarks.decks.drawing import channels_of
from benchmarks.decks.foreign.formulas import FORMULAS, elastic_force, plain
from benchmarks.decks.manifest import Entry

Array = NDArray[np.float64]


def forces(entry: Entry) -> tuple[list[Array], list[Array]]:
    """Forces of the channels with the concealed physics and without it."""
    channels = channels_of(entry)
    return concealed_forces(entry, channels), elastic(entry, channels)


def concealed_forces(entry: Entry, channels: list[Channel]) -> list[Array]:
    """Forces with the concealed physics."""
    (formula,) = entry.formulas
    made = FORMULAS[formula["name"]].force
    return [made(formula, entry.specimen, c) for c in channels]


def elastic(entry: Entry, channels: list[Channel]) -> list[Array]:
    """Forces without it; for MORPH, whose parts cannot be removed, the nearest curve of a law."""
    (formula,) = entry.formulas
    known = FORMULAS[formula["name"]]
    if known.base == "morph":
        return [elastic_force(entry.specimen, c)[0] for c in channels]
    return [plain(known, entry.specimen, c) for c in channels]


def with_fewer_samples(entry: Entry, samples: int) -> list[Channel]:
    """Channels with fewer samples, to find a size."""
    programs = tuple(replace(p, samples=min(p.samples, samples)) for p in entry.programs)
    return channels_of(replace(entry, programs=programs))
