"""Results -> files in a folder: result.json, curves as CSV, pictures, report.html. The one place that writes.

Every file is written beside its place and then renamed, so that a reader never sees half of one. A folder
of results may be written again, for parameter sweeps; files of other names in it are left alone. What the
tool would replace but cannot have written itself is refused: an input of the case, and files in a folder that
holds no result of an earlier run.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bushcli.case import Case
from bushcli.diagnosis.result import DiagnosedChannel, Diagnosis
from bushcli.errors import InputError, Problem
from bushcli.inverse import Fit
from bushcli.recording import write_curve_csv
from bushcli.report.quantity import quantities
from bushcli.simulate.meshes import Meshed
from bushcli.simulate.misfit import Misfit
from bushcli.simulate.predict import Response, Simulated
from geometry.errors import GeometryError
from geometry.shape import Shape
from geometry.view import View

RESULT = "result.json"
REPORT = "report.html"
#: The case file that `bushcli mesh PART` writes.
BEGINNING = "case.toml"
# What the name of a curve's file ends with, by command.
_CURVES = {
    "direct": ("", "-comparison"),
    "fit": ("-fit",),
    "inverse": ("-identified",),
    "diagnose": ("-diagnosis",),
}


def write_check(directory: Path, result: Mapping[str, Any], case: Case) -> tuple[Path, ...]:
    """Write what `case_json` returned.

    Raises
    ------
    InputError
        As `write_direct`.
    """
    return _write(directory, {RESULT: _json(result)}, case)


def write_direct(
    directory: Path,
    result: Mapping[str, Any],
    response: Response,
    misfits: Mapping[str, Misfit],
    fit: Fit | None,
) -> tuple[Path, ...]:
    """Write a direct prediction.

    Parameters
    ----------
    directory
        Made if it is not there.
    result
        What `direct_json` returned.
    response, misfits, fit
        As given to `direct_json`.

    Returns
    -------
    tuple of Path
        The files written.

    Raises
    ------
    InputError
        The folder is a file or cannot be written, or a file in the way is not the tool's own.
    """
    from bushcli.report.figures import direct_figures
    from bushcli.report.html import direct_html

    names = file_names([channel.name for channel in response.channels])
    files: dict[str, Callable[[Path], None]] = {RESULT: _json(result)}
    for channel in response.channels:
        name = names[channel.name]
        files[f"{name}.csv"] = _curve(channel)
        if channel.name in misfits:
            files[f"{name}-comparison.csv"] = _comparison(channel, misfits[channel.name])
    pictures = direct_figures(response, misfits, fit, names)
    for picture in pictures:
        files[f"{picture.name}.png"] = _bytes(picture.png)
        files[f"{picture.name}.svg"] = _bytes(picture.svg)
    files[REPORT] = _text(direct_html(result, response, misfits, fit, pictures))
    return _write(directory, files, response.case)


def write_fit(directory: Path, result: Mapping[str, Any], case: Case, fit: Fit) -> tuple[Path, ...]:
    """Write an identified law: result.json, a CSV with recorded and fitted stress per coupon, picture, report.

    Raises
    ------
    InputError
        As `write_direct`.
    """
    from bushcli.report.figures import fit_figures
    from bushcli.report.html import fit_html

    names = file_names([curve.name for curve in fit.curves])
    files: dict[str, Callable[[Path], None]] = {RESULT: _json(result)}
    for curve in fit.curves:
        shown = quantities(curve.recording.mode)
        q, force = shown.csv_names
        files[f"{names[curve.name]}-fit.csv"] = _table(
            (q, f"recorded_{force}", f"fitted_{force}"),
            (shown.shown(curve.recording.displacement), curve.recording.force, curve.fitted.force),
        )
    pictures = fit_figures(fit)
    for picture in pictures:
        files[f"{picture.name}.png"] = _bytes(picture.png)
        files[f"{picture.name}.svg"] = _bytes(picture.svg)
    files[REPORT] = _text(fit_html(result, case, fit, pictures))
    return _write(directory, files, case)


def write_inverse(
    directory: Path, result: Mapping[str, Any], case: Case, fits: Sequence[Fit]
) -> tuple[Path, ...]:
    """Write identified laws, best first: result.json, a CSV of the best one's curve per channel, pictures, report.

    Raises
    ------
    InputError
        As `write_direct`.
    """
    from bushcli.inverse.door import at_door
    from bushcli.report.cycles import fit_histories
    from bushcli.report.figures.cycles import history_figures
    from bushcli.report.figures.identification import inverse_figures
    from bushcli.report.identification_html import inverse_html

    fits = [at_door(fit) for fit in fits]
    best = fits[0]
    names = file_names([curve.name for curve in best.curves])
    files: dict[str, Callable[[Path], None]] = {RESULT: _json(result)}
    for curve in best.curves:
        shown = quantities(curve.recording.mode)
        q, force = shown.csv_names
        heads = [q, f"recorded_{force}", f"{'predicted' if curve.held_out else 'fitted'}_{force}"]
        columns = [shown.shown(curve.recording.displacement), curve.recording.force, curve.fitted.force]
        if curve.started is not None:
            heads.append(f"started_{force}")
            columns.append(curve.started.force)
        files[f"{names[curve.name]}-identified.csv"] = _table(heads, columns)
    pictures = (*inverse_figures(fits, names), *history_figures(fit_histories(best), names))
    for picture in pictures:
        files[f"{picture.name}.png"] = _bytes(picture.png)
        files[f"{picture.name}.svg"] = _bytes(picture.svg)
    files[REPORT] = _text(inverse_html(result, case, fits, pictures))
    return _write(directory, files, case)


def write_diagnosis(directory: Path, result: Mapping[str, Any], found: Diagnosis) -> tuple[Path, ...]:
    """Write a diagnosis: result.json, a CSV of the curves per channel, maps for ParaView, pictures, report.

    Raises
    ------
    InputError
        As `write_direct`.
    """
    from bushcli.report.diagnosis_field import map_vtu
    from bushcli.report.diagnosis_html import diagnosis_html
    from bushcli.report.figures.diagnosis import diagnosis_figures

    names = file_names([*(one.name for one in found.channels), *(one.name for one in found.maps)])
    files: dict[str, Callable[[Path], None]] = {RESULT: _json(result)}
    for channel in found.channels:
        missing = None if found.missing is None else found.missing.force.get(channel.name)
        files[f"{names[channel.name]}-diagnosis.csv"] = _diagnosed(channel, missing)
    for one in found.maps:
        files[f"{names[one.name]}-bushing-map.vtu"] = _text(map_vtu(one))
    pictures = diagnosis_figures(found, names)
    for picture in pictures:
        files[f"{picture.name}.png"] = _bytes(picture.png)
        files[f"{picture.name}.svg"] = _bytes(picture.svg)
    files[REPORT] = _text(diagnosis_html(result, found, pictures))
    return _write(directory, files, found.case)


def write_meshes(
    directory: Path,
    meshes: Sequence[Meshed],
    result: Mapping[str, Any] | None = None,
    shape: Shape | None = None,
) -> tuple[Path, ...]:
    """Write a picture of each mesh, as PNG and SVG, one of what was found in a file, and result.json.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    from bushcli.report.figures import mesh_figures

    files: dict[str, Callable[[Path], None]] = {} if result is None else {RESULT: _json(result)}
    if shape is not None and shape.view is not None:
        files |= _geometry(shape.view, "What was taken for what", shape.measures())
    for picture in mesh_figures(meshes):
        files[f"{picture.name}.png"] = _bytes(picture.png)
        files[f"{picture.name}.svg"] = _bytes(picture.svg)
    return _write(directory, files, None)


