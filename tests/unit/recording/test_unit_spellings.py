"""Several hundred spellings of units in every place of a file where a unit can stand: the right factor, or refused.

A spelling that is understood is never read with another factor, and one that is not understood is never left out.
"""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.header.units import is_unit, scaled_unit
from bushcli.recording.source import Source

# By definition: international inch and pound (1959), standard gravity 9.80665 m/s2.
INCH, FOOT, GRAVITY = 25.4, 304.8, 9.80665
POUND = 0.45359237 * GRAVITY
DEGREE = math.pi / 180

#: Separated by bars. Each spelling is read with its factor where the place leaves no doubt, and otherwise refused.
RIGHT: dict[str, dict[str, float]] = {
    "force": {
        "N|newton|Newton|NEWTON": 1, "daN|DAN|dan|Dekanewton|decanewtons|da N": 10, "hN|hektonewton": 100,
        "kN|KN|Kilonewton|kilo-newton|k N": 1e3, "cN": 1e-2, "mN|millinewton": 1e-3,
        "MN|meganewton|M N|Mio N|Mio. N|Mega N": 1e6,
        "kp|kgf|KGF|kgF|kg-f|kg(f)|Kilopond|kilogram-force|кгс": GRAVITY, "gf|pond": GRAVITY / 1e3,
        "tf": GRAVITY * 1e3,
        "lbf|LBF|lb|lbs|pounds|pound-force|lb-f|lb_f": POUND, "kip|kips|klbf|klb": 1e3 * POUND, "ozf|oz": POUND / 16,
        "dyn": 1e-5, "Н|牛顿|ニュートン": 1, "千牛|кН": 1e3,
    },
    "length": {
        "mm|MM|Millimeter|millimètres|mm.|㎜|毫米|мм": 1, "cm|Zentimeter|c m": 10, "dm|Dezimeter|d m": 100,
        "m|metres|metri": 1e3,
        "um|µm|μm|micron|Mikrometer": 1e-3, "nm": 1e-6, "in|inch|Inches|Zoll|in.|pouces|pollici|pulgadas": INCH,
        "ft|feet|Fuß|'|′": FOOT, "mil|mils|thou|milli-inch": INCH / 1e3, "µin|microinch": INCH / 1e6,
    },
    "time": {
        "s|sec|Sec|SEC|Sekunden|secondi|с|秒": 1, "ms|msec|mSec|Millisekunden|milli-seconds|мс|毫秒": 1e-3,
        "us|µs|usec|Mikrosekunden": 1e-6, "ns": 1e-9, "min|minutes|Minuten": 60, "h|hours|Stunden|heures": 3600,
        "days|Tage": 86400,
    },
    "angle": {
        "deg|Deg|DEG|degrees|Grad|°|º|degrés|gradi|град|度": DEGREE, "rad|RAD|radians|Radiant|弧度": 1,
        "mrad|mRad": 1e-3,
        "pi rad|π rad|pi*rad|pi-rad": math.pi, "gon|Gon": math.pi / 200, "rev|turns|Umdr|Umdrehungen": 2 * math.pi,
        "arcmin": DEGREE / 60, "arcsec": DEGREE / 3600, "mdeg": DEGREE / 1e3,
    },
    "moment": {
        "Nmm|N*mm|N·mm|N-mm|N_mm|N×mm|Newton-mm|Newtonmillimeter|NMM": 1, "Ncm|N·cm|N cm|NCM": 10, "daNmm|daN*mm": 10,
        "Nm|N*m|N·m|N-m|N_m|NM|nm|N m|newton-meter|Newton-Meter|Newtonmeter|newton_meter|Нм|牛米": 1e3,
        "kNm|kN·m|KNm|kN m": 1e6,
        "kNmm|kN-mm": 1e3, "daNm|daN·m|daN m": 1e4, "daNcm|daN*cm|daN·cm": 100, "mNm": 1,
        "kgfcm|kgf·cm|kp·cm|kpcm": 10 * GRAVITY,
        "kgfm|kgf-m|kpm|mkp": 1e3 * GRAVITY, "lbfin|lbf-in|in-lb|in.lb|lb·in|inch-pounds|in-lbs": INCH * POUND,
        "ft-lb|ftlb|ft·lbf|lb-ft|lbft|foot-pounds|ft-lbs": FOOT * POUND, "oz-in|ozf·in|in-oz": INCH * POUND / 16,
        "kip-in": 1e3 * INCH * POUND,
    },
    "strain": {
        "%|pct|percent|Prozent|pourcent": 0.01, "‰|permille|Promille|mm/m|mstrain": 1e-3, "mm/mm|m/m|in/in": 1,
        "microstrain|µε|µstrain|ppm|µm/m|um/m": 1e-6,
    },
    "stress": {
        "MPa|Mpa|MPA|mpa|N/mm2|N/mm²|N/mm^2|N/mm**2|N·mm-2|N/sqmm|N/qmm|MN/m2|Megapascal|㎫|МПа": 1,
        "kPa|KPa|KPA|kN/m²|k Pa": 1e-3,
        "Pa|Pascal|N/m2|N*m^-2": 1e-6, "GPa|kN/mm2": 1e3, "bar|Bar|BAR|daN/cm²": 0.1, "mbar|hPa": 1e-4,
        "N/cm²": 0.01, "daN/mm2": 10,
        "psi|PSI|lbf/in2|lb/in²|lbf/sqin": POUND / INCH**2, "ksi|kip/in²": 1e3 * POUND / INCH**2,
        "kgf/mm2|kp/mm²": GRAVITY,
        "kgf/cm2|kp/cm²": GRAVITY / 100,
    },
}  # fmt: skip
#: Never read: other quantities, two meanings, numbers that may be a range, slips, and what nobody knows.
WRONG = {
    "force": "kg|ton|tons|tonf|tonnes|Tonnen|mV|Volt|psi|MPa|N/mm|N/s|mm|zoink|%|0.1 N|x10 N|10^3 N|N?|kg/cm2|deg",
    "length": "kN|N|Volt|deg|%|mm/s|smoots|foo|mm/min|Mm|0.1 mm|0.001 in|1/10 mm|1/100mm|Zehntel|psi",
    "time": "Ms|ks|Hz|samples|frames|Ticks|0.1 s|100 ms|N|mm|foo",
    "angle": "grad|grads|mm|kN|N|%|foo|deg/s|0.1 deg|mil|psi",
    "moment": "J|N|kN|mm|kg-cm|foo|N/m|Nm/rad|Nm/deg|psi|%",
    "strain": "mm|N|MPa|foo|deg",
    "stress": "N|kN|lbf|mPa|foo|Shore|kg/cm2|N/mm|daN|%|kN/m",
}
MODES = {
    "axial": (("Time", "s"), ("Displacement", "mm"), ("Force", "N")),
    "torsional": (("Time", "s"), ("Rotation", "rad"), ("Moment", "Nmm")),
    "uniaxial": (("Time", "s"), ("Strain", "mm/mm"), ("Stress", "MPa")),
}
WHERE = {
    "time": ("axial", 0), "length": ("axial", 1), "force": ("axial", 2), "angle": ("torsional", 1),
    "moment": ("torsional", 2), "strain": ("uniaxial", 1), "stress": ("uniaxial", 2),
}  # fmt: skip
SAMPLES = np.arange(12)
ROWS = np.column_stack(
    [0.5 * SAMPLES, 0.3 * np.sin(SAMPLES / 3), 7.3 * np.sin(SAMPLES / 3) + 0.01 * SAMPLES]
).round(6)
#: Places in the name, {n} the name and {u} the unit; then those with the unit in a line or a column of its own.
IN_NAMES = [
    "{n} [{u}]", "{n} ({u})", "{n} / {u}", "{n}/{u}", "{n}_{u}", "{n}, {u}", "{n} in {u}", "{n} {u}",
    "{n}: {u}", "{n} - {u}",
]  # fmt: skip
ABOVE = [
    "# units: {all}", "Units: {all}", "# units: {pairs}", "# {n} unit: {u}", "# unit of {n}: {u}",
    "# {n} in {u}", "# {n} [{u}]",
]  # fmt: skip
ROWS_OF_UNITS = [
    "below", "above", "above in brackets", "above as a comment", "above, alone", "below, alone",
]  # fmt: skip
BEHIND = ["", "Unit", "{n} unit"]


