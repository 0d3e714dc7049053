"""A stated unit is converted, or refused with its place; it is never silently taken for N, mm or s."""

import math
import re
import subprocess
import sys

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.header.units import find_unit
from bushcli.recording.source import Source

Q = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 1.25])
F = np.array([0.0, 101.5, 199.0, -290.25, 400.0, 250.0])
T = np.arange(6) * 0.1

# By definition: international foot and pound (1959), standard gravity 9.80665 m/s2, gon = 1/400 of a turn.
INCH, POUND, GRAVITY = 25.4, 0.45359237 * 9.80665, 9.80665
CONVERTED = {
    "force": {
        "N": 1, "newtons": 1, "kN": 1e3, "KN": 1e3, "kilonewtons": 1e3, "daN": 10, "mN": 1e-3, "MN": 1e6, "cN": 1e-2,
        "lbf": POUND, "lbs": POUND, "lb": POUND, "pounds": POUND, "kip": 1e3 * POUND, "kips": 1e3 * POUND,
        "klbf": 1e3 * POUND, "klb": 1e3 * POUND, "kgf": GRAVITY, "KGF": GRAVITY, "kp": GRAVITY, "gf": GRAVITY / 1e3,
        "ozf": POUND / 16, "oz": POUND / 16, "dyn": 1e-5, "kilopond": GRAVITY,
    },
    "length": {
        "mm": 1, "MM": 1, "millimetres": 1, "cm": 10, "m": 1e3, "um": 1e-3, "µm": 1e-3, "microns": 1e-3, "nm": 1e-6,
        "in": INCH, "in.": INCH, "inch": INCH, "inches": INCH, '"': INCH, "ft": 12 * INCH, "feet": 12 * INCH,
        "mil": INCH / 1e3, "mils": INCH / 1e3, "thou": INCH / 1e3, "yd": 36 * INCH,
    },
    "time": {
        "s": 1, "sec": 1, "seconds": 1, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "usec": 1e-6, "ns": 1e-9, "min": 60,
        "minutes": 60, "h": 3600, "hr": 3600, "hours": 3600, "days": 86400, "SEC": 1,
    },
    "angle": {
        "deg": math.pi / 180, "degrees": math.pi / 180, "°": math.pi / 180, "rad": 1, "radians": 1, "mrad": 1e-3,
        "gon": math.pi / 200, "rev": 2 * math.pi, "turns": 2 * math.pi, "arcmin": math.pi / 10800,
    },
    "moment": {
        "Nmm": 1, "N·mm": 1, "Nm": 1e3, "N-m": 1e3, "nm": 1e3, "kN·m": 1e6, "kNm": 1e6, "daNm": 1e4,
        "ft-lb": 12 * INCH * POUND, "ft-lbs": 12 * INCH * POUND, "lbf·ft": 12 * INCH * POUND, "in-lb": INCH * POUND,
        "oz-in": INCH * POUND / 16, "kgf·cm": 10 * GRAVITY, "kgf-m": 1e3 * GRAVITY,
    },
    "stress": {
        "MPa": 1, "MPA": 1, "N/mm²": 1, "kPa": 1e-3, "GPa": 1e3, "bar": 0.1, "mbar": 1e-4, "ksi": 1e3 * POUND / INCH**2,
        "psi": POUND / INCH**2, "kgf/cm2": GRAVITY / 100, "kgf/mm^2": GRAVITY, "N/cm²": 0.01, "atm": 0.101325,
    },
    "strain": {"%": 0.01, "mm/mm": 1, "permille": 1e-3, "ppm": 1e-6},
}  # fmt: skip
#: Refused: unknown units, units of another quantity, and units with two meanings.
REFUSED = {
    "force": [
        "kg",
        "t",
        "ton",
        "tonf",
        "g",
        "N/s",
        "MPa",
        "lbz",
        "x10 N",
        "1000 N",
        "mm",
        "%",
        "-",
        "V",
        "N/mm",
        "Kn",
    ],
    "length": ["N", "smoots", "px", "-", "V", "mm/s", "1/10 mm", "Mm", "°"],
    "angle": ["grad", "mm", "ticks", "deg/s", "-"],
    "moment": ["J", "kg-cm", "N", "Nm/deg", "Nms", "kgm"],
    "stress": ["mPa", "N", "N/mm", "Shore", "Pa·s"],
    "time": ["frames", "samples", "m", "Hz", "-", "min:s", "1/s"],
}


