"""Numbers of results -> CSV, with twelve significant digits, and maps of the bushing -> VTK."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bushcli.report.document import Array
from bushcli.report.quantity import FORCE_UNITS, MOTION_UNITS, quantities, shown_motion
from cases.six import MOTIONS, REACTIONS

if TYPE_CHECKING:
    from bushcli.mismatch.maps import LocalMap
    from bushcli.simulate.dynamic_tables import ComparedTable
    from bushcli.simulate.response import SixCurve
    from bushcli.simulate.vibrations import DynamicCurve
    from bushcli.study.batch import Batch, BatchCurve
    from bushcli.study.compare import Comparison


# VTK's number of each kind of cell, by dimension and number of corners.
_VTK = {(2, 3): 5, (2, 4): 9, (3, 4): 10, (3, 8): 12}


def number_table(columns: Mapping[str, Array]) -> str:
    """Return a table of numbers: columns of equal length, by their names."""
    rows = (",".join(f"{value:.12g}" for value in row) for row in np.column_stack([*columns.values()]))
    return "\n".join([",".join(columns), *rows, ""])


def word_table(rows: Iterable[Iterable[object]]) -> str:
    """Return a table of words and numbers, these with eight significant digits."""
    text = io.StringIO()
    cells = ([f"{cell:.8g}" if isinstance(cell, float) else cell for cell in row] for row in rows)
    csv.writer(text, lineterminator="\n").writerows(cells)
    return text.getvalue()


def forces(mode: str, displacement: Array, columns: Mapping[str, Array]) -> dict[str, Array]:
    """Return forces over a displacement as columns: a word, the quantity and its unit name a force."""
    units = quantities(mode)
    q, force = units.csv_names
    return {q: units.convert(displacement)} | {f"{word}_{force}": column for word, column in columns.items()}


def six_table(six: SixCurve) -> str:
    """Return all motions and reactions of a path, named as in recordings."""
    units = (unit.replace(" ", "") for unit in (*MOTION_UNITS, *FORCE_UNITS))
    names = [f"{name}_{unit}" for name, unit in zip((*MOTIONS, *REACTIONS), units, strict=True)]
    columns = zip(names, [*shown_motion(six).T, *six.force.T], strict=True)
    return number_table({"time_s": six.time, **dict(columns)})


def dynamic_table(curves: Sequence[DynamicCurve]) -> str:
    """Return the dynamic stiffness of a load case, with the columns of a rig's table."""
    units = quantities(curves[0].mode)
    travel, force = units.csv_names
    kind = "MPa" if units.force_unit == "MPa" else "Nmm_per_rad" if units.per_internal != 1.0 else "N_per_mm"
    moduli = (f"{name}_{kind}" for name in ("stiffness", "storage", "loss"))
    # "preload_mm" and "preload_N", as a rig writes them; "preload_stretch".
    preloads = (f"preload_{name if kind == 'MPa' else name.split('_', 1)[1]}" for name in (travel, force))
    peaks = [] if curves[0].amplitude is None else [f"amplitude_{travel.split('_', 1)[1]}"]
    names = ["frequency_Hz", *peaks, *preloads, *moduli, "loss_angle_deg"]
    rows = []
    for curve in curves:
        K, preload = curve.stiffness, [units.at(curve.preload), curve.force]
        peak = [] if curve.amplitude is None else [units.per_internal * curve.amplitude]
        conditions = np.broadcast_to([*peak, *preload], (len(K), len(peak) + 2))
        columns = [curve.frequency, conditions, abs(K), K.real, K.imag, np.degrees(np.angle(K))]
        rows.append(np.column_stack(columns))
    return number_table(dict(zip(names, np.vstack(rows).T, strict=True)))


def compared_table(compared: ComparedTable) -> str:
    """Return a measured table beside its simulation, a row for each of its rows."""
    table, units = compared.table, quantities(compared.table.mode)
    travel, force = (name.split("_", 1)[1] for name in units.csv_names)
    kind = "Nmm_per_rad" if units.per_internal != 1.0 else "N_per_mm"
    columns = {
        "frequency_Hz": table.frequency,
        f"amplitude_peak_{travel}": units.per_internal * table.amplitude,
        f"preload_{travel}": units.per_internal * compared.preload,
        f"preload_{force}": table.preload_force,
        "temperature_C": table.temperature,
        f"stiffness_{kind}": table.stiffness,
        "loss_angle_deg": np.degrees(table.loss_angle),
        f"simulated_stiffness_{kind}": np.abs(compared.simulated),
        "simulated_loss_angle_deg": np.degrees(np.angle(compared.simulated)),
    }
    filled = {name: values for name, values in columns.items() if not np.isnan(values).all()}
    return number_table(filled)


def part_table(batch: Batch) -> str:
    """Return a row for each part of a batch."""
    from bushcli.report.views.batch import stiffness
    from bushcli.study.causes import join_causes

    heads = "part,mode,factor,std,deviation,stiffness,rms_percent,noise_percent,outlier,causes"
    rows = (
        (
            *(part.name, part.mode, part.factor, part.std, part.deviation, stiffness(part)),
            *(part.rms_percent, part.noise_percent, " ".join(part.outlier), join_causes(part.causes)),
        )
        for part in batch.parts
    )
    return word_table([heads.split(","), *rows])


def mean_tables(curve: BatchCurve) -> tuple[str, str]:
    """Return the mean curve of a mode, which a recording may stand for, and the band of its tolerance."""
    mean, units = curve.mean, quantities(curve.mode)
    q, force = units.csv_names
    travel = {q: units.convert(mean.displacement)}
    times = {} if mean.time is None else {"time_s": mean.time}
    band = {f"mean_{force}": mean.force, f"lower_{force}": curve.lower, f"upper_{force}": curve.upper}
    return number_table(times | travel | {force: mean.force}), number_table(travel | band)


def difference_table(comparison: Comparison) -> str:
    """Return the keys and the numbers in which results differ."""
    rows = [
        (difference.key, *("" if value is None else value for value in difference.values))
        for difference in (*comparison.keys, *comparison.numbers)
    ]
    return word_table([("key", *(item.name for item in comparison.items)), *rows])


def map_vtu(local_map: LocalMap) -> str:
    """Return the map as an unstructured grid; a half-plane as (R, Z, 0), mm.

    References
    ----------
    VTK file formats, https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html
    """
    from bushcli.report.plots.places import ring_cells

    def array(kind: str, name: str, values: np.ndarray, more: str = "") -> str:  # type: ignore[type-arg]
        text = " ".join(f"{value:.9g}" for value in values.ravel())
        return f'<DataArray type="{kind}" Name="{name}" format="ascii" {more}>{text}</DataArray>'

    cells, dimension = ring_cells(local_map), local_map.points.shape[1]
    points = np.pad(local_map.points, ((0, 0), (0, 3 - dimension)))
    kind, offsets = _VTK[dimension, cells.shape[1]], cells.shape[1] * np.arange(1, len(cells) + 1)
    return f"""<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">
<Points>{array("Float64", "points", points, 'NumberOfComponents="3"')}</Points>
<Cells>
{array("Int64", "connectivity", cells)}
{array("Int64", "offsets", offsets)}
{array("UInt8", "types", np.full(len(cells), kind))}
</Cells>
<CellData Scalars="stiffness_change">{array("Float64", "stiffness_change", local_map.factor)}</CellData>
</Piece></UnstructuredGrid>
</VTKFile>
"""
