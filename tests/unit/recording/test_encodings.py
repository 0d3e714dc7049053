"""Text files in the encodings of test rigs: numbers and column names are read correctly."""

from __future__ import annotations

import numpy as np
import pytest

from bushcli.recording import read_recording
from bushcli.recording.source import Source
from bushcli.recording.text.decode import read_text
from bushcli.recording.text_file import read_table

Q = np.linspace(0.0, 4.0, 41)
ROWS = "".join(f"{0.1 * i:.1f}\t{q:.3f}\t{100 * q:.2f}\r\n" for i, q in enumerate(Q))
GERMAN = "Prüfstand für Größen\r\nPrüfzeit\tStandardweg\tPrüfkraft\r\ns\tmm\tN\r\n" + ROWS
CHINESE = "橡胶衬套试验\r\n时间(s)\t位移（m）\t试验力（kN）\r\n" + ROWS


UNICODE = ("utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32")
CASES = [
    *((GERMAN, encoding) for encoding in (*UNICODE, "latin-1", "cp1252")),
    *((CHINESE, encoding) for encoding in (*UNICODE, "gb2312", "gbk", "gb18030")),
]


@pytest.mark.parametrize(("text", "encoding"), CASES)
def test_names_and_numbers_come_back(tmp_path, text, encoding):
    path = tmp_path / "rig.txt"
    path.write_bytes(text.encode(encoding))
    table = read_table(path)
    names = (
        ("Prüfzeit", "Standardweg", "Prüfkraft")
        if text is GERMAN
        else ("时间(s)", "位移（m）", "试验力（kN）")
    )
    assert table.names == names
    recording = read_recording(Source("axial", path))
    scale = 1.0 if text is GERMAN else 1e3
    np.testing.assert_allclose(recording.displacement, scale * Q, atol=1e-9)
    np.testing.assert_allclose(recording.force, scale * 100 * Q, atol=1e-9)
    assert recording.time is not None


@pytest.mark.parametrize("word", ["Größe", "Weg", "°C und µm", "Prüföße", "FÜSSE ÄÖÜ"])
def test_german_words_are_not_taken_for_chinese(tmp_path, word):
    path = tmp_path / "rig.txt"
    path.write_bytes(
        f"{word}\nWeg [mm];Kraft [N]\n".encode("latin-1") + b"0;0\n1;100\n2;200\n3;290\n4;400\n5;500\n"
    )
    assert read_table(path).names == ("Weg [mm]", "Kraft [N]")
    assert word in read_text(path)
