"""Files of each format, written by the format's own library and read back to the same numbers."""

from __future__ import annotations

import contextlib
import gzip
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bushcli.errors import RecordingError
from bushcli.recording import Recording, find_table, isolated, read_program, read_recording
from bushcli.recording.reader import readers
from bushcli.recording.source import Source

N = 200
TIME = np.arange(N) * 0.05
TRAVEL = 4.0 * np.sin(0.4 * TIME)
FORCE = 130.0 * TRAVEL + 2.0 * TRAVEL**3
#: Columns as rigs name them, with units in the metadata of the file: a travel in m, a force in kN.
NAMES, UNITS = ("Prüfzeit", "Standardweg", "Standardkraft"), ("s", "m", "kN")
COLUMNS = (TIME, TRAVEL * 1e-3, FORCE * 1e-3)


def read(path: Path, mode: str = "axial", **keys: object) -> Recording:
    return read_recording(Source(mode, path, **keys))  # type: ignore[arg-type]


def assert_same(recording: Recording, rtol: float = 1e-12) -> None:
    assert recording.time is not None
    np.testing.assert_allclose(recording.time, TIME, rtol=rtol, atol=1e-12)
    np.testing.assert_allclose(recording.displacement, TRAVEL, rtol=rtol, atol=1e-12)
    np.testing.assert_allclose(recording.force, FORCE, rtol=rtol, atol=1e-9)


# -- writers: one per format, each with the units in the metadata ------------------------------------------------------


def write_mdf4(path: Path) -> Path:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append(
            [
                asammdf.Signal(samples=values, timestamps=TIME, name=name, unit=unit)
                for name, unit, values in zip(NAMES[1:], UNITS[1:], COLUMNS[1:], strict=True)
            ]
        )
        Path(file.save(path, overwrite=True)).replace(path)  # asammdf chooses the suffix
    return path


def write_mdf3(path: Path) -> Path:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="3.30") as file:
        file.append(
            [
                asammdf.Signal(samples=values, timestamps=TIME, name=name, unit=unit)
                for name, unit, values in zip(NAMES[1:], UNITS[1:], COLUMNS[1:], strict=True)
            ]
        )
        Path(file.save(path, overwrite=True)).replace(path)  # asammdf chooses the suffix
    return path


def write_tdms(path: Path) -> Path:
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as file:
        file.write_segment(
            [
                nptdms.ChannelObject("Messung", name, values, properties={"unit_string": unit})
                for name, unit, values in zip(NAMES, UNITS, COLUMNS, strict=True)
            ]
        )
    return path


def write_xlsx(path: Path) -> Path:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Prüfbericht"])
    sheet.append([])
    sheet.append(list(NAMES))
    sheet.append(list(UNITS))
    for row in zip(*COLUMNS, strict=True):
        sheet.append([float(value) for value in row])
    book.save(path)
    return path


def write_hdf5(path: Path) -> Path:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        group = file.create_group("Versuch 1")
        for name, unit, values in zip(NAMES, UNITS, COLUMNS, strict=True):
            group.create_dataset(name, data=values, compression="gzip").attrs["unit"] = unit
    return path


def write_parquet(path: Path) -> Path:
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    fields = [
        pyarrow.field(name, pyarrow.float64(), metadata={"unit": unit})
        for name, unit in zip(NAMES, UNITS, strict=True)
    ]
    parquet.write_table(pyarrow.table(list(COLUMNS), schema=pyarrow.schema(fields)), path)
    return path


def rpc_record(keyword: str, value: object) -> bytes:
    return keyword.encode("cp1252").ljust(32, b"\0") + str(value).encode("cp1252").ljust(96, b"\0")