def table(rows: list[list[str]]) -> str:
    return "\n".join(";".join(row) for row in rows) + "\n"


def contents(place: str, quantity: str, unit: str) -> str:
    """Return a file with a unit in a place, and the usual units elsewhere."""
    mode, k = WHERE[quantity]
    names, units = [name for name, _ in MODES[mode]], [one for _, one in MODES[mode]]
    full = [f"{name} [{one}]" if i != k else name for i, (name, one) in enumerate(MODES[mode])]
    rows = [[f"{value:.6f}" for value in row] for row in ROWS]
    own = [unit if i == k else one for i, one in enumerate(units)]
    if place in IN_NAMES:
        return table([[place.format(n=n, u=unit) if i == k else full[i] for i, n in enumerate(names)], *rows])
    if place in ABOVE:
        listed = ", ".join(own)
        pairs = ", ".join(f"{n}={one}" for n, one in zip(names, own, strict=True))
        line = place.format(all=listed, pairs=pairs, n=names[k], u=unit)
        return f"{line}\n" + table([names if "units:" in line.lower() else full, *rows])
    if place in BEHIND:
        header = [*full[: k + 1], place.format(n=names[k]), *full[k + 1 :]]
        return table([header, *([*row[: k + 1], unit, *row[k + 1 :]] for row in rows)])
    row = [one if i == k or "alone" not in place else "" for i, one in enumerate(own)]
    row = [f"[{one}]" for one in row] if "brackets" in place else row
    row[0] = f"# {row[0]}" if "comment" in place else row[0]
    return table([names, row, *rows] if "below" in place else [row, names, *rows])


