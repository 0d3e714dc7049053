"""A full disk, no HOME, a cache that is a file: one message, exit code 2, and computed results are still printed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest

from bushcli.cli import main
from bushcli.errors import printable
from cases.jit import cache_directory

ROOT = Path(__file__).parents[2]


def run(*arguments, cwd=None, stdout=subprocess.PIPE, **changes):
    environment = {key: value for key, value in (os.environ | changes).items() if value is not None}
    return subprocess.run(
        [sys.executable, "-m", "bushcli.cli", *map(str, arguments)],
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        cwd=cwd or ROOT,
        env=environment | {"PYTHONPATH": str(ROOT)},
        check=False,
        timeout=300,
    )


def refused(done):
    return done.returncode == 2 and "Traceback" not in done.stderr and "internal error" not in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize(
    "command", [["--help"], ["list", "laws"], ["check", "case"], ["direct", "case", "-q", "--json"]]
)
def test_a_full_disk_behind_standard_output(small, command):
    with Path("/dev/full").open("w") as full:
        done = run(*(small if word == "case" else word for word in command), stdout=full)
    assert refused(done)
    assert "error: standard output: cannot be written: No space left on device" in done.stderr


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_closed_standard_streams(small, closed):
    command = f'"{sys.executable}" -m bushcli.cli check "{small}" {closed}'
    done = subprocess.run(
        ["sh", "-c", command], capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)}
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_a_cache_that_is_a_file(small, tmp_path):
    (tmp_path / "cache").write_text("mine")
    done = run("direct", small, "-q", BUSHCLI_CACHE=str(tmp_path / "cache"))
    assert refused(done)
    assert "compiled kernels are saved there; BUSHCLI_CACHE=/path chooses another folder" in done.stderr
    examined = run("doctor", BUSHCLI_CACHE=str(tmp_path / "cache"))
    assert examined.returncode == 1
    assert f"{tmp_path / 'cache'} is a file" in examined.stdout


@pytest.mark.parametrize(
    "environment", [{"HOME": None}, {"TMPDIR": "/dev/full", "PYTHONWARNINGS": "error"}], ids=" ".join
)
def test_an_environment_in_which_libraries_do_not_start(small, environment):
    """Open MPI needs HOME and a folder for temporary files; libraries warn of each other when they are imported."""
    done = run("direct", small, "-q", **environment)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_an_output_that_no_file_system_takes(small, tmp_path):
    for folder in (tmp_path / ("x" * 300), "/proc/x", small / "x"):
        done = run("direct", small, "-q", "-o", folder)
        assert refused(done)
        assert done.stderr.startswith("error: ")


def test_escape_characters_are_written_out(small, tmp_path):
    (tmp_path / "axial.csv").write_text("time_s,dis\x1b[31mplacement_mm,for\x9bce_N\n" + "1,2,3\n2,3,5\n" * 3)
    for arguments in (
        ["check", small],
        ["check", "a\x1b[31mb.toml"],
        ["check", small, "--set", "x\x1b]0;y\x07=1"],
    ):
        done = run(*arguments)
        assert done.returncode == 2
        assert not {"\x1b", "\x9b", "\x07"} & set(done.stdout + done.stderr)


@pytest.mark.parametrize(
    "arguments",
    [
        ["check", "case", "--set", "title='{}'"],
        ["check", "case", "--set", "{}=1"],
        ["check", "{}.toml"],
        ["list", "{}"],
        ["init", "{}"],
        ["check", "case", "-o", "{}"],
    ],
    ids=str,
)
def test_bytes_that_are_not_utf8_are_refused_and_written_out(inside, small, tmp_path, monkeypatch, arguments):
    """Byte 0x9b begins a command of the terminal, as ESC [ does."""
    monkeypatch.chdir(tmp_path)
    bad = os.fsdecode(b"a\x9b31m\xff")
    done = inside(*(small if word == "case" else word.format(bad) for word in arguments))
    assert done.exit_code == 2, done.output
    assert not (tmp_path / bad).exists()
    printed = done.stdout_bytes + (done.stderr_bytes or b"")
    assert b"\x9b31m" not in printed
    assert b"\\x9b31m" in printed or b"\\udc9b31m" in printed


@pytest.mark.parametrize(
    ("text", "shown"), [("\x1b", r"\x1b"), ("\udc9b", r"\x9b"), ("\ud800", r"\ud800"), ("\u202e", r"\u202e")]
)
def test_control_characters_are_written_out(text, shown):
    assert printable(f"a{text}b") == f"a{shown}b"


@pytest.mark.slow
def test_a_channel_with_a_path_for_a_name_stays_in_the_folder(small, tmp_path):
    small.write_text(small.read_text() + 'name = "../../escaped"\n')
    done = run("direct", small, "-q", "-o", tmp_path / "deep" / "out")
    assert done.returncode == 0, done.stderr
    assert not list(tmp_path.glob("escaped*"))
    assert {"escaped.csv", "escaped.xdmf", "escaped.h5"} <= {
        p.name for p in (tmp_path / "deep" / "out").iterdir()
    }
    again = run("direct", small, "-q", "-o", tmp_path / "deep" / "out")
    assert again.returncode == 0, again.stderr


def test_a_field_file_that_is_the_users_is_not_replaced(small, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "axial.h5").write_text("mine")
    done = run("direct", small, "-q", "-o", tmp_path / "out")
    assert refused(done)
    assert (tmp_path / "out" / "axial.h5").read_text() == "mine"


@pytest.mark.parametrize(
    "arguments", [["a\x1bb"], ["check", "case", "--a\x1bb"], ["list", "a\x1bb"], ["--a\x1bb"]]
)
def test_usage_errors_write_escape_characters_out(arguments):
    """On a terminal; elsewhere Click takes them away."""
    with pytest.raises(click.UsageError) as caught:
        main.main(arguments, standalone_mode=False)
    assert "\x1b" not in caught.value.message
    assert "\\x1b" in caught.value.format_message()


def test_the_example_is_not_written_through_a_link(tmp_path):
    (tmp_path / "case.toml").symlink_to(tmp_path / "elsewhere")
    done = run("init", tmp_path)
    assert refused(done)
    assert "case.toml: exists already and is not overwritten" in done.stderr
    assert not (tmp_path / "elsewhere").exists()


@pytest.mark.slow
def test_a_bulk_modulus_below_that_of_the_fitted_law():
    """The law comes from coupons, so that the check of the case cannot compare its moduli."""
    example, options = (
        ROOT / "examples" / "batch" / "case.toml",
        ("-q", "--set", "material.bulk_modulus=1e-10"),
    )
    fitted = run("fit", example, *options)
    assert fitted.returncode == 0
    assert "problem bulk_modulus_too_small" in fitted.stdout
    simulated = run("direct", example, *options)
    assert refused(simulated)
    assert "bulk_modulus = 1e-10 is too small for a shear modulus of" in simulated.stderr


@pytest.mark.slow
def test_damaged_evaluations_are_calculated_again_and_reported(small, tmp_path):
    command = ("inverse", small, "--model", "neo_hookean", "-q", "-o", tmp_path / "out")
    first = run(*command)
    assert first.returncode == 0, first.stderr
    saved = sorted((tmp_path / "out").glob("history-*/*.npz"))
    for file in saved[:3]:
        file.write_bytes(file.read_bytes()[:-37])
    again = run(*command, "--resume")
    assert again.returncode == 0, again.stderr
    assert f"problem history_damaged: {min(3, len(saved))} saved result" in again.stdout


@pytest.mark.parametrize("command", ["check", "direct", "inverse"])
def test_free_play_as_large_as_the_travel(small, command):
    small.write_text(
        small.read_text() + "\n[[effects]]\nname = 'free_play'\nparameters = {half_width = 9.5}\n"
    )
    done = run(command, small, "-q")
    assert refused(done)
    assert "free_play.half_width = 9.5 takes up all of the travel of axial" in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [["check", "d\udce9but.toml"], ["check", "case.toml", "--set", 'title="\udc9b31m"'], ["\udcff"]],
)
def test_arguments_that_are_no_text_are_refused(arguments):
    """A file's name in Latin-1, for example: libraries and reports cannot contain it."""
    done = run(*arguments)
    assert refused(done)
    assert "not text in the encoding of this system" in done.stderr
    assert "\\x" in done.stderr


def test_a_working_directory_that_was_deleted(tmp_path):
    (tmp_path / "gone").mkdir()
    command = f'cd "{tmp_path}/gone" && rmdir ../gone && exec "{sys.executable}" -m bushcli.cli list laws'
    done = subprocess.run(
        ["sh", "-c", command], capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)}
    )
    assert refused(done)
    assert "the working directory no longer exists" in done.stderr


