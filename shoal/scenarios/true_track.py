"""True tracks of vehicles in a run, coarsely."""

import math

import imc
from shoal.scenarios.result import TRACK_PERIOD
from support.wgs84 import displace


class TrueTrack:
    """Notes the true position of a vehicle each `TRACK_PERIOD`: `points` has latitude, longitude (°), depth (m) ..."""

    transient = True

    def __init__(self, system: int):
        self.points: list[float] = []
        self._system = system
        self._next = -math.inf

    def record_position(self, truth: imc.SimulatedState) -> None:
        """A state of any vehicle."""
        if truth.src == self._system and truth.timestamp >= self._next:
            if not math.isfinite(truth.lat + truth.lon + truth.height + truth.x + truth.y + truth.z):
                return
            self._next = truth.timestamp + TRACK_PERIOD
            lat, lon, _ = displace(truth.lat, truth.lon, truth.height, truth.x, truth.y, truth.z)
            self.points += [round(math.degrees(lat), 7), round(math.degrees(lon), 7), round(truth.z, 2)]
