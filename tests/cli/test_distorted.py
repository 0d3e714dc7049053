"""The warning that elements are distorted: where the rubber folds around the edge of a bond."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

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


@pytest.mark.parametrize(("amplitude", "names"), [(3.6, []), (4.6, ["distorted_elements"])])
def test_distorted_elements_are_reported_with_a_remedy(
    cli: Cli, tmp_path: Path, amplitude: float, names: list[str]
) -> None:
    """The rubber folds between 4.0 and 4.5 mm, on the default and on a finer mesh (`simulate.stretched`)."""
    (tmp_path / "case.toml").write_text(CASE.replace("4.6", str(amplitude)))
    done = cli("direct", tmp_path / "case.toml", "-o", tmp_path / "out", "--no-fields")
    assert done.returncode == 0, done.stderr
    problems = json.loads((tmp_path / "out" / "result.json").read_text())["problems"]
    assert [problem["name"] for problem in problems] == names
    assert all('geometry.contact = "sleeves"' in problem["remedy"] for problem in problems)
