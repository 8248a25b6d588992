"""IMC over UDP: how fast packets come in beside imcpy, what ten peers cost, and what one console costs a vehicle.

    python bench/network.py [SECONDS]

Each figure is for SECONDS (5 by default). The rate of incoming packets is per second of the receiver's CPU time: how
long it takes to read and parse bursts of EstimatedState. imcpy's actor and a vehicle
of Shoal take turns, both without a subscriber and both with one.
"""

import asyncio
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import imcpy
from imcpy.actors import IMCBase
from imcpy.network.udp import IMCProtocolUDP

import imc
from imc.discovery import Service, Services
from runtime.bus import Subscription
from runtime.kernel import WallClock
from runtime.profile import load_profile
from runtime.testing import NoProfile
from runtime.udp_sockets import bind_udp_socket
from runtime.vehicle import Vehicle, build
from tasks.transports.udp import UDP

CONSOLE = 0x4042
BURST = 200  # packets, which the buffer of a socket holds
CONSOLE_PROGRAM = """
import socket, sys, time, imc
from imc.discovery import Service, Services
console = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
console.connect(("127.0.0.1", int(sys.argv[1])))
console.settimeout(0.1)
services = str(Services.of([Service("imc+udp", "127.0.0.1", console.getsockname()[1])]))
console.send(imc.encode(imc.Announce(src=0x4042, sys_name="console", services=services)))
began, beat, count = time.monotonic() + 1.0, 0.0, 0
while (now := time.monotonic()) < began + float(sys.argv[2]):
    if now > beat:
        beat = now + 1.0
        console.send(imc.encode(imc.Heartbeat(src=0x4042)))
    try:
        console.recv(65535)
        count += now > began
    except OSError:
        pass
print(count)
"""
PACKET = imc.encode(imc.EstimatedState(src=CONSOLE, timestamp=1e9, lat=0.72, x=1.0))


def bursts(port: int, receive: Callable[[int], None], seconds: float) -> float:
    """CPU time (s) per packet of a receiver, which gets bursts of packets at a port."""
    spent, count, end = 0.0, 0, time.monotonic() + seconds
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as source:
        source.connect(("127.0.0.1", port))
        while time.monotonic() < end:
            for _ in range(BURST):
                source.send(PACKET)
            count += BURST
            began = time.process_time()
            receive(count)
            spent += time.process_time() - began
    return spent / count


class Actor(IMCBase):
    """imcpy's own actor, which has counted the messages that it got."""

    count = 0

    def post_message(self, msg: Any) -> None:
        self.count += 1
        super().post_message(msg)


def imcpy_cost(seconds: float, *, subscribers: int) -> float:
    """imcpy's actor with its protocol in asyncio."""
    owner, loop = Actor(), asyncio.new_event_loop()
    if subscribers:
        owner._subs = {imcpy.EstimatedState: [lambda _: None] * subscribers}

    async def wait(expected: int) -> None:
        while owner.count < expected:
            await asyncio.sleep(0.002)

    opened = bind_udp_socket("127.0.0.1", 0)
    loop.run_until_complete(loop.create_datagram_endpoint(lambda: IMCProtocolUDP(owner), sock=opened))
    spent = bursts(opened.getsockname()[1], lambda expected: loop.run_until_complete(wait(expected)), seconds)
    loop.run_until_complete(loop.shutdown_default_executor())
    return spent


def vehicle_with_udp(**values: Any) -> tuple[Vehicle, UDP]:
    vehicle = Vehicle("lauv-noptilus-1", 0x1A, clock=WallClock(), profile=NoProfile())
    udp = vehicle.add(UDP, "Transports.UDP", local_port=0, **values)
    assert isinstance(udp, UDP)
    vehicle.start()
    vehicle.run(0.1)
    services = str(Services.from_system_info([Service("imc+udp", "127.0.0.1", 9)]))
    udp.on_announce(imc.Announce(src=CONSOLE, sys_name="console", services=services))
    return vehicle, udp


