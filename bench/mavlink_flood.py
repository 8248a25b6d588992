"""Cost of 1 MB/s of rubbish on a MAVLink link, and whether the rates of another station stay.

`python bench/mavlink_flood.py [--seconds 4]`: for each kind of link and of rubbish, the share of a core that the
vehicle's process takes more than without it, and how many of the messages that a station at 50 Hz is due arrive.
"""

import argparse
import os
import pty
import random
import socket
import subprocess
import sys
import time
import tty
from pathlib import Path
from typing import Any

from mavlink import encode, load_dialect, split
from runtime import Script
from runtime.kernel import WallClock
from runtime.testing import simulate
from tasks.transports.mavlink import MAVLink

HOST = "127.0.0.1"
RATE = 1_000_000  # bytes/s
STEP = 0.01  # s
PORTION = 1000  # bytes
DIALECT = load_dialect()
ORDER = DIALECT.by_name["COMMAND_LONG"]


def rubbish(kind: str) -> bytes:
    """Bytes of a kind, about 1 MB."""
    frame = encode(ORDER, ORDER.pack({"target_system": 99, "command": 400, "param1": 1.0}), 0, 254, 1)
    if kind == "random":
        return random.Random(1).randbytes(RATE)
    if kind == "wrong sums":
        frame = frame[:-1] + bytes((frame[-1] ^ 1,))
    return frame * (RATE // len(frame))


def flood(scheme: str, place: str, kind: str) -> None:
    """Send rubbish until killed; a connection that is ended is made again."""
    data, at = rubbish(kind), 0
    sender: Any = None
    due = time.monotonic()
    while True:
        part = data[at : at + round(RATE * STEP)]
        at = (at + len(part)) % len(data)
        try:
            if scheme == "serial":
                sender = int(place) if sender is None else sender
                os.write(sender, part)
            elif scheme == "udpin":
                sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM) if sender is None else sender
                for begin in range(0, len(part), PORTION):
                    sender.sendto(part[begin : begin + PORTION], (HOST, int(place)))
            else:
                sender = socket.create_connection((HOST, int(place)), 1.0) if sender is None else sender
                sender.sendall(part)
        except OSError:
            sender = sender if scheme == "serial" else None
        due += STEP
        time.sleep(max(0.0, due - time.monotonic()))


def free_port(kind: socket.SocketKind) -> int:
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind((HOST, 0))
        return probe.getsockname()[1]


def measure(scheme: str, kind: str, seconds: float) -> tuple[float, float]:
    """The share of a core, and that of the messages that arrive."""
    good, bad = free_port(socket.SOCK_DGRAM), free_port(socket.SOCK_STREAM if scheme == "tcpin" else socket.SOCK_DGRAM)
    end, own = pty.openpty()
    tty.setraw(own)
    os.set_blocking(end, False)
    link, place = f"{scheme}://{HOST}:{bad}", str(bad)
    if scheme == "serial":
        link, place = f"serial://{os.ttyname(own)}?baud=921600", str(end)
    station = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    station.setblocking(False)
    process = None
    if kind:
        command = [sys.executable, __file__, "--flood", scheme, place, kind]
        process = subprocess.Popen(
            command, env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}, pass_fds=(end,)
        )
    found: list[float] = []

    async def script(control: Script) -> None:
        await control.sleep(1.5)
        fields = {"target_system": 26, "command": 511, "param1": 2, "param2": 20_000.0}
        station.sendto(encode(ORDER, ORDER.pack(fields), 0, 255, 190), (HOST, good))
        await control.sleep(0.5)
        read()
        used, began = time.process_time(), time.monotonic()
        await control.sleep(seconds)
        passed = time.monotonic() - began
        found.extend(((time.process_time() - used) / passed, read() / (50.0 * passed)))
        control.task.vehicle.stop()

    def read() -> int:
        count = 0
        while True:
            try:
                count += sum(m.name == "SYSTEM_TIME" for m in split(station.recv(2048), DIALECT)[0])
            except BlockingIOError:
                return count

    try:
        links = [f"udpin://{HOST}:{good}", link]
        simulate([(MAVLink, {"links": links})], seconds=60.0, clock=WallClock(), script=script)
    finally:
        if process is not None:
            process.kill()
            process.wait()
        os.close(own)
        os.close(end)
    return found[0], found[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--flood", nargs=3)
    options = parser.parse_args()
    if options.flood:
        flood(*options.flood)
    for scheme in ("udpin", "tcpin", "serial"):
        idle, _ = measure(scheme, "", options.seconds)
        for kind in ("random", "wrong sums", "wrong targets"):
            used, arrived = measure(scheme, kind, options.seconds)
            print(f"{scheme}, {kind}: {used - idle:+.3f} of a core, {100.0 * arrived:.1f} % of the messages arrive")
    print("load", *os.getloadavg())


if __name__ == "__main__":
    main()
