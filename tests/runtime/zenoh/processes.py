"""Processes with a zenoh session each, on a bus of their own."""

import contextlib
import json
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from runtime.zenoh.config import SESSION_OFFSET, SESSIONS
from runtime.zenoh.listen_endpoint_failover import is_in_use
from tests.outside import PATIENCE, in_turn, until

DISCOVERY = ("Transports.Announce", "Transports.Discovery")
PEERS = Path(__file__).parent / "peers"
REPOSITORY = Path(__file__).parents[3]


BLOCKS = in_turn(port for port in range(11_000, 32_000, 100) if port != 30_100)  # that of discovery


def local_port() -> int:
    """A local port with free session ports after it, another one each time."""
    while True:
        port = next(BLOCKS)
        sessions = range(port + SESSION_OFFSET, port + SESSION_OFFSET + SESSIONS)
        if not any(is_in_use(f"tcp/127.0.0.1:{number}") for number in (port, *sessions)):
            return port


class Process:
    """A Python process that prints one JSON object per line; other lines are ignored."""

    def __init__(self, *arguments: object) -> None:
        command = [sys.executable, *map(str, arguments)]
        pipe = subprocess.PIPE
        self.popen = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, cwd=REPOSITORY)
        self.lines: queue.Queue[Any] = queue.Queue()
        self.errors: list[str] = []
        self.threads = [
            threading.Thread(target=reader, daemon=True) for reader in (self._read_lines, self._read_errors)
        ]
        for thread in self.threads:
            thread.start()

    def _read_lines(self) -> None:
        for line in self.popen.stdout or ():
            if line.startswith("{"):
                self.lines.put(json.loads(line))
        self.lines.put(None)

    def _read_errors(self) -> None:
        self.errors.extend(self.popen.stderr or ())

    def line(self) -> Any:
        with contextlib.suppress(queue.Empty):
            if (answer := self.lines.get(timeout=PATIENCE)) is not None:
                return answer
        raise AssertionError(f"no answer from {self.popen.args}: {''.join(self.errors)}")

    def line_where(self, **wanted: object) -> Any:
        """The next line with these values."""
        deadline = time.monotonic() + PATIENCE
        while not wanted.items() <= (answer := self.line()).items():
            assert time.monotonic() < deadline, f"no {wanted}"
        return answer

    def ask(self, command: str) -> Any:
        assert self.popen.stdin is not None
        self.popen.stdin.write(command + "\n")
        self.popen.stdin.flush()
        return self.line()

    def until(self, condition: Callable[[Any], bool], command: str = "status") -> Any:
        status: Any = None

        def holds() -> bool:
            nonlocal status
            status = self.ask(command)
            return condition(status)

        until(holds, told=lambda: f"still {status}")
        return status

    def hears(self, system: int, at_least: int = 1) -> Any:
        """Wait for this many more messages of a system."""
        before = count(self.ask("status"), system)
        return self.until(lambda status: count(status, system) >= before + at_least)

    def wait(self) -> int:
        assert self.popen.stdin is not None
        self.popen.stdin.close()
        return self.popen.wait(PATIENCE)

    def end(self) -> None:
        with contextlib.suppress(OSError):
            self.popen.kill()
        self.popen.wait()
        for thread in self.threads:
            thread.join()
        for pipe in (self.popen.stdin, self.popen.stdout, self.popen.stderr):
            if pipe is not None:
                with contextlib.suppress(OSError):
                    pipe.close()


def count(status: Any, system: int) -> int:
    return status["heard"].get(str(system), [0])[0]


def hear_each_other(running: dict[int, Process]) -> None:
    for system, process in running.items():
        for other in running.keys() - {system}:
            process.hears(other, 5)


class Network:
    """A separate bus: a port to connect to, a scouting port, and ports of discovery that no other test uses.

    `own_udp` are the settings of vehicles that announce themselves only there.
    """

    def __init__(self) -> None:
        self.local_port = local_port()
        self.scouting_port = self.local_port + 1
        self.discovery_ports = range(self.local_port + 2, self.local_port + 7)
        listed = ",".join(map(str, self.discovery_ports))
        self.own_udp = [f"{section}:Ports={listed}" for section in DISCOVERY] + ["Transports.UDP:Local Port=0"]
        self.processes: list[Process] = []

    def add(self, *arguments: object) -> Process:
        process = Process(*arguments)
        self.processes.append(process)
        return process

    def bus(self, system: int, *, scouting: bool = True, **options: str) -> Process:
        """A process with a transport; `options` are those of [Zenoh], with _ for blanks."""
        named = {name.replace("_", " "): value for name, value in options.items()}
        port = self.scouting_port if scouting else 0
        return self.add(PEERS / "bus.py", system, self.local_port, port, json.dumps(named))

    def asker(self, mode: str = "client", options: dict[str, object] | None = None) -> Process:
        """A zenoh program without Shoal's transport, see there; `options` are zenoh's."""
        return self.add(PEERS / "asker.py", mode, self.local_port, self.scouting_port, json.dumps(options or {}))

    def plain(self, expression: str, mode: str) -> Process:
        return self.add(PEERS / "plain.py", expression, mode, self.local_port, self.scouting_port)

    def buses(self, *systems: int, scouting: bool = True) -> list[Process]:
        """Processes started at the same time and connected, each sending 100 messages per second."""
        processes = [self.bus(system, scouting=scouting) for system in systems]
        for process in processes:
            assert process.line() == {"opened": True}
            process.ask("flow 100")
        hear_each_other(dict(zip(systems, processes, strict=True)))
        return processes
