"""The literature's model as an example: a plain ring with self-contact, six axial and six radial cycles."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from click.testing import CliRunner

from bushcli.cli import main

CASE = Path(__file__).parents[2] / "examples" / "cycles" / "case.toml"
# A tenth of the unknowns: the radial force is some per cent too large.
SMALL = ("mesh.elements_across=2", "mesh.elements_along=4", "mesh.elements_around=8")


def cycles(*changes: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    arguments = ["direct", str(CASE), "--json", "-q"]
    for change in changes:
        arguments += ["--set", change]
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 0, done.output
    found = json.loads(done.output)
    assert found["case"]["geometry"]["contact"] is True
    return {
        one["mode"]: (np.array(one["displacement"]), np.array(one["force"])) for one in found["load_cases"]
    }


def check(curves: dict[str, tuple[np.ndarray, np.ndarray]]) -> None:
    for mode, reach in (("axial", 8.0), ("radial", 3.0)):
        q, force = curves[mode]
        tops, bottoms = (force[np.isclose(q, sign * reach)] for sign in (1.0, -1.0))
        assert (len(tops), len(bottoms)) == (6, 6)
        # Without memory all cycles are the same curve, and contact without friction dissipates nothing.
        np.testing.assert_allclose(tops, tops[0], rtol=1e-5)
        np.testing.assert_allclose(bottoms, -tops[0], rtol=1e-3)
        assert q[-1] == 0.0
        assert abs(force[-1]) < 1e-4 * tops[0]


def test_six_cycles_run_and_are_one() -> None:
    check(cycles(*SMALL, "load_cases.0.steps=4", "load_cases.1.steps=4"))
