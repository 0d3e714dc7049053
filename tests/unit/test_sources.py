"""Recordings of a case: patterns of files, modes from their names, machine units, tolerance; `bushcli init --from`."""

from __future__ import annotations

import json
import os
import resource
import signal
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from bushcli.case import case_json, load_case
from bushcli.case.example import write_case
from bushcli.case.from_files import case_from_files
from bushcli.case.rebuild import rebuilt_case
from bushcli.cli import main
from bushcli.errors import CaseError, InputError, RecordingError
from bushcli.recording import read_program, read_recording
from bushcli.recording.guess import contradicting_modes, modes_of_name
from bushcli.recording.source import Source

CASE = """
[geometry]
shape = "plain"
inner_radius = 12.0
outer_radius = 22.0
length = 40.0
[material]
law = "yeoh"
"""
Q = np.concatenate([np.linspace(0, 4, 21), np.linspace(3.8, 0, 20)])


def rig(path: Path, head: str = "time_s,displacement_mm,force_N", scale: float = 100.0) -> Path:
    rows = "\n".join(f"{0.1 * i:.1f},{q:.4f},{scale * q:.4f}" for i, q in enumerate(Q))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"{head}\n{rows}\n", encoding="utf-8")
    return path


def case(folder: Path, text: str) -> Path:
    path = folder / "case.toml"
    path.write_text(CASE + text, encoding="utf-8")
    return path


def run(*words: object) -> Result:
    return CliRunner().invoke(main, [str(word) for word in words])


@pytest.mark.parametrize(
    ("name", "specimen", "mode"),
    [
        ("run_03_axial", "bushing", "axial"),
        ("B12-AX-23C", "bushing", "axial"),
        ("Radialsteifigkeit_quer", "bushing", "radial"),
        ("torsion2", "bushing", "torsional"),
        ("Kardanisch", "bushing", "conical"),
        ("Zug_S2", "coupon", "uniaxial"),
        ("pure_shear_1", "coupon", "planar"),
        ("Biax", "coupon", "equibiaxial"),
        ("quad_shear", "coupon", "simple_shear"),
        ("SimpleShear_02", "coupon", "simple_shear"),
        ("double-shear", "coupon", None),
        ("lap_shear", "coupon", "simple_shear"),
        ("Schubversuch", "coupon", None),
        ("axial_radial", "bushing", None),
        ("run_03", "bushing", None),
        ("faxes", "bushing", None),
        ("axial", "coupon", None),
    ],
)
def test_modes_of_names(name, specimen, mode):
    names = modes_of_name(name, specimen)
    assert names == (mode,) if mode else len(names) != 1


def test_a_name_that_two_modes_share_is_asked(tmp_path):
    assert modes_of_name("shear_1", "coupon") == ("planar", "simple_shear")
    rig(tmp_path / "shear_1.csv", "time_s,strain,stress_MPa", 0.1)
    with pytest.raises(CaseError, match="may mean planar or simple_shear"):
        load_case(case(tmp_path, '[[coupons]]\nfile = "shear_1.csv"\n'))


@pytest.mark.parametrize(
    ("name", "mode", "says"),
    [
        ("radial_01", "axial", ("radial",)),
        ("torsion", "conical", ("torsional",)),
        ("quad_lap", "planar", ("simple_shear",)),
        ("uniaxial", "volumetric", ("uniaxial",)),
        ("radial_01", "radial", ()),
        ("axial_radial", "axial", ()),
        ("twist_rad", "torsional", ()),
        ("bulk_compression", "volumetric", ()),
        ("compression", "volumetric", ()),
        ("planar_tension", "planar", ()),
        ("shear", "planar", ()),
    ],
)
def test_a_name_that_speaks_of_another_mode(name, mode, says):
    assert contradicting_modes(name, mode) == says


def test_a_file_whose_name_says_another_mode_is_asked_about(tmp_path):
    rig(tmp_path / "radial_01.csv")
    text = '[[recordings]]\nmode = "axial"\nfile = "radial_01.csv"\n'
    with pytest.raises(CaseError, match=r'says radial \(mode = "radial"; or name = "axial"'):
        load_case(case(tmp_path, text))
    assert load_case(case(tmp_path, text.replace('mode = "axial"', 'mode = "radial"'))).recordings
    assert load_case(case(tmp_path, text + 'name = "axial"\n')).recordings[0].mode == "axial"


