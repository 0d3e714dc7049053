"""Results -> files in a folder: result.json, curves as CSV, pictures, report.html. Only these modules write results.

A folder of results may be written again, for parameter sweeps; files with other names are left alone. A file that
bushcli did not write is never replaced; the command is refused (`bushcli.report.folder`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
    InputError
        As `write_direct`.
    """
    return _write(directory, {RESULT: result}, case)


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
    """
    from bushcli.report.figures import direct_figures
    from bushcli.report.html import direct_html

    names = file_names([channel.name for channel in response.channels])
    files: dict[str, Content] = {RESULT: result}
    for channel in response.channels:
        name = names[channel.name]
        files[f"{name}.csv"] = curve_table(channel)
        if channel.name in misfits:
            files[f"{name}-comparison.csv"] = comparison_table(channel, misfits[channel.name])
    pictures = direct_figures(response, misfits, fit, names)
    files |= drawn(pictures)
    files[REPORT] = text_file(direct_html(result, response, misfits, fit, pictures))
    return _write(
        directory, files, response.case, [f"{name}{end}" for name in names.values() for end in FIELDS]
    )


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
    InputError
        As `write_direct`.
    """
    from bushcli.report.figures import fit_figures
    from bushcli.report.html import fit_html

    names = file_names([curve.name for curve in fit.curves])
    files: dict[str, Content] = {RESULT: result}
    for curve in fit.curves:
        shown = quantities(curve.recording.mode)
        q, force = shown.csv_names
        files[f"{names[curve.name]}-fit.csv"] = number_table(
            (q, f"recorded_{force}", f"fitted_{force}"),
            (shown.shown(curve.recording.displacement), curve.recording.force, curve.fitted.force),
        )
    pictures = fit_figures(fit)
    files |= drawn(pictures)
    files[REPORT] = text_file(fit_html(result, case, fit, pictures))
    return _write(directory, files, case)


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
    InputError
        As `write_direct`.
    """
    from bushcli.inverse.file_units import in_file_units
    from bushcli.report.cycles import fit_histories
    from bushcli.report.figures.cycles import history_figures
    from bushcli.report.figures.identification import inverse_figures
    from bushcli.report.identification_html import inverse_html

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
    pictures = (*inverse_figures(fits, names), *history_figures(fit_histories(best), names))
    files |= drawn(pictures)
    files[REPORT] = text_file(inverse_html(result, case, fits, pictures))
    return _write(directory, files, case)


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
    InputError
        As `write_direct`.
    """
    from bushcli.report.diagnosis_field import map_vtu
    from bushcli.report.diagnosis_html import diagnosis_html
    from bushcli.report.figures.diagnosis import diagnosis_figures

    names = file_names([*(one.name for one in found.channels), *(one.name for one in found.maps)])
    files: dict[str, Content] = {RESULT: result}
    for channel in found.channels:
        missing = None if found.missing is None else found.missing.force.get(channel.name)
        files[f"{names[channel.name]}-diagnosis.csv"] = diagnosed_table(channel, missing)
    for one in found.maps:
        files[f"{names[one.name]}-bushing-map.vtu"] = text_file(map_vtu(one))
    pictures = diagnosis_figures(found, names)
    files |= drawn(pictures)
    files[REPORT] = text_file(diagnosis_html(result, found, pictures))
    return _write(directory, files, found.case)


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
    """Return the files that a case reads."""
    if case is None:
        return []
    inputs = [case.path, *(source.file for source in (*case.recordings, *case.coupons))]
    return inputs + [load.source.file for load in case.load_cases if load.source is not None]


def _write(
    directory: Path, files: Mapping[str, Content], case: Case | None, beside: Iterable[str] = ()
) -> tuple[Path, ...]:
    return write_files(directory, files, inputs_of(case), beside)
