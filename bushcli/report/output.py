"""Results -> files in a folder: result.json, curves as CSV, pictures, report.html. Only these modules write results.

The numbers are written before anything is drawn. What becomes of an earlier result in the folder, and of files that
bushcli did not write, is decided in `bushcli.report.folder`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bushcli.case import resolved
from bushcli.report.contents import (
    comparison_table,
    curve_table,
    diagnosed_table,
    drawn,
    number_table,
    text_file,
)
from bushcli.report.folder import RESULT, Content, check_folder, refuse_others, write_files
from bushcli.report.quantity import quantities
from bushcli.runtime.names import file_names
from bushcli.runtime.store import code_revision

if TYPE_CHECKING:
    from bushcli.case import Case
    from bushcli.diagnosis.result import Diagnosis
    from bushcli.inverse import Fit
    from bushcli.simulate.misfit import Misfit
    from bushcli.simulate.response import Response

REPORT = "report.html"
#: The designs of a study.
DESIGNS = "designs.parquet"
#: Endings of field files.
FIELDS = (".xdmf", ".h5")
# Options that change how a command works, but not what it finds.
_HOW = frozenset({"workers", "scheduler", "resume", "strict", "no_fields"})
# Ending of the name of a curve's file, by command.
_CURVES = {
    "direct": ("", "-comparison"),
    "fit": ("-fit",),
    "inverse": ("-identified",),
    "diagnose": ("-diagnosis",),
}


def write_check(directory: Path, result: Mapping[str, Any], case: Case) -> tuple[Path, ...]:
    """Write the result of `check`.

    Parameters
    ----------
    directory : Path
        Folder for the result; created if necessary.
    result : mapping of str to object
        What `case_json` returned.
    case : Case
        The validated case, whose input files are not replaced.

    Raises
    ------
    InputError, NotDrawn
        As `write_direct`.
    """
    return write_files(directory, {RESULT: result}, inputs_of(case))


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
        Created if necessary.
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
        The folder is a file or cannot be written, or a file to be replaced is not bushcli's.
    NotDrawn
        Everything is written but the pictures and the page.
    """
    names = file_names([channel.name for channel in response.channels])
    files: dict[str, Content] = {RESULT: result}
    for channel in response.channels:
        name = names[channel.name]
        files[f"{name}.csv"] = curve_table(channel)
        if channel.name in misfits:
            files[f"{name}-comparison.csv"] = comparison_table(channel, misfits[channel.name])

    def draw() -> dict[str, Content]:
        from bushcli.report.drawing.results import direct_figures
        from bushcli.report.html import direct_html

        pictures = direct_figures(response, misfits, fit, names)
        return drawn(pictures) | {REPORT: text_file(direct_html(result, response, misfits, fit, pictures))}

    fields = [f"{name}{end}" for name in names.values() for end in FIELDS]
    return write_files(directory, files, inputs_of(response.case), fields, draw)


def write_fit(directory: Path, result: Mapping[str, Any], case: Case, fit: Fit) -> tuple[Path, ...]:
    """Write an identified law: result.json, a CSV with recorded and fitted stress per coupon, picture, report.

    Parameters
    ----------
    directory : Path
        Folder for the result; created if necessary.
    result : mapping of str to object
        What `fit_json` returned.
    case : Case
        The validated case, whose input files are not replaced.
    fit : Fit
        The identified law.

    Raises
    ------
    InputError, NotDrawn
        As `write_direct`.
    """
    names = file_names([curve.name for curve in fit.curves])
    files: dict[str, Content] = {RESULT: result}
    for curve in fit.curves:
        shown = quantities(curve.recording.mode)
        q, force = shown.csv_names
        files[f"{names[curve.name]}-fit.csv"] = number_table(
            (q, f"recorded_{force}", f"fitted_{force}"),
            (shown.shown(curve.recording.displacement), curve.recording.force, curve.fitted.force),
        )

    def draw() -> dict[str, Content]:
        from bushcli.report.drawing.results import fit_figures
        from bushcli.report.html import fit_html

        pictures = fit_figures(fit)
        return drawn(pictures) | {REPORT: text_file(fit_html(result, case, fit, pictures))}

    return write_files(directory, files, inputs_of(case), drawn=draw)


