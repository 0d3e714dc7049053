"""Common parts of all commands: options, streams, timings, and exit codes for errors."""

from __future__ import annotations

import errno
import functools
import io
import json as json_format
import os
import resource
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import click

from bushcli.errors import InputError, Problem, printable
from bushcli.runtime.interrupt import hold, let_go, listen, ranks_started
from cases.interrupt import is_interrupt
from geometry.errors import GeometryError

if TYPE_CHECKING:
    from bushcli.case import Case
    from bushcli.recording.table_cache import TableCache
    from bushcli.report.document import Document
    from bushcli.report.results import Result
    from bushcli.runtime.condition import Condition

DONE, NEGATIVE, WRONG_INPUT, NOT_CONVERGED, MISTAKE, INTERRUPTED = 0, 1, 2, 3, 70, 130
#: Meaning of each exit code, for `--help`; README and docs/results.md have the same codes.
EXIT_CODES = {
    DONE: "done",
    NEGATIVE: "done, but the verdict is negative and --strict was given, or `doctor` found problems",
    WRONG_INPUT: "an error in the command line, the case file, a recording, or the surroundings (memory, folders)",
    NOT_CONVERGED: "a simulation or the fit of an answer did not converge",
    MISTAKE: "an error in bushcli",
    INTERRUPTED: "interrupted",
}
# Bytes of address space: `bushcli direct` of a plain bushing takes 0.79e9 (VmPeak), and with less some libraries end
# the process by a signal; a large mesh takes some 10e9 (`bushcli.case.limits`), so that a limit below can be the cause.
_LEAST, _ENOUGH = 750_000_000, 10_000_000_000
# Characters in a line of piped output, and the least on a terminal.
WIDTH, NARROWEST = 120, 100


