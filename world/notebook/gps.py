"""A GPS receiver on a quadrotor."""

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from support.rotations import rotation, to_ned
from world.notebook.quadrotor import Column, QuadrotorState, triple
from world.notebook.sensor import Pace, Sensor
from world.sensors import Drift

EPH_FIRST, EPH_LAST, EPH_TAU = 100.0, 0.1, 0.9  # m, m, s; of AirSim's GpsSimpleParams
EPH_3D, EPH_2D = 3.0, 4.0  # m


class GpsReading(NamedTuple):
    """Position (m) and velocity (m/s), each (3, 1), north, east, down; `fix` is 3, 2, or 0 for none; `eph` in m."""

    position: Column
    velocity: Column
    fix: int
    eph: float


@dataclass(frozen=True)
class Receiver:
    """A kind of receiver: `rate` in Hz, times in s, standard deviations north, east and down in m and m/s.

    `wander` are those that drive the error of position, with the inverse time constant `decay` (1/s).
    """

    rate: float
    latency: float = 0.0
    start_up: float = 0.0
    wander: tuple[float, float, float] = (0.0, 0.0, 0.0)
    decay: float = 0.0
    speed: float = 0.0
    converges: bool = False


RECEIVERS: Mapping[str, Receiver] = MappingProxyType(
    {
        # Beard and McLain, Small Unmanned Aircraft (2012), section 7.5
        "beard": Receiver(1.0, wander=(0.21, 0.21, 0.40), decay=1.0 / 1100.0, speed=0.05),
        "airsim": Receiver(50.0, latency=0.2, start_up=1.0, converges=True),
        "ideal": Receiver(10.0),
    }
)


class GPS(Sensor):
    """Measures position and velocity over ground as a GpsReading; the last one between two of them, None without any.

    `receiver` is "beard" (noise, and an error that wanders), "airsim" (no noise, but late, and converging at the start)
    or "ideal". There is no fix deeper than `max_depth` (m). The antenna is at `t` (m, body). `fresh` is whether the
    last reading was new. Raises ValueError.
    """

    def __init__(
        self, receiver: str = "beard", *, name: str = "GPS", t: Any = (0, 0, 0), max_depth: float = 0.2, seed: int = 0
    ):
        super().__init__(name, seed=seed)
        if receiver not in RECEIVERS:
            raise ValueError(f"receiver {receiver!r} is not one of {', '.join(RECEIVERS)}")
        kind = RECEIVERS[receiver]
        self.receiver: Receiver = kind
        self.max_depth = max_depth
        self.fresh: bool = False
        self._place, self._pace = triple(t, "t"), Pace(kind.rate, "rate")
        self._last: GpsReading | None = None
        self._waiting: deque[tuple[float, GpsReading]] = deque()
        self._drift: Drift | None = None
        if kind.decay:
            a, b, c = kind.wander
            share = math.sqrt(1.0 - math.exp(-2.0 * kind.decay / kind.rate))
            draws = self.random.standard_normal(3).tolist()
            self._drift = Drift((a / share, b / share, c / share), 1.0 / kind.decay, draws)

    def read(self, quad: QuadrotorState, n: int, Ts: float) -> GpsReading | None:
        now = n * Ts
        if self._pace.due(n, Ts):
            self._waiting.append((now + self.receiver.latency, self._measure(quad, now)))
        self.fresh = False
        while self._waiting and self._waiting[0][0] <= now + 1e-9:
            due, reading = self._waiting.popleft()
            if due >= self.receiver.start_up:
                self._last, self.fresh = reading, True
        return self._last

    def _measure(self, quad: QuadrotorState, now: float) -> GpsReading:
        draws = self.random.standard_normal(6)
        wander = (0.0, 0.0, 0.0)
        if self._drift is not None:
            wander = self._drift.advance(1.0 / self.receiver.rate, draws[:3].tolist())
        attitude = rotation(*triple(quad.Phi, "Phi"))
        place = np.add(triple(quad.r, "r"), to_ned(attitude, self._place))
        rates = triple(getattr(quad, "omega", (0.0, 0.0, 0.0)), "omega")
        body = np.add(triple(quad.v, "v"), np.cross(rates, self._place))
        velocity = np.add(to_ned(attitude, triple(body, "v")), self.receiver.speed * draws[3:])
        eph = EPH_LAST
        if self.receiver.converges:
            eph += (EPH_FIRST - EPH_LAST) * math.exp(-now / EPH_TAU)
        fix = 3 if eph <= EPH_3D else 2 if eph <= EPH_2D else 0
        if not place[2] <= self.max_depth:
            fix, place, velocity = 0, np.full(3, math.nan), np.full(3, math.nan)
        return GpsReading(np.add(place, wander)[:, None], velocity[:, None], fix, eph)