def table(columns):
    return "".join(",".join(f"{v:.4f}" for v in row) + "\n" for row in zip(*columns, strict=True))


def read(tmp_path, content, mode="axial", **keys):
    file = tmp_path / "rig.csv"
    file.write_text(content)
    return read_recording(Source(mode, file, **keys))


@pytest.mark.parametrize(
    ("kind", "unit"), [(kind, unit) for kind, units in CONVERTED.items() for unit in units]
)
def test_a_known_unit_has_the_factor_of_its_definition(kind, unit):
    found = find_unit(unit, kind)
    assert found.measured == kind
    assert found.factor == pytest.approx(CONVERTED[kind][unit], rel=1e-9)


@pytest.mark.parametrize(
    ("kind", "unit"), [(kind, unit) for kind, units in REFUSED.items() for unit in units]
)
@pytest.mark.parametrize("written", ["{} [{}]", "{} ({})", "{} in {}", "{} / {}"])
def test_a_unit_of_something_else_is_refused_with_its_place(tmp_path, kind, unit, written):
    unit = unit.replace(" ", "") if " in " in written else unit
    mode = {"angle": "torsional", "moment": "torsional", "stress": "uniaxial"}.get(kind, "axial")
    names = {
        "axial": {"time": "Time [s]", "length": "Displacement [mm]", "force": "Force [N]"},
        "torsional": {"time": "Time [s]", "angle": "Rotation [deg]", "moment": "Moment [Nmm]"},
        "uniaxial": {"time": "Time [s]", "strain": "Strain [-]", "stress": "Stress [MPa]"},
    }[mode]
    names[kind] = written.format(names[kind].split()[0], unit)
    # A stress in N is a force: the specimen's area makes a stress of it.
    remedy = "give area" if (kind, unit) == ("stress", "N") else r"units = \{"
    with pytest.raises(RecordingError, match=rf"rig\.csv:1: column \d .*{remedy}"):
        read(tmp_path, ",".join(names.values()) + "\n" + table((T, Q, F)), mode)


HEADS = [
    "Time [s],Displacement [inches],Force [lbs]",
    "Time (s),Displacement (inches),Force (lbs)",
    "Time {s},Displacement {inches},Force {lbs}",
    "time_s,displacement_inches,force_lbs",
    "Time in s,Displacement in inches,Force in lbs",
    "Time / s,Displacement / inches,Force / lbs",
    "Time/s,Displacement/inches,Force/lbs",
    "Time s,Displacement inches,Force lbs",
    "Time-s,Displacement-inches,Force-lbs",
    'Time [s],Displacement ["],Force [lbs]',
    "Time (s),Displacement (inches) (filtered),Force [lbs] filtered",
    "time_s,displacement_inches_raw,force_lbf_ch1",
    "Time,Displacement,Force\ns,inches,lbs",
    "Time,Displacement,Force\n(s),(inches),(lbs)",
    "# Time,Displacement,Force\n# [s],[inches],[lbs]",
    "Time [s],Displacement [inches],Force\n,,lbs",
    'Time,Displacement,Force\ns,",lbs',
    'Time,Displacement,Force\n[s],["],[lbs]',
    '"Time","Displacement","Force"\n"(s)","(in)","(lbf)"',
    "TIME (SEC),DISPLACEMENT (IN),FORCE (LBF)",
    "Running Time (s),Ch 1 Displacement (in),Ch 1 Force (lbf)",
    "MTS793|MPT|1|0|A\n\nData Header:,Time:,3.0 Sec\nTime,Axial Displacement,Axial Force\nSec,in,lbf",
]


@pytest.mark.parametrize("head", HEADS)
def test_every_way_to_write_a_unit(tmp_path, head):
    recording = read(tmp_path, head + "\n" + table((T, Q, F)))
    np.testing.assert_allclose(recording.displacement, INCH * Q, atol=1e-12)
    np.testing.assert_allclose(recording.force, POUND * F, rtol=1e-12)
    assert recording.units == ("in", "lbf")


