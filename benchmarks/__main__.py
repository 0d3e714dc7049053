"""`make bench`: measure the speed, beside other programs, and print the tables of README.md."""

from __future__ import annotations

import argparse
import platform
import sys
from pathlib import Path

from benchmarks import compare, direct, effects, processes, real, six, step, study

SECTIONS = {
    "processes": processes.processes,
    "targets": direct.targets,
    "growth": direct.growth,
    "threads": direct.threads,
    "peers": compare.compare,
    "effects": effects.cost,
    "memory": effects.memory,
    "alike": effects.alike,
    "real": real.real,
    "six": six.six,
    "step": step.step,
    "study": study.study,
}


def machine() -> str:
    """Processor, number of cores, system."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{names[0] if names else platform.processor()}, {len(names)} cores, {platform.system()}"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument(
        "sections", nargs="*", metavar="SECTION", help=f"of {', '.join(SECTIONS)}; default: all"
    )
    parser.add_argument("--runs", type=int, default=5, help="runs of which the median is taken (default: 5)")
    options = parser.parse_args()
    unknown = [section for section in options.sections if section not in SECTIONS]
    if unknown:
        parser.error(f"{unknown[0]!r} is not a section ({', '.join(SECTIONS)})")
    print(f"{machine()}; Python {platform.python_version()}; medians of {options.runs} runs\n", flush=True)
    for section in options.sections or SECTIONS:
        for text in SECTIONS[section](options.runs):
            print(text, flush=True)
    if sys.stdout.isatty():
        print("Times on a machine that does other work at the same time are worth as ratios only.")


if __name__ == "__main__":
    main()
