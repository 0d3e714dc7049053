"""Results -> the files of a folder: numbers as CSV, pictures, the page. Only the writers write results.

The numbers are written before anything is drawn. What becomes of an earlier result in the folder, and of files that
bushcli did not write, is decided in `bushcli.report.writers.folder`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bushcli.case import load_case_names, resolved
from bushcli.case.identified import IDENTIFIED, IDENTIFYING, identified_case
from bushcli.recording import write_curve_csv
from bushcli.report.quantity import FORCE_UNITS, MOTION_UNITS, quantities, shown_motion
from bushcli.report.writers.folder import (
    RESULT,
    Content,
    check_folder,
    earlier_result,
    refuse_others,
    write_files,
)
from bushcli.runtime.claims import claim
from bushcli.runtime.names import file_names
from bushcli.runtime.store import code_revision
from cases.six import MOTIONS, REACTIONS

if TYPE_CHECKING:
    from bushcli.case import Case
    from bushcli.diagnosis.result import Diagnosis
    from bushcli.inverse import Fit
    from bushcli.inverse.coupon_tables import TableSpectrum, TableSweep
    from bushcli.mismatch.maps import LocalMap
    from bushcli.report.document import Document, Picture
    from bushcli.simulate.dynamic import DynamicCurve, DynamicResponse
    from bushcli.simulate.dynamic_tables import ComparedTable
    from bushcli.simulate.meshes import Meshed
    from bushcli.simulate.misfit import Misfit
    from bushcli.simulate.response import Response, Simulated
    from bushcli.study.batch import Batch
    from bushcli.study.compare import Comparison, Difference
    from bushcli.study.study import Study
    from geometry.errors import GeometryError

Array = NDArray[np.float64]

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
    "direct": ("", "-comparison"),
    "fit": ("-fit",),
    "inverse": ("-identified",),
    "diagnose": ("-diagnosis",),
    "dynamic": ("-dynamic",),
}
# VTK's number of each kind of cell, and its order of corners: around a ring, first below, then above.
_VTK = {
    ("simplex", 3): (5, (0, 1, 2)),
    ("simplex", 4): (10, (0, 1, 2, 3)),
    ("tensor", 4): (9, (0, 1, 3, 2)),
    ("tensor", 8): (12, (0, 1, 3, 2, 4, 5, 7, 6)),
    ("ring", 4): (9, (0, 1, 2, 3)),
    ("ring", 8): (12, (0, 1, 2, 3, 4, 5, 6, 7)),
}


@dataclass(frozen=True)
class Files:
    """What is written of a result, besides result.json.

    Attributes
    ----------
    case : Case or None
        Its case, whose files are never replaced.
    contents : mapping of str to Content
        Numbers by file name, which are written first.
    fields : sequence of str
        Names of files that were written while the command calculated.
    pictures : callable or None
        Draws the pictures.
    has_page : bool
    """

    case: Case | None
    contents: Mapping[str, Content] = field(default_factory=dict)
    fields: Sequence[str] = ()
    pictures: Callable[[], Sequence[Picture]] | None = None
    has_page: bool = True


def write(
    directory: Path, result: Mapping[str, Any], files: Files, document: Callable[..., Document]
) -> tuple[Path, ...]:
    """Write a result: its JSON and numbers, and when they are on disk its pictures and its page.

    Parameters
    ----------
    directory : Path
        Folder for the result; created if necessary.
    result : mapping of str to object
        The result as JSON-ready data.
    files : Files
    document : callable
        Returns the document of the result; takes its pictures.

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

    def draw() -> dict[str, Content]:
        pictures = files.pictures() if files.pictures else ()
        made = drawn(pictures)
        if files.has_page:
            from bushcli.report.writers.page import page

            made[REPORT] = text_file(page(document(pictures), result, inputs_of(files.case)))
        return made

    contents: dict[str, Content] = {}
    if files.case is not None and result["command"] in IDENTIFYING:
        carried = identified_case(files.case, result, directory)
        contents |= {IDENTIFIED: text_file(carried)} if carried else {}
    draws = draw if files.pictures or files.has_page else None
    return write_files(
        directory, {RESULT: result, **contents, **files.contents}, inputs_of(files.case), files.fields, draws
    )