def write_refused(directory: Path, error: GeometryError) -> tuple[Path, ...]:
    """Write a picture of a geometry that was refused, where there is something to see.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    return () if error.view is None else _write(directory, _geometry(error.view, str(error), {}), None)


def write_beginning(directory: Path, case: str) -> tuple[Path, ...]:
    """Write a case file to begin with, unless there is one: somebody may have worked on it.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    return () if (directory / BEGINNING).exists() else _write(directory, {BEGINNING: _text(case)}, None)


def _geometry(view: View, title: str, measures: Mapping[str, float]) -> dict[str, Callable[[Path], None]]:
    from bushcli.report.figures.geometry import geometry_figure
    from bushcli.report.figures.picture import picture

    shown = picture("geometry", "geometry", title, geometry_figure(view, title, measures))
    return {"geometry.png": _bytes(shown.png), "geometry.svg": _bytes(shown.svg)}


def check_output(directory: Path, case: Case, command: str = "direct") -> None:
    """Refuse a folder before anything is computed for it by a command.

    Raises
    ------
    InputError
        It is a file, or lies below one, or cannot be written to; or a result would replace an input of the case.
    """
    existing = next(path for path in (directory, *directory.absolute().parents) if path.exists())
    if not existing.is_dir():
        raise InputError(Problem(str(existing), "is a file", "", "a folder for the results"))
    if not os.access(existing, os.W_OK | os.X_OK):
        raise InputError(Problem(str(existing), "is not writable", "", "another -o"))
    channels = [source.label for source in (case.coupons if command == "fit" else case.recordings)]
    if command == "direct":
        channels = [load.mode for load in case.load_cases] + channels
    endings = _CURVES.get(command, ())
    curves = [f"{name}{ending}.csv" for name in file_names(channels).values() for ending in endings]
    _refuse_others(directory, [RESULT, REPORT, *curves], case)


