"""German compounds name the mode of a column as separate words do."""

import pytest

from bushcli.recording import read_recording
from bushcli.recording.source import Source


@pytest.mark.parametrize(("mode", "largest"), [("radial", 400.0), ("axial", 40.0)])
def test_the_mode_decides_between_compounds(tmp_path, mode, largest):
    rows = "".join(f"{0.1 * i};{0.1 * i};{100 * i};{10 * i}\n" for i in range(5))
    (tmp_path / "r.csv").write_text(f"Zeit (s);Weg (mm);Radialkraft (N);Axialkraft (N)\n{rows}")
    assert read_recording(Source(mode, tmp_path / "r.csv")).force.max() == largest
