"""Simulates a depth sensor."""

import math

import imc
from runtime import State, Task, consume, param, periodic


class DepthSensor(Task):
    """Measures depth with white noise; never less than zero."""

    execution_frequency: float = param(10.0, "Hz", "Rate of Depth.", minimum=0.1, maximum=1000)
    standard_deviation: float = param(0.05, "m", "Standard deviation of the noise.", minimum=0)

    def start(self) -> None:
        self._truth: imc.SimulatedState | None = None
        self.set_entity_state(State.BOOT, "waiting for SimulatedState")

    @consume
    def update_truth(self, truth: imc.SimulatedState) -> None:
        if not math.isfinite(truth.z):
            self._truth = None
            self.set_entity_state(State.FAULT, "SimulatedState is not finite")
            return
        if self._truth is None:
            self.set_entity_state(State.NORMAL, "active")
        self._truth = truth

    @periodic("execution_frequency")
    def measure(self) -> None:
        noise = self.standard_deviation * self.random.standard_normal()
        if self._truth is not None:
            depth = max(0.0, self._truth.z + noise)
            self.publish(imc.Depth(timestamp=self._truth.timestamp, value=depth), keep_time=True)
