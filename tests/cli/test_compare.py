"""Results and cases beside each other: keys, numbers, curves, files, and wrong input."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from bushcli.cli import main
from bushcli.report.plots.curves import compare_panels
from bushcli.study.compare import ComparedResult, compare, curves_in
from tests.cli.test_six import CASE, PATH, REACTIONS

LOAD = '[[load_cases]]\nmode = "axial"\namplitude = 1.0\nsteps = 4\n'


def bushcli(*arguments: object) -> Result:
    return CliRunner().invoke(main, [*map(str, arguments)])


@pytest.fixture
def two(tmp_path: Path) -> tuple[Path, Path]:
    """Return the folder of a result, and a case file with twice its stiffness and another length of the mesh."""
    (tmp_path / "soft.toml").write_text(CASE + LOAD)
    (tmp_path / "stiff.toml").write_text(
        (CASE + LOAD)
        .replace("C10 = 0.5", "C10 = 1.0")
        .replace("C20 = -0.05", "C20 = -0.1")
        .replace("C30 = 0.01", "C30 = 0.02")
        .replace("bulk_modulus = 200.0", "bulk_modulus = 400.0")
    )
    out = tmp_path / "soft"
    assert bushcli("direct", tmp_path / "soft.toml", "-q", "--no-fields", "-o", out).exit_code == 0
    return out, tmp_path / "stiff.toml"


def test_a_result_and_a_case_are_compared(two: tuple[Path, Path], tmp_path: Path) -> None:
    out = tmp_path / "compared"
    done = bushcli("compare", *two, "-q", "-o", out)
    assert done.exit_code == 0, done.output
    found = json.loads((out / "result.json").read_text())
    assert set(found["keys"]) == {
        "title",
        "material.bulk_modulus",
        *(f"material.parameters.{name}" for name in ("C10", "C20", "C30")),
    }
    assert found["keys"]["material.parameters.C10"]["values"] == [0.5, 1.0]
    # All moduli are twice as large: so are the forces, and the strains are equal.
    secant = found["numbers"]["load_cases.axial.stiffness.secant"]
    assert secant["percent"][1] == pytest.approx(100.0, rel=1e-6)
    strained = {key for key in found["numbers"] if "stretch" in key}
    assert not strained, {key: found["numbers"][key] for key in strained}
    (axial,) = found["curves"]
    assert axial["percent"] == pytest.approx([0.0, 100.0], abs=1e-4)
    assert {one["name"] for one in found["results"]} == {"soft", "stiff.toml"}
    rows = (out / "differences.csv").read_text().splitlines()
    assert rows[0] == "key,soft,stiff.toml"
    assert "material.parameters.C10,0.5,1" in rows
    assert (out / "axial-compare.svg").exists()
    assert (out / "report.html").exists()


def test_equal_results_have_no_differences(two: tuple[Path, Path], tmp_path: Path) -> None:
    done = bushcli("compare", two[0], tmp_path / "soft.toml", "--json", "-q")
    found = json.loads(done.output)
    assert found["keys"] == {}
    # Neither do the seconds that each took count.
    assert found["numbers"] == {}
    assert found["curves"][0]["percent"] == pytest.approx([0.0, 0.0], abs=1e-6)


def test_overrides_change_the_cases(two: tuple[Path, Path], tmp_path: Path) -> None:
    done = bushcli("compare", two[0], tmp_path / "soft.toml", "--json", "-q", "--set", "geometry.length=44")
    assert json.loads(done.output)["keys"]["geometry.length"]["values"] == [40.0, 44.0]


def test_what_cannot_be_compared_is_refused(two: tuple[Path, Path], tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "result.json").write_text('{"case": 3}')
    for arguments, said in (
        ([two[0]], "BEFORE"),
        ([two[0], two[0]], "given twice"),
        ([two[0], two[0] / "result.json"], "given twice"),
        ([two[0], tmp_path / "empty"], "is a directory"),
        ([two[0], tmp_path / "broken"], "is not the result of a command on a case"),
        ([two[0], tmp_path / "none.toml"], "no such case file"),
    ):
        refused = bushcli("compare", *arguments)
        assert refused.exit_code == 2, arguments
        assert said in refused.output


def test_an_identified_law_is_compared_by_the_curves_of_its_case(tmp_path: Path) -> None:
    q = [0.1 * k for k in range(11)]
    rows = "\n".join(f"{x:.2f},{300.0 * x:.3f}" for x in q)
    (tmp_path / "axial.csv").write_text(f"displacement_mm,force_N\n{rows}\n")
    (tmp_path / "soft.toml").write_text(CASE + LOAD)
    recorded = '[[recordings]]\nmode = "axial"\nfile = "axial.csv"\n'
    (tmp_path / "case.toml").write_text(CASE + recorded)
    out = tmp_path / "identified"
    done = bushcli("inverse", tmp_path / "case.toml", "-q", "-o", out, "--model", "neo_hookean")
    assert done.exit_code == 0, done.output
    compared = bushcli("compare", tmp_path / "soft.toml", out, "-q", "--json")
    (axial,) = json.loads(compared.stdout)["curves"]
    stiffness = json.loads(bushcli("direct", tmp_path / "soft.toml", "-q", "--json").stdout)
    secant = stiffness["load_cases"][0]["stiffness"]["secant"]
    assert axial["percent"][1] == pytest.approx(100.0 * (300.0 / secant - 1.0), abs=1.0)
    # A moved recording leaves the rest to be compared.
    (tmp_path / "axial.csv").unlink()
    moved = bushcli("compare", tmp_path / "soft.toml", out)
    assert moved.exit_code == 0, moved.output
    assert "identified is compared without curves" in moved.output


def result_of(case: dict[str, object], **more: object) -> ComparedResult:
    result = {"case": case, "command": "direct", **more}
    return ComparedResult("a", result, curves_in(result))


def test_parts_that_one_case_lacks_are_one_difference() -> None:
    parts = [
        {"name": f"part_{i:02d}", "mode": "axial", "file": f"parts/part_{i:02d}.csv"} for i in range(1, 21)
    ]
    mean = [{"name": "axial", "mode": "axial", "file": "mean.csv"}]
    found = compare([result_of({"specimens": parts}), result_of({"recordings": mean, "specimens": []})])
    assert {one.key: one.values for one in found.keys} == {
        "recordings": (None, "axial"),
        "specimens": ("20: part_01 ... part_20", None),
    }
    # Of equal lists the entries are compared.
    other = [{**parts[0], "file": "again.csv"}, *parts[1:]]
    found = compare([result_of({"specimens": one}) for one in (parts, other)])
    assert [one.key for one in found.keys] == ["specimens.part_01.file"]


def test_six_motions_are_compared_reaction_by_reaction() -> None:
    """The reactions over time; a moment of 1e-9 N mm is a rounding error."""
    forces = {name: [0.0, 1e-9, 2e-9] for name in REACTIONS} | {
        "fx": [0.0, 100.0, 200.0],
        "mz": [0.0, 50.0, 80.0],
    }
    channels = [
        {"name": "path", "mode": "path", "time": [0.0, 1.0, 2.0], "force": forces | {"fx": fx}}
        for fx in ([0.0, 100.0, 200.0], [0.0, 100.0, 220.0])
    ]
    found = compare([result_of({}, load_cases=[one]) for one in channels])
    assert {one.channel: one.percent[1] for one in found.curves} == {
        "path fx": pytest.approx(10.0),
        "path mz": pytest.approx(0.0),
    }
    (force, _) = compare_panels(found)
    assert force.rows[0][0].labels == ("time [s]", "force [N]")


@pytest.mark.slow
def test_results_of_six_motions_have_a_page(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(CASE + PATH)
    (tmp_path / "b.toml").write_text((CASE + PATH).replace("C10 = 0.5", "C10 = 0.6"))
    done = bushcli("compare", tmp_path / "a.toml", tmp_path / "b.toml", "-q", "-o", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert (tmp_path / "out" / "path_fx-compare.svg").exists()
