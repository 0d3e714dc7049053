"""Units of a table of dynamic stiffness: those of recordings, and of frequency, temperature, stiffness and damping."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from bushcli.recording.header.units import TEMPERATURES, unit_size

#: Powers of time, length, force and angle -> kind.
_KINDS = {
    (1, 0, 0, 0): "time", (0, 1, 0, 0): "length", (0, 0, 0, 1): "angle", (0, 0, 1, 0): "force", (0, 1, 1, 0): "moment",
    (0, -2, 1, 0): "stress", (0, 0, 0, 0): "strain", (0, -1, 1, 0): "stiffness", (0, 1, 1, -1): "rotational stiffness",
    (1, -1, 1, 0): "damping", (1, 1, 1, -1): "rotational damping", (1, 1, 1, 0): "rotational damping",
}  # fmt: skip
_FREQUENCIES = {
    "hz": 1.0, "hertz": 1.0, "khz": 1e3, "mhz": 1e-3, "rad/s": 0.5 / math.pi, "rads-1": 0.5 / math.pi,
    "rad/sec": 0.5 / math.pi, "rad·s-1": 0.5 / math.pi, "rad*s-1": 0.5 / math.pi, "rpm": 1 / 60, "cpm": 1 / 60,
}  # fmt: skip
#: "Ns/mm", "kNs/m", "Nms/rad": a force, or a moment, times seconds, written together.
_IMPULSE = re.compile(r"(?<![^\W_])([kM]?N)(mm|m)?s(?![^\W_])")


@dataclass(frozen=True)
class DynamicUnit:
    """A unit: its kind, and ``value in internal units = factor * number + zero``."""

    kind: str
    factor: float
    zero: float = 0.0


def read_unit(text: str) -> DynamicUnit | None:
    """Return the unit that a text names: to Hz, degrees C, and the internal units of a recording; None for others."""
    bare = re.sub(r"\s+", "", text.strip().strip("[](){}"))
    low = bare.lower()
    if low in _FREQUENCIES:
        return DynamicUnit("frequency", _FREQUENCIES[low])
    if low in TEMPERATURES:
        return DynamicUnit("temperature", *TEMPERATURES[low])
    if bare in ("1", "-", "--"):
        return DynamicUnit("strain", 1.0)
    if not bare or any(character.isdigit() for character in bare[:1]):
        return None
    spaced = _IMPULSE.sub(lambda m: f"{m[1]}*{m[2] + '*' if m[2] else ''}s", text.strip().strip("[](){}"))
    spaced = re.sub(r"(?<=[^\W_])\s+(?=[^\W_])", "*", spaced)
    size = unit_size(spaced)
    if size is None or size[0] not in _KINDS:
        return None
    return DynamicUnit(_KINDS[size[0]], size[1])
