"""Recordings: files of test rigs are read, and senseless ones are refused with file, line and column."""

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import (
    cycle_mask,
    read_program,
    read_recording,
    select_cycles,
    write_curve_csv,
)
from bushcli.recording.source import Source

Q = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 1.25])
F = np.array([0.0, 101.5, 199.0, -290.25, 400.0, 250.0])
T = np.arange(6) * 0.1


def table(columns=(T, Q, F), sep=",", decimal=".", end="\n"):
    rows = (sep.join(f"{v:.4f}".replace(".", decimal) for v in row) for row in zip(*columns, strict=True))
    return end.join(rows) + end


def source(tmp_path: Path, content: str | bytes, mode="axial", **keys) -> Source:
    file = tmp_path / "rig.csv"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return Source(mode, file, **keys)


def assert_read(recording):
    np.testing.assert_allclose(recording.displacement, Q, atol=1e-12)
    np.testing.assert_allclose(recording.force, F, atol=1e-9)
    np.testing.assert_allclose(recording.time, T, atol=1e-12)


HEAD = "time_s,displacement_mm,force_N\n"
GERMAN = "Prüfzeit;Traversenweg;Standardkraft\ns;mm;N\n"
RIG = '"Prüfprotokoll"\nMaschine;ZX 100\nQuerschnitt;170,873;mm2\nDatum;01.02.2024\n\n'


@pytest.mark.parametrize(
    "content",
    [
        HEAD + table(),
        HEAD.replace(",", " , ") + table(sep=" , "),
        "\ufeff" + HEAD + table(),
        HEAD.replace("\n", "\r\n") + table(end="\r\n"),
        HEAD.replace("\n", "\r") + table(end="\r"),
        (HEAD + table()).encode("utf-16"),
        (GERMAN + table(sep=";", decimal=",")).encode("latin-1"),
        GERMAN + table(sep=";", decimal=","),
        RIG + GERMAN + table(sep=";", decimal=","),
        RIG + GERMAN + table(sep=";"),
        "Zeit;Weg;Kraft;\ns;mm;N;\n" + table(sep=";", decimal=",", end=";\n"),
        "Zeit\tWeg\tKraft\n[s]\t[mm]\t[N]\n" + table(sep="\t", decimal=","),
        "Zeit [s]  Weg [mm]  Kraft [N]\n" + table(sep="   "),
        "# time_s displacement_mm force_N\n" + table(sep=" "),
        "# remark\n" + HEAD + table().replace("0.2000,1.0000", "\n# pause\n\n0.2000,1.0000"),
        HEAD + '"' + table(sep='","', decimal=",", end='"\n"').removesuffix('"'),
        "Time (s),Axial Displacement (mm),Axial Force (N)\n" + table(),
        "elapsed time,Stroke in mm,Load / N\n" + table(),
        "force_N,time_s,displacement_mm\n" + table((F, T, Q)),
        "clock;time_s;displacement_mm;force_N\n"
        + "12:00:01;"
        + table(sep=";").replace("\n", "\n12:00:01;")[:-9],
        "t_s,disp_mm,F_N\n" + table(),
        "time_ms,displacement_m,force_kN\n"
        + "\n".join(
            f"{t * 1e3:.15g},{q * 1e-3:.15g},{f * 1e-3:.15g}" for t, q, f in zip(T, Q, F, strict=True)
        ),
        HEAD + table().replace("-", "\u2212"),
        HEAD + table().rstrip("\n"),
    ],
)
def test_reads_what_rigs_write(tmp_path, content):
    assert_read(read_recording(source(tmp_path, content)))


def test_scientific_notation_of_all_kinds(tmp_path):
    rows = "0,0.0E0,1e2\n1,+.5e+0,2D2\n2,1.,3\n3,15e-1,4.0\n4,2,5\n"
    recording = read_recording(source(tmp_path, HEAD + rows))
    np.testing.assert_allclose(recording.displacement, [0, 0.5, 1, 1.5, 2])
    np.testing.assert_allclose(recording.force, [100, 200, 3, 4, 5])


def test_rotation_is_in_radians_inside(tmp_path):
    content = "time_s,rotation_deg,moment_Nm\n" + table()
    recording = read_recording(source(tmp_path, content, "torsional"))
    np.testing.assert_allclose(recording.displacement, np.radians(Q))
    np.testing.assert_allclose(recording.force, 1e3 * F)


