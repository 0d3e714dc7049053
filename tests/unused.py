"""List code that only tests use, or nobody: names in the packages that neither they nor a benchmark use.

Vulture looks for names that occur nowhere but in their definition; what a library calls by its name is listed here.
``make lint`` runs this file.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from vulture import Vulture

ROOT = Path(__file__).parents[1]
READ = ("bushcli", "cases", "forms", "geometry", "benchmarks", "docs/tables.py")
# Vulture's confidence for names that are not used; what is certain (unreachable code) has 100 %.
CONFIDENCE = 60
SELECTED = re.compile(r'\bselect\([\w.]+, "([\w ]+)"\)')
RESULT = re.compile(r'^    "\w+": "(\w+)",$', re.MULTILINE)
VALIDATORS = ["@field_validator*", "@model_validator*"]

_MOTIONS = ("ux", "uy", "uz", "rx", "ry", "fx", "fy", "fz", "mz")
#: Where the path begins, name (or kind) -> who uses it.
ALLOWED = {
    ("benchmarks/constants.py", "get_code"): "importlib",
    ("", "__getattr__"): "Python, where a module lacks a name that is loaded late",
    ("", "model_config"): "pydantic",
    **{("bushcli/case/schema.py", key): "pydantic: keys of a case file" for key in _MOTIONS},
    ("bushcli/cli/page_server.py", "log_message"): "http.server",
    ("bushcli/errors.py", "exit_code"): "click",
    ("bushcli/export/fmu/slave", "Bushing"): "PythonFMU",
    ("bushcli/export/fmu/slave", "modelName"): "PythonFMU",
    ("bushcli/export/fmu/slave", "exit_initialization_mode"): "PythonFMU",
    ("bushcli/export/fmu/slave", "do_step"): "PythonFMU",
    ("bushcli/report/document.py", "fold"): "the template of the page",
    ("bushcli/report/document.py", "numbers_only"): "the template of a plot",
    ("benchmarks/compare_checkouts.py", "method"): "html.parser",
    ("bushcli/runtime/canonical.py", "persistent_id"): "pickle.Pickler",
    ("geometry/shapes/", "class"): "the list of shapes, which is made from the files in the folder",
    ("geometry/shapes/", "examples"): "the tests of all shapes",
    ("geometry/shape.py", "examples"): "the tests of all shapes",
}


class Unused(NamedTuple):
    """A name that is defined and not used; `kind` is Vulture's word: function, class, variable, ..."""

    path: str
    line: int
    kind: str
    name: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.kind} {self.name} is not used"

    def reason(self, allowed: Iterable[tuple[str, str]]) -> tuple[str, str] | None:
        """Key of ``allowed`` that covers it."""
        return next(
            (
                (begin, what)
                for begin, what in allowed
                if self.path.startswith(begin) and what in (self.name, self.kind)
            ),
            None,
        )


def unused(root: Path, read: Iterable[str]) -> list[Unused]:
    """Names that files and folders under ``root`` define and do not use."""
    vulture = Vulture(ignore_decorators=VALIDATORS)
    vulture.scavenge([root / path for path in read])
    # What `select` in `report/json/common.py` takes from a value under the same name.
    parts = [
        part
        for file in (root / "bushcli/report/json").glob("*.py")
        for part in SELECTED.findall(file.read_text())
    ]
    taken = {name for part in parts for name in part.split()}
    # The functions of each result, which `bushcli.report` calls by the name of its files.
    results = [
        name for file in root.glob("bushcli/report/__init__.py") for name in RESULT.findall(file.read_text())
    ]
    taken |= {f"{name}_{kind}" for name in results for kind in ("document", "files", "json")}
    return [
        Unused(Path(item.filename).relative_to(root).as_posix(), item.first_lineno, item.typ, item.name)
        for item in vulture.get_unused_code(min_confidence=CONFIDENCE)
        if item.name not in taken
    ]


def faults(root: Path, read: Iterable[str], allowed: Mapping[tuple[str, str], str]) -> list[str]:
    """Sentences about unused names that ``allowed`` lacks, and about its entries that cover nothing."""
    found = unused(root, read)
    needed = {name.reason(allowed) for name in found}
    return [
        *(str(name) for name in found if name.reason(allowed) is None),
        *(
            f"no unused {what} in {begin or 'any file'}: remove the exception"
            for begin, what in allowed
            if (begin, what) not in needed
        ),
    ]


if __name__ == "__main__":
    sys.exit("\n".join(faults(ROOT, READ, ALLOWED)) or 0)
