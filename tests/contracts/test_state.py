"""No module keeps the results of earlier work: caches are objects that are made by a caller and passed.

The source is parsed, not imported. A module keeps something if a name of its own, or of one of its classes, is bound to
a container, a lock, or an object of a class that changes itself, or if it memoises a function of arguments.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("bushcli", "cases", "forms", "geometry")
CONTAINERS = {
    *("dict", "list", "set", "bytearray", "OrderedDict", "defaultdict", "Counter", "deque", "ChainMap"),
    *("WeakKeyDictionary", "WeakValueDictionary", "WeakSet"),
}
# Objects that exist to be changed, or to guard something that is.
CHANGING = {"Lock", "RLock", "Condition", "Semaphore", "Event", "local", "ContextVar", "count"}
MUTATORS = {
    *("append", "add", "clear", "discard", "extend", "insert", "move_to_end", "pop", "popitem", "remove"),
    *("setdefault", "update", "appendleft", "popleft", "sort", "reverse"),
}

#: What modules keep nevertheless, and why.
ALLOWED = {
    (
        "bushcli/runtime/process_cache.py",
        "_caches",
    ): "what a worker process retains between two pieces of work",
    ("bushcli/runtime/process_cache.py", "_alone"): "guards these caches against the threads of a worker",
    ("bushcli/runtime/workers.py", "_marks"): "shared with the process that asks, from the start of a worker",
    ("bushcli/runtime/workers.py", "_mark"): "the question that a worker answers, whatever work that is",
    ("bushcli/runtime/interrupt.py", "_remembered"): "signals come to the process, whatever it is doing",
    ("bushcli/runtime/interrupt.py", "_holding"): "signals come to the process, whatever it is doing",
    ("cases/kernels.py", "_KERNELS"): "compiled code, which a process loads once and cannot unload",
    # Pure functions of what identifies their result; the same arguments have the same result for everyone.
    (
        "bushcli/mismatch/scan.py",
        "_null",
    ): "a distribution by the shape of the record: numbers of a fixed seed",
    ("bushcli/recording/header/units.py", "_parse_unit"): "a unit by its spelling",
    ("bushcli/recording/header/name.py", "heading"): "the parts of a column's name by its spelling",
    ("bushcli/recording/header/vocabulary.py", "name_quality"): "how surely a name means a quantity",
    ("bushcli/mismatch/scan.py", "_pairs"): "indices of a triangle by its size",
    ("cases/compiling.py", "_places"): "points of the form compiler's dummy domain",
    ("cases/compiling.py", "_numbers"): "spaces on the form compiler's dummy domain",
    (
        "geometry/cad/find_part.py",
        "find_part",
    ): "a part by its file and the time of its change, for shapes that are equal",
    (
        "geometry/cad/meshing.py",
        "part_mesh",
    ): "a part's tetrahedra by its file, the time of its change, and their size: all modes share them",
    ("geometry/cad/ready_mesh.py", "read_mesh"): "a mesh by its file and the time of its change",
    ("geometry/isolated.py", "_reader"): "the process that reads files for this one",
    ("geometry/section/dxf.py", "read_dxf"): "a drawing by its file and the time of its change",
    ("geometry/section/find_section.py", "find_section"): "the measures of a section by its outlines",
}

Function = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def tree_of(path: Path) -> ast.Module:
    """Return the parsed source of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def sources() -> list[Path]:
    """Return every Python file of the four packages."""
    return sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


def bound(body: list[ast.stmt]) -> Iterator[tuple[str, ast.expr]]:
    """Yield the names that a module or a class binds to a value, also inside of `if` and `try`."""
    for node in body:
        if isinstance(node, ast.Assign):
            for target in node.targets:
                if isinstance(target, ast.Name):
                    yield target.id, node.value
                elif isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                    for one, value in zip(target.elts, node.value.elts, strict=False):
                        if isinstance(one, ast.Name):
                            yield one.id, value
        elif isinstance(node, ast.AnnAssign) and node.value is not None and isinstance(node.target, ast.Name):
            yield node.target.id, node.value
        elif isinstance(node, (ast.If, ast.Try, ast.With, ast.For)):
            yield from bound(node.body)
            yield from bound([*getattr(node, "orelse", []), *getattr(node, "finalbody", [])])


