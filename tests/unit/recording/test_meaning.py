"""A column of a coupon keeps the meaning of its name: true and engineering, volume and length, pressure, shear."""

from __future__ import annotations

import re

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording, write_curve_csv
from bushcli.recording.source import Source, Specimen

E = np.linspace(0.0, 1.0, 21)
#: Nominal stress of a neo-Hookean rubber with C10 = 0.11 MPa, uniaxial.
S = 0.22 * ((1 + E) - (1 + E) ** -2)
LOG, CAUCHY = np.log1p(E), S * (1 + E)
#: Volume ratio and pressure (MPa) of a bulk modulus of 2000 MPa, W = kappa/2 (J - 1)^2.
J = np.linspace(1.0, 0.95, 21)
P = 2000.0 * (1 - J)
FIRST_TWO = {"displacement": 1, "force": 2}


def read(folder, mode, head, moved, forced, **keys):
    """Read a file of two columns."""
    rows = "".join(f"{a:.12g},{b:.12g}\n" for a, b in zip(moved, forced, strict=True))
    (folder / "test.csv").write_text(f"{head}\n{rows}", encoding="utf-8")
    return read_recording(Source(mode, folder / "test.csv", **keys))


@pytest.mark.parametrize("columns", [FIRST_TWO, None])
@pytest.mark.parametrize(
    ("head", "moved", "forced"),
    [
        ("True Strain,True Stress (MPa)", LOG, CAUCHY),
        ("Hencky [%],Cauchy stress (kPa)", 100 * LOG, 1e3 * CAUCHY),
        ("ln strain,Stress (MPa)", LOG, S),
        ("wahre Dehnung,wahre Spannung [MPa]", LOG, CAUCHY),
        ("Strain (%),True Stress (MPa)", 100 * E, CAUCHY),
        ("Stretch,Engineering Stress", 1 + E, S),
        ("Engineering Strain,1st Piola-Kirchhoff (MPa)", E, S),
    ],
)
def test_a_chosen_column_keeps_the_meaning_of_its_name(tmp_path, head, moved, forced, columns):
    names = dict(zip(FIRST_TWO, head.split(","), strict=True))
    found = read(tmp_path, "uniaxial", head, moved, forced, columns=columns or names)
    np.testing.assert_allclose(found.displacement, E, atol=1e-10)
    np.testing.assert_allclose(found.force, S, atol=1e-10)


def test_the_case_file_may_state_another_meaning(tmp_path):
    plain = Specimen(stress="engineering", strain="engineering")
    found = read(tmp_path, "uniaxial", "True Strain,True Stress", E, S, columns=FIRST_TWO, specimen=plain)
    np.testing.assert_allclose(found.displacement, E, atol=1e-10)
    np.testing.assert_allclose(found.force, S, atol=1e-10)


@pytest.mark.parametrize(
    ("head", "asked"),
    [
        ("Green strain,Stress (MPa)", 'strain = "engineering" or "true"'),
        ("Strain,2nd PK stress (MPa)", 'stress = "engineering" or "true"'),
        ("Extension,Stress (MPa)", "give gauge_length"),
        ("Extension (mm),Stress (MPa)", "give gauge_length"),
        ("Strain,Load", "give area"),
        ("Strain,Load (N)", "give area"),
        ("Strain,Pressure (MPa)", 'mode = "volumetric"'),
        ("Volume strain [%],Stress (MPa)", 'mode = "volumetric"'),
        ("gamma [%],Stress (MPa)", 'mode = "simple_shear"'),
    ],
)
def test_what_a_name_does_not_permit_is_asked(tmp_path, head, asked):
    with pytest.raises(RecordingError, match=re.escape(asked)):
        read(tmp_path, "uniaxial", head, E, S, columns=FIRST_TWO)


def test_the_remedy_for_true_columns_leads_to_the_right_answer(tmp_path):
    head, specimen = "True Strain,True Stress (MPa)", Specimen()
    for key in ("strain", "stress"):
        with pytest.raises(RecordingError, match=f'give {key} = "true"'):
            read(tmp_path, "uniaxial", head, LOG, CAUCHY, specimen=specimen)
        specimen = Specimen(strain="true", stress="true" if key == "stress" else None)
    found = read(tmp_path, "uniaxial", head, LOG, CAUCHY, specimen=specimen)
    np.testing.assert_allclose(found.force, S, atol=1e-10)


@pytest.mark.parametrize(
    ("head", "moved", "forced"),
    [
        ("Volume ratio J,Pressure (MPa)", J, P),
        ("J [-],p [bar]", J, 10 * P),
        ("V/V0,Hydrostatic pressure (kPa)", J, 1e3 * P),
        ("Volumetric strain,Pressure (MPa)", J - 1, P),
        ("dV/V0 (%),Hydrostatic stress (MPa)", 100 * (J - 1), -P),
        ("Volumenänderung [%],Druck [MPa]", 100 * (J - 1), P),
        ("strain,stress (MPa)", J - 1, -P),
        ("stretch,nominal_stress_MPa", J ** (1 / 3), -P * J ** (2 / 3)),
    ],
)
def test_a_volumetric_test_gives_the_stretch_and_the_nominal_stress_of_a_face(tmp_path, head, moved, forced):
    found = read(tmp_path, "volumetric", head, moved, forced)
    np.testing.assert_allclose(found.displacement, J ** (1 / 3) - 1, atol=1e-10)
    np.testing.assert_allclose(found.force, -P * J ** (2 / 3), atol=1e-8)


