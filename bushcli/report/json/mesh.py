"""The meshes of a case -> JSON-ready data."""

from __future__ import annotations

from typing import Any

from bushcli.case.typical import unusual_values
from bushcli.report.json.common import head, json_value, select
from bushcli.report.results import MeshResult


def mesh_json(result: MeshResult) -> dict[str, Any]:
    """Return the meshes of a case as JSON-ready data."""
    case = result.case
    document = head("mesh", case, unusual_values(case, case.material))
    document["geometry"] = {"notes": case.geometry.notes, "measures": case.geometry.measures()}
    document["meshes"] = [
        select(mesh, "name modes dimension cells nodes boundaries regions") for mesh in result.meshes
    ]
    return json_value(document)
