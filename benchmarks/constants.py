"""How far the probabilities of a diagnosis depend on constants that have no other source.

Each constant is replaced in the source while its module is imported, and recordings of the development deck are
diagnosed again. ``setup/enter python benchmarks/constants.py run DIR NAME...`` appends a line per constant, value and
recording to ``constants.jsonl`` (half a minute to two each; what is there is not run again), and ``... table`` prints
``constants.md``.
"""

from __future__ import annotations

import ast
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
RESULTS = Path(__file__).with_name("constants.jsonl")


@dataclass(frozen=True)
class Constant:
    """A constant of a module of bushcli, and the values that are tried in its place, as Python expressions."""

    module: str
    name: str
    tried: tuple[str, ...]


# Halved and doubled where nothing else suggests itself; intervals of integration wider, and with more points.
CONSTANTS = (
    Constant("likelihood.noise", "_DEGREE", ("4", "7")),
    Constant("likelihood.noise", "_PER_COEFFICIENT", ("2", "5")),
    Constant("likelihood.windows", "COVERED", ("0.25", "0.75")),
    Constant("likelihood.windows", "LEAST", ("6", "12")),
    Constant("likelihood.windows", "WINDOWS", ("1", "4")),
    Constant("likelihood.windows", "_USUAL", ("0.99", "0.9999")),
    Constant("likelihood.windows", "_ROUNDS", ("3", "12")),
    Constant("likelihood.level", "SIZES", ("np.concatenate([[0.0], np.geomspace(0.01, 1e9, 45)])",)),
    Constant("likelihood.level", "NODES", ("np.linspace(-3.5, 3.5, 81)",)),
    Constant("likelihood.features", "DEGREE", ("4", "7")),
    Constant("likelihood.features", "PER_COEFFICIENT", ("2", "5")),
    Constant("likelihood.form", "_NODES", ("np.linspace(-4.0, 4.0, 33, dtype=np.float64)",)),
    Constant("likelihood.form", "_NOISE_NODES", ("np.linspace(-4.0, 4.0, 17, dtype=np.float64)",)),
    Constant("likelihood.form", "UNKNOWN", ("(0.001, 0.5)", "(0.002, 1.0)")),
    Constant("likelihood.form", "_SIZES", ("np.geomspace(*UNKNOWN, 50)",)),
    Constant("likelihood.form", "UNKNOWN_IN_CHANNEL", ("0.25", "0.75")),
    Constant("evidence.prior", "UNKNOWN", ("0.005", "0.02")),
    Constant("evidence.prior", "LAW_SHARE", ("0.5", "2.0")),
    Constant("evidence.laplace", "AT_OFF", ("0.01", "0.3")),
    Constant("evidence.amplitudes", "MOST_SOLUTIONS", ("15", "60")),
    Constant("evidence.amplitudes", "SAME", ("1e-8", "1e-4")),
    Constant("likelihood.linearisation", "_RANK", ("1e-12", "1e-8")),
    Constant("likelihood.linearisation", "OWN", ("5e-4", "2e-3")),
    Constant("selection.neighbourhood", "NEIGHBOURS", ("0.005", "0.02")),
    Constant("selection.columns", "FLAT", ("5e-4", "2e-3")),
    Constant("selection.prediction", "TRIED", ("1.5", "4.0")),
    Constant("selection.predict", "POINTS", ("1", "4")),
    Constant("selection.predict", "PIECES", ("4", "9")),
    Constant("selection.fit", "VALLEY", ("(8, 1e-2)", "(8, 2.5e-3)")),
    Constant("selection.fit", "TURNS", ("2", "6")),
    Constant("evidence.density", "SETTLED", ("1.15", "1.6")),
    Constant("selection.fit", "MOST_EVALUATIONS", ("20", "80")),
)


# -- a changed constant ------------------------------------------------------------------------------------------


class _ModuleLoader(SourceFileLoader):
    """Loads a module in which a constant has another value."""

    def __init__(self, fullname: str, path: str, constant: str, value: str) -> None:
        super().__init__(fullname, path)
        self._constant, self._value = constant, value

    def get_code(self, fullname: str) -> CodeType:
        """Compile the source with the other value; kept bytecode is not used."""
        tree = ast.parse(Path(self.path).read_text("utf-8"))
        replace(tree, self._constant, self._value)
        return compile(tree, self.path, "exec")


