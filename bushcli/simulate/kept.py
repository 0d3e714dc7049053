"""What the designs of a study share: finite-element models, recordings, and how fine their steps have to be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from bushcli.simulate.measured import Measured
from cases.simulate import Prepare, prepare


@dataclass(frozen=True)
class Kept:
    """What is kept from one prediction to the next.

    Attributes
    ----------
    prepared : Prepare
        Makes the finite-element models.
    measured : Measured
        Reads the recordings.
    fineness : mapping of str to float
        Of the steps along recorded paths, by channel, where it is known (`bushcli.simulate.predict.fineness_of`). It is
        found for the others, and a path is then marched four times for one result.
    """

    prepared: Prepare = prepare
    measured: Measured = field(default_factory=Measured)
    fineness: Mapping[str, float] = field(default_factory=dict)
