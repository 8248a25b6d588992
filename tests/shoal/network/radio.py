"""A bad radio between network namespaces: it loses, delays, reorders and doubles what goes through it.

The kernel's own (`tc netem`) is not in every kernel. Run as a program with the names of interfaces, each an end of a
veth pair whose other end is in the namespace of a station: a frame from one goes to all others. It reads one line of
JSON per change, the fields of `Quality`, and answers each with a line.
"""

import array
import contextlib
import fcntl
import heapq
import json
import os
import random
import selectors
import socket
import struct
import sys
import time
from dataclasses import dataclass

ETHERNET = 3  # ETH_P_ALL
SIOCETHTOOL = 0x8946
OFFLOADS = (0x17, 0x1F, 0x24, 0x2C)  # ETHTOOL_STXCSUM, _STSO, _SGSO, _SGRO
LARGEST_FRAME = 1 << 16
MOST_WAITING = 20_000  # frames


@dataclass(frozen=True)
class Quality:
    """Shares of frames that are lost and doubled; delay and its largest addition in s; whether nothing goes through."""

    loss: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0
    double: float = 0.0
    cut: bool = False


def without_offloads(name: str) -> None:
    """Let the kernel compute checksums and cut segments itself: there is no hardware behind this interface."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        for offload in OFFLOADS:
            value = array.array("I", (offload, 0))
            request = struct.pack("16sP16x", name.encode(), value.buffer_info()[0])
            with contextlib.suppress(OSError):  # an old kernel may not have it
                fcntl.ioctl(any_socket, SIOCETHTOOL, request)


class Radio:
    """Carries frames between interfaces."""

    def __init__(self, names: list[str], seed: int = 1):
        self.quality = Quality()
        self._chance = random.Random(seed)
        self._ends = [socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ETHERNET)) for _ in names]
        for end, name in zip(self._ends, names, strict=True):
            end.bind((name, ETHERNET))
            end.setblocking(False)
        self._waiting: list[tuple[float, int, int, bytes]] = []
        self._count = 0

    def run(self) -> None:
        """Carry frames until the standard input ends."""
        text = b""
        with selectors.DefaultSelector() as selector:
            for number, end in enumerate(self._ends):
                selector.register(end, selectors.EVENT_READ, number)
            selector.register(0, selectors.EVENT_READ)
            print("ready", flush=True)
            while True:
                wait = max(0.0, self._waiting[0][0] - time.monotonic()) if self._waiting else None
                for key, _ in selector.select(wait):
                    if key.fd:
                        self._take(key.data)
                        continue
                    block = os.read(0, 1 << 16)
                    if not block:
                        return
                    *lines, text = (text + block).split(b"\n")
                    for line in lines:
                        self.quality = Quality(**json.loads(line))
                        print("changed", flush=True)
                self._give()

    def _take(self, number: int) -> None:
        with contextlib.suppress(BlockingIOError):
            frame, place = self._ends[number].recvfrom(LARGEST_FRAME)
            if place[2] == socket.PACKET_OUTGOING or self.quality.cut:
                return
            for other in range(len(self._ends)):
                if other != number:
                    self._send(other, frame)

    def _send(self, other: int, frame: bytes) -> None:
        quality, chance = self.quality, self._chance
        for _ in range(2 if chance.random() < quality.double else 1):
            if chance.random() >= quality.loss and len(self._waiting) < MOST_WAITING:
                self._count += 1
                due = time.monotonic() + quality.delay + chance.uniform(0.0, quality.jitter)
                heapq.heappush(self._waiting, (due, self._count, other, frame))

    def _give(self) -> None:
        while self._waiting and self._waiting[0][0] <= time.monotonic():
            _, _, other, frame = heapq.heappop(self._waiting)
            with contextlib.suppress(OSError):  # a station is gone, or its queue is full
                self._ends[other].send(frame)


if __name__ == "__main__":
    Radio(sys.argv[1:]).run()
