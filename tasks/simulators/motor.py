"""Simulates a motor's tachometer, and the watchdog of its controller."""

import math
from collections import deque

import imc
from runtime import State, consume, param, periodic
from tasks.simulators.powered_device import PoweredDeviceTask

AVERAGED = 5  # samples
DEAD_BAND = 0.1  # of full actuation
SLOWEST = 30  # rpm


class Motor(PoweredDeviceTask):
    """Measures the motor speed: rpm = offset + factor * actuation, averaged over five samples.

    With a time constant the speed lags, like that of the engine in a boat's model. An actuation must be repeated: after
    `Command Timeout` without one, the motor publishes an actuation of 0 and stops. Without power it stops, silently.
    """

    execution_frequency: float = param(20.0, "Hz", "Rate of Rpm.", minimum=1, maximum=100)
    thruster_id: int = param(0, "1", "Thruster that the motor turns.", minimum=0, maximum=255)
    thruster_act_to_rpm_factor: list[float] = param(
        [9.55, 2450.4], "rpm", "Offset and factor of the speed.", name="Thruster Act to RPM Factor", size=2
    )
    time_constant: float = param(0.0, "s", "Time constant of the speed; 0 for none.", minimum=0, maximum=60)
    command_timeout: float = param(2.0, "s", "Age at which an actuation expires; 0 for never.", minimum=0, maximum=3600)

    def start(self) -> None:
        self._actuation = 0.0
        self._commanded = self.now
        self._turning = 0.0
        self._speeds = deque([0] * AVERAGED, AVERAGED)
        self.set_entity_state(State.NORMAL, "active")

    @consume
    def on_set_thruster_actuation(self, actuation: imc.SetThrusterActuation) -> None:
        if actuation.id == self.thruster_id and math.isfinite(actuation.value):
            self._actuation = max(-1.0, min(1.0, actuation.value))
            self._commanded = self.now

    def on_power_loss(self) -> None:
        self._actuation = self._turning = 0.0
        self._speeds.extend([0] * AVERAGED)

    @periodic("execution_frequency")
    def publish_rpm(self, periods: int) -> None:
        if not self.has_power:
            return
        if self._actuation and self.command_timeout and self.now - self._commanded > self.command_timeout:
            if self.age(self._commanded) > self.command_timeout:
                self.log.error(f"no actuation for {self.command_timeout:g} s; the motor stops")
            self._actuation = 0.0
            self.publish(imc.SetThrusterActuation(id=self.thruster_id, value=0.0))
        offset, factor = self.thruster_act_to_rpm_factor
        share = self._actuation
        wanted = math.copysign(offset, share) + factor * share if abs(share) >= DEAD_BAND else 0.0
        left = math.exp(-periods / (self.execution_frequency * self.time_constant)) if self.time_constant else 0.0
        self._turning = wanted + (self._turning - wanted) * left
        self._speeds.append(int(self._turning))
        speed = round(sum(self._speeds) / AVERAGED)  # integers
        self.publish(imc.Rpm(value=max(-32768, min(32767, speed)) if abs(speed) >= SLOWEST else 0))
