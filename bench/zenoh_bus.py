"""Cost of a bus over zenoh beside zenoh-python alone: latency, CPU and throughput of messages, rates of frames.

Bare subscribers that do only a part of what a bus has to do, in Python, say how much of the rest is the bus.
Every measurement has two processes, and the two sides of a ratio are measured in turn, `--repeats` times. A ratio is
the median of those of each turn. `python bench/zenoh_bus.py [--seconds 3] [--repeats 5]`
"""

import argparse
import json
import os
import queue
import resource
import statistics
import struct
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import zenoh

import imc
from runtime.bus import Bus, Frame, Subscription
from runtime.kernel import Kernel, WallClock
from runtime.zenoh import ProcessPart, ZenohConfig, ZenohTransport

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.runtime.zenoh.processes import local_port

RATE = 100.0  # Hz, of the paced messages
SIZE = 1024  # pixels
KEY = "imc/bench/EstimatedState/Navigation"
SYSTEM, ENTITY = 0x1A, 7


def cpu() -> float:
    return sum(resource.getrusage(resource.RUSAGE_SELF)[:2])


def raw_session(port: int, listens: bool, shared: bool = False) -> Any:
    config: Any = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("transport/shared_memory/enabled", json.dumps(shared))
    for side, wanted in (("listen", listens), ("connect", not listens)):
        config.insert_json5(f"{side}/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"] if wanted else []))
    return zenoh.open(config)


class Result:
    """Result of a receiver, which answers when the sender closes its input."""

    def __init__(self) -> None:
        self.delays: list[float] = []
        self.count = 0
        self.first = self.last = 0.0

    def note(self, sent: float) -> None:
        now = time.monotonic()
        if not self.count:
            self.first = now
        self.count, self.last = self.count + 1, now
        if self.count % 16 == 0 or self.count < 4096:
            self.delays.append(now - sent)

    def tell(self, began: float) -> None:
        span = self.last - self.first
        delays = sorted(self.delays) or [0.0]
        print(json.dumps({
            "count": self.count, "rate": self.count / span if span else 0.0, "cpu": cpu() - began,
            "p50": statistics.median(delays) * 1e6, "p99": delays[int(0.99 * (len(delays) - 1))] * 1e6,
        }), flush=True)  # fmt: skip


def paced(send: Callable[[float], object], seconds: float) -> int:
    """Call `send` with the time RATE times a second."""
    due = time.monotonic()
    for _ in range(int(seconds * RATE)):
        due += 1.0 / RATE
        time.sleep(max(0.0, due - time.monotonic()))
        send(time.monotonic())
    return int(seconds * RATE)


def flat_out(send: Callable[[float], object], seconds: float) -> int:
    number, end = 0, time.monotonic() + seconds
    while time.monotonic() < end:
        for _ in range(64):
            send(time.monotonic())
        number += 64
    return number


def state(sent: float) -> imc.EstimatedState:
    return imc.EstimatedState(lat=sent, src=SYSTEM, src_ent=ENTITY, timestamp=1.0)


def small(sent: float) -> imc.LogBookEntry:
    """A message whose packet has about 100 bytes."""
    return imc.LogBookEntry(htime=sent, text="x" * 60, src=SYSTEM, src_ent=ENTITY, timestamp=1.0)


def receive_raw(port: int, kind: str) -> None:
    result, began = Result(), cpu()
    with raw_session(port, False, kind == "shared") as session:
        if kind in ("tcp", "shared"):
            ring: Any = session.declare_subscriber(KEY, zenoh.handlers.RingChannel(2))
            print("{}", flush=True)
            for sample in ring:
                if len(sample.payload) < 16:
                    break
                np.frombuffer(sample.payload.to_bytes(), np.uint8).reshape(SIZE, SIZE, 4)
                result.note(0.0)
        else:
            kept_messages: deque[imc.Message] = deque(maxlen=4096)
            waiting: queue.SimpleQueue[bytes] = queue.SimpleQueue()

            def decode(packet: bytes) -> None:
                message = imc.decode(packet)
                kept_messages.append(message)
                result.note(message.htime if isinstance(message, imc.LogBookEntry) else getattr(message, "lat", 0.0))

            def decode_handed() -> None:
                while True:
                    decode(waiting.get())

            threading.Thread(target=decode_handed, daemon=True).start()
            use: dict[str, Callable[[bytes], None]] = {
                "codec": decode,
                "decoded": decode,
                "handed": waiting.put,
            }
            take = use.get(kind, lambda packet: result.note(struct.unpack_from("<d", packet)[0]))
            kept: Any = session.declare_subscriber(KEY, lambda sample: take(sample.payload.to_bytes()))
            print("{}", flush=True)
            began = cpu()
            sys.stdin.read()
            kept.undeclare()
        result.tell(began)


def send_raw(port: int, kind: str, seconds: float, ready: Callable[[], object]) -> int:
    make = small if kind in ("flood", "decoded") else state
    packet = imc.encode(make(1.0))
    rest = packet[8:]
    with raw_session(port, True, kind == "shared") as session:
        publisher = session.declare_publisher(KEY, congestion_control=zenoh.CongestionControl.BLOCK)
        ready()
        if kind in ("tcp", "shared"):
            image = np.random.default_rng(1).integers(0, 255, (SIZE, SIZE, 4), np.uint8)
            number = flat_out_frames(lambda: publisher.put(image.tobytes()), seconds)
            publisher.put(b"end")
            time.sleep(0.2)
            return number
        run = flat_out if make is small else paced
        if kind in ("codec", "decoded", "handed"):
            number = run(lambda now: publisher.put(imc.encode(make(now))), seconds)
            time.sleep(0.3)
            return number
        number = run(lambda now: publisher.put(struct.pack("<d", now) + rest), seconds)
        time.sleep(0.3)
        return number