def test_a_piston_gives_the_change_of_volume(tmp_path):
    piston = Specimen(gauge_length=20.0, area=100.0)
    found = read(tmp_path, "volumetric", "Weg [mm],Kraft [N]", 20 * (J - 1), -100 * P, specimen=piston)
    np.testing.assert_allclose(found.force, -P * J ** (2 / 3), atol=1e-8)


@pytest.mark.parametrize(
    ("head", "moved", "forced", "turned"),
    [
        ("Volumetric strain,Pressure (MPa)", 1 - J, P, ("displacement",)),
        ("Volumetric strain,Pressure (MPa)", J - 1, -P, ("force",)),
        ("strain,stress (MPa)", 1 - J, P, ("displacement", "force")),
    ],
)
def test_signs_of_a_volumetric_test_that_cannot_be_are_asked(tmp_path, head, moved, forced, turned):
    listed = ", ".join(f'"{name}"' for name in turned)
    with pytest.raises(RecordingError, match=re.escape(f"reverse = [{listed}]")):
        read(tmp_path, "volumetric", head, moved, forced)
    found = read(tmp_path, "volumetric", head, moved, forced, reverse=turned)
    np.testing.assert_allclose(found.force, -P * J ** (2 / 3), atol=1e-8)


def test_a_strain_that_may_be_of_volume_or_length_is_asked(tmp_path):
    for head, columns in (("engineering strain,stress (MPa)", {}), ("a,b", FIRST_TWO)):
        with pytest.raises(RecordingError, match='strain = "engineering" or "volume"'):
            read(tmp_path, "volumetric", head, J - 1, -P, columns=columns)


@pytest.mark.parametrize(
    ("head", "moved", "forced"),
    [
        ("gamma,tau (MPa)", E, S),
        ("γ [%],τ [kPa]", 100 * E, 1e3 * S),
        ("Shear strain (%),Shear stress (MPa)", 100 * E, S),
        ("Scherung [1],Schubspannung [N/mm²]", E, S),
        ("Scherung [%],Schubspannung [MPa]", 100 * E, S),
        ("strain,stress (MPa)", E, S),
    ],
)
def test_the_columns_of_simple_shear(tmp_path, head, moved, forced):
    found = read(tmp_path, "simple_shear", head, moved, forced)
    np.testing.assert_allclose(found.displacement, E, atol=1e-10)
    np.testing.assert_allclose(found.force, S, atol=1e-10)
    write_curve_csv(tmp_path / "again.csv", found)
    again = read_recording(Source("simple_shear", tmp_path / "again.csv"))
    np.testing.assert_allclose(again.displacement, found.displacement, atol=1e-10)


def test_a_stretch_is_no_amount_of_shear(tmp_path):
    with pytest.raises(RecordingError, match="no column shear_strain"):
        read(tmp_path, "simple_shear", "stretch,stress (MPa)", 1 + E, S)


def test_a_quad_lap_specimen_has_travel_and_force(tmp_path):
    found = read(
        tmp_path, "simple_shear", "Travel (mm),Force (N)", 6 * E, 1e3 * S, specimen=Specimen(6.0, 1e3)
    )
    np.testing.assert_allclose(found.displacement, E, atol=1e-10)
    np.testing.assert_allclose(found.force, S, atol=1e-10)


@pytest.mark.parametrize("name", ["compression_sample", "CompressionTest", "Druckversuch_2", "stauch"])
def test_a_file_named_compression_is_not_read_as_tension(tmp_path, name):
    file = tmp_path / f"{name}.csv"
    file.write_text("strain,stress (MPa)\n" + "".join(f"{a},{b}\n" for a, b in zip(E / 4, S, strict=True)))
    with pytest.raises(RecordingError, match=re.escape('reverse = ["displacement", "force"]')):
        read_recording(Source("uniaxial", file))
    found = read_recording(Source("uniaxial", file, reverse=("displacement", "force")))
    assert found.displacement.min() == pytest.approx(-0.25)
    assert read_recording(Source("uniaxial", file, reverse=())).displacement.max() == pytest.approx(0.25)


@pytest.mark.parametrize("name", ["tension_compression", "Zug_Druck", "decompress_tensile", "sample"])
def test_a_file_of_tension_is_read_as_it_is(tmp_path, name):
    file = tmp_path / f"{name}.csv"
    file.write_text("strain,stress (MPa)\n" + "".join(f"{a},{b}\n" for a, b in zip(E, S, strict=True)))
    assert read_recording(Source("uniaxial", file)).displacement.max() == pytest.approx(1.0)
