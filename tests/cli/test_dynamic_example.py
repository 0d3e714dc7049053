"""The example of dynamic stiffness: about a car's weight, from the command line to the table."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from click.testing import CliRunner

from bushcli.cli import main

CASE = Path(__file__).parents[2] / "examples" / "dynamic" / "case.toml"
# A tenth of the unknowns: the stiffness is some per cent too large.
SMALL = ("mesh.elements_across=2", "mesh.elements_along=4", "mesh.elements_around=8")


def test_example(tmp_path: Path) -> None:
    changes = [word for change in SMALL for word in ("--set", change)]
    done = CliRunner().invoke(
        main, ["dynamic", str(CASE), "--json", "-q", "-o", str(tmp_path / "out"), *changes]
    )
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["problems"] == []
    curves = found["load_cases"]
    assert [round(one["preload"]["force"]) for one in curves[:3]] == [0, 1500, 3000]
    for one in curves:
        assert one["reduction_error"] < 1e-4
        low, high = one["stiffness"][0], one["stiffness"][-1]
        # All branches have relaxed at no frequency, and none relaxes at infinite frequency: 1 and 1 + 0.12 + 0.15 + 0.2
        # times the static rate, but for the preload and for inertia, which lowers the rate at the driving point.
        assert one["preload"]["stiffness"] < low < high < 1.5 * one["preload"]["stiffness"]
        assert 1 < max(one["loss_angle_deg"]) < 6
    table = np.genfromtxt(tmp_path / "out" / "radial-dynamic.csv", delimiter=",", names=True)
    assert len(table) == 3 * 40
    assert set(np.round(table["preload_N"])) == {0, 1500, 3000}
