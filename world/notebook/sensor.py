"""Sensors of a quadrotor, and the manager that reads all of them."""

import math
from typing import Any
from zlib import crc32

from numpy.random import PCG64, Generator, SeedSequence

from world.notebook.quadrotor import QuadrotorState

FIDELITIES = ("physical", "original")
EARLY = 1e-9  # of a period, by which the time of a step may be short for rounding


class Sensor:
    """A sensor; what it measures is what `read` returns.

    `fidelity` is "physical", or "original" for what quadsim's sensor does, mistakes included. Each sensor has random
    numbers of its own, by `seed` and its name at the beginning: another sensor does not change them. Raises ValueError.
    """

    def __init__(self, name: str = "Abstract Sensor", fidelity: str = "physical", seed: int = 0):
        if fidelity not in FIDELITIES:
            raise ValueError(f"fidelity {fidelity!r} is not one of {', '.join(FIDELITIES)}")
        self.name = name
        self.fidelity = fidelity
        self.random: Generator = Generator(PCG64(SeedSequence([seed, crc32(name.encode())])))

    def __str__(self) -> str:
        return self.name

    def read(self, quad: QuadrotorState, n: int, Ts: float) -> Any:
        """The reading at step `n` of a simulation in steps of `Ts` (s); None for no data."""
        return 0


class SensorManager:
    """Reads its sensors in the order in which they were registered."""

    def __init__(self) -> None:
        self.sensors: list[Sensor] = []

    def register(self, sensor: Sensor) -> None:
        """Add a sensor. Raises ValueError if one has its name, since readings are distinguished by it."""
        if any(sensor.name == other.name for other in self.sensors):
            raise ValueError(f"there is a sensor {sensor.name!r} already: give this one another name")
        self.sensors += [sensor]

    def get_data_packet(self, quad: QuadrotorState, i: int, Ts: float) -> dict[str, Any]:
        """The reading of each sensor by its name, None for no data. An exception carries the name as a note."""
        packet: dict[str, Any] = {}
        for sensor in self.sensors:
            try:
                packet[sensor.name] = sensor.read(quad, i, Ts)
            except Exception as error:
                error.add_note(f"sensor {sensor.name!r}, step {i}")
                raise
        return packet


class Pace:
    """Finds the steps at which something happens `rate` times a second, at every step if steps are longer.

    It happens in the first step at or after each multiple of the period: without drift, also if it does not divide.
    """

    def __init__(self, rate: float, what: str):
        if not 0.0 < rate < math.inf:
            raise ValueError(f"{what} is {rate:g}, not a positive number")
        self._rate = rate
        self._last: int | None = None

    def due(self, n: int, Ts: float) -> bool:
        number = math.floor(n * Ts * self._rate + EARLY)
        due, self._last = number != self._last, number
        return due
