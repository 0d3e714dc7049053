"""Results -> text, JSON, pictures, HTML: values in, strings and figures out.

Only `output` writes files. Each part is loaded when it is first used; Matplotlib and Jinja are loaded when a result is
written.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bushcli.report.design import design_json, design_text
    from bushcli.report.diagnosis import diagnosis_text
    from bushcli.report.diagnosis_document import diagnosis_json
    from bushcli.report.folder import QUESTION, STAGING, NotDrawn, earlier_result, moves_to, staging
    from bushcli.report.identification import inverse_json, inverse_text
    from bushcli.report.json.direct import case_json, direct_json, fit_json, mesh_json
    from bushcli.report.occupied import occupy
    from bushcli.report.output import (
        check_output,
        question_of,
        write_check,
        write_diagnosis,
        write_direct,
        write_fit,
        write_inverse,
    )
    from bushcli.report.output_mesh import BEGINNING, write_meshes, write_refused, write_starter_case
    from bushcli.report.output_study import write_design, write_study
    from bushcli.report.protocol import protocol_json, protocol_parts
    from bushcli.report.ranking import rank
    from bushcli.report.study import study_json, study_text
    from bushcli.report.text import case_text, direct_text, fit_text, mesh_text
    from bushcli.report.verdict import judge

__all__ = [
    "BEGINNING",
    "QUESTION",
    "STAGING",
    "NotDrawn",
    "case_json",
    "case_text",
    "check_output",
    "design_json",
    "design_text",
    "diagnosis_json",
    "diagnosis_text",
    "direct_json",
    "direct_text",
    "earlier_result",
    "fit_json",
    "fit_text",
    "inverse_json",
    "inverse_text",
    "judge",
    "mesh_json",
    "mesh_text",
    "moves_to",
    "occupy",
    "protocol_json",
    "protocol_parts",
    "question_of",
    "rank",
    "staging",
    "study_json",
    "study_text",
    "write_check",
    "write_design",
    "write_diagnosis",
    "write_direct",
    "write_fit",
    "write_inverse",
    "write_meshes",
    "write_refused",
    "write_starter_case",
    "write_study",
]

# Module of each name; loaded at first use, because no command needs the reports of all others (0.8 s).
_MODULES = {
    "design": ("design_json", "design_text"),
    "diagnosis": ("diagnosis_text",),
    "diagnosis_document": ("diagnosis_json",),
    "json.direct": ("case_json", "direct_json", "fit_json", "mesh_json"),
    "folder": ("QUESTION", "STAGING", "NotDrawn", "earlier_result", "moves_to", "staging"),
    "identification": ("inverse_json", "inverse_text"),
    "occupied": ("occupy",),
    "output": (
        "check_output",
        "question_of",
        "write_check",
        "write_diagnosis",
        "write_direct",
        "write_fit",
        "write_inverse",
    ),
    "output_mesh": ("BEGINNING", "write_starter_case", "write_meshes", "write_refused"),
    "output_study": ("write_design", "write_study"),
    "protocol": ("protocol_json", "protocol_parts"),
    "ranking": ("rank",),
    "study": ("study_json", "study_text"),
    "text": ("case_text", "direct_text", "fit_text", "mesh_text"),
    "verdict": ("judge",),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
