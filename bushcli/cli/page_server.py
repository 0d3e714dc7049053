"""Web server on this machine's own address for the page of a result."""

from __future__ import annotations

import sys
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any


def page_server(folder: Path, address: str, port: int) -> ThreadingHTTPServer:
    """Return a server of the files of a folder, which has bound its port but not started.

    Parameters
    ----------
    folder : Path
        Only its files and those below it are served.
    address : str
        Address of this machine to listen on, "127.0.0.1".
    port : int
        Port number, 0 to 65535; 0 takes a free one.

    Raises
    ------
    OSError
        If the port cannot be used.
    """
    return _Server((address, port), partial(_Quiet, hosts=(address, "localhost"), directory=str(folder)))


class _Server(ThreadingHTTPServer):
    """A server that does not report browsers which disconnect before they have the whole page."""

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report errors that the browser did not cause."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


class _Quiet(SimpleHTTPRequestHandler):
    """Serves files without log messages and without listings of folders."""

    def __init__(self, *arguments: Any, hosts: tuple[str, ...], **options: Any) -> None:
        self.hosts = hosts
        # The base class answers the request in its constructor.
        super().__init__(*arguments, **options)

    def send_head(self) -> Any:
        """Refuse requests under another host name, by which a page of another site could read the result.

        Files outside the folder and everything that is not a file are refused, too.
        """
        if self.headers.get("Host", "").rsplit(":", 1)[0] not in self.hosts:
            self.send_error(403)
            return None
        if not self._is_inside(Path(self.translate_path(self.path))):
            self.send_error(404)
            return None
        return super().send_head()

    def _is_inside(self, path: Path) -> bool:
        """Whether a path leads to a file of the folder.

        A symbolic link may lead out of it; of a folder the base class would serve index.html, which may be one.
        """
        try:
            return path.is_file() and path.resolve().is_relative_to(Path(self.directory).resolve())
        except (OSError, ValueError, RuntimeError):  # a null character, a loop of links
            return False

    def log_message(self, format: str, *arguments: Any) -> None:
        """Print nothing."""

    def list_directory(self, path: Any) -> None:
        """Refuse: the page refers to files only."""
        self.send_error(404)
