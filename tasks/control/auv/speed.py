"""Controls the speed of an underwater vehicle with one thruster."""

import math

import imc
from autonomy.control import STANDSTILL, EnabledLoops, PIDGains, ThrusterController, ThrusterGains
from runtime import State, Task, consume, param, periodic
from runtime.vehicle import general_number
from support.rotations import Vector, rotate_to_body

LONGEST_STEP = 1.0  # s
POWERED = 0.5  # m/s that the motor should give; less may not move the vehicle
SHARE = 0.3  # of this speed; a vehicle with less is held by something


class Speed(Task):
    """Turns DesiredSpeed into thrust, while the loop SPEED is enabled.

    A speed in m/s becomes a rotation rate: feed-forward plus a PID of the error, whose limited integral keeps running
    while the rate ramps, as on the LAUV. D acts on the measured speed only, so a new reference causes no jump. Each Rpm
    triggers one thrust command. Brake, Abort, a silent motor, silent navigation and the end of the task, even by a
    failure, stop the thruster. So does a vehicle that does not move, on the bottom or before a wall.
    """

    hardware_control: bool = param(
        True, "", "The motor controller regulates the rotation rate itself.", name="Hardware RPMs Control"
    )
    full_thrust: float = param(2500.0, "rpm", "Rotation rate at full thrust.", name="RPMs at Maximum Thrust", minimum=1)
    minimum_rpm: float = param(0.0, "rpm", "Lowest rotation rate while moving.", name="Minimum RPM Limit", minimum=0)
    rpm_acceleration: float = param(
        80.0, "rpm/s", "Fastest change of the rotation rate.", name="Maximum RPM Acceleration", minimum=0
    )
    speed_gains: list[float] = param([0.0, 25.0, 0.0], "rpm/(m/s)", "P, I, D on speed.", name="MPS PID Gains", size=3)
    speed_integral_limit: float = param(
        400.0, "rpm", "Limit of the integral; below 0 for none.", name="MPS Integral Limit"
    )
    speed_feedforward: float = param(
        1000.0, "rpm/(m/s)", "Feed-forward gain of the speed.", name="MPS Feedforward Gain"
    )
    rpm_gains: list[float] = param(
        [0.00013, 0.00021, 2.9e-05], "1/rpm", "P, I, D on rotation rate.", name="RPMs PID Gains", size=3
    )
    rpm_feedforward: float = param(
        0.00026, "1/rpm", "Feed-forward gain of the rotation rate.", name="RPMs Feedforward Gain"
    )
    lowest_thrust: float = param(0.0, "1", "Lowest thrust.", name="Negative Thrust Limit", minimum=-1, maximum=1)
    highest_thrust: float = param(1.0, "1", "Highest thrust.", name="Positive Thrust Limit", minimum=0, maximum=1)
    rpm_timeout: float = param(2.0, "s", "Longest time without Rpm from the motor.", name="RPM Timeout", minimum=0.1)
    state_timeout: float = param(
        2.0, "s", "Longest time without EstimatedState.", name="EstimatedState Timeout", minimum=0.1
    )
    stuck_timeout: float = param(
        12.0, "s", "How long the motor may run while the vehicle does not move; bursts are shorter.", minimum=1
    )
    log_parcels: bool = param(False, "", "Publish the parts of the control law.", name="Log PID Parcels")

    def configure(self) -> None:
        limit = self.speed_integral_limit
        gains = ThrusterGains(
            PIDGains(*self.speed_gains, integral_limit=limit if limit >= 0.0 else math.inf),
            self.speed_feedforward,
            PIDGains(*self.rpm_gains, limit=1.0),
            self.rpm_feedforward,
            self.rpm_acceleration,
            self.minimum_rpm,
            general_number(self.vehicle.profile, "Maximum Underwater RPMs", self.full_thrust),
            self.full_thrust,
            self.hardware_control,
        )
        if not hasattr(self, "_law"):  # the rotation rate stays if parameters change
            self._law = ThrusterController(gains)
        self._law.set_gains(gains)

    def start(self) -> None:
        self._loops = EnabledLoops(imc.CLoopsMask.SPEED)
        self._braking = False
        self._stated = math.inf
        self._state: imc.EstimatedState | None = None
        self._stream: Vector = (0.0, 0.0, 0.0)
        self._rest()
        self.set_entity_state(State.NORMAL, "idle")

    def stop(self) -> None:
        self.publish(imc.SetThrusterActuation(id=0, value=0.0))

    @consume
    def on_control_loops(self, loops: imc.ControlLoops) -> None:
        if not self._loops.receive(loops):
            return
        self._rest()
        if self._loops.mask:
            self.set_entity_state(State.NORMAL, "active")
        else:
            self._thrust(0.0)
            self.set_entity_state(State.NORMAL, "idle")

    @consume
    def set_desired_speed(self, speed: imc.DesiredSpeed) -> None:
        if not self._loops.mask:
            return
        if not math.isfinite(speed.value) or speed.speed_units not in tuple(imc.SpeedUnits):
            self.log.warning(f"invalid desired speed: {speed.value} in unit {speed.speed_units}")
            return
        if self._desired is None or speed.speed_units != self._desired.speed_units:
            self._law.reset_integrals()
        self._desired = speed

    @consume
    def cut_thrust_on_brake(self, brake: imc.Brake) -> None:
        self._braking = brake.op == imc.Brake.Op.START
        if self._braking:
            self._law.halt()
            self._thrust(0.0)

    @consume(others=True)
    def abort(self, abort: imc.Abort) -> None:
        if self.is_addressed_or_broadcast(abort):
            self._loops.mask = 0
            self._rest()
            self._thrust(0.0)
            self.set_entity_state(State.NORMAL, "idle")

    @consume
    def record_stream_velocity(self, stream: imc.EstimatedStreamVelocity) -> None:
        self._stream = stream.x, stream.y, stream.z

    @consume
    def control_speed(self, state: imc.EstimatedState) -> None:
        """Move the rotation rate toward that of a speed in m/s."""
        self._stated, self._state = self.now, state
        desired = self._desired
        if desired is None or desired.speed_units != imc.SpeedUnits.METERS_PS:
            return
        before, self._followed = self._followed, state.timestamp
        dt = state.timestamp - before
        dt = dt if 0.0 < dt <= LONGEST_STEP and not self._braking else 0.0
        self._law.step_speed_loop(state.u, desired.value, dt)
        if self.log_parcels and dt and desired.value >= STANDSTILL:
            parts = self._law.speed
            self.publish(imc.ControlParcel(p=parts.p, i=parts.i, d=parts.d, a=parts.p + parts.i + parts.d))

    @consume
    def control_rpm(self, rpm: imc.Rpm) -> None:
        desired, wanted = self._desired, None
        before, self._driven = self._driven, rpm.timestamp
        if desired is not None and desired.speed_units != imc.SpeedUnits.PERCENTAGE:
            wanted = desired.value if desired.speed_units == imc.SpeedUnits.RPM else self._law.rpm
        dt = rpm.timestamp - before
        actuation = self._law.actuation(rpm.value, wanted, dt if 0.0 < dt <= LONGEST_STEP else 0.0)
        if desired is not None:
            self._thrust(actuation if wanted is not None else 0.01 * desired.value)

    @periodic(1.0)
    def supervise(self) -> None:
        """Stop the thruster if no Rpm arrives, or no EstimatedState any more, or if the vehicle does not move."""
        if self._desired is None:
            return
        self._note_motion()
        if self.age(max(self._driven, self._began)) > self.rpm_timeout:
            reason = f"no Rpm for {self.rpm_timeout:g} s"
        elif self.age(max(self._stated, self._began)) > self.state_timeout:
            reason = f"no EstimatedState for {self.state_timeout:g} s"
        elif self._vain >= self.stuck_timeout:
            reason = "not moving though the motor runs"
        else:
            return
        self._rest()
        self._thrust(0.0)
        self.set_entity_state(State.ERROR, reason)

    def _note_motion(self) -> None:
        """Count the seconds that the motor runs in vain; a vehicle on the bottom may hop ahead now and then."""
        expected, state = self._law.measured / self.speed_feedforward if self.speed_feedforward else 0.0, self._state
        if state is None or abs(expected) < POWERED:
            self._vain = 0.0
            return
        # Against a current, a vehicle that does not move over ground is not held by anything.
        along = state.u - rotate_to_body(state.phi, state.theta, state.psi, self._stream)[0]
        self._vain = max(0.0, self._vain + (1.0 if along / expected < SHARE else -1.0))

    def _rest(self) -> None:
        self._desired: imc.DesiredSpeed | None = None
        self._began = self.now
        self._followed = self._driven = -math.inf
        self._vain = 0.0
        self._law.reset()

    def _thrust(self, value: float) -> None:
        limited = 0.0 if self._braking else max(self.lowest_thrust, min(self.highest_thrust, value))
        self.publish(imc.SetThrusterActuation(id=0, value=limited))
