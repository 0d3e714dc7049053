"""Several groups, sheets and rasters in a file, and columns that are found by unit or occur twice."""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import Recording, read_recording
from bushcli.recording.source import Source

pytestmark = pytest.mark.usefixtures("in_this_process")

N = 120
TIME = np.arange(N) * 0.1
Q = 3.0 * np.sin(0.5 * TIME)
F = 90.0 * Q


def read(path: Path, mode: str = "axial", **keys: object) -> Recording:
    return read_recording(Source(mode, path, **keys))  # type: ignore[arg-type]


def mdf(path: Path, *groups: list[tuple[str, str, np.ndarray, np.ndarray]]) -> Path:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        for i, group in enumerate(groups):
            signals = [
                asammdf.Signal(samples=values, timestamps=time, name=name, unit=unit)
                for name, unit, time, values in group
            ]
            file.append(signals, acq_name=f"raster {i + 1}")
        file.save(path, overwrite=True)
    return path


def test_groups_of_mdf_with_the_same_stamps_are_joined(tmp_path):
    path = mdf(
        tmp_path / "a.mf4", [("Weg", "mm", TIME, Q)], [("Kraft", "N", TIME, F)], [("T_Luft", "°C", TIME, Q)]
    )
    recording = read(path)
    np.testing.assert_allclose(recording.displacement, Q, atol=1e-12)
    np.testing.assert_allclose(recording.force, F, atol=1e-12)
    np.testing.assert_allclose(recording.time, TIME, atol=1e-12)


def slow(q: np.ndarray = Q, time: np.ndarray = TIME) -> list[tuple[str, str, np.ndarray, np.ndarray]]:
    return [("Weg", "mm", time, q)]


def said(recording: Recording) -> list[str]:
    return [repair.text for repair in recording.repairs if repair.kind == "columns"]


def test_rasters_of_mdf_are_brought_to_the_stamps_of_the_force(tmp_path):
    fast = 0.013 + np.arange(900) * 0.0125
    force = 90.0 * np.interp(fast, TIME, Q)
    path = mdf(
        tmp_path / "a.mf4", slow(), [("T_Luft", "°C", TIME[::3], Q[::3])], [("Kraft", "N", fast, force)]
    )
    recording = read(path)
    np.testing.assert_allclose(recording.time, fast, atol=1e-12)
    np.testing.assert_allclose(recording.force, force, atol=1e-12)  # unchanged
    np.testing.assert_allclose(recording.displacement, force / 90.0, atol=1e-12)
    (text,) = said(recording)
    assert 'group "raster 1" every 0.1 s, is interpolated at the 900 time stamps' in text
    assert 'group "raster 3" every 0.0125 s' in text


def test_stamps_at_which_the_travel_is_not_known_are_left_out_with_their_count(tmp_path):
    fast = -1.005 + np.arange(1400) * 0.01
    force = 90.0 * np.interp(fast, TIME, Q)
    # No travel for 3 s of motion, nor before its first and after its last stamp.
    there = (TIME < 4.0) | (TIME > 7.0)
    path = mdf(tmp_path / "a.mf4", slow(Q[there], TIME[there]), [("Kraft", "N", fast, force)])
    recording = read(path)
    known = (fast >= 0.0) & (fast <= TIME[-1]) & ~((fast > 3.9) & (fast < 7.1))
    np.testing.assert_allclose(recording.time, fast[known], atol=1e-12)
    assert f"; {np.count_nonzero(~known)} of them, before" in said(recording)[0]
    assert "in its 1 gap" in said(recording)[0]


def test_a_travel_that_is_logged_only_when_it_changes_has_no_gap(tmp_path):
    q = np.concatenate([np.linspace(0.0, 3.0, 40), np.full(60, 3.0), np.linspace(3.0, 0.0, 20)])
    changed = np.concatenate([[True], np.diff(q) != 0.0]) | (np.arange(N) == 100)
    path = mdf(
        tmp_path / "a.mf4", slow(q[changed], TIME[changed]), [("Kraft", "N", TIME[::2], 90.0 * q[::2])]
    )
    np.testing.assert_allclose(read(path).displacement, q[::2], atol=1e-12)


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        ([slow(), [("Kraft", "N", TIME + 100.0, F)]], r'"raster 2".*"raster 1".*do not overlap in time'),
        (
            [slow(), slow(Q[::2], TIME[::2]), [("Kraft", "N", TIME + 0.05, F)]],
            r'displacement could be in "raster 1", "raster 2" \(name the channel .*columns = {displacement',
        ),
        (
            [slow(Q, np.where(TIME > 5.0, TIME - 2.0, TIME)), [("Kraft", "N", TIME + 0.05, F)]],
            r"raster 1.*the time runs backwards, 3.1 s follows 5 s",
        ),
    ],
)
def test_rasters_that_cannot_be_brought_together_are_refused(tmp_path, groups, message):
    with pytest.raises(RecordingError, match=message):
        read(mdf(tmp_path / "a.mf4", *groups))