def _drawing() -> Any:
    """Return the module that draws, which loads Matplotlib."""
    from bushcli.report.drawing import results

    return results


def check_files(case: Case) -> Files:
    """Return the files of a checked case: result.json alone."""
    return Files(case, has_page=False)


def mesh_files(case: Case, meshes: Sequence[Meshed]) -> Files:
    """Return the files of meshes: a picture of each, and of the interpretation of a geometry file.

    Parameters
    ----------
    case : Case
    meshes : sequence of Meshed
    """
    shape = case.geometry

    def pictures() -> list[Picture]:
        draw, seen = _drawing(), shape.view
        shown = [] if seen is None else [draw.geometry_picture(seen, draw.INTERPRETED, shape.measures())]
        return [*shown, *draw.mesh_figures(meshes)]

    # A part has no case file: the one that is written to start from is not an input.
    fields = [f"mesh-{one.name}{end}" for one in meshes for end in FIELDS]
    return Files(None, {}, fields, pictures, has_page=False)


def direct_files(
    response: Response, misfits: Mapping[str, Misfit], fit: Fit | None, tables: Sequence[ComparedTable] = ()
) -> Files:
    """Return the files of a direct prediction: per channel its curve, its comparison and its fields.

    Parameters
    ----------
    response, misfits, fit
        As given to `direct_json`.
    tables : sequence of ComparedTable
    """
    names = file_names(
        [*(channel.name for channel in response.channels), *(one.table.name for one in tables)]
    )
    contents: dict[str, Content] = {
        f"{names[one.table.name]}-table.csv": compared_rows(one) for one in tables
    }
    for channel in response.channels:
        name = names[channel.name]
        contents[f"{name}.csv"] = _curve(channel)
        if (found := misfits.get(channel.name)) is not None:
            # At the recorded displacements, in the order of the recording.
            forces = {"recorded": found.simulated - found.difference, "simulated": found.simulated}
            contents[f"{name}-comparison.csv"] = number_table(
                *_forces(channel.mode, found.displacement, forces)
            )
    fields = [f"{names[channel.name]}{end}" for channel in response.channels for end in FIELDS]
    return Files(
        response.case,
        contents,
        fields,
        lambda: _drawing().direct_figures(response, misfits, fit, names, tables),
    )


def fit_files(case: Case, fit: Fit | None, spectra: Sequence[TableSpectrum | TableSweep] = ()) -> Files:
    """Return the files of a fit: recorded and fitted stress of each coupon, and the master curve of each table.

    Parameters
    ----------
    case : Case
    fit : Fit or None
        None where the case has no tests but tables.
    spectra : sequence of TableSpectrum or TableSweep
    """
    from bushcli.inverse.coupon_tables import TableSpectrum
    from bushcli.report.plots.spectrum import master_columns

    curves = () if fit is None else fit.curves
    names = file_names([*(curve.name for curve in curves), *dict.fromkeys(one.table.name for one in spectra)])
    contents: dict[str, Content] = {
        f"{names[one.table.name]}-master.csv": number_table(*master_columns(one))
        for one in spectra
        if isinstance(one, TableSpectrum)
    }
    for curve in curves:
        forces = {"recorded": curve.recording.force, "fitted": curve.fitted.force}
        columns = _forces(curve.recording.mode, curve.recording.displacement, forces)
        contents[f"{names[curve.name]}-fit.csv"] = number_table(*columns)

    def pictures() -> Sequence[Picture]:
        drawing = _drawing()
        of_law = () if fit is None else drawing.fit_figures(fit)
        return (*of_law, *drawing.spectrum_figures(spectra, names))

    return Files(case, contents, pictures=pictures)


def inverse_files(case: Case, fits: Sequence[Fit]) -> Files:
    """Return the files of identified laws: for each channel the recorded curve and that of the best law.

    Parameters
    ----------
    case : Case
    fits : sequence of Fit
        The best first.
    """
    from bushcli.inverse.file_units import in_file_units

    fits = [in_file_units(fit) for fit in fits]
    best = fits[0]
    names = file_names([*(curve.name for curve in best.curves), *(one.table.name for one in best.tables)])
    contents: dict[str, Content] = {
        f"{names[one.table.name]}-table.csv": compared_rows(one) for one in best.tables
    }
    for curve in best.curves:
        found = "predicted" if curve.held_out else "fitted"
        forces = {"recorded": curve.recording.force, found: curve.fitted.force}
        if curve.started is not None:
            forces["started"] = curve.started.force
        columns = _forces(curve.recording.mode, curve.recording.displacement, forces)
        contents[f"{names[curve.name]}-identified.csv"] = number_table(*columns)

    def pictures() -> Sequence[Picture]:
        from bushcli.report.cycles import fit_histories

        loops = _drawing().history_figures(fit_histories(best), names)
        return (*_drawing().inverse_figures(fits, names), *loops)

    return Files(case, contents, pictures=pictures)


