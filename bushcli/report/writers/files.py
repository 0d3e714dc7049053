"""Results -> the files of a folder: numbers, pictures, the page; the numbers are written before anything is drawn.

What becomes of an earlier result in the folder, and of files that bushcli did not write, is decided in
`bushcli.report.writers.folder`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bushcli.case import case_json
from bushcli.case.identified import IDENTIFIED, IDENTIFYING, identified_case
from bushcli.recording import write_curve_csv
from bushcli.report.writers import folder, tables
from bushcli.runtime.names import file_names
from bushcli.runtime.store import code_revision

if TYPE_CHECKING:
    from bushcli.case import Case
    from bushcli.diagnosis.result import Diagnosis
    from bushcli.inverse import FittedCurve
    from bushcli.report import results
    from bushcli.report.document import Document, Panels, Picture
    from bushcli.simulate.dynamic_tables import ComparedTable
    from bushcli.study.batch import Batch
    from bushcli.study.compare import Comparison
    from bushcli.study.design import Design
    from geometry.errors import GeometryError

REPORT = "report.html"
#: The designs of a study.
DESIGNS = "designs.parquet"
#: The differences of a comparison.
DIFFERENCES = "differences.csv"
#: The parts of a batch.
PARTS = "parts.csv"
#: The case file that `bushcli mesh PART` writes.
BEGINNING = "case.toml"
#: Folder beside a result for the picture of a geometry that was refused: the result keeps its own.
REFUSED = "refused-mesh"
#: Endings of field files.
FIELDS = (".xdmf", ".h5")

# Options that change how a command works, but not what it finds.
_HOW = frozenset({"workers", "scheduler", "resume", "strict", "no_fields"})
# Ending of the name of a curve's file, by command.
_CURVES = {
    "direct": (".csv", "-comparison.csv", *FIELDS),
    "fit": ("-fit.csv",),
    "inverse": ("-identified.csv",),
    "diagnose": ("-diagnosis.csv",),
    "dynamic": ("-dynamic.csv",),
}


@dataclass(frozen=True)
class Files:
    """What is written of a result, besides result.json."""

    case: Case | None  # its files are never replaced
    contents: Mapping[str, folder.Content] = field(
        default_factory=dict
    )  # by file name: numbers, written first
    fields: Sequence[str] = ()  # files that were written while the command calculated
    pictures: Callable[[], Iterable[Panels | Picture]] | None = None  # and plots to be drawn as pictures
    has_page: bool = True


def write(
    directory: Path, result: Mapping[str, Any], files: Files, document: Callable[[], Document]
) -> tuple[Path, ...]:
    """Write a result: its JSON and numbers, and when they are on disk its pictures and its page.

    Parameters
    ----------
    directory : Path
        Folder for the result; created if necessary.
    result : mapping of str to object
        The result as JSON-ready data.
    files : Files
        Everything else that is written.
    document : callable
        Returns the document of the result.

    Raises
    ------
    NotDrawn
        Everything is written but the pictures and the page.
    """

    def draw() -> dict[str, folder.Content]:
        pictures = _report("drawing.results").pictures_of(files.pictures()) if files.pictures else ()
        written = picture_files(pictures)
        if files.has_page:
            page = _report("writers.page").page
            written[REPORT] = page(document(), result, pictures, inputs_of(files.case))
        return written

    contents: dict[str, folder.Content] = {folder.RESULT: result}
    if files.case is not None and result["command"] in IDENTIFYING:
        carried = identified_case(files.case, result, directory)
        contents |= {IDENTIFIED: carried} if carried else {}
    draws = draw if files.pictures or files.has_page else None
    return folder.write_files(
        directory, {**contents, **files.contents}, inputs_of(files.case), files.fields, draws
    )


def _report(module: str) -> Any:
    """Return a module of the report: what draws is loaded when something is drawn, and not for other results."""
    return import_module(f"bushcli.report.{module}")


def check_files(result: results.CheckResult) -> Files:
    """Return the files of a checked case: result.json alone."""
    return Files(result.case, has_page=False)


def mesh_files(result: results.MeshResult) -> Files:
    """Return the files of meshes: a picture of each, and of the interpretation of a geometry file."""
    return Files(
        None,  # a part has no case file: the one that is written to start from is not an input
        fields=[f"mesh-{mesh.name}{end}" for mesh in result.meshes for end in FIELDS],
        pictures=lambda: _report("drawing.results").mesh_pictures(result.case.geometry, result.meshes),
        has_page=False,
    )


def direct_files(result: results.DirectResult) -> Files:
    """Return the files of a direct prediction: per channel its curve, its comparison and its fields."""
    curves, compared = [channel.name for channel in result.response.channels], result.tables or ()
    names = file_names([*curves, *(table.table.name for table in compared)])
    contents = _table_files(compared, names)
    for channel in result.response.channels:
        name = names[channel.name]
        contents[f"{name}.csv"] = (
            partial(write_curve_csv, curve=channel.curve)
            if channel.six is None
            else tables.six_table(channel.six)
        )
        if (misfit := result.misfits.get(channel.name)) is not None:
            # At the recorded displacements, in the order of the recording.
            forces = {"recorded": misfit.simulated - misfit.difference, "simulated": misfit.simulated}
            columns = tables.forces(channel.mode, misfit.displacement, forces)
            contents[f"{name}-comparison.csv"] = tables.number_table(columns)
    return Files(
        result.response.case,
        contents,
        [f"{names[name]}{end}" for name in curves for end in FIELDS],
        lambda: _report("drawing.results").direct_pictures(result, names),
    )


def _table_files(compared: Iterable[ComparedTable], names: Mapping[str, str]) -> dict[str, folder.Content]:
    return {f"{names[table.table.name]}-table.csv": tables.compared_table(table) for table in compared}


def fit_files(result: results.FitResult) -> Files:
    """Return the files of a fit: recorded and fitted stress of each coupon, and the master curve of each table."""
    from bushcli.inverse.coupon_tables import TableSpectrum

    fit, spectra = result.fit, result.spectra
    curves = () if fit is None else fit.curves
    tested = dict.fromkeys(spectrum.table.name for spectrum in spectra)
    names, plots = file_names([*(curve.name for curve in curves), *tested]), "plots.spectrum"
    contents = {f"{names[curve.name]}-fit.csv": _fit_table(curve, "fitted") for curve in curves}
    for spectrum in spectra:
        if isinstance(spectrum, TableSpectrum):
            columns = _report(plots).master_columns(spectrum)
            contents[f"{names[spectrum.table.name]}-master.csv"] = tables.number_table(columns)

    def pictures() -> list[Panels]:
        of_law = [] if fit is None else [_report("plots.fit").fit_panels(fit)]
        return [*of_law, *(_report(plots).table_panels(table, names[table.table.name]) for table in spectra)]

    return Files(result.case, contents, pictures=pictures)


def inverse_files(result: results.InverseResult) -> Files:
    """Return the files of identified laws: for each channel the recorded curve and that of the best law."""
    best = result.best_fit
    names = file_names([*(curve.name for curve in best.curves), *(table.table.name for table in best.tables)])
    contents = _table_files(best.tables, names)
    for curve in best.curves:
        how = "predicted" if curve.held_out else "fitted"
        contents[f"{names[curve.name]}-identified.csv"] = _fit_table(curve, how, start=True)
    return Files(result.case, contents, pictures=lambda: _report("plots.fit").inverse_panels(result, names))


def _fit_table(curve: FittedCurve, how: str, start: bool = False) -> str:
    """Return recorded and fitted force, and on demand that at the start of the search, where it is known."""
    forces = {"recorded": curve.recording.force, how: curve.fitted.force}
    if start and curve.started is not None:
        forces["started"] = curve.started.force
    return tables.number_table(tables.forces(curve.recording.mode, curve.recording.displacement, forces))


def diagnosis_files(diagnosis: Diagnosis) -> Files:
    """Return the files of a diagnosis: the curves of each channel, and maps of the bushing for ParaView."""
    names = file_names([item.name for item in (*diagnosis.measured_channels, *diagnosis.maps)])
    contents = _table_files([table.compared for table in diagnosis.tables], names)
    for channel in diagnosis.channels:
        recorded = channel.recording
        forces = {"recorded": recorded.force, "plain": channel.before, "final": channel.after}
        if diagnosis.missing is not None and channel.name in diagnosis.missing.force:
            forces["missing"] = diagnosis.missing.force[channel.name]
        columns = {} if recorded.time is None else {"time_s": recorded.time}
        columns |= tables.forces(recorded.mode, recorded.displacement, forces)
        columns["faulty"] = channel.faulty.astype(float)
        contents[f"{names[channel.name]}-diagnosis.csv"] = tables.number_table(columns)
    for local_map in diagnosis.maps:
        contents[f"{names[local_map.name]}-bushing-map.vtu"] = tables.map_vtu(local_map)
    draw = "drawing.results"
    return Files(
        diagnosis.case, contents, pictures=lambda: _report(draw).diagnosis_pictures(diagnosis, names)
    )


def dynamic_files(result: results.DynamicResult) -> Files:
    """Return the files of dynamic stiffness: a table of each load case, a row for each preload and frequency."""
    curves = result.response.curves
    names = file_names(dict.fromkeys(curve.name for curve in curves))
    contents = {
        f"{file}-dynamic.csv": tables.dynamic_table([curve for curve in curves if curve.name == name])
        for name, file in names.items()
    }
    plots = "plots.dynamic"
    return Files(
        result.response.case, contents, pictures=lambda: _report(plots).dynamic_panels(curves, names)
    )


def study_files(result: results.StudyResult) -> Files:
    """Return the files of a study: its designs as Parquet."""
    study, rows = result.study, {DESIGNS: result.write_rows}
    return Files(study.case, rows, pictures=lambda: _report("plots.study").study_panels(study))


def design_files(design: Design) -> Files:
    """Return the files of a design: its page."""
    return Files(design.case)


def batch_files(batch: Batch) -> Files:
    """Return the files of a batch: a row for each part, and the mean curve of each mode with its band."""
    contents = {PARTS: tables.part_table(batch)}
    for curve in batch.curves:
        contents[f"{curve.mode}-mean.csv"], contents[f"{curve.mode}-band.csv"] = tables.mean_tables(curve)
    return Files(batch.case, contents, pictures=lambda: _report("plots.curves").batch_panels(batch))


def compare_files(comparison: Comparison) -> Files:
    """Return the files of a comparison: its page and pictures, the differences as CSV."""
    contents = {DIFFERENCES: tables.difference_table(comparison)}
    return Files(None, contents, pictures=lambda: _report("plots.curves").compare_panels(comparison))


def write_refused(directory: Path, error: GeometryError) -> tuple[Path, ...]:
    """Write a picture of a geometry that was refused, if the error has a view of it.

    Parameters
    ----------
    directory : Path
        Folder for the picture, created if necessary; if it holds a result, `REFUSED` in it.
    error : GeometryError
        The error, whose message becomes the title.
    """
    if error.view is None:
        return ()
    if folder.earlier_result(directory) is not None:
        directory = directory / REFUSED
    pictures = picture_files([_report("drawing.results").geometry_picture(error.view, str(error), {})])
    listing = json.dumps(sorted({*folder.claimed_files(directory), *pictures}))
    return folder.write_files(directory, {folder.CLAIMED: listing, **pictures}, [])[1:]


def write_starter_case(directory: Path, case: str) -> tuple[Path, ...]:
    """Write a case file to start from, unless the folder has one, which the user may have edited.

    Parameters
    ----------
    directory : Path
        Folder for the case file; created if necessary.
    case : str
        Text of the case file.
    """
    return () if (directory / BEGINNING).exists() else folder.write_files(directory, {BEGINNING: case}, [])


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
    """
    folder.check_folder(directory)
    channels = {
        "direct": [name for name, _ in case.channels],
        "dynamic": [vibration.label for vibration in case.vibrations],
        "fit": [source.label for source in case.coupons],
    }.get(command, [source.label for source in case.recordings])
    modes = dict.fromkeys(source.mode for source in case.specimens)
    names = [folder.RESULT, REPORT, *([IDENTIFIED] if command in IDENTIFYING else [])]
    names += {
        "mesh": [file.name for file in directory.glob("mesh-*") if file.suffix in FIELDS],
        "batch": [PARTS, *(f"{mode}-{kind}.csv" for mode in modes for kind in ("mean", "band"))],
        "compare": [DIFFERENCES],
        "study": [DESIGNS],
    }.get(command, [])
    files = file_names(channels).values()
    names += [f"{name}{ending}" for name in files for ending in _CURVES.get(command, ())]
    folder.refuse_others(directory, names, inputs_of(case))


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
    relevant = {name: value for name, value in options.items() if name not in _HOW}
    case_data = {key: value for key, value in case_json(case).items() if key != "path"}
    files = (value for value in relevant.values() if isinstance(value, Path) and value.is_file())
    texts = [file.read_text(errors="replace") for file in files]
    data = [command, case_data, case.data_digest(), relevant, texts, code_revision()]
    return hashlib.sha256(json.dumps(data, sort_keys=True, default=str).encode()).hexdigest()[:32]


def picture_files(pictures: Sequence[Picture]) -> dict[str, folder.Content]:
    """Return each picture as a PNG and an SVG file."""
    return {
        f"{picture.name}.{form}": getattr(picture, form) for form in ("png", "svg") for picture in pictures
    }