def test_a_file_named_compression_becomes_a_compressed_coupon(tmp_path):
    rig(tmp_path / "compression.csv", "time_s,travel_mm,force_N")
    text = case_from_files([tmp_path / "compression.csv"], tmp_path)
    assert 'mode = "uniaxial"' in text
    assert 'reverse = ["displacement", "force"]' in text
    assert "<-- reverse" in text


def test_a_file_named_axial_with_too_few_points_is_no_coupon(tmp_path):
    (tmp_path / "axial.csv").write_text("displacement_mm,force_N\n0,0\n1,300\n2,600\n")
    with pytest.raises(CaseError, match=r"has only 3 points \(at least 5\)"):
        case_from_files([tmp_path / "axial.csv"], tmp_path)


@pytest.mark.parametrize(
    ("name", "mode", "others"),
    [
        ("quad_shear", "simple_shear", "planar"),
        ("radial_01", "radial", "axial"),
        ("shear", "planar", "simple_shear"),
    ],
)
def test_a_mode_guessed_from_a_name_is_marked_with_its_alternatives(tmp_path, name, mode, others):
    rig(tmp_path / f"{name}.csv", *(["time_s,strain,stress_MPa", 0.1] if "shear" in name else []))
    text = case_from_files([tmp_path / f"{name}.csv"], tmp_path)
    assert f'mode = "{mode}"' in text
    (line,) = [line for line in text.splitlines() if "<-- mode" in line]
    assert "guessed from the name" in line
    assert others in line


def test_a_pattern_stands_for_its_files_in_natural_order(tmp_path):
    for i in (1, 2, 10):
        rig(tmp_path / "runs" / f"axial_{i}.csv")
    rig(tmp_path / "runs" / "radial_1.csv")
    found = load_case(case(tmp_path, '[[recordings]]\nfile = "runs/*.csv"\n'))
    assert [(s.name, s.mode) for s in found.recordings] == [
        ("axial_1", "axial"), ("axial_2", "axial"), ("axial_10", "axial"), ("radial_1", "radial"),
    ]  # fmt: skip
    assert all(len(read_recording(source).force) == len(Q) for source in found.recordings)


def test_a_file_whose_name_is_a_pattern_is_taken_as_it_is(tmp_path):
    rig(tmp_path / "axial[1].csv")
    found = load_case(case(tmp_path, '[[recordings]]\nfile = "axial[1].csv"\n'))
    assert [s.name for s in found.recordings] == ["axial"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('file = "none_*.csv"\nmode = "axial"', "matches no file"),
        ('file = "**/*.csv"', r"is not a supported pattern"),
        ('file = "/etc/*.conf"', r"is not a supported pattern"),
        ('file = "run_*.csv"', r'mode is missing, and the name "run_1.csv" does not contain a mode \(axial'),
        ('file = "run_1.csv"', r'mode is missing, and the name "run_1.csv" does not contain a mode'),
        ('file = "run_*.csv"\nmode = "axial"\nname = "a"', "matches 2 files"),
        (
            'file = "run_1.csv"\nmode = "axial"\ngauge_length = 20.0',
            "gauge_length belongs to a material test",
        ),
        ('file = "run_1.csv"\nmode = "axial"\nrate = 1.0\nsample_rate = 2.0', "rate and sample_rate both"),
        ('file = "run_1.csv"\nmode = "axial"\ngroup = 0', "group = 0"),
        ('file = "run_1.csv"\nmode = "axial"\nsample_rate = -1.0', "sample_rate = -1.0 must be greater"),
        ('file = "run_1.csv"\nmode = "axial"\nstandard = "ISO 7734"', 'did you mean "ISO 7743"'),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, text, message):
    rig(tmp_path / "run_1.csv")
    rig(tmp_path / "run_2.csv")
    with pytest.raises(CaseError, match=message):
        load_case(case(tmp_path, f"[[recordings]]\n{text}\n"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("width = 4.0", "thickness is missing"),
        ("thickness = 4.0", "width is missing"),
        ("area = 8.0\ndiameter = 3.0", "area and diameter"),
        ("area = 8.0\nwidth = 2.0\nthickness = 4.0", "area and width and thickness"),
        ("area = -8.0", "must be greater than 0"),
        ('stress = "cauchy"', "is not allowed"),
    ],
)
def test_a_cross_section_is_given_once(tmp_path, text, message):
    rig(tmp_path / "zug.csv")
    with pytest.raises(CaseError, match=message):
        load_case(case(tmp_path, f'[[coupons]]\nfile = "zug.csv"\ngauge_length = 20.0\n{text}\n'))


