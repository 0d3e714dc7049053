"""Map of where a change of stiffness would help -> a file for ParaView (VTK's XML, as text)."""

from __future__ import annotations

import numpy as np

from bushcli.mismatch.maps import LocalMap
from bushcli.report.drawing.bushing_map import numbering

# VTK's number of each kind of cell, and its order of corners: around a ring, first below, then above.
_VTK = {
    ("simplex", 3): (5, (0, 1, 2)),
    ("simplex", 4): (10, (0, 1, 2, 3)),
    ("tensor", 4): (9, (0, 1, 3, 2)),
    ("tensor", 8): (12, (0, 1, 3, 2, 4, 5, 7, 6)),
    ("ring", 4): (9, (0, 1, 2, 3)),
    ("ring", 8): (12, (0, 1, 2, 3, 4, 5, 6, 7)),
}


def map_vtu(found: LocalMap) -> str:
    """Return the map as an unstructured grid; a half-plane as (R, Z, 0), mm.

    References
    ----------
    VTK file formats, https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html
    """
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
