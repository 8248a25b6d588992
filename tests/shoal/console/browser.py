"""Chromium without a screen, through its DevTools protocol; every host but this computer is unreachable for it."""

import base64
import json
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import which
from typing import Any
from urllib.request import urlopen

from websockets.sync.client import ClientConnection, connect

from tests.outside import children, until
from tests.shoal.console.operator_page import vehicle_page

CHROMIUM = which("chromium") or which("chromium-browser")
WORDS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-component-update",
    "--disable-background-networking",
    "--remote-debugging-port=0",
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
)


class Browser:
    """One tab. `requests` are the addresses that it has asked for, `errors` those of its scripts."""

    def __init__(self, socket: ClientConnection, process: int) -> None:
        self._socket = socket
        self._process = process
        self._number = 0
        self.requests: list[str] = []
        self.errors: list[str] = []
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **words: object) -> dict[str, Any]:
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": words}))
        while True:
            answer = json.loads(self._socket.recv(30))
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]
            self._note(answer)

    def _note(self, event: dict[str, Any]) -> None:
        words = event.get("params", {})
        match event.get("method"):
            case "Network.requestWillBeSent":
                self.requests.append(words["request"]["url"])
            case "Runtime.exceptionThrown":
                self.errors.append(json.dumps(words["exceptionDetails"])[:3000])
            case "Log.entryAdded" if words["entry"]["level"] == "error":
                self.errors.append(words["entry"]["text"])

    @contextmanager
    def asleep(self) -> Iterator[None]:
        """Stop all processes of the browser, as a computer does that sleeps, and wake them."""
        found = [self._process]
        for each in found:  # which grows
            found.extend(children(each))
        for each in found:
            os.kill(each, signal.SIGSTOP)
        try:
            yield
        finally:
            for each in found:
                os.kill(each, signal.SIGCONT)

    def open(self, address: str) -> None:
        self.call("Page.navigate", url=address)
        until(lambda: self.run("document.readyState") == "complete")

    def run(self, script: str) -> Any:
        """The value of an expression of JavaScript."""
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def text(self, selector: str) -> str:
        return self.run(f"document.querySelector({json.dumps(selector)})?.textContent ?? ''")

    def press(self, selector: str) -> None:
        """Press the left button in the middle of an element."""
        self.run(f"document.querySelector({json.dumps(selector)}).scrollIntoView({{block: 'nearest'}})")
        x, y = self.run(
            f"(() => {{ const r = document.querySelector({json.dumps(selector)}).getBoundingClientRect();"
            " return [r.x + r.width / 2, r.y + r.height / 2]; })()"
        )
        self.press_at(x, y)

    def press_at(self, x: float, y: float) -> None:
        place = {"x": x, "y": y, "button": "left", "clickCount": 1}
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, **place)

    def key(self, key: str) -> None:
        text = {"Enter": "\r", " ": " "}.get(key, "")
        number = {"Tab": 9, "Enter": 13}.get(key, 0)  # by which the browser itself knows a key
        words = {"key": key, "code": key, "windowsVirtualKeyCode": number}
        self.call("Input.dispatchKeyEvent", type="keyDown", text=text, **words)
        self.call("Input.dispatchKeyEvent", type="keyUp", **words)

    def set_size(self, width: int, height: int) -> None:
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        self.call("Emulation.setDeviceMetricsOverride", **size)

    def set_dark(self, value: str) -> None:
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": value}])

    def picture(self) -> bytes:
        """What the tab shows, as PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])


@contextmanager
def browser(folder: Path) -> Iterator[Browser]:
    assert CHROMIUM, "Chromium is missing: .ci/browser installs it"
    command = [CHROMIUM, *WORDS, f"--user-data-dir={folder}", "about:blank"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            port_file = folder / "DevToolsActivePort"
            until(lambda: port_file.exists() and port_file.read_text().count("\n"), 60.0)
            port = port_file.read_text().splitlines()[0]
            pages = json.loads(urlopen(f"http://127.0.0.1:{port}/json").read())
            address = next(page["webSocketDebuggerUrl"] for page in pages if page["type"] == "page")
            with connect(address, max_size=None, ping_interval=None) as socket:
                yield Browser(socket, process.pid)
        finally:
            process.terminate()
            time.sleep(0.1)


@contextmanager
def opened_vehicle_page(folder: Path, width: int, height: int, *words: str) -> Iterator[Browser]:
    """The page of a vehicle that runs in `folder`, logged in, as soon as it shows the vehicle; sizes are in pixels."""
    profile = folder / "browser"
    profile.mkdir()
    with vehicle_page(folder, *words) as vehicle, browser(profile) as found:
        found.set_size(width, height)
        found.open(vehicle.link)
        until(lambda: "service" in found.text("#summary"), 60.0, told=lambda: found.text("#summary"))
        yield found