def test_a_named_channel_decides_among_rasters(tmp_path):
    other = [("Traverse", "mm", TIME[::2], 2.0 * Q[::2])]
    path = mdf(tmp_path / "a.mf4", slow(), other, [("Kraft", "N", TIME + 0.05, F)])
    found = read(path, columns={"displacement": "Traverse"})
    np.testing.assert_allclose(found.displacement, np.interp(found.time, TIME[::2], 2.0 * Q[::2]), atol=1e-12)


def test_groups_without_a_common_clock_are_refused_by_name(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        for name, column, step in (("A", "Weg_mm", 1), ("B", "Kraft_N", 2)):
            file[f"{name}/time_s"], file[f"{name}/{column}"] = TIME[::step], Q[::step]
    with pytest.raises(RecordingError, match=r"different time stamps.*one common raster"):
        read(path)


def test_the_only_group_with_the_columns_is_taken(tmp_path):
    path = mdf(
        tmp_path / "a.mf4",
        [("T_Luft", "°C", TIME[::7], Q[::7])],
        [("Weg", "mm", TIME, Q), ("Kraft", "N", TIME, F)],
    )
    np.testing.assert_allclose(read(path).force, F, atol=1e-12)


def test_several_groups_with_the_columns_need_a_choice(tmp_path):
    one = [("Weg", "mm", TIME, Q), ("Kraft", "N", TIME, F)]
    path = mdf(tmp_path / "a.mf4", one, [("Weg", "mm", TIME, 2 * Q), ("Kraft", "N", TIME, 2 * F)])
    with pytest.raises(
        RecordingError, match=r'2 sheets or groups .*"raster 1", "raster 2" \(choose in the case file: group'
    ):
        read(path)
    np.testing.assert_allclose(read(path, group="Raster 2").force, 2 * F, atol=1e-12)
    np.testing.assert_allclose(read(path, group=1).force, F, atol=1e-12)
    with pytest.raises(RecordingError, match='no sheet or group "raster 3"; did you mean "raster'):
        read(path, group="raster 3")
    with pytest.raises(RecordingError, match="has no group 7"):
        read(path, group=7)


def test_the_columns_are_named_where_none_suits(tmp_path):
    other = [("T_Luft", "°C", TIME, Q), ("p_Luft", "mbar", TIME, F)]
    path = mdf(tmp_path / "a.mf4", other, [("U_Batt", "V", TIME[::2], Q[::2])])
    with pytest.raises(RecordingError, match=r'"raster 1" has time, T_Luft, p_Luft \(choose .*columns'):
        read(path)


def test_samples_that_mdf_marks_as_invalid_are_refused_with_their_place(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    invalid = np.zeros(N, dtype=bool)
    invalid[5:8] = True
    with asammdf.MDF(version="4.10") as file:
        file.append(
            [
                asammdf.Signal(samples=Q, timestamps=TIME, name="Weg", unit="mm"),
                asammdf.Signal(samples=F, timestamps=TIME, name="Kraft", unit="N", invalidation_bits=invalid),
            ]
        )
        file.save(tmp_path / "a.mf4", overwrite=True)
    with pytest.raises(
        RecordingError, match=r"sample 6: .*Kraft.* is not a finite number, and likewise in 2 more"
    ):
        read(tmp_path / "a.mf4")


def test_scaled_integers_of_mdf_are_in_their_unit(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    counts = np.round(F * 10).astype(np.int16)
    with asammdf.MDF(version="4.10") as file:
        file.append(
            [
                asammdf.Signal(samples=Q, timestamps=TIME, name="Weg", unit="mm"),
                asammdf.Signal(
                    samples=counts, timestamps=TIME, name="Kraft", unit="N", conversion={"a": 0.1, "b": 0.0}
                ),
            ]
        )
        file.save(tmp_path / "a.mf4", overwrite=True)
    np.testing.assert_allclose(read(tmp_path / "a.mf4").force, F, atol=0.051)


def workbook(path: Path, **sheets: list[tuple[object, ...]]) -> Path:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path


ROWS = [("Zeit [s]", "Weg [mm]", "Kraft [N]"), *zip(TIME.tolist(), Q.tolist(), F.tolist(), strict=True)]


def test_a_sheet_of_remarks_beside_the_data_does_no_harm(tmp_path):
    notes = [("Prüfer", "Mustermann"), ("Probe", "B 12"), ("Temperatur", 23)]
    table = [("Probe", "Höhe"), (1, 12.5), (2, 12.4)]
    path = workbook(tmp_path / "a.xlsx", Deckblatt=notes, Ergebnisse=table, Werte=ROWS)
    np.testing.assert_allclose(read(path).force, F, rtol=1e-14)


def test_sheets_are_chosen_by_name(tmp_path):
    path = workbook(tmp_path / "a.xlsx", Probe1=ROWS, Probe2=ROWS)
    with pytest.raises(RecordingError, match='"Probe1", "Probe2"'):
        read(path)
    assert len(read(path, group="Probe2").force) == N


def test_clock_times_of_a_workbook_are_seconds(tmp_path):
    start = datetime.datetime(2026, 3, 1, 12, 0, 0)
    rows = [("Zeit", "Weg [mm]", "Kraft [N]")]
    rows += [
        (start + datetime.timedelta(seconds=int(i)), q, f)
        for i, (q, f) in enumerate(zip(Q.tolist(), F.tolist(), strict=True))
    ]
    recording = read(workbook(tmp_path / "a.xlsx", Werte=rows))
    np.testing.assert_allclose(recording.time, np.arange(N), atol=1e-6)


def test_texts_with_a_decimal_comma_in_a_workbook(tmp_path):
    rows = [
        ("Weg [mm]", "Kraft [N]"),
        *((f"{q:.4f}".replace(".", ","), f"{f:.4f}".replace(".", ",")) for q, f in zip(Q, F, strict=True)),
    ]
    np.testing.assert_allclose(read(workbook(tmp_path / "a.xlsx", Werte=rows)).force, F, atol=1e-4)


def test_a_missing_cell_is_refused_with_its_row(tmp_path):
    rows = [*ROWS[:10], (0.9, 1.0, None), *ROWS[11:]]
    with pytest.raises(RecordingError, match=r"a.xlsx:11: .*"):
        read(workbook(tmp_path / "a.xlsx", Werte=rows))


def test_tdms_waveforms_get_their_time(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        wave = {"wf_increment": 0.1, "wf_start_offset": 0.0, "wf_samples": N}
        file.write_segment(
            [
                nptdms.ChannelObject("g", "Position", Q, properties={**wave, "unit_string": "mm"}),
                nptdms.ChannelObject("g", "Load", F, properties={**wave, "unit_string": "N"}),
            ]
        )
    recording = read(tmp_path / "a.tdms")
    np.testing.assert_allclose(recording.time, TIME, atol=1e-12)
    np.testing.assert_allclose(recording.displacement, Q, atol=1e-12)


def test_hdf5_matrix_and_records(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        data = file.create_dataset("werte", data=np.column_stack([TIME, Q, F]).T)
        data.attrs["columns"], data.attrs["units"] = ["time", "stroke", "load"], ["s", "mm", "N"]
    np.testing.assert_allclose(read(tmp_path / "a.h5").force, F, atol=1e-12)
    with h5py.File(tmp_path / "b.h5", "w") as file:
        kinds = [("time", "f8"), ("stroke", "f8"), ("load", "f4")]
        file["run/table"] = np.array(list(zip(TIME, Q, F, strict=True)), dtype=kinds)
    np.testing.assert_allclose(read(tmp_path / "b.h5").force, F, rtol=1e-6)


def test_parquet_of_pandas_with_units_and_dates(tmp_path):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    stamps = pandas.to_datetime("2026-03-01") + pandas.to_timedelta(TIME, unit="s")
    frame = pandas.DataFrame({"Zeit": stamps, "Weg": Q / 10, "Kraft": F / 1e3})
    frame.attrs["units"] = {"Weg": "cm", "Kraft": "kN"}
    frame.to_parquet(tmp_path / "a.parquet")
    recording = read(tmp_path / "a.parquet")
    np.testing.assert_allclose(recording.time, TIME, atol=1e-6)
    np.testing.assert_allclose(recording.displacement, Q, atol=1e-12)
    np.testing.assert_allclose(recording.force, F, atol=1e-9)


# -- columns by unit, and twice ----------------------------------------------------------------------------------------


def csv(path: Path, head: str, *columns: np.ndarray) -> Path:
    rows = "\n".join(",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True))
    path.write_text(f"{head}\n{rows}\n", encoding="utf-8")
    return path


def test_a_channel_without_a_telling_name_is_taken_by_its_unit_and_said(tmp_path):
    path = csv(tmp_path / "a.csv", "Zeit [s],AI 0 [mm],AI 1 [kN]", TIME, Q, F / 1e3)
    recording = read(path)
    np.testing.assert_allclose(recording.force, F, atol=1e-5)
    said = [repair.text for repair in recording.repairs]
    assert said == [
        "column 2 (AI 0 [mm]) is read as the displacement because of its unit",
        "column 3 (AI 1 [kN]) is read as the force because of its unit",
    ]


def test_two_channels_without_telling_names_are_refused(tmp_path):
    path = csv(tmp_path / "a.csv", "AI 0 [mm],AI 1 [N],AI 2 [N]", Q, F, 2 * F)
    with pytest.raises(RecordingError, match=r"column 2 .* and column 3 .* could each be the force"):
        read(path)


@pytest.mark.parametrize("name", ["Sollweg [mm]", "Displacement error [mm]", "Max [mm]", "Temperatur [°C]"])
def test_what_is_no_measured_travel_is_not_taken_by_its_unit(tmp_path, name):
    with pytest.raises(RecordingError, match="no column displacement_mm"):
        read(csv(tmp_path / "a.csv", f"{name},Kraft [N]", Q, F))


def test_identical_columns_are_one_and_said(tmp_path):
    path = csv(tmp_path / "a.csv", "Zeit [s],Weg [mm],Kraft [N],Kraft [N]", TIME, Q, F, F)
    recording = read(path)
    assert [repair.text for repair in recording.repairs] == [
        "column 3 (Kraft [N]) and column 4 (Kraft [N]) are identical; one of them is used"
    ]
    assert len(read(path, columns={"force": "Kraft"}).force) == N


def test_columns_that_differ_in_one_sample_are_two(tmp_path):
    other = F.copy()
    other[7] += 1.0
    path = csv(tmp_path / "a.csv", "Zeit [s],Weg [mm],Kraft [N],Kraft [N]", TIME, Q, F, other)
    with pytest.raises(RecordingError, match="could each be the force"):
        read(path)


def test_identical_numbers_in_different_units_are_two(tmp_path):
    path = csv(tmp_path / "a.csv", "Weg [mm],Kraft [N],Kraft [kN]", Q, F, F)
    with pytest.raises(RecordingError, match="could each be the force"):
        read(path)


@pytest.mark.parametrize(
    "head",
    [
        "Prüfzeit [s],Traverse [mm],Standardkraft [N]",
        "Zeit [s],Traversenweg [mm],Kraft Ist [N]",
        "Testzeit [s],Standardweg [mm],Prüfkraft [N]",
        "Time [s],Position [mm],Load [N]",
        "时间[s],位移[mm],试验力[N]",
        "T[s],Kolbenweg[mm],F[N]",
    ],
)
def test_names_of_machines(tmp_path, head):
    recording = read(csv(tmp_path / "a.csv", head, TIME, Q, F))
    np.testing.assert_allclose(recording.force, F, atol=1e-6)
    assert recording.time is not None


def test_the_better_name_wins(tmp_path):
    path = csv(
        tmp_path / "a.csv", "Zeit [s],Traverse [mm],Standardweg [mm],Standardkraft [N]", TIME, 5 * Q, Q, F
    )
    np.testing.assert_allclose(read(path).displacement, Q, atol=1e-7)
