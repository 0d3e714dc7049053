"""Web server on this machine's own address for the page of a result."""

from __future__ import annotations

import sys
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any


def page_server(page: Path, address: str, port: int) -> ThreadingHTTPServer:
    """Return a server of a page, which has bound its port, or raised OSError, but not started."""
    return _Server((address, port), partial(_Quiet, hosts=(address, "localhost"), page=page))


class _Server(ThreadingHTTPServer):
    """A server that does not report browsers which disconnect before they have the whole page."""

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report errors that the browser did not cause."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


class _Quiet(SimpleHTTPRequestHandler):
    """Serves a page, without log messages."""

    def __init__(self, *arguments: Any, hosts: tuple[str, ...], page: Path) -> None:
        self.hosts, self.page = hosts, page
        # The base class answers the request in its constructor.
        super().__init__(*arguments, directory=str(page.parent))

    def send_head(self) -> Any:
        """Refuse requests under another host name, by which a page of another site could read the result.

        Every other file is refused, too, and a page that is a link out of its folder.
        """
        if self.headers.get("Host", "").rsplit(":", 1)[0] not in self.hosts:
            self.send_error(403)
            return None
        path = Path(self.translate_path(self.path))
        if path != self.page or not self.page.resolve().is_relative_to(self.page.parent.resolve()):
            self.send_error(404)
            return None
        return super().send_head()

    def log_message(self, format: str, *arguments: Any) -> None:
        """Print nothing."""