@pytest.mark.parametrize("command", ["check", "direct"])
def test_too_little_memory_is_said(small, command):
    limited = f'ulimit -v 300000; exec "{sys.executable}" -m bushcli.cli {command} "{small}"'
    done = subprocess.run(
        ["sh", "-c", limited], capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)}
    )
    assert "Traceback" not in done.stderr
    assert done.returncode in ((0, 2) if command == "check" else (2,)), done.stderr
    if done.returncode:
        assert "memory: is not enough" in done.stderr


def test_a_limit_of_the_shell_that_suffices_is_no_fault_of_a_binary_file(small):
    """The process that reads the file has limits of its own; it keeps a narrower one of the shell."""
    nptdms = pytest.importorskip("nptdms")
    q = np.linspace(0.0, 1.0, 50)
    with nptdms.TdmsWriter(small.parent / "axial.tdms") as file:
        for name, unit, values in (("Displacement", "mm", q), ("Force", "N", 200.0 * q)):
            waveform = {"wf_increment": 0.1, "wf_samples": 50, "unit_string": unit}
            file.write_segment([nptdms.ChannelObject("rig", name, values, properties=waveform)])
    small.write_text(small.read_text().replace("axial.csv", "axial.tdms"))
    limited = f'ulimit -v 3000000; exec "{sys.executable}" -m bushcli.cli check "{small}"'
    done = subprocess.run(
        ["sh", "-c", limited], capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)}
    )
    assert done.returncode == 0, done.stderr


def test_a_home_without_a_name(small):
    done = run("direct", small, "-q", HOME="", BUSHCLI_CACHE=str(cache_directory().parents[1]))
    assert done.returncode == 0, done.stderr


def test_exit_codes_have_one_definition():
    from bushcli.cli.run import EXIT_CODES

    table = (ROOT / "docs" / "results.md").read_text().partition("## Exit codes")[2].partition("\n## ")[0]
    assert [int(line.split("|")[1]) for line in table.splitlines() if line[2:3].isdigit()] == list(EXIT_CODES)
    readme = (ROOT / "README.md").read_text().partition("## Exit codes")[2].partition("\n## ")[0]
    shown = " ".join(run("--help").stdout.split())
    for code, meaning in EXIT_CODES.items():
        assert f"{code} {meaning}" in shown
        assert f"{code} {meaning.partition(',')[0].partition(' (')[0]}" in " ".join(readme.split())
