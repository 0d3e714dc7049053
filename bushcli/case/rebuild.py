"""Rebuild a case from the JSON in a result (`bushcli.case.case.resolved`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bushcli.case.build import Builder
from bushcli.case.case import Case
from bushcli.errors import CaseError, Problem


class _Rebuilder(Builder):
    """Builds a case without looking for its recordings; a missing one is an error only when it is read."""

    looks_for_files = False


def rebuilt_case(shown: dict[str, Any], folder: Path) -> Case:
    """Return the case of a result.

    Parameters
    ----------
    shown : dict
        The entry "case" of a result, with changes such as an identified material.
    folder : Path
        Folder of the result. The case file is searched for from the working folder, then from this one upwards.

    Raises
    ------
    CaseError
        Something in it is wrong, such as a geometry file that is no longer there.
    """
    path = found_case(Path(str(shown.get("path", "case.toml"))), folder)
    data = {key: _given(value) for key, value in shown.items() if key != "path" and value is not None}
    material = data.get("material")
    if isinstance(material, dict) and material.get("bulk_modulus") == "inf":
        material["bulk_modulus"] = float("inf")
    builder = _Rebuilder(path.parent)
    case = builder.case(data, path)
    if case is None:
        raise CaseError(
            *(Problem(str(folder), one.what, one.nearest, one.expected) for one in builder.findings)
        )
    return case


def found_case(path: Path, folder: Path) -> Path:
    """Return where a result's case file is: as named from the working folder, else from a folder above the result.

    Parameters
    ----------
    path : Path
        As the result names it.
    folder : Path
        Folder of the result.
    """
    if path.is_absolute() or path.exists():
        return path
    above = (parent / path for parent in folder.resolve().parents)
    return next((one for one in above if one.exists()), path)


def _given(value: Any) -> Any:
    """Return a value without the keys that are not given: a case file has no null."""
    if isinstance(value, dict):
        return {key: _given(item) for key, item in value.items() if item is not None}
    if isinstance(value, list):
        return [_given(item) for item in value]
    return value
