"""Run programs side by side, in turn and several times, and take medians."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Subject:
    """A program to be measured: its name in the table, its command, and additional environment variables."""

    name: str
    command: Sequence[str]
    environment: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Result:
    """What a subject printed (the run with the median solving time), and medians over its runs.

    Attributes
    ----------
    wall
        Seconds of the whole process, start to end.
    memory
        Largest resident memory of the process or of a child, MB.
    """

    printed: Mapping[str, Any]
    solve: float
    wall: float
    memory: float


def once(subject: Subject) -> tuple[dict[str, Any], float, float]:
    """Run a subject; return its last line of JSON, seconds and MB; raise RuntimeError with its output if it fails."""
    begin = time.perf_counter()
    process = subprocess.Popen(
        subject.command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"OMP_NUM_THREADS": "1"} | dict(subject.environment),
    )
    out, err = process.communicate()
    wall = time.perf_counter() - begin
    if process.returncode:
        raise RuntimeError(f"{subject.name}: {(err or out).strip()[-500:]}")
    lines = [line for line in out.splitlines() if line.startswith("{") and line.endswith("}")]
    printed = json.loads(lines[-1]) if lines else {}
    return printed, wall, float(printed.get("memory", 0.0))


def side_by_side(subjects: Sequence[Subject], runs: int) -> dict[str, Result | str]:
    """Run all subjects in turn, `runs` times, so that a busy machine slows all alike; failures are returned as text."""
    samples: dict[str, list[tuple[dict[str, Any], float, float]]] = {subject.name: [] for subject in subjects}
    failures: dict[str, str] = {}
    # The first round only fills caches: kernels, bytecode, disk.
    for turn in range(runs + 1):
        for subject in subjects:
            if subject.name in failures:
                continue
            try:
                row = once(subject)
            except (RuntimeError, OSError) as failure:
                failures[subject.name] = str(failure)
                continue
            if turn > 0:
                samples[subject.name].append(row)
    results: dict[str, Result | str] = dict(failures)
    for name, rows in samples.items():
        if name in failures:
            continue
        rows.sort(key=lambda row: row[0].get("solve", 0.0))
        results[name] = Result(
            printed=rows[len(rows) // 2][0],
            solve=statistics.median(row[0].get("solve", 0.0) for row in rows),
            wall=statistics.median(row[1] for row in rows),
            memory=max(row[2] for row in rows),
        )
    return {subject.name: results[subject.name] for subject in subjects}


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table with aligned columns."""
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]
    lines = [head, ["-" * width for width in widths], *rows]
    return "\n".join(
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) + " |"
        for line in lines
    )