@pytest.mark.parametrize(
    "text", ["area = 8.0", "width = 4.0\nthickness = 2.0", "diameter = 3.1915382432114616"]
)
def test_machine_units_of_a_case(tmp_path, text):
    rig(tmp_path / "zug.csv")
    found = load_case(case(tmp_path, f'[[coupons]]\nfile = "zug.csv"\ngauge_length = 20.0\n{text}\n'))
    recording = read_recording(found.coupons[0])
    assert found.coupons[0].mode == "uniaxial"
    np.testing.assert_allclose(recording.displacement, Q / 20.0, atol=1e-6)
    np.testing.assert_allclose(recording.force, 100.0 * Q / 8.0, atol=1e-4)
    shown = case_json(found)["coupons"][0]
    assert shown["gauge_length"] == 20.0
    assert shown["area"] == pytest.approx(8.0)


# -- programs of load cases -------------------------------------------------------------------------------------------


def program(tmp_path, text):
    rows = "".join(f"{q:.4f};{2 * q:.4f}\n".replace(".", ",") for q in Q)
    (tmp_path / "path.csv").write_text(f"Weg A;Weg B\n{rows}")
    return case(
        tmp_path, f'[[load_cases]]\nmode = "axial"\n{text}\n[material.parameters]\nC10=0.5\nC20=0.0\nC30=0.0'
    )


def test_the_file_of_a_program_is_read_as_that_of_a_recording(tmp_path):
    keys = 'columns = {displacement = "Weg B"}\nunits = {displacement = "cm"}\nreverse = ["displacement"]'
    path = program(tmp_path, f'file = "path.csv"\n{keys}\nsample_rate = 10.0')
    used = load_case(path)
    source = used.load_cases[0].source
    read = read_program(source)
    np.testing.assert_allclose(read.displacement, -20.0 * Q, atol=1e-2)
    np.testing.assert_allclose(read.time, 0.1 * np.arange(len(Q)), atol=1e-12)
    assert rebuilt_case(case_json(used), tmp_path).load_cases[0].source == source


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("amplitude = 3.0\ngroup = 2", r"load_cases\[0\]\.group has no meaning without a file"),
        (
            'file = "path.csv"\nunits = {displacement = "kN"}',
            '"kN" is not a unit of displacement for mode axial',
        ),
    ],
)
def test_keys_that_say_nothing_of_a_program_are_refused(tmp_path, text, message):
    with pytest.raises(CaseError, match=message):
        load_case(program(tmp_path, text))


# -- tolerance ---------------------------------------------------------------------------------------------------------


def test_the_tolerance_is_ten_percent_where_none_is_given(tmp_path):
    assert (
        load_case(
            case(
                tmp_path,
                '[[load_cases]]\nmode = "axial"\namplitude = 1.0\n[material.parameters]\nC10=0.5\nC20=0.0\nC30=0.0',
            )
        ).tolerance.percent
        == 10.0
    )


