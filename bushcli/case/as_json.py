"""Parts of a case as JSON-ready data, with the keys and units of the case file."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

from bushcli.recording.source import Source
from cases.mode import modes
from cases.six import MOTIONS, REACTIONS, SixPath


def twelve_digits(value: float) -> float:
    """Return a number with twelve digits: 30 degrees must not come back as 29.999999999999996."""
    return float(f"{value:.12g}")


def in_degrees(value: float, rotational: bool) -> float:
    """Return a displacement or a rate as the case file has it: of a rotation in degrees.

    Parameters
    ----------
    value : float
        mm, rad, mm/s or rad/s.
    rotational : bool
        Whether it is of a rotation.
    """
    return twelve_digits(math.degrees(value) if rotational else value)


def path_json(path: SixPath) -> dict[str, Any]:
    """Return a path of six motions: its times, the motions that move, the loads, and what is free."""
    shown: dict[str, Any] = {"time": path.time.tolist()}
    for k, name in enumerate(MOTIONS):
        if k not in path.free and path.motion[:, k].any():
            shown[name] = [in_degrees(value, k >= 3) for value in path.motion[:, k]]
    shown |= {REACTIONS[k]: path.loads[:, k].tolist() for k in path.loaded}
    free = [MOTIONS[k] for k in path.free if k not in path.loaded]
    return shown | ({"free": free} if free else {})


def source_json(source: Source, folder: Path) -> dict[str, Any]:
    """Return a source of a case in the folder; keys that few sources have are left out where they are not given."""
    rotational = source.mode in modes() and modes()[source.mode].rotational
    six = source.six
    rarer = {
        "branch": source.branch,
        "largest_stretch": source.largest_stretch,
        "group": source.group,
        "rows": dict(source.rows) or None,
        "sample_rate": source.sample_rate,
        "rate": source.rate and in_degrees(source.rate, rotational),
        "conditioning": source.conditioning or None,
        "standard": source.standard,
        "temperature": source.temperature,
        **vars(source.specimen),
        "path": six and {"motions": dict(six.motions), "free": [MOTIONS[k] for k in six.free]},
    }
    columns: dict[Any, Any] = dict(source.columns)
    units: dict[Any, Any] = dict(source.units)
    if source.temperature_column is not None:
        columns["temperature"] = source.temperature_column
    if source.temperature_unit:
        units["temperature"] = source.temperature_unit
    return {
        "mode": source.mode,
        "file": relative(source.file, folder),
        "name": source.label,
        "columns": columns,
        "units": units,
        "delimiter": source.delimiter,
        "decimal": source.decimal,
        "reverse": None if source.reverse is None else list(source.reverse),
        "cycles": list(source.cycles) if source.cycles else None,
        "accept": [*source.accept, *source.accepted_faults] or None,
        **{key: value for key, value in rarer.items() if value is not None},
    }


def relative_name(file: Path, folder: Path) -> str:
    """Return the name of a file as a case file in the folder has it."""
    return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()


def relative(file: Path, folder: Path) -> str:
    """Return a file's name relative to the folder where it lies below it."""
    below = os.path.relpath(file, folder)
    # A file given with its whole path, outside the case's folder, keeps that path.
    return str(file) if below.startswith("..") and file.is_absolute() else Path(below).as_posix()
