"""The command line: reads arguments, calls the functions that do the work, prints. Nothing else prints.

Data go to stdout, narration and progress to stderr. What a command needs is imported inside it, so that --help answers
at once. Under MPI every rank does the same and only the first one prints.
"""

from __future__ import annotations

import atexit
import gc
import io
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from bushcli import __version__
from bushcli.cli.case import check, direct, dynamic, mesh
from bushcli.cli.compare import compare
from bushcli.cli.diagnosis import diagnose
from bushcli.cli.export import export
from bushcli.cli.identification import batch, fit, inverse
from bushcli.cli.run import EXIT_CODES, INTERRUPTED, WRONG_INPUT, report_mistake, unwritable
from bushcli.cli.study import design, study
from bushcli.cli.tool import doctor, init, list_
from bushcli.cli.view import view
from bushcli.errors import nearest, printable


class _Commands(click.Group):
    """A group that suggests the nearest command, and reports in a sentence that its output cannot be written."""

    def main(self, args: Sequence[str] | None = None, *others: Any, **extra: Any) -> Any:
        typed = list(sys.argv[1:] if args is None else args)
        # DOLFINx and reports cannot contain bytes that are no text.
        for text in typed:
            if any("\ud800" <= character <= "\udfff" for character in text):
                what = "contains bytes that are not text in the encoding of this system"
                remedy = "rename the file, or write the value anew"
                click.echo(f"error: {printable(text)}: {what} ({remedy})", err=True)
                sys.exit(WRONG_INPUT)
        _make_usable()
        try:
            return super().main(typed, *others, **extra)
        except OSError as error:
            sys.exit(unwritable(error))
        except MemoryError as error:
            sys.exit(report_mistake(error))

    def make_context(self, *args: Any, **extra: Any) -> click.Context:
        with _printable_usage():
            return super().make_context(*args, **extra)

    def invoke(self, ctx: click.Context) -> Any:
        with _printable_usage():
            return super().invoke(ctx)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            close = nearest(args[0], self.list_commands(ctx)) if args else ""
            if close:
                error.message += f' Did you mean "{close}"?'
            raise


@contextmanager
def _printable_usage() -> Iterator[None]:
    """Escape control characters in click's message, which repeats what the user typed: a terminal would act on them.

    An interruption before the command has begun gets its exit code here; click's own is 1.
    """
    try:
        yield
    except click.UsageError as error:
        error.message = printable(error.message)
        raise
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


def _make_usable() -> None:
    """Make folder, environment, garbage collector and streams usable for libraries and worker processes."""
    try:
        os.getcwd()  # noqa: PTH109 - Path.cwd is the same
    except OSError:
        # Relative paths, results too, would go elsewhere or nowhere.
        what = "the working directory no longer exists"
        click.echo(f"error: {what} (change to another one: cd DIRECTORY)", err=True)
        sys.exit(WRONG_INPUT)
    # Open MPI does not start without HOME, which Python finds in the system's list of users.
    try:
        os.environ.setdefault("HOME", str(Path.home()))
    except RuntimeError:  # no such user, as in a container whose user is only a number
        import tempfile

        os.environ["HOME"] = tempfile.gettempdir()
    # Pictures are only saved; the backend of a notebook, which commands inherit, may not exist here.
    os.environ["MPLBACKEND"] = "agg"
    # A library that is imported may warn of another one; with "error" the command would end there.
    if os.environ.pop("PYTHONWARNINGS", None):
        warnings.resetwarnings()
    # Open MPI ends with exit code 59 if this is no folder that can be written; Python then takes /tmp, for example.
    if "TMPDIR" in os.environ and not os.access(Path(os.environ["TMPDIR"]) / ".", os.W_OK | os.X_OK):
        import tempfile

        os.environ["TMPDIR"] = tempfile.gettempdir()
    # Saves 20 ms at start: pydantic would search all packages for plugins, and check the schemas that it makes.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    os.environ.setdefault("PYDANTIC_SKIP_VALIDATING_CORE_SCHEMAS", "1")
    # The libraries make some 150,000 objects, nearly all of which stay: of the 0.74 s of `bushcli direct` on the axial
    # case of the benchmark, the usual collector takes 0.02 s while they are made, and 0.03 s at exit. The peak memory
    # of `bushcli diagnose` is the same with both settings within 1 %.
    gc.set_threshold(100_000, 50, 1000)
    atexit.register(gc.freeze)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        # Of a stream that the caller closed (`>&-`) Python has None, and the next file that is opened gets its number:
        # what a library prints would be written into it.
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode))  # noqa: PTH123, SIM115 - stays open until the end
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # Python might print a surrogate as its byte.
            stream.reconfigure(errors="backslashreplace")


@click.group(
    cls=_Commands,
    epilog="Exit codes: " + "; ".join(f"{code} {meaning}" for code, meaning in EXIT_CODES.items()) + ".",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(__version__, prog_name="bushcli")
def main() -> None:
    """Simulate rubber bushings and correlate them with test-rig recordings.

    A case file (TOML) describes the bushing and lists its recordings and coupon tests; `bushcli init` writes an
    example. Units are N, mm, MPa, s and degrees.
    """


for _command in (
    *(init, check, mesh, fit, direct, dynamic, inverse, batch, compare, diagnose),
    *(export, study, design, view, list_, doctor),
):
    main.add_command(_command)

__all__ = ["main"]
