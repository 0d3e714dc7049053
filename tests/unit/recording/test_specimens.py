"""Coupons in machine units, true stress and strain, cycles for conditioning."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import Recording, read_recording
from bushcli.recording.source import Source, Specimen

STRAIN = np.linspace(0.0, 1.0, 41)
#: Nominal stress of a neo-Hookean rubber of 0.5 MPa, uniaxial.
STRESS = 0.5 * ((1 + STRAIN) - (1 + STRAIN) ** -2)


def coupon(
    path: Path, head: str, moved: np.ndarray, forced: np.ndarray, mode: str = "uniaxial", **keys: object
) -> Recording:
    rows = "\n".join(f"{a:.12g};{b:.12g}" for a, b in zip(moved, forced, strict=True))
    path.write_text(f"{head}\n{rows}\n", encoding="utf-8")
    return read_recording(Source(mode, path, **keys))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("head", "moved", "forced", "specimen"),
    [
        ("Traversenweg [mm];Kraft [N]", 20 * STRAIN, 8 * STRESS, Specimen(20.0, 8.0)),
        ("Traversenweg [cm];Kraft [kN]", 2 * STRAIN, 8e-3 * STRESS, Specimen(20.0, 8.0)),
        ("Dehnung [%];Kraft [N]", 100 * STRAIN, 8 * STRESS, Specimen(None, 8.0)),
        ("Weg [mm];Spannung [MPa]", 20 * STRAIN, STRESS, Specimen(20.0)),
        ("stretch;true stress [MPa]", 1 + STRAIN, STRESS * (1 + STRAIN), Specimen(stress="true")),
        (
            "true strain;true stress [MPa]",
            np.log1p(STRAIN),
            STRESS * (1 + STRAIN),
            Specimen(stress="true", strain="true"),
        ),
        ("log strain [%];nominal stress [MPa]", 100 * np.log1p(STRAIN), STRESS, Specimen(strain="true")),
    ],
)
@pytest.mark.parametrize("mode", ["uniaxial", "equibiaxial", "planar"])
def test_every_form_gives_stretch_and_nominal_stress(tmp_path, mode, head, moved, forced, specimen):
    recording = coupon(tmp_path / "a.csv", head, moved, forced, mode, specimen=specimen)
    np.testing.assert_allclose(recording.displacement, STRAIN, atol=1e-10)
    np.testing.assert_allclose(recording.force, STRESS, atol=1e-10)


def test_the_true_stress_is_taken_only_where_it_is_asked_for(tmp_path):
    columns = "\n".join(
        f"{a:.6f};{b:.6f};{c:.6f}" for a, b, c in zip(STRAIN, STRESS, STRESS * (1 + STRAIN), strict=True)
    )
    (tmp_path / "a.csv").write_text(f"strain;stress [MPa];true stress [MPa]\n{columns}\n")
    for specimen in (Specimen(), Specimen(stress="true")):
        found = read_recording(Source("uniaxial", tmp_path / "a.csv", specimen=specimen))
        np.testing.assert_allclose(found.force, STRESS, atol=2e-6)


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ("Weg [mm];Kraft [N]", r"the file has a length: give gauge_length"),
        ("strain;Kraft [N]", r"the file has a force: give area"),
        ("strain;true stress [MPa]", r'if it is a true stress, give stress = "true"'),
        ("log strain;stress [MPa]", r'if it is a true strain, give strain = "true"'),
    ],
)
def test_the_message_says_what_the_case_lacks(tmp_path, head, message):
    with pytest.raises(RecordingError, match=message):
        coupon(tmp_path / "a.csv", head, STRAIN + 0.001, STRESS)


def test_a_travel_beyond_the_specimen_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="compresses a specimen of 10 mm to zero length"):
        coupon(
            tmp_path / "a.csv", "Weg [mm];Kraft [N]", -20 * STRAIN, -8 * STRESS, specimen=Specimen(10.0, 8.0)
        )


def test_percent_taken_for_a_logarithmic_strain_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="if it is in percent"):
        coupon(
            tmp_path / "a.csv",
            "log strain;stress [MPa]",
            100 * STRAIN,
            STRESS,
            specimen=Specimen(strain="true"),
        )


def cyclic(path: Path, **keys: object) -> Recording:
    q = np.concatenate([[0.0], *[np.concatenate([np.linspace(0.1, 4, 40), np.linspace(3.9, 0, 40)])] * 5])
    time = 0.1 * np.arange(len(q))
    rows = "\n".join(f"{a:.6g},{b:.6g},{c:.6g}" for a, b, c in zip(time, q, 100 * q, strict=True))
    path.write_text(f"time_s,displacement_mm,force_N\n{rows}\n")
    return read_recording(Source("axial", path, **keys))  # type: ignore[arg-type]


def test_cycles_for_conditioning_are_left_out_and_keep_their_numbers(tmp_path):
    recording = cyclic(tmp_path / "a.csv", conditioning=3)
    assert recording.conditioning == 3
    assert recording.cycles == (4, 5)
    assert {branch.cycle for branch in recording.branches} == {4, 5}
    assert cyclic(tmp_path / "a.csv", conditioning=3, cycles=(2, 5)).cycles == (5,)


def test_a_conditioning_of_all_cycles_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="conditioning = 5, but the recording has 5 cycles"):
        cyclic(tmp_path / "a.csv", conditioning=5)
    with pytest.raises(RecordingError, match="leaves none of the cycles"):
        cyclic(tmp_path / "a.csv", conditioning=3, cycles=(1, 2))
