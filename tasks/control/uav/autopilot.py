"""Keeps a multirotor in the air: velocities become roll, pitch, heading rate and rotor speed."""

import math
from enum import Enum
from functools import partial

import imc
from autonomy.control import (
    BLIND_DESCENT,
    GRAVITY,
    EnabledLoops,
    MultirotorCommand,
    MultirotorController,
    MultirotorGains,
    PIDGains,
    TouchdownDetector,
    rotor_actuation,
)
from autonomy.limits import OperatingLimits
from autonomy.navigation import VerticalSpeedEstimator
from runtime import State, Task, consume, param, periodic
from runtime.vehicle import general_number
from support.rotations import Vector

Loops = imc.CLoopsMask
Mode = imc.VehicleState.OpMode
UNCOMMANDED = (Mode.SERVICE, Mode.ERROR, Mode.BOOT)
LONGEST_STEP = 1.0  # s
UNKNOWN_MOTION = 0.5  # s in which the process stood still, after which the height starts anew
ALOFT = 2.0  # m; above this altitude at the start of the task, the vehicle is flying
RISES = 0.05  # m/s; a faster climb must be commanded to leave the ground
BLIND_STEP, BLIND_MARGIN, RECOVERY = 0.1, 30.0, 3.0  # s
BLIND_MEMORY = 120.0  # s; what fails again so soon is not trusted again


class FlightPhase(Enum):
    """Phase of the flight; the value is the mode in AutopilotMode."""

    GROUND = "GROUND"
    FOLLOW = "GUIDED"
    HOVER = "LOITER"
    LAND = "LAND"
    BLIND = "BLIND"


