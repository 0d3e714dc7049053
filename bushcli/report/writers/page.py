"""A document -> one HTML page that opens offline: it contains pictures, style and script, and fetches nothing.

Jinja escapes all text from a case or a recording. A page with zoomable plots runs one script, which the page's content
policy permits by its digest: no other script that might get into the page is run.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import datetime
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any

import jinja2

from bushcli.report.document import Block, Document, Picture, Table, on
from bushcli.report.drawing.looks import style_sheet
from bushcli.report.drawing.zoom import figure, script
from bushcli.report.views.terms import terms

# Largest number of rows of a table that may be long; result.json has all.
_MOST = 100


def page(
    document: Document,
    result: Mapping[str, Any],
    pictures: Sequence[Picture] = (),
    inputs: Sequence[Path] = (),
) -> str:
    """Return the page of a result: verdict, warning, problems, conditions, sections, provenance."""
    sections = on("page", document.illustrated(pictures).sections)
    blocks = [block for section in sections for block in (*section.blocks, *section.folded)]
    code = script() if any(isinstance(block, Picture) and block.panels for block in blocks) else ""
    digests = []
    for path in inputs:
        with suppress(OSError), path.open("rb") as opened:  # a file may be gone since it was read
            digests.append((path, hashlib.file_digest(opened, "sha256").hexdigest()))
    return (
        _environment()
        .get_template("report.html")
        .render(
            document=document,
            warnings=on("page", [document.warning] if document.warning else []),
            sections=sections,
            script=code,
            plot_style=style_sheet(),
            digest=base64.b64encode(hashlib.sha256(code.encode()).digest()).decode(),
            result=result,
            terms=terms([document.headline, *document.lines]),
            inputs=digests,
            date=datetime.now().astimezone(),
            case=json.dumps(result["case"], indent=2, ensure_ascii=False),
        )
    )


def _grouped(blocks: Iterable[Block]) -> Iterator[tuple[str, list[Block]]]:
    """Yield blocks of the same kind that follow each other, with the name of their kind."""
    for kind, found in groupby(blocks, lambda block: type(block).__name__.lower()):
        yield (
            kind,
            [block.shortened(_MOST) if isinstance(block, Table) and block.most else block for block in found],
        )


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("bushcli.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"figure": figure, "grouped": _grouped}
    return environment
