"""A case from the JSON that it was shown as (`bushcli.case.case.resolved`), as it is in every result."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bushcli.case.build import Builder
from bushcli.case.case import Case
from bushcli.errors import CaseError, Problem


def case_again(shown: dict[str, Any], where: str) -> Case:
    """Return the case of a result; its files are looked for where they were when the result was made.

    Parameters
    ----------
    shown : dict
        The entry "case" of a result, with changes such as an identified material.
    where : str
        Name of the result, for the message.

    Raises
    ------
    CaseError
        Something in it is wrong, such as a file that is no longer there.
    """
    path = Path(str(shown.get("path", "case.toml")))
    data = {key: _given(value) for key, value in shown.items() if key != "path" and value is not None}
    material = data.get("material")
    if isinstance(material, dict) and material.get("bulk_modulus") == "inf":
        material["bulk_modulus"] = float("inf")
    builder = Builder(path.parent)
    case = builder.case(data, path)
    if case is None:
        raise CaseError(*(Problem(where, one.what, one.nearest, one.expected) for one in builder.findings))
    return case


def _given(value: Any) -> Any:
    """Return a value without the keys that are not given: a case file has no null."""
    if isinstance(value, dict):
        return {key: _given(item) for key, item in value.items() if item is not None}
    if isinstance(value, list):
        return [_given(item) for item in value]
    return value
