"""Numbers that a rubber bushing does not have are asked about, with a remedy; numbers that it has are not."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from bushcli.case import load_case
from bushcli.case.temperatures import unused_temperatures
from bushcli.case.typical import unusual_values
from bushcli.cli import main
from bushcli.errors import InputError
from bushcli.recording import RecordedProgram

CASE = """
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = 18.0
length = 34.0
[material]
law = "neo_hookean"
bulk_modulus = 2000.0
parameters = { C10 = 0.4 }
[[load_cases]]
mode = "axial"
amplitude = 3.0
rate = 0.5
[[load_cases]]
mode = "torsional"
amplitude = 20.0
"""


@pytest.fixture
def found(tmp_path):
    def look(*changes, paths=()):
        (tmp_path / "case.toml").write_text(CASE)
        case = load_case(tmp_path / "case.toml", list(changes))
        return unusual_values(case, case.material, paths)

    return look


@pytest.mark.parametrize(
    "change", ["material.parameters.C10=0.4", "material.parameters.C10=0.006", "load_cases.0.rate=30"]
)
def test_a_bushing_is_not_asked_about(found, change):
    assert found(change) == ()


@pytest.mark.parametrize(
    ("change", "message", "remedy"),
    [
        ("material.parameters.C10=60", "shear modulus of 120 MPa", "60 Shore A has C10 of about 0.6"),
        ("material.parameters.C10=400", "shear modulus of 800 MPa", "kPa, divide them by 1000"),
        ("material.parameters.C10=0.0004", "shear modulus of 0.0008 MPa", "GPa, multiply them by 1000"),
        ("material.bulk_modulus=2", "bulk modulus is 2 MPa", "material.bulk_modulus in MPa"),
        ("geometry.length=800", "800 mm in size", "dimensions in mm"),
        ("load_cases.0.amplitude=50", "shear strain of 556 %", "travel in mm"),
        # 17 mm from the centre to the ends of the sleeve, 9 mm of rubber.
        ("load_cases.1={mode='conical',amplitude=0.02}", "shear strain of 0.0659 %", "travel in degrees"),
        ("load_cases.1={mode='torsional',amplitude=0.02}", "shear strain of 0.0349 %", "travel in degrees"),
        ("load_cases.0.amplitude=0.003", "shear strain of 0.0333 %", "travel in mm"),
        ("load_cases.0.rate=500", "strained by 56 per s", "time in s"),
        ("load_cases.1.amplitude=0.02", "0.02 degrees on 9 mm of rubber", "travel in degrees"),
    ],
)
def test_a_number_of_another_unit_is_asked_about(found, change, message, remedy):
    (one,) = found(change)
    assert one.name == "unusual_value"
    assert message in one.message
    assert remedy in one.remedy


def test_recordings_are_looked_at_too(found):
    time = np.linspace(0.0, 40.0, 400)
    q = 3.0 * np.sin(0.3 * time)

    def path(q, time):
        return RecordedProgram("recorded", "axial", time, q)

    assert found(paths=[path(q, time)]) == ()
    for wrong in (1e3 * time, 1e-3 * time):
        (one,) = found(paths=[path(q, wrong)])
        assert "per s" in one.message
    (one,) = found(paths=[path(100.0 * q, time)])[:1]
    assert "300 mm on 9 mm of rubber" in one.message


@pytest.mark.parametrize(
    "command",
    [
        "check",
        "direct",
        "inverse",
        "diagnose --effects gain --no-maps",
        "fit --set material.parameters.C10=50",
        "study --designs 2 --vary material.bulk_modulus=uniform(1990,2010)",
    ],
)
def test_every_command_asks_about_the_numbers_of_its_case(tmp_path, command):
    """A coupon with a hardness as its modulus, recorded with a time column that is a thousand off."""
    name, *options = command.split()
    stretch = 1.0 + 0.01 * np.arange(60)
    stress = 0.6 * (stretch - stretch**-2) + 5e-4 * (-1.0) ** np.arange(60)
    rows = zip(1e6 * stretch, stretch, stress, strict=True)
    text = "".join(f"{time:.0f},{x:.4f},{y:.6f}\n" for time, x, y in rows)
    (tmp_path / "uniaxial.csv").write_text(f"Time (s),stretch,stress (MPa)\n{text}")
    (tmp_path / "case.toml").write_text(
        f"""
        [geometry]
        shape = "coupon"
        [material]
        law = "neo_hookean"
        bulk_modulus = 2000.0
        parameters = {{ C10 = 60.0 }}
        [[{"coupons" if name == "fit" else "recordings"}]]
        mode = "uniaxial"
        file = "uniaxial.csv"
        """
    )
    arguments = [name, str(tmp_path / "case.toml"), "-q", "-o", str(tmp_path / "out"), *options]
    done = CliRunner().invoke(main, arguments, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    problems = json.loads((tmp_path / "out" / "result.json").read_text())["problems"]
    said = " ".join(one["message"] for one in problems if one["name"] == "unusual_value")
    assert "initial shear modulus of 1" in said
    if name == "study":
        said = " ".join(one["message"] for one in problems)
        assert '2 of 2 designs have the condition "unusual_value"' in said
    else:
        assert "strained by 1e-06 per s" in said


def test_zero_is_a_place_like_any_other(tmp_path):
    outline = "".join(
        f"[[geometry.outline]]\nfrom = [{a}.0, {b}.0]\nto = [{c}.0, {d}.0]\n"
        + (f'name = "{name}"\n' if name else "")
        for a, b, c, d, name in (
            (10, -20, 10, 20, "inner"),
            (10, 20, 20, 16, ""),
            (20, 16, 20, -16, "outer"),
            (20, -16, 10, -20, ""),
        )
    )
    material = CASE[CASE.index("[material]") :]
    for centre in ("0.0", "-1.0", "0"):
        (tmp_path / "case.toml").write_text(
            f'[geometry]\nshape = "section"\ncentre = {centre}\n{outline}{material}'
        )
        assert load_case(tmp_path / "case.toml").geometry.centre == float(centre)


@pytest.mark.parametrize("value", ["1e-320", "1e-300", "1e300", "-1e-310"])
@pytest.mark.parametrize(
    "key", ["load_cases.0.rate", "load_cases.0.amplitude", "geometry.length", "material.parameters.C10"]
)
def test_a_number_that_computers_cannot_use_is_refused(tmp_path, key, value):
    (tmp_path / "case.toml").write_text(CASE)
    with pytest.raises(InputError, match=key.split(".")[-1]):
        load_case(tmp_path / "case.toml", [f"{key}={value}"])


@pytest.mark.parametrize(("warm", "noted"), [(80.0, True), (-16.0, False)])
def test_temperatures_that_no_effect_uses_are_said(tmp_path, warm, noted):
    recordings = "".join(
        f'[[recordings]]\nmode = "axial"\nfile = "{i}.csv"\ntemperature = {degrees}\n'
        for i, degrees in enumerate((-20.0, warm))
    )
    for i in range(2):
        rows = [f"{0.1 * j},{(30 + i) * j}" for j in range(6)]
        (tmp_path / f"{i}.csv").write_text("\n".join(["displacement_mm,force_N", *rows]))
    (tmp_path / "case.toml").write_text(CASE + recordings)
    shown = CliRunner().invoke(main, ["check", str(tmp_path / "case.toml"), "-q"])
    words = " ".join(shown.output.split())
    assert ("temperatures of -20 and 80 degrees C are not used" in words) is noted
    assert f"{warm:.1f} °C" in words
    case = load_case(tmp_path / "case.toml", ["effects=[{name='temperature'}]", "temperature=23.0"])
    assert not [*unused_temperatures(case, [])]
