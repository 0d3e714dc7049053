"""Paths of six motions and stiffness matrices: as JSON, as tables of text, as CSV."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bushcli.report.quantity import number, quantities
from bushcli.report.tables import ReportTable, Row
from cases.six import MOTIONS, REACTIONS

if TYPE_CHECKING:
    from bushcli.simulate.response import Response, Simulated
    from bushcli.simulate.six import SixCurve

Array = NDArray[np.float64]

_MOTION_UNITS, _FORCE_UNITS = ("mm",) * 3 + ("deg",) * 3, ("N",) * 3 + ("N mm",) * 3
# Rows of a printed path: its ends and states between them.
_ROWS = 9
# Values below this share of the largest one of the same kind are rounding errors and are printed as zero.
_NOTHING = 1e-6
# Forces or moments that are all below this share of the largest value of both, in N and N mm, are rounding errors:
# Newton's method leaves 1e-9 of it in the moment of a free tilt.
_ROUNDING = 1e-6


def shown_motion(six: SixCurve) -> Array:
    """Return the motions in mm and degrees, shape (n, 6)."""
    return np.hstack([six.motion[:, :3], np.degrees(six.motion[:, 3:])])


def six_json(channel: Simulated) -> dict[str, Any]:
    """Return motions, reactions and stiffness matrices of a channel as JSON-ready data, where there are any."""
    document: dict[str, Any] = {}
    if channel.six is not None:
        six, motion = channel.six, shown_motion(channel.six)
        document = {
            "mode": "path",
            "units": {
                "motion": "mm, deg",
                "force": "N, N mm",
                "stiffness": quantities(channel.mode).stiffness_unit,
            },
            "time": six.time,
            "motion": {name: motion[:, k] for k, name in enumerate(MOTIONS)},
            "force": {name: six.force[:, k] for k, name in enumerate(REACTIONS)},
            "free": [MOTIONS[k] for k in six.free],
            "lead": MOTIONS[six.lead],
            "reach": channel.reach if channel.stopped else float(six.time[-1]),
        }
    for state, (displacement, matrix) in (channel.stiffness or {}).items():
        name = "stiffness_matrix" if state == "end" else f"stiffness_matrix_{state}"
        document[name] = matrix.tolist()
        document["stiffness_matrix_state"] = "unrelaxed" if channel.unrelaxed else "relaxed"
        if state == "at":
            document["stiffness_matrix_at_displacement"] = _displacement(channel, displacement)
    return document


def six_tables(response: Response) -> Iterator[ReportTable]:
    """Yield the tables of a prediction's paths and stiffness matrices."""
    for channel in response.channels:
        if channel.six is not None and len(channel.six.time):
            yield _path_table(channel.name, channel.six)
        for state, (displacement, matrix) in (channel.stiffness or {}).items():
            yield _matrix_table(channel, state, displacement, matrix)


def six_columns(six: SixCurve) -> tuple[list[str], list[Array]]:
    """Return names and columns of time, motions (mm, degrees) and reactions (N, N mm), named as in recordings."""
    names = [f"{name}_{unit}" for name, unit in zip(MOTIONS, _MOTION_UNITS, strict=True)]
    names += [f"{name}_{unit.replace(' ', '')}" for name, unit in zip(REACTIONS, _FORCE_UNITS, strict=True)]
    return ["time_s", *names], [six.time, *shown_motion(six).T, *six.force.T]


def largest_reactions(force: Array) -> tuple[float, float]:
    """Return the largest force (N) and the largest moment (N mm) of reactions of shape (n, 6).

    It is infinite where all of them are rounding errors, as moments are if each belongs to a free or symmetric motion.
    """
    most = float(np.abs(force).max())
    forces, moments = (float(np.abs(force[:, part]).max()) for part in (slice(0, 3), slice(3, 6)))
    least = _ROUNDING * most
    return (forces if forces > least else np.inf), (moments if moments > least else np.inf)


def _path_table(name: str, six: SixCurve) -> ReportTable:
    chosen = np.unique(np.linspace(0, len(six.time) - 1, min(_ROWS, len(six.time))).round().astype(int))
    motion = shown_motion(six)
    moving = [k for k in range(6) if k in six.free or np.any(motion[:, k])]
    heads = ["time, s"]
    heads += [f"{MOTIONS[k]}{' (free)' if k in six.free else ''}, {_MOTION_UNITS[k]}" for k in moving]
    heads += [f"{force}, {unit}" for force, unit in zip(REACTIONS, _FORCE_UNITS, strict=True)]
    largest = largest_reactions(six.force)
    widest = [float(np.abs(motion[:, part]).max()) for part in (slice(0, 3), slice(3, 6))]
    rows: list[Row] = []
    for i in chosen:
        forces = [_force(six.force[i, k], largest[k // 3]) for k in range(6)]
        moved = [_force(motion[i, k], widest[k // 3]) for k in moving]
        rows.append((number(six.time[i]), *moved, *forces))
    title = f"{name}: motions of the inner sleeve, and the reactions (moments about its centre)"
    return ReportTable(title, tuple(heads), tuple(rows), left=0)


def _matrix_table(channel: Simulated, at: str, displacement: float, matrix: Array) -> ReportTable:
    heads = ("", *(f"{name}, {'mm' if k < 3 else 'rad'}" for k, name in enumerate(MOTIONS)))
    diagonal = np.sqrt(np.abs(np.diag(matrix)))
    rows = []
    for k, name in enumerate(REACTIONS):
        row = [_force(matrix[k, m], float(diagonal[k] * diagonal[m])) for m in range(6)]
        rows.append((f"{name}, {_FORCE_UNITS[k]}", *row))
    where = {"start": "at the start", "end": "at the end"}.get(at, "")
    unit = "s" if channel.in_time else quantities(channel.mode).displacement_unit
    place = (
        f"{where} ({number(_displacement(channel, displacement))} {unit})"
        if where
        else (f"at {number(_displacement(channel, displacement))} {unit}")
    )
    state = f"; {channel.state}" if channel.state else ""
    return ReportTable(
        f"{channel.name}: stiffness matrix {place}, N, mm, rad{state}", heads, tuple(rows), left=1
    )


def _displacement(channel: Simulated, displacement: float) -> float:
    return displacement if channel.in_time else quantities(channel.mode).at(displacement)


def _force(value: float, largest: float) -> str:
    return "0" if abs(value) <= _NOTHING * largest else number(value, 4)
