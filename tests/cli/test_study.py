"""Studies and designs as a user runs them: a process, its files and its exit code."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from http.client import HTTPConnection
from pathlib import Path
from threading import Thread

import pytest

from bushcli.cli import main
from bushcli.cli.page_server import page_server

ROOT = Path(__file__).parents[2]
CASE = """
title = "a small one"
[geometry]
shape = "plain"
inner_radius = 9.0
outer_radius = "18.0 +- 0.2"
length = 34.0
[mesh]
elements_across = 2
elements_along = 4
elements_around = 8
[material]
law = "yeoh"
bulk_modulus = 2000.0
[material.parameters]
C10 = 0.2087
C20 = -0.0108
C30 = 0.00074
[[load_cases]]
mode = "axial"
amplitude = 4.0
steps = 5
"""


@pytest.fixture
def case(tmp_path):
    file = tmp_path / "case.toml"
    file.write_text(CASE)
    return file


def designs(folder):
    parquet = pytest.importorskip("pyarrow.parquet")
    return parquet.read_table(folder / "designs.parquet").to_pylist()


@pytest.mark.slow
def test_a_grid_is_what_single_runs_are(command_line, case, tmp_path):
    out = tmp_path / "out"
    options = ["--vary", "geometry.outer_radius=18,20", "--vary", "material.parameters.C10=0.2,0.3"]
    options += ["--answer", "axial.initial", "--answer", "pull=axial.force@2", "--answer", "axial.tangent@2"]
    options += ["--answer", "load_cases[0].stiffness.secant", "--workers", 2]
    done = command_line("study", case, *options, "-o", out, "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert (result["designs"], result["failed"], result["sampling"]) == (4, 0, "grid")
    rows = designs(out)
    assert [(row["geometry.outer_radius"], row["material.parameters.C10"]) for row in rows] == [
        (18.0, 0.2),
        (18.0, 0.3),
        (20.0, 0.2),
        (20.0, 0.3),
    ]
    single = command_line(
        "direct", case, "--set", "geometry.outer_radius=20", "--set", "material.parameters.C10=0.3", "--json"
    )
    channel = json.loads(single.stdout)["load_cases"][0]
    assert rows[3]["axial.initial"] == pytest.approx(channel["stiffness"]["initial"], rel=1e-8)
    assert rows[3]["load_cases[0].stiffness.secant"] == pytest.approx(
        channel["stiffness"]["secant"], rel=1e-8
    )
    assert rows[3]["axial.force"] == pytest.approx(channel["force"], rel=1e-8)
    assert rows[3]["axial.displacement"] == channel["displacement"]
    # `pull` is twice the tangent at 2 mm to 10 %, because the curve is nearly straight there.
    assert rows[3]["pull"] == pytest.approx(2.0 * rows[3]["axial.tangent@2"], rel=0.1)
    page = (out / "report.html").read_text()
    assert "Curves of all designs" in page
    assert "pull" in page


def test_tolerances_of_the_case_are_varied_by_themselves(inside, case, tmp_path):
    out = tmp_path / "out"
    options = ["--designs", 12, "--vary", "hardness=60 +- 5", "--limits", "axial.initial=120 +- 30 %"]
    done = inside("study", case, *options, "--workers", 1, "-o", out, "-q", "--json")
    assert done.exit_code == 0, done.output
    result = json.loads(done.output)
    assert set(result["variables"]) == {"hardness", "geometry.outer_radius"}
    assert all(17.8 <= row["geometry.outer_radius"] <= 18.2 for row in designs(out))
    answer = result["answers"]["axial.initial"]
    assert answer["influences"]["hardness"]["pearson"] > 0.95
    assert 0.0 <= answer["yield"]["lower"] <= answer["yield"]["share"] <= answer["yield"]["upper"] <= 1.0
    # Every other command takes the nominal value.
    plain = inside("check", case, "--json", "-q")
    assert json.loads(plain.output)["case"]["geometry"]["outer_radius"] == 18.0


def test_a_tolerance_beyond_what_can_be_made_is_refused(inside, case, tmp_path):
    done = inside("study", case, "--vary", "geometry.length=34 +- 50", "-o", tmp_path / "out", "-q")
    assert done.exit_code == 2
    assert "length=34 +- 50: has the limit -16, which is not possible: geometry.length" in done.output


def test_few_designs_say_no_more_than_they_can(inside, case):
    """One design has answers; two cannot separate two keys, and a rank correlation of three designs means nothing."""
    options = ["--answer", "axial.initial", "--workers", 1, "-q"]
    one = inside("study", case, "--vary", "geometry.length=34", *options)
    assert "1 design (grid), all with a result." in one.output
    assert "axial.initial: 12" in one.output
    case.with_suffix(".csv").write_text("geometry.length,material.parameters.C10\n30,0.2\n34,0.25\n")
    two = inside("study", case, "--list", case.with_suffix(".csv"), *options, "--json")
    assert '"influences": {}' in two.output
    three = inside("study", case, "--vary", "geometry.length=30,34,38", *options)
    assert "Effect of each key alone" in three.output
    assert "grows with" not in three.output


def test_designs_that_fail_are_named_and_the_others_go_on(inside, case, tmp_path):
    out = tmp_path / "out"
    done = inside(
        "study", case, "--vary", "geometry.outer_radius=8,18,8.5", "--workers", 1, "-o", out, "--strict"
    )
    assert done.exit_code == 1
    assert "Designs without a result" in done.output
    failure = json.loads((out / "result.json").read_text())["failures"][0]
    assert (failure["count"], failure["designs"]) == (2, [0, 2])
    assert "inner_radius = 9 must be smaller than outer_radius = 8" in failure["reason"]
    rows = designs(out)
    assert [row["status"] for row in rows] == ["failed", "ok", "failed"]
    assert rows[0]["failure"] == "input"
    assert "must be smaller" in rows[0]["reason"]


def test_a_study_of_which_nothing_has_a_result_says_so(inside, case, tmp_path):
    out = tmp_path / "out"
    far = ["--answer", "axial.travel@99kN"]
    done = inside("study", case, "--vary", "geometry.length=30,34", *far, "--workers", 1, "-o", out)
    assert done.exit_code == 3
    assert "those of the others" not in done.output
    assert "0 of 2 designs (grid) have a result." in done.output
    assert (out / "report.html").is_file()


def test_answers_from_lists_of_a_path_of_six_motions(inside, case):
    text = case.read_text().partition("[[load_cases]]")[0]
    path = 'mode = "path"\nsteps = 3\n[load_cases.path]\ntime = [0, 1]\nux = [0, 0.5]\nrz = [0, 2]\n'
    case.write_text(f"{text}[[load_cases]]\n{path}")
    answers = ["--answer", "end=load_cases.path.force.fx.-1", "--answer", "load_cases.path.force.mz.-1"]
    options = ["--vary", "geometry.length=30,34", "--workers", 1, "-q", "--json"]
    done = inside("study", case, *answers, *options)
    found = json.loads(done.stdout)["answers"]
    end = found["end"]["worst"]
    # 30 and 34 mm long: torsional stiffness grows as the length, radial stiffness more.
    assert end["highest"]["value"] > 1.1 * end["lowest"]["value"]
    twist = found["load_cases.path.force.mz.-1"]["worst"]
    assert twist["highest"]["value"] / twist["lowest"]["value"] == pytest.approx(34 / 30, rel=0.02)
    done = inside("study", case, "--answer", "load_cases.path.force.fx.99", *options[:-1])
    assert "has no 99 there (a list: 0 to " in done.output


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], None),
        (["--vary", "geometry.outer_radios=18,20"], 'did you mean "outer_radius"?'),
        (["--vary", "geometry.outer_radius"], "is not KEY=VALUES"),
        (["--vary", "geometry.outer_radius=18:20", "--sampling", "grid"], "has no values for a grid"),
        (["--vary", "geometry.length=30,34", "--answer", "radial.initial"], "there is no channel radial"),
        (["--vary", "geometry.length=30,34", "--answer", "axial.force"], "is not an answer"),
        (
            ["--vary", "geometry.length=30,34", "--answer", "axial.force@99"],
            "is beyond the travel of the load case",
        ),
        (
            ["--vary", "geometry.length=30,34", "--limits", "radial.initial=1:2"],
            "is not an answer of this study",
        ),
        (["--vary", "geometry.length=30,34", "--limits", "axial.initial=2:1"], "has no limits"),
        (["--vary", "hardness=15,95"], "outside 20 to 90"),
        (["--list", "nosuch.csv"], "cannot be read"),
        (["--list", "/dev/zero"], "/dev/zero: is a device or a pipe, not a file"),
        (["--vary", "geometry.length=30,34", "--seed", "-1"], "Invalid value for '--seed': -1"),
        (
            ["--vary", "geometry.length=38,thirty"],
            "thirty: value 2 = thirty is a word, but the first value, 38,",
        ),
        (["--vary", "material.bulk_modulus=inf,2000"], "value 1 = inf is not finite"),
        (
            ["--vary", "geometry.length=0:1e9:1"],
            "has 1 as its number of values (LOW:HIGH:NUMBER, 2 to 100000)",
        ),
        (
            ["--vary", "geometry.length=38 +- nan"],
            "error: --vary geometry.length=38 +- nan: geometry.length =",
        ),
        (
            ["--vary", "geometry.length=30,34", "--answer", "x=1+1"],
            "the result of `bushcli direct` has no 1+1",
        ),
        (["--vary", "geometry.length=30,34", "--answer", "materials.C10"], 'did you mean "material"?'),
        (["--vary", "geometry.length=30,34", "--resume"], "needs the folder"),
        (
            ["--vary", "geometry.length=30,34", "--workers", "2", "--scheduler", "tcp://x:1"],
            "cannot be combined with",
        ),
    ],
)
def test_wrong_input_ends_in_a_sentence(inside, case, options, message):
    if message is None:
        case.write_text(CASE.replace('"18.0 +- 0.2"', "18.0"))
        message = "nothing is varied"
    done = inside("study", case, *options)
    assert done.exit_code == 2
    assert message in done.output
    assert "Traceback" not in done.output
    assert len([line for line in done.output.splitlines() if message in line]) == 1
    assert len(done.output.strip().splitlines()) == 1 or "Usage: " in done.output


def test_a_value_of_a_list_is_named_by_its_line(inside, case, tmp_path):
    """Not by `--set`, with which the study passes it on."""
    listed = tmp_path / "designs.csv"
    listed.write_text("geometry.length,geometry.inner_radius\n\n30,50\n-34,9\n")
    done = inside("study", case, "--list", listed)
    assert done.exit_code == 2
    assert f"error: {listed}:3: geometry: inner_radius = 50 must be" in done.output
    assert "--set" not in done.output


def test_a_tolerance_of_the_case_is_named_by_its_file(inside, case):
    case.write_text(CASE.replace('"18.0 +- 0.2"', '"18.0 +- 1e9"'))
    done = inside("study", case, "--designs", 1, "--seed", 1)
    assert done.exit_code == 2
    assert done.output.startswith(f"error: {case}: geometry.outer_radius = ")


@pytest.mark.slow
def test_killed_and_resumed_nothing_is_lost_and_nothing_twice(command_line, case, tmp_path):
    out = tmp_path / "out"
    options = [
        "study",
        case,
        "--vary",
        "geometry.length=30:40",
        "--designs",
        150,
        "--seed",
        5,
        "--workers",
        2,
    ]
    options += ["-o", out]
    command = [sys.executable, "-m", "bushcli.cli", *map(str, options)]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(command, env=env, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    journal = out / "history-study" / "journal.jsonl"
    until = time.monotonic() + 60
    while time.monotonic() < until and not (journal.exists() and journal.stat().st_size > 2000):
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    saved = journal.read_bytes().count(b"\n")
    assert 0 < saved < 150
    resumed = command_line(*options, "--resume", "--json")
    assert resumed.returncode == 0, resumed.stderr
    assert json.loads(resumed.stdout)["resumed"] == saved
    rows = designs(out)
    assert [row["design"] for row in rows] == list(range(150))
    whole = command_line(*options[:-2], "-o", tmp_path / "whole", "-q")
    assert whole.returncode == 0
    for one, other in zip(rows, designs(tmp_path / "whole"), strict=True):
        assert one["geometry.length"] == other["geometry.length"]
        assert one["axial.initial"] == pytest.approx(other["axial.initial"], rel=1e-9)
    again = command_line(*options, "--vary", "geometry.inner_radius=8:9", "--resume")
    assert again.returncode == 2
    assert "holds another study: vary differ" in again.stderr


@pytest.mark.slow
def test_sobol_indices(inside, case, tmp_path):
    out = tmp_path / "out"
    varied = ["--vary", "geometry.length=33:35", "--vary", "material.parameters.C10=0.15:0.25"]
    done = inside(
        "study",
        case,
        *varied,
        "--sampling",
        "saltelli",
        "--designs",
        100,
        "-o",
        out,
        "--json",
        "-q",
        "--no-curves",
        "--workers",
        1,
    )
    assert done.exit_code == 0, done.output
    result = json.loads(done.output)
    # Three keys, the two given and the toleranced radius: 16 times five designs.
    assert result["designs"] == 80
    influences = result["answers"]["axial.initial"]["influences"]
    assert influences["material.parameters.C10"]["total"] > 0.8
    assert influences["geometry.length"]["total"] < 0.2


def test_a_design_has_its_target_rates(inside, case, tmp_path):
    out = tmp_path / "out"
    targets = ["--target", "axial=117", "--target", "radial=796"]
    varied = ["--vary", "geometry.outer_radius=16:20", "--vary", "geometry.length=25:45"]
    done = inside(
        "design", case, *targets, *varied, "--tolerance", "hardness=60 +- 5", "-o", out, "--json", "-q"
    )
    assert done.exit_code == 0, done.output
    result = json.loads(done.output)
    assert result["met"], result
    assert result["targets"]["axial"]["value"] == pytest.approx(117.0, rel=1e-5)
    assert result["targets"]["axial"]["tolerances"]["worst"] > 15.0
    assert set(result["targets"]["axial"]["tolerances"]["contributions"]) == {
        "geometry.outer_radius",
        "hardness",
    }
    # The same rate from `direct`: a march to 0.02 mm.
    options = [option for text in result["set"] for option in ("--set", text)]
    options += ["--set", "load_cases.0.amplitude=0.02"]
    direct = json.loads(inside("direct", case, *options, "--json", "-q").output)
    assert direct["load_cases"][0]["stiffness"]["secant"] == pytest.approx(117.0, rel=1e-4)


def test_a_target_out_of_reach_is_reported(inside, case):
    done = inside(
        "design", case, "--target", "axial=500", "--vary", "geometry.length=30:40", "--strict", "--json", "-q"
    )
    assert done.exit_code == 1, done.output
    result = json.loads(done.output)
    assert not result["met"]
    assert result["design"]["geometry.length"]["at_bound"]
    assert result["problems"][0]["name"] == "target_missed"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--target", "axail=350", "--vary", "geometry.length=30:40"], 'did you mean "axial"?'),
        (["--target", "axial", "--vary", "geometry.length=30:40"], "is not NAME=VALUE"),
        (["--target", "axial.secant=350", "--vary", "geometry.length=30:40"], "needs a travel"),
        (["--target", "axial=350", "--vary", "geometry.length=30,40"], "has no range to search"),
        (["--target", "axial=350", "--vary", "geometry.lenght=30:40"], 'did you mean "length"?'),
        (
            ["--target", "axial=350", "--vary", "geometry.length=30:40", "--tolerance", "geometry.x=1"],
            "has no",
        ),
    ],
)
def test_wrong_targets_end_in_a_sentence(inside, case, options, message):
    done = inside("design", case, *options)
    assert done.exit_code == 2
    assert message in done.output
    assert "Traceback" not in done.output


def test_the_page_is_served_to_this_machine_only(command_line, case, tmp_path):
    out = tmp_path / "out"
    assert command_line("check", case, "-o", out).returncode == 0
    refused = command_line("view", out)
    assert refused.returncode == 2
    assert "has no report.html" in refused.stderr
    (out / "report.html").write_text("<!doctype html><title>page</title>")
    command = [sys.executable, "-m", "bushcli.cli", "view", str(out), "--serve", "--port", "0"]
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        command, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            address = process.stdout.readline().strip()
            assert address.startswith("http://127.0.0.1:")
            with urllib.request.urlopen(address, timeout=10) as page:
                assert b"<title>page</title>" in page.read()
            for path, host in (("/", None), ("/../case.toml", None), ("/report.html", "evil.example")):
                request = urllib.request.Request(
                    address.rsplit("/", 1)[0] + path, headers={"Host": host} if host else {}
                )
                with pytest.raises(urllib.error.HTTPError, match=r"40[34]") as refused:
                    urllib.request.urlopen(request, timeout=10)
                refused.value.close()
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=20)
    assert process.returncode == 0


@pytest.mark.parametrize(
    ("path", "code"),
    [
        ("report.html", 200),
        ("inside.txt", 404),
        ("result.json", 404),
        ("", 404),
        ("outside.txt", 404),
        ("folder/secret.txt", 404),
        ("deep/", 404),
        ("pipe", 404),
        ("%00", 404),
    ],
)
def test_only_the_page_is_served(tmp_path, path, code):
    """Other files beside it, links, an index.html that is one, and a pipe, which would never end, are not."""
    out = tmp_path / "out"
    (out / "deep").mkdir(parents=True)
    (tmp_path / "secret.txt").write_text("secret")
    (out / "report.html").write_text("page")
    (out / "result.json").write_text("secret")
    (out / "inside.txt").symlink_to("report.html")
    (out / "outside.txt").symlink_to(tmp_path / "secret.txt")
    (out / "folder").symlink_to(tmp_path)
    (out / "deep" / "index.html").symlink_to(tmp_path / "secret.txt")
    os.mkfifo(out / "pipe")
    with page_server(out / "report.html", "127.0.0.1", 0) as server:
        Thread(target=server.handle_request, daemon=True).start()
        client = HTTPConnection("127.0.0.1", server.server_port, timeout=10)
        client.request("GET", f"/{path}")
        answer = client.getresponse()
        assert answer.status == code
        assert b"secret" not in answer.read()
        client.close()


def test_the_manual_has_every_command_and_option():
    run = subprocess.run(
        [sys.executable, "-m", "bushcli.cli.manual"],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stdout.startswith('.\\"')
    for name, command in main.commands.items():
        assert f".SS bushcli {name}" in run.stdout
        for parameter in command.params:
            for option in (one for one in parameter.opts if one.startswith("--")):
                assert option.replace("-", "\\-") in run.stdout
    # A line that begins with a dot is a macro; only macros of man(7) are allowed.
    macros = {line.split()[0] for line in run.stdout.splitlines() if line.startswith((".", "'"))}
    assert macros <= {'.\\"', ".TH", ".SH", ".SS", ".PP", ".TP", ".B", ".I"}


def test_the_shell_completes_commands_and_options():
    def completed(words, number):
        environment = {"_BUSHCLI_COMPLETE": "bash_complete", "COMP_WORDS": words, "COMP_CWORD": str(number)}
        run = subprocess.run(
            [sys.executable, "-c", "from bushcli.cli import main; main(prog_name='bushcli')"],
            env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
            capture_output=True,
            text=True,
            check=False,
        )
        return [line.partition(",")[2] for line in run.stdout.splitlines()]

    assert completed("bushcli st", 1) == ["study"]
    assert "--vary" in completed("bushcli study --v", 2)
    assert "saltelli" in completed("bushcli study --sampling s", 3)
