"""A shipped vehicle in a process of its own, on a zenoh network of a test."""

from collections.abc import Callable
from pathlib import Path

import imc
from tests.outside import ALONE, until
from tests.runtime.zenoh.processes import DISCOVERY, Network, Process

NAME = "lauv-noptilus-1"
SYSTEM = 0x001A
OVER_UDP = tuple(f"{section}:Enabled=Never" for section in (*DISCOVERY, "Transports.UDP"))


class Vehicle(Process):
    """`shoal run` of the shipped profile, on zenoh and, if wanted, UDP, where only this test hears it."""

    def __init__(self, network: Network, folder: Path, *options: str, udp: bool = False) -> None:
        self.folder = folder
        settings = [f"Zenoh:Local Port={network.local_port}", *(network.own_udp if udp else ())]
        settings += [setting for setting in ALONE if not (udp and setting in OVER_UDP)]
        words = [word for setting in settings for word in ("--set", setting)]
        modes = ("-p", "Simulation", "--bus", "zenoh")
        super().__init__("-m", "shoal.cli", "run", NAME, *modes, *words, *options, "--log-dir", folder)
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
