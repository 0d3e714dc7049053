"""A hardness in place of the law's parameters: its moduli, what is said of it, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from bushcli.case import case_json, load_case
from bushcli.case.hardness import from_hardness, known_from_hardness, youngs_modulus
from bushcli.errors import CaseError
from forms.law import laws

CASE = """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[material]
law = "yeoh"
{material}
[[load_cases]]
mode = "axial"
amplitude = 1.0
"""


def case(folder: Path, material: str, more: str = "") -> Path:
    file = folder / "case.toml"
    file.write_text(CASE.format(material=material) + more)
    return file


@pytest.mark.parametrize("name", laws())
def test_every_law_has_the_shear_modulus_of_the_hardness(name: str) -> None:
    material = from_hardness(name, 60.0)
    assert laws()[name].shear_modulus(**material.parameters) == pytest.approx(youngs_modulus(60.0) / 3.0)
    assert all(laws()[name].parameter(key).admits(value) for key, value in material.parameters.items())


def test_a_case_from_a_hardness_says_so(tmp_path: Path) -> None:
    found = load_case(case(tmp_path, "hardness = 60"))
    assert not found.needs_fit
    shown = case_json(found)["material"]
    assert shown["hardness"] == 60.0
    (said,) = known_from_hardness(found.material)
    assert said.name == "from_hardness"
    # Gent: E(60) = 0.0981 x 513.4 / (0.137505 x 101.6) MPa.
    assert "E = 3.61 MPa" in said.message
    assert not known_from_hardness(
        load_case(case(tmp_path, "parameters = {C10 = 0.5, C20 = 0.0, C30 = 0.0}")).material
    )


@pytest.mark.parametrize(
    ("material", "more", "said"),
    [
        ("hardness = 60\nparameters = {C10 = 0.5}", "", "material.parameters are given"),
        ("hardness = 60", '[[coupons]]\nmode = "uniaxial"\nfile = "u.csv"\n', "coupons"),
        ("hardness = 0.6", "", "is no hardness"),
        ("hardness = 98", "", "20 to 90"),
        # Gent's modulus is infinite.
        ("hardness = 100", "", "20 to 90"),
        ('hardness = "60 Shore"', "", "material.hardness"),
    ],
)
def test_a_hardness_beside_something_better_or_out_of_range_is_refused(
    tmp_path: Path, material: str, more: str, said: str
) -> None:
    (tmp_path / "u.csv").write_text(
        "stretch,nominal_stress_MPa\n1,0\n1.1,0.1\n1.2,0.2\n1.3,0.3\n1.4,0.4\n1.5,0.5\n"
    )
    with pytest.raises(CaseError, match=said):
        load_case(case(tmp_path, material, more))
