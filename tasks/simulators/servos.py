"""Simulates servos that turn the fins."""

import math

import imc
from runtime import State, consume, param, periodic
from tasks.simulators.powered_device import PoweredDeviceTask

ROUNDING = 1e-7  # rad
MICROSECONDS = 1e6  # in a second


class Servos(PoweredDeviceTask):
    """Turns servos to the angles of SetServoPosition at a limited rate; publishes ServoPosition as they move.

    A servo publishes when it arrives, at `Update Rate` while it turns, and once a second in any case. After `Command
    Timeout` without a command it returns to the middle. With `Generate Faults`, all servos get stuck at `Fault Time`.
    Without power they stay where they are, and report nothing.
    """

    number_of_servos: int = param(4, "1", "Number of servos.", minimum=1, maximum=255, editable=False)
    maximum_angle: float = param(45.0, "°", "Largest angle to either side.", minimum=0, maximum=90)
    enable_rotation_rate: bool = param(True, "", "Whether servos need time to turn.")
    maximum_rate: float = param(333.3, "°/s", "Fastest turn.", minimum=1)
    update_rate: float = param(50.0, "Hz", "Rate of ServoPosition while a servo turns.", minimum=1, maximum=1000)
    command_timeout: float = param(2.0, "s", "Age at which a position expires; 0 for never.", minimum=0, maximum=3600)
    generate_faults: bool = param(False, "", "Whether the servos get stuck.")
    fault_time: float = param(10.0, "s", "Time from the start to the fault.", minimum=0)

    def configure(self) -> None:
        self._limit = math.radians(self.maximum_angle)
        self._fastest = math.radians(self.maximum_rate) if self.enable_rotation_rate else math.inf

    def start(self) -> None:
        count = self.number_of_servos
        self._position, self._target = [0.0] * count, [0.0] * count
        self._since = [self.now_ns] * count
        self._commanded = [self.now] * count
        self._moving = [False] * count
        self._stuck = False
        if self.generate_faults:
            self.after(self.fault_time, self._fail)
        self.set_entity_state(State.NORMAL, "active")

    @consume
    def on_set_servo_position(self, wish: imc.SetServoPosition) -> None:
        servo = wish.id
        if servo >= self.number_of_servos or not math.isfinite(wish.value) or self._stuck or not self.has_power:
            return
        limit, angle = self._limit, wish.value
        self._commanded[servo] = self.now
        self._aim(servo, -limit if angle < -limit else limit if angle > limit else angle)

    def on_power_loss(self) -> None:
        self._freeze()

    @periodic(1.0)
    def move_servos(self) -> None:
        if not self.has_power:
            return
        for servo in range(self.number_of_servos):
            stale = self.command_timeout and self.now - self._commanded[servo] > self.command_timeout
            if stale and self._target[servo] and not self._stuck:
                if self.age(self._commanded[servo]) > self.command_timeout:
                    self.log.error(
                        f"no position for servo {servo} in {self.command_timeout:g} s; it goes to the middle"
                    )
                self._aim(servo, 0.0)
            self._advance(servo)
            self._publish(servo)

    def _aim(self, servo: int, target: float) -> None:
        self._advance(servo)
        self._target[servo] = target
        if not self._moving[servo]:
            self._schedule_arrival(servo)

    def _advance(self, servo: int) -> None:
        """Turn a servo for the time since it was last turned."""
        now, target, position = self.now_ns, self._target[servo], self._position[servo]
        elapsed, self._since[servo] = now - self._since[servo], now
        reach = ROUNDING + self._fastest * (elapsed if elapsed > 1 else 1) * 1e-9
        if abs(target - position) > reach:
            target = position + math.copysign(reach, target - position)
        self._position[servo] = target

    def _schedule_arrival(self, servo: int) -> None:
        """Look again when the servo arrives, or when the next report is due, whichever is first."""
        distance = abs(self._target[servo] - self._position[servo])
        moving = self._moving[servo] = distance > 0.0
        if moving:
            # rounded up to a time that a log can represent
            arrival = math.ceil(distance / self._fastest * MICROSECONDS) / MICROSECONDS
            self.after(min(arrival, 1.0 / self.update_rate), self._arrive, servo)

    def _arrive(self, servo: int) -> None:
        if not self.has_power:
            return
        self._advance(servo)
        self._publish(servo)
        self._schedule_arrival(servo)

    def _publish(self, servo: int) -> None:
        self.publish(imc.ServoPosition(id=servo, value=self._position[servo]))

    def _freeze(self) -> None:
        for servo in range(self.number_of_servos):
            self._advance(servo)
            self._target[servo] = self._position[servo]

    def _fail(self) -> None:
        self._freeze()
        self._stuck = True
        self.set_entity_state(State.ERROR, "the servos are stuck")
