"""Whether a ground station at one UDP port gets all telemetry of a fleet: rates kept, and frames lost, of each vehicle.

`python bench/mavlink_fleet.py [--vehicles 20] [--per-process 10] [--modes Kinematic] [--seconds 20]` starts a fleet of
`lauv-noptilus-1`, each calling the same port, and prints the lowest share of a rate (of HEARTBEAT, ATTITUDE,
GLOBAL_POSITION_INT, VFR_HUD, SYS_STATUS), and the share of the frames that are missing in the sequence numbers.
"""

import argparse
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from bench.fleet import family, used
from mavlink import encode, load_dialect, split
from tests.outside import free_ports
from tests.runtime.zenoh.processes import Network

DIALECT = load_dialect()
RATES = {"HEARTBEAT": 1.0, "ATTITUDE": 10.0, "GLOBAL_POSITION_INT": 4.0, "VFR_HUD": 4.0, "SYS_STATUS": 2.0}
STARTING = 120.0  # s
SETTLING = 10.0  # s
HOST = "127.0.0.1"
FLEET = """
name: bench-{port}
profile: lauv-noptilus-1
modes: {modes}
per_process: {per_process}
stagger: 0.3s
spacing: 50
zenoh: {{Local Port: "{port}"}}
set: ["Transports.MAVLink:Links=udpout://127.0.0.1:{station}", {own_udp}]
vehicles: [{{name: "v-{{number}}", count: {count}}}]
"""


class Station:
    """A ground station with one socket for all vehicles."""

    def __init__(self, port: int) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        self.socket.bind((HOST, port))
        self.socket.setblocking(False)
        self.places: dict[int, tuple[str, int]] = {}
        self.last: dict[tuple[int, int], int] = {}
        self.counts: Counter[tuple[int, str]] = Counter()
        self.received = self.lost = 0
        self.beat_due, self.sequence = 0.0, 0

    def listen(self, seconds: float) -> None:
        """Take what comes, and send each vehicle a heartbeat once a second."""
        self.counts.clear()
        self.received = self.lost = 0
        end = time.monotonic() + seconds
        while (now := time.monotonic()) < end:
            if now >= self.beat_due:
                self.beat_due, self.sequence = now + 1.0, (self.sequence + 1) % 256
                beat = DIALECT.by_name["HEARTBEAT"]
                for place in self.places.values():
                    self.socket.sendto(encode(beat, beat.pack({"type": 6}), self.sequence, 255, 190), place)
            if not select.select([self.socket], [], [], min(0.1, end - now))[0]:
                continue
            data, place = self.socket.recvfrom(2048)
            for message in split(data, DIALECT)[0]:
                self.take(message.system, message.component, message.name, message.sequence, place)

    def take(self, system: int, component: int, name: str, sequence: int, place: tuple[str, int]) -> None:
        self.places[system] = place
        source = system, component
        if source in self.last:
            self.lost += (sequence - self.last[source] - 1) % 256
        self.last[source] = sequence
        self.received += 1
        if component == 1:
            self.counts[system, name] += 1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vehicles", type=int, default=20)
    parser.add_argument("--per-process", type=int, default=10)
    parser.add_argument("--modes", default="Kinematic")
    parser.add_argument("--seconds", type=float, default=20.0)
    options = parser.parse_args()
    (place,) = free_ports(1)
    network, station = Network(), Station(place)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "fleet.yaml"
        own_udp = str(list(network.own_udp))[1:-1].replace("'", '"')
        file.write_text(
            FLEET.format(
                port=network.local_port,
                modes=options.modes,
                per_process=options.per_process,
                station=place,
                own_udp=own_udp,
                count=options.vehicles,
            )
        )
        run = subprocess.Popen(
            [sys.executable, "-m", "shoal.cli", "fleet", str(file), "--log-dir", f"{folder}/log"],
            env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])},
        )
        try:
            deadline = time.monotonic() + STARTING
            while len(station.places) < options.vehicles:
                if time.monotonic() > deadline:
                    raise TimeoutError(f"of {options.vehicles} vehicles only {len(station.places)} send")
                station.listen(0.5)
            station.listen(SETTLING)
            before, began = used(family(run.pid)), time.monotonic()
            station.listen(options.seconds)
            passed = time.monotonic() - began
            cpu = (used(family(run.pid)) - before) / passed
        finally:
            run.send_signal(signal.SIGTERM)
            run.wait()
    for name, rate in RATES.items():
        shares = sorted(station.counts[system, name] / (rate * passed) for system in station.places)
        print(f"{name}: {100 * shares[0]:.1f} to {100 * shares[-1]:.1f} % of {rate:g} Hz")
    sent = station.received + station.lost
    print(
        f"{len(station.places)} vehicles, {options.modes}: {station.received / passed:.0f} frames/s, "
        f"lost {station.lost} of {sent} ({100 * station.lost / sent:.3f} %), {100 * cpu:.0f} % of a core, "
        f"load {os.getloadavg()[0]:.1f}"
    )


if __name__ == "__main__":
    main()
