"""The warning that elements are distorted: where the rubber folds around the edge of a bond."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

Cli = Callable[..., "subprocess.CompletedProcess[str]"]

CASE = """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[material]
law = "yeoh"
parameters = {C10 = 0.5, C20 = -0.05, C30 = 0.01}
bulk_modulus = 2000.0
[[load_cases]]
mode = "radial"
amplitude = 4.6
"""


@pytest.mark.slow
@pytest.mark.parametrize(("amplitude", "names"), [(3.6, []), (4.6, ["distorted_elements"])])
def test_distorted_elements_are_reported_with_a_remedy(
    cli: Cli, tmp_path: Path, amplitude: float, names: list[str]
) -> None:
    """The rubber folds between 4.0 and 4.5 mm, on the default and on a finer mesh (`simulate.strains`)."""
    (tmp_path / "case.toml").write_text(CASE.replace("4.6", str(amplitude)))
    done = cli("direct", tmp_path / "case.toml", "-o", tmp_path / "out", "--no-fields")
    assert done.returncode == 0, done.stderr
    problems = json.loads((tmp_path / "out" / "result.json").read_text())["problems"]
    assert [problem["name"] for problem in problems] == names
    assert all('geometry.contact = "sleeves"' in problem["remedy"] for problem in problems)


CONE = """
[geometry]
shape = "section"
outline = [
  {from = [10.0, -20.0], to = [16.0, -20.0]},
  {to = [24.0, 20.0], name = "outer"},
  {to = [18.0, 20.0]},
  {to = [10.0, -20.0], name = "inner"},
]
[mesh]
elements_across = 2
elements_along = 6
[material]
law = "neo_hookean"
parameters = {C10 = 0.5}
bulk_modulus = 2000.0
[[load_cases]]
mode = "axial"
path = [0, 3, -3]
steps = 6
[[effects]]
name = "cure_shrinkage"
parameters = {shrinkage = 0.02}
"""


@pytest.mark.slow
def test_a_force_at_rest_is_reported_with_the_offset_of_the_rig(cli: Cli, tmp_path: Path) -> None:
    """A cone that has shrunk pushes its inner sleeve along; set to zero there, the rig records no force at rest."""
    (tmp_path / "case.toml").write_text(CONE)
    done = cli("direct", tmp_path / "case.toml", "--json")
    (problem,) = json.loads(done.stdout)["problems"]
    assert problem["name"] == "force_at_rest"
    offset = problem["remedy"].split("= ")[1]
    rest = abs(float(problem["message"].split("exerts ")[1].split()[0]))
    more = f'[[effects]]\nname = "offset"\nparameters = {{displacement = {offset}, force = 0.0}}\n'
    (tmp_path / "case.toml").write_text(CONE + more)
    done = cli("direct", tmp_path / "case.toml", "--json")
    (axial,) = json.loads(done.stdout)["load_cases"]
    at_rest = min(zip(map(abs, axial["displacement"]), axial["force"], strict=True))[1]
    # The offset is interpolated between steps of 0.5 mm.
    assert abs(at_rest) < 0.03 * rest


COUPON = """
[geometry]
shape = "coupon"
[material]
law = "gent"
bulk_modulus = 500.0
parameters = {mu = 0.8, Jm = 30.0}
[[load_cases]]
mode = "uniaxial"
amplitude = 6.0
"""


@pytest.mark.parametrize(
    ("changes", "names"),
    [((), ["changed_volume"]), (("load_cases.0.amplitude=2",), []), (("load_cases.0.mode=volumetric",), [])],
)
def test_a_coupon_whose_volume_changes_is_reported(
    inside: Callable[..., Result], tmp_path: Path, changes: tuple[str, ...], names: list[str]
) -> None:
    (tmp_path / "case.toml").write_text(COUPON)
    done = inside(
        "direct", tmp_path / "case.toml", *(f"--set={change}" for change in changes), "--json", "-q"
    )
    assert done.exit_code == 0, done.output
    problems = json.loads(done.stdout)["problems"]
    assert [problem["name"] for problem in problems] == names
    assert all("changes by 87 %" in problem["message"] for problem in problems)