def flat_out_frames(send: Callable[[], object], seconds: float) -> int:
    number, end = 0, time.monotonic() + seconds
    while time.monotonic() < end:
        send()
        number += 1
    return number


def bus_of(port: int, process: str) -> tuple[Kernel, Bus]:
    """The bus of one of two processes of a vehicle."""
    kernel = Kernel(WallClock())
    bus = Bus(kernel, SYSTEM)
    bus.release_backlog()
    config = ZenohConfig(local_port=port, scouting="none", vehicle="bench")
    part = ProcessPart("bench", SYSTEM, 1 if process == "main" else 2, process)
    transport = ZenohTransport(config, lambda _: "bench", lambda *_: "Navigation", part=part)
    bus.attach_transport(transport)
    bus.frames = transport.frames
    return kernel, bus


def receive_bus(port: int, kind: str) -> None:
    result, began = Result(), cpu()
    kernel, bus = bus_of(port, "other")
    wanted: dict[str, tuple[type, Callable[[Any], None]]] = {
        "paced": (imc.EstimatedState, lambda message: result.note(message.lat)),
        "flood": (imc.LogBookEntry, lambda message: result.note(message.htime)),
        "frames": (Frame, lambda frame: result.note(frame.time)),
    }
    bus.subscribe(Subscription(wanted[kind][0], wanted[kind][1], others=True))
    print("{}", flush=True)
    began = cpu()
    threading.Thread(target=lambda: (sys.stdin.read(), kernel.post(kernel.stop)), daemon=True).start()
    kernel.run(None)
    result.tell(began)
    sys.stdout.flush()
    bus.close_transports()
    os._exit(0)


def send_bus(port: int, kind: str, seconds: float, ready: Callable[[], object]) -> int:
    kernel, bus = bus_of(port, "main")
    ready()

    def publish(message: imc.Message) -> None:
        bus.deliver_and_send(message, imc.encode(message), None)

    sent = 0
    if kind == "paced":
        sent = paced(lambda now: publish(state(now)), seconds)
    elif kind == "frames":
        image = np.random.default_rng(1).integers(0, 255, (SIZE, SIZE, 4), np.uint8)
        frames = bus.frames
        assert frames is not None

        def share() -> None:
            nonlocal sent
            sent += 1
            frames.send(Frame(time.monotonic(), "Front", sent, image))
            time.sleep(0.0005)

        flat_out_frames(share, seconds)
    else:
        sent = flat_out(lambda now: publish(small(now)), seconds)
    time.sleep(0.3)
    bus.close_transports()
    kernel.close()
    return sent


def measure(side: str, kind: str, seconds: float) -> dict[str, float]:
    """One run of two processes; `side` is raw or bus."""
    port = local_port()
    pipe = subprocess.PIPE
    child = subprocess.Popen([sys.executable, __file__, side, kind, str(port)], stdin=pipe, stdout=pipe, text=True)
    assert child.stdin is not None
    assert child.stdout is not None
    out = child.stdout

    def ready() -> None:
        out.readline()
        time.sleep(0.7)  # until the subscription has arrived
        began.append(cpu())

    began: list[float] = []
    sent = (send_raw if side == "raw" else send_bus)(port, kind, seconds, ready)
    used = cpu() - began[0]
    child.stdin.close()
    result = json.loads(out.readline() or "{}")
    child.wait()
    result.update(sent=sent, cpu_per_message=(used + result["cpu"]) / max(1, result["count"]) * 1e6)
    return result


def main() -> None:
    if len(sys.argv) == 4 and sys.argv[1] in ("raw", "bus"):
        (receive_raw if sys.argv[1] == "raw" else receive_bus)(int(sys.argv[3]), sys.argv[2])
        return
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    runs: dict[tuple[str, str], list[dict[str, float]]] = {}
    messages = [("raw", "paced"), ("raw", "codec"), ("raw", "handed"), ("bus", "paced")]
    cases = [*messages, ("raw", "flood"), ("raw", "decoded"), ("bus", "flood"), ("raw", "tcp"), ("bus", "frames")]
    for _ in range(options.repeats):
        for side, kind in cases:
            runs.setdefault((side, kind), []).append(measure(side, kind, options.seconds))
    for case, found in runs.items():
        spans = {name: sorted(run[name] for run in found) for name in found[0]}
        print(*case, *(f"{name} {values[0]:.4g}..{values[-1]:.4g}" for name, values in spans.items()))

    def ratio(case: tuple[str, str], other: tuple[str, str], name: str) -> float:
        return statistics.median(
            ours[name] / theirs[name] for ours, theirs in zip(runs[case], runs[other], strict=True)
        )

    for what, case in (
        ("bus", ("bus", "paced")),
        ("a bare subscriber that decodes", ("raw", "codec")),
        ("a bare subscriber that decodes in another thread", ("raw", "handed")),
    ):
        p50, cost = (ratio(case, ("raw", "paced"), name) for name in ("p50", "cpu_per_message"))
        print(f"EstimatedState at {RATE:g} Hz, {what}: p50 {p50:.2f} x raw zenoh, CPU of both sides {cost:.2f} x")
    for what, case in (("bus", ("bus", "flood")), ("a bare subscriber that decodes", ("raw", "decoded"))):
        print(f"throughput at 100 B, {what}: {ratio(case, ('raw', 'flood'), 'rate'):.3f} x raw zenoh")
    print(f"frames of {SIZE}²: {ratio(('bus', 'frames'), ('raw', 'tcp'), 'rate'):.1f} x raw zenoh over TCP")
    print("load", *os.getloadavg())


if __name__ == "__main__":
    main()
