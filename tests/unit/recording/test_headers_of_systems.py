"""Names of columns as test machines and data-acquisition systems write them: read in the unit that they give."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.source import Source

ROWS = [
    (0.05 * i, 5.0 * math.asin(math.sin(math.pi * i / 12)), 400.0 * math.sin(i / 6), 3.0 + i, 7.0 - i)
    for i in range(48)
]


def rig(folder: Path, header: str, mode: str = "axial", below: str = "", **options: object):
    """Read a file with time, travel and force in its first columns; names are separated by |."""
    names = header.split("|")
    lines = [";".join(names), *([below.replace("|", ";")] if below else [])]
    lines += [";".join(f"{value:.6f}" for value in row[: len(names)]) for row in ROWS]
    (folder / "rig.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_recording(Source(mode, folder / "rig.csv", **options))  # type: ignore[arg-type]


def columns(recording) -> dict[str, tuple[int, str]]:
    return {one.quantity: (one.number, one.unit) for one in recording.columns}


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("Load(Linear:Load) (kN)", "kN"), ("Load 2(Linear:Load 2) (kN)", "kN"), ("Load (Dynacell) (kN)", "kN"),
        ("Load(8800 (0,1):Load) (kN)", "kN"), ("Load cell (max 25 kN) [kN]", "kN"), ("Force [N] (cycle 5)", "N"),
        ("Kraft (Nennkraft 25 kN) [kN]", "kN"), ("Force (rate 10 mm/min) [N]", "N"), ("Force (5th cycle) [N]", "N"),
        ("Force (+) [N]", "N"), ("Force (2021-03-05) [N]", "N"), ("<Force> (N)", "N"), ("Force incl. preload [N]", "N"),
        ("Load cell (25 kN) [kN]", "kN"), ("Force (±5 kN) [kN]", "kN"), ("Force +/-25 kN [kN]", "kN"),
        ("Force S9M/5kN [kN]", "kN"), ("Force (HBM U10M, 25 kN, SN 1234) [kN]", "kN"), ("Force (0...10 V) [N]", "N"),
        ("Force (S/N 123456) [N]", "N"), ("Force (LP 100 Hz) [N]", "N"), ("Force (fs = 1 kHz) [N]", "N"),
        ("Force (CFC60) [N]", "N"), ("Force (low pass) [N]", "N"), ("Force (zero corrected) [N]", "N"),
        ("Force (compression) [N]", "N"), ("Force (tension/compression) [N]", "N"), ("Force (+ = tension) [N]", "N"),
        ("Force [N] (positive = compression)", "N"), ("Kraft (Zug positiv) [N]", "N"), ("Force (10 mm/min) [N]", "N"),
        ("Force (offset removed) [N]", "N"), ("Force (range 10 kN) [N]", "N"), ("Force (filtrée) [N]", "N"),
        ("Force (z direction) [N]", "N"), ("Force (Fz) [N]", "N"), ("Standardkraft (ungefiltert) [N]", "N"),
        # Without brackets.
        ("Force, offset corrected [N]", "N"), ("Force without offset [N]", "N"), ("Force mean-free [N]", "N"),
        ("Force inertia compensated [N]", "N"), ("Force in z direction [N]", "N"), ("Force 10 kN range [N]", "N"),
        ("Force_10mm_min [N]", "N"), ("Force average of 2 sensors [N]", "N"), ("Kraft Mittel aus 2 Sensoren [N]", "N"),
    ],
)  # fmt: skip
def test_a_remark_beside_a_known_unit(tmp_path, name, unit):
    assert columns(rig(tmp_path, f"Time [s]|Displacement [mm]|{name}"))["force"] == (3, unit)


@pytest.mark.parametrize(
    "name",
    [
        "Position(Linear:Digital Position) (mm)", "Displacement (compliance corrected) [mm]", "Weg WA/50 [mm]",
        "Displacement (Temposonics) [mm]", "Displacement K-WA/50 [mm]", "Displacement average of LVDT 1+2 [mm]",
        "Displacement (Avg of 2) [mm]",
    ],
)  # fmt: skip
def test_a_remark_beside_the_unit_of_the_displacement(tmp_path, name):
    assert columns(rig(tmp_path, f"Time (1000 Hz) [s]|{name}|Force [N]"))["displacement"] == (2, "mm")


@pytest.mark.parametrize(
    "name",
    [
        "<Force>",
        "Force (Collected)", "Force (Formula Result)", "Force (unfiltered)", "Kraft gefiltert", "Kraft (gefiltert)",
        "Kraft tariert", "Kraft (tariert)", "Kraft roh", "Kraft (Rohdaten)", "Kraft (korrigiert)", "Force compensated",
        "Force (resampled)", "Force (detrended)", "Force (Dev1/ai0)", "Force (LC2)", "Force_lc2", "Force MX840",
        "Force (MX840B)", "Force, z-axis", "Force (Z-axis)", "Force (z direction)", "Force (Instron)", "Force (static)",
        "Force final", "Force (Fz)", "axialForce", "AxialForce", "LoadCell1", "Force (filtrée)", "Forza", "Fuerza",
        "荷重", "力(牛)",
    ],
)  # fmt: skip
def test_a_name_without_a_unit(tmp_path, name):
    found = rig(tmp_path, f"Time [s]|Displacement [mm]|{name}")
    assert columns(found)["force"] == (3, "N")


@pytest.mark.parametrize(
    "header",
    [
        "Temps|Déplacement|Effort", "Tempo|Spostamento|Forza", "Tiempo|Desplazamiento|Carga", "時間|変位|荷重",
        "时间(秒)|位移(毫米)|力(牛)", "runningTime|axialDisplacement|axialForce", "TimeStamp|Disp|Load",
    ],
)  # fmt: skip
def test_headers_of_other_languages_and_programs(tmp_path, header):
    assert columns(rig(tmp_path, header)) == {"time": (1, "s"), "displacement": (2, "mm"), "force": (3, "N")}


def test_a_row_of_comments_below_the_row_of_units(tmp_path):
    found = rig(tmp_path, "Time|Displacement|Force", below="s|in|kN\nComments|Channel 1|Channel 2")
    assert found.units == ("in", "kN")


@pytest.mark.parametrize("row", ["x1|x10|x100", "a|gain 10|b", "a|(in)|b", "a|0.1|b"])
def test_a_row_below_the_row_of_units_that_may_have_factors_is_refused(tmp_path, row):
    with pytest.raises(RecordingError, match=r"rig\.csv:3: .*below the row of units|rig\.csv:3: "):
        rig(tmp_path, "Time|Displacement|Force", below=f"s|mm|kN\n{row}")


@pytest.mark.parametrize(
    "name",
    [
        "Force (kgf) [N]", "Force (in lbf) [N]", "Force (V) [N]", "Force (counts) [V]", "Force (tons) [N]",
        "Force (kilo) [N]", "Force (imperial) [N]", "Force (mV/V) [N]", "Force (raw mV) [N]", "Force (0.1) [N]",
        "Force (1:10) [N]", "Force (x10) [N]", "Force (gain=10) [N]", "Force [N] (klx)", "Force (N) [kN]",
        "Force (25 kN)", "Force (LP 100 Hz)", "Force (filtered, kgf)", "Force (A)", "Force KN2", "Force LBF2",
        "Force ADC1", "Force GAIN10", "F1/1000 [N]", "RF/1000 [N]", "FORCE/10 [N]", "Force drift",
    ],
)  # fmt: skip
def test_what_may_be_another_unit_or_a_factor_is_refused(tmp_path, name):
    with pytest.raises(RecordingError, match=re.escape(name)):
        rig(tmp_path, f"Time [s]|Displacement [mm]|{name}")


@pytest.mark.parametrize(
    "name",
    [
        "Force mean of 3 cycles [N]", "Force max cycle 5 [N]", "Force (max) [N]", "Force cycle [N]",
        "Force average [N]", "Force offset [N]", "Force range [N]", "Inertia force [N]",
        "Forza media [N]", "Forza comando [N]", "ForceCommand", "MaxForce [N]",
    ],
)  # fmt: skip
def test_another_quantity_is_not_taken_for_the_force(tmp_path, name):
    with pytest.raises(RecordingError, match="no column force_N"):
        rig(tmp_path, f"Time [s]|Displacement [mm]|{name}")


@pytest.mark.parametrize(
    ("header", "travel", "force"),
    [
        ("Time [s]|Spostamento [mm]|Forza [N]|Spostamento comando [mm]", 2, 3),
        ("Time [s]|Displacement [mm]|Force [N]|Force (offset corrected) [N]|Displacement (laser) [mm]", 2, 3),
        ("Time [s]|Position(Linear:Position) (mm)|Load(Linear:Load) (kN)|Max Load(Linear:Load) (kN)", 2, 3),
        ("Time [s]|Position(Linear:Position) (mm)|Load(Linear:Load) (N)|Position Error(Linear:Position) (mm)", 2, 3),
        ("Time [s]|Displacement [mm]|Prüfkraft [N]|Fx [N]|Fy [N]", 2, 3),
    ],
)  # fmt: skip
def test_the_measured_one_of_several_columns(tmp_path, header, travel, force):
    found = columns(rig(tmp_path, header))
    assert (found["displacement"][0], found["force"][0]) == (travel, force)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("Axial strain (%)", "percent"), ("Strain (ΔL/L0) [-]", "strain"), ("Strain (dL/L0)", "strain"),
        ("Strain (video extensometer) [%]", "percent"), ("Strain (AVE2) [%]", "percent"), ("Strain (ε)", "strain"),
        ("Strain (clip-on) (%)", "percent"), ("Déformation (%)", "percent"), ("ひずみ[%]", "percent"),
    ],
)  # fmt: skip
def test_strains_of_coupons(tmp_path, name, unit):
    factor = 100.0 if unit == "percent" else 1.0
    rows = "\n".join(f"{0.05 * i * factor:.4f};{0.1 * i:.2f}" for i in range(9))
    (tmp_path / "coupon.csv").write_text(f"{name};Contrainte (MPa)\n{rows}\n", encoding="utf-8")
    found = read_recording(Source("uniaxial", tmp_path / "coupon.csv"))
    assert found.displacement == pytest.approx(0.05 * np.arange(9))


@pytest.mark.parametrize("name", ["λ [-]", "Stretch ratio λ [-]", "Stretch (L/L0)"])
def test_stretches_of_coupons(tmp_path, name):
    rows = "\n".join(f"{1.0 + 0.05 * i:.4f};{0.1 * i:.2f}" for i in range(9))
    (tmp_path / "coupon.csv").write_text(f"{name};σ [MPa]\n{rows}\n", encoding="utf-8")
    found = read_recording(Source("uniaxial", tmp_path / "coupon.csv"))
    assert found.displacement == pytest.approx(0.05 * np.arange(9))


@pytest.mark.parametrize("name", ["Radial strain (%)", "Volumetric strain (%)", "Axial true strain (%)"])
def test_strains_in_another_direction_are_refused(tmp_path, name):
    (tmp_path / "coupon.csv").write_text(f"{name};Stress (MPa)\n" + "\n".join(f"{i};{i}" for i in range(9)))
    with pytest.raises(RecordingError, match="no column stretch"):
        read_recording(Source("uniaxial", tmp_path / "coupon.csv"))
