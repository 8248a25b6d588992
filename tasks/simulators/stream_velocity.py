"""Simulates the current that carries the vehicle."""

import math

import imc
from runtime import State, Task, param, periodic

CONSTANT, GAUSS_MARKOV, SINUSOIDAL = SOURCES = "Constant", "Gauss-Markov", "Sinusoidal"


class StreamVelocity(Task):
    """Publishes the velocity of the water: constant, a Gauss-Markov process around the same mean, or a tide.

    `Sinusoidal` is DUNE's: amplitude * sin(2 pi t / period + phase) toward the slope, with t from the start, and no
    mean velocity.
    """

    execution_frequency: float = param(1.0, "Hz", "Rate of EstimatedStreamVelocity.", minimum=0.1, maximum=100)
    stream_velocity_source: str = param("Constant", "", "Model of the velocity.", choices=SOURCES)
    default_speed_north: float = param(0.0, "m/s", "Mean northward velocity.", minimum=-100, maximum=100)
    default_speed_east: float = param(0.0, "m/s", "Mean eastward velocity.", minimum=-100, maximum=100)
    default_speed_down: float = param(0.0, "m/s", "Mean downward velocity.", minimum=-100, maximum=100)
    standard_deviation: float = param(
        0.1, "m/s", "Standard deviation of the Gauss-Markov process, north and east.", minimum=0, maximum=3
    )
    time_constant: float = param(300.0, "s", "Time constant of the Gauss-Markov process.", minimum=1)
    amplitude: float = param(0.5, "m/s", "Largest speed of the sinusoidal current.", name="Sinusoidal -- Amplitude")
    period: float = param(3600.0, "s", "Period of the sinusoidal current.", name="Sinusoidal -- Period", minimum=0.001)
    phase: float = param(0.0, "°", "Phase of the sinusoidal current at the start.", name="Sinusoidal -- Phase")
    slope: float = param(
        0.0, "°", "Direction to which the sinusoidal current flows first, from north.", name="Sinusoidal -- Slope"
    )

    def start(self) -> None:
        self._north, self._east = self.random.standard_normal(2).tolist()
        self._began = self.now
        self.set_entity_state(State.NORMAL, "active")

    @periodic("execution_frequency")
    def publish_velocity(self, periods: int) -> None:
        north, east, down = self.default_speed_north, self.default_speed_east, self.default_speed_down
        if self.stream_velocity_source == SINUSOIDAL:
            angle = math.tau * (self.now - self._began) / self.period + math.radians(self.phase)
            speed, toward = self.amplitude * math.sin(angle), math.radians(self.slope)
            north, east, down = speed * math.cos(toward), speed * math.sin(toward), 0.0
        elif self.stream_velocity_source == GAUSS_MARKOV:
            keep = math.exp(-periods / (self.execution_frequency * self.time_constant))
            fresh = math.sqrt(1.0 - keep * keep)
            n, e = self.random.standard_normal(2).tolist()
            self._north, self._east = keep * self._north + fresh * n, keep * self._east + fresh * e
            north += self.standard_deviation * self._north
            east += self.standard_deviation * self._east
        self.publish(imc.EstimatedStreamVelocity(x=north, y=east, z=down))
