"""Results -> text, JSON, pictures, HTML: values in, strings and figures out.

Only `output` writes files. Matplotlib and Jinja are loaded when something is written, not before.
"""

from bushcli.report.design import design_json, design_text
from bushcli.report.diagnosis import diagnosis_text
from bushcli.report.diagnosis_json import diagnosis_json
from bushcli.report.document import case_json, direct_json, fit_json, mesh_json
from bushcli.report.identification import inverse_json, inverse_text
from bushcli.report.output import (
    BEGINNING,
    check_output,
    write_beginning,
    write_check,
    write_diagnosis,
    write_direct,
    write_fit,
    write_inverse,
    write_meshes,
    write_refused,
)
from bushcli.report.output_study import write_design, write_study
from bushcli.report.ranking import rank
from bushcli.report.study import study_json, study_text
from bushcli.report.text import case_text, direct_text, fit_text, mesh_text
from bushcli.report.verdict import judge

__all__ = [
    "BEGINNING",
    "case_json",
    "case_text",
    "check_output",
    "design_json",
    "design_text",
    "diagnosis_json",
    "diagnosis_text",
    "direct_json",
    "direct_text",
    "fit_json",
    "fit_text",
    "inverse_json",
    "inverse_text",
    "judge",
    "mesh_json",
    "mesh_text",
    "rank",
    "study_json",
    "study_text",
    "write_beginning",
    "write_check",
    "write_design",
    "write_diagnosis",
    "write_direct",
    "write_fit",
    "write_inverse",
    "write_meshes",
    "write_refused",
    "write_study",
]