@pytest.mark.parametrize(
    ("value", "text"), [("15.0", "15 %"), ("12", "12 %"), ('{class = "D2", percent = 15.0}', "D2 (15 %)")]
)
def test_a_tolerance_is_read(tmp_path, value, text):
    rig(tmp_path / "axial.csv")
    path = case(tmp_path, '[[recordings]]\nfile = "axial.csv"\n')
    assert load_case(path, [f"tolerance={value}"]).tolerance.text == text
    shown = run("check", path, "--set", f"tolerance={value}", "--set", 'geometry.length="40 +- 1 %"')
    assert f"accepted simulations within {text} of" in " ".join(shown.output.split()), shown.output
    assert "tolerances geometry.length 40 ± 0.4" in " ".join(shown.output.split())


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ('"D2"', r'depends on hardness and wall thickness .*tolerance = \{class = "D2", percent = 15\}'),
        ('"E2"', "is not a number"),
        ("0", "must be greater than 0"),
        ("500", "must be at most 100"),
        ('{class = "D2"}', "percent is missing"),
        ('{class = "D7", percent = 3}', r'did you mean "D[123]"'),
    ],
)
def test_a_tolerance_that_says_nothing_is_refused(tmp_path, value, message):
    rig(tmp_path / "axial.csv")
    path = case(tmp_path, '[[recordings]]\nfile = "axial.csv"\n')
    with pytest.raises(CaseError, match=message):
        load_case(path, [f"tolerance={value}"])


# -- init --from -------------------------------------------------------------------------------------------------------


def test_a_case_from_files_is_accepted_by_check(tmp_path):
    rig(tmp_path / "lab" / "run1_axial.csv", "Prüfzeit [s],Standardweg [mm],Standardkraft [N]")
    rig(tmp_path / "lab" / "run2.csv", scale=400.0)
    rig(tmp_path / "lab" / "torsion.csv", "t_s,Winkel [deg],Moment [Nmm]", scale=2000.0)
    rig(tmp_path / "lab" / "Zug_S2.csv", "Zeit [s],Traversenweg [mm],Kraft [N]", scale=2.0)
    rig(tmp_path / "lab" / "biax.csv", "time_s,strain,stress [MPa]", scale=0.4)
    files = sorted((tmp_path / "lab").iterdir())
    done = run("init", "--from", *files, tmp_path / "new")
    assert done.exit_code == 0, done.output
    text = (tmp_path / "new" / "case.toml").read_text(encoding="utf-8")
    assert "<-- mode: the file name does not state it; the columns suit axial, radial" in text
    assert "<-- gauge_length (mm), area (mm2): put in" in text
    checked = run("check", tmp_path / "new" / "case.toml", "--json", "-q")
    assert checked.exit_code == 0, checked.output
    found = json.loads(checked.output)
    assert {entry["name"]: entry["mode"] for entry in found["recordings"]} == {
        "run1_axial": "axial", "run2": "axial", "torsional": "torsional",
    }  # fmt: skip
    assert [entry["mode"] for entry in found["coupons"]] == ["uniaxial", "equibiaxial"]


def test_columns_that_could_both_be_meant_are_chosen_and_said(tmp_path):
    rows = "\n".join(f"{q:.3f},{100 * q:.3f},{110 * q:.3f}" for q in Q)
    (tmp_path / "axial.csv").write_text(f"Weg [mm],Kraft A [N],Kraft B [N]\n{rows}\n")
    done = run("init", "--from", tmp_path / "axial.csv", tmp_path)
    assert done.exit_code == 0, done.output
    text = (tmp_path / "case.toml").read_text(encoding="utf-8")
    assert "columns = { force = 2 }" in text
    assert '<-- columns: the force could be any of 2 ("Kraft A [N]"), 3 ("Kraft B [N]")' in text
    assert run("check", tmp_path / "case.toml", "-q").exit_code == 0


def test_stress_and_strain_are_of_a_coupon_whatever_else_is_in_the_file(tmp_path):
    rows = "\n".join(
        f"{0.4 * q:.4f}\t{60 * q:.3f}\t{25 * q:.4f}\t{25 * q:.4f}\t{i}\t{200 + q:.4f}"
        for i, q in enumerate(Q)
    )
    head = "#  Querschnitt: 150\n# [N/mm**2]\t[N]\t[%-ext]\t[%-trav]\t[s]\t[mm]"
    (tmp_path / "viscoel1.dat").write_text(f"{head}\n{rows}\n")
    assert run("init", "--from", tmp_path / "viscoel1.dat", tmp_path).exit_code == 0
    [source] = load_case(tmp_path / "case.toml").coupons
    recording = read_recording(source)
    np.testing.assert_allclose(recording.displacement, 0.25 * Q, atol=1e-4)
    np.testing.assert_allclose(recording.force, 0.4 * Q, atol=1e-4)
    assert "are identical; one of them is used" in (tmp_path / "case.toml").read_text()