@pytest.mark.parametrize(
    "head",
    [
        "Time [s],Displacement [zoink],Force [N]",
        "Time (s),Displacement (zoink),Force (N)",
        "Time in s,Displacement in zoink,Force in N",
        "Time / s,Displacement / zoink,Force / N",
        "time_s,displacement_zk,force_N",
        "Time,Displacement,Force\n[s],[zoink],[N]",
        "Time,Displacement,Force\ns,zoink,N",
        "Time,Displacement,Force\njiffies,zoink,slugs",
        "Displacement [mm] [zoink],Time [s],Force [N]",
    ],
)
def test_a_unit_that_nobody_knows_is_refused(tmp_path, head):
    line = 1 + head.count("\n")
    columns = {"time": 1, "displacement": 2, "force": 3}
    for keys in ({}, {"columns": columns}) if head.startswith("Time") else ({},):
        with pytest.raises(
            RecordingError, match=rf"rig\.csv:{line}: column \d .*zo?i?n?k|jiffies|not a known unit"
        ):
            read(tmp_path, head + "\n" + table((T, Q, F)), **keys)
    given = {"time": "s", "displacement": "mm", "force": "N"}
    if "[mm]" not in head:
        np.testing.assert_allclose(
            read(tmp_path, head + "\n" + table((T, Q, F)), units=given).displacement, Q
        )


def test_a_row_of_units_that_does_not_fit_is_not_skipped(tmp_path):
    with pytest.raises(RecordingError, match=r'rig.csv:2: "s;mm" is neither a header nor'):
        read(tmp_path, "Time;Displacement;Force\ns;mm\n" + table((T, Q, F)).replace(",", ";"))


def test_two_units_that_contradict_each_other_are_refused(tmp_path):
    with pytest.raises(RecordingError, match=r"rig.csv:2: column 3 \(force_N\) is in N and in kN"):
        read(tmp_path, "time_s,displacement_mm,force_N\ns,mm,kN\n" + table((T, Q, F)))
    same = read(tmp_path, "time_s,displacement_mm,force_N\ns,mm,N\n" + table((T, Q, F)))
    np.testing.assert_allclose(same.force, F)


@pytest.mark.parametrize(
    ("head", "found"),
    [
        ("time_s,displacement_mm,Force rate [N/s],Force [N]", 4),
        ("time_s,displacement_mm,force rate,Force", 4),
        ("time_s,displacement_mm,Displacement error [mm],Force [N]", 4),
        ("time_s,load step,displacement_mm,load", 4),
        ("time_s,stroke count,stroke,load", 4),
        ("time_s,Load (Max) [N],stroke,Load [N]", 4),
        ("time_s,stroke [mm],load (Min),load (N)", 4),
        ("time_s,displacement demand [mm],displacement [mm],force [N]", 4),
        ("time_s,displacement [mm],measured displacement [mm],force [N]", 4),
        ("time_s,Sollweg [mm],Istweg [mm],Kraft [N]", 4),
        ("time_s,Weg Soll [mm],Weg Ist [mm],Kraft [N]", 4),
        ("time_s,Extension [%],Extension [mm],Load [N]", 4),
        ("time_s,Force [kg],displacement_mm,force [N]", 4),
    ],
)
def test_a_column_is_taken_by_its_quantity(tmp_path, head, found):
    """Three measured columns and one that only sounds like one, with values of its own."""
    names = head.split(",")
    wrong = next(i for i in (1, 2) if _is_wrong(names[i]))
    columns = [T, Q, F]
    columns.insert(wrong, 7.0 + 3.0 * T)
    assert len(columns) == found
    recording = read(tmp_path, head + "\n" + table(columns))
    np.testing.assert_allclose(recording.displacement, Q)
    np.testing.assert_allclose(recording.force, F)


def _is_wrong(name):
    other = r"rate|error|step|count|Max|Min|demand|Soll|%|kg|^displacement \[mm\]$"
    return re.search(other, name) is not None


@pytest.mark.parametrize(
    "head",
    [
        "time_s,displacement_mm,force rate [N/s]",
        "time_s,displacement_mm,load step",
        "time_s,displacement_mm,Load (Max)",
        "time_s,displacement_mm,Load (Min) [N]",
        "time_s,displacement error,force_N",
        "time_s,stroke count,force_N",
        "time_s,Sollweg [mm],force_N",
        "time_s,displacement command [mm],force_N",
    ],
)
def test_what_only_sounds_like_a_quantity_is_not_taken(tmp_path, head):
    with pytest.raises(RecordingError, match=r"no column (displacement_mm|force_N)"):
        read(tmp_path, head + "\n" + table((T, Q, F)))


def test_minutes_and_extremes(tmp_path):
    recording = read(tmp_path, "Time (min),disp (mm),Load (N)\n" + table((T, Q, F)))
    np.testing.assert_allclose(recording.time, 60 * T)
    for head in ("Time (Min)", "Time_MIN"):
        with pytest.raises(
            RecordingError, match=r'rig.csv:1: column 1 .*it is not clear whether "M(in|IN)" is a unit'
        ):
            read(tmp_path, head + ",disp (mm),Load (N)\n" + table((T, Q, F)))


