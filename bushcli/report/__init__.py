"""Results -> documents (`views`) and JSON-ready data (`json`); documents -> terminal, page and folder (`writers`).

Only the writers write files. Each part is loaded when it is first used; Matplotlib and Jinja are loaded when a result
is written.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bushcli.report.json.batch import batch_json
    from bushcli.report.json.check import check_json
    from bushcli.report.json.compare import compare_json
    from bushcli.report.json.design import design_json
    from bushcli.report.json.diagnosis import diagnosis_json
    from bushcli.report.json.direct import direct_json
    from bushcli.report.json.dynamic import dynamic_json
    from bushcli.report.json.fit import fit_json
    from bushcli.report.json.inverse import inverse_json
    from bushcli.report.json.mesh import mesh_json
    from bushcli.report.json.study import described, study_json
    from bushcli.report.ranking import rank
    from bushcli.report.verdict import judge
    from bushcli.report.views.batch import batch_document
    from bushcli.report.views.check import Checked, check_document
    from bushcli.report.views.compare import compare_document
    from bushcli.report.views.design import design_document
    from bushcli.report.views.diagnosis.document import diagnosis_document
    from bushcli.report.views.direct import direct_document
    from bushcli.report.views.dynamic import dynamic_document
    from bushcli.report.views.fit import fit_document
    from bushcli.report.views.inverse import inverse_document
    from bushcli.report.views.mesh import mesh_document
    from bushcli.report.views.study import study_document
    from bushcli.report.writers.files import (
        BEGINNING,
        Files,
        batch_files,
        check_files,
        check_output,
        compare_files,
        diagnosis_files,
        direct_files,
        dynamic_files,
        fit_files,
        inverse_files,
        mesh_files,
        question_of,
        study_files,
        write,
        write_refused,
        write_starter_case,
    )
    from bushcli.report.writers.folder import (
        QUESTION,
        STAGING,
        NotDrawn,
        earlier_result,
        moves_to,
        occupy,
        staging,
    )
    from bushcli.report.writers.terminal import terminal_text

__all__ = [
    "BEGINNING",
    "QUESTION",
    "STAGING",
    "Checked",
    "Files",
    "NotDrawn",
    "batch_document",
    "batch_files",
    "batch_json",
    "check_document",
    "check_files",
    "check_json",
    "check_output",
    "compare_document",
    "compare_files",
    "compare_json",
    "described",
    "design_document",
    "design_json",
    "diagnosis_document",
    "diagnosis_files",
    "diagnosis_json",
    "direct_document",
    "direct_files",
    "direct_json",
    "dynamic_document",
    "dynamic_files",
    "dynamic_json",
    "earlier_result",
    "fit_document",
    "fit_files",
    "fit_json",
    "inverse_document",
    "inverse_files",
    "inverse_json",
    "judge",
    "mesh_document",
    "mesh_files",
    "mesh_json",
    "moves_to",
    "occupy",
    "question_of",
    "rank",
    "staging",
    "study_document",
    "study_files",
    "study_json",
    "terminal_text",
    "write",
    "write_refused",
    "write_starter_case",
]

# Module of each name; loaded at first use, because no command needs the reports of all others (0.8 s).
_MODULES = {
    "json.batch": ("batch_json",),
    "json.check": ("check_json",),
    "json.compare": ("compare_json",),
    "json.design": ("design_json",),
    "json.diagnosis": ("diagnosis_json",),
    "json.direct": ("direct_json",),
    "json.dynamic": ("dynamic_json",),
    "json.fit": ("fit_json",),
    "json.inverse": ("inverse_json",),
    "json.mesh": ("mesh_json",),
    "json.study": ("described", "study_json"),
    "ranking": ("rank",),
    "verdict": ("judge",),
    "views.batch": ("batch_document",),
    "views.check": ("Checked", "check_document"),
    "views.compare": ("compare_document",),
    "views.design": ("design_document",),
    "views.diagnosis.document": ("diagnosis_document",),
    "views.direct": ("direct_document",),
    "views.dynamic": ("dynamic_document",),
    "views.fit": ("fit_document",),
    "views.inverse": ("inverse_document",),
    "views.mesh": ("mesh_document",),
    "views.study": ("study_document",),
    "writers.files": (
        "BEGINNING",
        "Files",
        "batch_files",
        "check_files",
        "check_output",
        "compare_files",
        "diagnosis_files",
        "direct_files",
        "dynamic_files",
        "fit_files",
        "inverse_files",
        "mesh_files",
        "question_of",
        "study_files",
        "write",
        "write_refused",
        "write_starter_case",
    ),
    "writers.folder": ("QUESTION", "STAGING", "NotDrawn", "earlier_result", "moves_to", "occupy", "staging"),
    "writers.terminal": ("terminal_text",),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}
__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
