"""A bad network for tests: it loses, doubles, delays and reorders datagrams, always the same ones for the same seed."""

import heapq
import itertools
import random
import select
import socket
import threading
import time
from dataclasses import dataclass, field

HOST = "127.0.0.1"


@dataclass
class Trouble:
    """What happens to datagrams: shares that are lost, come twice, or are overtaken since they take `late` s longer."""

    loss: float = 0.0
    twice: float = 0.0
    overtaken: float = 0.0
    late: float = 0.03  # s
    delay: float = 0.0  # s
    seed: int = 1
    sent: int = 0
    lost: int = 0
    chance: random.Random = field(init=False)

    def __post_init__(self):
        self.chance = random.Random(self.seed)

    def fates(self):
        """How long (s) each copy of the next datagram takes; nothing if it is lost."""
        self.sent += 1
        if self.chance.random() < self.loss:
            self.lost += 1
            return []
        copies = 2 if self.chance.random() < self.twice else 1
        late = [self.chance.random() < self.overtaken for _ in range(copies)]
        return [self.delay + (self.chance.uniform(0.0, self.late) if slow else 0.0) for slow in late]


class Lossy(threading.Thread):
    """A bad line between a vehicle, which calls `port`, and a ground station, which listens at another one."""

    def __init__(self, station, **trouble):
        super().__init__(daemon=True)
        self.trouble = Trouble(**trouble)
        self.front, self.back = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        for end in (self.front, self.back):
            end.bind((HOST, 0))
            end.setblocking(False)
        self.port = self.front.getsockname()[1]
        self.targets = {self.back: (HOST, station), self.front: None}
        self.silent = self.ended = False
        self._wait, self._number = [], itertools.count()

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.ended = True
        self.join()
        self.front.close()
        self.back.close()

    def run(self):
        while not self.ended:
            due = self._wait[0][0] - time.monotonic() if self._wait else 0.05
            for end in select.select([self.front, self.back], [], [], max(0.0, min(due, 0.05)))[0]:
                self._take(end)
            while self._wait and self._wait[0][0] <= time.monotonic():
                _, _, end, data = heapq.heappop(self._wait)
                self._pass(end, data)

    def _take(self, end):
        """Read what has come at one end, and decide when it leaves at the other."""
        other = self.back if end is self.front else self.front
        while True:
            try:
                data, source = end.recvfrom(4096)
            except BlockingIOError:
                return
            except OSError:
                continue  # the station is not there yet
            if end is self.front:
                self.targets[self.front] = source
            for delay in [] if self.silent else self.trouble.fates():
                if delay:
                    heapq.heappush(self._wait, (time.monotonic() + delay, next(self._number), other, data))
                else:
                    self._pass(other, data)

    def _pass(self, end, data):
        if (target := self.targets[end]) is not None:
            try:
                end.sendto(data, target)
            except OSError:
                pass  # as above
