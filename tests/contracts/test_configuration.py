"""Nothing is configured after its construction: an object's attributes are assigned by its own methods alone.

The source is parsed, not imported. A place is found if it assigns or deletes an attribute, or an element of an
attribute, of anything but `self` or `cls`: `problem.stage = "profile"`, `self.model.tolerance = 1e-6`.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("bushcli", "cases", "forms", "geometry")
OWN = {"self", "cls"}
SETTERS = {"setattr", "delattr", "object.__setattr__", "object.__delattr__"}

#: Where the path begins and how the target ends -> why it is assigned nevertheless.
ALLOWED = {
    ("", ".array"): "values of a DOLFINx function or of a PETSc vector: the view for reading and writing",
    ("", ".array_w"): "values of a PETSc vector: the view for writing",
    ("cases/fields.py", "mesh.cells.name"): "DOLFINx's MeshTags have no argument for it",
    ("cases/fields.py", "mesh.facets.name"): "DOLFINx's MeshTags have no argument for it",
    ("cases/material.py", ".total"): "an array that a compiled function fills: its values, not another array",
    (
        "cases/material.py",
        ".parameters",
    ): "an array that a compiled function reads: its values, not another array",
    (
        "cases/material.py",
        ".values",
    ): "an array that a compiled function reads: its values, not another array",
    ("cases/system.py", ".values"): "the entries of a matrix, which are added up anew each time",
    (
        "bushcli/simulate/bodies.py",
        ".geometry.x",
    ): "DOLFINx's array of the nodes, which is how a mesh is moved",
    ("cases/", ".value"): "a DOLFINx constant: compiled forms read what is assigned to it",
    ("bushcli/cli/", "sys"): "standard streams that the caller closed, or that can no longer be written",
    ("bushcli/cli/", "sys.stdout"): "the interpreter flushes it at exit, and would fail again",
    ("bushcli/recording/isolated.py", "sys.stdout"): "a reader that prints must not write into the answer",
    ("bushcli/cli/", "os.environ"): "settings of the caller with which libraries would not start",
    ("bushcli/cli/", "error.message"): "click prints the message of the error that passes",
    ("bushcli/export/fmu/build.py", "sys.path"): "undoes what a library that packs FMUs did to it",
    ("bushcli/export/fmu/build.py", "sys.modules"): "undoes what a library that packs FMUs did to them",
    ("bushcli/export/writers/", ".text"): "an element of ElementTree has no argument for its text",
    ("bushcli/runtime/interrupt.py", "sys.unraisablehook"): "how Python is given a hook",
    ("bushcli/runtime/interrupt.py", "os.environ"): "PETSc and UCX take options from it alone",
    ("bushcli/runtime/interrupt.py", "timer.daemon"): "threading.Timer has no argument for it",
}


def parts(target: ast.expr) -> Iterator[ast.expr]:
    """Yield the single targets of an assignment; of an element of something, what it is an element of."""
    if isinstance(target, (ast.Tuple, ast.List)):
        for one in target.elts:
            yield from parts(one)
    elif isinstance(target, (ast.Starred, ast.Subscript)):
        yield from parts(target.value)
    else:
        yield target


def targets(node: ast.AST) -> list[ast.expr]:
    """Return what a statement assigns to or deletes."""
    if isinstance(node, (ast.Assign, ast.Delete)):
        return node.targets
    if isinstance(node, (ast.AugAssign, ast.AnnAssign, ast.For, ast.AsyncFor, ast.comprehension)):
        return [node.target]
    if isinstance(node, (ast.With, ast.AsyncWith)):
        return [one.optional_vars for one in node.items if one.optional_vars is not None]
    return []


def is_own(node: ast.expr) -> bool:
    """Whether an expression is `self` or `cls`."""
    return isinstance(node, ast.Name) and node.id in OWN


def foreign(tree: ast.AST) -> set[str]:
    """Return the attributes of other objects that the source assigns, and the objects that it hands to `setattr`."""
    found = set()
    for node in ast.walk(tree):
        for target in targets(node):
            for one in parts(target):
                if isinstance(one, ast.Attribute) and not is_own(one.value):
                    found.add(ast.unparse(one))
        if isinstance(node, ast.Call) and ast.unparse(node.func) in SETTERS and not is_own(node.args[0]):
            found.add(ast.unparse(node.args[0]))
    return found


def sources() -> dict[str, set[str]]:
    """Return what each file of the four packages assigns of other objects."""
    files = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
    return {path.relative_to(ROOT).as_posix(): foreign(ast.parse(path.read_text("utf-8"))) for path in files}


def is_exception(path: str, target: str, begin: str, end: str) -> bool:
    """Whether a place is meant by an exception for paths that begin, and targets that end, like this."""
    return path.startswith(begin) and (target.endswith(end) if end.startswith(".") else target == end)


def test_attributes_are_assigned_by_their_own_object_and_exceptions_are_needed() -> None:
    needed, other = set(), []
    for path, targets_of_file in sources().items():
        for target in targets_of_file:
            exceptions = {known for known in ALLOWED if is_exception(path, target, *known)}
            needed |= exceptions
            other += [] if exceptions else [f"{path}: {target}"]
    assert other == []
    assert ALLOWED.keys() - needed == set()


CONFIGURED = {
    "an attribute": ("problem.stage = 'profile'", "problem.stage"),
    "an attribute of an attribute": ("self.simulation.failure_limit = 3", "self.simulation.failure_limit"),
    "one of several": ("a, (model.share, *b) = found", "model.share"),
    "by an operator": ("problem.solves += 1", "problem.solves"),
    "with a type": ("problem.best: float = 1.0", "problem.best"),
    "an element": ("self.model.values[0] = 1.0", "self.model.values"),
    "a loop": ("for model.stage in (0, 1):\n    pass", "model.stage"),
    "a context": ("with opened() as model.file:\n    pass", "model.file"),
    "a deletion": ("del model.cache['a']", "model.cache"),
    "a copy of itself": ("other = copy(self)\nother.failure_limit = 1", "other.failure_limit"),
    "by name": ("setattr(channel, name, 1)", "channel"),
    "of a frozen object": ("object.__setattr__(task, 'start', 1)", "task"),
}
NOT_CONFIGURED = {
    "a local name": "share = 1.0",
    "an element of a local": "found[0] = 1.0",
    "its own attribute": "self.stage = 'profile'",
    "an element of its own": "self.known[key] = 1.0",
    "the class's own": "cls.count += 1",
    "a frozen object's own": "object.__setattr__(self, 'array', array)",
    "a question": "same = problem.stage == 'profile'",
    "a verb": "problem.watch(states)",
}


@pytest.mark.parametrize(
    ("text", "target"), [pytest.param(*one, id=name) for name, one in CONFIGURED.items()]
)
def test_a_configuration_is_found(text: str, target: str) -> None:
    assert foreign(ast.parse(text)) == {target}


@pytest.mark.parametrize("text", [pytest.param(text, id=name) for name, text in NOT_CONFIGURED.items()])
def test_nothing_else_is_taken_for_one(text: str) -> None:
    assert foreign(ast.parse(text)) == set()
