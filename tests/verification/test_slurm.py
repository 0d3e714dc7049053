"""The script for a SLURM cluster in docs/studies.md, with a shell in place of SLURM: the job must start a worker."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
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
[material]
law = "neo_hookean"
[material.parameters]
C10 = 0.3
[[load_cases]]
mode = "axial"
amplitude = 4.0
steps = 2
"""
#: Starts a copy of the job script at once, in a new session, as SLURM does.
SBATCH = """#!/bin/sh
cp "$1" "$JOBS/job.sh"
setsid sh "$JOBS/job.sh" >"$JOBS/job.log" 2>&1 </dev/null &
echo $! >"$JOBS/pid"
echo "Submitted batch job $!"
"""


@pytest.fixture
def slurm(tmp_path):
    """Yield an environment that has sbatch, scancel and bushcli-env; jobs end with the test."""
    pytest.importorskip("dask_jobqueue")
    programs = {"sbatch": SBATCH, "scancel": "#!/bin/sh\n", "bushcli-env": '#!/bin/sh\nexec "$@"\n'}
    (tmp_path / "bin").mkdir()
    for name, text in programs.items():
        (tmp_path / "bin" / name).write_text(text)
        (tmp_path / "bin" / name).chmod(0o755)
    path = f"{tmp_path / 'bin'}:{Path(sys.executable).parent}:{os.environ['PATH']}"
    yield os.environ | {"PATH": path, "JOBS": str(tmp_path), "PYTHONPATH": str(ROOT)}
    if (tmp_path / "pid").exists():
        with contextlib.suppress(ProcessLookupError):  # it ends with its scheduler
            os.killpg(int((tmp_path / "pid").read_text()), signal.SIGTERM)


def script() -> str:
    """Return the script of the documentation with one job on the loopback address."""
    page = (ROOT / "docs" / "studies.md").read_text(encoding="utf-8")
    [code] = [text for text in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "SLURMCluster" in text]
    own = code.replace("jobs=64", "jobs=1").replace('"port": 8786', '"port": 0, "host": "127.0.0.1"')
    assert own.count("jobs=1") == own.count("127.0.0.1") == 1
    return own


@pytest.mark.slow
def test_a_study_is_done_by_the_job_of_the_documented_script(slurm, tmp_path):
    (tmp_path / "slurm.py").write_text(script())
    (tmp_path / "case.toml").write_text(CASE)
    cluster = subprocess.Popen(
        [sys.executable, "slurm.py"], cwd=tmp_path, env=slurm, text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip
    try:
        assert cluster.stdout is not None
        said = re.fullmatch(r"--scheduler (tcp://127\.0\.0\.1:\d+), until Enter\n", cluster.stdout.readline())
        assert said is not None
        log, until = tmp_path / "job.log", time.monotonic() + 120.0
        while not log.exists() or "Registered to" not in log.read_text():
            assert time.monotonic() < until, log.read_text()
            time.sleep(0.1)
        command = [
            sys.executable,
            "-m",
            "bushcli.cli",
            "study",
            "case.toml",
            "--vary",
            "geometry.length=30,34,38",
        ]
        done = subprocess.run(
            [*command, "--scheduler", said[1], "--json", "-q"],
            cwd=tmp_path, env=slurm, capture_output=True, text=True, timeout=240, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        result = json.loads(done.stdout)
        assert (result["designs"], result["failed"]) == (3, 0)
    finally:
        try:
            cluster.communicate("\n", timeout=60)
        except subprocess.TimeoutExpired:  # on a busy machine; how a cluster ends is not tested here
            cluster.kill()
            cluster.communicate()
    job = (tmp_path / "job.sh").read_text()
    for line in ("#SBATCH -n 1", "#SBATCH --cpus-per-task=1", "#SBATCH --mem=2G", "#SBATCH -t 04:00:00"):
        assert line in job.splitlines()
    assert re.search(
        r"^bushcli-env python -m distributed\.cli\.dask_worker .*--nthreads 1 ", job, re.MULTILINE
    )
