"""Simulates the wind that pushes a boat."""

import math

import imc
from runtime import State, Task, param, periodic


class Wind(Task):
    """Publishes AbsoluteWind: a mean and gusts, a Gauss-Markov process. The direction is where the wind comes from."""

    execution_frequency: float = param(1.0, "Hz", "Rate of AbsoluteWind.", minimum=0.1, maximum=100)
    speed: float = param(0.0, "m/s", "Mean speed.", minimum=0, maximum=50)
    direction: float = param(0.0, "°", "Direction that the wind comes from, true north.", minimum=-360, maximum=360)
    gusts: float = param(0.0, "m/s", "Standard deviation of the speed.", minimum=0, maximum=20)
    time_constant: float = param(10.0, "s", "Time constant of the gusts.", minimum=0.1)

    def start(self) -> None:
        self._gust = float(self.random.standard_normal())
        self.set_entity_state(State.NORMAL, "active")

    @periodic("execution_frequency")
    def publish_wind(self, periods: int) -> None:
        keep = math.exp(-periods / (self.execution_frequency * self.time_constant))
        self._gust = keep * self._gust + math.sqrt(1.0 - keep * keep) * float(self.random.standard_normal())
        speed = max(0.0, self.speed + self.gusts * self._gust)
        self.publish(imc.AbsoluteWind(direction=math.radians(self.direction), speed=speed, turbulence=self.gusts))
