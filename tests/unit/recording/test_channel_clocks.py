"""Channels of one file with clocks of their own: compared for every format, interpolated and said, or refused.

The specimen is a spring of 100 N/mm without loss: a force read beside a travel of another instant has another
stiffness, and a loop. Linear interpolation of the travel of 0.02 s is within 2e-4 mm of its sine.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import Recording, read_recording
from bushcli.recording.read import read_program
from bushcli.recording.source import Source

pytestmark = pytest.mark.usefixtures("in_this_process")

N = 600
STEP = 0.02
TIME = STEP * np.arange(N)
DAY = np.datetime64("2026-03-01T10:00:00.000000")


def travel(time: np.ndarray) -> np.ndarray:
    """Return a travel of 2 mm, mm, at times in s."""
    return 2.0 * np.sin(1.3 * np.asarray(time))


def force(time: np.ndarray) -> np.ndarray:
    return 100.0 * travel(time)


def read(path: Path, **keys: object) -> Recording:
    return read_recording(Source("axial", path, **keys))  # type: ignore[arg-type]


def said(recording: Recording) -> str:
    return "; ".join(repair.text for repair in recording.repairs if repair.kind == "columns")


def assert_spring(recording: Recording, samples: int, interpolated: bool = True) -> None:
    assert len(recording.force) == samples
    np.testing.assert_allclose(recording.force, 100.0 * recording.displacement, atol=0.02)
    assert ("is interpolated at" in said(recording)) == interpolated
    assert recording.time is not None


# -- TDMS --------------------------------------------------------------------------------------------------------------


def tdms(folder: Path, *channels: tuple[str, str, np.ndarray, dict[str, object]]) -> Path:
    """Write channels: group/name, unit, values, and properties."""
    nptdms = pytest.importorskip("nptdms")
    path = folder / "run.tdms"
    with nptdms.TdmsWriter(path) as file:
        file.write_segment(
            [
                nptdms.ChannelObject(*name.split("/"), values, properties={**wave, "unit_string": unit})
                for name, unit, values, wave in channels
            ]
        )
    return path


def wave(step: float = STEP, start: float | None = 0.0, offset: float | None = None) -> dict[str, object]:
    """Return properties of a waveform whose clock starts at a time in s."""
    found: dict[str, object] = {"wf_increment": step}
    if start is not None:
        found["wf_start_time"] = DAY + np.timedelta64(round(1e6 * start), "us")
    return found if offset is None else found | {"wf_start_offset": offset}


@pytest.mark.parametrize(
    ("clock", "begin", "step", "samples"),
    [
        (wave(start=1.0), 1.0, STEP, 550),  # 50 samples after the end of the travel
        (wave(start=-1.0), -1.0, STEP, 550),
        (wave(offset=0.5), 0.5, STEP, 575),
        (wave(start=0.25, offset=0.255), 0.505, STEP, 574),
        (wave(step=0.01), 0.0, 0.01, 600),
        (wave(step=0.03), 0.0, 0.03, 400),
        (wave() | {"wf_increment": 10.0, "wf_xunit_string": "ms"}, 0.0, 0.01, 600),
    ],
)
@pytest.mark.parametrize("group", ["Rig", "Load cell"])
def test_waveforms_with_another_clock_are_interpolated(tmp_path, clock, begin, step, samples, group):
    time = begin + step * np.arange(N)
    path = tdms(
        tmp_path, ("Rig/Position", "mm", travel(TIME), wave()), (f"{group}/Load", "N", force(time), clock)
    )
    assert_spring(read(path), samples)


def test_waveforms_of_other_lengths_are_interpolated(tmp_path):
    slow = 0.05 * np.arange(200)
    path = tdms(
        tmp_path,
        ("Rig/Position", "mm", travel(TIME), wave()),
        ("Rig/Load", "N", force(slow), wave(step=0.05)),
        ("Rig/Temperature", "degC", slow, wave(step=0.05)),
    )
    assert_spring(read(path), 200)
    assert_spring(read(path, group="rig"), 200)  # the group, although its channels have two clocks


@pytest.mark.parametrize(
    ("wave_or_time", "values"),
    [
        (wave(), None),
        ({}, TIME),
        ({}, TIME + 1e-5 * np.sin(np.arange(N))),  # rounded
        ({}, TIME.astype(np.float32)),
        ({}, DAY + np.rint(1e6 * TIME).astype("m8[us]")),
    ],
)
def test_equal_stamps_of_two_groups_are_one_clock(tmp_path, wave_or_time, values):
    channels = [
        ("A/Position", "mm", travel(TIME), wave(start=None if values is None or values[0] == 0 else 0.0)),
        ("B/Load", "N", force(TIME), wave_or_time),
    ]
    if values is None:
        channels[0] = ("A/Position", "mm", travel(TIME), wave())
    else:
        channels.append(("B/Time", "" if values.dtype.kind == "M" else "s", values, {}))
    assert_spring(read(tdms(tmp_path, *channels)), N, interpolated=False)


@pytest.mark.parametrize("clock", [{}, wave(step=0.0)])
def test_a_channel_without_an_interval_has_the_clock_of_its_group_and_it_is_said(tmp_path, clock):
    path = tdms(tmp_path, ("Rig/Position", "mm", travel(TIME), wave()), ("Rig/Load", "N", force(TIME), clock))
    found = read(path)
    assert_spring(found, N, interpolated=False)
    assert "no sampling interval is stated of Load" in said(found)
    np.testing.assert_allclose(found.time, TIME, atol=1e-9)


@pytest.mark.parametrize(
    ("channels", "message"),
    [
        # Which of two clocks a third channel has is not known.
        (
            [("Rig/Temperature", "degC", TIME, wave(step=0.05)), ("Rig/Load", "N", force(TIME), {})],
            r"has no time, apart .*export the channels with one common raster",
        ),
        ([("Rig/Load", "N", force(TIME[::2]), {})], "has no time, apart"),
        ([("Rig/Load", "N", force(TIME), wave(step=0.0, start=1.0))], "has no time, apart"),
        (
            [("Rig/Load", "N", force(TIME), wave(step=0.01, start=None))],
            "not say that they count from the same",
        ),
        (
            [
                (
                    "Rig/Load",
                    "N",
                    force(TIME),
                    wave(step=0.01) | {"wf_start_time": np.datetime64("1904-01-01T00:00:00")},
                )
            ],
            "does not say that they count from the same instant",
        ),
        ([("Rig/Load", "N", force(TIME), wave(start=100.0))], "do not overlap in time .*same run"),
    ],
)
def test_clocks_that_cannot_be_compared_are_refused(tmp_path, channels, message):
    with pytest.raises(RecordingError, match=message):
        read(tdms(tmp_path, ("Rig/Position", "mm", travel(TIME), wave()), *channels))


# -- other binary formats and sheets -----------------------------------------------------------------------------------


def hdf5(folder: Path, **groups: dict[str, np.ndarray]) -> Path:
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / "run.h5", "w") as file:
        for group, columns in groups.items():
            for name, values in columns.items():
                file[f"{group}/{name}"] = values
    return folder / "run.h5"


def test_waveforms_in_hdf5(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = hdf5(tmp_path, Rig={"Position_mm": travel(TIME), "Load_N": force(TIME + 1.0)})
    with h5py.File(path, "a") as file:
        for name, start in (("Position_mm", DAY), ("Load_N", DAY + np.timedelta64(1, "s"))):
            file[f"Rig/{name}"].attrs.update({"wf_increment": STEP, "wf_start_time": str(start)})
    assert_spring(read(path), 550)


def test_groups_of_hdf5_with_their_own_time(tmp_path):
    moved = {"time_s": TIME, "Position_mm": travel(TIME)}
    same = hdf5(tmp_path, A=moved, B={"time_ms": 1e3 * TIME, "Load_N": force(TIME)})
    assert_spring(read(same), N, interpolated=False)
    # Where the stamps of two groups count from is not stated, unless they are seconds since 1970.
    other = {"time_s": 2.0 * TIME, "Load_N": force(2.0 * TIME)}
    with pytest.raises(RecordingError, match=r"different time stamps.*one common raster"):
        read(hdf5(tmp_path, A=moved, B=other))
    since_1970 = [{**one, "time_s": one["time_s"] + 1.77e9} for one in (moved, other)]
    assert_spring(read(hdf5(tmp_path, A=since_1970[0], B=since_1970[1])), 300)


def parquet(folder: Path, **columns: object) -> Path:
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    pandas.DataFrame(columns).to_parquet(folder / "run.parquet")
    return folder / "run.parquet"


def test_columns_of_dates_in_parquet(tmp_path):
    pandas = pytest.importorskip("pandas")
    first = pandas.DatetimeIndex(DAY + np.rint(1e6 * TIME).astype("m8[us]"))
    second = first + pandas.Timedelta(seconds=1)
    columns = {"Zeit A": first, "Weg_mm": travel(TIME), "Zeit B": second, "Kraft_N": force(TIME + 1.0)}
    assert_spring(read(parquet(tmp_path, **columns)), 550)
    # Zones: 11:00:01 in Berlin is 10:00:01 in UTC.
    zoned = (second + pandas.Timedelta(hours=1)).tz_localize("Europe/Berlin")
    columns |= {"Zeit A": first.tz_localize("UTC"), "Zeit B": zoned}
    assert_spring(read(parquet(tmp_path, **columns)), 550)
    columns |= {"Zeit B": first}
    with pytest.raises(RecordingError, match="does not say that they count from the same instant"):
        read(parquet(tmp_path, **columns))


def test_sheets_with_a_time_of_their_own(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")

    def workbook(shift: float, dated: bool) -> Path:
        book = openpyxl.Workbook()
        book.remove(book.active)
        for name, head, values, begin in (
            ("Weg", "Weg [mm]", travel(TIME), 0.0),
            ("Kraft", "Kraft [N]", force(TIME + shift), shift),
        ):
            sheet = book.create_sheet(name)
            sheet.append(["Zeit" if dated else "Zeit [s]", head])
            for t, value in zip(TIME + begin, values, strict=True):
                stamp = (DAY + np.timedelta64(round(1e6 * t), "us")).astype(object)
                sheet.append([stamp if dated else float(t), float(value)])
        book.save(tmp_path / "run.xlsx")
        return tmp_path / "run.xlsx"

    assert_spring(read(workbook(0.0, False)), N, interpolated=False)
    assert_spring(read(workbook(1.0, True)), 550)
    with pytest.raises(RecordingError, match="does not say that they count from the same instant"):
        read(workbook(1.0, False))


# -- LabVIEW measurement files -----------------------------------------------------------------------------------------


def lvm(
    columns: str = "No", x0=("0", "0"), step=("0.02", "0.02"), clock=("10:00:00.0", "10:00:00.0"), rows=()
) -> str:
    head = [
        "LabVIEW Measurement", "Separator\tTab", "Decimal_Separator\t.", f"X_Columns\t{columns}",
        "Time_Pref\tRelative", "***End_of_Header***", "", "Channels\t2", f"Samples\t{N}\t{N}",
        "Date\t2026/03/01\t2026/03/01", "Time\t" + "\t".join(clock), "Y_Unit_Label\tmm\tN",
        "X_Dimension\tTime\tTime", "X0\t" + "\t".join(x0), "Delta_X\t" + "\t".join(step),
        "***End_of_Header***", "X_Value\tDisplacement\t" + ("X_Value\t" * (columns == "Multi")) + "Force",
    ]  # fmt: skip
    return "\n".join([*head, *rows])


def without_x(time: np.ndarray) -> list[str]:
    return [f"\t{q:.6f}\t{f:.6f}" for q, f in zip(travel(TIME), force(time), strict=True)]


@pytest.mark.parametrize(
    ("text", "samples"),
    [
        (lvm(x0=("0", "1"), rows=without_x(TIME + 1.0)), 550),
        (lvm(step=("0.02", "0.01"), rows=without_x(0.5 * TIME)), 600),
        (lvm(clock=("10:00:00.0", "10:00:01.0"), rows=without_x(TIME + 1.0)), 550),
        (
            lvm(
                "One",
                clock=("10:00:00.0", "10:00:01.0"),
                rows=[f"{t:.3f}{row}" for t, row in zip(TIME, without_x(TIME + 1.0), strict=True)],
            ),
            550,
        ),
        (
            lvm(
                "One",
                step=("0.02", "0.01"),
                rows=[f"{t:.3f}{row}" for t, row in zip(TIME, without_x(0.5 * TIME), strict=True)],
            ),
            600,
        ),
        (
            lvm(
                "Multi",
                rows=[f"{t:.3f}\t{travel(t):.6f}\t{t + 1:.3f}\t{force(t + 1.0):.6f}" for t in TIME],
            ),
            550,
        ),
        (
            lvm(
                "Multi",
                rows=[
                    f"{t:.3f}\t{travel(t):.6f}\t" + (f"{2 * t:.3f}\t{force(2 * t):.6f}" if t < 5.99 else "\t")
                    for t in TIME
                ],
            ),
            300,
        ),
    ],
    ids=["X0", "Delta_X", "Time", "one column, Time", "one column, Delta_X", "two columns", "fewer rows"],
)
def test_channels_of_labview_with_another_clock_are_interpolated(tmp_path, text, samples):
    (tmp_path / "run.lvm").write_text(text)
    found = read(tmp_path / "run.lvm")
    assert_spring(found, samples)


def test_a_channel_of_labview_without_a_value_is_left_out(tmp_path):
    (tmp_path / "run.lvm").write_text(lvm("Multi", rows=[f"{t:.3f}\t{travel(t):.6f}\t\t" for t in TIME]))
    with pytest.raises(RecordingError, match="no column force_N"):
        read(tmp_path / "run.lvm")


# -- several columns of time in a text ---------------------------------------------------------------------------------


def csv(folder: Path, head: str, *columns: object, separator: str = ",") -> Path:
    """Write columns; a shorter one leaves its fields empty."""
    width = max(len(column) for column in columns)  # type: ignore[arg-type]
    filled = [[*column, *[""] * (width - len(column))] for column in columns]  # type: ignore[misc, arg-type]
    rows = [separator.join(str(field) for field in row) for row in zip(*filled, strict=True)]
    (folder / "run.csv").write_text("\n".join([head, *rows]) + "\n")
    return folder / "run.csv"


LATE, RARE = TIME + 1.0, 0.05 * np.arange(200)


@pytest.mark.parametrize(
    ("head", "columns", "samples"),
    [
        ("Time A [s],Weg [mm],Time B [s],Kraft [N]", (TIME, travel(TIME), LATE, force(LATE)), 550),
        ("Time [s],Kraft [N],Time [ms],Weg [mm]", (LATE, force(LATE), 1e3 * TIME, travel(TIME)), 550),
        ("Weg [mm],Zeit Weg [s],Kraft [N],Zeit Kraft [s]", (travel(TIME), TIME, force(RARE), RARE), 200),
        (
            "Nr,Time A [s],Weg [mm],Time B [s],Kraft [N]",
            (range(N), TIME, travel(TIME), LATE, force(LATE)),
            550,
        ),
    ],
)
def test_each_channel_has_the_time_beside_it(tmp_path, head, columns, samples):
    path = csv(tmp_path, head, *columns)
    found = read(path)
    assert_spring(found, samples)
    assert "(Weg [mm]) every 0.02 s" in said(found)
    assert "(Kraft [N]) every" in said(found)
    names = head.split(",")
    by_number = {
        "displacement": names.index("Weg [mm]") + 1,
        "force": names.index("Kraft [N]") + 1,
    }
    assert_spring(read(path, columns=by_number), samples)


def test_a_travel_and_a_force_beside_one_time_have_it(tmp_path):
    columns = (TIME, travel(TIME), force(TIME), RARE, RARE)
    found = read(csv(tmp_path, "Time A [s],Weg [mm],Kraft [N],Time B [s],Temperatur [C]", *columns))
    assert_spring(found, N, interpolated=False)
    np.testing.assert_allclose(found.time, TIME, atol=1e-9)


def test_equal_columns_of_time_are_one_whatever_their_unit(tmp_path):
    columns = (TIME, travel(TIME), 1e3 * TIME, force(TIME))
    found = read(csv(tmp_path, "Time [s],Weg [mm],Time [ms],Kraft [N]", *columns))
    assert_spring(found, N, interpolated=False)


def test_times_of_day_and_zones_are_compared(tmp_path):
    def stamps(shift: float, zone: str, hour: int) -> list[str]:
        return [f"{hour}:{int((t + shift) // 60):02d}:{(t + shift) % 60:05.2f}{zone}" for t in TIME]

    head = "Time A,Weg [mm],Time B,Kraft [N]"
    columns = (stamps(0.0, "", 10), travel(TIME), stamps(1.0, "", 10), force(LATE))
    assert_spring(read(csv(tmp_path, head, *columns)), 550)
    columns = (stamps(0.0, "+01:00", 10), travel(TIME), stamps(1.0, "Z", 9), force(LATE))
    assert_spring(read(csv(tmp_path, head, *columns)), 550)
    columns = (stamps(0.0, "+01:00", 10), travel(TIME), stamps(1.0, "Z", 10), force(LATE))
    with pytest.raises(RecordingError, match="do not overlap"):
        read(csv(tmp_path, head, *columns))


def test_a_time_that_the_case_names_does_not_hide_another(tmp_path):
    path = csv(tmp_path, "Time A [s],Weg [mm],Time B [s],Kraft [N]", TIME, travel(TIME), LATE, force(LATE))
    for named in ("Time A", 1, "Time B"):
        with pytest.raises(RecordingError, match=r"are different times.*leave `time` out of `columns`"):
            read(path, columns={"time": named})


@pytest.mark.parametrize(
    ("times", "message"),
    [
        ((TIME, np.where(TIME > 5.0, TIME - 2.0, TIME + 1.0)), "the time runs backwards"),
        ((TIME, TIME + 100.0), "do not overlap in time"),
    ],
)
def test_columns_of_time_that_cannot_be_compared_are_refused(tmp_path, times, message):
    a, b = times
    with pytest.raises(RecordingError, match=message):
        read(csv(tmp_path, "Time A [s],Weg [mm],Time B [s],Kraft [N]", a, travel(a), b, force(b)))


def test_a_jump_of_the_clock_of_the_force_leaves_out_what_has_no_travel(tmp_path):
    jumped = np.where(TIME > 5.0, TIME + 3.0, TIME)
    path = csv(
        tmp_path, "Time A [s],Weg [mm],Time B [s],Kraft [N]", TIME, travel(TIME), jumped, force(jumped)
    )
    assert_spring(read(path), int((jumped <= TIME[-1]).sum()))


def test_stamps_with_too_few_digits_are_repaired_before_they_are_compared(tmp_path):
    coarse = np.floor(TIME * 10.0 + 1e-9) / 10.0
    fine = 0.503 + 0.01 * np.arange(1000)
    path = csv(tmp_path, "Time A [s],Weg [mm],Time B [s],Kraft [N]", coarse, travel(TIME), fine, force(fine))
    found = read(path)
    # The even stamps are known to half a digit, 0.05 s, at up to 2.6 mm/s; a staircase would be wrong by 0.26 mm.
    assert np.abs(found.force / 100.0 - found.displacement).max() < 0.14
    assert np.ptp(found.force / 100.0 - found.displacement) < 0.28


def test_init_writes_no_time_where_each_channel_has_its_own(tmp_path):
    from bushcli.case import load_case
    from bushcli.case.from_files import case_from_files

    path = csv(tmp_path, "Time A [s],Weg [mm],Time B [s],Kraft [N]", TIME, travel(TIME), LATE, force(LATE))
    (tmp_path / "case.toml").write_text(case_from_files([path], tmp_path))
    (source,) = load_case(tmp_path / "case.toml").recordings
    assert_spring(read_recording(source), 550)


def test_a_program_has_the_time_in_front_of_it(tmp_path):
    path = csv(tmp_path, "Time A [s],Kraft [N],Time B [s],Weg [mm]", LATE, force(LATE), RARE, travel(RARE))
    program = read_program(Source("axial", path))
    np.testing.assert_allclose(program.time, RARE, atol=1e-9)
    np.testing.assert_allclose(program.displacement, travel(RARE), atol=1e-9)


def test_a_path_of_six_motions_with_two_times_is_interpolated(tmp_path):
    from bushcli.case import load_case

    columns = (TIME, travel(TIME), 0.5 * travel(TIME), LATE, force(LATE))
    csv(tmp_path, "Time A [s],ux_mm,uz_mm,Time B [s],fz_N", *columns)
    (tmp_path / "case.toml").write_text(
        '[geometry]\nshape = "plain"\ninner_radius = 9\nouter_radius = 18\nlength = 34\n'
        '[material]\nlaw = "neo_hookean"\n[[recordings]]\nmode = "path"\nfile = "run.csv"\n'
    )
    (source,) = load_case(tmp_path / "case.toml").recordings
    found = read_recording(source)
    assert "the motion, in" in said(found)
    np.testing.assert_allclose(found.force, 100.0 * found.six.motion[:, 0], atol=0.02)
    assert len(found.force) == 550
