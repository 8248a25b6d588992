"""Stations in network namespaces of their own, joined by a radio; for a process that has a namespace of its own."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path

from tests.shoal.network.radio import Quality, without_offloads

RADIO = Path(__file__).with_name("radio.py")
UP = "link set lo up", "link set radio0 up"


class Stations:
    """Each station has the address 10.98.0.N, counted from 1, and a namespace that `enter` leads to."""

    def __init__(self, radio: "subprocess.Popen[str]", namespaces: list[int]):
        self._radio = radio
        self._namespaces = namespaces

    def address(self, number: int) -> str:
        return f"10.98.0.{number}"

    def enter(self, number: int) -> list[str]:
        """The beginning of a command that runs the rest at a station."""
        return ["nsenter", "-t", str(self._namespaces[number - 1]), "-n"]

    def change(self, quality: Quality) -> None:
        """Change the radio, and wait until it has."""
        assert self._radio.stdin is not None
        assert self._radio.stdout is not None
        self._radio.stdin.write(json.dumps(asdict(quality)) + "\n")
        self._radio.stdin.flush()
        assert self._radio.stdout.readline() == "changed\n"


@contextmanager
def stations(count: int) -> Iterator[Stations]:
    """Make stations; at first the radio is perfect."""
    with ExitStack() as stack:
        namespaces: list[int] = []
        names: list[str] = []
        for number in range(1, count + 1):
            sleeper = stack.enter_context(subprocess.Popen(["unshare", "-n", "sleep", "infinity"]))
            stack.callback(sleeper.kill)
            here = os.readlink("/proc/self/ns/net")
            while os.readlink(f"/proc/{sleeper.pid}/ns/net") == here:
                time.sleep(0.01)
            name = f"air{number}"
            ip("link", "add", name, "type", "veth", "peer", "name", "radio0", "netns", str(sleeper.pid))
            ip("link", "set", name, "up")
            enter = ["nsenter", "-t", str(sleeper.pid), "-n"]
            environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
            subprocess.run([*enter, sys.executable, __file__], check=True, env=environment)
            for words in (*UP, f"addr add 10.98.0.{number}/24 brd + dev radio0"):
                subprocess.run([*enter, "ip", *words.split()], check=True)
            namespaces.append(sleeper.pid)
            names.append(name)
        radio = stack.enter_context(
            subprocess.Popen(
                [sys.executable, str(RADIO), *names], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
        )
        stack.callback(radio.kill)
        assert radio.stdout is not None
        assert radio.stdout.readline() == "ready\n"
        yield Stations(radio, namespaces)


def ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True)


if __name__ == "__main__":
    without_offloads("radio0")
