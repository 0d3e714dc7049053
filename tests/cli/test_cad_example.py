"""The bundled CAD example and the README's way from a part to a curve, command by command."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "cad-example.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
TRUTH = json.loads((ROOT / "examples" / "cad" / "truth" / "truth.json").read_text(encoding="utf-8"))


def commands(text: str) -> list[str]:
    """Return the lines that a reader types."""
    blocks = re.findall(r"```console\n(.*?)```", text, re.DOTALL)
    return [line[2:] for block in blocks for line in block.splitlines() if line.startswith("$ ")]


def run(lines: list[str], folder: Path) -> None:
    (folder / "examples").symlink_to(ROOT / "examples")
    for line in lines:
        done = subprocess.run(line, shell=True, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"


def result(folder: Path) -> Any:
    return json.loads((folder / "result.json").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_the_readme_goes_from_a_part_to_a_curve_in_five_commands(tmp_path: Path) -> None:
    section = README.partition("## From a CAD file to a curve")[2].partition("\n## ")[0]
    lines = commands(section)
    assert len(lines) == 5
    run(lines, tmp_path)
    assert (tmp_path / "part" / "geometry.png").stat().st_size > 10_000
    curves = result(tmp_path / "part" / "out")["load_cases"]
    assert [one["mode"] for one in curves] == ["axial", "radial"]
    assert all(one["stiffness"]["initial"] > 50.0 for one in curves)


def volume() -> float:
    """Volume of the part by a formula, mm^3: a ring less two kidneys with round ends."""
    d = TRUTH["drawn"]
    r, R = d["void_inner_radius"], d["void_outer_radius"]
    kidney = 0.5 * np.radians(d["void_angle"]) * (R**2 - r**2) + np.pi * (0.5 * (R - r)) ** 2
    area = np.pi * (d["outer_radius"] ** 2 - d["inner_radius"] ** 2) - 2 * kidney
    return float(area * d["length"])


@pytest.mark.slow
def test_every_command_of_the_page_does_what_it_says(tmp_path: Path) -> None:
    run(commands(PAGE), tmp_path)
    measures = result(tmp_path / "part")["geometry"]["measures"]
    assert measures["rubber"] == pytest.approx(volume(), rel=1e-6)
    direct = {one["mode"]: one for one in result(tmp_path / "direct")["load_cases"]}
    assert direct["radial"]["recording"]["rms_percent"] > 5 * TRUTH["noise_percent"]