def diagnosis_files(found: Diagnosis) -> Files:
    """Return the files of a diagnosis: the curves of each channel, and maps of the bushing for ParaView."""
    names = file_names([*(one.name for one in found.channels), *(one.name for one in found.maps)])
    contents: dict[str, Content] = {}
    for channel in found.channels:
        forces = {"recorded": channel.recording.force, "plain": channel.before, "final": channel.after}
        missing = None if found.missing is None else found.missing.force.get(channel.name)
        if missing is not None:
            forces["missing"] = missing
        one = channel.recording
        heads, columns = _forces(one.mode, one.displacement, forces)
        heads, columns = [*heads, "faulty"], [*columns, channel.faulty.astype(float)]
        if one.time is not None:
            heads, columns = ["time_s", *heads], [one.time, *columns]
        contents[f"{names[channel.name]}-diagnosis.csv"] = number_table(heads, columns)
    for found_map in found.maps:
        contents[f"{names[found_map.name]}-bushing-map.vtu"] = text_file(map_vtu(found_map))

    return Files(found.case, contents, pictures=lambda: _drawing().diagnosis_figures(found, names))


def dynamic_files(response: DynamicResponse) -> Files:
    """Return the files of dynamic stiffness: a table of each load case, a row for each preload and frequency."""
    names = file_names(dict.fromkeys(curve.name for curve in response.curves))
    contents: dict[str, Content] = {
        f"{file}-dynamic.csv": dynamic_table([one for one in response.curves if one.name == name])
        for name, file in names.items()
    }

    return Files(response.case, contents, pictures=lambda: _drawing().dynamic_figures(response, names))


def study_files(found: Study, rows: Callable[[Path], None]) -> Files:
    """Return the files of a study: its designs as Parquet.

    Parameters
    ----------
    found : Study
    rows : callable
        Writes the designs at a path.
    """
    return Files(found.case, {DESIGNS: rows}, pictures=lambda: _drawing().study_figures(found))


def batch_files(found: Batch) -> Files:
    """Return the files of a batch: a row for each part, and the mean curve of each mode with its band."""
    from bushcli.report.views.batch import stiffness
    from bushcli.study.causes import joined

    heads = "part,mode,factor,std,deviation,stiffness,rms_percent,noise_percent,outlier,causes"
    rows = [
        [
            *(one.name, one.mode, one.factor, one.std, one.deviation, stiffness(one)),
            *(one.rms_percent, one.noise_percent, " ".join(one.outlier), joined(one.causes)),
        ]
        for one in found.parts
    ]
    table = "\n".join([heads, *(",".join(map(_cell, row)) for row in rows)])
    contents: dict[str, Content] = {PARTS: text_file(f"{table}\n")}
    for curve in found.curves:
        shown, mean = quantities(curve.mode), curve.mean
        q, force = shown.csv_names
        times = ([], []) if mean.time is None else (["time_s"], [mean.time])
        contents[f"{curve.mode}-mean.csv"] = number_table(
            [*times[0], q, force], [*times[1], shown.shown(mean.displacement), mean.force]
        )
        contents[f"{curve.mode}-band.csv"] = number_table(
            (q, f"mean_{force}", f"lower_{force}", f"upper_{force}"),
            (shown.shown(mean.displacement), mean.force, curve.lower, curve.upper),
        )

    def pictures() -> Sequence[Picture]:
        from bushcli.report.drawing.results import batch_figures

        return batch_figures(found)

    return Files(found.case, contents, pictures=pictures)


