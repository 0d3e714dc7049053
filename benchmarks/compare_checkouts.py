"""Run the commands of all examples with two checkouts and list what differs in their results.

    setup/enter python benchmarks/compare_checkouts.py OLD NEW [--slow] [--only PATTERN] [--outputs DIR]

OLD and NEW are checkouts, or folders of outputs that an earlier run left in DIR/old or DIR/new. Both run with the
Python that runs this script. JSON is compared value by value, CSV and exported files byte by byte, the terminal's text
and the text of the pages line by line; what a run cannot repeat (times, versions, digests of the code) is left out.
Of pictures only the names, and the places on the page, are compared. Exit code 1 if anything differs.
"""

from __future__ import annotations

import argparse
import difflib
import fnmatch
import html.parser
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

# Name of the run -> the commands, in a folder of its own that has the examples; the result goes to `out`.
QUICK = {
    "check-batch": "bushcli check examples/batch/case.toml --json -o out",
    "check-batch-text": "bushcli check examples/batch/case.toml",
    "check-concealed": "bushcli check examples/concealed/case.toml",
    "check-cycles": "bushcli check examples/cycles/case.toml",
    "check-cad": "bushcli check examples/cad/case.toml",
    "check-wrong-key": "bushcli check examples/batch/case.toml --set geometry.lenght=38",
    "init-rig": "bushcli init --from examples/rig/axial_bushing_07.mf4 out && bushcli check out/case.toml",
    "fit-batch": "bushcli fit examples/batch/case.toml -o out",
    "fit-batch-json": "bushcli fit examples/batch/case.toml --branch unloading --json",
    "mesh-batch": "bushcli mesh examples/batch/case.toml -o out",
    "mesh-cad": "bushcli mesh examples/cad/bushing.step -o out",
    "direct-batch": "bushcli direct examples/batch/case.toml --mesh-check -o out",
    "direct-cycles": "bushcli direct examples/cycles/case.toml -o out",
    "direct-cad": "bushcli direct examples/cad/case.toml -o out",
    "direct-matrix": "bushcli direct examples/cycles/case.toml --stiffness-matrix -o out",
    "inverse-held-out": "bushcli inverse examples/batch/case.toml --model yeoh --hold-out radial -o out",
    "inverse-laws": "bushcli inverse examples/batch/case.toml --model yeoh,neo_hookean -o out",
    "study-batch": 'bushcli study examples/batch/case.toml --vary "geometry.outer_radius=18 +- 0.1" --vary '
    '"hardness=60 +- 5" --designs 8 --limits "axial.initial=122 +- 15 %" -o out',
    "design-batch": "bushcli design examples/batch/case.toml --target axial=110 --vary geometry.length=25:40 -o out",
    "export-abaqus": "bushcli fit examples/batch/case.toml -o out && bushcli export out --to abaqus -o out/rubber.inp",
}
SLOW = {
    "diagnose-batch": "bushcli diagnose examples/batch/case.toml -o out",
    "diagnose-concealed": "bushcli diagnose examples/concealed/case.toml -o out",
    "diagnose-cad": "bushcli diagnose examples/cad/case.toml --hold-out axial "
    "--effects misalignment,dimension,cure_shrinkage -o out",
}
# Keys of result.json that no two runs share, and the times of channels and designs.
UNREPEATABLE = re.compile(r"timings_s|versions|question|(.*_)?seconds(_.*)?")
TIME = re.compile(r"\b\d+(\.\d+)? s\b|^\d{4}-\d\d-\d\d \d\d:\d\d \S+$")
VERSION = re.compile(r"\b(bushcli|python|dolfinx|gmsh|numpy|scipy|petsc) \d[\w.+]*")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--slow", action="store_true", help="the diagnoses too, which take minutes")
    parser.add_argument(
        "--only", default="*", metavar="PATTERN", help="runs whose name matches, e.g. 'direct-*'"
    )
    parser.add_argument("--outputs", type=Path, metavar="DIR", help="keep the outputs there")
    given = parser.parse_args()
    chosen = QUICK | SLOW if given.slow else QUICK
    runs = {name: text for name, text in chosen.items() if fnmatch.fnmatch(name, given.only)}
    with tempfile.TemporaryDirectory() as temporary:
        outputs = (given.outputs or Path(temporary)).resolve()
        folders = []
        for which, source in (("old", given.old.resolve()), ("new", given.new.resolve())):
            folders.append(source)
            if (source / "bushcli").is_dir():
                folders[-1] = outputs / which
                for name, text in runs.items():
                    print(f"{which}: {text}", flush=True)
                    run(source, text, folders[-1] / name)
        differing = 0
        for name in runs:
            for where, lines in differences(*(folder / name for folder in folders)):
                differing += 1
                print(f"\n== {name}: {where}", *lines, sep="\n")
    print(f"\n{differing} outputs differ" if differing else "\nno output differs")
    return 1 if differing else 0


