"""Throughput of studies: designs per second, cost over the march alone, memory, and reading rows back."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import numpy as np

# The bushing of the other benchmarks (benchmarks/problem.py), every dimension varied.
CASE = """
[geometry]
shape = "plain"
inner_radius = "12.0 +- 0.2"
outer_radius = "22.0 +- 0.3"
length = "40.0 +- 3.0"
[material]
law = "yeoh"
bulk_modulus = 2000.0
[material.parameters]
C10 = 0.5
C20 = -0.05
C30 = 0.01
[[load_cases]]
mode = "{mode}"
amplitude = {amplitude}
steps = {steps}
"""
# Instead of the load case: a recording, whose path is marched if the rubber has memory.
RECORDING = """
[[recordings]]
mode = "axial"
file = "axial.csv"
"""
MEMORY = """
[[effects]]
name = "viscoelasticity"
parameters = {{ g1 = 0.3, tau1 = 2.0 }}
"""
AXIAL, RADIAL = ("axial", 8.0, 20), ("radial", 2.0, 10)
WORKERS = 2


def study(runs: int) -> Iterator[str]:
    """Yield the tables of studies; `runs` plays no part, since each is long enough by itself."""
    yield "### Studies\n"
    columns = f"| study | designs | wall clock | processor | per design | on {WORKERS} quiet cores | memory |"
    yield f"{columns}\n{'| --- ' * 7}|"
    for load, designs in ((AXIAL, 1000), (RADIAL, 200), (AXIAL, 4000)):
        yield _throughput(load, designs)
    yield f"\n| one process, processor time | per design | march alone | ratio |\n{'| --- ' * 4}|"
    # Processor time, because the wall clock of a busy machine means little.
    with mock.patch.object(time, "perf_counter", time.process_time):
        for load in (AXIAL, RADIAL):
            with tempfile.TemporaryDirectory() as folder:
                yield _overhead(load[0], _case(Path(folder), load))
        for name, effects in (("axial recording", ""), ("axial recording, viscoelastic", MEMORY)):
            with tempfile.TemporaryDirectory() as folder:
                yield _overhead(name, _write_recorded_case(Path(folder), effects), 60 if not effects else 8)
    yield "\n" + _rows(100_000)


def _case(folder: Path, load: tuple[str, float, int]) -> Path:
    file = folder / "case.toml"
    file.write_text(CASE.format(mode=load[0], amplitude=load[1], steps=load[2]))
    return file


def _write_recorded_case(folder: Path, effects: str) -> Path:
    """Write a case with a recording of four cycles and a hold, 4,000 samples."""
    t = np.linspace(0.0, 100.0, 4000)
    corners = np.arange(0.0, 100.0, 10.0)
    q = np.interp(t, corners, [0.0, 4.0, -4.0, 4.0, -4.0, 8.0, 8.0, -8.0, 8.0, 0.0])
    rows = "".join(f"{a:.3f},{b:.4f},{400.0 * b:.2f}\n" for a, b in zip(t, q, strict=True))
    (folder / "axial.csv").write_text("time_s,displacement_mm,force_N\n" + rows)
    file = folder / "case.toml"
    text = CASE.partition("[[load_cases]]")[0] + RECORDING + effects
    file.write_text(text.replace("{{", "{").replace("}}", "}"))
    return file


def _throughput(load: tuple[str, float, int], designs: int) -> str:
    with tempfile.TemporaryDirectory() as folder:
        case, out = _case(Path(folder), load), Path(folder) / "out"
        command = [sys.executable, "-m", "bushcli.cli", "study", str(case), "--designs", str(designs)]
        begin, before = time.perf_counter(), _processor()
        subprocess.run(
            [*command, "--workers", str(WORKERS), "-q", "-o", str(out), "--json"],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        wall, spent = time.perf_counter() - begin, _processor() - before
        result = json.loads((out / "result.json").read_text())
    assert result["failed"] == 0, result["failures"]
    # Peak memory of the largest child so far.
    largest = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    return (
        f"| {load[0]} | {designs} | {wall:.0f} s | {spent:.0f} s | {1e3 * spent / designs:.1f} ms "
        f"| {spent / WORKERS:.0f} s | {largest:.0f} MB |"
    )


def _processor() -> float:
    """Return the processor time of all children that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _overhead(name: str, file: Path, designs: int = 60) -> str:
    """Time designs and the marches within them, in one process, so that other work disturbs both alike."""
    from bushcli.case import load_case
    from bushcli.study import task as module
    from bushcli.study.answers import default_answers
    from bushcli.study.plan import plan
    from bushcli.study.task import SECONDS, DesignCache, StudyTask, evaluate, with_fineness
    from bushcli.study.variable import of_tolerance

    marched = []
    predict = module.predict

    def timed_predict(*arguments: object, **options: object) -> object:
        prediction = predict(*arguments, **options)  # type: ignore[arg-type]
        marched.append(prediction.channels[0].seconds["march"])
        return prediction

    case = load_case(file)
    chosen = plan(
        [of_tolerance(key, tolerance) for key, tolerance in case.toleranced.items()], "lhs", designs
    )
    cache = DesignCache()
    task = with_fineness(cache, StudyTask(file, (), chosen.keys, default_answers(case)), chosen.rows[0])
    evaluate(cache, task, 0, chosen.rows)
    module.predict = timed_predict  # type: ignore[assignment]
    try:
        rows = evaluate(cache, task, 0, chosen.rows)
    finally:
        module.predict = predict
    whole, march = (float(np.median(times)) for times in ([row[SECONDS] for row in rows], marched))
    return f"| {name} | {1e3 * whole:.1f} ms | {1e3 * march:.1f} ms | {whole / march:.2f} |"


def _rows(count: int) -> str:
    """Write and read back rows with a curve of 21 points each."""
    from bushcli.study.analysis import band, columns
    from bushcli.study.rows import Rows, columns_of

    kinds = columns_of({"a": True}, ["axial.initial"], ["axial.displacement", "axial.force"])
    q = np.linspace(0.0, 8.0, 21)
    with tempfile.TemporaryDirectory() as folder:
        rows = Rows(Path(folder), {}, kinds, count)
        begin = time.perf_counter()
        for first in range(0, count, 50):
            rows.add([_row(number, q) for number in range(first, first + 50)])
        written = time.perf_counter() - begin
        rows.close()
        begin = time.perf_counter()
        rows = Rows(Path(folder), {}, kinds, count, resume=True)
        table = columns(rows, ["a"], ["axial.initial"])
        read = time.perf_counter() - begin
        band(rows, "axial")
        banded = time.perf_counter() - begin - read
        begin = time.perf_counter()
        rows.write(Path(folder) / "all.parquet")
        joined = time.perf_counter() - begin
        size = (Path(folder) / "all.parquet").stat().st_size / 1e6
        rows.close()
    assert len(table.design) == count
    return (
        f"{count} rows with curves: saved as they come in {written:.1f} s, {1e3 * written / count:.2f} ms each; "
        f"resumed and read for the statistics in {read:.1f} s; band of the curves {banded:.1f} s; "
        f"one file of {size:.0f} MB in {joined:.1f} s"
    )


def _row(number: int, q: np.ndarray) -> dict[str, object]:
    a = 20.0 + 4.0 * np.sin(number)
    return {
        "design": number,
        "a": a,
        "status": "ok",
        "failure": "",
        "reason": "",
        "axial.initial": 10.0 * a,
        "conditions": "",
        "seconds": 0.03,
        "axial.displacement": q.tolist(),
        "axial.force": (10.0 * a * q * (1.0 - 0.01 * q)).tolist(),
    }
