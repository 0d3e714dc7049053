"""Sizes of the code: lines by package, fragments, longest files and functions (`make sizes`).

Logic is lines that are neither blank, nor comment, nor docstring. A private helper that is named once is a function
with a leading underscore whose name occurs in its module once besides its definition. An early return is not the last
statement of its function; those on the way of a recording are counted in the functions of `bushcli/recording` that run
while a file is read.

python tests/sizes.py
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("bushcli", "cases", "forms", "geometry", "tests", "benchmarks")
LONGEST = 5
# Lines below which a module may be a fragment; a plug-in, one file for one effect, format or standard, is none.
FRAGMENT = 60
PLUG_INS = {"effects/library", "standards/library", "export/writers", "recording/readers"}


def rooms() -> Iterator[tuple[str, list[Path]]]:
    """Yield each package, and each room of bushcli, with its Python files."""
    for package in PACKAGES:
        yield package, sorted((ROOT / package).rglob("*.py"))
        if package == "bushcli":
            for room in sorted(
                path for path in (ROOT / package).iterdir() if (path / "__init__.py").exists()
            ):
                yield f"  {room.name}", sorted(room.rglob("*.py"))


def lines(file: Path) -> int:
    """Return the number of lines of a file."""
    return len(file.read_text(encoding="utf-8").splitlines())


def functions(file: Path) -> Iterator[tuple[int, str]]:
    """Yield length and place of every function of a file."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield (node.end_lineno or 0) - node.lineno + 1, f"{file.relative_to(ROOT)}::{node.name}"


def logic(file: Path) -> int:
    """Return the number of lines of a file that are neither blank, nor comment, nor docstring."""
    text = file.read_text(encoding="utf-8")
    left = set(range(1, len(text.splitlines()) + 1))
    for node in ast.walk(ast.parse(text)):
        if (
            isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
            and ast.get_docstring(node) is not None
        ):
            left -= set(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    return sum(1 for n in left if (line := text.splitlines()[n - 1].strip()) and not line.startswith("#"))


def named_once(file: Path) -> int:
    """Return the number of private functions of a file whose name occurs once besides its definition."""
    text = file.read_text(encoding="utf-8")
    private = [
        node.name
        for node in ast.parse(text).body
        if isinstance(node, ast.FunctionDef) and node.name.startswith("_") and not node.name.startswith("__")
    ]
    return sum(len(re.findall(rf"\b{name}\b", text)) == 2 for name in private)


def early_returns(read: Callable[[], object]) -> tuple[int, int]:
    """Return the number of functions of bushcli/recording that a call runs, and of their early returns."""
    called: set[tuple[str, int]] = set()

    def note(frame: FrameType, event: str, argument: object) -> None:
        if event == "call":
            called.add((frame.f_code.co_filename, frame.f_code.co_firstlineno))

    sys.setprofile(note)
    try:
        read()
    finally:
        sys.setprofile(None)
    found = [
        node
        for file in (ROOT / "bushcli" / "recording").rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef)
        and (str(file), min([node.lineno, *(one.lineno for one in node.decorator_list)])) in called
    ]
    last = {
        inner.body[-1] for node in found for inner in ast.walk(node) if isinstance(inner, ast.FunctionDef)
    }
    every = {inner for node in found for inner in ast.walk(node) if isinstance(inner, ast.Return)}
    return len(found), len(every - last)


def print_returns() -> None:
    """Print the early returns on the way of a recording and of a table of dynamic stiffness."""
    from bushcli.recording import read_recording
    from bushcli.recording.dynamic.read import read_dynamic
    from bushcli.recording.dynamic.source import DynamicSource
    from bushcli.recording.source import Source

    static, dynamic = (ROOT / "examples" / name / "axial.csv" for name in ("concealed", "vibration"))
    for kind, read in (
        ("recording", lambda: read_recording(Source("axial", static))),
        ("dynamic table", lambda: read_dynamic(DynamicSource("axial", (dynamic,)))),
    ):
        functions_run, returns = early_returns(read)
        sys.stdout.write(f"{kind}: {returns} early returns in the {functions_run} functions that read it\n")


def main() -> None:
    """Print the tables."""
    out = sys.stdout.write
    heads = ("files", "lines", "logic", "under 60", "named once", "longest file", "longest function")
    out(f"{'package':24s} {' '.join(f'{head:>{max(len(head), 7)}s}' for head in heads)}\n")
    program: list[Path] = []
    for name, files in rooms():
        if name in PACKAGES[:4]:
            program += files
        longest = max((length for file in files for length, _ in functions(file)), default=0)
        sizes = list(map(lines, files))
        short = sum(
            size < FRAGMENT and file.name != "__init__.py" and "/".join(file.parts[-3:-1]) not in PLUG_INS
            for size, file in zip(sizes, files, strict=True)
        )
        once = sum(map(named_once, files))
        row = (len(files), sum(sizes), sum(map(logic, files)), short, once, max(sizes), longest)
        cells = (f"{number:{max(len(head), 7)}d}" for head, number in zip(heads, row, strict=True))
        out(f"{name:24s} {' '.join(cells)}\n")
    out("\nlongest functions of the program\n")
    for length, place in sorted((one for file in program for one in functions(file)), reverse=True)[:LONGEST]:
        out(f"{length:6d} {place}\n")
    out("longest files of the program\n")
    for length, file in sorted(((lines(file), file) for file in program), reverse=True)[:LONGEST]:
        out(f"{length:6d} {file.relative_to(ROOT)}\n")
    print_returns()


if __name__ == "__main__":
    main()