@pytest.mark.parametrize(
    ("head", "values"),
    [
        ("stretch,nominal_stress_MPa", 1 + Q),
        ("stretch,stress [N/mm^2]", 1 + Q),
        ("Nominal Strain,Nominal Stress (MPa)", Q),
        ("Dehnung [%],Spannung [MPa]", 100 * Q),
        ("strain_percent,engineering stress", 100 * Q),
    ],
)
def test_coupon_displacement_is_stretch_minus_one(tmp_path, head, values):
    recording = read_recording(source(tmp_path, head + "\n" + table((values, F)), "uniaxial"))
    np.testing.assert_allclose(recording.displacement, Q, atol=1e-12)
    np.testing.assert_allclose(recording.force, F)
    assert recording.time is None


def test_a_coupon_needs_only_three_points(tmp_path):
    recording = read_recording(source(tmp_path, "stretch,nominal_stress_MPa\n1,0\n2,1\n3,2\n", "planar"))
    assert len(recording.force) == 3


def test_columns_by_number_and_units_by_key(tmp_path):
    """The layout of a material test with its header in comments, strain twice, and peaks commented out."""
    rows = table((F, 100 * F, 100 * Q, 100 * Q, T)).replace(",", "\t")
    first, rest = rows.split("\n", 1)
    content = (
        "#\n#  Querschnitt: 170.4\n# [N/mm**2] [N] [%-ext] [%-trav] [s]\n"
        + first
        + "\n   #  1 2 3 4 5\n"
        + rest
    )
    keys = {"columns": {"force": 1, "displacement": 3, "time": 5}}
    recording = read_recording(source(tmp_path, content, "uniaxial", **keys))
    assert_read(recording)
    clear = content.replace("[%-trav]", "[mm]")
    assert_read(read_recording(source(tmp_path, clear, "uniaxial")))
    # Both strain columns have the same numbers: they count as one.
    assert_read(read_recording(source(tmp_path, content, "uniaxial")))
    different = "# [N/mm**2] [N] [%-ext] [%-trav] [s]\n" + table((F, 100 * F, 100 * Q, 101 * Q, T)).replace(
        ",", "\t"
    )
    with pytest.raises(RecordingError, match="column 3 and column 4 could each be the displacement"):
        read_recording(source(tmp_path, different, "uniaxial"))
    headless = source(tmp_path, rows, "uniaxial", units={"displacement": "percent"}, **keys)
    assert_read(read_recording(headless))


def test_columns_by_name(tmp_path):
    content = "Zeit;Weg A [mm];Weg B [mm];Kraft [N]\n" + table((T, 0 * Q, Q, F), sep=";")
    assert_read(read_recording(source(tmp_path, content, columns={"displacement": "weg b"})))
    assert_read(read_recording(source(tmp_path, content, columns={"displacement": "Weg B [mm]"})))
    with pytest.raises(
        RecordingError, match=r"column 2 \(Weg A \[mm\]\) and column 3 .*columns = \{displacement"
    ):
        read_recording(source(tmp_path, content))
    with pytest.raises(RecordingError, match=r'no column "Weg C".*did you mean "Weg'):
        read_recording(source(tmp_path, content, columns={"displacement": "Weg C"}))
    with pytest.raises(RecordingError, match=r"no column 9 \(the table has 4 columns\)"):
        read_recording(source(tmp_path, content, columns={"displacement": 9}))


def test_a_unit_of_the_case_overrides_the_file(tmp_path):
    recording = read_recording(source(tmp_path, HEAD + table(), units={"displacement": "in", "force": "lbf"}))
    np.testing.assert_allclose(recording.displacement, 25.4 * Q)
    # 1 lbf = 0.45359237 kg * 9.80665 m/s2, exact by definition.
    np.testing.assert_allclose(recording.force, 0.45359237 * 9.80665 * F)