class Run:
    """Options that every command on a case shares."""

    def __init__(
        self,
        command: str,
        case: Path,
        overrides: tuple[str, ...],
        output: Path | None,
        json: bool,
        quiet: bool,
        verbose: bool,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        self.options = options or {}
        self.question = ""
        self.command, self.path, self.overrides, self.output = command, case, overrides, output
        self.json, self.quiet, self.verbose = json, quiet, verbose
        self.begin = time.perf_counter()
        self.seconds: dict[str, float] = {}

    def load(self, parts: bool = False) -> Case:
        """Read and validate the case; with `parts` also a CAD file or a drawing in place of one."""
        from bushcli.case import load_case, load_part, shape_of_part

        if self.options.get("resume") and self.output is None:
            raise InputError(Problem("--resume", "needs the folder of the run to continue", "", "-o DIR"))
        with self.timer("case"):
            if parts and shape_of_part(self.path):
                case = load_part(self.path, self.overrides)
            else:
                case = load_case(self.path, self.overrides, self.tables)
        if self.output is not None:
            self.prepare(self.output, case)
        return case

    def prepare(self, output: Path, case: Case) -> None:
        """Refuse a folder that cannot be used, or into which another run writes, and say what becomes of its result."""
        from bushcli.report.writers.files import check_output, question_of
        from bushcli.report.writers.folder import moves_to, occupy, staging_folder

        check_output(output, case, self.command)
        has_ranks, ends = number_of_ranks() > 1, click.get_current_context()
        if is_first_rank():
            refused = None
            try:
                ends.call_on_close(occupy(output))
                ends.with_resource(staging_folder(output))
            except InputError as error:
                refused = error
        if has_ranks:
            from mpi4py import MPI

            refused = MPI.COMM_WORLD.bcast(refused if is_first_rank() else None)
        if refused is not None:
            raise refused
        self.question = question_of(self.command, case, self.options)
        moved = moves_to(output, self.command, self.question)
        if moved is not None:
            _complain(
                f"{output} holds a result of `bushcli {moved[0]}`; it moves to {moved[1]} when this run has a result"
            )

    def write_into(self, folder: Path) -> Path:
        """Write into this folder unless the user has given one, and return the folder."""
        self.output = self.output or folder
        return self.output

    @property
    def staging_folder(self) -> Path | None:
        """Folder for files that are written while the command calculates; None without -o."""
        from bushcli.report.writers.folder import STAGING

        return None if self.output is None else self.output / STAGING

    def deliver(self, result: Result) -> None:
        """Write a result into the folder of -o, then print it.

        An interruption waits until the numbers are on disk. Whatever prevents the writing is raised after the printing.
        """
        from bushcli import report

        failure: BaseException | None = None
        if self.output is not None and is_first_rank():
            hold()
        document = report.as_json(result)
        document["timings_s"] = {**self.timings(), **document["timings_s"]}
        if self.output is not None and is_first_rank():
            from bushcli.report.writers.files import write
            from bushcli.report.writers.folder import QUESTION, NotDrawn

            try:
                answer = {**document, QUESTION: self.question}
                files = report.as_files(result)
                written = write(self.output, answer, files, lambda: report.as_document(result))
                self._say_where(self.output, written[0].parent)
                let_go()
            except NotDrawn as error:
                self._say_where(self.output, error.place)
                _complain(
                    f"{error.place} holds the numbers of the result, but not all of its pictures, nor its page: "
                    "the same command again draws them"
                )
                failure = error.cause
            except (InputError, OSError, KeyboardInterrupt) as error:
                failure = error
        if self.shows:
            self.show(report.as_document(result))
        self.emit(document)
        if failure is not None:
            raise failure

    def _say_where(self, output: Path, place: Path) -> None:
        if place == output:
            self.say(f"wrote {output}")
            return
        from bushcli.report.writers.folder import earlier_result

        earlier_command = (earlier_result(output) or {}).get("command", "")
        _complain(
            f"interrupted before the end: {output} keeps the finished result of `bushcli {earlier_command}`; "
            f"the unfinished one is in {place}"
        )

    @functools.cached_property
    def tables(self) -> TableCache:
        """Cache of the binary files that the command reads."""
        from bushcli.recording.table_cache import TableCache

        return TableCache()

    @contextmanager
    def timer(self, name: str) -> Iterator[None]:
        """Add the time of a block to the timings."""
        start = time.perf_counter()
        yield
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start

    def timings(self) -> dict[str, float]:
        """Return the seconds of each stage and the total so far."""
        return {**self.seconds, "total": time.perf_counter() - self.begin}

    def say(self, text: str) -> None:
        """Narrate on stderr, unless quiet."""
        if not self.quiet and is_first_rank():
            with suppress(OSError):  # a stderr that is full or closed costs no result
                click.echo(printable(text), err=True)

    @property
    def shows(self) -> bool:
        """Whether results are printed as text: not if JSON was requested, and by one rank only."""
        return not self.json and is_first_rank()

    def show(self, document: Document) -> None:
        """Print a document on stdout."""
        from rich.console import Console

        from bushcli.report.writers.terminal import terminal_text

        renderable = terminal_text(document)
        if is_terminal(sys.stdout):
            # On a narrower console tables lose words; lines that wrap are the lesser evil.
            console = Console(highlight=False, width=max(Console().width, NARROWEST))
            console.print(renderable)
            return
        text = io.StringIO()
        Console(file=text, width=WIDTH, highlight=False, no_color=True).print(renderable)
        click.echo("\n".join(printable(line.rstrip()) for line in text.getvalue().rstrip().splitlines()))

    def emit(self, result: dict[str, Any]) -> None:
        """Print the result as JSON on stdout, if requested."""
        if self.json and is_first_rank():
            click.echo(json_format.dumps(result, indent=2, allow_nan=False))


def is_terminal(stream: TextIO) -> bool:
    """Whether the stream is a terminal that a person reads."""
    return stream.isatty() and not any(name in os.environ for name in ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE"))


def is_first_rank() -> bool:
    """Whether this process is the first rank; True without MPI."""
    if "mpi4py.MPI" not in sys.modules:
        return True
    from mpi4py import MPI

    return bool(MPI.COMM_WORLD.rank == 0)


def number_of_ranks() -> int:
    """Number of processes that `mpirun` has started; 1 without it."""
    if ranks_started() == 1:
        return 1
    from mpi4py import MPI

    return int(MPI.COMM_WORLD.size)


def wait_for_ranks() -> None:
    """Wait until all ranks of `mpirun` have reached this point; do nothing without it."""
    if number_of_ranks() > 1:
        from mpi4py import MPI

        MPI.COMM_WORLD.Barrier()


class _Folder(click.Path):
    """A folder with a name: an empty name, such as an unset variable of the shell, would mean the current folder."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value == "":
            self.fail("is empty: give the name of a folder", param, ctx)
        return super().convert(value, param, ctx)


def on_a_case(
    command: Callable[..., int | None],
    into: str = "DIR",
    writes: str = "Write result.json there and, by command, report.html, curves, plots and fields.",
) -> Callable[..., None]:
    """Give a command the CASE argument and the common options, and turn its errors into exit codes."""

    @click.argument("case", type=click.Path(path_type=Path))
    @click.option(
        "--set",
        "overrides",
        multiple=True,
        metavar="KEY=VALUE",
        help="Override a key of the case file, e.g. geometry.length=38.",
    )
    @click.option("-o", "--output", type=_Folder(path_type=Path), metavar=into, help=writes)
    @click.option("--json", is_flag=True, help="Print the result as JSON on stdout, and nothing else there.")
    @click.option("-q", "--quiet", is_flag=True, help="Print no messages and no progress.")
    @click.option("-v", "--verbose", is_flag=True, help="Print more: every step of the march, every trial.")
    @click.option("--debug", is_flag=True, help="Show a traceback on errors.")
    @functools.wraps(command)
    def wrapper(
        case: Path,
        overrides: tuple[str, ...],
        output: Path | None,
        json: bool,
        quiet: bool,
        verbose: bool,
        debug: bool,
        **options: Any,
    ) -> None:
        run = Run(command.__name__, case, overrides, output, json, quiet, verbose, options)
        finish(lambda: command(run, **options), debug)

    return wrapper


def verdict_code(conditions: Iterable[Condition], converged: bool, negative: bool) -> int:
    """Return the code of an identification: interrupted, not converged, or whether its verdict is negative."""
    if any(condition.name == "interrupted" for condition in conditions):
        # mpirun ends all ranks as soon as one has ended with this code, and the first one may still be writing.
        wait_for_ranks()
        return INTERRUPTED
    if not converged:
        return NOT_CONVERGED
    return NEGATIVE if negative else DONE


def finish(work: Callable[[], int | None], debug: bool) -> None:
    """Run a command and exit with the code that its result or its error calls for."""
    listen()
    try:
        if 0 < _memory_limit() < _LEAST:
            raise MemoryError
        code = work() or DONE
    except (InputError, GeometryError) as error:
        if debug:
            raise
        _complain(f"error: {error}")
        code = WRONG_INPUT
    except KeyboardInterrupt:
        code = _code_of_interrupt()
    except BrokenPipeError:
        # A pipeline that ends early (`| head`) is not an error.
        sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115 - the interpreter flushes it at exit
        code = DONE
    except OSError as error:
        if debug:
            raise
        # A library that cannot be mapped is an OSError without a number, which names no file.
        starved = error.errno in (None, errno.ENOMEM) and _memory_limit()
        code = report_mistake(error) if starved else unwritable(error)
    except Exception as error:  # the last line of defence between a traceback and a user
        if debug:
            raise
        code = _code_of_interrupt() if is_interrupt(error) else report_mistake(error)
    sys.exit(code)


def _code_of_interrupt() -> int:
    if is_first_rank():
        click.echo("interrupted", err=True)
    return INTERRUPTED


def _complain(text: str) -> None:
    """Print an error on stderr; a stderr that is closed or full is ignored."""
    if is_first_rank():
        with suppress(OSError):
            click.echo(printable(text), err=True)


def unwritable(error: OSError) -> int:
    """Report which file or stream the operating system refused, and return the exit code."""
    place, expected = str(error.filename or "standard output"), ""
    if "cases.jit" in sys.modules:
        cache = str(sys.modules["cases.jit"].cache_directory())
        # A failed write does not name its file: the form compiler writes into the cache, everything else to the output.
        frames = [frame.f_code.co_filename for frame, _ in traceback.walk_tb(error.__traceback__)]
        if error.filename is None and any("ffcx" in frame or "cffi" in frame for frame in frames):
            place = cache
        if place.startswith(cache) or cache.startswith(f"{place}/"):
            expected = "compiled kernels are saved there; BUSHCLI_CACHE=/path chooses another folder"
    action = "written" if place == "standard output" else "read or written"
    what = f"cannot be {action}: {error.strerror or error}"
    _complain(f"error: {Problem(place[:300], what, '', expected)}")
    # The interpreter flushes it at exit, and would fail again.
    sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115
    return WRONG_INPUT


def _memory_limit() -> int:
    """Return the limit on a process's address space in bytes; 0 if there is none, or one that leaves enough."""
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return limit if 0 <= limit < _ENOUGH else 0


def report_mistake(error: Exception) -> int:
    """Report an error that no command expects, or a lack of memory, and return the exit code."""
    from bushcli.runtime.dolfinx_version import installed_dolfinx, untried_dolfinx

    limit = _memory_limit()
    allowed = f"this shell allows a process {limit / 1e9:.2g} GB (ulimit -v)"
    if isinstance(error, MemoryError) or (limit and isinstance(error, ImportError)):
        # Under a limit a library that cannot be mapped is an error of its import.
        memory = allowed if limit else "the memory is full"
        expected = "`ulimit -v unlimited`, a smaller mesh, or fewer processes"
        _complain(f"error: {Problem('memory', f'is not enough: {memory}', '', expected)}")
        return WRONG_INPUT
    if is_first_rank():
        click.echo(printable(f"internal error: {type(error).__name__}: {error}"), err=True)
        click.echo("this is an error in bushcli; --debug shows where", err=True)
        if limit:
            click.echo(f"a possible cause: {allowed}", err=True)
        for possible in untried_dolfinx(installed_dolfinx()):
            click.echo(f"a possible cause: {possible.message}\n  remedy: {possible.remedy}", err=True)
    return MISTAKE
