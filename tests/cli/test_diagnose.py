"""`bushcli diagnose` with the work replaced: options, streams, exit codes and files."""

from __future__ import annotations

import json
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from bushcli.cli import main
from bushcli.diagnosis import diagnose as driver


@pytest.fixture
def called(small: Path, capsys: pytest.CaptureFixture[str]) -> Any:
    """Run the command on the small case in this process."""

    def command(*arguments: object) -> SimpleNamespace:
        with pytest.raises(SystemExit) as ended:
            main(["diagnose", str(small), *map(str, arguments)])
        streams = capsys.readouterr()
        return SimpleNamespace(code=ended.value.code, out=streams.out, err=streams.err)

    return command


@pytest.fixture
def run(called: Any, diagnoses: ModuleType, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The same with a driver that gives a diagnosis made by hand and keeps what it was asked."""

    def command(*arguments: object, kind: str = "missing_physics") -> SimpleNamespace:
        asked: dict[str, Any] = {}

        def diagnose(case: Any, *, progress: Any = None, **options: Any) -> Any:
            asked.update(options)
            if progress is not None:
                progress("refit", "mullins", "misfit 1.02")
            return diagnoses.diagnosis(case, kind)

        monkeypatch.setattr(driver, "diagnose", diagnose)
        done = called(*arguments)
        done.asked = asked
        return done

    return command


def test_the_verdict_is_on_stdout_and_progress_on_stderr(run: Any) -> None:
    done = run()
    assert done.code == 0, done.err
    assert done.out.startswith("Missing physics: mullins.")
    line = next(line for line in done.err.splitlines() if "refit" in line)
    # Seconds, stage, effect, misfit.
    assert line.split()[1:] == ["s", "refit", "mullins", "misfit", "1.02"]


def test_json_is_alone_on_stdout(run: Any) -> None:
    done = run("--json", "-q")
    assert done.err == ""
    result = json.loads(done.out)
    assert {
        "command",
        "case",
        "versions",
        "timings_s",
        "problems",
        "verdict",
        "effects",
        "rivals",
    } <= result.keys()
    assert {"mismatch", "misfit", "next_test"} <= result.keys()
    assert result["timings_s"]["diagnose"] >= 0


def test_options_reach_the_driver(run: Any, tmp_path: Path) -> None:
    done = run(
        "--model",
        "gent",
        "--effects",
        "mullins, friction",
        "--workers",
        2,
        "--no-maps",
        "-o",
        tmp_path / "out",
    )
    assert done.code == 0, done.err
    assert done.asked == {
        "model": "gent",
        "effects": ["mullins", "friction"],
        "workers": 2,
        "journal": tmp_path / "out" / "history-diagnose",
        "resume": False,
        "maps": False,
    }
    assert run().asked["journal"] is None


def test_the_folder_holds_result_report_curves_and_map(run: Any, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = run("-o", out)
    assert done.code == 0, done.err
    names = {path.name for path in out.iterdir()}
    assert {"result.json", "report.html", "axial-diagnosis.csv", "axial-bushing-map.vtu"} <= names
    assert json.loads((out / "result.json").read_text())["verdict"] == "missing_physics"
    assert f"wrote {out}" in done.err


@pytest.mark.parametrize(
    ("kind", "code"), [("explained", 0), ("missing_physics", 1), ("law_too_poor", 1), ("unexplained", 1)]
)
def test_strict_asks_for_explained(run: Any, kind: str, code: int) -> None:
    assert run("--strict", "-q", kind=kind).code == code
    assert run("-q", kind=kind).code == 0


def test_resume_needs_a_folder(run: Any) -> None:
    done = run("--resume")
    assert done.code == 2
    assert "-o DIR" in done.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--effects", "mulins"], ["--effects", "mulins", '"mullins"']),
        (["--model", "yeho"], ["yeho", '"yeoh"']),
    ],
)
def test_wrong_names_end_with_2_and_the_nearest(called: Any, arguments: list[str], words: list[str]) -> None:
    # With the real driver, which looks before it works.
    done = called(*arguments)
    assert done.code == 2
    for word in words:
        assert word in done.err


def test_a_case_without_recordings_is_refused(called: Any, small: Path) -> None:
    text = small.read_text().split("[[recordings]]")[0]
    small.write_text(text + '[[load_cases]]\nmode = "axial"\namplitude = 2.0\n')
    done = called()
    assert done.code == 2
    assert "recordings" in done.err