def shoal_cost(seconds: float, *, subscribers: int) -> float:
    """The task, which puts each message on the bus of a vehicle, where so many functions subscribe to it."""
    vehicle, udp = vehicle_with_udp(maximum_rate=1e9)
    for _ in range(subscribers):
        vehicle.bus.subscribe(Subscription(imc.EstimatedState, lambda _: None, None, others=True))

    def receive(expected: int) -> None:
        while udp.taken < expected:
            vehicle.run(0.002)

    spent = bursts(udp.port, receive, seconds)
    vehicle.close()
    return spent


def peers_cost(count: int) -> tuple[float, float]:
    """CPU time (s) per message to `count` peers, and how often each message was encoded again."""
    vehicle, udp = vehicle_with_udp(transports=["EulerAngles"], maximum_rate=1e9)
    angles = imc.EulerAngles(phi=0.1)
    udp.publish(angles)
    encodings, encode = 0, imc.EulerAngles.to_packet_with_header

    def counted(message: imc.EulerAngles, *header: Any) -> bytes:
        nonlocal encodings
        encodings += 1
        return encode(message, *header)

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sink:
        sink.bind(("127.0.0.1", 0))
        for system in range(0x4100, 0x4100 + count):
            services = str(Services.from_system_info([Service("imc+udp", "127.0.0.1", sink.getsockname()[1])]))
            udp.on_announce(imc.Announce(src=system, sys_name=f"console {system}", services=services))
            udp.on_datagrams([(imc.encode(imc.Heartbeat(src=system)), "127.0.0.1", 1)])
        vehicle.kernel.drain()
        imc.EulerAngles.to_packet_with_header = counted
        messages, began = 5000, time.process_time()
        for _ in range(messages):
            udp.publish(angles)
            vehicle.kernel.drain()
        spent = time.process_time() - began
        imc.EulerAngles.to_packet_with_header = encode
    vehicle.close()
    return spent / messages, encodings / messages


def running_cost(seconds: float, *, network: bool) -> tuple[float, float]:
    """CPU of a running lauv-noptilus-1 as a share of a core, and packets per second to one console."""
    profile = load_profile("lauv-noptilus-1")
    for task in ("Announce", "Discovery", "UDP"):
        if not network:
            profile.override(f"Transports.{task}:Enabled=Never")
    profile.override("Transports.UDP:Local Port=0")
    packets = 0
    with tempfile.TemporaryDirectory() as folder:
        vehicle = build(profile, {"Simulation"}, clock=WallClock(), log_root=Path(folder)).vehicle
        vehicle.start()
        vehicle.run(3.0)
        console = None
        if network:
            udp = vehicle.task("Transports.UDP")
            assert isinstance(udp, UDP)
            command = [sys.executable, "-c", CONSOLE_PROGRAM, str(udp.port), str(seconds)]
            console = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
            vehicle.run(1.0)
        before = time.process_time()
        vehicle.run(seconds)
        spent = time.process_time() - before
        if console is not None:
            packets = int(console.communicate()[0])
        vehicle.close()
    return spent / seconds, packets / seconds


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 5.0
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    for subscribers in (0, 1):
        pairs = [
            (shoal_cost(seconds / 4, subscribers=subscribers), imcpy_cost(seconds / 4, subscribers=subscribers))
            for _ in range(4)
        ]
        ours, theirs = (median(each) for each in zip(*pairs, strict=True))
        ratio = median(b / a for a, b in pairs)
        print(
            f"in, {subscribers} subscribers: Shoal {1 / ours:.0f} packets per CPU second, "
            f"imcpy {1 / theirs:.0f}: {ratio:.2f} times"
        )
    for count in (1, 10):
        spent, encodings = peers_cost(count)
        print(f"out: {count} peers: {1e6 * spent:.1f} us per message, encoded again {encodings:g} times")
    without, _ = running_cost(2 * seconds, network=False)
    cost, packets = running_cost(2 * seconds, network=True)
    print(
        f"lauv-noptilus-1 with one console: {packets:.0f} packets/s, {100 * cost:.1f} % of a core, "
        f"{100 * without:.1f} % without the network: {100 * (cost - without):.1f} % for it"
    )


if __name__ == "__main__":
    main()
