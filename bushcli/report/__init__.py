"""Results -> documents (`views`) and JSON-ready data (`json`); documents -> terminal, page and folder (`writers`).

Only the writers write files. What tells a result is loaded when it is asked for: no command needs the reports of all
others (0.8 s), and Matplotlib and Jinja are loaded when a result is written.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bushcli.report.document import Document
    from bushcli.report.results import Result
    from bushcli.report.writers.files import Files

# Type of a result -> the name of its files in `views` and `json`, and of its functions.
_NAMES = {
    "CheckResult": "check",
    "MeshResult": "mesh",
    "DirectResult": "direct",
    "DynamicResult": "dynamic",
    "FitResult": "fit",
    "InverseResult": "inverse",
    "Diagnosis": "diagnosis",
    "StudyResult": "study",
    "Design": "design",
    "Batch": "batch",
    "Comparison": "compare",
}


def as_json(result: Result) -> dict[str, Any]:
    """Return a result as JSON-ready data."""
    return _convert(result, "json.{}", "json")


def as_document(result: Result) -> Document:
    """Return the document of a result."""
    return _convert(result, "views.{}", "document")


def as_files(result: Result) -> Files:
    """Return what is written of a result besides result.json."""
    return _convert(result, "writers.files", "files")


def _convert(result: Result, module: str, kind: str) -> Any:
    name = _NAMES[type(result).__name__]
    return getattr(import_module(f"{__name__}.{module.format(name)}"), f"{name}_{kind}")(result)
