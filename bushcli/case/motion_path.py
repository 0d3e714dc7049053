"""Paths of six motions in a case file: prescribed ones of load cases, and the columns of recordings."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from bushcli.case import checks
from bushcli.case.finding import Finding, Keys, dotted_key, toml_text, unknown_name, wrong_key
from bushcli.case.loads import PathLoadCase
from bushcli.case.schema import LoadCaseTable, PathTable
from bushcli.errors import RecordingError
from bushcli.recording.source import SixColumns, Source
from bushcli.recording.table_cache import TableCache
from cases.mode import modes
from cases.six import MOTIONS, PAIR_MODES, REACTIONS, SixPath, displacement
from geometry.shape import Shape

if TYPE_CHECKING:
    from bushcli.case.schema_recordings import RecordingTable

PATH = "path"
# mm or rad: a smaller motion counts as none.
SMALLEST = 1e-9


def is_meant(table: LoadCaseTable) -> bool:
    """Whether a load case is, or claims to be, a path of six motions."""
    raw: object = table.path
    return isinstance(raw, dict) or modes()[table.mode].follow is not None


def load_case(
    table: LoadCaseTable, keys: Keys, shape: Shape | None, validated: Callable[..., PathTable | None]
) -> tuple[PathLoadCase | None, list[Finding]]:
    """Return a load case of six motions, and what is wrong with it."""
    at, raw = (*keys, "path"), cast(object, table.path)
    if not isinstance(raw, dict) or modes()[table.mode].follow is None:
        other = "amplitude, file or a list of points"
        if isinstance(raw, dict):
            what = f"{dotted_key(at)} is a table of six motions, and mode {toml_text(table.mode)} has one"
        else:
            what = f"{dotted_key(keys)}: mode {toml_text(table.mode)} has six motions; {other} gives one"
        expected = f'mode = "{PATH}" with a table [load_cases.path], or {other} with another mode'
        return None, [Finding(at if raw is not None else keys, what, expected=expected)]
    earlier = []
    if table.rate is not None:
        what = f"has no meaning: {dotted_key((*at, 'time'))} gives the times"
        earlier.append(wrong_key((*keys, "rate"), what))
    path = validated(raw, at, PathTable, "[load_cases.path]")
    if path is None:
        return None, earlier
    six, findings = prescribed_path(path, at, shape)
    return None if six is None else PathLoadCase(table.mode, steps=table.steps, six=six), earlier + findings


def prescribed_path(
    table: PathTable, keys: Keys, shape: Shape | None
) -> tuple[SixPath | None, list[Finding]]:
    """Return the path of a load case in mm and rad, and what is wrong with it."""
    findings = []
    time = np.array(table.time)
    motion, load = np.zeros((2, len(time), 6))
    free_names = set(table.free or ())
    unit = np.repeat([1.0, math.pi / 180.0], 3)
    given = {name: getattr(table, name) for name in (*MOTIONS, *REACTIONS)}
    columns = {name: values for name, values in given.items() if values is not None}
    for k, (name, force) in enumerate(zip(MOTIONS, REACTIONS, strict=True)):
        prescriptions = [f'"{name}" in {dotted_key((*keys, "free"))}'] if name in free_names else []
        prescriptions += [dotted_key((*keys, key)) for key in (name, force) if key in columns]
        if len(prescriptions) > 1:
            expected = "one of them: a motion is prescribed, or its force is, or it is free of force"
            what = f"{' and '.join(prescriptions)} are given"
            findings.append(Finding((*keys, name if name in columns else force), what, expected=expected))
        motion[:, k] = unit[k] * _at_knots(columns.get(name), (*keys, name), len(time), findings)
        load[:, k] = _at_knots(columns.get(force), (*keys, force), len(time), findings)
    free = tuple(k for k in range(6) if MOTIONS[k] in free_names or REACTIONS[k] in columns)
    if np.any(np.diff(time) <= 0.0) or time[0] != 0.0:
        at, what = (*keys, "time"), "does not begin at 0" if time[0] != 0.0 else "does not increase"
        findings.append(wrong_key(at, what, "increasing times in s, from 0"))
    if findings:
        return None, findings
    if np.abs(motion).max() < SMALLEST and not load.any():
        possible = ", ".join((*MOTIONS, *REACTIONS))
        return None, [wrong_key(keys, "moves nothing", f"give values of at least one of {possible}")]
    findings += _too_far(motion, keys, shape)
    return (None if findings else SixPath(time, motion, free, load=load)), findings


def _too_far(motion: NDArray[np.float64], keys: Keys, shape: Shape | None) -> Iterator[Finding]:
    """Yield findings for motions (n, 6) that go too far, each named by the motion that goes furthest."""
    for number, part in enumerate((slice(0, 2), slice(2, 3), slice(3, 6))):
        # Across the axis, along it, and about.
        size = float(np.linalg.norm(motion[:, part], axis=1).max())
        k = part.start + int(np.argmax(np.abs(motion[:, part]).max(axis=0)))
        yield from checks.too_far((*keys, MOTIONS[k]), shape, *(size * (i == number) for i in range(3)))
    tilt = np.linalg.norm(motion[:, 3:5], axis=1)
    if shape is None or shape.wall is None or not tilt.any():
        return
    ends = np.array([[0.0, 0.0], [0.0, 0.0], [-shape.wall.facing, shape.wall.facing]])
    across = [float(np.linalg.norm(displacement(ends, pose)[:2], axis=0).max()) for pose in motion]
    worst = int(np.argmax(across))
    k = 3 + int(np.argmax(np.abs(motion[worst, 3:5])))
    yield from checks.too_far((*keys, MOTIONS[k]), shape, across[worst], 0.0, float(tilt[worst]))


def _at_knots(
    values: Sequence[float] | None, at: Keys, count: int, findings: list[Finding]
) -> NDArray[np.float64]:
    """Return the values of a motion or a force at the times of a path; zeros without any, or with a finding."""
    if values is None:
        return np.zeros(count)
    if len(values) != count:
        what = f"has {len(values)} values, {dotted_key((*at[:-1], 'time'))} has {count}"
        expected = "give a value for each time"
        findings.append(wrong_key(at, what, expected))
        return np.zeros(count)
    if values[0] != 0.0:
        findings.append(wrong_key(at, f"begins at {values[0]:g}", "0 at the first time, the rest position"))
    return np.array(values)


def channels(
    source: Source, table: RecordingTable, keys: Keys, taken: Sequence[str], tables: TableCache
) -> tuple[list[Source], list[Finding]]:
    """Return the source of a recording, or one for each reaction of a recorded path whose own motion moves.

    Findings say what is wrong with it.
    """
    only = [key for key in ("motions", "forces", "free") if getattr(table, key) is not None]
    if modes()[source.mode].follow is None:
        at = (*keys, only[0] if only else "mode")
        meaningless = wrong_key(at, f"has no meaning for mode {source.mode}", 'mode = "path"')
        return [source], [meaningless] if only else []
    refused = _meaningless_keys(table, keys)
    if refused:
        return [], refused
    # With the readers, which few cases need.
    from bushcli.recording.six import columns_given_by_name, columns_of, read_motions

    free = tuple(k for k, name in enumerate(MOTIONS) if name in (table.free or ()))
    try:
        motions, forces = columns_of(source, table.motions, table.forces, tables)
        by_name = columns_given_by_name(table.motions, table.forces)
        six_columns = SixColumns(motions, free, source.label, by_name)
        _, motion = read_motions(source, six_columns, tables)
    except RecordingError as error:
        return [], [Finding((*keys, "file"), str(error))]
    moves = [k for k in range(6) if np.ptp(motion[:, k]) > SMALLEST]
    # A free motion follows from its reaction, which is zero: it is no measurement.
    paired = [k for k in range(6) if REACTIONS[k] in forces and k in moves and k not in free]
    if not paired:
        what = f"{dotted_key(keys)} has no reaction along a motion in which the sleeve moves"
        pairs = ", ".join(f"{force} with {motion}" for motion, force in zip(MOTIONS, REACTIONS, strict=True))
        return [], [Finding((*keys, "file"), what, expected=f"columns such as ux_mm and fx_N: {pairs}")]
    sources = []
    for k in paired:
        name = f"{source.label}.{REACTIONS[k]}"
        if name in taken:
            at = (*keys, "name")
            return [], [wrong_key(at, f": {name} is the name of another channel")]
        columns = {"displacement": motions[MOTIONS[k]], "force": forces[REACTIONS[k]]}
        if "time" in source.columns:
            columns["time"] = source.columns["time"]
        sources.append(replace(source, mode=PAIR_MODES[k], name=name, columns=columns, six=six_columns))  # type: ignore[arg-type]
    return sources, []


def _meaningless_keys(table: RecordingTable, keys: Keys) -> list[Finding]:
    """Return findings for keys that a recorded path does not take, and for names of no known motion or reaction."""
    findings = []
    for key in ("displacement", "force"):
        for section in ("columns", "units"):
            if getattr(getattr(table, section), key) is not None:
                at = (*keys, section, key)
                expected = (
                    "motions = {ux = ...} and forces = {fx = ...}, with units in the header: ux_mm, mz_Nmm"
                )
                findings.append(wrong_key(at, "has no meaning for mode path", expected))
    for key in ("reverse", "cycles"):
        if getattr(table, key) is not None:
            findings.append(wrong_key((*keys, key), "has no meaning for mode path"))
    named_sections: tuple[tuple[str, Mapping[str, object] | None, tuple[str, ...]], ...] = (
        ("motions", table.motions, MOTIONS),
        ("forces", table.forces, REACTIONS),
    )
    for key, names, names_of_columns in named_sections:
        findings += [
            unknown_name((*keys, key, name), name, names_of_columns, key[:-1])
            for name in names or ()
            if name not in names_of_columns
        ]
    return findings
