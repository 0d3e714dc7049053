"""docs/filled-rubber.md: its commands, and what it says of the example's rubber."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "filled-rubber.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_one_set_of_constants_serves_loops_a_hold_frequencies_and_amplitudes(tmp_path: Path) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    (block,) = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
    for line in block.splitlines():
        done = subprocess.run(line, shell=True, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{line}\n{done.stderr}"
    slow, fast, hold = (
        np.genfromtxt(tmp_path / "out" / "loops" / f"axial-{k}.csv", delimiter=",", names=True)
        for k in (1, 2, 3)
    )
    assert np.abs(slow["force_N"] - fast["force_N"]).max() < 0.02 * np.ptp(slow["force_N"])
    assert hold["force_N"][-1] / hold["force_N"].max() == pytest.approx(1.0 - 0.18, abs=0.01)
    result = json.loads((tmp_path / "out" / "vibrations" / "result.json").read_text(encoding="utf-8"))
    axial = [one for one in result["load_cases"] if one["mode"] == "axial"]
    high = [one["stiffness"][-1] for one in axial]
    assert high[0] > 900
    assert high[-1] < 350
    assert (np.diff(high) < 0).all()
    angles = [one["loss_angle_deg"][-1] for one in axial]
    assert 0 < int(np.argmax(angles)) < len(angles) - 1
    assert all(one["reduction_error"] < 5e-4 for one in result["load_cases"])
