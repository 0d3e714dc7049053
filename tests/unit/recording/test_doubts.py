"""Names, units and numbers that a tester found read in silence as something else: converted now, or refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.header.name import heading
from bushcli.recording.source import Source

ROWS = [(0.5 * i, 2.0 * math.sin(i / 6), 500.0 * math.sin(i / 6), 2.2 * math.sin(i / 6)) for i in range(40)]


def rig(folder: Path, header: str, above: str = ""):
    """Read a file with time, travel, force and a fourth column, as many as the header has names."""
    names = header.split("|")
    lines = [above] * bool(above) + ["\t".join(names)]
    lines += ["\t".join(f"{value:.6f}" for value in row[: len(names)]) for row in ROWS]
    (folder / "rig.csv").write_text("\n".join(lines) + "\n")
    return read_recording(Source("axial", folder / "rig.csv"))


def column_of(recording) -> float:
    """Return the largest displacement over the 2 of the travel's column."""
    return float(np.abs(recording.displacement).max() / 2.0)


@pytest.mark.parametrize(
    "name",
    [
        'Displacement "in"',
        "Displacement:in",
        "Displacement *in*",
        "Displacement\\in",
        "Displacement@in",
        'Travel:"',
    ],
)
def test_inches_in_every_notation(tmp_path, name):
    # 2 sin(8/6 ...): the largest sample is within 1 % of 2.
    assert column_of(rig(tmp_path, f"Time [s]|{name}|Force [N]")) == pytest.approx(25.4, rel=0.01)


@pytest.mark.parametrize(
    "header",
    [
        "Time [s]|Displacement mm (in)|Force [N]",
        "Time [s]|Displacement_mm_in|Force [N]",
        "Time [s]|Displacement [mm]|Force N (lbf)",
        "Time [s]|Displacement [mm]|Force in N (kN)",
        "Time [s]|Displacement thousandths of an inch|Force [N]",
        "Time [s]|Displacement [mm]|Force hundreds lbs",
        "Time [s]|in Displacement|Force [N]",
        "Time [s]|in_disp|Force [N]",
    ],
)
def test_two_units_and_factors_in_words_are_refused(tmp_path, header):
    with pytest.raises(RecordingError, match="give the unit in the table of the case file"):
        rig(tmp_path, header)


@pytest.mark.parametrize("name", ["Kraft in [N]", "F [N]", "Load N [N]", "Force in N"])
def test_a_unit_that_stands_twice_or_behind_in_is_one(name):
    assert set(heading(name).written) == {"N"}


@pytest.mark.parametrize(
    "other",
    [
        "Commanded Displacement [mm]",
        "Weg Vorgabe [mm]",
        "Regelabweichung Weg [mm]",
        "Displacement simulated [mm]",
    ],
)
@pytest.mark.parametrize("measured", ["Position [mm]", "Kolbenweg [mm]", "AI 3 [mm]"])
def test_a_set_or_computed_value_is_not_taken_for_a_measured_one(tmp_path, measured, other):
    found = rig(tmp_path, f"Time [s]|{measured}|Force [N]|{other}")
    assert column_of(found) == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize(
    "name",
    ["Commanded Force [N]", "Kraftsollwert [N]", "Kraftgrenze [N]", "Load ratio", "Kraft Nr", "Preload [N]"],
)
def test_what_is_no_measured_force_is_refused(tmp_path, name):
    with pytest.raises(RecordingError, match="no column force_N"):
        rig(tmp_path, f"Time [s]|Displacement [mm]|{name}")


def test_the_displacement_of_the_mode_comes_before_that_of_the_crosshead(tmp_path):
    found = rig(tmp_path, "Time [s]|Axial Displacement [mm]|Axial Force [N]|Crosshead [mm]")
    assert column_of(found) == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize(
    "above",
    [
        "Units: mm kN sec", "Unit set: mm-kN-s", "All forces in kN, displacements in mm",
        "Einheit Kraft: kN, Einheit Weg: mm", "ForceUnit=kN", "Forces in kN", "Displacement;mm;Force;kN",
        "Channel 1: Displacement, mm; Channel 2: Force, kN",
    ],
)  # fmt: skip
def test_units_that_a_line_above_the_table_states(tmp_path, above):
    found = rig(tmp_path, "Time|Displacement|Force", above)
    assert found.units == ("mm", "kN")


@pytest.mark.parametrize("above", ["Load cell 25 kN", "Max force 25 kN", "Displacement rate 5 mm/s"])
def test_a_value_above_the_table_states_no_unit(tmp_path, above):
    assert rig(tmp_path, "Time|Displacement|Force", above).units == ("mm", "N")


def test_a_system_of_units_alone_is_refused(tmp_path):
    with pytest.raises(RecordingError, match=r"line 1 states the system of units: Imperial"):
        rig(tmp_path, "Time|Displacement|Force", "Units: Imperial")


def test_a_row_of_units_may_have_a_label_in_a_column_of_its_own(tmp_path):
    assert rig(tmp_path, "Time|Displacement|Force", "Units: in, lbf").units == ("in", "lbf")


def test_the_time_of_catman_is_named_with_its_sample_rate(tmp_path):
    found = rig(tmp_path, "Time  1 - default sample rate [s]|Displacement [mm]|Force [N]")
    assert found.time == pytest.approx([row[0] for row in ROWS])


