"""A concealed effect is found on a path of six motions and on a section of revolution, with small meshes."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from bushcli.cli import main

NOISE = 1e-3
RUBBER = '[material]\nlaw = "neo_hookean"\nbulk_modulus = 200.0\n'
PARAMETERS = "[material.parameters]\nC10 = 0.5\n"
PLAIN = """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[mesh]
elements_across = 2
elements_along = 3
elements_around = 6
"""
SECTION = """
[geometry]
shape = "section"
[[geometry.outline]]
from = [10.0, -20.0]
to = [20.0, -15.0]
[[geometry.outline]]
to = [20.0, 15.0]
name = "outer"
[[geometry.outline]]
to = [10.0, 20.0]
arc_through = [15.0, 16.0]
[[geometry.outline]]
to = [10.0, -20.0]
name = "inner"
[mesh]
elements_across = 3
"""
EFFECT = '[[effects]]\nname = "viscoelasticity"\n[effects.parameters]\ng1 = 0.3\ntau1 = 3.0\n'
PATH = """
[[load_cases]]
mode = "path"
steps = 24
[load_cases.path]
time = [0.0, 4.0, 8.0, 16.0]
ux = [0.0, 1.0, 1.0, 1.0]
uz = [0.0, 0.0, 3.0, -2.0]
"""
CYCLES = """
[[load_cases]]
mode = "axial"
path = [0.0, 2.0, -2.0, 4.0, -4.0, 0.0]
rate = 1.0
steps = 24
"""


def made(folder: Path, body: str, load: str, columns: tuple[str, ...], samples: int) -> Path:
    """Write a recording of a case with the effect, with noise (fixed seed), and a case without it."""
    (folder / "truth.toml").write_text(body + RUBBER + PARAMETERS + load + EFFECT)
    mode = "path" if '"path"' in load else "axial"
    arguments = ["direct", str(folder / "truth.toml"), "-o", str(folder / "truth"), "--no-fields", "-q"]
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 0, done.output
    rows = list(csv.DictReader((folder / "truth" / f"{mode}.csv").read_text().splitlines()))
    time = np.array([float(row["time_s"]) for row in rows])
    at, rng = np.linspace(0.0, time[-1], samples), np.random.default_rng(11)
    found = [at]
    for name in columns:
        values = np.array([float(row[name]) for row in rows])
        scatter = NOISE * np.ptp(values) if name.startswith("f") else 0.0
        found.append(np.interp(at, time, values) + scatter * rng.standard_normal(samples))
    text = ",".join(("time_s", *columns)) + "\n"
    text += "".join(",".join(f"{value:.9g}" for value in row) + "\n" for row in np.column_stack(found))
    (folder / "recorded.csv").write_text(text)
    case = folder / "case.toml"
    case.write_text(f'{body}{RUBBER}[[recordings]]\nmode = "{mode}"\nfile = "recorded.csv"\n')
    return case


def diagnosed(case: Path, *options: str) -> Any:
    out = case.parent / "out"
    done = CliRunner().invoke(main, ["diagnose", str(case), "-o", str(out), "-q", "--workers", "1", *options])
    assert done.exit_code == 0, done.output
    return json.loads((out / "result.json").read_text(encoding="utf-8"))


def check(found: Any) -> None:
    assert found["verdict"] == "missing_physics"
    assert [one["name"] for one in found["effects"]] == ["viscoelasticity"]
    assert found["probability"]["viscoelasticity"] > 0.95
    for name, true in (("g1", 0.3), ("tau1", 3.0)):
        one = found["effects"][0]["parameters"][name]
        # Between the steps of the truth its curve is a straight line, off by less than the noise.
        assert one["value"] == pytest.approx(true, rel=0.1)
    for channel, before in found["misfit"]["before"].items():
        assert found["misfit"]["after"][channel] < 0.25 * before


@pytest.mark.slow
def test_an_effect_concealed_on_a_path_of_six_motions_is_found(tmp_path: Path) -> None:
    """Only one absent effect is offered beside it: the whole catalogue takes some minutes in three dimensions."""
    case = made(tmp_path, PLAIN, PATH, ("ux_mm", "uz_mm", "fx_N", "fz_N"), 73)
    check(diagnosed(case, "--effects", "viscoelasticity,rig_compliance", "--no-maps"))


@pytest.mark.slow
def test_an_effect_concealed_on_a_section_is_found(tmp_path: Path) -> None:
    """The mesh consists of triangles, and so does the map of the rubber, which is drawn and written."""
    check(diagnosed(made(tmp_path, SECTION, CYCLES, ("displacement_mm", "force_N"), 121)))
    assert (tmp_path / "out" / "axial-bushing-map.png").stat().st_size > 10_000
    assert 'Name="stiffness_change"' in (tmp_path / "out" / "axial-bushing-map.vtu").read_text(
        encoding="utf-8"
    )
