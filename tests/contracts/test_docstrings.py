"""Docstrings describe the arguments that other rooms give; functions and files, in C too, stay short enough to be read.

The source is parsed, not imported: the check needs neither DOLFINx nor a mesh.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("bushcli", "cases", "forms", "geometry")

#: Of a Python function, statements of inner functions included; docstrings count for nothing.
STATEMENTS_OF_FUNCTION = 45
#: Of a file, without its docstrings.
LINES_OF_FILE = 500
#: A C function has no statements that could be counted without a parser.
LINES_OF_FUNCTION_IN_C = 60
LENGTH_OF_LINE = 120

# In C: a line at the margin, further lines of arguments, and all from a brace alone at the margin to the next such one.
FUNCTION_IN_C = re.compile(r"^(?!typedef)\w.*\n(?: .*\n)*\{\n(?:.*\n)*?\}$", re.MULTILINE)

Function = ast.FunctionDef | ast.AsyncFunctionDef

# A number or an array needs a unit, a shape, or a word that says why it has none.
NUMERIC = re.compile(r"\b(float|Array|ndarray|NDArray|Floats)\b")
UNIT_OR_SHAPE = re.compile(
    r"""(?<!['’])\b(N|mm|MPa|kPa|s|rad|radians|degrees|deg|kg|g|Hz|K|percent|px|pixels|unit|units|dimensionless|
        shape|share|shares|ratio|factor|fraction|fractions|probability|probabilities|count|number|index|indices|
        seconds|bytes|log|nats|odds|characters|points)\b|%|\(n|\(m|\(k|\(3""",
    re.VERBOSE | re.IGNORECASE,
)


def sources() -> list[Path]:
    """Return every Python file of the four packages, relative to the root of the checkout."""
    return sorted(path.relative_to(ROOT) for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


@cache
def tree_of(path: Path) -> ast.Module:
    """Return the parsed source of a file, whose path is relative to the root of the checkout."""
    return ast.parse((ROOT / path).read_text(encoding="utf-8"))


def sources_in_c() -> list[Path]:
    """Return every C file and header of the four packages, relative to the root of the checkout."""
    return sorted(path.relative_to(ROOT) for package in PACKAGES for path in (ROOT / package).rglob("*.[ch]"))


def functions_in_c(text: str) -> dict[str, int]:
    """Return the number of lines of each C function by its first line."""
    found = [match.group().splitlines() for match in FUNCTION_IN_C.finditer(text)]
    return {lines[0]: len(lines) for lines in found}


def functions(tree: ast.Module) -> Iterator[tuple[str, Function, bool]]:
    """Yield name, node and "is a method" of the functions of a module and of its classes, without inner functions."""
    for node in tree.body:
        if isinstance(node, Function):
            yield node.name, node, False
        elif isinstance(node, ast.ClassDef):
            for member in node.body:
                if isinstance(member, Function):
                    yield f"{node.name}.{member.name}", member, True


def public(name: str) -> bool:
    """Whether no part of a dotted name begins with an underscore."""
    return not any(part.startswith("_") for part in name.split("."))


def arguments(node: Function, method: bool) -> list[ast.arg]:
    """Return the arguments of a function without `self` and `cls`."""
    given = node.args
    found = [*given.posonlyargs, *given.args]
    static = any(isinstance(item, ast.Name) and item.id == "staticmethod" for item in node.decorator_list)
    if method and not static:
        found = found[1:]
    return (
        found
        + [item for item in (given.vararg,) if item]
        + given.kwonlyargs
        + [item for item in (given.kwarg,) if item]
    )


def described(docstring: str) -> dict[str, str]:
    """Return the arguments that the section `Parameters` of a numpydoc docstring names, with what it says of each."""
    found: dict[str, str] = {}
    lines = docstring.splitlines()
    if "Parameters" not in [line.strip() for line in lines]:
        return found
    start = [line.strip() for line in lines].index("Parameters") + 2
    names: list[str] = []
    for number, line in enumerate(lines[start:], start):
        below = lines[number + 1].strip() if number + 1 < len(lines) else ""
        if below and set(below) == {"-"}:
            break
        if line and not line.startswith(" "):
            names = [name.strip().lstrip("*") for name in line.split(":")[0].split(",")]
            found.update({name: line.partition(":")[2] for name in names})
        else:
            for name in names:
                found[name] += " " + line.strip()
    return found


def is_command(node: Function) -> bool:
    """Whether a function is a command of click: its docstring is its help, where each option has its own text."""
    return any("click.command" in ast.unparse(item) for item in node.decorator_list)


def faults(node: Function, method: bool) -> list[str]:
    """Return what the docstring of a function with two or more arguments lacks, unless the class above it has it."""
    given = arguments(node, method)
    overrides = any(ast.unparse(item) == "override" for item in node.decorator_list)
    if len(given) < 2 or is_command(node) or overrides:
        return []
    said = described(ast.get_docstring(node) or "")
    missing = [item.arg for item in given if not said.get(item.arg, "").strip()]
    unmeasured = [
        item.arg
        for item in given
        if item.arg not in missing
        and item.annotation is not None
        and NUMERIC.search(ast.unparse(item.annotation))
        and not UNIT_OR_SHAPE.search(said[item.arg])
    ]
    return [f"{name} is not described" for name in missing] + [
        f"{name} has no unit or shape" for name in unmeasured
    ]


def room(path: Path) -> tuple[str, ...]:
    """Return the room of a file: a package of bushcli, `forms`, `cases` or `geometry`."""
    return path.parts[:2] if path.parts[0] == "bushcli" and len(path.parts) > 2 else path.parts[:1]


@cache
def asked_for() -> frozenset[str]:
    """Return what modules of another room import, and what a room hands on in its `__init__`, by full name."""
    found: set[str] = set()
    for path in sources():
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.ImportFrom) and node.module:
                home = Path(*node.module.split("."), "module.py")
                if room(home) != room(path) or path.name == "__init__.py":
                    found.update(f"{node.module}.{item.name}" for item in node.names)
    return frozenset(found)


def is_asked_for(path: Path, name: str) -> bool:
    """Whether a caller outside the room of a file may use one of its functions, or its class, or the whole module."""
    module = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
    return module in asked_for() or f"{module}.{name.split('.')[0]}" in asked_for()


def lacks(path: Path) -> list[str]:
    """Return the functions of a file that other rooms use and whose docstrings lack something, with what they lack."""
    return [
        f"{path}:{node.lineno} {name}: {', '.join(missing)}"
        for name, node, method in functions(tree_of(path))
        if public(name) and is_asked_for(path, name) and (missing := faults(node, method))
    ]


def test_arguments_are_described() -> None:
    """A function with two or more arguments that another room calls has a section `Parameters` with each of them."""
    assert [lack for path in sources() for lack in lacks(path)] == []


def test_what_another_room_calls_is_known() -> None:
    """`report` hands its functions on; a helper of its drawings is its own business."""
    assert is_asked_for(Path("bushcli/report/__init__.py"), "as_json")
    assert is_asked_for(Path("geometry/mesh.py"), "build")
    assert not is_asked_for(Path("bushcli/report/drawing/zoom.py"), "svg")


def docstring_of(node: ast.AST) -> ast.Expr | None:
    """Return the statement that is the docstring of a module, class or function."""
    body = getattr(node, "body", None)
    if not isinstance(node, ast.Module | ast.ClassDef | Function) or not body:
        return None
    head = body[0]
    text = (
        isinstance(head, ast.Expr)
        and isinstance(head.value, ast.Constant)
        and isinstance(head.value.value, str)
    )
    return head if text else None


def statements(node: Function) -> int:
    """Return the number of statements of a function, without docstrings."""
    inside = list(ast.walk(node))
    return sum(isinstance(item, ast.stmt) for item in inside) - 1 - sum(map(bool, map(docstring_of, inside)))


def code_lines(text: str, tree: ast.Module) -> int:
    """Return the number of lines of Python code, without docstrings."""
    docstrings = filter(None, map(docstring_of, ast.walk(tree)))
    return len(text.splitlines()) - sum((item.end_lineno or 0) - item.lineno + 1 for item in docstrings)


def test_functions_are_short() -> None:
    """No function has more than 45 statements."""
    long = {
        f"{path}::{node.name}": count
        for path in sources()
        for node in ast.walk(tree_of(path))
        if isinstance(node, Function) and (count := statements(node)) > STATEMENTS_OF_FUNCTION
    }
    assert not long


def test_files_are_short() -> None:
    """No file has more than 500 lines; docstrings count for nothing."""
    long = {
        str(path)
        for path in sources()
        if code_lines((ROOT / path).read_text("utf-8"), tree_of(path)) > LINES_OF_FILE
    }
    long |= {
        str(path)
        for path in sources_in_c()
        if len((ROOT / path).read_text("utf-8").splitlines()) > LINES_OF_FILE
    }
    assert not long


def test_docstrings_count_for_nothing() -> None:
    """Statements of inner functions and branches count, docstrings do not."""
    text = (
        'def f(x):\n    """Do."""\n    def g():\n        """Go on.\n\n        """\n        return 1\n'
        "    if x:\n        y = 2\n    return y\n"
    )
    tree = ast.parse(text)
    (node,) = tree.body
    assert isinstance(node, Function)
    assert statements(node) == 5
    assert code_lines(text, tree) == 6


@pytest.mark.parametrize("path", sources_in_c(), ids=str)
def test_c_is_as_short_as_python(path: Path) -> None:
    """No function of a C file is longer than 60 lines, and no line longer than ruff lets one of Python be."""
    text = (ROOT / path).read_text(encoding="utf-8")
    lines = text.splitlines()
    assert [number for number, line in enumerate(lines, 1) if len(line) > LENGTH_OF_LINE] == []
    found = functions_in_c(text)
    assert len(found) == lines.count("}")
    assert {name for name, count in found.items() if count > LINES_OF_FUNCTION_IN_C} == set()


def test_a_c_function_reaches_from_its_first_line_to_its_last_brace() -> None:
    """Declarations and comments around it do not count."""
    struct = "typedef struct\n{\n    int a;\n} one;\n\n"
    text = (
        struct
        + "/* Says what. */\nstatic int f(int a,\n             int b)\n{\n    if (a)\n    {\n    }\n    return b;\n}\n"
    )
    assert functions_in_c(text) == {"static int f(int a,": 8}
