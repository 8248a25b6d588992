"""Distributes torques to the four fins of a torpedo-shaped vehicle."""

import math

import imc
from autonomy.control import EnabledLoops, Fins, allocate_fins, fin_torques
from runtime import State, Task, consume, param, periodic

LONGEST_STEP = 1.0  # s
NEAR = math.radians(6.0)  # a servo that is nearer to its command follows it


class Allocator(Task):
    """Turns DesiredControl into the positions of four fins, while the loop TORQUE is enabled.

    Fins are 0 below, 1 at port, 2 at starboard, 3 above. A brake crosses them; roll and pitch get what is left. The
    fins are centered when the task ends, even by a failure, and if DesiredControl falls silent, which is an error. So
    is a servo that stops reporting its position, or does not follow its commands.
    """

    effect_k: float = param(0.25, "N m/rad", "Roll torque of a fin.", name="Fin effect K", minimum=1e-6)
    effect_m: float = param(0.5, "N m/rad", "Pitch torque of a fin.", name="Fin effect M", minimum=1e-6)
    effect_n: float = param(0.5, "N m/rad", "Yaw torque of a fin.", name="Fin effect N", minimum=1e-6)
    maximum_fin_rotation: float = param(25.0, "°", "Largest deflection.", minimum=0, maximum=90)
    maximum_rotation_rate: float = param(300.0, "°/s", "Fastest movement of a fin.", minimum=0)
    brake_margin: float = param(0.8, "1", "Fraction of the deflection used for braking.", minimum=0, maximum=1)

    servo_timeout: float = param(3.0, "s", "Longest time without a position from a servo.", minimum=0.1)
    control_timeout: float = param(
        4.0, "s", "Longest time without torques.", name="DesiredControl Timeout", minimum=0.1
    )

    def configure(self) -> None:
        self._effects = self.effect_k, self.effect_m, self.effect_n
        self._limit = math.radians(self.maximum_fin_rotation)
        self._rate = math.radians(self.maximum_rotation_rate)

    def start(self) -> None:
        self._loops = EnabledLoops(imc.CLoopsMask.TORQUE)
        self._fins: Fins = (0.0, 0.0, 0.0, 0.0)
        self._moved, self._began = -math.inf, self.now
        self._braking = False
        self._servos: dict[int, float] = {}
        self._followed: dict[int, float] = {}
        self.set_entity_state(State.NORMAL, "idle")

    def stop(self) -> None:
        for number in range(4):
            self.publish(imc.SetServoPosition(id=number, value=0.0))

    @consume
    def on_control_loops(self, loops: imc.ControlLoops) -> None:
        if not self._loops.receive(loops):
            return
        if self._loops.mask:
            self._moved, self._began = -math.inf, self.now
            self.set_entity_state(State.NORMAL, "active")
        else:
            self._move((0.0, 0.0, 0.0, 0.0))
            self.set_entity_state(State.NORMAL, "idle")

    @consume
    def record_servo_response(self, position: imc.ServoPosition) -> None:
        servo, now = position.id, self.now
        self._servos[servo] = now
        if servo < len(self._fins):
            follows = abs(position.value - self._fins[servo]) <= NEAR
            self._followed[servo] = now if follows else self._followed.get(servo, now)

    @periodic(1.0)
    def supervise(self) -> None:
        followed = {servo: max(at, self._began) for servo, at in self._followed.items()}
        astray = [str(servo) for servo, at in followed.items() if self.age(at) > self.servo_timeout]
        silent = [str(servo) for servo, received in self._servos.items() if self.age(received) > self.servo_timeout]
        if self._loops.mask and self.age(max(self._moved, self._began)) > self.control_timeout:
            self._move((0.0, 0.0, 0.0, 0.0))
            self.set_entity_state(State.ERROR, f"no DesiredControl for {self.control_timeout:g} s")
        elif silent:
            self.set_entity_state(State.ERROR, f"no position from servo {', '.join(sorted(silent))}")
        elif astray and self._loops.mask:
            self.set_entity_state(State.ERROR, f"servo {', '.join(sorted(astray))} not at the commanded angle")
        elif self.entity.state is State.ERROR:
            self.set_entity_state(State.NORMAL, "active" if self._loops.mask else "idle")

    @consume
    def set_fin_braking(self, brake: imc.Brake) -> None:
        self._braking = brake.op == imc.Brake.Op.START

    @consume
    def deflect(self, control: imc.DesiredControl) -> None:
        if not self._loops.mask:
            return
        wanted = control.k, control.m, control.n
        if not all(map(math.isfinite, wanted)):
            self.log.warning(f"desired torques are not numbers: {wanted}")
            return
        dt, self._moved = control.timestamp - self._moved, control.timestamp
        step = self._rate * dt if 0.0 < dt <= LONGEST_STEP else math.inf
        crossed = self.brake_margin * self._limit if self._braking else 0.0
        fins = allocate_fins(wanted, self._effects, self._limit, crossed)
        a, b, c, d = map(_moved, self._fins, fins, (step, step, step, step))
        self._move((a, b, c, d))
        k, m, n = fin_torques(self._fins, self._effects)
        self.publish(imc.AllocatedControlTorques(k=k, m=m, n=n))

    def _move(self, fins: Fins) -> None:
        self._fins = fins
        for number, value in enumerate(fins):
            self.publish(imc.SetServoPosition(id=number, value=value))


def _moved(old: float, new: float, step: float) -> float:
    """Value from `old` toward `new`, at most one step away."""
    low, high = old - step, old + step
    return low if new < low else high if new > high else new
