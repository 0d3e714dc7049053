"""Units above a table: rows of units, statements in words, and numbers that are no units."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.source import Source

ROWS = "\n".join(f"{0.5 * i}{{0}}{0.1 * i:.3f}{{0}}{10.0 * i:.3f}" for i in range(8))


def read(folder: Path, head: str, separator: str = ",", **options):
    (folder / "axial.csv").write_text(head + "\n" + ROWS.format(separator) + "\n")
    return read_recording(Source("axial", folder / "axial.csv", **options))


@pytest.mark.parametrize(
    "head",
    [
        "s,in,lbf\nTime,Displacement,Force",
        "[s],[in],[lbf]\nTime,Displacement,Force",
        "(sec),(inch),(lbf)\n\nTime,Displacement,Force",
        "# units: s, in, lbf\nTime,Displacement,Force",
        "Force unit: lbf\nDisplacement unit: in\nTime,Displacement,Force",
        "Channel 1: Time, s\nChannel 2: Displacement, in\nChannel 3: Force, lbf\nTime,Displacement,Force",
        "Force [lbf] over displacement [in]\nTime,Displacement,Force",
        '"Time\n[s]","Displacement\n[in]","Force\n[lbf]"',
    ],
)
def test_units_above_the_names_are_those_of_the_columns(tmp_path, head):
    found = read(tmp_path, head)
    # An inch is 25.4 mm, a pound-force 4.4482216 N by definition.
    assert found.displacement[-1] == pytest.approx(0.7 * 25.4)
    assert found.force[-1] == pytest.approx(70.0 * 4.4482216152605)
    assert not any(column.assumed for column in found.columns if column.quantity != "time")


def test_values_above_a_table_are_no_units(tmp_path):
    """The range of a load cell, a preload and a speed say nothing about the columns."""
    head = (
        "Load cell: 25 kN\nPreload force 50 kN\nSpeed: 10 mm/min\nMax. force: 5 kN\nTime,Displacement,Force"
    )
    found = read(tmp_path, head)
    assert found.force[-1] == pytest.approx(70.0)
    assert {column.quantity for column in found.columns if column.assumed} == {
        "time",
        "displacement",
        "force",
    }


def test_statements_that_contradict_each_other_are_refused(tmp_path):
    with pytest.raises(RecordingError, match=r"state kN \(line 1\) and lbf \(line 2\)"):
        read(tmp_path, "Force in kN\nForce in lbf\nTime,Displacement,Force")


def test_a_unit_of_the_column_goes_before_a_statement(tmp_path):
    found = read(tmp_path, "Force unit: lbf\nTime [s],Displacement [mm],Force [N]")
    assert found.force[-1] == pytest.approx(70.0)


@pytest.mark.parametrize(
    "name", ["Load Cell 500 lbf", "Force 500 daN", "Load 5 kip", "5 kN Load Cell", "10 x Force [N]"]
)
def test_the_range_of_a_sensor_is_not_its_unit(tmp_path, name):
    with pytest.raises(RecordingError, match="give the unit"):
        read(tmp_path, f"Time [s],Stroke [mm],{name}")


@pytest.mark.parametrize("name", ["Channel 3 kN", "force_2_kN", "Sensor 4 kN", "Force 1 [kN]"])
def test_the_number_of_a_channel_is_no_range(tmp_path, name):
    assert read(tmp_path, f"Time [s],Stroke [mm],{name}").force[-1] == pytest.approx(70e3)


def test_an_empty_unit_of_the_last_column_is_none(tmp_path):
    (tmp_path / "axial.csv").write_text(
        "Time;Weg;Kraft;Zyklus\ns;mm;daN;\n"
        + "\n".join(f"{i},0;{i / 10};{i};1".replace(".", ",") for i in range(8))
    )
    assert read_recording(Source("axial", tmp_path / "axial.csv")).force[-1] == pytest.approx(70.0)


def test_which_columns_were_read_is_known(tmp_path):
    (tmp_path / "axial.csv").write_text(
        "Standardmessrate [s];Crosshead;Extensometer [mm];Load\n"
        + "\n".join(f"{i};{i / 10};{i / 11:.3f};{i}" for i in range(8))
    )
    found = read_recording(Source("axial", tmp_path / "axial.csv", columns={"displacement": "Crosshead"}))
    assert [(one.quantity, one.number, one.unit, one.assumed) for one in found.columns] == [
        ("displacement", 2, "mm", True),
        ("force", 4, "N", True),
    ]
    assert found.unused == ("Standardmessrate [s]", "Extensometer [mm]")
    assert any("was not taken as the time" in repair.text for repair in found.repairs)


def test_the_mode_decides_between_columns_of_two(tmp_path):
    head = "Axial Displacement [mm],Axial Force [N],Radial Displacement [mm],Radial Force [N]"
    rows = "\n".join(f"{i},{2 * i},{3 * i},{4 * i}" for i in range(8))
    (tmp_path / "both.csv").write_text(f"{head}\n{rows}\n")
    for mode, ratio in (("axial", 2.0), ("radial", 4.0 / 3.0)):
        found = read_recording(Source(mode, tmp_path / "both.csv"))
        np.testing.assert_allclose(found.force, ratio * found.displacement)


@pytest.mark.parametrize("name", ["Elongation (%)", "Extension (%)", "Verformung [%]"])
def test_a_change_of_length_in_percent_is_a_strain(tmp_path, name):
    (tmp_path / "coupon.csv").write_text(
        f"{name},Stress (MPa)\n" + "\n".join(f"{10 * i},{i / 10}" for i in range(8))
    )
    assert read_recording(Source("uniaxial", tmp_path / "coupon.csv")).displacement[-1] == pytest.approx(0.7)


def test_a_positive_compression_is_not_read_as_tension(tmp_path):
    (tmp_path / "coupon.csv").write_text(
        "Compressive Strain (%),Compressive Stress (MPa)\n" + "\n".join(f"{5 * i},{i / 10}" for i in range(8))
    )
    with pytest.raises(RecordingError, match="compressive, and its values are positive"):
        read_recording(Source("uniaxial", tmp_path / "coupon.csv"))
    found = read_recording(Source("uniaxial", tmp_path / "coupon.csv", reverse=("displacement", "force")))
    assert found.displacement[-1] == pytest.approx(-0.35)


BLOCKS = """Data Header: Time: {time} Sec
Cycle {cycle}
Time,{second},Force
s,mm,{unit}
"""


def blocks(folder: Path, second: str = "Displacement", unit: str = "kN") -> Path:
    """Three cycles, each below a header of its own; the names and the unit of the last one may differ."""
    parts = []
    for cycle in range(3):
        last = cycle == 2
        parts.append(
            BLOCKS.format(
                time=4.5 * cycle,
                cycle=cycle + 1,
                second=second if last else "Displacement",
                unit=unit if last else "kN",
            )
        )
        parts += [f"{4 * cycle + i},{0.1 * i:.2f},{i}\n" for i in range(4)]
    (folder / "blocks.csv").write_text("".join(parts))
    return folder / "blocks.csv"


def test_a_header_that_each_cycle_repeats_is_left_out_and_said(tmp_path):
    found = read_recording(Source("axial", blocks(tmp_path)))
    assert len(found.force) == 12
    assert found.force[-1] == pytest.approx(3000.0)
    assert any("8 lines that repeat the header are left out" in repair.text for repair in found.repairs)


@pytest.mark.parametrize("change", [{"second": "Stroke"}, {"unit": "N"}])
def test_a_header_that_differs_is_refused(tmp_path, change):
    with pytest.raises(RecordingError, match=r"blocks.csv:(19|20): .*in a file of its own"):
        read_recording(Source("axial", blocks(tmp_path, **change)))


TABLE = "time_s,displacement_mm,force_N\n" + "".join(f"{i},{0.1 * i:.2f},{i}\n" for i in range(30))


@pytest.mark.parametrize(
    ("below", "said"),
    [
        ("End of test\n", r'the text below the table is left out \(line 32: "End of test"\)'),
        ("-----\nOperator: A. Smith, shift 2\n", r"2 lines of text below the table .* line 32: \"-----\""),
        ("Max,2.9,29\nMin,0,0\n", r'2 lines of text below the table .* line 32: "Max,2.9,29"'),
    ],
)
def test_text_below_the_table_is_left_out_and_said(tmp_path, below, said):
    (tmp_path / "rig.csv").write_text(TABLE + below)
    found = read_recording(Source("axial", tmp_path / "rig.csv"))
    assert len(found.force) == 30
    assert re.search(said, " ".join(repair.text for repair in found.repairs))


@pytest.mark.parametrize(
    "below", ["30,3.0\n", "NaN,NaN,NaN\n", "30,3.0,abc\n", "time,disp,force\n0,1,2\n", "#N/A,3.0,30\n"]
)
def test_what_may_be_a_sample_is_not_left_out(tmp_path, below):
    (tmp_path / "rig.csv").write_text(TABLE + below)
    with pytest.raises(RecordingError, match=r"rig\.csv:3[123]: "):
        read_recording(Source("axial", tmp_path / "rig.csv"))


def test_extremes_of_cycles_are_no_samples(tmp_path):
    (tmp_path / "rig.csv").write_text(
        "Cycle,Max Displacement [mm],Max Force [N]\n1,3,900\n2,3,890\n3,3,880\n"
    )
    with pytest.raises(RecordingError, match="are its rows the extremes of cycles"):
        read_recording(Source("axial", tmp_path / "rig.csv"))


def two_tables(folder: Path, second: str, units: str) -> Path:
    """Write one table from rest to 2 mm at 100 N/mm, and below a header another with force and travel exchanged."""
    lines = ["Time;Displacement;Force", "s;mm;N"]
    lines += [f"{i};{0.1 * i:.1f};{10 * i}" for i in range(20)]
    lines += [second, *([units] if units else [])]
    lines += [f"{i};{10 * (40 - i)};{0.1 * (40 - i):.1f}" for i in range(20, 40)]
    (folder / "two.csv").write_text("\n".join(lines) + "\n")
    return folder / "two.csv"


@pytest.mark.parametrize("sign", ["", "# "])
@pytest.mark.parametrize("units", ["s;N;mm", ""])
def test_a_further_table_with_its_columns_in_another_order_is_put_in_order(tmp_path, sign, units):
    units = units and sign + units
    found = read_recording(Source("axial", two_tables(tmp_path, f"{sign}Time;Force;Displacement", units)))
    assert len(found.force) == 40
    assert found.force == pytest.approx(100.0 * found.displacement)
    assert found.displacement.max() == pytest.approx(2.0)
    assert any(
        "from line 23 on are put into the order of the first header" in one.text for one in found.repairs
    )


@pytest.mark.parametrize("sign", ["", "# "])
def test_tables_with_lines_above_each_and_columns_of_other_quantities_are_put_in_order(tmp_path, sign):
    """As a rig writes them: a line with the time of each table, and units that no column needs."""
    lines = []
    for begin, order in ((0, ("Displacement", "Force")), (20, ("Force", "Displacement"))):
        unit = {"Displacement": "mm", "Force": "N"}
        lines += [f"{sign}Data Acquisition\t\t\tTime:\t{begin + 1.9}\tSec\t3/29/2016 1:54:32 PM"]
        lines += [sign + "\t".join(("Running Time", *order, "Axial Count"))]
        lines += [sign + "\t".join(("Sec", *(unit[name] for name in order), "segments"))]
        for i in range(begin, begin + 20):
            value = {"Displacement": 0.1 * (20 - abs(20 - i)), "Force": 10.0 * (20 - abs(20 - i))}
            lines.append(f"{i}\t{value[order[0]]:.2f}\t{value[order[1]]:.2f}\t1")
    (tmp_path / "rig.dat").write_text("\n".join(lines) + "\n")
    found = read_recording(Source("axial", tmp_path / "rig.dat"))
    assert len(found.force) == 40
    assert found.force == pytest.approx(100.0 * found.displacement)


@pytest.mark.parametrize(
    ("second", "units"),
    [
        ("Time;Force;Stroke", "s;N;mm"),
        ("Time;Force;Displacement", "s;kN;mm"),
        ("Time;Force;Displacement;Temperature", "s;N;mm;degC"),
        ("# Time;Force;Displacement", "# s;kN;mm"),
    ],
)
def test_a_further_table_with_other_names_or_units_is_refused_with_a_remedy_that_helps(
    tmp_path, second, units
):
    with pytest.raises(RecordingError, match="each table in a file of its own"):
        read_recording(Source("axial", two_tables(tmp_path, second, units)))


@pytest.mark.parametrize("head", ["Time;Displacement;Force;Remark", "# Time;Displacement;Force;Remark"])
def test_a_last_column_with_a_name_and_no_values_is_read_over(tmp_path, head):
    (tmp_path / "axial.csv").write_text(
        f"{head}\ns;mm;N;\n" + "".join(f"{i};{i};{2 * i};\n" for i in range(9))
    )
    found = read_recording(Source("axial", tmp_path / "axial.csv"))
    assert found.force == pytest.approx(2.0 * found.displacement)
    assert found.unused == ("Remark",)
