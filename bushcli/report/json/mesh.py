"""The meshes of a case -> JSON-ready data."""

from __future__ import annotations

from typing import Any

from bushcli.case.typical import unusual_values
from bushcli.report.json.common import result_json, select
from bushcli.report.results import MeshResult


def mesh_json(result: MeshResult) -> dict[str, Any]:
    """Return the meshes of a case as JSON-ready data."""
    case, names = result.case, "name modes dimension cells nodes boundaries regions"
    entries = {
        "geometry": {"notes": case.geometry.notes, "measures": case.geometry.measures()},
        "meshes": [select(mesh, names) for mesh in result.meshes],
    }
    return result_json("mesh", case, unusual_values(case, case.material), entries)
