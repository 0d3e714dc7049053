"""A document -> one HTML page that opens offline: it contains pictures, style and script, and fetches nothing.

Jinja escapes all text from a case or a recording. A page with zoomable plots runs one script, which the page's content
policy permits by its digest: no other script that might get into the page is run.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import datetime
from itertools import groupby
from pathlib import Path
from typing import Any

from bushcli.report.document import Block, Document, Picture, Table, on
from bushcli.report.drawing.looks import style_sheet
from bushcli.report.drawing.zoom import figure, script, templates

# Largest number of rows of a table that may be long; result.json has all.
_MOST = 100

# By the words in which a verdict uses the term.
_TERMS = {
    r"misfit": (
        "misfit",
        "simulated minus recorded force; as one number its root mean square over all samples",
    ),
    r"\brms\b": ("rms", "root mean square over all samples, in percent of the recorded force range"),
    r"force range": ("force range", "the largest recorded force minus the smallest one"),
    r"\bnoise\b": (
        "noise",
        "scatter of the recorded force about a smooth curve: one standard deviation of it",
    ),
    r"too (soft|stiff)": (
        "too soft, too stiff",
        "at the same displacement the simulated force is smaller, or larger, than the recorded one",
    ),
    r"N(?: mm)?/(?:mm|deg)": (
        "stiffness in N/mm or N mm/deg",
        "secant from one end of the curve to the other",
    ),
    r"factor of .* on the stiffness": (
        "factor on the stiffness",
        "the number by which all simulated forces would have to be multiplied",
    ),
    r" ± ": ("±", "one standard error"),
    r"(than|about|\() ?\d+ %\)": (
        "percentage after an effect",
        "probability, given these recordings and how common the effect is, that it is there",
    ),
    r"formulas? .* err": (
        "error of the formulas",
        "how far the formulas of the law are assumed to be from the true behaviour of rubber",
    ),
    r"held out": ("held out", "not used to fit the model, but predicted by it"),
    r"hardly plausible": ("hardly plausible", "hardly any bushing has a value so far from the usual ones"),
    r"poorly determined": ("poorly determined", "many values of it describe the recordings nearly as well"),
}


def page(
    document: Document,
    result: Mapping[str, Any],
    pictures: Sequence[Picture] = (),
    inputs: Sequence[Path] = (),
) -> str:
    """Return the page of a result: verdict, warning, problems, conditions, sections, provenance."""
    sections = on("page", document.with_pictures(pictures).sections)
    blocks = [block for section in sections for block in (*section.blocks, *section.folded)]
    code = script() if any(isinstance(block, Picture) and block.panels for block in blocks) else ""
    digests = []
    for path in inputs:
        with suppress(OSError), path.open("rb") as file:  # a file may be gone since it was read
            digests.append((path, hashlib.file_digest(file, "sha256").hexdigest()))
    environment = templates()
    environment.filters.update({"figure": figure, "grouped": _groups})
    return environment.get_template("report.html").render(
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


def _groups(blocks: Iterable[Block]) -> Iterator[tuple[str, list[Block]]]:
    """Yield blocks of the same kind that follow each other, with the name of their kind."""
    shown = (b.without_middle(_MOST) if isinstance(b, Table) and b.most else b for b in blocks)
    for kind, group in groupby(shown, lambda block: type(block).__name__.lower()):
        yield kind, list(group)


def terms(lines: Iterable[str]) -> list[tuple[str, str]]:
    """Return the terms that occur in these lines, each with its meaning."""
    text = "\n".join(lines)
    return [meaning for words, meaning in _TERMS.items() if re.search(words, text, re.IGNORECASE)]
