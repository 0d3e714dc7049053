"""Rebuild a case from the JSON in a result (`bushcli.case.case_json`)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from bushcli.case.build import Builder
from bushcli.case.case import Case
from bushcli.case.limits import LARGEST_RESULT
from bushcli.errors import CaseError, InputError, Problem
from bushcli.runtime.bounded import TooLarge, read_bounded


def rebuilt_case(document: dict[str, Any], folder: Path) -> Case:
    """Return the case of a result.

    Parameters
    ----------
    document : dict
        The entry "case" of a result, with changes such as an identified material.
    folder : Path
        Folder of the result. The case file is searched for from the working folder, then from this one upwards.

    Raises
    ------
    CaseError
        Something in it is wrong, such as a geometry file that is no longer there.
    """
    path = found_case(Path(str(document.get("path", "case.toml"))), folder)
    data = {key: value for key, value in _without_null(document).items() if key != "path"}
    material = data.get("material")
    if isinstance(material, dict) and material.get("bulk_modulus") == "inf":
        material["bulk_modulus"] = float("inf")
    # A missing recording is an error only when it is read.
    builder = Builder(path.parent, looks_for_files=False)
    case = builder.case(data, path)
    if case is None:
        raise CaseError(*(Problem(str(folder), f.what, f.nearest, f.expected) for f in builder.findings))
    return case


def read_result(file: Path, shown_path: Path | None = None) -> dict[str, Any]:
    """Return the result of a command on a case.

    Parameters
    ----------
    file : Path
        The result, result.json.
    shown_path : Path, optional
        Folder that the user named, for the message where the result is missing.

    Raises
    ------
    InputError
        It cannot be read, or a command on a case did not write it.
    """
    try:
        result = json.loads(read_bounded(file, LARGEST_RESULT))
    except FileNotFoundError:
        what = "is a folder without result.json"
        expected = "a case file, or a folder written with -o"
        raise InputError(Problem(str(shown_path or file), what, "", expected)) from None
    except (OSError, ValueError, RecursionError, TooLarge) as error:
        reason = getattr(error, "strerror", None) or "it is not JSON written by bushcli"
        raise InputError(Problem(str(file), f"cannot be read: {reason}")) from None
    if not isinstance(result, dict) or not isinstance(result.get("case"), dict):
        what = "is not the result of a command on a case"
        raise InputError(Problem(str(file), what, "", "a folder that a command on a case wrote with -o"))
    return result


def found_case(path: Path, folder: Path) -> Path:
    """Return where a result's case file is: as named from the working folder, else from a folder above the result."""
    if path.is_absolute() or path.exists():
        return path
    above = (parent / path for parent in folder.resolve().parents)
    return next((candidate for candidate in above if candidate.exists()), path)


def _without_null(value: Any) -> Any:
    """Return a value without keys that are null, because TOML has no null."""
    if isinstance(value, dict):
        return {key: _without_null(item) for key, item in value.items() if item is not None}
    if isinstance(value, list):
        return [_without_null(item) for item in value]
    return value
