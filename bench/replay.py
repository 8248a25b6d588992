"""Replay at full speed: messages per CPU second, and messages lost.

`python bench/replay.py` prints figures for this machine; it does not pass or fail.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import imc
from runtime import Task, consume
from runtime.kernel import VirtualClock
from runtime.testing import NoProfile
from runtime.vehicle import Vehicle
from tasks.transports.replay import Replay

SYSTEM = 0xA123


class Listener(Task):
    """Counts the messages it receives."""

    def start(self) -> None:
        self.heard = 0


class States(Listener):
    """Receives two types."""

    @consume(others=True)
    def hear(self, message: imc.EstimatedState | imc.SimulatedState) -> None:
        self.heard += 1


class Sensors(Listener):
    """Receives three types."""

    @consume(others=True)
    def hear(self, message: imc.Acceleration | imc.AngularVelocity | imc.GpsFix) -> None:
        self.heard += 1


class Everything(Listener):
    """Receives all types, with the packets."""

    @consume(others=True, packets=True)
    def hear(self, message: imc.Message, packet: bytes) -> None:
        self.heard += message.src != SYSTEM


def play(path: Path, *listeners: type[Listener]) -> tuple[int, float]:
    """Replay a log to listeners: messages that `Everything` received (0 without it), and CPU seconds."""
    vehicle = Vehicle("replay", SYSTEM, clock=VirtualClock(), profile=NoProfile())
    vehicle.add(Replay, "Transports.Replay", load_at_start=str(path), exit_at_end=True)
    ears = [vehicle.add(cls, f"bench.{cls.__name__}") for cls in listeners]
    began = time.process_time()
    vehicle.start()
    vehicle.run()
    vehicle.kernel.drain()
    used = time.process_time() - began
    heard = max((ear.heard for ear in ears if isinstance(ear, Everything)), default=0)
    vehicle.close()
    return heard, used


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--log", type=Path, help="A log to replay, instead of a new one.")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        path = arguments.log
        if path is None:
            command = ["run", "lauv-noptilus-1", "-p", "Kinematic", "--clock", "virtual", "--seed", "1"]
            command += ["--log-dir", "log", "--for", f"{arguments.seconds}s"]
            subprocess.run(
                [sys.executable, "-m", "shoal.cli", *command],
                check=True,
                cwd=name,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            path = next(Path(name).glob("log/*/*/*"))
        count = len(imc.Log(path))
        for listeners in ((States, Sensors), (States, Sensors, Everything)):
            runs = [play(path, *listeners) for _ in range(arguments.repeats)]
            best = min(used for _, used in runs)
            lost = f", lost {count - runs[0][0]}" if Everything in listeners else ""
            names = ", ".join(cls.__name__ for cls in listeners)
            print(f"{count} messages to {names}: {count / best:.0f} messages per CPU second{lost}")


if __name__ == "__main__":
    main()
