"""Rows that one file, or a group of its columns, contributes to a dynamic table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TablePart:
    """Rows of one file, or of a group of its columns: arrays (n,) by name, in internal units."""

    arrays: Mapping[str, Array]
    places: tuple[str, ...]
    remarks: tuple[str, ...] = ()
    modulus: Literal["E", "G", ""] = ""