class Finder(MetaPathFinder):
    """Finds one module, with another value of one constant; all others are left to the usual finders."""

    def __init__(self, module: str, constant: str, value: str) -> None:
        self._module, self._constant, self._value = module, constant, value

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Specification of the module with the changed constant; None for all others."""
        if fullname != self._module:
            return None
        spec = PathFinder.find_spec(fullname, path)
        if spec is None or spec.origin is None:
            return None
        spec.loader = _ModuleLoader(fullname, spec.origin, self._constant, self._value)
        return spec


def replace(tree: ast.Module, name: str, value: str) -> None:
    """Replace the value that a module assigns to a name.

    Parameters
    ----------
    tree
        The module; it is changed.
    name, value
        The constant, alone or in a tuple of names, and an expression.

    Raises
    ------
    ValueError
        If the module does not assign to the name exactly once.
    """
    new, count = ast.parse(value, mode="eval").body, 0
    for statement in tree.body:
        if not isinstance(statement, ast.Assign | ast.AnnAssign):
            continue
        target = statement.target if isinstance(statement, ast.AnnAssign) else statement.targets[0]
        if isinstance(target, ast.Name) and target.id == name:
            statement.value, count = new, count + 1
        elif isinstance(target, ast.Tuple) and isinstance(statement.value, ast.Tuple):
            for i, element in enumerate(target.elts):
                if isinstance(element, ast.Name) and element.id == name:
                    statement.value.elts[i], count = new, count + 1
    if count != 1:
        raise ValueError(f"{name} is assigned {count} times")
    ast.fix_missing_locations(tree)


def diagnose(module: str, name: str, value: str, arguments: Sequence[str]) -> None:
    """Run ``bushcli diagnose`` in this process with another value of a constant ("-": as it is)."""
    sys.path.insert(0, str(ROOT))
    if module != "-":
        sys.meta_path.insert(0, Finder(f"bushcli.{module}", name, value))
    from bushcli.cli import main

    main(["diagnose", *arguments])


# -- all of them -------------------------------------------------------------------------------------------------


def _lines() -> list[dict[str, Any]]:
    return list(map(json.loads, RESULTS.read_text("utf-8").splitlines())) if RESULTS.exists() else []


def _tasks(names: Sequence[str]) -> Iterator[tuple[str, str, str, str]]:
    for name in names:
        yield "-", "-", "-", name
    for constant in CONSTANTS:
        for value in constant.tried:
            for name in names:
                yield constant.module, constant.name, value, name


def run(folder: Path, names: Sequence[str]) -> None:
    """Diagnose recordings with each value of each constant.

    Parameters
    ----------
    folder
        Folder of the development deck's cases.
    names
        Names of recordings, such as "021".
    """
    known = {(x["module"], x["constant"], x["value"], x["case"]) for x in _lines()}
    for task in _tasks(names):
        if task in known:
            continue
        module, constant, value, name = task
        with tempfile.TemporaryDirectory() as out:
            call = [sys.executable, __file__, "diagnose", module, constant, value]
            case = str(folder / name / "case.toml")
            done = subprocess.run(
                [*call, case, "--no-maps", "-o", out], capture_output=True, text=True, check=False
            )
            file = Path(out) / "result.json"
            line: dict[str, Any] = {"module": module, "constant": constant, "value": value, "case": name}
            if file.exists():
                result = json.loads(file.read_text("utf-8"))
                line |= {"verdict": result["verdict"], "probability": result["probability"]}
            else:
                line |= {"code": done.returncode, "stderr": done.stderr[-400:]}
        with RESULTS.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(line) + "\n")
        print(*task, line.get("verdict"), flush=True)


def table() -> str:
    """Markdown: the largest change of a probability by each value of each constant."""
    lines = _lines()
    usual = {x["case"]: x for x in lines if x["module"] == "-"}
    rows = [
        "| module | constant | value | largest change | of | in | verdicts that change |",
        "|" + " --- |" * 7,
    ]
    for constant in CONSTANTS:
        for value in constant.tried:
            key = (constant.module, constant.name, value)
            matches = [
                x for x in lines if (x["module"], x["constant"], x["value"]) == key and x["case"] in usual
            ]
            changes = [
                (abs((p or 0.0) - (usual[x["case"]]["probability"].get(effect) or 0.0)), effect, x["case"])
                for x in matches
                for effect, p in x.get("probability", {}).items()
            ]
            if not changes:
                continue
            most, effect, case = max(changes)
            other = sum(x.get("verdict") != usual[x["case"]]["verdict"] for x in matches)
            module = constant.module.replace(".", "/")
            cells = [f"`{module}`", f"`{constant.name}`", f"`{value}`", f"{most:.3f}", effect, case]
            rows.append("| " + " | ".join([*cells, f"{other} of {len(matches)}"]) + " |")
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["run", folder, *names]:
            run(Path(folder), names)
        case ["table"]:
            print(table(), end="")
        case ["diagnose", module, constant, value, *arguments]:
            diagnose(module, constant, value, arguments)
        case _:
            raise SystemExit(__doc__)
