"""Damaged and malicious files of each format are refused with one sentence, in bounded time."""

from __future__ import annotations

import gzip
import struct
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

from bushcli.errors import RecordingError
from bushcli.recording import find_table, isolated, read_recording
from bushcli.recording.reader import readers
from bushcli.recording.source import Source

HEADS = {
    "mdf": b"MDF     4.10    ",
    "tdms": b"TDSm",
    "hdf5": b"\x89HDF\r\n\x1a\n",
    "parquet": b"PAR1",
    "xlsx": b"PK\x03\x04[Content_Types].xml",
    "rpc": b"FORMAT\0",
    "lvm": b"LabVIEW Measurement\t\n",
    "zs2": gzip.compress(b"\xaf\xbe\xad\xde", mtime=0),
}


def refused(path: Path, message: str = ".", **keys: object) -> None:
    started = time.process_time()
    with pytest.raises(RecordingError, match=message) as raised:
        read_recording(Source("axial", path, **keys))  # type: ignore[arg-type]
    assert time.process_time() - started < 5.0
    text = str(raised.value)
    assert "Traceback" not in text
    assert "\n" not in text
    assert len(text) < 700


@pytest.mark.parametrize("name", HEADS)
@pytest.mark.parametrize(
    "rest", [b"", b"\0" * 5000, bytes(range(256)) * 40], ids=["nothing", "zeros", "bytes"]
)
def test_a_head_with_nonsense_behind_it(tmp_path, name, rest):
    path = tmp_path / "rig.xlsx" if name == "xlsx" else tmp_path / "rig.bin"
    path.write_bytes(HEADS[name] + rest)
    assert find_table.format_of(path) == name
    refused(path)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "reason"), [("mdf", "not a valid MDF file"), ("xlsx", "not a zip file")])
def test_the_reason_is_the_parsers_own(tmp_path, name, reason):
    """The message has neither the parser's output while it fails nor the name of its exception."""
    path = tmp_path / f"rig.{name}"
    path.write_bytes(HEADS[name] + b"\x07" * 3000)
    refused(path, rf"cannot be read as an? [^:]*: [^:]*{reason} \(is it complete")


def record(keyword: str, value: object) -> bytes:
    return keyword.encode().ljust(32, b"\0") + str(value).encode().ljust(96, b"\0")


def rpc(path: Path, body: bytes = b"", **changes: object) -> Path:
    keys: dict[str, object] = {
        "FORMAT": "BINARY_IEEE_LITTLE_END", "NUM_HEADER_BLOCKS": 3, "NUM_PARAMS": 10, "DELTA_T": 0.01,
        "PTS_PER_FRAME": 16, "PTS_PER_GROUP": 16, "FRAMES": 1, "CHANNELS": 2, "DATA_TYPE": "SHORT_INTEGER",
        "INT_FULL_SCALE": 32768,
    } | changes  # fmt: skip
    header = b"".join(record(key, value) for key, value in keys.items()).ljust(3 * 512, b"\0")
    path.write_bytes(header + body)
    return path


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"NUM_PARAMS": 10**9}, "keywords in 3 blocks is not possible"),
        ({"NUM_PARAMS": -1}, "keywords in 3 blocks is not possible"),
        ({"NUM_PARAMS": "x"}, "NUM_PARAMS = 'x' in the header is not a number"),
        ({"NUM_HEADER_BLOCKS": 10**8}, "is not possible in this format"),
        ({"CHANNELS": 10**6}, "contradict each other"),
        ({"FRAMES": 10**9}, "is cut off"),
        ({"PTS_PER_FRAME": 0}, "contradict each other"),
        ({"PTS_PER_GROUP": 17}, "contradict each other"),
        ({"CHANNELS": "1e999"}, "CHANNELS = 1e999 in the header is out of range"),
        ({"CHANNELS": "1e14"}, "contradict each other"),
        ({"FRAMES": "1e14"}, "is cut off"),
        ({"NUM_PARAMS": "1e999"}, "NUM_PARAMS = 1e999 in the header is out of range"),
        ({"DELTA_T": 0}, "is not a sampling interval"),
        ({"DELTA_T": "1e9999"}, "DELTA_T"),
        ({"DELTA_T": "nan"}, "in the header is not a number"),
        ({"FORMAT": "ASCII"}, "FORMAT = ASCII with DATA_TYPE = SHORT_INTEGER is not read"),
        ({"FORMAT": "BINARY", "DATA_TYPE": "FLOATING_POINT"}, "numbers of a VAX"),
        ({}, "is cut off: it has 1536 bytes, its header announces 1600"),
    ],
)
def test_headers_of_rpc_that_cannot_be(tmp_path, changes, message):
    # A wrong interval is noticed only if the data are complete.
    body = bytes(64) if "DELTA_T" in changes else b""
    refused(rpc(tmp_path / "a.rsp", body, **changes), message)


@pytest.mark.slow
def test_a_workbook_that_unpacks_to_gigabytes(tmp_path):
    path = tmp_path / "bomb.xlsx"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as packed:
        packed.writestr("[Content_Types].xml", "<Types/>")
        with packed.open("xl/worksheets/sheet1.xml", "w", force_zip64=True) as part:
            zeros = b"0" * 10_000_000
            for _ in range(101):
                part.write(zeros)
    refused(path, "unpacks to more than 1000 MB")


