"""Conditions that the lines above a table of dynamic stiffness state, and numbers in its header."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording.dynamic.read import read_dynamic
from bushcli.recording.dynamic.source import DynamicSource

HEAD = "f [Hz]\tKd [N/mm]\tPhase [deg]\n"
ROWS = "1.0\t500.5\t5.1\n10.0\t550\t7\n"


def read(folder, text, **given):
    path = folder / "table.csv"
    path.write_text(text, encoding="utf-8")
    return read_dynamic(DynamicSource("radial", (path,), **given))


def refused(folder, text, **given):
    with pytest.raises(RecordingError) as error:
        read(folder, text, **given)
    return str(error.value)


@pytest.mark.parametrize(
    ("line", "force"),
    [
        ("Preload: 1,000 N", 1000.0),
        ("Preload: 1,234.5 N", 1234.5),
        ("Preload: 0,500 kN", 500.0),
        ("Preload: -2.5 kN", -2500.0),
        ("Preload: 1'500 N", 1500.0),
        ("Preload: 1 500 N", 1500.0),
        ("Preload: ~500 N", 500.0),
        ("Static preload 1500 N", 1500.0),
        ("Radial preload: 500 N (compression)", 500.0),
        ("Preload: 500 N, 30 s hold", 500.0),
        ("Preload level: 500 N", 500.0),
        ("Preload: 500 N (50 kg)", 500.0),
    ],
)
def test_numbers_above_a_table_may_have_separators(tmp_path, line, force):
    table = read(tmp_path, f"{line}\n{HEAD}{ROWS}")
    np.testing.assert_allclose(table.preload_force, force)


@pytest.mark.parametrize(
    ("line", "key", "value"),
    [
        ("Temperature: RT (23 °C)", "temperature", 23.0),
        ("Temperatur: 23±2 °C", "temperature", 23.0),
        ("Prüftemperatur: 23 °C", "temperature", 23.0),
        ("Amplitude (0-peak) [mm]\t0.1", "amplitude", 0.1),
        ("Amplitude: 0.2 mm (half peak-to-peak)", "amplitude", 0.2),
        ("Amplitude, p-p: 0.2 mm", "amplitude", 0.1),
        ("Preload in N: 500", "preload_force", 500.0),
        ("Preload (in MN): 0.5", "preload_force", 5e5),
        ("Preload (compression): 500 N +/- 5 N", "preload_force", 500.0),
        ("Preload\tN\t500", "preload_force", 500.0),
        ("Room temperature: 23 °C", "temperature", 23.0),
        ("Raumtemperatur: 23 °C", "temperature", 23.0),
        ("Ambient temperature: 23 °C", "temperature", 23.0),
        ("Umgebungstemperatur: 23 °C", "temperature", 23.0),
        ("Temperatur Klimakammer: 23 °C", "temperature", 23.0),
        ("Chamber temperature: 23.0 °C (setpoint)", "temperature", 23.0),
        ("Temperature: 23 °C (73 °F)", "temperature", 23.0),
        ("Temperature: 23 °C (room temperature), humidity 50 %", "temperature", 23.0),
        ("Amplitude: 0.1 mm (0-p), sinusoidal", "amplitude", 0.1),
        ("Preload: 500 N @ 23 °C", "preload_force", 500.0),
        ("Preload: 500 N @ 23 °C", "temperature", 23.0),
        ("Amplitude: 0.1 mm (peak) at -20 °C, 500 N", "temperature", -20.0),
        ("Amplitude: 0.1 mm (peak) at -20 °C, 500 N", "preload_force", 500.0),
    ],
)
def test_a_line_of_known_words_states_a_condition(tmp_path, line, key, value):
    table = read(tmp_path, f"{line}\n{HEAD}{ROWS}")
    np.testing.assert_allclose(getattr(table, key), value)
    assert not any("not read as a condition" in remark for remark in table.remarks)


@pytest.mark.parametrize(
    ("line", "key"),
    [
        ("Conditioning amplitude: 5 mm (peak)", "amplitude"),
        ("Storage temperature: 40 °C", "temperature"),
        ("Lagerungstemperatur: 40 °C", "temperature"),
        ("Temperature limit: 80 °C", "temperature"),
        ("Temperature after test: 31 °C", "temperature"),
        ("Temperature: RT", "temperature"),
        ("Preload tolerance: 5 N", "preload_force"),
        ("Max preload: 2000 N", "preload_force"),
        ("Axial preload: 300 N", "preload_force"),
    ],
)
def test_a_line_that_says_more_or_less_states_none_and_is_reported(tmp_path, line, key):
    table = read(tmp_path, f"{line}\n{HEAD}{ROWS}")
    assert np.isnan(getattr(table, key)).all()
    (remark,) = table.remarks
    assert line in remark
    assert f"{key} = ..." in remark
    # What the case file states needs no remark, and a line that states it is not overruled.
    assert read(tmp_path, f"{line}\n{HEAD}{ROWS}", **{key: 7.0}).remarks == ()
    if key == "temperature":
        table = read(tmp_path, f"Temperature: 20 °C\n{line}\n{HEAD}{ROWS}")
        np.testing.assert_allclose(table.temperature, 20.0)


@pytest.mark.parametrize(
    ("line", "key"),
    [
        ("Temperature: 23", "temperature"),
        ("Temperature: 23 °C (40 °C)", "temperature"),
        ("Preload: 200-500 N", "preload_force"),
        # A list of what the table has is no condition of all rows.
        ("Preload: 0,500,1000 N", "preload_force"),
        ("Preload: 500 N limit 80 °C", "preload_force"),
    ],
)
def test_a_line_that_is_not_understood_is_asked_for_where_nothing_else_states_its_condition(
    tmp_path, line, key
):
    said = refused(tmp_path, f"{line}\n{HEAD}{ROWS}")
    assert line in said
    assert f"{key} = ..." in said
    np.testing.assert_allclose(getattr(read(tmp_path, f"{line}\n{HEAD}{ROWS}", **{key: 7.0}), key), 7.0)
    other = "Temperature: 20 °C" if key == "temperature" else "Preload: 20 N"
    table = read(tmp_path, f"{other}\n{line}\n{HEAD}{ROWS}")
    np.testing.assert_allclose(getattr(table, key), 20.0)
    assert any(line in remark for remark in table.remarks)


def test_a_line_may_state_several_conditions(tmp_path):
    line = "Preload: 500 N, Amplitude: 0.1 mm (peak); Temperature = 40 °C"
    table = read(tmp_path, f"{line}\n{HEAD}{ROWS}")
    assert {*table.preload_force, *table.amplitude, *table.temperature} == {500.0, 0.1, 40.0}


def test_lines_that_state_different_values_are_asked_for(tmp_path):
    text = f"Temperature: 23 °C\nTest temperature: 40 °C\n{HEAD}{ROWS}"
    said = refused(tmp_path, text)
    assert "line 1" in said
    assert "temperature = ..." in said
    np.testing.assert_allclose(read(tmp_path, text, temperature=40.0).temperature, 40.0)
    same = f"Amplitude: 0.1 mm (peak)\nAmplitude: 0.2 mm p-p\n{HEAD}{ROWS}"
    np.testing.assert_allclose(read(tmp_path, same).amplitude, 0.1)


@pytest.mark.parametrize("where", ["line", "names", "row"])
@pytest.mark.parametrize(("sign", "force"), [(".", 1000.0), (",", 1.0)])
def test_a_number_in_a_header_has_the_decimal_sign_of_the_rows(tmp_path, where, sign, force):
    head = {
        "line": f"Preload: 1,000 N\n{HEAD}",
        "names": "f [Hz]\tKd 1,000 N [N/mm]\tPhase 1,000 N [deg]\n",
        "row": "Preload [N]\t1,000\t1,000\nf [Hz]\tKd [N/mm]\tPhase [deg]\n",
    }[where]
    table = read(tmp_path, head + ROWS.replace(".", sign))
    np.testing.assert_allclose(table.preload_force, force)
    whole = head + "1\t500\t5\n10\t550\t7\n"
    assert 'decimal = "." or ","' in refused(tmp_path, whole)
    np.testing.assert_allclose(read(tmp_path, whole, decimal=sign).preload_force, force)
