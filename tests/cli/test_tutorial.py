"""The tutorial, command by command, in a folder of its own."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("asammdf")
pytest.importorskip("fmpy")
pytest.importorskip("pythonfmu")
pytest.importorskip("pyarrow")

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")


def commands() -> list[str]:
    """Return the lines that a reader types."""
    blocks = re.findall(r"```console\n(.*?)```", PAGE, re.DOTALL)
    return [line[2:] for block in blocks for line in block.splitlines() if line.startswith("$ ")]


def result(folder: Path) -> Any:
    return json.loads((folder / "result.json").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_every_command_of_the_tutorial_does_what_the_page_says(tmp_path: Path) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for line in commands():
        done = subprocess.run(line, shell=True, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"
    truth = json.loads((ROOT / "examples" / "rig" / "truth" / "truth.json").read_text(encoding="utf-8"))
    found = result(tmp_path / "out")
    assert found["verdict"] == "missing_physics"
    assert [one["name"] for one in found["effects"]] == list(truth["effects"])
    assert found["probability"]["viscoelasticity"] > 0.99
    for name, value in truth["effects"]["viscoelasticity"].items():
        one = found["effects"][0]["parameters"][name]
        # The numbers of the page, and the truth within three standard deviations of them.
        assert abs(one["value"] - value) < 3 * one["std"]
    assert "*VISCOELASTIC, TIME=PRONY" in (tmp_path / "rubber.inp").read_text(encoding="utf-8")
    assert 0.0 <= result(tmp_path / "study")["answers"]["axial.initial"]["yield"]["share"] <= 1.0
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    code += "assert 0.0 < force[-1] < 0.95 * force[20], force[[20, -1]]\n"
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