@pytest.mark.parametrize(
    ("first", "step", "kind"),
    [(43894.5, 1e-5, "days since 1900"), (1.5833124e12, 5e2, "milliseconds since 1970")],
)
def test_a_date_in_place_of_a_time_is_refused(tmp_path, first, step, kind):
    rows = "\n".join(f"{first + step * i!r},{row[1]},{row[2]}" for i, row in enumerate(ROWS))
    (tmp_path / "rig.csv").write_text(f"Time,Displacement [mm],Force [N]\n{rows}\n")
    with pytest.raises(RecordingError, match=kind):
        read_recording(Source("axial", tmp_path / "rig.csv"))
    assert read_recording(Source("axial", tmp_path / "rig.csv", units={"time": "s"})).time is not None


@pytest.mark.parametrize("code", ["9.91E37", "9.91e+37", "-999.25", "8388607"])
def test_more_codes_for_missing_values_are_asked_about(tmp_path, code):
    rows = [f"{row[0]},{row[1]},{row[2] / 100}" for row in ROWS]
    rows[20] = f"{ROWS[20][0]},{ROWS[20][1]},{code}"
    (tmp_path / "rig.csv").write_text("Time [s],Displacement [mm],Force [N]\n" + "\n".join(rows) + "\n")
    with pytest.raises(RecordingError, match="code for a missing value"):
        read_recording(Source("axial", tmp_path / "rig.csv"))


@pytest.mark.parametrize("mark", ["#VALEUR!", "#N/D", "#NA", "#NaN", "#####"])
def test_marks_of_spreadsheets_are_missing_values(tmp_path, mark):
    rows = [f"{row[0]},{row[1]},{row[2]}" for row in ROWS]
    rows[20] = f"{mark},1.0,250.0"
    (tmp_path / "rig.csv").write_text("Time [s],Displacement [mm],Force [N]\n" + "\n".join(rows) + "\n")
    with pytest.raises(RecordingError, match="is a missing value"):
        read_recording(Source("axial", tmp_path / "rig.csv"))


def test_rows_behind_a_comment_sign_are_counted(tmp_path):
    rows = [("# " if i in (20, 21) else "") + f"{row[0]},{row[1]},{row[2]}" for i, row in enumerate(ROWS)]
    rows.insert(10, "# the rig was restarted here")
    (tmp_path / "rig.csv").write_text("Time [s],Displacement [mm],Force [N]\n" + "\n".join(rows) + "\n")
    found = read_recording(Source("axial", tmp_path / "rig.csv"))
    assert len(found.force) == 38
    said = " ".join(repair.text for repair in found.repairs)
    assert "2 rows of numbers behind # or % are left out as comments (line 23 and others)" in said


def coupon(folder: Path, header: str, begin: float, **keys: object):
    stretches = 1.0 + 0.05 * np.arange(20)
    rows = [f"{begin + s - 1.0:.4f},{s - s**-2:.5f}" for s in stretches]
    (folder / "coupon.csv").write_text(f"{header}\n" + "\n".join(rows) + "\n")
    return read_recording(Source("uniaxial", folder / "coupon.csv", **keys)).displacement  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["Stretch [mm/mm]", "lambda (in/in)", "Stretch [-]"])
def test_a_stretch_in_a_ratio_of_lengths_is_a_stretch(tmp_path, name):
    assert coupon(tmp_path, f"{name},Stress [MPa]", 1.0) == pytest.approx(0.05 * np.arange(20), abs=1e-4)


def test_a_strain_in_a_ratio_of_lengths_is_a_strain(tmp_path):
    assert coupon(tmp_path, "Strain [mm/mm],Stress [MPa]", 0.0) == pytest.approx(
        0.05 * np.arange(20), abs=1e-4
    )


@pytest.mark.parametrize(
    ("name", "begin", "other"), [("Strain", 1.02, "a stretch"), ("Stretch", 0.02, "a strain")]
)
def test_a_coupon_that_does_not_begin_at_rest_is_asked_about(tmp_path, name, begin, other):
    with pytest.raises(RecordingError, match=f"as {other} does"):
        coupon(tmp_path, f"{name},Stress [MPa]", begin)
    assert len(coupon(tmp_path, f"{name},Stress [MPa]", begin, units={"displacement": name.lower()})) == 20


@pytest.mark.parametrize("name", ["Green strain", "Transverse strain", "Querdehnung [%]", "Shear strain"])
def test_other_measures_of_strain_are_refused(tmp_path, name):
    with pytest.raises(RecordingError, match="no column stretch"):
        coupon(tmp_path, f"{name},Stress [MPa]", 0.0)


def test_the_nominal_stress_of_a_planar_test_may_be_that_of_pure_shear(tmp_path):
    found = coupon(tmp_path, "Pure shear strain,Pure shear stress [MPa]", 0.0)
    assert found == pytest.approx(0.05 * np.arange(20), abs=1e-4)


def test_names_with_control_characters_are_shown_written_out(tmp_path):
    found = rig(tmp_path, "Time [s]|Displacement [mm]|Force [N]|T\x1b]0;title\x07\u202e")
    assert found.unused == ("T\\x1b]0;title\\x07\\u202e",)


def test_a_header_with_another_number_of_names_is_said(tmp_path):
    (tmp_path / "rig.csv").write_text("Time;Disp;Force;Temp\n0;0;0\n1;1;1\n2;2;2\n")
    with pytest.raises(RecordingError, match="line 1 has 4 names, and the rows have 3 fields"):
        read_recording(Source("axial", tmp_path / "rig.csv"))