@pytest.mark.parametrize("columns", [2, 3])
def test_columns_without_a_header_are_taken_in_their_usual_order_and_said(tmp_path, columns):
    rows = "\n".join(
        ",".join([f"{0.1 * i:.1f}", f"{q:.3f}", f"{100 * q:.3f}"][3 - columns :]) for i, q in enumerate(Q)
    )
    (tmp_path / "axial.csv").write_text(rows + "\n")
    assert run("init", "--from", tmp_path / "axial.csv", tmp_path).exit_code == 0
    assert "# <-- columns, units: the file has no header" in (tmp_path / "case.toml").read_text()
    [source] = load_case(tmp_path / "case.toml").recordings
    recording = read_recording(source)
    np.testing.assert_allclose(recording.displacement, Q, atol=1e-3)
    np.testing.assert_allclose(recording.force, 100 * Q, atol=0.1)
    assert (recording.time is None) == (columns == 2)


def test_what_cannot_be_read_is_said_for_each_file(tmp_path):
    (tmp_path / "notes.txt").write_text("nothing to see\n")
    done = run("init", "--from", tmp_path / "notes.txt", tmp_path / "absent.csv", tmp_path / "new")
    assert done.exit_code == 2
    assert "notes.txt: has no table" in done.output
    assert "absent.csv: no such file" in done.output
    assert not (tmp_path / "new").exists()


def test_a_case_that_is_there_is_not_replaced(tmp_path):
    rig(tmp_path / "axial.csv")
    case(tmp_path, "# mine\n")
    done = run("init", "--from", tmp_path / "axial.csv", tmp_path)
    assert done.exit_code == 2
    assert "exists already" in done.output
    assert "# mine" in (tmp_path / "case.toml").read_text()


def test_a_name_that_would_break_the_file_is_written_in_quotes(tmp_path):
    rig(tmp_path / 'a"b = 1\\axial.csv')
    folder = tmp_path / 'new "case"'
    done = run("init", "--from", tmp_path / 'a"b = 1\\axial.csv', folder)
    assert done.exit_code == 0, done.output
    assert run("check", folder / "case.toml", "-q").exit_code == 0


@pytest.mark.parametrize("name", [b"axial\x1b[31m.csv", "axial\u202e.csv".encode(), b"\x7f/axial.csv"])
def test_a_file_that_a_case_cannot_name_is_refused(tmp_path, name):
    file = rig(tmp_path / os.fsdecode(name))
    done = run("init", "--from", file, tmp_path / "new")
    assert done.exit_code == 2, done.output
    assert "has a control character, or bytes that are not UTF-8, in its path" in done.output
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("name", [b"new\x1b[31m", b"new\x7f"])
def test_a_folder_with_any_name_gets_a_case_that_check_accepts(tmp_path, name):
    file, folder = rig(tmp_path / "axial.csv"), tmp_path / os.fsdecode(name)
    assert run("init", "--from", file, folder).exit_code == 0
    assert run("check", folder / "case.toml", "-q").exit_code == 0


def test_columns_with_control_characters_are_written_out_in_remarks(tmp_path):
    rows = "\n".join(f"{q:.3f},{100 * q:.3f},{110 * q:.3f}" for q in Q)
    (tmp_path / "axial.csv").write_text(f"Weg [mm],Kraft \x7f [N],Kraft \u202e [N]\n{rows}\n")
    assert run("init", "--from", tmp_path / "axial.csv", tmp_path).exit_code == 0
    assert not {"\x7f", "\u202e"} & set((tmp_path / "case.toml").read_text())
    assert run("check", tmp_path / "case.toml", "-q").exit_code == 0