def test_a_time_in_another_unit_is_not_dropped_silently(tmp_path):
    with pytest.raises(
        RecordingError, match=r"rig.csv:1: column 1 \(Time \[m\]\) is in m, but .* needs a time"
    ):
        read(tmp_path, "Time [m],disp [mm],Load [N]\n" + table((T, Q, F)))


def test_a_force_in_kilograms_is_refused_by_name(tmp_path):
    with pytest.raises(
        RecordingError, match=r"column 3 \(force \[kg\]\) is in kg, but mode axial needs a force"
    ):
        read(tmp_path, "time_s,displacement_mm,force [kg]\n" + table((T, Q, F)))


def test_units_of_the_case_are_converted_too(tmp_path):
    recording = read(
        tmp_path, "t,disp,load\n" + table((T, Q, F)), units={"force": "kgf", "displacement": "mils"}
    )
    np.testing.assert_allclose(recording.force, GRAVITY * F)
    np.testing.assert_allclose(recording.displacement, INCH / 1e3 * Q)


def test_strain_in_percent_and_stretch_without_unit(tmp_path):
    file = tmp_path / "rig.csv"
    for head, values in (("strain [%]", 100 * Q), ("strain [-]", Q), ("stretch [-]", 1 + Q), ("Dehnung,", Q)):
        file.write_text(head.rstrip(",") + ",stress_MPa\n" + table((values, F)))
        np.testing.assert_allclose(read_recording(Source("uniaxial", file)).displacement, Q, atol=1e-12)


