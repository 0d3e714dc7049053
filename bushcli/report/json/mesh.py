"""The meshes of a case -> JSON-ready data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from bushcli.case import Case
from bushcli.case.typical import unusual
from bushcli.report.json.common import cleaned, head, part

if TYPE_CHECKING:
    from bushcli.simulate.meshes import Meshed


def mesh_json(case: Case, meshes: Sequence[Meshed]) -> dict[str, Any]:
    """Return the meshes of a case as JSON-ready data.

    Parameters
    ----------
    case : Case
        The validated case.
    meshes : sequence of Meshed
        Its meshes, in the order of the tables.
    """
    document = head("mesh", case, unusual(case, case.material))
    document["geometry"] = {"notes": list(case.geometry.notes), "measures": dict(case.geometry.measures())}
    document["meshes"] = [
        part(mesh, "name modes dimension cells nodes boundaries regions") for mesh in meshes
    ]
    return cleaned(document)
