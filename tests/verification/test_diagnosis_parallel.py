"""The same diagnosis under `mpirun -n 2` (one rank leads, the other answers) as in one process."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CASE = ROOT / "examples" / "concealed" / "case.toml"


def run(folder, *launcher):
    options = ["--effects", "offset,rig_compliance", "--no-maps", "--json", "-o", str(folder)]
    environment = os.environ | {
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
        "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
        "PYTHONPATH": str(ROOT),
    }
    done = subprocess.run(
        [*launcher, sys.executable, "-m", "bushcli.cli", "diagnose", str(CASE), *options],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("mpirun") is None, reason="there is no mpirun on the PATH")
def test_ranks_that_share_the_refits_come_to_the_same_answer(tmp_path):
    alone, together = run(tmp_path / "1"), run(tmp_path / "2", "mpirun", "-n", "2")
    for one in (alone, together):
        assert one.pop("timings_s")
        assert one.pop("seconds") > 0
    assert together == alone
    # The first rank saves the others' results, because they may not see its folder.
    kept = [sorted(file.name for file in (tmp_path / n / "history-diagnose").glob("*.npz")) for n in "12"]
    # A fit that is abandoned may have ended on another rank.
    assert set(kept[0]) <= set(kept[1])
    assert kept[0]


@pytest.mark.skipif(shutil.which("mpirun") is None, reason="there is no mpirun on the PATH")
def test_processes_of_one_machine_are_not_asked_for_beside_ranks():
    done = subprocess.run(
        ["mpirun", "-n", "2", sys.executable, "-m", "bushcli.cli", "diagnose", str(CASE), "--workers", "2"],
        env=os.environ | {"OMPI_MCA_rmaps_base_oversubscribe": "1", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 2
    assert "--workers: cannot be used under mpirun" in done.stderr
