"""Names in further languages, and units in a column of their own."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import read_recording
from bushcli.recording.source import Source

ROWS = [(0.05 * i, 5.0 * math.sin(i / 6), 400.0 * math.sin(i / 6)) for i in range(48)]
LARGEST = max(row[2] for row in ROWS)


def rig(folder: Path, header: str, cells: Callable[[int, Sequence[str]], Sequence[str]] = lambda _, row: row):
    """Read a file with time, travel and force; `cells` puts further fields between them."""
    rows = [cells(i, [f"{value:.6f}" for value in row]) for i, row in enumerate(ROWS)]
    (folder / "rig.csv").write_text(
        "\n".join([header, *(";".join(row) for row in rows)]) + "\n", encoding="utf-8"
    )
    return read_recording(Source("axial", folder / "rig.csv"))


@pytest.mark.parametrize(
    "name",
    [
        "最大力(N)", "设定力(N)", "目标力(N)", "力峰值(N)", "荷重指令(N)", "最大荷重(N)", "목표 하중(N)",
        "Сила макс. [N]", "Заданная сила [N]", "Piekkracht [N]", "Kracht gewenst [N]", "Fout kracht [N]",
        "Effort maxi [N]", "Effort calculé [N]",
        "Force théorique [N]", "Fuerza pico [N]", "Fuerza calculada [N]", "Forza impostata [N]", "Forza di picco [N]",
        "Força de referência [N]", "Siła zadana [N]", "Siła maksymalna [N]", "Kuvvet (hedef) [N]", "Kraftbörvärde [N]",
        "Raideur [N]", "Énergie [N]",
    ],
)  # fmt: skip
def test_what_was_not_measured_in_further_languages(tmp_path, name):
    with pytest.raises(RecordingError, match="no column force_N"):
        rig(tmp_path, f"Time [s];Displacement [mm];{name}")
    found = rig(
        tmp_path, f"Time [s];Displacement [mm];{name};Force [N]", lambda _, row: [*row[:2], "7", row[2]]
    )
    assert found.columns[1].number == 4


@pytest.mark.parametrize(
    ("header", "unit"),
    [
        ("Время, с;Перемещение, мм;Нагрузка, кН", "kN"), ("Tempo (s);Deslocamento (mm);Força (N)", "N"),
        ("Tijd [s];Verplaatsing [mm];Kracht [N]", "N"), ("Čas [s];Dráha [mm];Síla [kN]", "kN"),
        ("시간(s);변위(mm);하중(N)", "N"), ("Zaman (s);Yer değiştirme (mm);Kuvvet (N)", "N"),
        ("Temps [s];Déplacement [mm];Force lissée [N]", "N"), ("Tiempo [s];Desplazamiento [mm];Fuerza medida [N]", "N"),
    ],
)  # fmt: skip
def test_measured_columns_in_further_languages(tmp_path, header, unit):
    found = rig(tmp_path, header)
    assert found.units == ("mm", unit)
    assert found.time is not None


def with_units(force: str | Callable[[int], str]) -> Callable[[int, Sequence[str]], list[str]]:
    return lambda i, row: [row[0], "s", row[1], "mm", row[2], force if isinstance(force, str) else force(i)]


@pytest.mark.parametrize("names", ["Unit", "", "Einheit", "remark"])
def test_a_unit_in_the_column_behind_the_numbers(tmp_path, names):
    found = rig(tmp_path, f"Time;{names};Displacement;{names};Force;{names}", with_units("kN"))
    assert found.units == ("mm", "kN")
    assert np.abs(found.force).max() == pytest.approx(1000.0 * LARGEST, rel=1e-5)
    assert not any(one.assumed for one in found.columns)


def test_units_behind_the_numbers_that_are_not_clear(tmp_path):
    header = "Time;Unit;Displacement;Unit;Force;Unit"
    with pytest.raises(
        RecordingError, match=r'rig\.csv:22: column 5 \(Force\): the unit behind it is "N" at first and'
    ):
        rig(tmp_path, header, with_units(lambda i: "N" if i < 20 else "kN"))
    with pytest.raises(RecordingError, match=r'column 5 \(Force\): "zoink" is not a known unit'):
        rig(tmp_path, header, with_units("zoink"))
    with pytest.raises(RecordingError, match=r"column 5 \(Force \[N\]\) is in N and in kN"):
        rig(tmp_path, header.replace("Force", "Force [N]"), with_units("kN"))


@pytest.mark.parametrize(("name", "text"), [("Phase", "h"), ("Status", "ok"), ("Remark", "N/A?"), ("", "ok")])
def test_other_texts_behind_the_numbers_are_no_units(tmp_path, name, text):
    found = rig(tmp_path, f"Time;Displacement;Force;{name}", lambda _, row: [*row, text])
    assert [one.unit for one in found.columns if one.quantity == "force"] == ["N"]


def test_a_column_t_that_is_not_taken_as_the_time_is_reported(tmp_path):
    found = rig(tmp_path, "t_us;x_mm;F_N")
    assert found.time is None
    assert any("column 1 (t_us) was not taken as the time" in one.text for one in found.repairs)
