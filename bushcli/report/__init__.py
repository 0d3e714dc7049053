"""Results -> documents (`views`) and JSON-ready data (`json`); documents -> terminal, page and folder (`writers`).

Only the writers write files. Each part is loaded when it is first used: no command needs the reports of all others
(0.8 s), and Matplotlib and Jinja are loaded when a result is written.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bushcli.report.json.batch import batch_json as batch_json
    from bushcli.report.json.check import check_json as check_json
    from bushcli.report.json.compare import compare_json as compare_json
    from bushcli.report.json.design import design_json as design_json
    from bushcli.report.json.diagnosis import diagnosis_json as diagnosis_json
    from bushcli.report.json.direct import direct_json as direct_json
    from bushcli.report.json.dynamic import dynamic_json as dynamic_json
    from bushcli.report.json.fit import fit_json as fit_json
    from bushcli.report.json.inverse import inverse_json as inverse_json
    from bushcli.report.json.mesh import mesh_json as mesh_json
    from bushcli.report.json.study import described as described
    from bushcli.report.json.study import study_json as study_json
    from bushcli.report.ranking import rank as rank
    from bushcli.report.results import Checked as Checked
    from bushcli.report.results import DirectResult as DirectResult
    from bushcli.report.results import FitResult as FitResult
    from bushcli.report.results import InverseResult as InverseResult
    from bushcli.report.results import MeshResult as MeshResult
    from bushcli.report.views.batch import batch_document as batch_document
    from bushcli.report.views.check import check_document as check_document
    from bushcli.report.views.compare import compare_document as compare_document
    from bushcli.report.views.design import design_document as design_document
    from bushcli.report.views.diagnosis import diagnosis_document as diagnosis_document
    from bushcli.report.views.direct import direct_document as direct_document
    from bushcli.report.views.dynamic import dynamic_document as dynamic_document
    from bushcli.report.views.fit import fit_document as fit_document
    from bushcli.report.views.inverse import inverse_document as inverse_document
    from bushcli.report.views.mesh import mesh_document as mesh_document
    from bushcli.report.views.study import study_document as study_document
    from bushcli.report.writers.files import BEGINNING as BEGINNING
    from bushcli.report.writers.files import Files as Files
    from bushcli.report.writers.files import batch_files as batch_files
    from bushcli.report.writers.files import check_files as check_files
    from bushcli.report.writers.files import check_output as check_output
    from bushcli.report.writers.files import compare_files as compare_files
    from bushcli.report.writers.files import diagnosis_files as diagnosis_files
    from bushcli.report.writers.files import direct_files as direct_files
    from bushcli.report.writers.files import dynamic_files as dynamic_files
    from bushcli.report.writers.files import fit_files as fit_files
    from bushcli.report.writers.files import inverse_files as inverse_files
    from bushcli.report.writers.files import mesh_files as mesh_files
    from bushcli.report.writers.files import question_of as question_of
    from bushcli.report.writers.files import study_files as study_files
    from bushcli.report.writers.files import write as write
    from bushcli.report.writers.files import write_refused as write_refused
    from bushcli.report.writers.files import write_starter_case as write_starter_case
    from bushcli.report.writers.folder import QUESTION as QUESTION
    from bushcli.report.writers.folder import STAGING as STAGING
    from bushcli.report.writers.folder import NotDrawn as NotDrawn
    from bushcli.report.writers.folder import earlier_result as earlier_result
    from bushcli.report.writers.folder import moves_to as moves_to
    from bushcli.report.writers.folder import occupy as occupy
    from bushcli.report.writers.folder import staging as staging
    from bushcli.report.writers.terminal import terminal_text as terminal_text

# Where a name is: of a result by its ending, of what serves all results by the name itself.
_ENDINGS = {"json": "json.{}", "document": "views.{}", "files": "writers.files"}
_OTHERS = {
    "json.study": "described",
    "ranking": "rank",
    "results": "Checked DirectResult FitResult InverseResult MeshResult",
    "writers.files": "BEGINNING Files check_output question_of write write_refused write_starter_case",
    "writers.folder": "QUESTION STAGING NotDrawn earlier_result moves_to occupy staging",
    "writers.terminal": "terminal_text",
}
_HOME = {name: module for module, names in _OTHERS.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    result, _, ending = name.rpartition("_")
    module = _HOME.get(name) or _ENDINGS.get(ending, "").format(result)
    if not module or name.startswith("_"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{module}"), name)
