"""Common parts of boat controllers: loops, references, supervision, and the parameters of both axes."""

import math
from typing import ClassVar

import imc
from autonomy.control import HORIZONTAL, EnabledLoops, HeadingController, SpeedController
from runtime import State, Task, consume, param, periodic

Loops = imc.CLoopsMask
SPEED, YAW, YAW_RATE = Loops.SPEED.value, Loops.YAW.value, Loops.YAW_RATE.value
LONGEST_STEP = 1.0  # s; without EstimatedState for longer, the actuators go to neutral


class BoatController(Task):
    """Controls the boat at each EstimatedState while one of its loops is enabled.

    The actuators are neutral while no loop is enabled, while braking, without EstimatedState, and after the task ends,
    even by a failure. Abort disables the loops. An enabled loop without a reference for too long is an error, and so is
    a motor or servo that stops reporting.
    """

    controlled: ClassVar[int] = 0

    reference_timeout: float = param(5.0, "s", "How long an enabled loop may be without a reference.", minimum=0)
    actuator_timeout: float = param(2.5, "s", "Longest time without a report of a motor or servo.", minimum=1.5)
    log_parcels: bool = param(False, "", "Publish the parts of each control law.", name="Log PID Parcels")

    _heading: HeadingController | None = None
    _speed: SpeedController | None = None

    def actuate(self, state: imc.EstimatedState, mask: int, dt: float) -> bool:
        """Move the actuators for the loops in `mask`, `dt` s after the last call; True if all references are set."""
        raise NotImplementedError

    def center_actuators(self) -> None:
        """Move the actuators to neutral."""
        raise NotImplementedError

    def start(self) -> None:
        self._loops = EnabledLoops(self.controlled)
        self._braking = self._given_up = False
        self._reports: dict[int, float] = {}
        self._controlled = self._complete = -math.inf
        for law in (self._heading, self._speed):
            if law is not None:
                law.reset()
        self.center_actuators()
        self.set_entity_state(State.NORMAL, "idle")

    def stop(self) -> None:
        self.center_actuators()

    @consume
    def on_control_loops(self, loops: imc.ControlLoops) -> None:
        before = self._loops.mask
        if not self._loops.receive(loops):
            return
        mask = self._loops.mask
        if self._heading is not None and (mask ^ before) & HORIZONTAL:
            self._heading.reset()
        if self._speed is not None and (mask ^ before) & SPEED:
            self._speed.reset()
        self._complete, self._given_up = self.now, False
        if not mask:
            self.center_actuators()
        self.set_entity_state(State.NORMAL, "active" if mask else "idle")

    @consume
    def set_desired_heading(self, desired: imc.DesiredHeading) -> None:
        if self._heading is not None and self._loops.mask & YAW and self._is_number(desired.value, "heading"):
            self._heading.heading = desired.value

    @consume
    def set_desired_heading_rate(self, desired: imc.DesiredHeadingRate) -> None:
        rate = self._loops.mask & YAW_RATE
        if self._heading is not None and rate and self._is_number(desired.value, "heading rate"):
            self._heading.desired_rate = desired.value

    @consume
    def set_desired_speed(self, desired: imc.DesiredSpeed) -> None:
        if self._speed is not None and self._loops.mask & SPEED and not self._speed.set_desired(desired):
            self.log.warning(f"invalid desired speed: {desired.value} in unit {desired.speed_units}")

    @consume
    def center_actuators_on_brake(self, brake: imc.Brake) -> None:
        self._braking = brake.op == imc.Brake.Op.START
        if self._braking:
            self.center_actuators()

    @consume(others=True)
    def abort(self, abort: imc.Abort) -> None:
        if self.is_addressed_or_broadcast(abort):
            self._loops.mask = 0
            self.center_actuators()
            self.set_entity_state(State.NORMAL, "idle")

    @consume
    def control(self, state: imc.EstimatedState) -> None:
        before, self._controlled = self._controlled, state.timestamp
        if not self._loops.mask or self._braking or self._given_up:
            return
        dt = state.timestamp - before
        if self.actuate(state, self._loops.mask, dt if 0.0 < dt <= LONGEST_STEP else 0.0):
            self._complete = self.now
            self.set_entity_state(State.NORMAL, "active")
        elif self.age(self._complete) > self.reference_timeout:
            self.set_entity_state(State.ERROR, "timed out while waiting for a reference")

    @periodic(2.0)
    def supervise(self) -> None:
        """Move the actuators to neutral if EstimatedState or the report of an actuator is missing."""
        if not self._loops.mask:
            return
        silent = [entity for entity, at in self._reports.items() if self.age(at) > self.actuator_timeout]
        if self.age(max(self._controlled, self._complete)) > LONGEST_STEP:
            self.center_actuators()
            self.set_entity_state(State.ERROR, "EstimatedState is missing")
        elif silent:
            self._given_up = True
            self.center_actuators()
            names = (self.vehicle.entities.label(self.system, entity) for entity in silent)
            self.set_entity_state(State.ERROR, f"no report of {', '.join(names)} for {self.actuator_timeout:g} s")

    def _is_number(self, value: float, what: str) -> bool:
        if not math.isfinite(value):
            self.log.warning(f"desired {what} is not a number")
        return math.isfinite(value)