def called(value: ast.expr) -> str:
    """Return the name of what a call calls, without its module; empty where it is not a call of a name."""
    if not isinstance(value, ast.Call):
        return ""
    function = value.func.value if isinstance(value.func, ast.Subscript) else value.func
    if isinstance(function, ast.Attribute):
        return function.attr
    return function.id if isinstance(function, ast.Name) else ""


def is_container(value: ast.expr) -> bool:
    """Whether a value can be changed in place: a display, a comprehension, or a container of the library."""
    kinds = (ast.Dict, ast.List, ast.Set, ast.DictComp, ast.ListComp, ast.SetComp)
    return isinstance(value, kinds) or called(value) in CONTAINERS


@cache
def classes_and_imports(path: Path) -> list[ast.ClassDef | ast.ImportFrom]:
    """Return the classes that a file defines, and its imports of single names."""
    return [node for node in ast.walk(tree_of(path)) if isinstance(node, (ast.ClassDef, ast.ImportFrom))]


def class_of(name: str, path: Path) -> tuple[ast.ClassDef, Path] | None:
    """Return the class that a name means in a file, and the file that defines it; None if it is not one of ours."""
    for node in classes_and_imports(path):
        if isinstance(node, ast.ClassDef):
            if node.name == name:
                return node, path
        elif node.module and node.module.partition(".")[0] in PACKAGES:
            for alias in node.names:
                if name == (alias.asname or alias.name):
                    home = ROOT.joinpath(*node.module.split("."))
                    file = home / "__init__.py" if home.is_dir() else home.with_suffix(".py")
                    return class_of(alias.name, file) if file != path else None
    return None


def changes_itself(kind: ast.ClassDef, path: Path) -> bool:
    """Whether objects of a class keep something: a container, or an attribute that a method binds later."""
    frozen = any("frozen=True" in ast.unparse(one) for one in kind.decorator_list)
    for _, value in bound(kind.body):
        for key in value.keywords if isinstance(value, ast.Call) else ():
            if key.arg == "default_factory" and isinstance(key.value, ast.Name):
                of = class_of(key.value.id, path)
                if (of and changes_itself(*of)) or (not frozen and key.value.id in CONTAINERS):
                    return True
    for method in (node for node in kind.body if isinstance(node, Function)):
        later = method.name not in ("__init__", "__post_init__", "__new__")
        for node in ast.walk(method):
            if isinstance(node, (ast.Assign, ast.AnnAssign, ast.AugAssign)):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                own = any(is_own(one) for target in targets for one in ast.walk(target))
                if own and (later or (node.value is not None and is_container(node.value))):
                    return True
    return False


def is_own(node: ast.AST) -> bool:
    """Whether an expression is an attribute of `self`."""
    return isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "self"


def changed(nodes: list[ast.AST]) -> set[str]:
    """Return the names whose objects functions change in place, by the nodes inside of the functions."""
    found: set[str] = set()
    for node in nodes:
        if isinstance(node, ast.Subscript) and isinstance(node.ctx, (ast.Store, ast.Del)):
            found |= names(node.value)
        elif isinstance(node, ast.AugAssign):
            found |= names(node.target)
        elif isinstance(node, ast.Call):
            if isinstance(node.func, ast.Attribute) and node.func.attr in MUTATORS:
                found |= names(node.func.value)
        elif isinstance(node, ast.Global):
            found |= set(node.names)
    return found


def names(node: ast.expr) -> set[str]:
    """Return the name that an expression begins with: `a` of `a`, `a.b`, `self.a` and `Class.a`, the last part too."""
    found: set[str] = set()
    while isinstance(node, (ast.Attribute, ast.Subscript)):
        if isinstance(node, ast.Attribute):
            found.add(node.attr)
        node = node.value
    return found | ({node.id} if isinstance(node, ast.Name) else set())


def handed_on(nodes: list[ast.AST], own: set[str]) -> set[str]:
    """Return the names that functions pass to other functions of the same module, which may change their objects."""
    return {
        argument.id
        for node in nodes
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in own
        for argument in node.args
        if isinstance(argument, ast.Name)
    }


def empty(value: ast.expr) -> bool:
    """Whether a container has nothing in it yet, so that it exists to be filled."""
    if isinstance(value, ast.Dict):
        return not value.keys
    if isinstance(value, (ast.List, ast.Set)):
        return not value.elts
    return isinstance(value, ast.Call) and not value.args


