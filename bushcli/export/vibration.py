"""Dynamic stiffness of a bushing over frequency, from the result of `dynamic` or else simulated."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import InputError, Problem
from cases.mode import modes

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Forces and moments on the inner sleeve, in the order of a stiffness matrix's rows; the bushing's axis is z.
FORCES = ("FX", "FY", "FZ", "TX", "TY", "TZ")


def mode_of(direction: str) -> str:
    """Return the name of the mode whose curve stands for a direction FX to TZ."""
    return next(mode.name for mode in modes().values() if direction in mode.directions)


@dataclass(frozen=True)
class Vibration:
    """Dynamic stiffness of one motion about one preload."""

    name: str  # of the load case
    directions: tuple[str, ...]  # forces that it stands for, of FX to TZ; the bushing's axis is z
    #: Displacement and force of the preload, mm or rad and N or N mm; None = the end of a path of six motions.
    static: tuple[float, float] | None
    transfer: bool  # the force is that on the held sleeve
    frequency: Array  # (n,), Hz, increasing
    stiffness: Complex  # (n,), K' + i K'', N/mm or N mm/rad
    amplitude: float | None = None  # peak, mm or rad; None = small

    @property
    def rotational(self) -> bool:
        """Whether it is a moment over an angle."""
        return self.directions[0].startswith("T")

    @property
    def damping(self) -> Array:
        """Coefficient of a viscous damper, K'' / omega, N s/mm or N mm s/rad."""
        return np.asarray(self.stiffness.imag / (2.0 * np.pi * self.frequency))

    @property
    def state(self) -> str:
        """The preload in words."""
        point = f"{self.name}, {'transfer' if self.transfer else 'driving-point'} stiffness about"
        if self.static is None:
            return f"{point} the end of the path"
        q, force = self.static
        per, unit = (math.degrees(1.0), "deg") if self.rotational else (1.0, "mm")
        peak = "" if self.amplitude is None else f" at an amplitude of {per * self.amplitude:.4g} {unit}"
        return f"{point} {per * q:.4g} {unit} and {force:.4g} {'N mm' if self.rotational else 'N'}{peak}"


def by_direction(vibrations: tuple[Vibration, ...], program: str) -> dict[str, Vibration]:
    """Return the vibration of each direction FX to TZ: of the first load case, at its first preload and amplitude."""
    directions: dict[str, Vibration] = {}
    for vibration in vibrations:
        for direction in vibration.directions:
            directions.setdefault(direction, vibration)
    lacking = dict.fromkeys(mode_of(direction) for direction in FORCES if direction not in directions)
    if lacking:
        missing = ", ".join(direction for direction in FORCES if direction not in directions)
        what = f"no dynamic stiffness in {missing}, where the bushing would be free"
        tables = " and ".join(f'mode = "{mode}"' for mode in lacking)
        remedy = (
            f"add [[load_cases]] with {tables}, each with a table [load_cases.dynamic]; or --to csv_dynamic"
        )
        raise InputError(Problem(f"--to {program}", what, "", remedy))
    return {direction: directions[direction] for direction in FORCES}


def vibrations_in(result: dict[str, Any]) -> tuple[Vibration, ...]:
    """Return what the JSON of `dynamic` has; coupons are left out."""
    vibrations: list[Vibration] = []
    for entry in result["load_cases"] if result["command"] == "dynamic" else ():
        of = "" if entry.get("storage_matrix") is None else "_matrix"
        values = np.array(entry[f"storage{of}"]) + 1j * np.array(entry[f"loss{of}"])
        preload, mode, peak = entry["preload"], entry["mode"], entry["amplitude"]
        unit = math.radians(1.0) if modes()[mode].rotational else 1.0
        q = unit * preload["displacement"]
        static, transfer = (q, preload["force"]), entry["point"] == "transfer"
        frequency = np.array(entry["frequency"], dtype=float)
        amplitude = None if peak is None else unit * peak
        vibrations += motions(entry["name"], mode, static, transfer, frequency, values, amplitude)
    return tuple(vibrations)


def motions(
    name: str,
    mode: str,
    static: tuple[float, float],
    transfer: bool,
    frequency: Array,
    values: Complex,
    amplitude: float | None = None,
) -> Iterator[Vibration]:
    """Yield the motions of a load case: one of a mode, six of a pose, whose matrix lacks its other terms.

    Frequencies (n,) in Hz are in any order; the values K' + i K'' are (n,) or (n, 6, 6), in N, mm and rad; preload and
    amplitude are as in `Vibration`.
    """
    rising = np.argsort(frequency)
    if values.ndim == 1:
        if modes()[mode].specimen == "bushing":
            directions = modes()[mode].directions
            yield Vibration(name, directions, static, transfer, frequency[rising], values[rising], amplitude)
        return
    for k, direction in enumerate(FORCES):
        yield Vibration(name, (direction,), None, transfer, frequency[rising], values[rising, k, k])
