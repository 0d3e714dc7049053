"""`bushcli diagnose` with the calculation replaced: options, streams, exit codes and files."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from bushcli.case import load_case
from bushcli.cli import diagnosis as command
from bushcli.cli import main
from bushcli.cli.run import Run
from bushcli.diagnosis import aftermath, answer
from bushcli.diagnosis import diagnose as driver
from bushcli.runtime.store import SUFFIX
from bushcli.runtime.workers import Workers
from bushcli.selection.search_extent import SearchExtent
from cases.march import failure_at_start

ROOT = Path(__file__).parents[2]


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
    """Like `called`, with a driver that returns a diagnosis made by hand and records its arguments."""

    def command(*arguments: object, kind: str = "missing_physics") -> SimpleNamespace:
        asked: dict[str, Any] = {}

        def diagnose(case: Any, *, progress: Any = None, tables: Any = None, **options: Any) -> Any:
            asked.update(options)
            if progress is not None:
                progress("fit", "mullins", "misfit 1.02")
            return diagnoses.diagnosis(case, kind)

        monkeypatch.setattr(driver, "diagnose", diagnose)
        done = called(*arguments)
        done.asked = asked
        return done

    return command


def test_the_verdict_is_on_stdout_and_progress_on_stderr(run: Any) -> None:
    done = run()
    assert done.code == 0, done.err
    assert done.out.startswith(
        "Missing physics: Mullins softening (more than 99 %), with nothing else (97 %)."
    )
    line = next(line for line in done.err.splitlines() if "mullins" in line)
    # Seconds, stage, effect, misfit.
    assert line.split()[1:] == ["s", "fit", "mullins", "misfit", "1.02"]


def test_a_screening_is_told_effect_by_effect_or_point_by_point(capsys: pytest.CaptureFixture[str]) -> None:
    points = [("screen", "mullins", "m 0.1"), ("screen", "mullins", "m 0.3"), ("screen", "offset", "")]
    steps = [*points, ("fit", "mullins", "misfit 1.02"), *points[1:2]]
    for verbose, count in ((False, 4), (True, 5)):
        run = Run("diagnose", Path("case.toml"), (), None, False, False, verbose)
        line = command._progress(run)
        assert line is not None
        for step in steps:
            line(*step)
        said = capsys.readouterr().err
        assert len(said.splitlines()) == count
        assert ("m 0.3" in said) == verbose
        assert "misfit 1.02" in said


def test_the_time_left_of_a_budget_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    line = command._progress(Run("diagnose", Path("case.toml"), (), None, False, False, False), 90.0)
    assert line is not None
    line("fit", "mullins", "misfit 1.02")
    assert capsys.readouterr().err.split() == [
        "0",
        "s",
        "90",
        "s",
        "left",
        "fit",
        "mullins",
        "misfit",
        "1.02",
    ]


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
        "--hold-out",
        "axial",
        "--budget",
        3,
        "--uniform-odds",
        "-o",
        tmp_path / "out",
    )
    assert done.code == 0, done.err
    assert done.asked == {
        "model": "gent",
        "effects": ["mullins", "friction"],
        "hold_out": ("axial",),
        "uniform": True,
        # Minutes on the command line.
        "budget": 180.0,
        "workers": 2,
        "executor": None,
        "journal": tmp_path / "out" / "history-diagnose",
        "resume": None,
        "maps": False,
    }
    assert run().asked["journal"] is None


@pytest.mark.parametrize(
    ("given", "asked"),
    [
        ([], None),
        (["--effects", "mullins"], ["mullins"]),
        (["--effects", "mullins", "--effects", "friction"], ["mullins", "friction"]),
        (
            ["--effects", "mullins,offset", "--effects", " friction ,mullins,"],
            ["mullins", "offset", "friction"],
        ),
    ],
)
def test_effects_are_a_list_an_option_given_again_or_both(
    run: Any, given: list[str], asked: list[str] | None
) -> None:
    assert run("-q", *given).asked["effects"] == asked


def test_effects_without_a_name_are_refused(run: Any) -> None:
    done = run("--effects", " ,")
    assert done.code == 2
    assert "names no effect" in done.err


@pytest.mark.slow
def test_the_folder_holds_result_report_curves_and_map(run: Any, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = run("-o", out)
    assert done.code == 0, done.err
    names = {path.name for path in out.iterdir()}
    assert {"result.json", "report.html", "axial-diagnosis.csv", "axial-bushing-map.vtu"} <= names
    assert json.loads((out / "result.json").read_text())["verdict"] == "missing_physics"
    assert f"wrote {out}" in done.err


@pytest.mark.parametrize(
    ("kind", "code"),
    [("explained", 0), ("missing_physics", 1), ("law_too_poor", 1), ("unexplained", 1), ("faulty_data", 1)],
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
        (["--hold-out", "axil"], ["--hold-out", "axil", '"axial"']),
        (["--hold-out", "axial"], ["--hold-out", "leaves no channel"]),
    ],
)
def test_wrong_names_end_with_2_and_the_nearest(called: Any, arguments: list[str], words: list[str]) -> None:
    # With the real driver, which checks names before it calculates.
    done = called(*arguments)
    assert done.code == 2
    for word in words:
        assert word in done.err


def test_all_wrong_names_are_told_at_once(called: Any) -> None:
    done = called("--effects", "mulins,offset", "--effects", "fricton")
    assert done.code == 2
    assert '"mullins"' in done.err
    assert '"friction"' in done.err
    # The list of valid names is long, so it is printed once.
    assert done.err.count("swaging") == 1


def test_a_folder_with_a_file_of_somebody_is_refused_before_anything_is_solved(
    run: Any, tmp_path: Path
) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "axial-diagnosis.csv").write_text("mine")
    done = run("-o", tmp_path / "out")
    assert done.code == 2
    assert "axial-diagnosis.csv: exists already" in done.err
    assert done.asked == {}


def test_effects_of_the_case_and_loud_noise_are_told(small: Path, diagnoses: ModuleType) -> None:
    fitted, alone = SimpleNamespace(converged=True, simulated=()), SimpleNamespace(effects=())
    best: Any = SimpleNamespace(state=SimpleNamespace(fitted=fitted, model=alone))
    none: Any = SimpleNamespace(
        used=(), compared_recordings=lambda simulated: (), likelihood=SimpleNamespace(features=())
    )
    searched = SearchExtent(True, 0.0, "nothing left", (), (), {})
    case = load_case(small)
    channel = diagnoses.channel()
    assert answer.doubts(case, (channel,), (), best, none, searched) == []
    text = small.read_text() + '[[effects]]\nname = "rig_compliance"\nparameters = { stiffness = 5000 }\n'
    small.write_text(text)
    loud = (replace(channel, noise_percent=63.0),)
    effects, noise = answer.doubts(load_case(small), loud, (), best, none, searched)
    assert effects.name == "effects_of_the_case"
    assert "(rig_compliance)" in effects.message
    assert noise.name == "loud_noise"
    assert "axial 63 %" in noise.message
    for after, noise_percent, missed in ((4.0, 0.2, True), (0.9, 0.2, False), (4.0, 2.0, False)):
        outside = replace(channel, held_out=True, after_percent=after, noise_percent=noise_percent)
        names = [one.name for one in answer.doubts(load_case(small), (outside,), (), best, none, searched)]
        assert ("held_out_missed" in names) == missed


def test_a_case_without_recordings_is_refused(called: Any, small: Path) -> None:
    text = small.read_text().split("[[recordings]]")[0]
    small.write_text(text + '[[load_cases]]\nmode = "axial"\namplitude = 2.0\n')
    done = called()
    assert done.code == 2
    assert "recordings" in done.err


def test_a_recording_that_cannot_be_read_leaves_the_fits_of_an_earlier_run(
    called: Any, small: Path, tmp_path: Path
) -> None:
    kept = tmp_path / "out" / "history-diagnose" / f"0{SUFFIX}"
    kept.parent.mkdir(parents=True)
    kept.touch()
    recording = small.parent / "axial.csv"
    lines = recording.read_text().splitlines()
    recording.write_text(
        "\n".join([*lines[:5], lines[5].replace(lines[5].split(",")[-1], "nan"), *lines[6:]])
    )
    done = called("-o", tmp_path / "out")
    assert done.code == 2
    assert "axial.csv" in done.err
    assert kept.exists()


@pytest.mark.parametrize(
    ("there", "resume", "words"),
    [
        (2, True, "2 results found; those of the same case and revision are used"),
        (0, True, "there are no saved results: starting from the beginning"),
        (1, False, "1 result found; those of the same question are calculated again"),
        (0, False, ""),
        (2, None, "2 results found; those of the same case and revision are used"),
        (0, None, ""),
    ],
)
def test_what_becomes_of_an_earlier_run_is_told(
    tmp_path: Path, there: int, resume: bool | None, words: str
) -> None:
    for i in range(there):
        (tmp_path / f"{i:024x}{SUFFIX}").touch()
    told: list[str] = []
    driver._open_store(tmp_path, resume, lambda *line: told.append(line[2]))
    assert told == ([words] if words else [])


def test_an_output_folder_has_a_name(called: Any) -> None:
    done = called("-o", "")
    assert done.code == 2
    assert "is empty: give the name of a folder" in done.err


def extras(monkeypatch: pytest.MonkeyPatch, stopped: str, error: BaseException) -> Any:
    """The next test and the map of a diagnosis, one of which is stopped by an error."""

    def stop(*_: Any) -> None:
        raise error

    models: Any = [SimpleNamespace(effects=("mullins",), probability=0.6)]
    models.append(SimpleNamespace(effects=("friction",), probability=0.4))
    monkeypatch.setattr(aftermath, "next_test", lambda *_: "a test")
    monkeypatch.setattr(aftermath, "_maps", lambda *_: ("a map",))
    if stopped:
        monkeypatch.setattr(aftermath, stopped, stop)
    found = aftermath.Extras()
    nothing: Any = None
    search: Any = SimpleNamespace(problem=nothing, progress=lambda *_: None, share_left=0.0)
    monkeypatch.setattr(aftermath, "amplitude_faults", lambda *_: ())
    found.make(search, nothing, models, Workers(), nothing, True)
    return found


@pytest.mark.parametrize(
    ("stopped", "error", "condition", "words"),
    [
        (
            "next_test",
            KeyboardInterrupt(),
            "interrupted",
            "the proposed test or the map of the bushing is missing",
        ),
        ("_maps", KeyboardInterrupt(), "interrupted", "the map of the bushing is missing"),
        # The form in which an interruption leaves PETSc's callbacks.
        ("_maps", RuntimeError("KeyboardInterrupt"), "interrupted", "the map of the bushing is missing"),
        ("_maps", failure_at_start("at 2 mm"), "no_map", "at 2 mm"),
    ],
)
def test_what_stops_the_extras_is_a_condition_beside_the_verdict(
    monkeypatch: pytest.MonkeyPatch, stopped: str, error: BaseException, condition: str, words: str
) -> None:
    made = extras(monkeypatch, stopped, error)
    assert made.test == (None if stopped == "next_test" else "a test")
    assert made.maps == ()
    (found,) = made.conditions
    assert found.name == condition
    assert words in found.message


def test_a_mistake_in_the_extras_is_not_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ZeroDivisionError):
        extras(monkeypatch, "_maps", ZeroDivisionError())


@pytest.mark.slow
def test_a_signal_ends_the_command_and_leaves_what_resume_goes_on_with(small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    text = small.read_text().split("[material.parameters]")[0]
    small.write_text(text + '[[recordings]]\nmode = "axial"\nfile = "axial.csv"\n')

    def stopped(sent: signal.Signals, *more: str) -> dict[str, int]:
        """Stop after the plain law; return the files that were kept, and when each was written."""
        arguments = [
            "-m",
            "bushcli.cli",
            "diagnose",
            str(small),
            "-o",
            str(out),
            "--effects",
            "offset",
            *more,
        ]
        # In a new session, so that a signal to its group reaches all its processes, as Ctrl-C does.
        with subprocess.Popen(
            [sys.executable, *arguments],
            env=os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        ) as process:
            assert process.stderr is not None
            said = ""
            while "screen" not in said:
                said = process.stderr.readline()
                assert said, "ended before the plain law was fitted"
            os.killpg(process.pid, sent)
            # Pipes are closed when the last of its processes has ended.
            _, said = process.communicate(timeout=60)
        # A stopped search still gives an answer; the exit code says that it is not final.
        assert process.returncode == 130
        assert "Traceback" not in said
        result = json.loads((out / "result.json").read_text())
        assert "interrupted" in [one["name"] for one in result["problems"]]
        assert result["searched"]["ended"] in ("interrupted", "nothing left")
        return {file.name: file.stat().st_mtime_ns for file in (out / "history-diagnose").glob(f"*{SUFFIX}")}

    kept = stopped(signal.SIGINT, "--workers", "2")
    assert kept
    # The plain law is not fitted again, although the number of workers has changed.
    assert kept.items() <= stopped(signal.SIGTERM, "--resume").items()
