"""The rig's own count of cycles, and what precedes the cycles that are compared."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from bushcli.cli import main
from bushcli.curve.earlier import earlier
from bushcli.recording import Recording, read_recording
from bushcli.recording.source import Source
from bushcli.standards.observation import observe

NUMBER = 5
T = np.linspace(0.0, NUMBER, 100 * NUMBER + 1)
SINE = 2.0 * np.sin(2.0 * np.pi * T)
COUNT = np.minimum(T.astype(int), NUMBER - 1)


def read(
    folder: Path, displacement: np.ndarray, count: object, head: str, timed: bool = True, **keys: object
) -> Recording:
    time = 0.01 * np.arange(len(displacement))
    # A spring with a friction of 10 N, without force at the first sample.
    force = 100.0 * displacement + 10.0 * np.sign(np.diff(displacement, prepend=displacement[0]))
    names = ["Zeit [s]"] * timed + ["Weg [mm]", "Kraft [N]", head]
    columns = [time] * timed + [displacement.round(6), force.round(4), count]
    rows = "\n".join(";".join(map(str, row)) for row in zip(*columns, strict=True))
    (folder / "rig.csv").write_text(f"{';'.join(names)}\n{rows}\n")
    return read_recording(Source("axial", folder / "rig.csv", **keys))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("head", "count"),
    [
        ("Zyklus", COUNT + 1),
        ("Cycle", COUNT),
        ("Zyklus Nr.", T.astype(int) + 1),
        ("Cycle Count (cycles)", np.concatenate([COUNT[:2], COUNT[:-2]])),
        ("Lastwechselzahl", COUNT + 10_001),
        ("Elapsed Cycles", np.round(np.minimum(T, NUMBER - 0.001), 3)),
        ("Zyklus", [f"Zyklus {one + 1}" for one in COUNT]),
    ],
)
def test_the_rig_counts_the_cycles(tmp_path, head, count):
    found = read(tmp_path, SINE, count, head, conditioning=3)
    assert found.record.numbers is not None
    assert {branch.cycle for branch in found.branches} == {4, 5}
    # Two cycles, with the sample at which they begin.
    assert len(found.displacement) == 201
    assert head not in found.unused


@pytest.mark.parametrize(
    ("head", "count"),
    [
        ("Segment", np.minimum((2.0 * T + 0.5).astype(int), 2 * NUMBER)),
        ("Block", (COUNT > 2) + 1),
        ("Cycle time", np.round(T % 1, 3)),
        ("Cycle", np.arange(len(T))),
        ("Zyklus", np.ones(len(T))),
        ("Zyklus", [*[""] * 500, "1"]),
    ],
)
def test_a_column_that_counts_something_else_is_not_used(tmp_path, head, count):
    found = read(tmp_path, SINE, count, head, conditioning=3)
    assert found.record.numbers is None
    assert {branch.cycle for branch in found.branches} == {4, 5}


def test_the_ways_to_a_preload_and_back_belong_to_the_cycles_beside_them(tmp_path):
    way = np.linspace(0.0, 3.0, 60)[:-1]
    path = np.concatenate([way, 3.0 + SINE, way[::-1]])
    count = np.concatenate([np.zeros(59, dtype=int), COUNT + 1, np.full(59, NUMBER)])
    found = read(tmp_path, path, count, "Zyklus", conditioning=2)
    assert max(branch.cycle for branch in found.record.branches) == NUMBER
    # The rig counts from the preload, not from the valley: 3 cycles of 100 samples and the way back.
    assert found.displacement[0] == pytest.approx(3.0, abs=0.15)
    assert len(found.displacement) == pytest.approx(300 + 59, abs=3)


@pytest.mark.parametrize("timed", [True, False])
def test_what_is_not_compared_is_the_history_of_what_is(tmp_path, timed):
    found = read(tmp_path, SINE, COUNT + 1, "Zyklus", timed=timed, cycles=(2, 5))
    # Also where no time tells equal cycles apart.
    np.testing.assert_array_equal(found.places, [*range(100, 201), *range(400, 501)])
    np.testing.assert_array_equal(found.record.displacement[found.places], found.displacement)
    assert earlier(found) is None
    alone = Recording("axial", found.displacement[101:], found.force[101:], name="axial")
    assert earlier(alone) is not None
    seen = observe(found)
    assert seen.from_rest
    assert (len(seen.amplitudes), len(seen.compared)) == (5, 2)


def test_standards_see_the_amplitudes_of_the_whole_record(tmp_path):
    grown = np.where(T < 2.0, 0.5, 1.0) * SINE
    seen = observe(read(tmp_path, grown, COUNT + 1, "Zyklus", conditioning=3))
    assert seen.amplitudes == pytest.approx((1.0, 1.0, 2.0, 2.0, 2.0), abs=0.01)
    # The conditioning has one cycle of the largest travel, not three.
    assert seen.largest_cycles == 3
    assert seen.rates == pytest.approx((4.0, 8.0), rel=0.1)


def test_check_shows_all_cycles_and_which_are_for_conditioning(tmp_path, monkeypatch):
    monkeypatch.setattr("bushcli.cli.run.listen", lambda: None)
    read(tmp_path, SINE, COUNT + 1, "Zyklus")
    (tmp_path / "case.toml").write_text(
        '[geometry]\nshape = "plain"\ninner_radius = 12.0\nouter_radius = 22.0\nlength = 40.0\n'
        '[material]\nlaw = "yeoh"\n[[recordings]]\nmode = "axial"\nfile = "rig.csv"\nconditioning = 3\n'
    )
    said = " ".join(CliRunner().invoke(main, ["check", str(tmp_path / "case.toml")]).output.split())
    assert "axial axial 501 5 -2.00 2.00 mm" in said
    assert "cycle = column 4 (Zyklus)" in said
    assert "2 cycles after 3 for conditioning" in said
    assert "not from rest" not in said
