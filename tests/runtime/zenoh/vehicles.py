"""A shipped vehicle in a process of its own, on a zenoh network of a test."""

from collections.abc import Callable
from pathlib import Path

import imc
from tests.outside import until
from tests.runtime.zenoh.processes import Network, Process

NAME = "lauv-noptilus-1"
SYSTEM = 0x001A
# By UDP it would find every other vehicle of this computer, and log what they say.
ELSEWHERE = (
    "Transports.Announce",
    "Transports.Discovery",
    "Transports.UDP",
    "Transports.TCP.Server",
    "Transports.MAVLink",
)


class Vehicle(Process):
    """`shoal run` of the shipped profile, with no network but that of the test."""

    def __init__(self, network: Network, folder: Path, *options: str) -> None:
        self.folder = folder
        port = f"Zenoh:Local Port={network.local_port}"
        modes = ("-p", "Simulation", "--bus", "zenoh", "--set", port)
        off = [word for section in ELSEWHERE for word in ("--set", f"{section}:Enabled=Never")]
        super().__init__("-m", "shoal.cli", "run", NAME, *modes, *off, *options, "--log-dir", folder)
        network.processes.append(self)

    def swims(self) -> bool:
        """Whether it got so far that it logs."""
        return any(self.folder.rglob("Data.lsf*"))

    def ended(self) -> bool:
        return self.popen.poll() is not None

    def messages(self) -> list[imc.Message]:
        return [m for file in sorted(self.folder.rglob("Data.lsf*")) for m in imc.Log(file.parent)]


def wait_until(condition: Callable[[], object], *processes: Process) -> None:
    """Wait for a condition, for which these processes are needed."""
    until(condition, told=lambda: [process.errors for process in processes])