def compare_files(found: Comparison) -> Files:
    """Return the files of a comparison: its page and pictures, the differences as CSV."""

    def rows(differences: Sequence[Difference]) -> list[list[object]]:
        return [[one.key, *("" if value is None else value for value in one.values)] for one in differences]

    names = ["key", *(item.name for item in found.items)]
    lines: list[list[object]] = [list(names), *rows(found.keys), *rows(found.numbers)]
    table = "\n".join(",".join(map(_cell, line)) for line in lines)

    def pictures() -> Sequence[Picture]:
        from bushcli.report.drawing.results import compare_figures

        return compare_figures(found)

    return Files(None, {DIFFERENCES: text_file(f"{table}\n")}, pictures=pictures)


def _cell(value: object) -> str:
    text = f"{value:.8g}" if isinstance(value, float) else str(value)
    return '"' + text.replace('"', '""') + '"' if any(one in text for one in ',"\n') else text


def write_refused(directory: Path, error: GeometryError) -> tuple[Path, ...]:
    """Write a picture of a geometry that was refused, if the error has a view of it.

    Parameters
    ----------
    directory : Path
        Folder for the picture, created if necessary; if it holds a result, `REFUSED` in it.
    error : GeometryError
        The error, whose message becomes the title.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    if error.view is None:
        return ()
    if earlier_result(directory) is not None:
        directory = directory / REFUSED
    pictures = drawn([_drawing().geometry_picture(error.view, str(error), {})])
    refuse_others(directory, pictures, [])
    with suppress(OSError):  # `write_files` says why
        claim(directory, pictures)
    return write_files(directory, pictures, [])


def write_starter_case(directory: Path, case: str) -> tuple[Path, ...]:
    """Write a case file to start from, unless the folder has one, which the user may have edited.

    Parameters
    ----------
    directory : Path
        Folder for the case file; created if necessary.
    case : str
        Text of the case file.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    return (
        () if (directory / BEGINNING).exists() else write_files(directory, {BEGINNING: text_file(case)}, [])
    )


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
    if command == "dynamic":
        channels = list(load_case_names(case.vibrations, ()))
    endings = [f"{ending}.csv" for ending in _CURVES.get(command, ())]
    endings += [".xdmf", ".h5"] if command == "direct" else []
    curves = [f"{name}{ending}" for name in file_names(channels).values() for ending in endings]
    meshes = (
        [file.name for file in directory.glob("mesh-*") if file.suffix in FIELDS] if command == "mesh" else []
    )
    modes = dict.fromkeys(source.mode for source in case.specimens)
    curves += [f"{mode}-{kind}.csv" for mode in modes for kind in ("mean", "band") if command == "batch"]
    curves += [PARTS] if command == "batch" else [DIFFERENCES] if command == "compare" else []
    designs = [DESIGNS] if command == "study" else [IDENTIFIED] if command in IDENTIFYING else []
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


def drawn(pictures: Sequence[Picture]) -> dict[str, Content]:
    """Return each picture as a PNG and an SVG file."""
    files: dict[str, Content] = {f"{one.name}.png": data_file(one.png) for one in pictures}
    return files | {f"{one.name}.svg": data_file(one.svg) for one in pictures}


def text_file(content: str) -> Callable[[Path], None]:
    """Return a function that writes a text at a path."""
    return data_file(content.encode())


def data_file(content: bytes) -> Callable[[Path], None]:
    """Return a function that writes bytes at a path."""

    def write(path: Path) -> None:
        path.write_bytes(content)

    return write


def _curve(channel: Simulated) -> Content:
    """Return the simulated curve of a channel; for a path of six motions, all motions and reactions."""
    six = channel.six
    if six is None:
        return lambda path: write_curve_csv(path, channel.curve)
    # Named as in recordings.
    units = (unit.replace(" ", "") for unit in (*MOTION_UNITS, *FORCE_UNITS))
    names = [f"{name}_{unit}" for name, unit in zip((*MOTIONS, *REACTIONS), units, strict=True)]
    return number_table(["time_s", *names], [six.time, *shown_motion(six).T, *six.force.T])


def _forces(mode: str, displacement: Array, forces: Mapping[str, Array]) -> tuple[list[str], list[Array]]:
    """Return names and columns of forces over a displacement; a word, the quantity and its unit name a force."""
    shown = quantities(mode)
    q, force = shown.csv_names
    return [q, *(f"{word}_{force}" for word in forces)], [shown.shown(displacement), *forces.values()]


