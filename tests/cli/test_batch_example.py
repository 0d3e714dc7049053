"""docs/batch.md, command by command, in a folder of its own."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "batch.md").read_text(encoding="utf-8")


def commands() -> list[str]:
    """Return the lines that a reader types."""
    blocks = re.findall(r"```console\n(.*?)```", PAGE, re.DOTALL)
    return [line[2:] for block in blocks for line in block.splitlines() if line.startswith("$ ")]


@pytest.mark.slow
def test_every_command_of_the_page_does_what_it_says(tmp_path: Path) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    said = ""
    for line in commands():
        done = subprocess.run(line, shell=True, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"
        said += done.stdout

    def result(folder: str) -> Any:
        return json.loads((tmp_path / folder / "result.json").read_text(encoding="utf-8"))

    (shown,) = re.findall(r"```\n(20 parts.*?)```", PAGE, re.DOTALL)
    assert shown in said
    found = result("out")
    assert f"{found['forward_solves']} simulations here, in place of {20 * found['forward_solves']}" in PAGE
    # The rubber of examples/parts/make.py times the mean factor of the parts.
    mean = sum(one["factor"] for one in found["parts"] if not one["outlier"]) / 15
    assert mean == pytest.approx(1.0, abs=1e-3)
    assert found["parameters"]["C10"]["value"] == pytest.approx(0.5, rel=0.02)
    axial = next(one for one in result("mean")["load_cases"] if one["mode"] == "axial")
    assert axial["recording"]["rms_percent"] < 0.1
    radial = next(one for one in result("radial")["load_cases"] if one["mode"] == "radial")
    assert radial["force"][-1] == pytest.approx(2000.0, rel=1e-6)
    assert result("compared")["keys"]
