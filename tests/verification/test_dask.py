"""Work shared among the workers of a real Dask scheduler; one of them is killed during a study."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DESIGNS = 60
CASE = """
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0
[material]
law = "yeoh"
bulk_modulus = 2000.0
[material.parameters]
C10 = 0.2087
C20 = -0.0108
C30 = 0.00074
[[load_cases]]
mode = "axial"
amplitude = 6.0
"""


class Process:
    """A process whose output is read as it comes, and which ends with the context."""

    def __init__(self, *arguments: object) -> None:
        self.lines: list[str] = []
        self.process = subprocess.Popen(
            [sys.executable, "-m", *map(str, arguments)],
            env=os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line)

    def said(self, pattern: str, seconds: float = 60.0) -> re.Match[str]:
        """Wait for a line of output that matches."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            found = re.search(pattern, "".join(self.lines))
            if found:
                return found
            assert self.process.poll() is None or self._reader.is_alive(), "".join(self.lines)
            time.sleep(0.02)
        raise AssertionError(f"{pattern} was not said: {''.join(self.lines)}")

    def __enter__(self) -> Process:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.terminate()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait(20)
        self._reader.join(5)
        assert self.process.stdout is not None
        self.process.stdout.close()


@pytest.fixture
def cluster(tmp_path):
    """Yield a scheduler, its address, and three workers that have registered."""
    pytest.importorskip("distributed")
    with ExitStack() as stack:
        scheduler = stack.enter_context(
            Process("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", 0, "--no-dashboard")
        )
        address = scheduler.said(r"Scheduler at: +(tcp://127\.0\.0\.1:\d+)")[1]
        options = ("--nthreads", 1, "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
        places = [("--local-directory", tmp_path / f"dask-{i}") for i in range(3)]
        workers = [
            stack.enter_context(Process("distributed.cli.dask_worker", address, *options, *place))
            for place in places
        ]
        for worker in workers:
            worker.said("Registered to")
        yield scheduler, address, workers


@pytest.mark.slow
def test_no_result_is_lost_and_none_twice_when_a_worker_is_killed(cluster, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    scheduler, address, workers = cluster
    case, out = tmp_path / "case.toml", tmp_path / "out"
    case.write_text(CASE)
    command = ("study", case, "--vary", "geometry.length=30:40", "--designs", DESIGNS, "--seed", 7)
    with Process("bushcli.cli", *command, "--scheduler", address, "-o", out) as study:
        # Midway: the first designs are done, the last are not.
        study.said(r"designs: [1-9]\d*/60")
        workers[1].process.send_signal(signal.SIGKILL)
        study.said(r"wrote ", 120.0)
        study.process.wait(30)
        assert study.process.returncode == 0, "".join(study.lines)
    assert workers[1].process.wait(5) == -signal.SIGKILL
    assert [worker.process.poll() for worker in (workers[0], workers[2])] == [None, None]
    assert re.search(r"Remove worker addr", "".join(scheduler.lines))
    rows = parquet.read_table(out / "designs.parquet").to_pylist()
    assert [row["design"] for row in rows] == list(range(DESIGNS))
    assert {row["status"] for row in rows} == {"ok"}
    # The same designs in one process on this machine.
    here = tmp_path / "here"
    with Process("bushcli.cli", *command, "--workers", 1, "-o", here) as alone:
        alone.said(r"wrote ", 120.0)
    for one, other in zip(rows, parquet.read_table(here / "designs.parquet").to_pylist(), strict=True):
        assert one["geometry.length"] == other["geometry.length"]
        assert one["axial.initial"] == pytest.approx(other["axial.initial"], rel=1e-9)


@pytest.mark.slow
def test_a_diagnosis_is_shared_too(cluster, tmp_path):
    case = ROOT / "examples" / "concealed" / "case.toml"
    options = ("--effects", "offset", "--no-maps", "-o")
    found = []
    for name, more in (("there", ("--scheduler", cluster[1])), ("here", ())):
        with Process("bushcli.cli", "diagnose", case, *options, tmp_path / name, *more) as run:
            run.said(r"wrote ", 240.0)
        found.append(json.loads((tmp_path / name / "result.json").read_text()))
    assert found[0]["probability"] == pytest.approx(found[1]["probability"], rel=1e-6, abs=1e-30)
    # The first process keeps what the workers find.
    kept = [
        sorted(file.name for file in (tmp_path / n / "history-diagnose").glob("*.npz"))
        for n in ("there", "here")
    ]
    assert kept[0] == kept[1] != []
