"""A headless Chromium found on the machine, driven over its debugging pipe: no further package.

Messages are JSON with a zero byte behind each, to file descriptor 3 and from file descriptor 4 of
the browser (its flag `--remote-debugging-pipe`).
"""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--hide-scrollbars",
    "--no-first-run",
    "--disable-extensions",
    "--disable-background-networking",
    "--disable-component-update",
    "--remote-debugging-pipe",
)
_LAUNCH = """
import fcntl, os, sys
ends = [fcntl.fcntl(int(number), fcntl.F_DUPFD, 64) for number in sys.argv[1:3]]
for end, number in zip(ends, (3, 4)):
    os.dup2(end, number)
os.execv(sys.argv[3], sys.argv[3:])
"""
PATIENCE = 60.0  # [s] for one answer, on a busy machine


def find_chromium() -> str | None:
    """The browser of this machine; None if there is none."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class BrowserError(Exception):
    """The browser did not answer, or a script in its page failed."""


class Tab:
    """One page of a browser."""

    def __init__(self, browser: _Pipe, session: str) -> None:
        self._browser, self._session = browser, session
        self.events: list[Mapping[str, Any]] = []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> Mapping[str, Any]:
        """Ask the browser for something."""
        return self._browser.call(method, parameters, self._session, self.events)

    def open(self, url: str) -> None:
        """Load a page, and wait until it has been."""
        self.events.clear()
        self.call("Page.navigate", url=url)
        self.wait_for("Page.loadEventFired")

    def wait_for(self, method: str) -> None:
        """Wait for an event."""
        deadline = time.monotonic() + PATIENCE
        while not any(event.get("method") == method for event in self.events):
            self._browser.read(deadline, self.events)

    def run(self, script: str) -> Any:
        """The value of an expression in the page; promises are waited for."""
        answer = self.call(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in answer:
            raise BrowserError(str(answer["exceptionDetails"]))
        return answer["result"].get("value")

    def size(self, width: int, height: int, mobile: bool = False) -> None:
        """Give the window a size in pixels."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=mobile,
        )

    def media(self, media: str = "", **features: str) -> None:
        """Pretend a medium, such as print, and what the user prefers."""
        listed = [
            {"name": name.replace("_", "-"), "value": value} for name, value in features.items()
        ]
        self.call("Emulation.setEmulatedMedia", media=media, features=listed)

    @property
    def complaints(self) -> list[str]:
        """Errors and warnings of the page since it was opened."""
        found = []
        for event in self.events:
            method, about = event.get("method"), event.get("params", {})
            if method == "Runtime.exceptionThrown":
                found.append(str(about["exceptionDetails"]))
            elif method == "Log.entryAdded" and about["entry"]["level"] in ("error", "warning"):
                found.append(str(about["entry"]["text"]))
            elif method == "Runtime.consoleAPICalled" and about["type"] in ("error", "warning"):
                found.append(str(about["args"]))
        return found

    @property
    def requests(self) -> list[str]:
        """Addresses that the page asked for since it was opened."""
        return [
            event["params"]["request"]["url"]
            for event in self.events
            if event.get("method") == "Network.requestWillBeSent"
        ]


class _Pipe:
    """The debugging pipe of a browser."""

    def __init__(self, write: int, read: int) -> None:
        self._write, self._read = write, read
        self._number, self._buffer = 0, b""
        self._answers: dict[int, Mapping[str, Any]] = {}

    def call(
        self,
        method: str,
        parameters: Mapping[str, Any],
        session: str | None,
        events: list[Mapping[str, Any]],
    ) -> Mapping[str, Any]:
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._write, data) :]

        deadline = time.monotonic() + PATIENCE
        while self._number not in self._answers:
            self.read(deadline, events)
        answer = self._answers.pop(self._number)
        if "error" in answer:
            raise BrowserError(f"{method}: {answer['error']}")
        found: Mapping[str, Any] = answer["result"]
        return found

    def read(self, deadline: float, events: list[Mapping[str, Any]]) -> None:
        """Read what there is; wait for it if there is nothing."""
        left = deadline - time.monotonic()
        if left <= 0 or not select.select([self._read], [], [], left)[0]:
            raise BrowserError("the browser does not answer")
        data = os.read(self._read, 1 << 20)
        if not data:
            raise BrowserError("the browser has ended")
        self._buffer += data
        *messages, self._buffer = self._buffer.split(b"\0")
        for message in map(json.loads, messages):
            if "id" in message:
                self._answers[message["id"]] = message
            else:
                events.append(message)


@contextmanager
def browser_tab(path: str, flags: Sequence[str] = ()) -> Iterator[Tab]:
    """A tab of a browser of its own, which ends with the block."""
    to_browser, from_browser = os.pipe(), os.pipe()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        # a process of Python gives both ends the numbers that the browser expects, and becomes it
        process = subprocess.Popen(
            [
                *(sys.executable, "-c", _LAUNCH, str(to_browser[0]), str(from_browser[1])),
                *(path, *FLAGS, f"--user-data-dir={Path(profile)}", *flags, "about:blank"),
            ],
            pass_fds=(to_browser[0], from_browser[1]),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_browser[0])
        os.close(from_browser[1])

        pipe = _Pipe(to_browser[1], from_browser[0])
        try:
            target = pipe.call("Target.createTarget", {"url": "about:blank"}, None, [])
            attached = pipe.call(
                "Target.attachToTarget", {"targetId": target["targetId"], "flatten": True}, None, []
            )
            yield Tab(pipe, attached["sessionId"])
            pipe.call("Browser.close", {}, None, [])
        finally:
            try:
                process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            os.close(to_browser[1])
            os.close(from_browser[0])
