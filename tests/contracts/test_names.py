"""A name means one thing: every public class has a name of its own, and no function is written twice."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("bushcli", "cases", "forms", "geometry")
#: Characters of a function's body from which on a copy is no accident.
_LONG = 80
#: The hook of a package that loads its names on first use has to stand in each of them.
_HOOKS = {"__getattr__"}
#: Classes that share a name, with the reason.
SEVERAL = {
    # The class of an FMU, under the name that it has in the script in the FMU; a script has one of the two, and no
    # module imports either.
    "Bushing": ("bushcli.export.fmu.slave2", "bushcli.export.fmu.slave3"),
    # Parts of a document or of a plot, and what the same word means in its own field: the section of a bushing, the
    # rows of a text file.
    "Section": ("bushcli.report.document", "geometry.shapes.section"),
    "Table": ("bushcli.recording.text.table", "bushcli.report.document"),
}


def modules():
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            yield (
                path.relative_to(ROOT).with_suffix("").as_posix().replace("/", "."),
                ast.parse(path.read_text()),
            )


def test_every_class_has_a_name_of_its_own():
    homes = defaultdict(list)
    for module, tree in modules():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                homes[node.name].append(module)
    several = {name: tuple(found) for name, found in homes.items() if len(found) > 1}
    assert several == SEVERAL


def test_no_function_is_written_twice():
    written = defaultdict(list)
    for module, tree in modules():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef) and node.name not in _HOOKS:
                has_docstring = ast.get_docstring(node, clean=False) is not None
                body = "\n".join(ast.unparse(line) for line in node.body[has_docstring:])
                if len(body) > _LONG:
                    written[body].append(f"{module}.{node.name}")
    assert [places for places in written.values() if len(places) > 1] == []