def test_a_case_that_cannot_be_written_leaves_no_file(tmp_path):
    """On a full disk it would be empty, and the next run would not replace it; here a file may have 100 bytes."""
    before, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.getsignal(signal.SIGXFSZ)
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))
    try:
        with pytest.raises(InputError, match="cannot be written: File too large"):
            write_case(tmp_path, "x" * 1000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    assert not list(tmp_path.iterdir())


def test_init_without_files_takes_one_folder(tmp_path):
    assert run("init", tmp_path / "a").exit_code == 0
    refused = run("init", tmp_path / "b", tmp_path / "c")
    assert refused.exit_code == 2
    assert "unexpected extra argument" in refused.output


def test_a_file_in_place_of_a_folder_is_told_how_to_become_a_case(tmp_path):
    (tmp_path / "axial.csv").write_text("time_s,displacement_mm,force_N\n0,0,0\n1,1,10\n")
    done = run("init", tmp_path / "axial.csv")
    assert done.exit_code == 2
    assert (
        f"axial.csv is a file; to write a case for files of a rig: bushcli init --from {tmp_path}"
        in done.output
    )


def test_of_several_forces_the_first_that_is_no_constant_is_chosen_and_marked(tmp_path):
    rows = "".join(f"{i},{0.1 * i:.1f},0.5,{10 * i}\n" for i in range(20))
    (tmp_path / "axial.csv").write_text("Time [s],Travel [mm],Fx [N],Fz [N]\n" + rows)
    assert run("init", "--from", tmp_path / "axial.csv", tmp_path / "new").exit_code == 0
    text = (tmp_path / "new" / "case.toml").read_text()
    assert "columns = { force = 4 }" in text
    assert '<-- columns: the force could be any of 3 ("Fx [N]"), 4 ("Fz [N]")' in text


def test_init_says_what_is_wrong_in_the_mode_whose_columns_the_file_has(tmp_path):
    rows = "".join(f"{i},{0.1 * i:.1f},{i}\n" for i in range(9))
    (tmp_path / "rig.csv").write_text("ms,in,0.1 N\nTime,Displacement,Force\n" + rows)
    done = run("init", "--from", tmp_path / "rig.csv", tmp_path / "new")
    assert done.exit_code == 2
    assert '"0.1 N" may be' in done.output
    assert "there is none yet: `bushcli init DIR`" in done.output
    assert "stretch" not in done.output


TABLE = """\
frequency [Hz];amplitude [mm];|K*| [N/mm];loss angle [deg]
1;0.1;350;2.5
5;0.1;390;5.1
20;0.1;420;4.8
80;0.1;470;5.5
"""


def test_a_table_of_dynamic_stiffness_becomes_a_recording_of_its_kind(tmp_path):
    """What the file does not say, here the kind of its amplitude, is answered with a mark."""
    (tmp_path / "radial.csv").write_text(TABLE)
    (tmp_path / "dma.csv").write_text("Frequency (Hz),E' (MPa),E'' (MPa)\n1,6,0.6\n3,6.5,0.8\n10,7,1\n")
    rig(tmp_path / "run_radial.csv")
    files = [tmp_path / name for name in ("radial.csv", "dma.csv", "run_radial.csv")]
    done = run("init", "--from", *files, tmp_path / "new")
    assert done.exit_code == 0, done.output
    text = (tmp_path / "new" / "case.toml").read_text()
    assert 'kind = "dynamic"\nname = "radial"\nfile = "../radial.csv"\namplitude_is = "peak"' in text
    assert "# <-- amplitude_is: column 2 (amplitude [mm]) may be the peak" in text
    checked = run("check", tmp_path / "new" / "case.toml", "--json", "-q")
    assert checked.exit_code == 0, checked.output
    tables = json.loads(checked.output)["dynamic"]
    assert {(table["name"], table["mode"]) for table in tables} == {
        ("radial", "radial"),
        ("uniaxial", "uniaxial"),
    }


def test_a_table_of_dynamic_stiffness_without_its_kind_is_refused_with_the_key(tmp_path):
    (tmp_path / "radial.csv").write_text(TABLE)
    with pytest.raises(RecordingError, match='kind = "dynamic" in the case file'):
        read_recording(Source("radial", tmp_path / "radial.csv"))
