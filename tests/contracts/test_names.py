"""A name means one thing: classes that other rooms use have names of their own, and no function is written twice."""

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


def modules():
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            yield (
                path.relative_to(ROOT).with_suffix("").as_posix().replace("/", "."),
                ast.parse(path.read_text()),
            )


def room(module: str) -> str:
    """Return the room of a module: a package, within bushcli one of its packages."""
    parts = module.split(".")
    return ".".join(parts[: 2 if parts[0] == "bushcli" else 1])


def test_classes_used_in_other_rooms_have_names_of_their_own():
    homes, users = defaultdict(set), defaultdict(set)
    for module, tree in modules():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].add(module)
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                for name in node.names:
                    if room(node.module) != room(module):
                        users[name.name].add(node.module)
    # A package may pass on the classes of its modules.
    used = {
        name: {home for home in found if any(home == user or room(home) == user for user in users[name])}
        for name, found in homes.items()
    }
    several = {name: sorted(found) for name, found in used.items() if len(found) > 1}
    assert several == {}


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
