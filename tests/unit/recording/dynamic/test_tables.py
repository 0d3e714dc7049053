"""Tables of dynamic stiffness as rigs and laboratories write them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording.dynamic.names import meaning
from bushcli.recording.dynamic.read import read_dynamic
from bushcli.recording.dynamic.source import DynamicSource

#: |K*| in N/mm and loss angle in degrees at 1, 10 and 50 Hz.
FREQUENCY = np.array([1.0, 10.0, 50.0])
STIFFNESS, ANGLE = np.array([500.0, 550.0, 600.0]), np.radians([5.0, 7.0, 9.0])
STORAGE, LOSS = STIFFNESS * np.cos(ANGLE), STIFFNESS * np.sin(ANGLE)
#: Each quantity as a column: its name, and its values in the unit of the name.
COLUMNS = {
    "stiffness": ("Kdyn [kN/m]", STIFFNESS),
    "storage": ("K' (N/m)", 1e3 * STORAGE),
    "loss": ("K'' [N/mm]", LOSS),
    "loss_angle": ("Verlustwinkel in °", np.degrees(ANGLE)),
    "radians": ("delta [rad]", ANGLE),
    "tan_delta": ("tan δ", np.tan(ANGLE)),
    "percent": ("loss factor [%]", 100.0 * np.tan(ANGLE)),
    "damping": ("damping_Ns_per_mm", LOSS / (2.0 * np.pi * FREQUENCY)),
}
_SAME = {"radians": "loss_angle", "percent": "tan_delta"}
PAIRS = [
    pair
    for pair in itertools.combinations(COLUMNS, 2)
    if _SAME.get(pair[0], pair[0]) != _SAME.get(pair[1], pair[1])
    # Loss and damping are the same quantity, and so are the angle and its tangent.
    and set(pair) != {"loss", "damping"}
    and not set(pair) <= {"loss_angle", "radians", "tan_delta", "percent"}
]


def read(folder, text, mode="radial", **given):
    path = folder / "table.csv"
    path.write_text(text, encoding="utf-8")
    return read_dynamic(DynamicSource(mode, (path,), **given))


def refused(folder, text, mode="radial", **given):
    with pytest.raises(RecordingError) as error:
        read(folder, text, mode, **given)
    return str(error.value)


def rows(*columns):
    return "\n".join(",".join(f"{value:.6g}" for value in row) for row in zip(*columns, strict=True)) + "\n"


@pytest.mark.parametrize("pair", PAIRS, ids="-".join)
def test_any_two_quantities_give_storage_and_loss(tmp_path, pair):
    (first, one), (second, other) = (COLUMNS[key] for key in pair)
    table = read(tmp_path, f"frequency_Hz,{first},{second}\n" + rows(FREQUENCY, one, other))
    # The difference of |K*| and K' has five of the six digits that are written, the others lose none.
    accuracy = 1e-2 if set(pair) == {"stiffness", "storage"} else 1e-4
    np.testing.assert_allclose(table.storage, STORAGE, rtol=1e-4)
    np.testing.assert_allclose(table.loss, LOSS, rtol=accuracy)
    assert np.isnan(table.amplitude).all()


def test_conditions_are_columns_lines_above_or_keys(tmp_path):
    text = "Vorlast: 500 N\nTemperatur;40;°C\nf;Amplitude [±µm];Cdyn [N/mm];Phase [°]\nHz;;;\n1;50;500;5\n10;50;550;7\n"
    table = read(tmp_path, text)
    np.testing.assert_allclose(table.amplitude, 0.05)
    assert (table.preload_force == 500.0).all()
    assert (table.temperature == 40.0).all()
    kelvin = "freq [rad/s],T [K],K* [N/mm],delta [deg]\n6.283185,296.15,500,5\n62.83185,296.15,550,7\n"
    table = read(tmp_path, kelvin, preload=-2.0, amplitude=0.2, amplitude_is="double")
    np.testing.assert_allclose(table.frequency, [1.0, 10.0], rtol=1e-6)
    np.testing.assert_allclose(table.temperature, 23.0)
    np.testing.assert_allclose([table.preload[0], table.amplitude[0]], [-2.0, 0.1])


def test_a_wide_table_has_its_conditions_in_the_names(tmp_path):
    head = "f [Hz],Kdyn @ ±0.1 mm [N/mm],delta @ ±0.1 mm [deg],Kdyn @ ±0.5 mm [N/mm],delta @ ±0.5 mm [deg]\n"
    table = read(tmp_path, head + "1,500,5,400,6\n10,550,7,450,8\n")
    np.testing.assert_allclose(table.amplitude, [0.1, 0.1, 0.5, 0.5])
    np.testing.assert_allclose(table.stiffness, [500, 550, 400, 450])
    np.testing.assert_allclose(table.frequency, [1, 10, 1, 10])
    assert len(table.conditions()) == 2
    over_amplitude = read(
        tmp_path,
        "A pp [mm],K* 1 Hz [N/mm],δ 1 Hz [°],K* 10 Hz [N/mm],δ 10 Hz [°]\n"
        "0.2,500,5,550,6\n1,400,7,450,8\n2,300,7,350,8\n",
    )
    np.testing.assert_allclose(over_amplitude.frequency, [1, 1, 1, 10, 10, 10])
    np.testing.assert_allclose(over_amplitude.amplitude, [0.1, 0.5, 1, 0.1, 0.5, 1])
    assert not over_amplitude.over_frequency


def test_conditions_in_names_may_stand_behind_an_underscore(tmp_path):
    head = "f [Hz],Kdyn_-20C [N/mm],Phase_-20C [deg],Kdyn_20C [N/mm],Phase_20C [deg]\n"
    np.testing.assert_allclose(read(tmp_path, f"{head}1,500,5,400,6\n").temperature, [-20, 20])


def test_blocks_beside_each_other_have_their_conditions_above(tmp_path):
    text = ";0.1 mm;;0.5 mm;\nf [Hz];K* [N/mm];delta [deg];K* [N/mm];delta [deg]\n"
    text += "1;500;5;400;6\n10;550;7;450;8\n50;600;8;;\n"
    assert 'across = "amplitude"' in refused(tmp_path, text)
    table = read(tmp_path, text, across="amplitude", amplitude_is="peak")
    np.testing.assert_allclose(table.amplitude, [0.1, 0.1, 0.1, 0.5, 0.5])
    np.testing.assert_allclose(table.stiffness, [500, 550, 600, 400, 450])


WIDE = [
    # A row of conditions below names in merged cells, or above the names; titles above names that are conditions.
    "f [Hz],Kdyn [N/mm],,Phase [deg],\nVorlast [N],0,500,0,500\n",
    "Preload (N),0,500,0,500\nf [Hz],Kdyn [N/mm],Kdyn [N/mm],Phase [deg],Phase [deg]\n",
    ",Kdyn [N/mm],,Phase [deg],\nf [Hz],0 N,500 N,0 N,500 N\n",
    "f [Hz],Kdyn [N/mm],,Phase [deg],\n,0 N,500 N,0 N,500 N\n",
    "f [Hz],Kdyn,,Phase,\nHz,N/mm,,deg,\nPreload [N],0,500,0,500\n",
]


@pytest.mark.parametrize("head", WIDE)
def test_a_wide_table_has_its_conditions_in_a_row(tmp_path, head):
    table = read(tmp_path, head + "1,500,600,5,6\n10,550,650,7,8\n")
    np.testing.assert_allclose(table.preload_force, [0, 0, 500, 500])
    np.testing.assert_allclose(table.stiffness, [500, 550, 600, 650])
    np.testing.assert_allclose(np.degrees(table.loss_angle), [5, 7, 6, 8])


def test_a_row_of_amplitudes_says_what_they_are(tmp_path):
    head = "Amplitude [mm] (0-pk);0,1;0,5;0,1;0,5\nf [Hz];Kdyn [N/mm];Kdyn [N/mm];Phase [deg];Phase [deg]\n"
    table = read(tmp_path, head + "1;500,5;400;5;6\n10;550;450;7;8\n")
    np.testing.assert_allclose(table.amplitude, [0.1, 0.1, 0.5, 0.5])


@pytest.mark.parametrize(
    ("line", "peak"),
    [
        ("Amplitude: 0.2 mm (peak)", 0.2),
        ("Amplitude: +/-0.2 mm", 0.2),
        ("Amplitude = 0.4 mm p-p", 0.2),
        ("Amplitude: 0.4 mm peak-peak", 0.2),
        ("Amplitude (mm p-p),0.4", 0.2),
        ("Amplitude,±0.2,mm", 0.2),
        ("Schwingweg (Spitze-Spitze): 0.4 mm", 0.2),
    ],
)
def test_a_line_above_says_which_amplitude_it_has(tmp_path, line, peak):
    table = read(tmp_path, f"{line}\nf [Hz],Kd [N/mm],Phase [deg]\n1,500,5\n10,550,7\n")
    np.testing.assert_allclose(table.amplitude, peak)
    # A column says it in the brackets of its unit.
    for name in ("A [+/- mm]", "Amplitude (mm, 0-pk)"):
        table = read(tmp_path, f"f [Hz];{name};Kd [N/mm];Phase [deg]\n1;{peak};500;5\n10;{peak};550;7\n")
        np.testing.assert_allclose(table.amplitude, peak)


_DOUBLE = (
    "Amplitude peak-2-peak [mm]", "Amplitude p2p [mm]", "Amplitude peak to valley [mm]", "AmplitudePeakToPeak_mm",
    "Amplitude peak-to-trough [mm]", "Amplitude peak-pk [mm]", "Amplitude Spitze-Tal [mm]", "Schwingweite [mm]",
)  # fmt: skip
_PEAK = (
    "Amplitude half peak-to-peak [mm]", "Amplitude (half p-p) [mm]", "Amplitude (p-p)/2 [mm]",
    "Halbe Doppelamplitude [mm]", "Amplitude 1/2 p-p [mm]", "Amplitude half range [mm]", "Amplitude 0-to-peak [mm]",
)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "factor"),
    [*((name, 0.5) for name in _DOUBLE), *((name, 1.0) for name in _PEAK), ("Amplitude RMS [mm]", 2.0**0.5)],
)
def test_a_column_says_which_amplitude_it_has(tmp_path, name, factor):
    table = read(tmp_path, f"f [Hz];{name};Kd [N/mm];Phase [deg]\n1;0.2;500;5\n10;0.2;550;7\n")
    np.testing.assert_allclose(table.amplitude, 0.2 * factor)


@pytest.mark.parametrize("name", ["Peak amplitude rms [mm]", "Peak amplitude, total travel [mm]"])
def test_a_column_that_says_two_things_of_its_amplitude_is_asked_for(tmp_path, name):
    text = f"f [Hz];{name};Kd [N/mm];Phase [deg]\n1;0.2;500;5\n10;0.2;550;7\n"
    assert "amplitude_is" in refused(tmp_path, text)
    np.testing.assert_allclose(read(tmp_path, text, amplitude_is="rms").amplitude, 0.2 * 2.0**0.5)


@pytest.mark.parametrize("minus", ["-", "\u2212", "\u2013", "minus "])
def test_a_minus_of_any_kind_is_one_in_a_header(tmp_path, minus):
    line = f"Temperature: {minus}20 °C\nf [Hz],Kd [N/mm],Phase [deg]\n1,500,5\n10,550,7\n"
    np.testing.assert_allclose(read(tmp_path, line).temperature, -20.0)
    names = f"f [Hz],Kd {minus}20 °C [N/mm],Phase {minus}20 °C [deg],Kd 20 °C [N/mm],Phase 20 °C [deg]\n"
    table = read(tmp_path, f"{names}1,500,5,400,6\n10,550,7,450,8\n")
    np.testing.assert_allclose(table.temperature, [-20, -20, 20, 20])


def test_another_range_in_the_line_says_nothing_of_the_amplitude(tmp_path):
    line = "Amplitude: 0.2 mm; frequency range 1 to 10 Hz\n"
    assert "amplitude_is" in refused(tmp_path, line + "f [Hz],Kd [N/mm],Phase [deg]\n1,500,5\n10,550,7\n")


def test_a_torsional_stiffness_in_german(tmp_path):
    text = "f [Hz];Drehsteifigkeit [Nm/rad];Verlustwinkel [°]\n1;172;4\n10;180;5\n"
    table = read(tmp_path, text, "torsional", stiffness_is="magnitude")
    np.testing.assert_allclose(table.stiffness, [172e3, 180e3])


def test_a_row_of_units_that_static_recordings_have_not(tmp_path):
    text = "Frequency;Storage stiffness;Damping;Preload\nHz;N/mm;Ns/mm;N\n"
    table = read(tmp_path, text + "1;900;9.5;500\n10;950;1.2;500\n")
    np.testing.assert_allclose(table.loss, 2.0 * np.pi * table.frequency * [9.5, 1.2])
    np.testing.assert_allclose(table.preload_force, 500.0)


@pytest.mark.parametrize("mark", ["", "# "])
def test_blocks_below_each_other_have_their_own_conditions(tmp_path, mark):
    head = "f [Hz],K* [N/mm],delta [deg]\n"
    blocks = [
        f"{mark}Preload: {force} N\n{head}1,{500 + force},5\n10,{550 + force},7\n" for force in (0, 500)
    ]
    table = read(tmp_path, "\n".join(blocks))
    np.testing.assert_allclose(table.preload_force, [0, 0, 500, 500])
    np.testing.assert_allclose(table.stiffness, [500, 550, 1000, 1050])
    # What the case file says holds for all rows.
    np.testing.assert_allclose(read(tmp_path, "\n".join(blocks), preload_force=7.0).preload_force, 7.0)


@pytest.mark.parametrize("line", ["Preload: 500 N", "Preload;500;N", "Static preload 500 N"])
def test_a_line_between_rows_holds_for_the_rows_below_it(tmp_path, line):
    text = f"Preload: 0 N\nf [Hz];K* [N/mm];delta [deg]\n1;500;5\n10;550;7\n{line}\n1;1000;5\n10;1050;7\n"
    table = read(tmp_path, text)
    np.testing.assert_allclose(table.preload_force, [0, 0, 500, 500])
    np.testing.assert_allclose(table.stiffness, [500, 550, 1000, 1050])
    # Another line stays one that does not fit.
    assert "1 field, where the rows before have 3" in refused(tmp_path, text.replace(line, "Sample 2"))


@pytest.mark.parametrize("units", ["", "Hz;N/mm;deg\n"])
@pytest.mark.parametrize("line", ["# Preload: {} N", "Preload: {} N", "Preload;{};N"])
def test_a_line_between_the_names_and_the_first_row_holds_for_the_rows_below_it(tmp_path, line, units):
    head = "f;K*;delta\n" if units else "f [Hz];K* [N/mm];delta [deg]\n"
    blocks = [f"{line.format(force)}\n1;500;5\n10;550;7\n" for force in (500, 800)]
    for text in (head + units + "".join(blocks), f"Preload: 100 N\n{head}{units}{''.join(blocks)}"):
        np.testing.assert_allclose(read(tmp_path, text).preload_force, [500, 500, 800, 800])


def test_a_preload_below_the_rows_of_another_kind_ends_that(tmp_path):
    head, rows_of = "f [Hz];K* [N/mm];delta [deg]\n", "1;500;5\n10;550;7\n"
    text = f"Preload: 500 N\nAmplitude: 0.2 mm p-p\n{head}{rows_of}Preload: 2 mm\nAmplitude: 0.2 mm peak\n{rows_of}"
    table = read(tmp_path, text)
    np.testing.assert_array_equal(table.preload_force, [500, 500, np.nan, np.nan])
    np.testing.assert_array_equal(table.preload, [np.nan, np.nan, 2, 2])
    np.testing.assert_allclose(table.amplitude, [0.1, 0.1, 0.2, 0.2])


def test_an_amplitude_between_the_rows_is_asked_for_like_one_above_them(tmp_path):
    text = "f [Hz];K* [N/mm];delta [deg]\n1;500;5\n10;550;7\nAmplitude: 0.2 mm\n1;400;5\n10;450;7\n"
    assert "amplitude_is" in refused(tmp_path, text)
    np.testing.assert_array_equal(
        read(tmp_path, text, amplitude_is="double").amplitude, [np.nan, np.nan, 0.1, 0.1]
    )


def test_one_file_for_each_condition_is_one_table(tmp_path):
    for force in (0, 500):
        text = f"Preload = {force} N\nfrequency_Hz,stiffness_N_per_mm,loss_angle_deg\n"
        text += f"1,{500 + force},5\n10,{550 + force},6\n"
        (tmp_path / f"r{force}.csv").write_text(text)
    table = read_dynamic(DynamicSource("radial", (tmp_path / "r0.csv", tmp_path / "r500.csv")))
    np.testing.assert_allclose(table.preload_force, [0, 0, 500, 500])
    assert [len(rows) for rows in table.conditions()] == [2, 2]


def test_a_rotation_has_moments_per_angle(tmp_path):
    text = "Frequency [Hz],Rotation amplitude p-p [deg],Kdyn [Nm/deg],loss angle [deg]\n1,2,10,5\n10,2,11,6\n"
    table = read(tmp_path, text, "torsional")
    np.testing.assert_allclose(table.amplitude, np.radians(1.0))
    np.testing.assert_allclose(table.stiffness, np.array([1e4, 1.1e4]) * 180.0 / np.pi)


@pytest.mark.parametrize(("name", "mode", "quantity"), [("E", "uniaxial", "E"), ("G", "simple_shear", "G")])
def test_a_coupon_has_a_modulus(tmp_path, name, mode, quantity):
    text = f"T(C)\tFreq(Hz)\tStrain\t{name}'(Pa)\t{name}''(Pa)\n20\t1\t0.01\t17e6\t2e6\n20\t1\t1\t10e6\t3e6\n"
    asked = refused(tmp_path, text, mode)
    assert 'units = {amplitude = "percent"}' in asked
    assert 'amplitude_is = "peak"' in asked
    table = read(tmp_path, text, mode, units={"amplitude": "percent"}, amplitude_is="peak")
    assert table.quantity == quantity
    np.testing.assert_allclose(table.amplitude, [1e-4, 1e-2])
    np.testing.assert_allclose(table.storage, [17.0, 10.0])


_OF_FREQUENCY, _OF_ANGLE, _OF_STORAGE = (
    {"units": {key: unit}}
    for key, unit in (("frequency", "rad/s"), ("loss_angle", "deg"), ("storage", "N/mm"))
)
ASKED = {
    "frequency": ("frequency,K' [N/mm],K'' [N/mm]", 'units = {frequency = "Hz"} or "rad/s"', _OF_FREQUENCY),
    "small angles": ("f [Hz],K* [N/mm],delta", 'units = {loss_angle = "deg"}', _OF_ANGLE),
    "amplitude": (
        "f [Hz],A [mm],K' [N/mm],K'' [N/mm]",
        'amplitude_is = "peak", "double" or "rms"',
        {"amplitude_is": "double"},
    ),
    "name": (
        "f [Hz],Stiffness [N/mm],delta [deg]",
        'stiffness_is = "magnitude"',
        {"stiffness_is": "storage"},
    ),
    "stiffness": ("f [Hz],K',K'' [N/mm]", 'units = {storage = "N/mm"}', _OF_STORAGE),
}


@pytest.mark.parametrize("case", ASKED)
def test_what_is_not_said_is_asked_with_the_key_that_answers(tmp_path, case):
    head, key, answer = ASKED[case]
    values = {3: "1,50,1\n10,55,1.2\n", 4: "1,0.1,500,50\n10,0.1,550,60\n"}[head.count(",") + 1]
    assert key in refused(tmp_path, f"{head}\n{values}")
    assert len(read(tmp_path, f"{head}\n{values}", **answer)) == 2


def test_a_modulus_of_a_coupon_without_a_symbol_is_asked_for(tmp_path):
    text = "frequency_Hz,storage_MPa,loss_MPa\n1,5,1\n10,6,1\n"
    assert 'quantity = "E" or "G"' in refused(tmp_path, text, "uniaxial")
    assert read(tmp_path, text, "uniaxial", quantity="E").quantity == "E"


def test_degrees_are_recognised_by_their_size(tmp_path):
    table = read(tmp_path, "f [Hz],K* [N/mm],delta\n1,500,5\n10,550,7\n")
    np.testing.assert_allclose(table.loss_angle, np.radians([5.0, 7.0]))
    assert "in degrees" in table.remarks[0]


def test_a_stiffness_is_named_by_the_others(tmp_path):
    head = "f [Hz],Stiffness [N/mm],K'' [N/mm],delta [deg]\n"
    table = read(tmp_path, head + rows(FREQUENCY, STIFFNESS, LOSS, np.degrees(ANGLE)))
    np.testing.assert_allclose(table.storage, STORAGE, rtol=1e-4)
    big = np.radians([20.0, 25.0, 30.0])
    table = read(tmp_path, head + rows(FREQUENCY, STORAGE, STORAGE * np.tan(big), np.degrees(big)))
    np.testing.assert_allclose(table.storage, STORAGE, rtol=1e-4)


CONTRADICTIONS = {
    "complement": (STORAGE, LOSS, 90.0 - np.degrees(ANGLE), 'loss_angle_is = "complement"'),
    "radians": (STORAGE, LOSS, ANGLE, 'units = {loss_angle = "rad"}'),
    "exchanged": (LOSS, STORAGE, np.degrees(ANGLE), "K' and K'' are exchanged"),
}


@pytest.mark.parametrize("case", CONTRADICTIONS)
def test_what_contradicts_itself_is_named_with_the_remedy(tmp_path, case):
    storage, loss, angle, remedy = CONTRADICTIONS[case]
    text = "f [Hz],K' [N/mm],K'' [N/mm],delta [deg]\n" + rows(FREQUENCY, storage, loss, angle)
    assert remedy in refused(tmp_path, text)
    answers = {
        "complement": {"loss_angle_is": "complement"},
        "radians": {"units": {"loss_angle": "rad"}},
        "exchanged": {"columns": {"storage": 3, "loss": 2}},
    }
    np.testing.assert_allclose(read(tmp_path, text, **answers[case]).storage, STORAGE, rtol=1e-4)


SEVERAL = {
    "direction": ("axial", "radial"),
    "Specimen No": ("1", "2"),
    "Channel": ("Z", "X"),
    "Mode": ("axial", "radial"),
    "Test direction": ("axial", "radial"),
    "Load direction": ("axial", "radial"),
    "Run": ("a", "b"),
}


@pytest.mark.parametrize("name", SEVERAL)
def test_rows_of_several_specimens_are_no_table_until_one_is_chosen(tmp_path, name):
    blocks = [
        f"{label};1;{k};5\n{label};10;{k + 50};7\n"
        for label, k in zip(SEVERAL[name], (500, 900), strict=True)
    ]
    text = f"{name};f [Hz];K* [N/mm];delta [deg]\n{''.join(blocks)}"
    key = f'"{name}"' if " " in name else name
    assert f"rows = {{{key} = " in refused(tmp_path, text)
    table = read(tmp_path, text, rows={name: SEVERAL[name][1]})
    np.testing.assert_allclose(table.stiffness, [900, 950])


def test_runs_that_are_counted_are_one_table(tmp_path):
    text = "Run;f [Hz];K* [N/mm];delta [deg]\n1;1;500;5\n1;10;550;7\n2;1;501;5\n2;10;551;7\n"
    assert len(read(tmp_path, text)) == 4


@pytest.mark.parametrize("name", ["Status", "Note", "Remark"])
def test_a_status_of_repeated_rows_tells_none_apart(tmp_path, name):
    head = f"{name};f [Hz];K* [N/mm];delta [deg]\n"
    assert len(read(tmp_path, head + "ok;1;500;5\nok;10;550;7\nretry;1;501;5\nok;10;551;7\n")) == 4


@pytest.mark.parametrize("name", ["Run", "Note", "Mode", "Part", "Channel"])
def test_a_text_beside_rows_of_other_conditions_tells_none_apart(tmp_path, name):
    head = f"{name};T [°C];f [Hz];K* [N/mm];delta [deg]\n"
    text = head + "a;0;1;500;5\na;0;10;550;7\nb;40;1;400;5\nb;40;10;450;7\n"
    assert len(read(tmp_path, text)) == 4


def test_merged_cells_of_a_condition_hold_downwards(tmp_path):
    head = "direction;Preload [N];f [Hz];K* [N/mm];delta [deg]\n"
    text = head + "axial;0;1;500;5\n;;10;550;7\n;500;1;600;5\n;;10;650;7\n"
    table = read(tmp_path, text)
    np.testing.assert_allclose(table.preload_force, [0, 0, 500, 500])
    assert any("Preload" in remark and "2 empty fields" in remark for remark in table.remarks)
    # Every other amplitude is empty: one of a small vibration, or missing.
    amplitudes = "A peak [mm];f [Hz];K* [N/mm];delta [deg]\n0.1;1;500;5\n;10;550;7\n0.2;1;600;5\n;10;650;7\n"
    assert "a field is empty" in refused(tmp_path, amplitudes)
    merged = amplitudes + ";50;700;8\n"
    np.testing.assert_allclose(read(tmp_path, merged).amplitude, [0.1, 0.1, 0.2, 0.2, 0.2])
    # A field that is missing among others is none of merged cells, and neither is a measured one.
    assert "a field is empty" in refused(tmp_path, head + "a;0;1;500;5\na;;10;550;7\na;500;1;600;5\n")
    assert "a field is empty" in refused(tmp_path, head + "a;0;1;500;5\na;0;10;;7\na;0;20;;7\n")


def test_rows_of_delimiters_and_conditions_without_values_are_empty(tmp_path):
    text = "f [Hz];amplitude [mm];K* [N/mm];delta [deg]\n1;;500;5\n;;;\n10;;550;7\n;;;\n"
    table = read(tmp_path, text)
    np.testing.assert_allclose(table.stiffness, [500, 550])
    assert np.isnan(table.amplitude).all()
    # A column that the case file names must have the values.
    assert "a field is empty" in refused(tmp_path, text, columns={"amplitude": 2}, amplitude_is="peak")


@pytest.mark.parametrize(
    ("names", "missing"),
    [
        ("f [Hz];1/Kdyn [N/mm];delta [deg]", "need two of"),
        ("f [Hz];log K* [N/mm];delta [deg]", "need two of"),
        ("f [Hz];log10(Kdyn) [N/mm];delta [deg]", "need two of"),
        ("f [Hz];Kdyn [N/mm];sin delta [deg]", "need two of"),
        ("log10(Frequency) [Hz];Kdyn [N/mm];delta [deg]", "no column of a frequency"),
        ("f [Hz];Kdyn [N/mm];damping factor [-]", "columns = {tan_delta = 3}"),
    ],
)
def test_a_function_of_a_quantity_is_none_and_a_doubtful_factor_is_asked_for(tmp_path, names, missing):
    text = names + "\n1;2.7;0.05\n10;2.8;0.06\n"
    assert missing in refused(tmp_path, text)
    if "damping" in names:
        table = read(tmp_path, text, columns={"tan_delta": 3})
        np.testing.assert_allclose(table.loss / table.storage, [0.05, 0.06])


@pytest.mark.parametrize(
    "pair", ["Elastic Rate;Viscous Rate", "Re K*;Im K*", "Re(K);Im(K)", "K* real;K* imag"]
)
def test_the_two_parts_of_a_complex_stiffness_by_their_names(tmp_path, pair):
    first, second = pair.split(";")
    text = f"Frequency [cps];{first} [N/mm];{second} [N/mm]\n1;500;50\n10;550;60\n"
    table = read(tmp_path, text)
    np.testing.assert_allclose([*table.storage, *table.loss], [500, 550, 50, 60])


@pytest.mark.parametrize(("factor", "remedy"), [(2.0 * np.pi, '"rad/s"'), (1e3, '"N s/m"')])
def test_a_damping_that_contradicts_the_others_is_named(tmp_path, factor, remedy):
    damping = factor * LOSS / (2.0 * np.pi * FREQUENCY)
    text = "f [Hz],|K| [N/mm],c' [N/mm],c'' [N/mm],damping [N s/mm]\n" + rows(
        FREQUENCY, STIFFNESS, STORAGE, LOSS, damping
    )
    assert remedy in refused(tmp_path, text)


def test_a_modulus_is_not_the_stiffness_of_a_bushing(tmp_path):
    assert "[[coupons]]" in refused(tmp_path, "f [Hz],E* [MPa],delta [deg]\n1,5,5\n2,5,6\n")


def test_a_single_contradiction_is_found_in_its_row(tmp_path):
    angle = np.degrees(ANGLE) + np.array([0.0, 4.0, 0.0])
    text = "f [Hz],K' [N/mm],K'' [N/mm],delta [deg]\n" + rows(FREQUENCY, STORAGE, LOSS, angle)
    said = refused(tmp_path, text)
    assert "table.csv:3:" in said
    assert "11, and storage and loss give 7" in said


def test_ninety_degrees_minus_the_angle_is_asked_for_where_only_the_magnitude_is_given(tmp_path):
    text = "f [Hz],K* [N/mm],delta [deg]\n" + rows(FREQUENCY, STIFFNESS, 90.0 - np.degrees(ANGLE))
    assert 'loss_angle_is = "complement"' in refused(tmp_path, text)
    np.testing.assert_allclose(read(tmp_path, text, loss_angle_is="complement").loss, LOSS, rtol=1e-4)
    assert (read(tmp_path, text, loss_angle_is="loss").loss_angle > 1.4).all()


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("0,0.1,500,5", "a frequency of 0 Hz"),
        ("-1,0.1,500,5", "a frequency of -1 Hz"),
        ("1,0,500,5", "an amplitude of 0"),
        ("1,0.1,-500,5", "|K*| = -500 is not possible"),
        ("1,0.1,500,95", "a loss angle of 95 degrees"),
        ("1,0.1,500,-95", "only -90 to 90 are possible"),
        ("1,0.1,500,x", "is not a number"),
    ],
)
def test_impossible_rows_are_refused_with_their_line(tmp_path, row, said):
    text = f"frequency_Hz,amplitude_mm,stiffness_N_per_mm,loss_angle_deg\n2,0.1,500,5\n{row}\n5,0.1,520,5\n"
    message = refused(tmp_path, text, amplitude_is="peak")
    assert said in message
    assert "table.csv:3" in message


@pytest.mark.parametrize(
    ("quantity", "values"),
    [("delta [deg]", (5, 1, -2)), ("delta [deg]", (5, 1, 358)), ("K'' [N/mm]", (40, 9, -16))],
)
def test_a_loss_below_zero_is_read_in_some_rows_and_refused_in_most(tmp_path, quantity, values):
    """A force that is logged late has it at high frequencies; throughout, the column has the other sign."""
    stiffness = "K* [N/mm]" if "deg" in quantity else "K' [N/mm]"

    def text(sign):
        signed = [
            value if value > 180 and sign > 0 else sign * (value - 360 * (value > 180)) for value in values
        ]
        lines = (f"{f},500,{value}" for f, value in zip((1, 10, 100), signed, strict=True))
        return "\n".join([f"f [Hz],{stiffness},{quantity}", *lines])

    table = read(tmp_path, text(1))
    np.testing.assert_array_equal(np.sign(table.loss), [1, 1, -1])
    assert any("negative in 1 of 3 rows" in remark and "time_lag" in remark for remark in table.remarks)
    assert "change the sign of the column" in refused(tmp_path, text(-1))


def test_a_frequency_beyond_any_test_of_a_bushing_is_refused(tmp_path):
    rows_of = "{} [Hz],{} [{}],delta [deg]\n1,500,5\n1e6,550,7\n"
    assert "beyond any dynamic test" in refused(tmp_path, rows_of.format("f", "K*", "N/mm"))
    # A master curve of a coupon reaches any frequency.
    assert read(tmp_path, rows_of.format("f", "G*", "MPa"), "simple_shear").frequency[-1] == 1e6


def test_a_negative_storage_stiffness_names_the_inertia(tmp_path):
    said = refused(tmp_path, "f [Hz],K' [N/mm],K'' [N/mm]\n1,500,50\n900,-20,60\n")
    assert "K' = -20 is not possible" in said
    assert "inertia" in said


def test_one_measured_column_is_not_enough(tmp_path):
    assert "need two of |K*|, K', K''" in refused(
        tmp_path, "frequency_Hz,stiffness_N_per_mm\n1,500\n10,520\n"
    )


def test_a_table_whose_only_stiffness_is_chosen_as_a_condition_has_none(tmp_path):
    text = "frequency_Hz,Kdyn [N/mm],Other\n1,500,1\n10,520,2\n"
    assert "need two of |K*|" in refused(tmp_path, text, columns={"temperature": "Kdyn"})


def test_a_set_value_is_not_the_measured_one(tmp_path):
    text = "f [Hz],Amplitude target peak [mm],Amplitude actual peak [mm],K' [N/mm],K'' [N/mm]\n"
    text += "1,0.1,0.09,500,50\n2,0.1,0.09,500,50\n"
    np.testing.assert_allclose(read(tmp_path, text).amplitude, 0.09)


def test_two_columns_of_one_quantity_are_asked_for(tmp_path):
    text = "f [Hz],K' [N/mm],K' corrected [N/mm],K'' [N/mm]\n1,500,510,50\n10,520,530,60\n"
    assert "columns = {storage = ...}" in refused(tmp_path, text)
    np.testing.assert_allclose(read(tmp_path, text, columns={"storage": 3}).storage, [510, 530])


@pytest.mark.parametrize(
    ("name", "quantity", "unit", "peak"),
    [
        ("LossAngle [deg]", "loss_angle", "angle", ""),
        ("StorageModulus [MPa]", "storage", "stress", ""),
        ("Storage Modulus (E') [MPa]", "storage", "stress", ""),
        ("Damping N s/mm", "damping", "damping", ""),
        ("Amplitude_mm_pp", "amplitude", "length", "double"),
        ("Amplitude mm (peak)", "amplitude", "length", "peak"),
        ("Kdyn N/mm filtered", "stiffness", "stiffness", ""),
        ("K(dyn) [N/mm]", "stiffness", "stiffness", ""),
        ("频率（Hz）", "frequency", "frequency", ""),
        ("Oscillation strain %", "amplitude", "strain", ""),
        # A logarithm has no Hz, and a function stands directly before its quantity.
        ("log freq [Hz]", "frequency", "frequency", ""),
        ("Inverse FFT frequency [Hz]", "frequency", "frequency", ""),
        ("log freq", "", None, ""),
        ("log10(Frequency) [Hz]", "", "frequency", ""),
        ("log(freq) [Hz]", "", "frequency", ""),
        ("log10 freq [Hz]", "", "frequency", ""),
        ("log shear modulus [MPa]", "", "stress", ""),
        ("1/Kdyn [N/mm]", "", "stiffness", ""),
        # The force of a rig is no frequency, although f is the symbol of one; "dyn" is no unit.
        ("F_dyn [N]", "", "force", ""),
    ],
)
def test_names_are_split_as_those_of_recordings(name, quantity, unit, peak):
    column = meaning(name)
    assert (column.quantity, column.unit and column.unit.measured, column.peak) == (quantity, unit, peak)
