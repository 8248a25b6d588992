"""A browser's side of the console: requests with cookie and origin, and frames."""

import copy
import http.client
import json
import re
import ssl
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread
from typing import Any, Self

from websockets.sync.client import ClientConnection, connect

LINK = re.compile(r"open (https?://[^:/]+:(\d+)/#?(\S*))")


class OperatorPage:
    """A console in a process of its own, and one page that has logged in to it."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.lines: list[str] = []
        while not (found := LINK.match(self.lines[-1] if self.lines else "")):
            self.lines.append(assert_line(process))
        self.link, self.port, self.token = found[1], int(found[2]), found[3]
        self.scheme = self.link.partition(":")[0]
        self.host = f"127.0.0.1:{self.port}"
        self.cookie = ""

    def log_in(self, **words: str) -> dict[str, str]:
        """Log in with the link, or with user and password; returns the headers of the answer."""
        status, content, headers = self.request("POST", "/api/login", words or {"token": self.token})
        assert status == 200, content
        self.cookie = headers["set-cookie"].partition(";")[0]
        return headers

    def another(self, **words: str) -> Self:
        """A page of another browser, where a user has logged in."""
        other = copy.copy(self)
        other.cookie = ""
        other.log_in(**words)
        return other

    def lease(self, vehicle: str, change: str) -> dict[str, Any]:
        status, content, _ = self.request("POST", "/api/lease", {"vehicle": vehicle, "change": change})
        assert status == 200, content
        return json.loads(content)

    def request(self, method: str, path: str, body: Any = None, **headers: str) -> tuple[int, bytes, dict[str, str]]:
        if self.scheme == "https":
            context = ssl._create_unverified_context()
            connection = http.client.HTTPSConnection("127.0.0.1", self.port, timeout=30, context=context)
        else:
            connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        sent = {"Origin": f"{self.scheme}://{self.host}", "Cookie": self.cookie, **headers}
        data = json.dumps(body) if isinstance(body, dict) else body
        connection.request(method, path, data, sent)
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, content, {name.lower(): value for name, value in answer.getheaders()}

    def order(self, vehicle: str, order: str, **words: object) -> dict[str, Any]:
        status, content, _ = self.request("POST", "/api/order", {"vehicle": vehicle, "order": order, **words})
        assert status == 200, content
        return json.loads(content)

    def get(self, path: str) -> Any:
        status, content, _ = self.request("GET", path)
        assert status == 200, content
        return json.loads(content)

    def frames(self, **options: Any) -> ClientConnection:
        words = {"origin": f"http://{self.host}", "ping_interval": None, **options}
        return connect(f"ws://{self.host}/frames", additional_headers={"Cookie": self.cookie}, **words)


def frame_of(page: OperatorPage) -> dict[str, Any]:
    """The first frame that a page gets, which has everything."""
    with page.frames() as frames:
        return json.loads(frames.recv(10))


def assert_line(process: subprocess.Popen[str]) -> str:
    line = process.stdout.readline()
    assert line, f"the console has ended with {process.wait()}"
    return line


@contextmanager
def vehicle_page(folder: Path, *words: str, profile: str = "lauv-noptilus-1") -> Iterator[OperatorPage]:
    """A vehicle in a process of its own that talks to nobody but its page."""
    others = [f"Transports.{name}" for name in ("Announce", "Discovery", "FTP", "MAVLink", "TCP.Server", "UDP")]
    camera = ["Simulators.MUGDetectionCamera"] if profile.startswith("lauv") else []
    off = [*others, *camera, "Plan.Autostart", "Monitors.HostResources"]
    settings = [word for section in off for word in ("--set", f"{section}:Enabled=Never")]
    command = [sys.executable, "-m", "shoal.cli", "run", profile, "-p", "Simulation", "--clock", "4x"]
    command += ["--set", "Transports.Console:Port=0", *settings, *words]
    with subprocess.Popen(
        command, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        try:
            page = OperatorPage(process)
            reader = Thread(target=lambda: page.lines.extend(process.stdout), daemon=True)
            reader.start()
            yield page
        finally:
            process.terminate()
        reader.join(30.0)


@contextmanager
def operator_page(*words: str) -> Iterator[OperatorPage]:
    command = [sys.executable, "-m", "shoal.cli", "console", "--port", "0", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            yield OperatorPage(process)
        finally:
            process.terminate()
