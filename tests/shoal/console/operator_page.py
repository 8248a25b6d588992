"""A browser's side of the console: requests with cookie and origin, and frames."""

import http.client
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from websockets.sync.client import ClientConnection, connect

LINK = re.compile(r"open (http://127\.0\.0\.1:(\d+)/#(\S+))")


class OperatorPage:
    """A console in a process of its own, and one page that has logged in to it."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.lines: list[str] = []
        while not (found := LINK.match(self.lines[-1] if self.lines else "")):
            self.lines.append(assert_line(process))
        self.link, self.port, self.token = found[1], int(found[2]), found[3]
        self.host = f"127.0.0.1:{self.port}"
        self.cookie = ""

    def log_in(self) -> None:
        status, _, headers = self.request("POST", "/api/login", {"token": self.token})
        assert status == 200
        self.cookie = headers["set-cookie"].partition(";")[0]

    def request(self, method: str, path: str, body: Any = None, **headers: str) -> tuple[int, bytes, dict[str, str]]:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        sent = {"Origin": f"http://{self.host}", "Cookie": self.cookie, **headers}
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


def assert_line(process: subprocess.Popen[str]) -> str:
    line = process.stdout.readline()
    assert line, f"the console has ended with {process.wait()}"
    return line


@contextmanager
def operator_page(*words: str) -> Iterator[OperatorPage]:
    command = [sys.executable, "-m", "shoal.cli", "console", "--port", "0", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            yield OperatorPage(process)
        finally:
            process.terminate()
