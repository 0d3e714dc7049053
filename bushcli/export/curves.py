"""Curves and stiffness matrices of a bushing for vehicle models."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bushcli.errors import InputError, Problem
from bushcli.export.vibration import FORCES, Vibration, mode_of
from cases.mode import modes

if TYPE_CHECKING:
    from bushcli.export.law import BushingLaw

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ForceCurve:
    """Force against displacement of one channel."""

    name: str
    mode: str
    displacement: Array  # (n,), mm or rad, in the order of the program
    force: Array  # (n,), N or N mm
    time: Array | None = None  # (n,), s

    @property
    def rotational(self) -> bool:
        """Whether the curve is a moment over an angle."""
        return modes()[self.mode].rotational

    def single_valued(self) -> tuple[Array, Array]:
        """Return displacement, increasing, and force: loading and unloading averaged, a missing side mirrored.

        Vehicle models take one force for each displacement. A curve of a program that loads and unloads is averaged
        over its branches; a curve with one side only is mirrored, as if the bushing were equally stiff on both sides.
        """
        q, force = self.displacement, self.force
        low, high = float(q.min()), float(q.max())
        grid = np.unique(np.append(np.linspace(low, high, 41), 0.0))
        branches = [np.interp(grid, *part, left=np.nan, right=np.nan) for part in _monotone(q, force)]
        with np.errstate(all="ignore"):
            count = np.sum(np.isfinite(branches), axis=0)
            mean = np.nansum(branches, axis=0) / np.maximum(count, 1)
        grid, mean = grid[count > 0], mean[count > 0]
        if low >= -1e-9 * high or high <= 1e-9 * -low:
            sides = [(-grid[::-1], -mean[::-1]), (grid, mean)][:: 1 if high > -low else -1]
            doubled, forces = (np.concatenate(parts) for parts in zip(*sides, strict=True))
            grid, indices = np.unique(doubled, return_index=True)
            mean = forces[indices]
        return grid, mean


def _monotone(q: Array, force: Array) -> list[tuple[Array, Array]]:
    """Return the monotone parts of a curve, each in the order of rising displacement."""
    step = np.sign(np.diff(q))
    parts, start = [], 0
    for end in range(1, len(q)):
        if end == len(q) - 1 or step[end] * step[end - 1] < 0:
            part = slice(start, end + 1)
            x, y = (q[part], force[part]) if q[end] >= q[start] else (q[part][::-1], force[part][::-1])
            unique_x, indices = np.unique(x, return_index=True)
            if len(unique_x) > 1:
                parts.append((unique_x, y[indices]))
            start = end
    return parts


def matrix_remedy(unrelaxed: bool) -> str:
    """Return how to obtain the stiffness matrix in a state, for messages."""
    state = " --unrelaxed" if unrelaxed else ""
    return f"run `bushcli direct CASE --stiffness-matrix{state} -o OUT`, then export OUT{state}"


@dataclass(frozen=True)
class BushingData:
    """Data of a vehicle model."""

    curves: tuple[ForceCurve, ...] = ()
    #: (6, 6); N, mm, rad: forces fx fy fz mx my mz on the inner sleeve against ux uy uz rx ry rz.
    stiffness_matrix: Array | None = None
    remarks: tuple[str, ...] = ()  # sentences for the file
    law: BushingLaw | None = None  # force law with memory
    unrelaxed: bool = False  # curves and matrix are those in a sudden step
    vibrations: tuple[Vibration, ...] = ()  # dynamic stiffness, one per motion and preload

    def by_mode(self) -> dict[str, ForceCurve]:
        """Return the first curve of each mode."""
        curves: dict[str, ForceCurve] = {}
        for curve in self.curves:
            curves.setdefault(curve.mode, curve)
        return curves

    def curve_of(self, direction: str, program: str) -> tuple[Array, Array]:
        """Return the curve of a direction FX to TZ: a simulated one, else a line of the stiffness matrix.

        Parameters
        ----------
        direction : str
            "FX", "FY", "FZ", "TX", "TY" or "TZ"; the bushing's axis is z.
        program : str
            Name of the writer, for the message.

        Raises
        ------
        InputError
            The bushing has neither.
        """
        curves = self.by_mode()
        mode = mode_of(direction)
        if mode in curves:
            return curves[mode].single_valued()
        if self.stiffness_matrix is not None:
            i = FORCES.index(direction)
            end = math.radians(10.0) if direction.startswith("T") else 5.0
            q = np.array([-end, 0.0, end])
            return q, float(self.stiffness_matrix[i, i]) * q
        what = f"{direction} needs a curve in mode {mode}, but there is none"
        remedy = f'add [[load_cases]] with mode = "{mode}", or {matrix_remedy(self.unrelaxed)}'
        raise InputError(Problem(f"--to {program}", what, "", remedy))


def curves_of(result: dict[str, Any]) -> tuple[ForceCurve, ...]:
    """Return the curves in the JSON of `direct`; those of a path of several directions are left out."""
    curves = []
    for entry in result.get("load_cases", []):
        mode, force = entry.get("mode"), entry.get("force")
        if mode not in modes() or modes()[mode].specimen != "bushing" or not isinstance(force, list):
            continue
        if any(value is None for value in force):
            continue
        q = np.array(entry["displacement"], dtype=float)
        q = np.radians(q) if modes()[mode].rotational else q
        time = None if entry.get("time") is None else np.array(entry["time"], dtype=float)
        name = str(entry.get("name", mode))
        curves.append(ForceCurve(name, mode, q, np.array(force, dtype=float), time))
    return tuple(curves)


def matrix_of(result: dict[str, Any]) -> tuple[Array | None, str]:
    """Return the stiffness matrix at rest in the JSON of `direct`, else that of the last state; None without one.

    Its state follows: "relaxed", "unrelaxed", or empty in a result of a version that kept no state.
    """
    for key in ("stiffness_matrix_start", "stiffness_matrix"):
        for entry in (*result.get("load_cases", []), result):
            matrix = entry.get(key)
            if matrix is not None:
                stiffness = np.array(matrix, dtype=float)
                if stiffness.shape == (6, 6) and np.isfinite(stiffness).all():
                    return stiffness, str(entry.get("stiffness_matrix_state", ""))
    return None, ""