def dynamic_table(curves: Sequence[DynamicCurve]) -> Callable[[Path], None]:
    """Return the dynamic stiffness of a load case, with the columns of a rig's table."""
    shown = quantities(curves[0].mode)
    travel, force = shown.csv_names
    kind = "MPa" if shown.force_unit == "MPa" else "Nmm_per_rad" if shown.per_internal != 1.0 else "N_per_mm"
    moduli = (f"{name}_{kind}" for name in ("stiffness", "storage", "loss"))
    # "preload_mm" and "preload_N", as a rig writes them; "preload_stretch".
    preloads = (f"preload_{name if kind == 'MPa' else name.split('_', 1)[1]}" for name in (travel, force))
    peaks = [] if curves[0].amplitude is None else [f"amplitude_{travel.split('_', 1)[1]}"]
    names = ["frequency_Hz", *peaks, *preloads, *moduli, "loss_angle_deg"]
    rows = []
    for curve in curves:
        K, preload = curve.stiffness, [shown.at(curve.preload), curve.force]
        peak = [] if curve.amplitude is None else [shown.per_internal * curve.amplitude]
        held = np.broadcast_to([*peak, *preload], (len(K), len(peak) + 2))
        rows.append(np.column_stack([curve.frequency, held, abs(K), K.real, K.imag, np.degrees(np.angle(K))]))
    return number_table(names, list(np.vstack(rows).T))


def compared_rows(one: ComparedTable) -> Callable[[Path], None]:
    """Return a measured table beside its simulation, a row for each of its rows."""
    table, shown = one.table, quantities(one.table.mode)
    travel, force = (name.split("_", 1)[1] for name in shown.csv_names)
    kind = "Nmm_per_rad" if shown.per_internal != 1.0 else "N_per_mm"
    columns = {
        "frequency_Hz": table.frequency,
        f"amplitude_peak_{travel}": shown.per_internal * table.amplitude,
        f"preload_{travel}": shown.per_internal * one.preload,
        f"preload_{force}": table.preload_force,
        "temperature_C": table.temperature,
        f"stiffness_{kind}": table.stiffness,
        "loss_angle_deg": np.degrees(table.loss_angle),
        f"simulated_stiffness_{kind}": np.abs(one.simulated),
        "simulated_loss_angle_deg": np.degrees(np.angle(one.simulated)),
    }
    known = {name: values for name, values in columns.items() if not np.isnan(values).all()}
    return number_table(list(known), list(known.values()))


def number_table(names: Sequence[str], columns: Sequence[Array]) -> Callable[[Path], None]:
    """Return a table as CSV, with twelve significant digits.

    Parameters
    ----------
    names : sequence of str
        Names of the columns.
    columns : sequence of (n,) array
        One array per column, in the unit that its name gives.
    """
    rows = "".join(",".join(f"{value:.12g}" for value in row) + "\n" for row in np.column_stack(columns))
    return text_file(",".join(names) + "\n" + rows)


def map_vtu(found: LocalMap) -> str:
    """Return the map as an unstructured grid; a half-plane as (R, Z, 0), mm.

    References
    ----------
    VTK file formats, https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html
    """
    from bushcli.report.plots.places import numbering

    corners = found.cells.shape[1]
    points = np.zeros((len(found.points), 3))
    points[:, : found.points.shape[1]] = found.points
    kind, order = _VTK[numbering(found), corners]
    cells = found.cells[:, order]
    offsets = corners * np.arange(1, len(cells) + 1)
    return f"""<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">
<Points>{_array("Float64", "points", points, 'NumberOfComponents="3"')}</Points>
<Cells>
{_array("Int64", "connectivity", cells)}
{_array("Int64", "offsets", offsets)}
{_array("UInt8", "types", np.full(len(cells), kind))}
</Cells>
<CellData Scalars="stiffness_change">{_array("Float64", "stiffness_change", found.factor)}</CellData>
</Piece></UnstructuredGrid>
</VTKFile>
"""


def _array(kind: str, name: str, values: np.ndarray, more: str = "") -> str:  # type: ignore[type-arg]
    text = " ".join(f"{value:.9g}" for value in values.ravel())
    return f'<DataArray type="{kind}" Name="{name}" format="ascii" {more}>{text}</DataArray>'
