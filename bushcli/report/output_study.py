"""Files of a study and of a design for target rates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from bushcli.report.contents import drawn, text_file
from bushcli.report.folder import RESULT, Content, write_files
from bushcli.report.output import DESIGNS, REPORT, inputs_of
from bushcli.study.design import Design
from bushcli.study.study import Study


def write_study(
    directory: Path, result: Mapping[str, Any], found: Study, rows: Callable[[Path], None]
) -> tuple[Path, ...]:
    """Write a study: result.json, the designs as Parquet, pictures, report.

    Parameters
    ----------
    directory : Path
        Folder for the result; created if necessary.
    result : mapping of str to object
        What `study_json` returned.
    found : Study
        The study.
    rows : callable
        Writes the designs at a path.

    Raises
    ------
    InputError, NotDrawn
        As `write_direct`.
    """

    def draw() -> dict[str, Content]:
        from bushcli.report.drawing.results import study_figures
        from bushcli.report.study_html import study_html

        pictures = study_figures(found)
        return drawn(pictures) | {REPORT: text_file(study_html(result, found, pictures))}

    return write_files(directory, {RESULT: result, DESIGNS: rows}, inputs_of(found.case), drawn=draw)


def write_design(directory: Path, result: Mapping[str, Any], found: Design) -> tuple[Path, ...]:
    """Write a design for target rates: result.json, report.

    Parameters
    ----------
    directory : Path
        Folder for the result; created if necessary.
    result : mapping of str to object
        What `design_json` returned.
    found : Design
        The design.

    Raises
    ------
    InputError, NotDrawn
        As `write_direct`.
    """

    def draw() -> dict[str, Content]:
        from bushcli.report.design_html import design_html

        return {REPORT: text_file(design_html(result, found))}

    return write_files(directory, {RESULT: result}, inputs_of(found.case), drawn=draw)
