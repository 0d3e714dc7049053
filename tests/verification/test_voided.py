"""The default mesh of voided bushings serves the radial stiffness within 2 %, whatever the webs and the skins."""

from __future__ import annotations

import pytest

from bushcli.case import load_case
from bushcli.simulate.predict import predict

CASE = """
[geometry]
shape = "voided"
inner_radius = 10.0
outer_radius = 20.0
length = 40.0
void_inner_radius = {}
void_outer_radius = {}
void_angle = {}
[material]
law = "neo_hookean"
bulk_modulus = 2000.0
parameters = {{ C10 = 0.4 }}
[[load_cases]]
mode = "radial"
amplitude = 0.2
steps = 1
"""


@pytest.mark.parametrize(
    ("inner", "outer", "angle", "stiffness"),
    # N/mm, converged (docs/method.md). Twelve elements around, shared by angle, had
    # 122.3, 309.7, 3.908 and 144.1.
    [
        (13.0, 17.0, 120.0, 133.22),
        (13.0, 17.0, 80.0, 331.47),
        (13.0, 17.0, 175.0, 3.755),
        (14.5, 15.5, 120.0, 159.11),
    ],
)
def test_the_default_mesh_is_fine_enough(tmp_path, inner, outer, angle, stiffness):
    (tmp_path / "case.toml").write_text(CASE.format(inner, outer, angle))
    (channel,) = predict(load_case(tmp_path / "case.toml"), pictures=False).channels
    assert channel.curve.force[-1] / channel.curve.displacement[-1] == pytest.approx(stiffness, rel=0.02)