class HeadingTask(BoatController):
    """A boat controller that steers."""

    heading_gains: list[float] = param([0.5, 0.0, 0.0], "1/s", "P, I, D of heading.", name="Yaw PID Gains", size=3)
    maximum_rate: float = param(
        15.0, "°/s", "Largest heading rate that is commanded.", name="Maximum Heading Rate", minimum=0
    )
    rate_gains: list[float] = param([0.8, 0.3, 0.0], "s", "P, I, D of the rate.", name="Heading Rate PID Gains", size=3)
    rate_feedforward: float = param(0.5, "s", "Feed-forward gain of the rate.", name="Heading Rate Feedforward Gain")

    heading_controller: HeadingController

    def configure(self) -> None:
        super().configure()
        rate, before = math.radians(self.maximum_rate), self._heading
        self.heading_controller = self._heading = HeadingController(
            self.heading_gains, rate, self.rate_gains, self.rate_feedforward
        )
        if before is not None:
            self.heading_controller.heading, self.heading_controller.desired_rate = before.heading, before.desired_rate

    def steering_effort(self, state: imc.EstimatedState, mask: int, dt: float, limit: float) -> float | None:
        """Effort that turns the boat to starboard, between -`limit` and `limit`; None without a reference."""
        effort = self.heading_controller.effort(mask, state.psi, state.r, dt, limit)
        if effort is not None and mask & YAW and not mask & YAW_RATE:
            self.publish(imc.DesiredHeadingRate(value=self.heading_controller.rate))
        if self.log_parcels:
            self.publish(self.heading_controller.pid_parts)
        return effort


class SpeedTask(BoatController):
    """A boat controller that drives."""

    full_thrust: float = param(2500.0, "rpm", "Rotation rate at full thrust.", name="RPMs at Maximum Thrust", minimum=1)
    minimum_rpm: float = param(0.0, "rpm", "Lowest rotation rate while moving.", name="Minimum RPM Limit", minimum=0)
    maximum_rpm: float = param(2500.0, "rpm", "Highest rotation rate.", name="Maximum RPM Limit", minimum=0)
    rpm_acceleration: float = param(
        160.0, "rpm/s", "Fastest change of the rotation rate.", name="Maximum RPM Acceleration", minimum=0
    )
    speed_gains: list[float] = param([0.0, 25.0, 0.0], "rpm/(m/s)", "P, I, D on speed.", name="MPS PID Gains", size=3)
    speed_integral_limit: float = param(
        400.0, "rpm", "Limit of the integral; below 0 for none.", name="MPS Integral Limit"
    )
    speed_feedforward: float = param(
        1000.0, "rpm/(m/s)", "Feed-forward gain of the speed.", name="MPS Feedforward Gain"
    )
    highest_thrust: float = param(1.0, "1", "Highest thrust.", name="Maximum Thrust Actuation", minimum=0, maximum=1)

    speed_controller: SpeedController

    @consume
    def record_motor_report_time(self, rpm: imc.Rpm) -> None:
        self._reports[rpm.src_ent] = self.now

    def configure(self) -> None:
        super().configure()
        limit, before = self.speed_integral_limit, self._speed
        self.speed_controller = self._speed = SpeedController(
            self.speed_gains,
            limit if limit >= 0.0 else math.inf,
            self.speed_feedforward,
            (self.minimum_rpm, max(self.minimum_rpm, self.maximum_rpm)),
            self.rpm_acceleration,
            self.full_thrust,
        )
        if before is not None:
            self.speed_controller.desired = before.desired

    def thrust_fraction(self, state: imc.EstimatedState, mask: int, dt: float, *, held: bool = False) -> float | None:
        """Fraction of full actuation for the desired speed; 0 with the loop off, None without a reference."""
        if not mask & SPEED:
            return 0.0
        if self.speed_controller.desired is None:
            return None
        share = self.speed_controller.actuation(state.u, dt, held=held)
        if self.log_parcels:
            self.publish(self.speed_controller.pid_parts)
        return max(-self.highest_thrust, min(self.highest_thrust, share))
