"""Sizes of the code: lines by package, longest files and functions (`make sizes`).

python tests/sizes.py
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("bushcli", "cases", "forms", "geometry", "tests", "benchmarks")
LONGEST = 5


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


def main() -> None:
    """Print the tables."""
    out = sys.stdout.write
    out(f"{'package':24s} {'files':>6s} {'lines':>7s} {'longest file':>13s} {'longest function':>17s}\n")
    program: list[Path] = []
    for name, files in rooms():
        if name in PACKAGES[:4]:
            program += files
        longest = max((length for file in files for length, _ in functions(file)), default=0)
        sizes = list(map(lines, files))
        out(f"{name:24s} {len(files):6d} {sum(sizes):7d} {max(sizes):13d} {longest:17d}\n")
    out("\nlongest functions of the program\n")
    for length, place in sorted((one for file in program for one in functions(file)), reverse=True)[:LONGEST]:
        out(f"{length:6d} {place}\n")
    out("longest files of the program\n")
    for length, file in sorted(((lines(file), file) for file in program), reverse=True)[:LONGEST]:
        out(f"{length:6d} {file.relative_to(ROOT)}\n")


if __name__ == "__main__":
    main()