def memoised(functions: list[Function]) -> Iterator[str]:
    """Yield the functions that keep their results by their arguments; one without arguments has a single result."""
    for node in functions:
        decorators = [item.func if isinstance(item, ast.Call) else item for item in node.decorator_list]
        kinds = {
            item.attr if isinstance(item, ast.Attribute) else getattr(item, "id", "") for item in decorators
        }
        given = node.args
        if kinds & {"cache", "lru_cache"} and (given.args or given.kwonlyargs or given.vararg or given.kwarg):
            yield node.name


def state(path: Path) -> set[str]:
    """Return the names under which a file keeps something."""
    tree = tree_of(path)
    functions = [node for node in ast.walk(tree) if isinstance(node, Function)]
    nodes = [node for function in functions for node in ast.walk(function)]
    filled, passed = changed(nodes), handed_on(nodes, {node.name for node in functions})
    found = set(memoised(functions))
    for node in nodes:
        found |= set(node.names) if isinstance(node, ast.Global) else set()
    classes = [node for node in classes_and_imports(path) if isinstance(node, ast.ClassDef)]
    for body in (tree.body, *(node.body for node in classes)):
        for name, value in bound(body):
            kind = class_of(called(value), path) if called(value) else None
            if (
                (is_container(value) and (name in filled or (empty(value) and name in passed)))
                or called(value) in CHANGING
                or (kind is not None and changes_itself(*kind))
            ):
                found.add(name)
    return found


def test_no_module_keeps_the_results_of_earlier_work_and_exceptions_are_needed() -> None:
    assert {
        (path.relative_to(ROOT).as_posix(), name) for path in sources() for name in state(path)
    } == ALLOWED.keys()


KEPT = {
    "a dictionary that a function fills": "_last: dict[str, int] = {}\ndef f(x):\n    _last[x] = 1\n",
    "a dictionary that another function fills": (
        "from collections import OrderedDict\n_sets = OrderedDict()\n"
        "def kept(store, name):\n    store[name] = 1\ndef f(x):\n    return kept(_sets, x)\n"
    ),
    "a list of a class": "class A:\n    seen = []\n    def f(self):\n        self.seen.append(1)\n",
    "a name that is bound anew": "last = None\ndef f(x):\n    global last\n    last = x\n",
    "an object that keeps models": "from bushcli.simulate.bodies import PreparedModels\n_prepared = PreparedModels()\n",
    "an object that keeps recordings": (
        "from bushcli.simulate.recording_cache import RecordingCache\n_cache = RecordingCache()\n"
    ),
    "an object that keeps both": "from bushcli.study.task import DesignCache\nCACHE = DesignCache()\n",
    "an object that keeps tables": "from bushcli.recording.table_cache import TableCache\ntables = TableCache()\n",
    "models of a diagnosis": "from bushcli.selection.model_cache import ModelCache\nmodels = ModelCache()\n",
    "a lock": "import threading\n_alone = threading.Lock()\n",
    "a memoised function": "from functools import lru_cache\n@lru_cache(maxsize=8)\ndef f(x):\n    return x\n",
}
NOT_KEPT = {
    "a constant": "NAMES = ['a', 'b']\nTABLE = {'a': 1}\ndef f(x):\n    return TABLE[x]\n",
    "a value": "from geometry.mesh import Refinement\nDEFAULT = Refinement()\n",
    "a table that the module fills": "TABLE = {}\nfor i in range(3):\n    TABLE[i] = 2 * i\n",
    "a registry": "from functools import cache\n@cache\ndef laws():\n    return {}\n",
    "a local dictionary": "def f(x):\n    found = {}\n    found[x] = 1\n    return found\n",
}


@pytest.mark.parametrize("text", [pytest.param(text, id=name) for name, text in KEPT.items()])
def test_what_a_module_would_keep_is_found(tmp_path: Path, text: str) -> None:
    (tmp_path / "module.py").write_text(text)
    assert state(tmp_path / "module.py")


@pytest.mark.parametrize("text", [pytest.param(text, id=name) for name, text in NOT_KEPT.items()])
def test_values_and_registries_are_not_taken_for_it(tmp_path: Path, text: str) -> None:
    (tmp_path / "module.py").write_text(text)
    assert state(tmp_path / "module.py") == set()
