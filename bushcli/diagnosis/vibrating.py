"""Tables of dynamic stiffness in the result of a diagnosis: before and after, and where a model misses them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bushcli.diagnosis.result import DiagnosedTable
from bushcli.recording.dynamic.rows import RecordedTable
from bushcli.recording.dynamic.table import DynamicTable
from bushcli.simulate.dynamic_tables import ComparedTable
from cases.mode import modes

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

# A misfit is said where noise alone would make it in one table of a thousand (three standard deviations), and to vary
# with a condition where the means of that explain half of it. Words only.
SURE, VARIES = 3.0, 0.5
# Groups of neighbouring frequencies whose means are compared. Words only.
BANDS = 4


def diagnosed_table(
    recording: RecordedTable, before: Array, after: Array, used: NDArray[np.bool_], held_out: bool
) -> DiagnosedTable:
    """Return a table (n rows, 2 n samples) with its simulations by the plain law and by the most probable model."""
    rows = used[: len(recording.table)]
    table, errors = recording.table.rows(rows), recording.errors[:, rows]
    measured = table.storage + 1j * table.loss
    started, simulated = (recording.stiffness(force)[rows] for force in (before, after))

    def percent(relative: NDArray[np.complex128] | Array) -> float:
        return 100.0 * float(np.sqrt(np.mean(np.abs(relative) ** 2)))

    compared = ComparedTable(
        table,
        simulated,
        recording.displacement[: len(rows)][rows],
        0.0,
        errors * [table.stiffness, np.ones(len(table))],
        started,
        None,
        held_out,
    )
    return DiagnosedTable(
        compared,
        percent(started / measured - 1.0),
        percent(simulated / measured - 1.0),
        percent(np.hypot(*errors)),
        held_out,
        *(tuple(_places(table, stiffness / measured, errors)) for stiffness in (started, simulated)),
    )


def _places(table: DynamicTable, ratio: NDArray[np.complex128], errors: Array) -> Iterator[str]:
    """Yield a sentence for |K*| and for the loss angle, where a simulation misses them by more than noise.

    `ratio` (n,) is the simulated over the measured K*, `errors` (2, n) are those of ln |K*| and of the loss angle, rad.
    """
    if not np.isfinite(ratio).all():
        yield f"{table.name}: cannot be simulated"
        return
    count = len(table)
    for quantity, unit, missed, error in (
        ("dynamic stiffness", " %", 100.0 * (np.abs(ratio) - 1.0), 100.0 * errors[0]),
        ("loss angle", " degrees", np.degrees(np.angle(ratio)), np.degrees(errors[1])),
    ):
        weighted = missed / error
        total = float(weighted @ weighted)
        if total < count + SURE * np.sqrt(2.0 * count):
            continue
        parts = [
            (_explained_share(weighted, groups), words) for groups, words in _conditions(table, missed, unit)
        ]
        share, words = max(parts, default=(0.0, ""))
        mean, rms = float(np.mean(missed)), float(np.sqrt(np.mean(missed**2)))
        # Several means explain more than one by chance: 0.1 more is asked for.
        if share < max(VARIES, _explained_share(weighted, [np.arange(count)]) + 0.1):
            sense = f"by {mean:+.2g}{unit} on average" if abs(mean) > 0.7 * rms else "both ways"
            words = f"{sense}, spread over the table"
        size = f"{rms:.2g}{unit} rms, {np.sqrt(total / count):.1f} times the noise"
        yield f"{table.name}: the simulated {quantity} is off {words} ({size})"


def _explained_share(weighted: Array, groups: list[Rows]) -> float:
    """Share of the squares of a misfit (n,) that the means of groups explain."""
    own = sum(float(weighted[rows].sum()) ** 2 / len(rows) for rows in groups)
    return own / float(weighted @ weighted)


def _conditions(table: DynamicTable, missed: Array, unit: str) -> Iterator[tuple[list[Rows], str]]:
    """Yield the rows of each level of each condition, with the means of the misfit there in words."""
    rotational = modes()[table.mode].rotational
    length, per = ("deg", np.degrees(1.0)) if rotational else ("mm", 1.0)
    bands = np.array_split(np.argsort(table.frequency, kind="stable"), BANDS)
    force = "N mm" if rotational else "N"
    for key, name, unit_of_values, scale in (
        ("frequency", "at", "Hz", 1.0),
        ("amplitude", "at an amplitude of", length, per),
        ("preload", "at a preload of", length, per),
        ("preload_force", "at a preload of", force, 1.0),
        ("temperature", "at", "degrees C", 1.0),
    ):
        values = getattr(table, key)
        if np.isnan(values).any():
            continue
        groups = bands
        if key != "frequency":
            number = table.levels(key)
            groups = [np.flatnonzero(number == k) for k in range(number.max() + 1)]
        groups = [rows for rows in groups if len(rows)]
        if len(groups) < 2 or np.ptp(values) == 0.0:
            continue
        means = [float(np.mean(missed[rows])) for rows in groups]
        ends = [(means[k], _range(scale * values[groups[k]])) for k in np.argsort(means)[[0, -1]]]
        words = " to ".join(f"{mean:+.2g}{unit} {name} {where} {unit_of_values}" for mean, where in ends)
        yield groups, f"from {words}"


def _range(values: Array) -> str:
    low, high = f"{values.min():.3g}", f"{values.max():.3g}"
    return low if low == high else f"{low} to {high}"