class Autopilot(Task):
    """Follows DesiredVelocity and DesiredHeading while the loop VELOCITY is enabled; hovers in the air otherwise.

    The rotors stand still on the ground until a climb is commanded, and after a touchdown: the vehicle should descend
    but does not, and the rotors carry less than three quarters of the weight for a second. It lands where it is after
    an Abort, after hovering without a maneuver for `Idle Timeout` (after an error, `Error Timeout`), and always below
    `Landing Fuel Level`. Without EstimatedState it descends level, by accelerometer and barometer or, without these, by
    the thrust that carries its weight; the second time in two minutes, down to the ground. So it does if barometer and
    accelerometer contradict EstimatedState. It flies no higher than the limits of altitude, by the barometer, too.
    """

    ahrs: str = param("AHRS", "", "Entity of acceleration.", name="Entity Label - AHRS")
    barometer: str = param("Barometer", "", "Entity of pressure.", name="Entity Label - Barometer")

    velocity_gains: list[float] = param([1.8, 0.5, 0.0], "1/s", "P, I, D.", name="Velocity PID Gains", size=3)
    vertical_gains: list[float] = param([3.0, 1.5, 0.0], "1/s", "P, I, D.", name="Vertical PID Gains", size=3)
    integral_limit: float = param(3.0, "m/s²", "Limit of both integrals.", minimum=0)
    position_gain: float = param(0.8, "1/s", "Gain of position and height while hovering.", minimum=0)
    heading_gain: float = param(1.5, "1/s", "Gain of the heading.", minimum=0)
    maximum_heading_rate: float = param(60.0, "°/s", "Largest heading rate.", minimum=1)
    maximum_tilt: float = param(25.0, "°", "Largest angle from the vertical.", minimum=1, maximum=45)
    maximum_acceleration: float = param(2.5, "m/s²", "Fastest change of the velocity reference.", minimum=0.1)
    maximum_speed: float = param(12.0, "m/s", "Highest speed over ground.", minimum=0.1)
    maximum_climb_rate: float = param(3.0, "m/s", "Fastest climb.", minimum=0.1)
    maximum_descent_rate: float = param(1.5, "m/s", "Fastest descent.", minimum=0.1)
    landing_rate: float = param(0.5, "m/s", "Descent near the ground.", minimum=0.1)
    landing_altitude: float = param(5.0, "m", "The landing rate applies below this altitude.", minimum=0)
    hover_actuation: float = param(
        0.7, "1", "Fraction of the full rotor speed that carries the weight.", minimum=0.1, maximum=1
    )
    reference_timeout: float = param(0.5, "s", "Without a velocity for this long, the vehicle hovers.", minimum=0.1)
    state_timeout: float = param(
        0.5, "s", "Without EstimatedState for this long, the vehicle descends level.", minimum=0.1
    )
    idle_timeout: float = param(
        60.0, "s", "The vehicle lands after this time without a maneuver; 0 for never.", minimum=0
    )
    error_timeout: float = param(10.0, "s", "Idle timeout after an error; 0 for never.", minimum=0)
    landing_fuel_level: float = param(10.0, "%", "The vehicle lands below this battery level.", minimum=0, maximum=100)

    def configure(self) -> None:
        def pid(gains: list[float]) -> PIDGains:
            return PIDGains(*gains, integral_limit=self.integral_limit, limit=2.0 * GRAVITY)

        gains = MultirotorGains(
            horizontal=pid(self.velocity_gains),
            vertical=pid(self.vertical_gains),
            position=self.position_gain,
            heading=self.heading_gain,
            heading_rate=math.radians(self.maximum_heading_rate),
            tilt=math.radians(self.maximum_tilt),
            acceleration=self.maximum_acceleration,
            speed=self.maximum_speed,
            climb=self.maximum_climb_rate,
            descent=self.maximum_descent_rate,
            landing_rate=self.landing_rate,
            landing_altitude=self.landing_altitude,
        )
        self._own_limits = OperatingLimits.from_options(partial(general_number, self.vehicle.profile), highest=math.inf)
        if not hasattr(self, "_law"):  # what it remembers stays if parameters change
            self._law, self._ceiling = MultirotorController(gains), self._own_limits.highest
        self._law.set_gains(gains)

    def start(self) -> None:
        self._loops = EnabledLoops(Loops.VELOCITY)
        self._touchdown, self._vertical = TouchdownDetector(), VerticalSpeedEstimator()
        self._advanced, self._tilt = self.now, 1.0
        self._phase, self._begun = FlightPhase.GROUND, False
        self._state: imc.EstimatedState | None = None
        self._stated = self._resumed = self._referred = -math.inf
        self._reference: Vector = (0.0, 0.0, 0.0)
        self._heading: float | None = None
        self._landing = ""
        self._blinded, self._stays_blind, self._highest = -math.inf, False, 0.0
        self._mode: int = Mode.BOOT
        self._erred = False
        self._fuel = math.inf
        self._idle = self.now
        self._rest()
        self._publish_status()

    @consume
    def on_control_loops(self, loops: imc.ControlLoops) -> None:
        if self._loops.receive(loops):
            self._heading, self._referred = None, self.now if self._loops.mask else -math.inf
            if self._loops.mask:
                self._landing, self._erred = "", False

    @consume
    def set_desired_velocity(self, velocity: imc.DesiredVelocity) -> None:
        """Set the desired velocity: ahead, to starboard and down, in a level frame."""
        if not self._loops.mask or self._state is None:
            return
        if not math.isfinite(velocity.u + velocity.v + velocity.w):
            self.log.warning("desired velocity is not a number")
            return
        c, s = math.cos(self._state.psi), math.sin(self._state.psi)
        self._reference = velocity.u * c - velocity.v * s, velocity.u * s + velocity.v * c, velocity.w
        self._referred = self.now

    @consume
    def set_desired_heading(self, heading: imc.DesiredHeading) -> None:
        if self._loops.mask and math.isfinite(heading.value):
            self._heading = heading.value

    @consume
    def on_vehicle_state(self, vehicle: imc.VehicleState) -> None:
        self._mode = vehicle.op_mode
        self._erred = self._erred or vehicle.op_mode == Mode.ERROR

    @consume
    def on_operational_limits(self, limits: imc.OperationalLimits) -> None:
        """Set the highest altitude. It is sent only once, so it survives new parameters and a restart."""
        if limits.max_altitude >= 0.0:
            self._ceiling = self._own_limits.tightened(limits).highest

    @consume
    def record_fuel_level(self, fuel: imc.FuelLevel) -> None:
        self._fuel = fuel.value

    @consume
    def on_acceleration(self, force: imc.Acceleration) -> None:
        if self._is_from(force, self.ahrs):
            self._vertical.receive_force(self.now, force.x, force.y, force.z)

    @consume
    def on_pressure(self, pressure: imc.Pressure) -> None:
        if self._is_from(pressure, self.barometer):
            self._vertical.receive_pressure(self.now, pressure.value)

    @consume
    def on_gps_fix(self, fix: imc.GpsFix) -> None:
        if fix.type != imc.GpsFix.Type.MANUAL_INPUT and fix.validity & imc.GpsFix.Validity.VALID_POS:
            self._vertical.receive_gps_height(fix.height)

    @consume(others=True)
    def abort(self, abort: imc.Abort) -> None:
        if self.is_addressed_or_broadcast(abort):
            self._loops.mask = 0
            self._land("aborted")

    @consume
    def control(self, state: imc.EstimatedState) -> None:
        if not math.isfinite(state.x + state.y + state.z + state.vx + state.vy + state.vz + state.psi):
            return
        silent, dt = self.age(self._stated), self.now - self._stated
        self._stated, self._state = self.now, state
        if self.recent_stall > UNKNOWN_MOTION:
            self._vertical.resume()
        if silent > self.state_timeout:
            self._resumed = self.now
        self._advance()
        contradicted = self._vertical.contradicts(self.now, min(dt, LONGEST_STEP), state.alt, state.vz)
        if contradicted and self._phase is not FlightPhase.GROUND:
            self._resumed = self.now
            self._descend(state, "EstimatedState contradicts barometer and accelerometer")
        if self._phase is FlightPhase.BLIND and (self._stays_blind or self.now - self._resumed < RECOVERY):
            self._highest = max(self._highest, state.alt)
            return  # estimates that come and go would make it climb and fall
        if not self._begun and state.alt > ALOFT:
            self.log.warning("started in the air")
            self._enter(FlightPhase.HOVER, state)
        self._begun = True
        if self._phase is FlightPhase.GROUND:
            if self._follows and self._reference[2] < -RISES and self._fuel > self.landing_fuel_level:
                self._landing = ""
                self._enter(FlightPhase.FOLLOW, state)
                self._fly(state, 0.0)
        else:
            self._choose(state)
            self._fly(state, dt if 0.0 < dt <= LONGEST_STEP else 0.0)

    @periodic(1.0 / BLIND_STEP)
    def descend_without_state(self, periods: int) -> None:
        """Descend level if EstimatedState is missing."""
        missing = self.age(self._stated) > self.state_timeout
        if (
            self._phase is FlightPhase.GROUND
            or self._state is None
            or not (missing or self._phase is FlightPhase.BLIND)
        ):
            return
        self._descend(self._state, "EstimatedState is missing")
        self._advance()
        falling = self._vertical.speed if self._vertical.knows_speed(self.now) else None
        longest = 2.0  # times that of the descent
        if falling is not None:
            self._highest, longest = max(self._highest, self._vertical.height), 6.0  # a touchdown is detected
        if self.now - self._entered > BLIND_MARGIN + longest * self._highest / BLIND_DESCENT:
            self._enter(FlightPhase.GROUND, self._state)
            return
        command = self._law.descend_blind(periods * BLIND_STEP, falling)
        self._command(command)
        if falling is not None and self._stands(BLIND_DESCENT, falling, command.thrust):
            self._enter(FlightPhase.GROUND, self._state)

    def _descend(self, state: imc.EstimatedState, reason: str) -> None:
        """Begin to descend without a state."""
        if self._phase is not FlightPhase.BLIND:
            self.log.error(f"{reason}: descending level")
            self._enter(FlightPhase.BLIND, state)
            self.set_entity_state(State.ERROR, f"{reason}: descending level")

    @periodic(1.0)
    def publish_status(self) -> None:
        self._publish_status()

    def _is_from(self, message: imc.Message, label: str) -> bool:
        return not label or self.vehicle.entities.label(message.src, message.src_ent) == label

    def _advance(self) -> None:
        """Advance height and vertical speed by accelerometer and barometer."""
        elapsed, self._advanced = self.now - self._advanced, self.now
        if self._phase is FlightPhase.GROUND:
            self._vertical.rest(self._state.alt if self._state is not None else 0.0)
        else:
            dt = min(elapsed, LONGEST_STEP)
            self._vertical.advance(self.now, dt, self._expected_force, self._tilt)
            self._law.update_load(dt, self._vertical.measured_force(self.now, self._expected_force))

    @property
    def _expected_force(self) -> float:
        """Specific force (m/s²) along the mast by the commanded thrust."""
        return self._thrust * GRAVITY / self._law.weight

    def _stands(self, descent: float, vz: float, thrust: float) -> bool:
        return self._touchdown.update(self.now, descent, vz, thrust / self._law.weight)

    @property
    def _follows(self) -> bool:
        return bool(self._loops.mask) and self.age(self._referred) <= self.reference_timeout

    def _choose(self, state: imc.EstimatedState) -> None:
        """Choose the phase in the air."""
        if self._fuel < self.landing_fuel_level:
            self._land("the battery is low")
        elif self._phase is not FlightPhase.HOVER or self._loops.mask or self._mode not in UNCOMMANDED:
            self._idle = self.now
        elif self._erred:
            if 0.0 < self.error_timeout < self.age(self._idle):
                self._land("the vehicle is in error" if self._mode == Mode.ERROR else "no maneuver after an error")
        elif 0.0 < self.idle_timeout < self.age(self._idle):
            self._land("no maneuver")
        phase = FlightPhase.LAND if self._landing else FlightPhase.FOLLOW if self._follows else FlightPhase.HOVER
        if phase is not self._phase:
            self._enter(phase, state)
        if phase is FlightPhase.HOVER and self._loops.mask:
            self.set_entity_state(State.ERROR, "timed out while waiting for velocity")
        elif self._phase is not FlightPhase.BLIND:
            self.set_entity_state(State.NORMAL, self._landing or phase.name.lower())

    def _land(self, reason: str) -> None:
        if not self._landing and self._phase is not FlightPhase.GROUND:
            self.log.warning(f"landing: {reason}")
            self._landing = f"landing: {reason}"

    def _enter(self, phase: FlightPhase, state: imc.EstimatedState) -> None:
        if FlightPhase.GROUND in (phase, self._phase):
            self._rest()
        self._hold = self._law.stopping_point(state)
        self._kept = state.psi
        self._phase, self._entered = phase, self.now
        if phase is FlightPhase.GROUND:
            self._landing, self._blinded = "", -math.inf
            self.publish(imc.SetThrusterActuation(id=0, value=0.0))
            self.set_entity_state(State.NORMAL, "on the ground")
        elif phase is FlightPhase.BLIND:
            self._law.falling, self._highest = state.vz, max(0.0, state.alt)
            self._stays_blind, self._blinded = self.now - self._blinded < BLIND_MEMORY, self.now
        self._publish_status()

    def _rest(self) -> None:
        self._law.reset()
        self._touchdown.reset()
        self._share, self._thrust = 0.0, GRAVITY
        self._entered = self.now
        self._hold: Vector = (0.0, 0.0, 0.0)
        self._kept = 0.0

    def _fly(self, state: imc.EstimatedState, dt: float) -> None:
        law, heading = self._law, self._kept
        if self._phase is FlightPhase.FOLLOW:
            wanted, heading = self._reference, self._kept if self._heading is None else self._heading
        elif self._phase is FlightPhase.LAND:
            wanted = law.landing_velocity(state, self._hold)
        else:
            wanted = law.position_hold_velocity(state, self._hold)
        measured = self._vertical.height if self._vertical.knows_height(self.now) else state.alt
        wanted = law.below_fence(wanted, self._ceiling - max(state.alt, measured))
        command = law.step(state, wanted, heading, dt, self._vertical.measured_force(self.now, self._expected_force))
        self._command(command)
        if self._stands(law.velocity[2], state.vz, command.thrust):
            self._enter(FlightPhase.GROUND, state)

    def _command(self, command: MultirotorCommand) -> None:
        self._share = rotor_actuation(command.thrust, self.hover_actuation)
        self._thrust, self._tilt = command.thrust, math.cos(command.roll) * math.cos(command.pitch)
        self.publish(imc.DesiredRoll(value=command.roll))
        self.publish(imc.DesiredPitch(value=command.pitch))
        self.publish(imc.DesiredHeadingRate(value=command.heading_rate))
        self.publish(imc.SetThrusterActuation(id=0, value=self._share))

    def _publish_status(self) -> None:
        rests, states = self._phase is FlightPhase.GROUND, imc.ArmingState.State
        self.publish(imc.ArmingState(state=states.DISARMED if rests else states.ARMED))
        self.publish(imc.AutopilotMode(autonomy=imc.AutopilotMode.Autonomy.AUTO, mode=self._phase.value))
        self.publish(imc.Throttle(value=100.0 * self._share))
        if rests:
            self.set_entity_state(State.NORMAL, "on the ground")