def write_rpc(
    path: Path, kind: str = "FLOATING_POINT", order: str = "<", frame: int = 50, frames_per_group: int = 2
) -> Path:
    """Write RPC III from its description: blocks of 512 bytes, records of 128, groups of frames per channel."""
    frames = -(-N // frame)
    groups = -(-frames // frames_per_group)
    channels = COLUMNS[1:]
    scales = [float(np.abs(values).max()) / 32_000 for values in channels]
    keys: list[tuple[str, object]] = [
        ("FORMAT", "BINARY_IEEE_LITTLE_END" if order == "<" else "BINARY_IEEE_BIG_END"),
        ("NUM_HEADER_BLOCKS", 0),
        ("NUM_PARAMS", 0),
        ("FILE_TYPE", "TIME_HISTORY"),
        ("TIME_TYPE", "RESPONSE"),
        ("DELTA_T", 0.05),
        ("PTS_PER_FRAME", frame),
        ("CHANNELS", len(channels)),
        ("PTS_PER_GROUP", frame * frames_per_group),
        ("FRAMES", frames),
        ("INT_FULL_SCALE", 32768),
        ("DATA_TYPE", kind),
    ]
    for i, (name, unit, scale) in enumerate(zip(NAMES[1:], UNITS[1:], scales, strict=True), start=1):
        keys += [(f"DESC.CHAN_{i}", name), (f"UNITS.CHAN_{i}", unit), (f"SCALE.CHAN_{i}", f"{scale:.9e}")]
    blocks = -(-len(keys) // 4)
    values = dict(keys) | {"NUM_HEADER_BLOCKS": blocks, "NUM_PARAMS": len(keys)}
    header = b"".join(rpc_record(key, value) for key, value in values.items()).ljust(512 * blocks, b"\0")
    body = b""
    for group in range(groups):
        for values_, scale in zip(channels, scales, strict=True):
            points = np.zeros(frame * frames_per_group)
            part = values_[group * len(points) : (group + 1) * len(points)]
            points[: len(part)] = part
            if kind == "SHORT_INTEGER":
                body += np.round(points / scale).astype(order + "i2").tobytes()
            else:
                body += points.astype(order + "f4").tobytes()
    path.write_bytes(header + body)
    return path


def zs2_section(name: str, *inside: bytes) -> bytes:
    return bytes([len(name)]) + name.encode() + b"\xdd\x00" + b"".join(inside) + b"\xff"


def zs2_chunk(name: str, code: int, data: bytes) -> bytes:
    return bytes([len(name)]) + name.encode() + bytes([code]) + data


def zs2_text(name: str, text: str) -> bytes:
    return zs2_chunk(name, 0xAA, struct.pack("<I", len(text) | 0x80000000) + text.encode("utf-16-le"))


def write_zs2(path: Path, names: tuple[str, ...] = NAMES, specimens: int = 1) -> Path:
    """Write the sections of a zs2 file that hold channels, after the description in zs2decode's documentation."""
    manager = zs2_section(
        "ChannelManager",
        zs2_section(
            "ChannelManager",
            *(
                zs2_section(
                    f"Elem{i}",
                    zs2_chunk("ID", 0x66, struct.pack("<H", 100 + i)),
                    zs2_section("Name", zs2_text("Text", name)),
                )
                for i, name in enumerate(names)
            ),
        ),
    )
    block = zs2_section(
        "SingleGroupDataBlock",
        zs2_chunk("IndexTimeChannel", 0x11, struct.pack("<i", 0)),
        zs2_section(
            "DataChannels",
            *(
                zs2_section(
                    f"Elem{i}",
                    zs2_chunk("TrsChannelId", 0x66, struct.pack("<H", 100 + i)),
                    zs2_chunk("DataArray", 0xEE, b"\x05\x00" + struct.pack("<I", N) + values.tobytes()),
                )
                for i, values in enumerate(COLUMNS)
            ),
        ),
    )
    series = zs2_section("Series", *(zs2_section(f"Elem{i}", block) for i in range(specimens)))
    body = zs2_section("Document", zs2_section("Body", zs2_section("batch", manager, series)))
    path.write_bytes(gzip.compress(b"\xaf\xbe\xad\xde" + body))
    return path


WRITERS: dict[str, tuple[str, Callable[[Path], Path]]] = {
    "mdf4": (".mf4", write_mdf4),
    "mdf3": (".mdf", write_mdf3),
    "tdms": (".tdms", write_tdms),
    "xlsx": (".xlsx", write_xlsx),
    "hdf5": (".h5", write_hdf5),
    "parquet": (".parquet", write_parquet),
    "rpc": (".rsp", write_rpc),
}


@pytest.mark.parametrize("name", WRITERS)
def test_numbers_names_and_units_come_back(tmp_path, name):
    suffix, write = WRITERS[name]
    # A float32 has seven digits.
    assert_same(read(write(tmp_path / f"rig{suffix}")), rtol=1e-6 if name == "rpc" else 1e-12)


@pytest.mark.parametrize("name", WRITERS)
def test_the_format_is_found_by_content(tmp_path, name, in_this_process):
    _, write = WRITERS[name]
    found = read(write(tmp_path / "rig.dat"))
    assert found.units == ("m", "kN")


@pytest.mark.parametrize("name", WRITERS)
def test_a_wrong_unit_in_the_metadata_is_refused(tmp_path, name, in_this_process):
    suffix, write = WRITERS[name]
    with pytest.raises(
        RecordingError, match=r"is in m, but mode torsional needs a rotation|no column rotation_deg"
    ):
        read(write(tmp_path / f"rig{suffix}"), "torsional", columns={"displacement": "Standardweg"})


@pytest.mark.parametrize("name", WRITERS)
def test_without_the_library_one_sentence_names_the_extra(tmp_path, name, monkeypatch):
    suffix, write = WRITERS[name]
    path = write(tmp_path / f"rig{suffix}")
    monkeypatch.setattr(isolated.importlib.util, "find_spec", lambda module: None)
    if not readers()[find_table.format_of(path)].library:
        assert_same(read(path), rtol=1e-6)
        return
    with pytest.raises(
        RecordingError, match=r'not installed \(make install .* pip install "bushcli\[rig\]"\)'
    ):
        read(path)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", ["SHORT_INTEGER", "FLOATING_POINT"])
@pytest.mark.parametrize(("frame", "group"), [(64, 2), (200, 1), (7, 3)])
def test_rpc_of_every_kind(tmp_path, order, kind, frame, group):
    recording = read(write_rpc(tmp_path / "rig.rsp", kind, order, frame, group))
    frames = -(-N // frame)
    assert len(recording.force) == frames * frame
    # An integer has 1/32000 of the range.
    atol = float(np.abs(FORCE).max()) / 60_000 if kind == "SHORT_INTEGER" else 1e-4
    np.testing.assert_allclose(recording.force[:N], FORCE, atol=atol)
    np.testing.assert_allclose(recording.time[:N], TIME, atol=1e-12)


def test_zs2_needs_the_unit_from_the_case(tmp_path):
    pytest.importorskip("zs2decode")
    path = write_zs2(tmp_path / "rig.zs2")
    with pytest.raises(RecordingError, match=r'column 1 \(Prüfzeit\): "unknown" is not a known unit'):
        read(path)
    assert_same(read(path, units={"time": "s", "displacement": "m", "force": "kN"}))


def test_zs2_takes_the_unit_from_the_name(tmp_path, in_this_process):
    pytest.importorskip("zs2decode")
    names = ("Prüfzeit [s]", "Standardweg [m]", "Standardkraft [kN]")
    assert_same(read(write_zs2(tmp_path / "rig.zs2", names)))


def test_zs2_with_several_specimens(tmp_path, in_this_process):
    pytest.importorskip("zs2decode")
    names = ("Prüfzeit [s]", "Standardweg [m]", "Standardkraft [kN]")
    path = write_zs2(tmp_path / "rig.zs2", names, specimens=3)
    with pytest.raises(RecordingError, match=r'3 sheets or groups have columns.*"specimen 1", "specimen 2"'):
        read(path)
    assert_same(read(path, group="specimen 2"))
    assert_same(read(path, group=3))


def test_a_coupon_of_a_workbook(tmp_path, in_this_process):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in (("Dehnung [%]", "Spannung [MPa]"), (0, 0), (10, 0.15), (20, 0.27), (50, 0.55)):
        book.active.append(row)
    book.save(tmp_path / "zug.xlsx")
    coupon = read_recording(Source("uniaxial", tmp_path / "zug.xlsx"))
    np.testing.assert_allclose(coupon.displacement, [0, 0.1, 0.2, 0.5], atol=1e-12)
    assert coupon.units == ("percent", "MPa")


def test_the_drive_file_of_a_rig_is_a_program(tmp_path):
    read = read_program(Source("axial", write_rpc(tmp_path / "drive.drv", "SHORT_INTEGER")))
    assert read.time is not None
    np.testing.assert_allclose(read.time, TIME, atol=1e-12)
    np.testing.assert_allclose(read.displacement, TRAVEL, atol=4.0 / 60_000)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.integers(0, 2400), byte=st.integers(0, 255), cut=st.integers(0, 6000))
def test_a_damaged_rpc_file_is_read_or_refused(tmp_path, at, byte, cut):
    path = tmp_path / "rig.rsp"
    if not path.exists():
        write_rpc(path, "SHORT_INTEGER")
    content = bytearray(path.read_bytes())
    content[at] = byte
    (tmp_path / "bad.rsp").write_bytes(content[: len(content) - cut if cut < 3000 else len(content)])
    with contextlib.suppress(RecordingError):
        recording = read(tmp_path / "bad.rsp")
        assert np.isfinite(recording.force).all()