def test_a_stray_cell_at_the_end_of_a_sheet_does_no_harm(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for i in range(50):
        book.active.append([i, i])
    # The last cell of Excel's largest sheet.
    book.active.cell(row=1_048_576, column=16_384, value=1)
    book.save(tmp_path / "a.xlsx")
    columns = {"displacement": 1, "force": 2}
    recording = read_recording(Source("axial", tmp_path / "a.xlsx", columns=columns))
    assert len(recording.force) == 50


@pytest.mark.slow
def test_zs2_that_unpacks_to_gigabytes(tmp_path):
    path = tmp_path / "bomb.zs2"
    with gzip.open(path, "wb", compresslevel=9) as packed:
        packed.write(b"\xaf\xbe\xad\xde")
        zeros = b"\0" * 10_000_000
        for _ in range(41):
            packed.write(zeros)
    refused(path, "unpacks to more than 400 MB")


def test_hdf5_that_announces_more_than_it_holds(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("force", shape=(10**12,), dtype="f8", chunks=(1024,))
        file.create_dataset("displacement", shape=(10**12,), dtype="f8", chunks=(1024,))
    refused(tmp_path / "a.h5", "has 1000000000000 samples; at most 5000000")


def test_hdf5_is_not_followed_out_of_the_file(tmp_path):
    h5py = pytest.importorskip("h5py")
    (tmp_path / "secret").write_bytes(np.linspace(0, 1, 100).tobytes())
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in ("displacement", "force"):
            file.create_dataset(name, shape=(100,), dtype="f8", external=[(str(tmp_path / "secret"), 0, 800)])
        file["link"] = h5py.ExternalLink(str(tmp_path / "secret"), "/")
    refused(tmp_path / "a.h5", "holds no table of numbers")


@pytest.mark.slow
def test_mdf_whose_groups_form_a_ring_ends(tmp_path, monkeypatch):
    asammdf = pytest.importorskip("asammdf")
    path = tmp_path / "a.mf4"
    with asammdf.MDF(version="4.10") as file:
        signal = asammdf.Signal(samples=np.arange(9.0), timestamps=np.arange(9.0), name="Weg", unit="mm")
        file.append([signal])
        file.save(path, overwrite=True)
    content = bytearray(path.read_bytes())
    at = content.index(b"##DG")
    # The first link of a data group is the next one: itself.
    content[at + 24 : at + 32] = struct.pack("<Q", at)
    path.write_bytes(content)
    monkeypatch.setattr(isolated, "_WAITING", 1)
    # Loading the library takes one or two seconds.
    monkeypatch.setattr(isolated, "LONGEST", 8)
    refused(path, "cannot be read as an MDF file|no column|no sheet or group")


@pytest.mark.parametrize("name", ["mf4", "tdms", "h5", "parquet", "rsp"])
def test_every_cut_of_a_sound_file_ends_in_a_sentence(tmp_path, name):
    writers = {
        "mf4": "write_mdf4", "tdms": "write_tdms", "h5": "write_hdf5", "parquet": "write_parquet", "rsp": "write_rpc",
    }  # fmt: skip
    from importlib import util

    spec = util.spec_from_file_location("formats", Path(__file__).with_name("test_formats.py"))
    assert spec is not None
    assert spec.loader is not None
    formats = util.module_from_spec(spec)
    spec.loader.exec_module(formats)
    whole = getattr(formats, writers[name])(tmp_path / f"a.{name}").read_bytes()
    cut = tmp_path / f"cut.{name}"
    cut.write_bytes(whole[: 2 * len(whole) // 3])
    try:
        recording = read_recording(Source("axial", cut))
    except RecordingError as error:
        recording, text = None, str(error)
    else:
        text = ""
    assert "Traceback" not in text
    # npTDMS returns what was written before the cut, as after a power failure.
    assert recording is None or (name == "tdms" and len(recording.force) <= 200)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\xd0\xcf\x11\xe0" + b"\0" * 600, r"is an old Excel file \(.xls\) \(save it as .xlsx"),
        (b"MATLAB 5.0 MAT-file" + b"\0" * 600, "save it with -v7.3"),
        (b"PK\x03\x04" + b"\0" * 600, "is a zip archive"),
        (gzip.compress(b"time,force\n0,1\n", mtime=0), "is a gzip archive"),
        (b"%PDF-1.7 and more", "is a PDF document"),
    ],
)
def test_formats_that_are_not_read_are_named(tmp_path, content, message):
    (tmp_path / "rig.dat").write_bytes(content)
    refused(tmp_path / "rig.dat", message)


def test_a_device_is_refused():
    refused(Path("/dev/zero"), "is a device or a pipe")


def test_a_group_of_a_text_file_is_refused(tmp_path):
    (tmp_path / "a.csv").write_text("displacement_mm,force_N\n0,0\n1,1\n2,2\n3,3\n4,4\n")
    refused(tmp_path / "a.csv", "a text file is one table", group="Tabelle1")


def test_a_module_in_the_folder_of_the_user_is_not_imported(tmp_path, monkeypatch):
    pytest.importorskip("h5py")
    (tmp_path / "h5py.py").write_text("raise SystemExit('imported')\n")
    (tmp_path / "json.py").write_text("raise SystemExit('imported')\n")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.h5").write_bytes(HEADS["hdf5"] + b"\0" * 200)
    with pytest.raises(RecordingError) as raised:
        read_recording(Source("axial", tmp_path / "a.h5"))
    assert "imported" not in str(raised.value)


def test_every_reader_has_a_head_here():
    assert readers().keys() == HEADS.keys()
