"""A study and a design under `mpirun -n 3` (one rank leads, two simulate) as in one process."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CASE = """
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0
[mesh]
elements_across = 2
elements_along = 4
elements_around = 8
[material]
law = "yeoh"
bulk_modulus = 2000.0
[material.parameters]
C10 = 0.2087
C20 = -0.0108
C30 = 0.00074
[[load_cases]]
mode = "radial"
amplitude = 1.0
steps = 2
"""

pytestmark = pytest.mark.skipif(shutil.which("mpirun") is None, reason="there is no mpirun on the PATH")


def run(command, case, *options, launcher=()):
    environment = os.environ | {
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
        "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
        "PYTHONPATH": str(ROOT),
    }
    return subprocess.run(
        [*launcher, sys.executable, "-m", "bushcli.cli", command, str(case), *options],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.fixture
def case(tmp_path):
    file = tmp_path / "case.toml"
    file.write_text(CASE)
    return file


def both(command, case, *options):
    """Return the results of one process and of three ranks."""
    found = []
    for launcher, own in (((), ("--workers", "1")), (("mpirun", "-n", "3"), ())):
        done = run(command, case, *options, "--json", "-q", *own, launcher=launcher)
        assert done.returncode == 0, done.stderr
        found.append(json.loads(done.stdout))
    return found


@pytest.mark.slow
def test_ranks_that_share_a_study_come_to_the_same_answers(case):
    varied = ["--vary", "geometry.outer_radius=8.5,17,18,19", "--vary", "geometry.length=30,34,38"]
    alone, together = both("study", case, *varied)
    assert together["failed"] == alone["failed"] == 3
    assert together["failures"] == alone["failures"]
    for name, one in alone["answers"].items():
        assert together["answers"][name]["mean"] == pytest.approx(one["mean"], rel=1e-9)
        assert together["answers"][name]["worst"]["highest"]["design"] == one["worst"]["highest"]["design"]


@pytest.mark.slow
def test_ranks_that_share_the_starts_of_a_design_come_to_the_same(case):
    options = ["--target", "radial=796", "--vary", "geometry.outer_radius=16:20", "--starts", "3"]
    alone, together = both("design", case, *options)
    radius = [found["design"]["geometry.outer_radius"]["value"] for found in (alone, together)]
    assert radius[0] == pytest.approx(radius[1], rel=1e-6)
    assert together["targets"]["radial"]["value"] == pytest.approx(796.0, rel=1e-5)


def test_processes_of_one_machine_are_not_asked_for_beside_ranks(case):
    options = ["--vary", "geometry.length=30,34", "--workers", "2"]
    done = run("study", case, *options, launcher=("mpirun", "-n", "2"))
    assert done.returncode == 2
    assert done.stderr.count("--workers: cannot be combined with mpirun") == 1