def file_names(channels: Iterable[str]) -> dict[str, str]:
    """Return channel -> a name for its files: nothing in it leaves the folder or troubles a file system."""
    names: dict[str, str] = {}
    for channel in dict.fromkeys(channels):
        safe = re.sub(r"[^\w.-]+", "_", channel).strip("._-")[:100] or "channel"
        number, name = 1, safe
        while name.casefold() in {taken.casefold() for taken in names.values()}:
            number += 1
            name = f"{safe}_{number}"
        names[channel] = name
    return names


def _write(
    directory: Path, files: Mapping[str, Callable[[Path], None]], case: Case | None
) -> tuple[Path, ...]:
    if directory.exists() and not directory.is_dir():
        raise InputError(Problem(str(directory), "is a file", "", "a folder for the results"))
    if case is not None:
        _refuse_others(directory, files, case)
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for name, write in files.items():
            _replace(directory / name, write)
    except OSError as error:
        place = str(error.filename or directory)
        raise InputError(Problem(place, f"cannot be written: {error.strerror or error}")) from None
    return tuple(directory / name for name in files)


def _refuse_others(directory: Path, files: Iterable[str], case: Case) -> None:
    """Refuse to replace inputs of the case, or anything in a folder that holds no earlier result."""
    inputs = [case.path, *(source.file for source in (*case.recordings, *case.coupons))]
    inputs += [load.source.file for load in case.load_cases if load.source is not None]
    read = {path.resolve() for path in inputs}
    there = [directory / name for name in files if (directory / name).exists()]
    lost = [path for path in there if path.resolve() in read]
    if lost:
        raise InputError(
            *(
                Problem(str(path), "is an input of the case, and a result would replace it", "", "another -o")
                for path in lost
            )
        )
    if there and not (directory / RESULT).exists():
        raise InputError(
            *(
                Problem(
                    str(path),
                    "is there already, and not by an earlier run (the folder has no result.json)",
                    "",
                    "another -o",
                )
                for path in there
            )
        )


def _replace(path: Path, write: Callable[[Path], None]) -> None:
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        write(part)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _json(result: Mapping[str, Any]) -> Callable[[Path], None]:
    return _text(json.dumps(result, indent=2, allow_nan=False) + "\n")


def _text(content: str) -> Callable[[Path], None]:
    return _bytes(content.encode())


def _bytes(content: bytes) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        path.write_bytes(content)

    return write


def _curve(channel: Simulated) -> Callable[[Path], None]:
    return lambda path: write_curve_csv(path, channel.curve)


def _comparison(channel: Simulated, found: Misfit) -> Callable[[Path], None]:
    """Recorded and simulated force at the recorded displacements, in the order of the recording."""
    shown = quantities(channel.mode)
    q, force = shown.csv_names
    return _table(
        (q, f"recorded_{force}", f"simulated_{force}"),
        (shown.shown(found.displacement), found.simulated - found.difference, found.simulated),
    )


def _diagnosed(
    channel: DiagnosedChannel, missing: np.ndarray[Any, Any] | None = None
) -> Callable[[Path], None]:
    """Recorded force, that of the plain law and of the most probable model, what is missing, which samples are faulty.

    With the time where there is one.
    """
    shown = quantities(channel.mode)
    q, force = shown.csv_names
    recorded = channel.recording
    names = [q, f"recorded_{force}", f"plain_{force}", f"final_{force}"]
    columns = [shown.shown(recorded.displacement), recorded.force, channel.before, channel.after]
    if missing is not None:
        names, columns = [*names, f"missing_{force}"], [*columns, missing]
    names, columns = [*names, "faulty"], [*columns, channel.faulty.astype(float)]
    if recorded.time is not None:
        names, columns = ["time_s", *names], [recorded.time, *columns]
    return _table(names, columns)


def _table(names: Sequence[str], columns: Sequence[np.ndarray[Any, Any]]) -> Callable[[Path], None]:
    rows = "".join(",".join(f"{value:.12g}" for value in row) + "\n" for row in np.column_stack(columns))
    return _text(",".join(names) + "\n" + rows)