def run(checkout: Path, text: str, folder: Path) -> None:
    """Run commands with a checkout, in a folder where the examples are; its streams and exit codes become files."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    shutil.copytree(checkout / "examples", folder / "examples")
    environment = os.environ | {"PYTHONPATH": str(checkout), "COLUMNS": "120"}
    for number, command in enumerate(text.split(" && ")):
        arguments = shlex.split(command)[1:]
        done = subprocess.run(
            [sys.executable, "-m", "bushcli.cli", *arguments, *([] if arguments[0] == "init" else ["-q"])],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        (folder / f"stdout-{number}.txt").write_text(done.stdout)
        (folder / f"stderr-{number}.txt").write_text(f"{done.stderr}exit code {done.returncode}\n")


def differences(old: Path, new: Path) -> Iterator[tuple[str, list[str]]]:
    """Yield what differs: the name of a file, and the lines of the difference."""
    names = [
        {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
        for folder in (old, new)
    ]
    for name in sorted(names[0] | names[1]):
        # What `history-*` holds serves to continue a run of the same revision.
        if name.startswith("examples") or "history-" in name:
            continue
        if name not in names[0] or name not in names[1]:
            yield name, ["only in old" if name in names[0] else "only in new"]
            continue
        if Path(name).suffix in (".png", ".svg", ".h5", ".parquet"):
            continue
        before, after = (comparable(folder / name) for folder in (old, new))
        if before != after:
            yield name, list(difflib.unified_diff(before, after, "old", "new", lineterm="", n=1))


def comparable(file: Path) -> list[str]:
    """Return the lines of a file that two runs must share."""
    text = file.read_text(errors="replace")
    if text.startswith("{"):
        return json.dumps(repeatable(json.loads(text)), indent=1).splitlines()
    if file.suffix == ".html":
        return [VERSION.sub(r"\1", TIME.sub("... s", line)) for line in page_text(text)]
    if file.suffix == ".txt":
        # Columns of times may differ in their width.
        return [re.sub(r"\s{2,}", "  ", TIME.sub("... s", line)) for line in text.splitlines()]
    return text.splitlines()


def repeatable(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: repeatable(v) for k, v in value.items() if not UNREPEATABLE.fullmatch(k)}
    return [repeatable(item) for item in value] if isinstance(value, list) else value


class PageText(html.parser.HTMLParser):
    """Collects the text of a page; a figure, with what is written in it, is one line."""

    HIDDEN = ("script", "style", "figure")

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []
        self.within: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note a figure; nothing within it is text."""
        if tag in self.HIDDEN:
            self.within.append(tag)
            self.lines += ["[figure]"] if self.within == ["figure"] else []

    def handle_endtag(self, tag: str) -> None:
        """End what is no text."""
        if tag in self.HIDDEN and self.within:
            self.within.pop()

    def handle_data(self, data: str) -> None:
        """Keep the text."""
        if not self.within and data.strip():
            self.lines.append(" ".join(data.split()))


def page_text(text: str) -> list[str]:
    """Return the text of an HTML page, line by line."""
    parser = PageText()
    parser.feed(text)
    return parser.lines


if __name__ == "__main__":
    sys.exit(main())