def bad(row: int, old: str, new: str) -> str:
    lines = (HEAD + table()).split("\n")
    assert old in lines[row]
    lines[row] = lines[row].replace(old, new)
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (bad(3, "1.0000", "abc"), r'rig.csv:4: column 2 \(displacement_mm\): "abc" is not a number'),
        (bad(1, "0.0000,0.0000", "0.0000,abc"), r'rig.csv:2: column 2 .*"abc" is not a number'),
        (bad(3, "1.0000", ""), r"rig.csv:4: column 2 .* is empty"),
        (bad(3, "1.0000", "nan"), r"rig.csv:4: column 2 .* nan is not a finite number"),
        (bad(2, "101.5000", "1.#QNAN"), r"rig.csv:3: column 3 .* is not a finite number"),
        (bad(3, "199.0000", "-inf"), r"rig.csv:4: column 3 .* -inf is not a finite number"),
        (bad(3, "199.0000", "1e999"), r"rig.csv:4: column 3 .* 1e999 is not a finite number"),
        (bad(3, "199.0000", "1e300"), r"rig.csv:4: column 3 .* 1e300 is not a measured value"),
        (bad(3, "199.0000", "1.199,00"), r"rig.csv:4: 4 fields, where the rows before have 3"),
        (bad(4, ",-290.2500", ""), r"rig.csv:5: 2 fields, where the rows before have 3"),
        (bad(6, ",250.0000", ""), r"rig.csv:7: 2 fields.*last line: was the recording cut off"),
        (bad(4, "0.3000,1.5000,-290.2500", "End of test"), r"rig.csv:5: 1 field,"),
        (
            bad(3, "0.2000", "0.1000"),
            r"rig.csv:4: column 1 \(time_s\): the time does not increase, 0.1000 follows",
        ),
        (HEAD + table((T[:4], Q[:4], F[:4])), r"has only 4 points \(at least 5\)"),
        (
            HEAD + table((T, 0 * Q + 3, F)),
            r"column 2 \(displacement_mm\) is 3.0000 throughout: nothing moves",
        ),
        (HEAD + table((T, Q, 0 * F)), r"column 3 \(force_N\) is 0.0000 throughout"),
        (b"", "is empty"),
        (b" \n\n", "is empty"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0", "is not a text file"),
        ("just words\nand more words\n", "has no table with two columns of numbers"),
        (HEAD, "ends with the names of columns: no row of numbers follows"),
        (HEAD + table(decimal=","), "decimal sign, too.*with decimal points, or with semicolons"),
        (HEAD + 2 * "0,nan,0\n" + table((T + 1, Q, F)), r"rig.csv:2: .*nan is not.*likewise in 1 more row"),
        ("time_s,rotation_deg,moment_Nmm\n" + table(), "no column displacement_mm.*torsional or conical"),
        ("stretch,nominal_stress_MPa\n" + table((1 + Q, F)), "no column displacement_mm.*is this.*uniaxial"),
        (
            table(),
            r"the table has no header \(or choose a column by name or number: columns = \{displacement",
        ),
        ("time_s,displacement_deg,force_N\n" + table(), "is in deg, but mode axial needs a length"),
        (HEAD + "0.0,x,0.0\n" + table((T + 1, Q, F)), r'rig.csv:2: column 2 .*"x" is not a number'),
        (
            "Weg;Kraft\n0,0;x\n" + table((Q, F), sep=";", decimal=","),
            r'rig.csv:2: "0,0;x" is neither a header nor',
        ),
        ("time,Kraft Soll [N],displacement_mm\n" + table((T, F, Q)), "no column force_N"),
    ],
)
def test_refuses_with_place_and_reason(tmp_path, content, message):
    with pytest.raises(RecordingError, match=message):
        read_recording(source(tmp_path, content))


@pytest.mark.parametrize("force", [100.0 + 50.0 * 0.8 ** np.arange(6), -100.0 - 50.0 * 0.8 ** np.arange(6)])
def test_a_hold_from_its_full_displacement_on_is_read(tmp_path, force):
    recording = read_recording(source(tmp_path, HEAD + table((T, 0 * Q + 3, force))))
    assert [branch.kind for branch in recording.branches] == ["hold"]
    with pytest.raises(RecordingError, match=r"nothing moves .*and the file has the times"):
        read_recording(source(tmp_path, "displacement_mm,force_N\n" + table((0 * Q + 3, force))))


def test_refuses_files_that_are_none(tmp_path):
    with pytest.raises(RecordingError, match="no such file"):
        read_recording(Source("axial", tmp_path / "absent.csv"))
    with pytest.raises(RecordingError, match="is a directory"):
        read_recording(Source("axial", tmp_path))
    with pytest.raises(RecordingError, match="cannot be read"):
        read_recording(Source("axial", Path("a\0b")))


def test_refuses_what_the_mode_does_not_have(tmp_path):
    good = source(tmp_path, HEAD + table())
    with pytest.raises(RecordingError, match='"axail" is not a mode'):
        read_recording(Source("axail", good.file))
    with pytest.raises(RecordingError, match=r"no column rotation_deg.*axial or radial"):
        read_recording(Source("torsional", good.file))
    with pytest.raises(RecordingError, match=r"is in mm, but mode torsional needs a rotation"):
        read_recording(Source("torsional", good.file, columns={"displacement": 2, "force": 3}))
    with pytest.raises(RecordingError, match=r'a stretch of 0.0000 is impossible.*"percent"'):
        read_recording(source(tmp_path, "stretch,nominal_stress_MPa\n" + table((Q, F)), "uniaxial"))


def test_forced_delimiter_and_decimal_sign_are_obeyed(tmp_path):
    content = "a;b\n" + table((Q, F), sep=";", decimal=",")
    keys = {"columns": {"displacement": 1, "force": 2}}
    recording = read_recording(source(tmp_path, content, delimiter=";", decimal=",", **keys))
    np.testing.assert_allclose(recording.force, F)
    with pytest.raises(RecordingError, match="for this delimiter and decimal sign"):
        read_recording(source(tmp_path, content, delimiter=";", decimal=".", **keys))


