"""Parts whose surfaces meet under `mpirun -n 2`: the force of one process, shared at first or not."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
# A slot between two bonds, whose walls meet at 0.53 mm (tests/verification/test_contact.py).
CASE = """
[geometry]
shape = "section"
outline = [
    { from = [10.0, 0.0], to = [20.0, 0.0], name = "outer" },
    { to = [20.0, 4.7] },
    { to = [15.1619, 4.7] },
    { to = [15.1619, 5.3], arc_through = [12.8, 5.0] },
    { to = [20.0, 5.3] },
    { to = [20.0, 10.0] },
    { to = [10.0, 10.0], name = "inner" },
    { to = [10.0, 0.0] },
]
[material]
law = "yeoh"
bulk_modulus = 2000.0
[material.parameters]
C10 = 0.5
C20 = -0.05
C30 = 0.01
[[load_cases]]
mode = "axial"
amplitude = -0.7
steps = 4
"""

pytestmark = pytest.mark.skipif(shutil.which("mpirun") is None, reason="there is no mpirun on the PATH")


def run(case, *options, ranks=1):
    environment = os.environ | {
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
        "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
        "PYTHONPATH": str(ROOT),
    }
    launcher = ("mpirun", "-n", str(ranks)) if ranks > 1 else ()
    done = subprocess.run(
        [*launcher, sys.executable, "-m", "bushcli.cli", "direct", str(case), "--json", "-q", *options],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def case(tmp_path):
    file = tmp_path / "case.toml"
    file.write_text(CASE)
    return file


def names(found):
    return {one["name"] for one in found["problems"]}


def curve(found):
    (channel,) = found["load_cases"]
    return np.array(channel["force"])


@pytest.mark.slow
@pytest.mark.parametrize("asked", [(), ("--set", "geometry.contact=true")])
def test_two_processes_find_the_force_of_one_where_surfaces_meet(case, asked):
    alone, together = run(case, *asked), run(case, *asked, ranks=2)
    np.testing.assert_allclose(curve(together), curve(alone), rtol=1e-9)
    assert "not_shared" in names(together)
    assert "not_shared" not in names(alone)


@pytest.mark.slow
def test_a_mesh_whose_surfaces_do_not_meet_is_shared(case):
    opened = run(case, "--set", "load_cases.0.amplitude=0.5", ranks=2)
    assert "not_shared" not in names(opened)
    apart = run(case, "--set", "load_cases.0.amplitude=0.5")
    np.testing.assert_allclose(curve(opened), curve(apart), rtol=1e-6)
