"""The `view` command, which shows the page of a result."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import quote

import click

from bushcli.cli.run import DONE, finish
from bushcli.errors import InputError, Problem

LOCAL = "127.0.0.1"
# The same name as in `bushcli.report`, which takes half a second to load.
REPORT = "report.html"


@click.command()
@click.argument("output", type=click.Path(path_type=Path))
@click.option(
    "--serve",
    is_flag=True,
    help="Serve the page, and no other file, on this machine's own address instead, until Ctrl-C; for a remote machine "
    "forward the port: ssh -L 8000:127.0.0.1:8000 MACHINE.",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=8000,
    show_default=True,
    help="Port for --serve; 0 takes a free one.",
)
def view(output: Path, serve: bool, port: int) -> None:
    """Open the page of a result in the browser; OUTPUT is the folder that was given with -o, or the page itself."""
    finish(lambda: _serve(_page(output), port) if serve else _open(_page(output)), debug=False)


def _page(output: Path) -> Path:
    """Return the page of a folder of results."""
    page = output / REPORT if output.is_dir() else output
    if page.is_file() and page.suffix == ".html":
        return page.absolute()
    if not output.exists():
        raise InputError(Problem(str(output), "does not exist", "", "the folder that was given with -o"))
    below = sorted(str(page.parent) for page in output.glob(f"*/{REPORT}")) if output.is_dir() else []
    what = f"has no {REPORT}" if output.is_dir() else "is not a page"
    expected = ", ".join(below[:5]) or "a folder that was given with -o"
    raise InputError(Problem(str(output), what, "", expected))


def _open(page: Path) -> int:
    import webbrowser

    if not webbrowser.open(page.as_uri()):
        what = "no browser could be started"
        raise InputError(Problem(str(page), what, "", "open the file yourself, or use --serve"))
    click.echo(page.as_uri())
    return DONE


def _serve(page: Path, port: int) -> int:
    # Python's web server takes a hundredth of a second to load, which no other command needs.
    from bushcli.cli.page_server import page_server

    try:
        server = page_server(page, LOCAL, port)
    except OSError as error:
        what, remedy = (
            f"cannot be used: {error.strerror or error}",
            "choose another port, or 0 for a free one",
        )
        raise InputError(Problem(f"--port {port}", what, "", remedy)) from None
    with server:
        click.echo(f"http://{LOCAL}:{server.server_port}/{quote(page.name)}")
        click.echo("Ctrl-C ends it", err=True)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            return DONE
    return DONE