@pytest.mark.parametrize("seed", range(40))
def test_damaged_files_are_read_or_refused_but_never_crash(tmp_path, seed):
    """Bytes changed, lines dropped, doubled or cut: no other exception than RecordingError may be raised."""
    rng = np.random.default_rng(seed)
    refused = []
    original = (RIG + GERMAN + table(sep=";", decimal=",")).encode()
    for _ in range(25):
        content = bytearray(original)
        for _ in range(rng.integers(1, 6)):
            place = int(rng.integers(len(content)))
            kind = rng.integers(4)
            if kind == 0:
                content[place] = int(rng.integers(256))
            elif kind == 1:
                del content[place : place + int(rng.integers(1, 30))]
            elif kind == 2:
                content[place:place] = content[place : place + int(rng.integers(1, 30))]
            else:
                content[place:place] = rng.choice(
                    [b";", b",", b'"', b"\n", b"#", b"\xff", b"\0", b"e9", b"-"]
                )
        try:
            recording = read_recording(source(tmp_path, bytes(content)))
        except RecordingError as error:
            refused.append(str(error))
        else:
            assert np.isfinite(recording.force).all()
            assert np.isfinite(recording.displacement).all()
    assert all("rig.csv" in message for message in refused)


def cyclic():
    """0, 2, 0, 4, 0, 3, 0, -3, 0 mm in steps of 0.1 mm, 1 mm/s."""
    corners = [0, 2, 0, 4, 0, 3, 0, -3, 0]
    q = [0.0]
    for a, b in pairwise(corners):
        q.extend(np.linspace(a, b, 10 * abs(b - a) + 1)[1:])
    return 0.1 * np.arange(len(q)), np.array(q)


def test_cycles_are_selected(tmp_path):
    t, q = cyclic()
    content = HEAD + table((t, q, 100 * q))
    whole = read_recording(source(tmp_path, content, cycles=(2,))).record
    assert len(whole.force) == len(q)
    part = read_recording(source(tmp_path, content, cycles=(2,)))
    assert part.displacement.max() == 4.0
    assert part.displacement.min() == 0.0
    assert part.name == "axial"
    mask = cycle_mask(whole, [1, 3])
    # The sample between two cycles ends the one and begins the other.
    assert mask.sum() == len(q) - len(part.force) + 1
    assert [b.cycle for b in whole.branches] == [1, 1, 2, 2, 3, 3, 3, 3]
    with pytest.raises(RecordingError, match=r"there is no cycle 4 \(the recording has 3"):
        select_cycles(whole, [4])
    with pytest.raises(RecordingError, match="cycles 2: the force is 0 throughout"):
        select_cycles(replace(whole, force=np.where(mask, whole.force, 0.0)), [2])


@pytest.mark.parametrize("mode", ["axial", "radial", "torsional", "conical", "uniaxial"])
@pytest.mark.parametrize("time", [T, None])
def test_what_is_written_is_read_back(tmp_path, mode, time):
    names = {"torsional": "rotation_deg,moment_Nmm", "conical": "rotation_deg,moment_Nmm"}
    names["uniaxial"] = "stretch,nominal_stress_MPa"
    q = 1 + Q if mode == "uniaxial" else Q
    columns, head = [q, F], names.get(mode, "displacement_mm,force_N")
    if time is not None:
        columns, head = [time, *columns], "time_s," + head
    first = read_recording(source(tmp_path, head + "\n" + table(columns), mode))
    write_curve_csv(tmp_path / "out.csv", first)
    assert (tmp_path / "out.csv").read_text().startswith(head + "\n")
    second = read_recording(Source(mode, tmp_path / "out.csv"))
    np.testing.assert_allclose(second.displacement, first.displacement, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(second.force, first.force, rtol=1e-11)
    assert (second.time is None) == (time is None)


def test_degrees_are_written_round(tmp_path):
    content = "rotation_deg,moment_Nmm\n" + table((15 * Q, F))
    write_curve_csv(tmp_path / "out.csv", read_recording(source(tmp_path, content, "torsional")))
    assert "\n30,400\n" in (tmp_path / "out.csv").read_text()


def test_a_program_needs_no_force(tmp_path):
    read = read_program(source(tmp_path, "time_s,rotation_deg\n0,0\n1,30\n3,30\n4,-30\n", "conical"))
    np.testing.assert_allclose(read.time, [0, 1, 3, 4])
    np.testing.assert_allclose(read.displacement, [0, math.pi / 6, math.pi / 6, -math.pi / 6])
    with pytest.raises(RecordingError, match="has only 1 point"):
        read_program(source(tmp_path, "time_s,rotation_deg\n0,30\n", "conical"))
