"""What a recording holds: a measured curve in internal units, and where it came from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bushcli.recording.curve import Curve
from bushcli.recording.samples import Repair

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RecordedPath:
    """Six motions of the inner sleeve as recorded.

    Attributes
    ----------
    time : shape (n,) or None
        s.
    motion : shape (n, 6)
        mm and rad.
    free : tuple of int
        Motions that no force held.
    number : int
        Of the motion and reaction that the recording is of.
    name : str
        Of the whole recording, whose channels have one path.
    """

    time: Array | None
    motion: Array
    free: tuple[int, ...]
    number: int
    name: str


@dataclass(frozen=True)
class Recording(Curve):
    """A measured curve, in internal units.

    ``displacement`` (n,) is in mm or rad and ``force`` (n,) in N or N mm; of a coupon, ``displacement`` is
    stretch - 1 (the nominal strain) and ``force`` the nominal stress in MPa, so that a coupon is recorded
    like a bushing. ``time`` (n,) is in s, or None.

    Attributes
    ----------
    name : str
        Of the channel.
    source : Path, optional
        The file.
    cycles : tuple of int
        Numbers, in the file, of the cycles that were taken of it; empty where all were.
    units : (str, str)
        Of displacement and force in the file, see `bushcli.recording.units`; empty where they are not known.
    repeated : tuple of int
        Lines of the file that repeat the row before them, time and all; they were left out.
    repairs : tuple of Repair
        What else was repaired, or is to be known.
    conditioning : int
        Number of first cycles of the file that only condition the specimen.
    six : RecordedPath, optional
        The path of six motions of which displacement and force are one motion and its reaction.
    """

    name: str = ""
    source: Path | None = None
    cycles: tuple[int, ...] = ()
    units: tuple[str, str] = ("", "")
    repeated: tuple[int, ...] = ()
    repairs: tuple[Repair, ...] = ()
    conditioning: int = 0
    six: RecordedPath | None = None
