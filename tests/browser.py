"""A headless Chromium for the tests of the report, driven through its DevTools protocol.

``BUSHCLI_BROWSER`` is the address of a browser that is already running (``tests/with-browser`` starts one where the
isolated root of bushcli does not see the system's programs), ``BUSHCLI_CHROMIUM`` a program to start; without either,
Chromium or Chrome is taken from the PATH.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import time
import urllib.request
from contextlib import contextmanager

from websockets.sync.client import connect

FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars"),
    # If a page makes a request in spite of this, the request finds no host.
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
    "--remote-debugging-port=0",
)
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


@contextmanager
def started(folder):
    """Yield a browser, or None where none is installed."""
    address = os.environ.get("BUSHCLI_BROWSER")
    if address:
        yield Browser(address)
        return
    program = os.environ.get("BUSHCLI_CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        yield None
        return
    with (folder / "log").open("w") as log:
        process = subprocess.Popen(
            [program, *FLAGS, f"--user-data-dir={folder}"], stdout=log, stderr=subprocess.STDOUT
        )
        try:
            yield Browser(f"http://127.0.0.1:{_port(folder, process)}")
        finally:
            process.terminate()
            process.wait(30)


def _port(folder, process):
    """Return the port that the browser has chosen and written into its folder."""
    file, end = folder / "DevToolsActivePort", time.monotonic() + 60.0
    while time.monotonic() < end and process.poll() is None:
        if file.exists() and file.read_text().strip():
            return file.read_text().split()[0]
        time.sleep(0.05)
    raise RuntimeError(f"Chromium did not start: {(folder / 'log').read_text()[-2000:]}")


class Browser:
    """A running browser."""

    def __init__(self, address):
        self.address = address

    @contextmanager
    def page(self, file, dark=False):
        """Open a file in a new tab."""
        request = urllib.request.Request(f"{self.address}/json/new?about:blank", method="PUT")
        with urllib.request.urlopen(request, timeout=30) as reply:
            target = json.load(reply)
        try:
            with connect(target["webSocketDebuggerUrl"], max_size=None) as socket:
                page = Page(socket)
                if dark:
                    media = [{"name": "prefers-color-scheme", "value": "dark"}]
                    page.call("Emulation.setEmulatedMedia", features=media)
                page.open(file)
                yield page
        finally:
            urllib.request.urlopen(f"{self.address}/json/close/{target['id']}", timeout=30).close()


class Page:
    """A tab: the events that it has sent (``events``), and its replies to commands."""

    def __init__(self, socket):
        self.socket, self.events, self.number = socket, [], 0

    def call(self, method, **parameters):
        """Send a command and return its result; events on the way are kept."""
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self.socket.recv(timeout=60))
            if message.get("id") == self.number:
                assert "error" not in message, message
                return message["result"]
            self.events.append(message)

    def open(self, file):
        """Go to a file and wait until it is loaded."""
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call(
            "Emulation.setDeviceMetricsOverride", width=1100, height=1400, deviceScaleFactor=1, mobile=False
        )
        self.call("Page.navigate", url=file.as_uri())
        while not self.said("Page.loadEventFired"):
            self.events.append(json.loads(self.socket.recv(timeout=60)))

    def said(self, method):
        """Parameters of the events of a kind."""
        return [event["params"] for event in self.events if event.get("method") == method]

    def value(self, expression):
        """Evaluate JavaScript."""
        reply = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in reply, reply
        return reply["result"].get("value")

    def troubles(self):
        """Script errors, and what the console and the log complain about."""
        self.value("1")  # all earlier messages have arrived by then
        thrown = [event["exceptionDetails"]["text"] for event in self.said("Runtime.exceptionThrown")]
        spoken = [str(event) for event in self.said("Runtime.consoleAPICalled")]
        return thrown + spoken + [event["entry"]["text"] for event in self.said("Log.entryAdded")]

    def requests(self):
        """Addresses that the page has requested."""
        return [event["request"]["url"] for event in self.said("Network.requestWillBeSent")]
