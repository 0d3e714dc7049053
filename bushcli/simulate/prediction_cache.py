"""What the designs of a study share: finite-element models, recordings, and how fine their steps have to be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from bushcli.simulate.recording_cache import RecordingCache
from cases.simulate import Prepare, prepare


@dataclass(frozen=True)
class PredictionCache:
    """Models, recordings and fineness that one prediction passes on to the next.

    Attributes
    ----------
    prepared : Prepare
        Makes the finite-element models.
    measured : RecordingCache
        Reads the recordings.
    fineness : mapping of str to float
        Fineness of the steps along recorded paths, by channel, where it is known
        (`bushcli.simulate.predict.fineness_of`). For other channels it is searched for, which marches a path four times
        for one result.
    """

    prepared: Prepare = prepare
    measured: RecordingCache = field(default_factory=RecordingCache)
    fineness: Mapping[str, float] = field(default_factory=dict)
