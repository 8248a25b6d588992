"""Vehicles that run in processes of their own, on a bus of their own."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from tests.runtime.zenoh.processes import local_port

REPOSITORY = Path(__file__).parents[3]
PATIENCE = 30.0


class Running:
    """`shoal run` of a shipped vehicle; `SHOAL_CONNECT` and `SHOAL_DISCOVERY` lead to it, and to no other.

    `network` is zenoh, udp, tcp, or both of the first. Vehicles with the same `port` are on one network.
    """

    def __init__(
        self,
        folder: Path,
        *options: str,
        network: str = "zenoh",
        profile: str = "lauv-noptilus-1",
        port: int | None = None,
    ):
        self.port = local_port() if port is None else port
        self.log = folder / f"output-{profile}-{time.monotonic_ns()}.txt"
        ports = range(self.port + 2, self.port + 7)
        os.environ["SHOAL_DISCOVERY"] = f"{ports[0]}-{ports[-1]}"
        over_zenoh = f"tcp/127.0.0.1:{self.port}"
        os.environ["SHOAL_CONNECT"] = {
            "zenoh": over_zenoh,
            "udp": "udp",
            "tcp": f"imc+tcp://127.0.0.1:{self.port}",
            "both": f"udp,{over_zenoh}",
        }[network]
        words = ["--set", f"Transports.UDP:{'Local Port=0' if network in ('udp', 'both') else 'Enabled=Never'}"]
        words += ["--set", f"Transports.TCP.Server:Port={self.port if network == 'tcp' else 0}"]
        if network in ("zenoh", "both"):
            words += ["--bus", "zenoh", "--set", f"Zenoh:Local Port={self.port}"]
            words += ["--set", f"Zenoh:Scouting Address=224.0.0.224:{self.port + 1}"]
        for name in ("Announce", "Discovery"):
            words += ["--set", f"Transports.{name}:Ports={','.join(map(str, ports))}"]
        off = ("Transports.MAVLink", "Transports.Console", "Plan.Autostart")
        off += ("Simulators.MUGDetectionCamera",) if profile.startswith("lauv") else ()
        off += ("Monitors.HostResources",)  # this computer is busy with tests
        quiet = [word for section in off for word in ("--set", f"{section}:Enabled=Never")]
        quiet += ["--clock", "2x"]  # it boots sooner; a faster clock takes more of the processor as long as it runs
        command = [sys.executable, "-m", "shoal.cli", "run", profile, "-p", "Simulation", *words, *quiet, *options]
        environment = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
        with self.log.open("w") as output:
            self.popen = subprocess.Popen(
                command, cwd=folder, stdout=output, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, env=environment
            )
        self.until("LOG")

    def until(self, text: str) -> None:
        """Wait until the vehicle has printed a text."""
        deadline = time.monotonic() + PATIENCE
        while text not in (printed := self.log.read_text()):
            assert self.popen.poll() is None, printed
            assert time.monotonic() < deadline, f"no {text!r} in {printed}"
            time.sleep(0.05)

    def kill(self) -> None:
        self.popen.send_signal(signal.SIGKILL)
        self.popen.wait()

    def end(self) -> None:
        with contextlib.suppress(OSError):
            self.popen.kill()
        self.popen.wait()


@contextlib.contextmanager
def running(folder: Path, *options: str, **named: object) -> Iterator[Running]:
    before = {name: os.environ.get(name) for name in ("SHOAL_CONNECT", "SHOAL_DISCOVERY")}
    vehicle = Running(folder, *options, **named)
    try:
        yield vehicle
    finally:
        vehicle.end()
        for name, value in before.items():
            os.environ.pop(name, None) if value is None else os.environ.update({name: value})
