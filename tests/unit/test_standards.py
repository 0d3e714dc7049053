"""Kinds of recordings, requirements of standards, and open questions, on programs with known answers."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from click.testing import CliRunner

from bushcli.case.schema_recordings import RecordingTable
from bushcli.cli import main
from bushcli.recording import Recording, select_cycles
from bushcli.recording.source import Source, Specimen
from bushcli.standards import clauses, observe, open_questions, standards


def test_every_standard_has_a_source_and_modes():
    assert set(standards()) == {"ASTM D575", "ISO 37", "ISO 7743", "SAE J1636"}
    assert all(one.source and one.modes and one.title for one in standards().values())


def ramps(
    points: list[float], rate: float | list[float], mode: str = "axial", name: str = "", **keys: object
) -> Recording:
    """Return a recording along points at speeds, 50 samples for each ramp; a point twice is a hold of 60 s."""
    q, time = [points[0]], [0.0]
    rates = [rate] * (len(points) - 1) if isinstance(rate, float) else rate
    for a, b, speed in zip(points[:-1], points[1:], rates, strict=True):
        seconds = abs(b - a) / speed if a != b else 60.0
        q += list(np.linspace(a, b, 51)[1:])
        time += list(time[-1] + np.linspace(0, seconds, 51)[1:])
    displacement = np.array(q)
    return Recording(mode, displacement, 100.0 * displacement, np.array(time), name=name or mode, **keys)  # type: ignore[arg-type]


def questions(*recordings: Recording, coupons: tuple[Recording, ...] = ()) -> list[str]:
    return [
        lack.question
        for lack in open_questions([observe(r) for r in recordings], [observe(r) for r in coupons])
    ]


def test_cycles_rates_and_holds_are_counted():
    seen = observe(ramps([0, 4, 0, 4, 0, 4, 4, 0], [0.5, 0.5, 0.5, 0.5, 5.0, 1.0, 5.0]))
    assert seen.amplitudes == pytest.approx((4.0, 4.0, 4.0))
    assert seen.rates == pytest.approx((0.5, 5.0))
    # A rig needs a few samples to stop; they belong to the ramp.
    assert seen.holds == pytest.approx((60.0,), rel=0.05)
    assert (seen.timed, seen.from_rest, seen.unloads, seen.alike) == (True, True, True, 3)


def test_a_pause_of_the_logger_is_no_second_rate():
    one = ramps([0, 4, 0, 4, 0], 0.5)
    assert one.time is not None
    late = replace(one, time=one.time + np.where(np.arange(len(one.time)) > 75, 300.0, 0.0))
    seen = observe(late)
    assert seen.pauses == pytest.approx((300.16,))
    assert seen.rates == pytest.approx((0.5,))
    assert "whether viscosity or friction opens the loops" in questions(late)
    # A logger that samples by travel writes a slow ramp with long intervals.
    assert observe(ramps([0, 4, 0, 4, 0], [5.0, 5.0, 0.05, 5.0])).pauses == ()


def test_one_rate_leaves_viscosity_and_friction_open():
    one = ramps([0, 4, 0, 4, 0], 0.5, name="slow")
    question = "whether viscosity or friction opens the loops"
    assert question in questions(one)
    assert question not in questions(one, ramps([0, 4, 0, 4, 0], 5.0, name="fast"))
    assert question not in questions(ramps([0, 4, 4, 0, 4, 0], 0.5))
    # Two recordings at different rates in different modes have only one rate in each mode.
    assert question in questions(one, ramps([0, 2, 0, 2, 0], 5.0, mode="radial"))
    silent = Recording("axial", one.displacement, one.force, name="silent")
    [lack] = [lack for lack in open_questions([observe(silent)]) if lack.question == question]
    assert lack.why == "there is no time"


def test_softening_needs_a_travel_twice_and_cycles_that_grow():
    assert "Mullins softening" in questions(ramps([0, 4, 0], 0.5))
    assert "Mullins softening" not in questions(ramps([0, 4, 0, 4, 0], 0.5))
    assert "Mullins softening" not in questions(ramps([0, 2, 0, 4, 0], 0.5))
    assert "Mullins softening" in questions(ramps([0, 4, 0, 4, 0], 0.5, conditioning=3))


def test_further_questions():
    assert "damping, set and softening" in questions(ramps([0, 4], 0.5))
    assert "offset and permanent set" in questions(ramps([1.0, 4, 1.0, 4, 1.0], 0.5))
    batch = "whether the rubber is from another batch, or the geometry, compressibility or rig differs"
    assert batch in questions(ramps([0, 4, 0, 4, 0], 0.5))
    assert batch not in questions(ramps([0, 4, 0], 0.5), ramps([0, 2, 0], 0.5, mode="radial"))
    shear = "the law in equibiaxial and planar deformation"
    coupon = ramps([0, 1.0], 0.1, mode="uniaxial")
    assert shear in questions(coupons=(coupon,))
    assert shear not in questions(coupons=(coupon, ramps([0, 1.0], 0.1, mode="planar")))


def met(recording: Recording, standard: str, specimen: Specimen | None = None) -> list[bool | None]:
    source = Source(recording.mode, Path("a.csv"), standard=standard, specimen=specimen or Specimen())
    return [clause.met for clause in clauses(observe(recording), source)]


def test_iso_7743():
    # A cylinder 12.5 mm high at 10 mm/min: 0.0133 per s.
    cycles = [0, -0.25, 0, -0.25, 0, -0.25, 0, -0.25, 0]
    good = ramps([float(q) for q in cycles], 10 / 60 / 12.5, mode="uniaxial")
    assert met(good, "ISO 7743", Specimen(gauge_length=12.5, area=660.0)) == [True, True, True, True]
    assert met(good, "ISO 7743")[2] is None
    assert met(ramps([0, -0.25, 0], 0.0133, mode="uniaxial"), "ISO 7743")[0] is False
    assert met(ramps([0, -0.4, 0], 0.0133, mode="uniaxial"), "ISO 7743")[1] is False
    assert (
        met(ramps([float(q) for q in cycles], 0.1, mode="uniaxial"), "ISO 7743", Specimen(12.5, 660.0))[2]
        is False
    )


def test_iso_37_and_astm_d575():
    pull = ramps([0, 3.0], 500 / 60 / 20, mode="uniaxial")
    assert met(pull, "ISO 37", Specimen(20.0, 8.0)) == [True, True, True]
    assert met(ramps([0, 1.0, 0, 1.0, 0], 0.4, mode="uniaxial"), "ISO 37")[0] is False
    press = ramps([0, -0.3], 12 / 60 / 12.5, mode="uniaxial")
    assert met(press, "ASTM D575", Specimen(12.5, 660.0)) == [True, None]
    fast = ramps([0, -0.3, 0, -0.3, 0, -0.3, 0], 16 / 60 / 12.5, mode="uniaxial")
    assert met(fast, "ASTM D575", Specimen(12.5, 660.0)) == [False, True]


@pytest.mark.parametrize(
    ("standard", "asked"),
    [
        ("ASTM D575", ["speed 12 ± 3 mm/min"]),
        ("ISO 37", ["one pull, without conditioning"]),
        ("ISO 7743", []),
        ("SAE J1636", ["which cycles only condition the part is stated"]),
    ],
)
def test_what_public_text_does_not_confirm_is_good_practice(standard, asked):
    one = ramps([0, 4.0, 0], 0.5, mode="axial" if standard == "SAE J1636" else "uniaxial")
    source = Source(one.mode, Path("a.csv"), standard=standard)
    assert [clause.text for clause in clauses(observe(one), source) if not clause.practice] == asked


def test_sae_j1636():
    four = [0.0, *[4.0, 0.0] * 4]
    assert met(ramps(four, 0.5, conditioning=0), "SAE J1636") == [True, False, True, True]
    last = select_cycles(ramps(four, 0.5, conditioning=3), [4])
    assert met(last, "SAE J1636") == [True, True, True, True]
    assert met(ramps([0.0, 4.0, 0.0], 0.5), "SAE J1636")[0] is False
    twist = ramps([0.0, 0.4, 0.0], np.radians(2.0), mode="torsional")
    rates = clauses(observe(twist), Source("torsional", Path("a.csv"), standard="SAE J1636"))[2]
    assert rates.found == "2 degrees/s"


def test_a_standard_of_another_mode_is_not_met():
    assert met(ramps([0, 4, 0], 0.5), "ISO 37") == [False]


def test_check_says_all_of_it(tmp_path):
    recording = ramps([0, 4, 0, 4, 0], 0.5)
    rows = "\n".join(
        f"{t:.6g},{q:.6g},{f:.6g}"
        for t, q, f in zip(recording.time, recording.displacement, recording.force, strict=True)
    )
    (tmp_path / "axial.csv").write_text(f"time_s,displacement_mm,force_N\n{rows}\n")
    case = tmp_path / "case.toml"
    case.write_text(
        '[geometry]\nshape="plain"\ninner_radius=12.0\nouter_radius=22.0\nlength=40.0\n[material]\nlaw="yeoh"\n'
        '[[recordings]]\nfile="axial.csv"\nstandard="SAE J1636"\n'
    )
    shown = CliRunner().invoke(main, ["check", str(case)])
    assert shown.exit_code == 0, shown.output
    text = " ".join(shown.output.split())
    assert "axial: 2 cycles, ramps at 0.500 mm/s" in text
    assert (
        "no: good practice, 3 to 10 cycles to the same travel before the one that counts (found: 2 cycles"
        in text
    )
    assert "What the recordings leave open whether viscosity or friction opens the loops (axial)" in text
    found = json.loads(CliRunner().invoke(main, ["check", str(case), "--json", "-q"]).output)
    assert found["protocol"][0]["rates"] == pytest.approx([0.5])
    assert found["standards"][0]["clauses"][0]["met"] is False
    assert {"channels", "question", "why", "remedy"} == set(found["open_questions"][0])
    assert CliRunner().invoke(main, ["check", str(case), "--strict", "-q"]).exit_code == 1


def test_the_case_file_knows_every_standard():
    field = RecordingTable.model_fields["standard"]
    names = {name for part in get_args(field.annotation) for name in get_args(part)}
    assert names == set(standards())