def factor_read(folder: Path, quantity: str, content: str, **options) -> float | None:
    """Return the factor with which a column was read; None if the file was refused, or the column left out."""
    mode, k = WHERE[quantity]
    file = folder / "rig.csv"
    # A new file is written four times as fast as an old one is overwritten.
    file.unlink(missing_ok=True)
    file.write_text(content, encoding="utf-8")
    try:
        found = read_recording(Source(mode, file, **options))
    except RecordingError:
        return None
    values = (found.time, found.displacement, found.force)[k]
    return None if values is None else float(values[5] / ROWS[5, k])


SPELLINGS = [
    (quantity, unit, factor)
    for quantity, units in RIGHT.items()
    for spelled, factor in units.items()
    for unit in spelled.split("|")
] + [(quantity, unit, None) for quantity, units in WRONG.items() for unit in units.split("|")]


@pytest.mark.parametrize("quantity", list(WHERE))
@pytest.mark.parametrize("place", [*IN_NAMES, *ABOVE, *ROWS_OF_UNITS, *BEHIND])
def test_a_unit_is_read_with_its_factor_or_refused_wherever_it_stands(tmp_path, place, quantity):
    wrong, known, right = [], 0, 0
    for of, unit, factor in SPELLINGS:
        # A row with nothing but an unknown word may be a title.
        if of != quantity or (place == "above, alone" and factor is None and not is_unit(unit)):
            continue
        read = factor_read(tmp_path, quantity, contents(place, quantity, unit))
        known, right = known + (factor is not None), right + (read is not None and factor is not None)
        if read is not None and (factor is None or read != pytest.approx(factor, rel=1e-5)):
            wrong.append((unit, read, factor))
    assert not wrong
    # Refusing is right where a name leaves a doubt; a place of units refuses few.
    assert right >= (0.9 if place in (*IN_NAMES[:2], *ROWS_OF_UNITS, *BEHIND) else 0.6) * known


@pytest.mark.parametrize("quantity", list(WHERE))
def test_units_in_the_case_file(tmp_path, quantity):
    mode, k = WHERE[quantity]
    key = ("time", "displacement", "force")[k]
    names = [name if i == k else f"{name} [{one}]" for i, (name, one) in enumerate(MODES[mode])]
    content = table([names, *([f"{value:.6f}" for value in row] for row in ROWS)])
    for of, unit, factor in SPELLINGS:
        if of != quantity:
            continue
        read = factor_read(tmp_path, quantity, content, units={key: unit})
        scaled = scaled_unit(unit, quantity)
        if factor is None and unit[0] not in "0123456789x":
            assert read is None, unit
        else:
            assert read == pytest.approx(factor if factor is not None else scaled.factor, rel=1e-5), unit


@pytest.mark.parametrize(
    ("unit", "newtons"),
    [
        ("0.1 N", 0.1),
        ("0,1 N", 0.1),
        ("x10 N", 10),
        ("10^3 N", 1e3),
        ("1/10 daN", 1),
        ("1e3 N", 1e3),
        ("2.5kN", 2500),
    ],
)
def test_the_case_file_may_give_a_unit_with_a_number(tmp_path, unit, newtons):
    """The remedy of a file that is refused because "0.1 N" may be a range: the same text in `units`."""
    content = contents("above", "force", unit)
    (tmp_path / "rig.csv").write_text(content)
    with pytest.raises(RecordingError, match=r"units = \{force = "):
        read_recording(Source("axial", tmp_path / "rig.csv"))
    assert factor_read(tmp_path, "force", content, units={"force": unit}) == pytest.approx(newtons)


def test_units_above_the_names_and_behind_the_numbers_as_rigs_wrote_them(tmp_path):
    rows = "".join(f"{1000 * i};{0.1 * i};{5 * i}\n" for i in range(8))
    factor_file = tmp_path / "rig.csv"
    factor_file.write_text("ms;in;0.1 N\nTime;Displacement;Force\n" + rows)
    with pytest.raises(RecordingError, match=r'rig\.csv:1: column 3 \(Force\): "0\.1 N" may be the range'):
        read_recording(Source("axial", factor_file))
    found = read_recording(Source("axial", factor_file, units={"force": "0.1 N"}))
    assert (found.time[-1], found.displacement[-1], found.force[-1]) == pytest.approx((7.0, 0.7 * INCH, 3.5))


@pytest.mark.parametrize("mode", ["axial", "uniaxial"])
def test_a_list_of_units_that_does_not_fit_the_columns_is_not_ignored(tmp_path, mode):
    names = ";".join(name for name, _ in MODES[mode])
    rows = table([[f"{value:.6f}" for value in row] for row in ROWS])
    (tmp_path / "rig.csv").write_text(f"# units: s, deg, %\n{names}\n{rows}")
    with pytest.raises(RecordingError, match=r"what line 1 states is not a unit of"):
        read_recording(Source(mode, tmp_path / "rig.csv"))


def test_a_long_word_that_units_could_make_up_is_refused_at_once():
    """A force and a length may be written together, but not more than these two."""
    begin = time.process_time()
    assert scaled_unit("Nmkgcmlbft" * 20, "moment") is None
    assert time.process_time() - begin < 1.0
