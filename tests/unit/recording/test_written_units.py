"""Units, factors and formulas in and above a header that were read as mm, N or s: understood now, or refused."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.header.name import heading
from bushcli.recording.source import Source

ROWS = [(0.5 * i, 2.0 * math.sin(i / 6), 500.0 * math.sin(i / 6), 2.2 * math.sin(i / 6)) for i in range(20)]
LARGEST = max(abs(row[1]) for row in ROWS)


def rig(folder: Path, header: str, above: str = "", **options: object):
    """Read a file with time, travel, force and a fourth column, as many as the header has names."""
    names = header.split(";")
    lines = [*([above] if above else []), header]
    lines += [";".join(f"{value:.6f}" for value in row[: len(names)]) for row in ROWS]
    (folder / "rig.csv").write_text("\n".join(lines) + "\n")
    return read_recording(Source("axial", folder / "rig.csv", **options))  # type: ignore[arg-type]


def coupon(folder: Path, name: str):
    rows = "\n".join(f"{1.0 + 0.05 * i:.2f};{0.1 * i:.2f}" for i in range(9))
    (folder / "coupon.csv").write_text(f"stretch;{name}\n{rows}\n")
    return read_recording(Source("uniaxial", folder / "coupon.csv"))


@pytest.mark.parametrize(
    "name",
    [
        "Displacement (In)", "Displacement [In]", "Displacement (In.)", "Displacement [In.]", "Displacement/In",
        "Displacement, In", "Displacement: In", "Displacement - In", "Displacement In", "displacement_In",
        "Position(In)", "Displacement [In] filtered", "Displacement in In", "Displacement «In»", "Displacement “In”",
        "Displacement = In",
    ],
)  # fmt: skip
def test_inches_in_title_case(tmp_path, name):
    found = rig(tmp_path, f"Time [s];{name};Force [N]")
    assert np.abs(found.displacement).max() == pytest.approx(25.4 * LARGEST, rel=1e-5)


def test_inches_in_title_case_in_a_row_of_units(tmp_path):
    assert rig(tmp_path, "Sec;In;Lbf", "Time;Displacement;Force").units == ("in", "lbf")


@pytest.mark.parametrize("name", ["Force In kN", "Force In N", "Force (In kN)"])
def test_in_before_a_unit_is_a_preposition(name):
    assert heading(name).written in (("kN",), ("N",), ("In kN",))


@pytest.mark.parametrize(
    "name",
    [
        "Displacement [in''']", "Extension [strain]", "Extension [stretch]", "Displacement [lambda]",
        "Displacement [force]", "Displacement [load]", "Displacement [a.u.]", "Displacement [rel]",
        "Displacement [eng]", "Displacement [scaled]", "Displacement [ADC]", "Displacement (nominal)",
    ],
)  # fmt: skip
def test_a_text_in_brackets_that_is_no_remark_is_a_unit_of_the_displacement(tmp_path, name):
    place = re.escape(f"{tmp_path}/rig.csv:1: column 2 ({name})")
    with pytest.raises(RecordingError, match=rf"{place}.*units = \{{displacement"):
        rig(tmp_path, f"Time [s];{name};Force [N]")


@pytest.mark.parametrize(
    "name",
    [
        "Force [a.u.]", "Force [A.U.]", "Force [rel]", "Force [5V]", "Force [5 V]", "Force (0..10V)", "Force [0-5]",
        "Force [0.1]", "Force [1.0]", "Force [2.5]", "Force [stress]", "Force [at]", "Force [of]", "Force (time)",
        "Force 10V", "Force @5V", "Force 2t", "Force 500lb cell", "Force N/A", "Force n/a", "Force [500]", "Force [In]",
        "Force raw ADC",
    ],
)  # fmt: skip
def test_a_text_in_brackets_that_is_no_remark_is_a_unit_of_the_force(tmp_path, name):
    place = re.escape(f"{tmp_path}/rig.csv:1: column 3 ({name})")
    with pytest.raises(RecordingError, match=rf"{place}.*units = \{{force"):
        rig(tmp_path, f"Time [s];Displacement [mm];{name}")
    found = rig(tmp_path, f"Time [s];Displacement [mm];{name}", units={"force": "kN"})
    assert np.abs(found.force).max() == pytest.approx(1e3 * 250.0 * LARGEST, rel=1e-5)


@pytest.mark.parametrize(
    "name", ["Time [sample]", "Time [cycles]", "Time [a.u.]", "Time [rel]", "Time [counts]", "Time [index]"]
)
def test_a_time_that_counts_something_is_neither_seconds_nor_left_out(tmp_path, name):
    place = re.escape(f"rig.csv:1: column 1 ({name})")
    with pytest.raises(RecordingError, match=rf"{place}.*units = \{{time"):
        rig(tmp_path, f"{name};Displacement [mm];Force [N]")


@pytest.mark.parametrize(
    "name",
    [
        "Force (raw)", "Force [filtered]", "Force [ch1]", "Force (CH 1)", "Force (Ch. 2)", "Force (Channel B)",
        "Force (Z)", "Force [F]", "Force [2]", "Force (1)", "Force (measured)", "Force [Istwert]", "Force [load]",
        "Force (Load Cell 1)", "Kraft (Force)", "Force (AI 1)", "Force (Strain 1)", "Force (front left)",
        "Load 3(Load)", "Force (mean of 2) [N]", "Force (rel) [N]", "Force [eng] [N]", "Force (displacement) [N]",
    ],
)  # fmt: skip
def test_remarks_in_brackets_are_no_units(name):
    assert heading(name).written in ((), ("N",))


def test_a_row_of_units_makes_words_in_brackets_a_remark(tmp_path):
    found = rig(tmp_path, "s;in;lbf", "Time (abs);Travel (rel);Load (data of cell)")
    assert found.units == ("in", "lbf")


@pytest.mark.parametrize(("name", "factor"), [("stress [at]", 0.0980665), ("stress at", 0.0980665)])
def test_a_technical_atmosphere_is_a_unit_of_stress(tmp_path, name, factor):
    # 1 at = 1 kgf/cm2 = 98066.5 Pa.
    assert coupon(tmp_path, name).force[-1] == pytest.approx(0.8 * factor)


@pytest.mark.parametrize(
    ("above", "system"),
    [
        ("Unit system: US", "US"), ("Units: US", "US"), ("Unit set: US", "US"), ("System of units: English", "English"),
        ("Units: English", "English"), ("Units = SI", "SI"), ("Unit System;MKS", "MKS"), ("Units: Metric", "Metric"),
        ("Einheitensystem: SI", "SI"), ("All values in SI units", "SI units"), ("US units", "US units"),
        ("Values in SI", "SI"), ("Unit set to SI", "SI"),
    ],
)  # fmt: skip
def test_a_system_of_units_says_no_unit_and_is_refused(tmp_path, above, system):
    said = rf"column 2 \(Displacement\) has no unit, and line 1 states the system of units: {system} \(give the unit"
    with pytest.raises(RecordingError, match=said):
        rig(tmp_path, "Time;Displacement;Force", above)
    # The time of each system is in seconds.
    given = {"displacement": "in", "force": "lbf"}
    assert rig(tmp_path, "Time;Displacement;Force", above, units=given).time[-1] == pytest.approx(9.5)


@pytest.mark.parametrize(
    ("above", "units"),
    [
        ("Length unit: inch", ("in", "N")), ("Length unit = in", ("in", "N")), ("Längeneinheit: Zoll", ("in", "N")),
        ("Krafteinheit: kN", ("mm", "kN")), ("Values in kN and mm", ("mm", "kN")), ("Alle Werte in kN", ("mm", "kN")),
        ("Units set to mm, kN", ("mm", "kN")), ("Units set to in, lbf", ("in", "lbf")),
        ("Units: all values in mm and kN", ("mm", "kN")), ("Unit system: SI (mm, kN)", ("mm", "kN")),
        ("Units: US (in, lbf)", ("in", "lbf")), ("- Force in kN", ("mm", "kN")),
    ],
)  # fmt: skip
def test_more_statements_of_units_above_the_table(tmp_path, above, units):
    assert rig(tmp_path, "Time;Displacement;Force", above).units == units


@pytest.mark.parametrize("above", ["Length unit: in", "Values in inches", "Displacement unit: in"])
def test_a_statement_of_three_words_is_no_row_of_units(tmp_path, above):
    rows = "\n".join("\t".join(f"{value:.6f}" for value in row[:3]) for row in ROWS)
    (tmp_path / "rig.csv").write_text(f"{above}\nTime\tDisplacement\tForce\n{rows}\n")
    assert read_recording(Source("axial", tmp_path / "rig.csv")).units == ("in", "N")


@pytest.mark.parametrize(
    ("above", "column"),
    [
        ("Force unit: foo", 3), ("Force unit: kg", 3), ("Unit of force = raw", 3), ("Units: foo", 1),
        ("Units: none", 1), ("Units: mm, foo", 1), ("Length unit: smoot", 2), ("Values in V", 1),
        ("Values in V and A", 1),
        ("Kraft Einheit: Skalenteile", 3),
    ],
)  # fmt: skip
def test_an_unknown_unit_above_the_table_is_refused(tmp_path, above, column):
    said = rf"rig\.csv:2: column {column} .* what line 1 states is not a unit of .*give the unit"
    with pytest.raises(RecordingError, match=said):
        rig(tmp_path, "Time;Displacement;Force", above)


@pytest.mark.parametrize(
    "above",
    [
        "Unit under test: US-5", "Unit: 3", "Control unit: FT60", "Business unit: US", "Gauge length unit: in",
        "Number of units: 5", "Data in file 3", "Values in Berlin", "English text", "Test unit: MTS 810",
    ],
)  # fmt: skip
def test_lines_that_state_no_unit_of_a_column(tmp_path, above):
    assert rig(tmp_path, "Time;Displacement;Force", above).units == ("mm", "N")


@pytest.mark.parametrize(
    "name",
    [
        "Force [N]/2", "2*Force [N]", "0.5 Force [N]", "Force x 2", "Force ×2", "Force÷2", "Force*0.1", "Force e3 N",
        "Force E+3 N", "Force [kN]e3", "Force corrected [x2]", "Force scale 0.1", "Force factor 2", "Force 10x",
        "2x Force N", "-1*Force [N]", "Force [N] x 0,1", "Force x0.01", "Force 10³ N", "Force x1e-3 kN",
    ],
)  # fmt: skip
def test_a_factor_beside_a_column_is_refused_with_its_place(tmp_path, name):
    place = re.escape(f"rig.csv:1: column 3 ({name})")
    with pytest.raises(RecordingError, match=rf"{place}.*units = \{{force"):
        rig(tmp_path, f"Time [s];Displacement [mm];{name}")
    # Beside a column in a known unit it is not meant.
    found = rig(tmp_path, f"Time [s];Displacement [mm];{name};Force [N]")
    assert np.abs(found.force).max() == pytest.approx(1.1 * LARGEST, rel=1e-5)


def test_a_factor_beside_another_length_is_refused(tmp_path):
    with pytest.raises(RecordingError, match=r'column 2 .*: the factor "e-3" is not applied'):
        rig(tmp_path, "Time [s];Displacement e-3 m;Force [N]")


@pytest.mark.parametrize(
    "name",
    [
        "Force x1 [N]",
        "Force*1 [N]",
        "Force X2 [N]",
        "Force 2 x [N]",
        "Force 1.1 [N]",
        "Force 2 [N]",
        "N x Force [N]",
    ],
)
def test_a_factor_of_one_and_the_number_of_an_axis_are_none(name):
    assert heading(name).written == ("N",)


@pytest.mark.parametrize(
    "above",
    [
        "Scale factor: 10", "Gain;1;10;100", "Multiplier: 1000", "Skalierungsfaktor: 2,5", "ScaleFactor=0.1",
        "Force gain: 100", "Calibration factor force: 1.003", "Scale;1;10;100;1000", "Fattore di scala: 10",
        "Messwerte mit 10 multiplizieren", "Force corrected by a factor of 1.02",
    ],
)  # fmt: skip
def test_a_factor_of_no_certain_column_or_one_that_is_contained_is_reported(tmp_path, above):
    found = rig(tmp_path, "Time [s];Displacement [mm];Force [N]", above)
    assert re.search(
        r"line 1 states a factor .* was not applied", " ".join(one.text for one in found.repairs)
    )


@pytest.mark.parametrize(
    "above",
    [
        "Force scale factor: 2.0", "Force scale: 10", "Scale factor;1;1;100", "Scale;1;1;2", "Faktor Kraft: 10",
        "multiplier,1,1,4.448", "Scale factor;;;1000", "Skalierung 1 1 1000", "# Force x10", "Load multiplier = 1000",
        "Multiply force by 10", "Facteur d'échelle effort: 10", "Force in units of 100 N", "Forces divided by 10",
        "Force in thousand N", "Force values in thousands", "Forces are in 100 N",
    ],
)  # fmt: skip
def test_a_factor_of_a_column_that_is_read_is_refused_with_its_place(tmp_path, above):
    header = "Time [s];Displacement [mm];Force [N]"
    with pytest.raises(
        RecordingError, match=r"rig\.csv:1: .*column 3 \(Force \[N\]\).*units = \{force = \"N\"\}"
    ):
        rig(tmp_path, header, above)
    found = rig(tmp_path, header, above, units={"force": "N"})
    assert np.abs(found.force).max() == pytest.approx(500.0, rel=0.01)
    assert any("which was not applied" in one.text for one in found.repairs)


@pytest.mark.parametrize("above", ["Scale factor;1;10;1", "Displacement scale factor: 10", "All values x 10"])
def test_a_factor_of_the_displacement_is_refused(tmp_path, above):
    with pytest.raises(RecordingError, match=r"rig\.csv:1: .*column 2.*units = \{displacement"):
        rig(tmp_path, "Time [s];Displacement [mm];Force [N]", above)


def test_a_factor_of_a_column_that_is_not_read_does_not_matter(tmp_path):
    found = rig(tmp_path, "Time [s];Displacement [mm];Force [N];Temperature [C]", "Scale;1;1;1;10")
    assert not found.repairs


@pytest.mark.parametrize(
    "above",
    [
        "Scale factor;1;1,0;1.0", "Gain: 1", "Full scale: 5 kN", "PID gain: 5", "Scale 1:2", "Shape factor: 2",
        "Scale: auto", "Gauge factor: 2.05", "Specimen 2 x 3 mm", "Scale: 2 kN/V", "multiplier,1,1,1",
        "[N/mm**2] [N] [s]",
    ],
)  # fmt: skip
def test_other_numbers_above_the_table_are_no_factors(tmp_path, above):
    found = rig(tmp_path, "Time [s];Displacement [mm];Force [N]", above)
    assert not any("factor" in one.text for one in found.repairs)


FORMULAS = [
    "abs({}) [{}]", "|{}| [{}]", "-{} [{}]", "{}^2 [{}]", "{}**2", "{}² [{}]", "1/{} [{}]", "{} diff [{}]",
    "{} predicted", "{} FEM [{}]", "{} nominal [{}]", "sqrt({})", "sum(|{}|) [{}]", "sum(abs({})) [{}]",
    "{} magnitude", "{} stress",
]  # fmt: skip


@pytest.mark.parametrize("form", FORMULAS)
def test_a_formula_or_another_quantity_is_not_taken_for_the_measured_one(tmp_path, form):
    travel, force = form.format("Displacement", "mm"), form.format("Force", "N")
    with pytest.raises(RecordingError, match="no column force_N"):
        rig(tmp_path, f"Time [s];Displacement [mm];{force}")
    with pytest.raises(RecordingError, match="no column displacement_mm"):
        rig(tmp_path, f"Time [s];{travel};Force [N]")
    assert np.abs(
        rig(tmp_path, f"Time [s];Displacement [mm];{force};Force [N]").force
    ).max() == pytest.approx(1.1 * LARGEST, rel=1e-5)


@pytest.mark.parametrize(
    "name", ["Absolute force [N]", "Kraftbetrag [N]", "Force/Displacement", "Differenzkraft [N]"]
)
def test_magnitudes_quotients_and_differences_are_not_the_force(tmp_path, name):
    with pytest.raises(RecordingError, match="no column force_N"):
        rig(tmp_path, f"Time [s];Displacement [mm];{name}")


def test_a_formula_can_be_chosen(tmp_path):
    found = rig(tmp_path, "Time [s];Displacement [mm];-Force [N]", columns={"force": "-Force [N]"})
    assert found.force[1] == pytest.approx(ROWS[1][2], rel=1e-5)


def test_an_absolute_position_is_a_displacement(tmp_path):
    assert rig(tmp_path, "Time [s];Displacement abs [mm];Force [N]").units == ("mm", "N")


@pytest.mark.parametrize(
    "name",
    [
        "2nd PK stress [MPa]", "PK stress [MPa]", "reduced stress [MPa]", "Mooney stress", "von Mises stress [MPa]",
        "|stress| [MPa]",
    ],
)  # fmt: skip
def test_another_stress_is_not_taken_for_the_nominal_one(tmp_path, name):
    with pytest.raises(RecordingError, match="no column nominal_stress_MPa"):
        coupon(tmp_path, name)


@pytest.mark.parametrize(
    "name", ["1st PK stress [MPa]", "first Piola Kirchhoff stress", "Stress (F/A0)", "Stress (nominal)"]
)
def test_names_of_the_nominal_stress(tmp_path, name):
    assert coupon(tmp_path, name).force[-1] == pytest.approx(0.8)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("Force [1]", r"column 3 \(Force \[1\]\) says that it has no unit"),
        ("Force [M]", r"column 3 \(Force \[M\]\) is in M,"),
        ("Force [KG]", r"column 3 \(Force \[KG\]\) is in KG,"),
    ],
)
def test_units_are_shown_as_written(tmp_path, name, said):
    with pytest.raises(RecordingError, match=said):
        rig(tmp_path, f"Time [s];Displacement [mm];{name}")


@pytest.mark.parametrize(
    "name",
    [
        "Force k N", "Force K N", "Force, k, N", "Force N k", "Force k [N]", "Force k lbf", "Force mega N",
        "Force centi N", "Force milli [N]", "Force '000 N", "Force ’000 N", "Force 000's N", "Force 000s N",
        "Force Tsd. N",
    ],
)  # fmt: skip
def test_a_prefix_or_thousands_apart_from_the_unit_of_a_force_are_refused(tmp_path, name):
    with pytest.raises(RecordingError, match=r"the factor .* is not applied"):
        rig(tmp_path, f"Time [s];Travel [mm];{name}")


@pytest.mark.parametrize(
    "names", ["Time [s];Travel µ m", "Time [s];Travel c m", "Time [s];Travel m m", "Time m s;Travel mm"]
)
def test_a_prefix_apart_from_the_unit_of_a_length_or_time_is_refused(tmp_path, names):
    with pytest.raises(RecordingError, match=r"the factor .* is not applied"):
        rig(tmp_path, f"{names};Force [N]")


@pytest.mark.parametrize("name", ["Moment M Nm", "Moment M [Nm]", "Drehmoment M in Nm", "Kraft K [N]"])
def test_the_symbol_of_a_quantity_before_its_unit_is_no_prefix(name):
    assert not any("factor" in text for text in heading(name).written)


def test_a_pond_is_the_weight_of_a_gram(tmp_path):
    for unit, newtons in (("pond", 0.00980665), ("kpond", 9.80665), ("kp", 9.80665)):
        found = rig(tmp_path, f"Time [s];Travel [mm];Force [{unit}]")
        assert np.abs(found.force).max() == pytest.approx(newtons * 250 * LARGEST, rel=1e-5)


@pytest.mark.parametrize(
    "header",
    [
        "Time [s];Travel (rod);Force [N]", "Time [s];Travel (link);Force [N]", "Time [s];Travel [din];Force [N]",
        "Time [s];Travel [kin];Force [N]", "Time [s];Travel [mm s];Force [N]", "Time [s];Travel [mm];Force [N s]",
        "Time [s];Travel [mm];Force [Ns]", "Time [s];Travel [mm];Force [kNs]", "Time [s];Travel [mm];Force [EN]",
        "Time [s];Travel [mm];Force [GN]", "Time [hh];Travel [mm];Force [N]", "Time [dd];Travel [mm];Force [N]",
        "Time (a);Travel [mm];Force [N]", "Time [eon];Travel [mm];Force [N]", "Time [as];Travel [mm];Force [N]",
    ],
)  # fmt: skip
def test_what_only_a_library_of_units_takes_for_a_unit_is_refused(tmp_path, header):
    with pytest.raises(RecordingError, match="is not a known unit"):
        rig(tmp_path, header)


def test_an_impulse_per_area_is_no_stress(tmp_path):
    with pytest.raises(RecordingError, match='"MPa s" is not a known unit'):
        coupon(tmp_path, "nominal stress [MPa s]")


@pytest.mark.parametrize(
    ("unit", "millimetres"), [("µin", 25.4e-6), ("microinch", 25.4e-6), ("mils", 0.0254)]
)
def test_parts_of_an_inch_that_are_in_use_are_read(tmp_path, unit, millimetres):
    found = rig(tmp_path, f"Time [s];Travel [{unit}];Force [N]")
    assert np.abs(found.displacement).max() == pytest.approx(millimetres * LARGEST, rel=1e-5)


@pytest.mark.parametrize("name", ["Время, foo", "ms"])
def test_a_column_that_may_be_the_time_is_not_left_out_without_a_word(tmp_path, name):
    rows = "".join(f"{i};{0.1 * i:.1f};{i}\n" for i in range(8))
    (tmp_path / "a.csv").write_text(f"{name};Displacement [mm];Force [N]\n{rows}", encoding="utf-8")
    recording = read_recording(Source("axial", tmp_path / "a.csv"))
    assert recording.time is None
    assert any("was not taken as the time" in one.text for one in recording.repairs)


@pytest.mark.parametrize(("name", "factor"), [("Время, мин", 60.0), ("Время, ч", 3600.0)])
def test_minutes_and_hours_in_russian(tmp_path, name, factor):
    rows = "".join(f"{i};{0.1 * i:.1f};{i}\n" for i in range(8))
    (tmp_path / "a.csv").write_text(f"{name};Displacement [mm];Force [N]\n{rows}", encoding="utf-8")
    assert read_recording(Source("axial", tmp_path / "a.csv")).time[1] == factor
