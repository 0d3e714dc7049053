"""Diagnoses of the practice recordings (another code's, truth given) and of measured HNBR50.

``setup/enter python benchmarks/practice.py RECORDINGS [NAME ...]``: RECORDINGS is a folder with ``practice/``,
``coupons/hnbr50`` and ``component/hnbr50_shear``, which are not part of the project. Prints a row of
benchmarks/practice.md for each.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
BUSHING = """[geometry]
shape = "plain"
inner_radius = {rubber_inner_radius_mm}
outer_radius = {rubber_outer_radius_mm}
length = {bonded_length_inner_mm}
[material]
law = "yeoh"
bulk_modulus = 2000.0
"""
COUPON = """[geometry]
shape = "coupon"
[material]
law = "yeoh"
"""
NAMES = ("p01", "p02", "p03", "p04", "p05", "p06", "p08", "hnbr50", "hnbr50 loop", "hnbr50 shear")


def practice(source: Path, folder: Path, name: str) -> str:
    """Write the case of a bushing into a folder; return what its recordings conceal."""
    for file in (source / "practice" / name).iterdir():
        shutil.copy(file, folder)
    known = json.loads((folder / "bushing.json").read_text())
    text = BUSHING.format(**known["geometry"])
    text += "".join(f'[[recordings]]\nmode = "{mode}"\nfile = "{mode}.csv"\n' for mode in known["channels"])
    (folder / "case.toml").write_text(text)
    return ", ".join(json.loads((folder / "truth.json").read_text())["effects"]) or "nothing"


def coupon(source: Path, folder: Path, name: str) -> str:
    """Write the case of the measured coupon: both cycles, or the first loop alone."""
    lines = (source / "coupons" / "hnbr50" / "viscoel1.dat").read_text(encoding="latin-1").splitlines()
    rows = np.array(
        [line.split() for line in lines if line.strip() and not line.startswith("#")], dtype=float
    )
    stress, strain, seconds = rows[:, 0], rows[:, 2] / 100, rows[:, 4]
    if name == "hnbr50 loop":
        # Up to where the strain comes back to zero after its first maximum.
        top = int(np.argmax(strain > 0.98 * strain.max()))
        end = top + int(np.argmax(strain[top:] < 0.0))
        stress, strain, seconds = stress[:end], strain[:end], seconds[:end]
    table = np.column_stack([seconds, strain, stress])
    header = "time_s,strain,nominal_stress_MPa"
    np.savetxt(folder / "u.csv", table, delimiter=",", header=header, comments="", fmt="%.6g")
    (folder / "case.toml").write_text(f'{COUPON}[[recordings]]\nmode = "uniaxial"\nfile = "u.csv"\n')
    return "measured"


def shear(source: Path, folder: Path, name: str) -> str:
    """Copy the case of the measured shear specimen."""
    for file in (source / "component" / "hnbr50_shear").iterdir():
        shutil.copy(file, folder)
    return "measured"


def row(name: str, truth: str, result: dict[str, Any], seconds: float) -> str:
    """Return a row of the table: what is probable, what the next test is, misfit over noise, and time."""
    chances = sorted(result["probability"].items(), key=lambda pair: -pair[1])
    likely = ", ".join(f"{key} {100 * value:.3g} %" for key, value in chances if value > 0.03)
    misfit = ", ".join(f"{result['misfit']['after'][key]:.2g} %" for key in result["misfit"]["after"])
    groups = "; ".join(
        f"{group['name'] or 'group'} {100 * group['probability']:.3g} %" for group in result["groups"]
    )
    return f"| {name} | {truth} | {result['verdict']} | {likely} | {groups} | {misfit} | {seconds:.0f} |"


def main(source: Path, names: list[str]) -> None:
    """Diagnose each recording in a folder of its own."""
    made: dict[str, Callable[[Path, Path, str], str]] = {
        "hnbr50": coupon,
        "hnbr50 loop": coupon,
        "hnbr50 shear": shear,
    }
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            truth = made.get(name, practice)(source, Path(folder), name)
            begin = time.perf_counter()
            command = ["bushcli", "diagnose", str(Path(folder) / "case.toml"), "--json", "-q", "--no-maps"]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                print(f"| {name} | {truth} | exit {done.returncode}: {done.stderr.strip()} |", flush=True)
                continue
            print(row(name, truth, json.loads(done.stdout), time.perf_counter() - begin), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:] or list(NAMES))