def test_usual_units_do_not_import_pint(tmp_path):
    file = tmp_path / "rig.csv"
    file.write_text("Time [s],Temperature [°C],Displacement [mm],Load cell (lbs)\n" + table((T, T, Q, F)))
    program = (
        "import sys\nfrom pathlib import Path\nfrom bushcli.recording import read_recording\n"
        "from bushcli.recording.source import Source\n"
        f"read_recording(Source('axial', Path({str(file)!r})))\nassert 'pint' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


@pytest.mark.parametrize("unit", ["mm", "zoink", "kg", "ton"])
def test_a_unit_of_the_case_that_is_none_is_refused(tmp_path, unit):
    with pytest.raises(RecordingError, match=f'column 3 .*"{unit}" is not a unit of force'):
        read(tmp_path, "t,disp,load\n" + table((T, Q, F)), units={"force": unit})


FORCES = [
    # Units of something else, or unknown ones, after a sign that separates a name from its unit.
    "Force_tonne", "Force tonnes", "Force_t", "Force_V", "Force_volts", "Force_zoink", "Force, zoink",
    "Force zoink", "Force kilograms",
    "force_raw_zoink", "Force: zoink", "Force = zoink", "Force-zoink", "Force [tonne", "Force [zoink",
    "Force_kilograms", "Force_joules",
    # Products and quotients of units.
    "Force_N/s", "Force N/mm", "Force_N*s", "Force_N·s", "Force_lbf/in", "Force:N·s", "Force, N·s",
    # Factors beside a unit.
    "Force [N] x10", "Force [N] * 1000", "Force*1000 [N]", "Force/10 [N]", "Force x1000", "Force 10^3 N", "Force_N*10",
    "Force [1]", "Force%",
]  # fmt: skip
LENGTHS = [
    "Displacement [0.001 in]", "disp_in_raw", "Displacement_volts", "Displacement_pixels", "Displacement_tenths",
]  # fmt: skip


@pytest.mark.parametrize("name", FORCES)
def test_a_force_with_a_doubtful_unit_is_refused_with_its_place(tmp_path, name):
    with pytest.raises(RecordingError, match=r"rig\.csv:1: column 3 .*units = \{force"):
        read(tmp_path, f"time_s;displacement_mm;{name}\n" + table((T, Q, F)).replace(",", ";"))


@pytest.mark.parametrize("name", ["Force upper", "Force bench", "Kraft Prüfstand", "Load frame", "Force MTS"])
def test_words_of_a_rig_at_the_end_of_a_name_are_no_units(tmp_path, name):
    found = read(tmp_path, f"time_s,displacement_mm,{name}\n" + table((T, Q, F)))
    np.testing.assert_allclose(found.force, F)


@pytest.mark.parametrize("name", LENGTHS)
def test_a_length_with_a_doubtful_unit_is_refused_with_its_place(tmp_path, name):
    with pytest.raises(RecordingError, match=r"rig\.csv:1: column 2 .*units = \{displacement"):
        read(tmp_path, f"time_s,{name},force_N\n" + table((T, Q, F)))


@pytest.mark.parametrize(
    "name", ["Time_samples", "Time_frames", "Time_ticks", "Zeit_Std", "Zeit [Std]", "Time [Ms]", "Time [ks]"]
)
def test_a_time_with_a_doubtful_unit_is_refused_with_its_place(tmp_path, name):
    with pytest.raises(RecordingError, match=r"rig\.csv:1: column 1 .*units = \{time"):
        read(tmp_path, f"{name},displacement_mm,force_N\n" + table((T, Q, F)))


@pytest.mark.parametrize(
    ("head", "angle", "moment"),
    [
        ("phi/rad,Moment_kN·m", 1.0, 1e6),
        ("Rotation in rad,Moment kN·m filtered", 1.0, 1e6),
        ("Rotation_deg,Torque_ft-lb", math.pi / 180, 12 * INCH * POUND),
        ("Rotation (rad),Torque oz-in", 1.0, INCH * POUND / 16),
        ("Rotation [rad,Moment [Nm", 1.0, 1e3),
    ],
)
def test_compound_units_anywhere_in_a_name(tmp_path, head, angle, moment):
    recording = read(tmp_path, f"time_s,{head}\n" + table((T, Q, F)), "torsional")
    np.testing.assert_allclose(recording.displacement, angle * Q, rtol=1e-12)
    np.testing.assert_allclose(recording.force, moment * F, rtol=1e-9)


def test_rates_per_angle_are_not_moments(tmp_path):
    for name in ("Moment_Nm/deg", "Moment_Nm/rad", "Moment_joule", "Moment_ftlbz"):
        with pytest.raises(RecordingError, match=r"rig\.csv:1: column 3 .*units = \{force"):
            read(tmp_path, f"time_s,rotation_deg,{name}\n" + table((T, Q, F)), "torsional")


@pytest.mark.parametrize(
    "name", ["% Strain", "%strain", "Strain %", "Strain percentage", "Dehnung_Prozent", "Strain, %"]
)
def test_percent_before_or_after_the_name(tmp_path, name):
    file = tmp_path / "rig.csv"
    file.write_text(f"time_s;{name};stress_MPa\n" + table((T, 100 * Q, F)).replace(",", ";"))
    np.testing.assert_allclose(read_recording(Source("uniaxial", file)).displacement, Q, atol=1e-12)


def test_a_percent_sign_that_may_begin_a_comment_is_refused(tmp_path):
    file = tmp_path / "rig.csv"
    file.write_text("% Strain,stress_MPa\n" + table((100 * Q, F)))
    with pytest.raises(RecordingError, match=r"rig\.csv:1: .*the % may begin a comment or be the unit"):
        read_recording(Source("uniaxial", file))
    file.write_text("% stretch,stress_MPa\n" + table((1 + Q, F)))
    np.testing.assert_allclose(read_recording(Source("uniaxial", file)).displacement, Q, atol=1e-12)


def test_feet_without_brackets(tmp_path):
    recording = read(tmp_path, "time_s,Displacement ',Force [lbf]\n" + table((T, Q, F)))
    np.testing.assert_allclose(recording.displacement, 12 * INCH * Q, atol=1e-12)


@pytest.mark.parametrize(
    "name",
    ["ForceRate_N", "dF/dt [N]", "load increment", "Force SP [N]", "Mittelkraft", "force sigma", "Normalized force"],
)  # fmt: skip
def test_derived_quantities_are_not_taken_for_the_force(tmp_path, name):
    with pytest.raises(RecordingError, match="no column force_N"):
        read(tmp_path, f"time_s,displacement_mm,{name}\n" + table((T, Q, F)))


@pytest.mark.parametrize(
    "name",
    ["force_raw", "Force_vertical", "Force - filtered", "Load/unload force", "Force 2", "Force_B", "Force [F]",
     "Load cell (rear)", "Force, specimen", "Axial Hydropuls force", "t force"],
)  # fmt: skip
def test_other_words_beside_a_name_do_no_harm(tmp_path, name):
    recording = read(tmp_path, f"time_s;displacement_mm;{name}\n" + table((T, Q, F)).replace(",", ";"))
    np.testing.assert_allclose(recording.force, F)