def write_inverse(
    directory: Path, result: Mapping[str, Any], case: Case, fits: Sequence[Fit]
) -> tuple[Path, ...]:
    """Write identified laws, best first: result.json, a CSV of the best one's curve per channel, pictures, report.

    Parameters
    ----------
    directory : Path
        Folder for the result; created if necessary.
    result : mapping of str to object
        What `inverse_json` returned.
    case : Case
        The validated case, whose input files are not replaced.
    fits : sequence of Fit
        Identified laws, the best first.

    Raises
    ------
    InputError, NotDrawn
        As `write_direct`.
    """
    from bushcli.inverse.file_units import in_file_units

    fits = [in_file_units(fit) for fit in fits]
    best = fits[0]
    names = file_names([curve.name for curve in best.curves])
    files: dict[str, Content] = {RESULT: result}
    for curve in best.curves:
        shown = quantities(curve.recording.mode)
        q, force = shown.csv_names
        heads = [q, f"recorded_{force}", f"{'predicted' if curve.held_out else 'fitted'}_{force}"]
        columns = [shown.shown(curve.recording.displacement), curve.recording.force, curve.fitted.force]
        if curve.started is not None:
            heads.append(f"started_{force}")
            columns.append(curve.started.force)
        files[f"{names[curve.name]}-identified.csv"] = number_table(heads, columns)

    def draw() -> dict[str, Content]:
        from bushcli.report.cycles import fit_histories
        from bushcli.report.drawing.results import history_figures, inverse_figures
        from bushcli.report.identification_html import inverse_html

        pictures = (*inverse_figures(fits, names), *history_figures(fit_histories(best), names))
        return drawn(pictures) | {REPORT: text_file(inverse_html(result, case, fits, pictures))}

    return write_files(directory, files, inputs_of(case), drawn=draw)


def write_diagnosis(directory: Path, result: Mapping[str, Any], found: Diagnosis) -> tuple[Path, ...]:
    """Write a diagnosis: result.json, a CSV of the curves per channel, maps for ParaView, pictures, report.

    Parameters
    ----------
    directory : Path
        Folder for the result; created if necessary.
    result : mapping of str to object
        What `diagnosis_json` returned.
    found : Diagnosis
        The diagnosis.

    Raises
    ------
    InputError, NotDrawn
        As `write_direct`.
    """
    from bushcli.report.diagnosis_field import map_vtu

    names = file_names([*(one.name for one in found.channels), *(one.name for one in found.maps)])
    files: dict[str, Content] = {RESULT: result}
    for channel in found.channels:
        missing = None if found.missing is None else found.missing.force.get(channel.name)
        files[f"{names[channel.name]}-diagnosis.csv"] = diagnosed_table(channel, missing)
    for one in found.maps:
        files[f"{names[one.name]}-bushing-map.vtu"] = text_file(map_vtu(one))

    def draw() -> dict[str, Content]:
        from bushcli.report.diagnosis_html import diagnosis_html
        from bushcli.report.drawing.results import diagnosis_figures

        pictures = diagnosis_figures(found, names)
        return drawn(pictures) | {REPORT: text_file(diagnosis_html(result, found, pictures))}

    return write_files(directory, files, inputs_of(found.case), drawn=draw)


def check_output(directory: Path, case: Case, command: str = "direct") -> None:
    """Refuse an unusable output folder before a command computes anything.

    Parameters
    ----------
    directory : Path
        Folder for the result.
    case : Case
        The validated case, whose input files are not replaced.
    command : str
        Name of the command, from which the names of its files follow.

    Raises
    ------
    InputError
        The folder is a file, lies below one or cannot be written to, or the result would replace a file that is not
        bushcli's.
    """
    check_folder(directory)
    channels = [source.label for source in (case.coupons if command == "fit" else case.recordings)]
    if command == "direct":
        channels = [name for name, _ in case.channels]
    endings = [f"{ending}.csv" for ending in _CURVES.get(command, ())]
    endings += [".xdmf", ".h5"] if command == "direct" else []
    curves = [f"{name}{ending}" for name in file_names(channels).values() for ending in endings]
    meshes = (
        [file.name for file in directory.glob("mesh-*") if file.suffix in FIELDS] if command == "mesh" else []
    )
    designs = [DESIGNS] if command == "study" else []
    refuse_others(directory, [RESULT, REPORT, *designs, *curves, *meshes], inputs_of(case))


def inputs_of(case: Case | None) -> list[Path]:
    """Return the files that a case reads, the case file first."""
    return [] if case is None else [case.path, *case.files]


def question_of(command: str, case: Case, options: Mapping[str, Any]) -> str:
    """Return a digest of what determines the result of a command: case, contents of its files, options, program.

    Parameters
    ----------
    command : str
    case : Case
    options : mapping of str to object
        Of the command; those that only say how it works (`--workers`, `--resume`, ...) do not count.
    """
    asked = {name: value for name, value in options.items() if name not in _HOW}
    shown = {key: value for key, value in resolved(case).items() if key != "path"}
    read = [
        value.read_text(errors="replace")
        for value in asked.values()
        if isinstance(value, Path) and value.is_file()
    ]
    data = [command, shown, case.data_digest(), asked, read, code_revision()]
    return hashlib.sha256(json.dumps(data, sort_keys=True, default=str).encode()).hexdigest()[:32]
