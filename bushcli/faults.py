"""Data that are no physics: what is wrong with a recording before anything is fitted to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Kind = Literal["sign", "unit", "swapped", "clipped", "spikes", "stuck", "time"]


@dataclass(frozen=True)
class DataFault:
    """A fault of a channel's data.

    Attributes
    ----------
    channel : str
    kind : str
    where, remedy : str
    fatal : bool
        Whether it must be mended before anything can be fitted.
    samples : shape (n,) of bool
        Samples that are left out of every fit.
    """

    channel: str
    kind: Kind
    where: str
    remedy: str
    fatal: bool
    samples: NDArray[np.bool_]


def find_faults(case: object, recordings: object) -> tuple[DataFault, ...]:
    """Placeholder."""
    return ()
