"""Keeps a multirotor in the air: velocities become roll, pitch, heading rate and rotor speed."""

import math
from functools import partial

import imc
from autonomy.control import (
    GRAVITY,
    LOW_BATTERY,
    RECOVERY,
    BlindDescent,
    EnabledLoops,
    FlightPhase,
    LandingReasons,
    MultirotorCommand,
    MultirotorController,
    PowerDips,
    TouchdownDetector,
    rotor_actuation,
)
from autonomy.limits import OperatingLimits
from autonomy.navigation import VerticalSpeedEstimator
from runtime import State, consume, periodic
from runtime.vehicle import general_number
from support.planar_geometry import north_and_east
from support.rotations import Vector, down_axis
from tasks.control.uav.multirotor_parameters import MultirotorAutopilotTask

LONGEST_STEP, BLIND_STEP = 1.0, 0.1  # s
GAP = 2.0  # State Timeouts without a state that it flies over
UNKNOWN_MOTION = 0.5  # s in which the process stood still, after which the height starts anew
ALOFT = 2.0  # m; above this altitude at the start of the task, the vehicle is flying
LOW = 1.0  # m; a vehicle that has not been so high above the ground since its takeoff may still stand there
RISES = 0.05  # m/s; a faster climb must be commanded to leave the ground
LEVEL: Vector = (0.0, 0.0, 1.0)
REPEATED = "the power fails again and again"


class Autopilot(MultirotorAutopilotTask):
    """Follows DesiredVelocity and DesiredHeading while the loop VELOCITY is enabled; hovers in the air otherwise.

    The rotors rest on the ground until a climb is commanded. It lands where it is after an Abort, if a takeoff is
    stopped as it begins, if it hovers without a maneuver for `Idle Timeout` (after an error, `Error Timeout`), if the
    power fails repeatedly, and always below `Landing Fuel Level`. Without EstimatedState for two `State Timeout`, or if
    barometer and accelerometer contradict it, it descends level by these or by the thrust that carries it; the second
    time in two minutes, to the ground. Limits of altitude apply.
    """

    def configure(self) -> None:
        self._own_limits = OperatingLimits.from_options(partial(general_number, self.vehicle.profile), highest=math.inf)
        if not hasattr(self, "_law"):  # what it remembers stays if parameters change
            self._law, self._ceiling = MultirotorController(self.gains), self._own_limits.highest
        self._law.set_gains(self.gains)

    def start(self) -> None:
        self._loops, self._dips = EnabledLoops(imc.CLoopsMask.VELOCITY), getattr(self, "_dips", PowerDips())
        self._touchdown, self._vertical = TouchdownDetector(self._dips), VerticalSpeedEstimator()
        self._advanced, self._mast, self._floor = self.now, LEVEL, 0.0
        landed = getattr(self, "_begun", False) and self._phase is FlightPhase.GROUND
        self._phase, self._begun = FlightPhase.GROUND, landed  # one that has landed stays there, at any altitude
        self._state: imc.EstimatedState | None = None
        self._stated = self._resumed = self._referred = -math.inf
        self._starts, self._reasons = False, LandingReasons()
        self._reference: Vector = (0.0, 0.0, 0.0)
        self._heading: float | None = None
        self._landing, self._blind = getattr(self, "_landing", ""), getattr(self, "_blind", BlindDescent())
        self._rest()
        self.publish_status()

    def stop(self) -> None:
        if self._phase is not FlightPhase.GROUND:  # the last command stays until the airframe detects the silence
            self._command(self._law.level_command)

    @consume
    def on_control_loops(self, loops: imc.ControlLoops) -> None:
        if self._loops.receive(loops):
            self._heading, self._referred = None, self.now if self._loops.mask else -math.inf
            if self._loops.mask:
                self._landing, self._reasons.erred = "", False

    @consume
    def set_desired_velocity(self, velocity: imc.DesiredVelocity) -> None:
        """Set the desired velocity: ahead, to starboard and down, in a level frame."""
        if not self._loops.mask or self._state is None:
            return
        if not math.isfinite(velocity.u + velocity.v + velocity.w):
            self.log.warning("desired velocity is not a number")
            return
        self._reference = *north_and_east(velocity.u, velocity.v, self._state.psi), velocity.w
        self._referred = self.now

    @consume
    def set_desired_heading(self, heading: imc.DesiredHeading) -> None:
        if self._loops.mask and math.isfinite(heading.value):
            self._heading = heading.value

    @consume
    def on_vehicle_state(self, vehicle: imc.VehicleState) -> None:
        self._reasons.receive_mode(vehicle.op_mode)

    @consume
    def on_operational_limits(self, limits: imc.OperationalLimits) -> None:
        """Set the highest altitude. It is sent only once, so it survives new parameters and a restart."""
        if limits.max_altitude >= 0.0:
            self._ceiling = self._own_limits.tightened(limits).highest

    @consume
    def record_fuel_level(self, fuel: imc.FuelLevel) -> None:
        self._reasons.fuel = fuel.value

    @consume
    def on_acceleration(self, force: imc.Acceleration) -> None:
        if self.is_from(force, self.ahrs):
            self._vertical.receive_force(self.now, force.x, force.y, force.z)

    @consume
    def on_pressure(self, pressure: imc.Pressure) -> None:
        if self.is_from(pressure, self.barometer):
            self._vertical.receive_pressure(self.now, pressure.value)

    @consume
    def on_voltage(self, voltage: imc.Voltage) -> None:
        powered = not voltage.value <= 0.0
        if not self.is_from(voltage, self.batteries) or powered == self._dips.powered:
            return
        self._advance()
        self._dips.receive(self.now, powered=powered)
        if self._dips.has_repeated(self.now):
            self._land(REPEATED)
        if powered and (state := self._state) is not None and self._phase is not FlightPhase.GROUND:
            if self._vertical.fresh_force(self.now) is None:
                self._descend(state, "power and acceleration failed")
            if self._phase is FlightPhase.BLIND:
                self._descend_level(state, 0.0)  # each moment counts

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
        now, vertical, silent = self.now, self._vertical, self.age(self._stated)
        dt, self._stated, self._state = now - self._stated, now, state
        if self._phase is not FlightPhase.BLIND:
            self._dips.take_lost_time(now)  # the state has it
        if self.recent_stall > UNKNOWN_MOTION:
            vertical.resume()
        if silent > self.state_timeout:
            self._resumed = now
            if silent <= GAP * self.state_timeout:
                self._referred = min(self.now, self._referred + silent)  # without states nobody could lead it
        self._advance()
        apart = vertical.contradicts(now, min(dt, LONGEST_STEP), state.alt, state.vz)
        why = vertical.fault or ("EstimatedState contradicts barometer and accelerometer" if apart else "")
        if why and self._phase is not FlightPhase.GROUND:
            self._descend(state, why)
        arrives = (vertical.measured_height(now) or math.inf) < self.landing_altitude
        if self._phase is FlightPhase.BLIND and (arrives or not self._blind.trusts(now, self._resumed)):
            self._blind.note_altitude(state.alt)
            return  # estimates that come and go would make it climb and fall
        if not self._begun and state.alt > ALOFT:
            self.log.warning("started in the air")
            self._enter(FlightPhase.HOVER, state)
        self._begun = True
        if self._phase is not FlightPhase.GROUND:
            self._choose(state, min(dt, LONGEST_STEP))
            self._fly(state, dt if 0.0 < dt <= LONGEST_STEP else 0.0)
        elif self._follows and self._reference[2] < -RISES:
            self._take_off(state)

    @periodic(1.0 / BLIND_STEP)
    def descend_without_state(self, periods: int) -> None:
        """Descend level if EstimatedState is missing; in a short gap keep the height, or go on landing."""
        state, silent = self._state, self.age(self._stated)
        if state is None or self._phase is FlightPhase.GROUND:
            return
        if silent > self._dips.state_timeout(self.now, self.state_timeout) and not self._bridges(silent):
            self._descend(state, "EstimatedState is missing")
        if self._phase is FlightPhase.BLIND:
            self._advance()
            self._descend_level(state, periods * BLIND_STEP)
        elif silent > self.state_timeout:
            self._advance()
            self._command_level(periods * BLIND_STEP, min(max(0.0, self._law.velocity[2]), self._usual_descent))

    @property
    def _usual_descent(self) -> float:
        return self._law.blind_descent_rate(self._vertical.measured_height(self.now))

    def _bridges(self, silent: float) -> bool:
        """Whether flight continues without a state for `silent` s: its speed is measured, the last gap long ago."""
        measured = self._vertical.has_speed(self.now) and self._vertical.fresh_force(self.now) is not None
        settled = self._stated - self._resumed >= RECOVERY and not self._dips.has_repeated(self.now)
        return measured and settled and silent <= GAP * self.state_timeout and self._phase is not FlightPhase.BLIND

    def _command_level(self, step: float, descent: float) -> tuple[float | None, float]:
        """Command a level descent (m/s), `step` s after the last command; measured speed, and share of the weight."""
        vertical, lost = self._vertical, self._dips.take_lost_time(self.now)
        falling = vertical.speed if vertical.has_speed(self.now) else None
        above = vertical.highest(self.now) > self._ceiling
        command = self._law.descend_blind(step, falling, lost=lost, descent=descent, above_fence=above)
        self._command(command)
        return falling, command.thrust / self._law.weight

    def _descend_level(self, state: imc.EstimatedState, step: float) -> None:
        """Descend without a state, `step` s after the last command, until it is on the ground."""
        vertical, touchdown, now = self._vertical, self._touchdown, self.now
        descent = self._dips.descent(now, self._usual_descent)
        falling, share = self._command_level(step, descent)
        if falling is None:
            self._blind.note_fall(step, self._law.falling)
        else:
            self._blind.note_altitude(vertical.height)
        stands = touchdown.update(now, descent, falling, share, vertical.fresh_force(now, BLIND_STEP))
        lies = touchdown.lies(now, share, vertical.measured_height(now), vertical.fresh_force(now))
        landing = {"landing_altitude": self.landing_altitude, "landing_rate": self.landing_rate}
        late = self._dips.is_settled(now) and self._blind.has_landed(now, measured=falling is not None, **landing)
        if stands or lies or late:
            self._enter(FlightPhase.GROUND, state)

    def _descend(self, state: imc.EstimatedState, reason: str) -> None:
        """Begin to descend without a state, or continue: it has to be right for some time before it is used again."""
        self._resumed = self.now
        if self._phase is not FlightPhase.BLIND:
            self.log.error(f"{reason}: descending level")
            self._enter(FlightPhase.BLIND, state)
            self.set_entity_state(State.ERROR, f"{reason}: descending level")

    def _advance(self) -> None:
        """Advance height and vertical speed by accelerometer and barometer."""
        now = self.now
        elapsed, self._advanced = now - self._advanced, now
        if self._phase is FlightPhase.GROUND:
            self._vertical.rest(self._state.alt if self._state is not None else 0.0)
        else:
            dt, expected = min(elapsed, LONGEST_STEP), self._expected_force
            self._vertical.advance(now, dt, expected, self._mast)
            if self._dips.powered:
                self._law.update_load(dt, self._vertical.load_force(now, expected))

    @property
    def _expected_force(self) -> float:
        """Specific force (m/s²) along the mast by the commanded thrust."""
        return 0.0 if not self._dips.powered else self._thrust * GRAVITY / self._law.weight

    def _take_off(self, state: imc.EstimatedState) -> None:
        """Take off, or report the reason why not, so that the plan ends with it."""
        low = self._reasons.fuel <= self.landing_fuel_level
        if low or self._dips.has_repeated(self.now):
            self.set_entity_state(State.ERROR, f"does not take off: {LOW_BATTERY if low else REPEATED}")
            return
        self._landing, self._starts, self._floor = "", True, state.alt
        self._enter(FlightPhase.FOLLOW, state)
        self._fly(state, 0.0)

    @property
    def _follows(self) -> bool:
        return bool(self._loops.mask) and self.age(self._referred) <= self.reference_timeout

    def _choose(self, state: imc.EstimatedState, dt: float) -> None:
        """Choose the phase in the air."""
        hovers = self._phase is FlightPhase.HOVER and not self._loops.mask
        timeouts = self.idle_timeout, self.error_timeout
        self._starts = self._starts and state.alt < self._floor + LOW
        low = self._starts and not self._follows
        reason = self._reasons.find(dt, self.landing_fuel_level, timeouts, hovers=hovers)
        if low or reason:
            self._land("stopped at the beginning of a takeoff" if low else reason)
        phase = FlightPhase.LAND if self._landing else FlightPhase.FOLLOW if self._follows else FlightPhase.HOVER
        if phase is not self._phase:
            self._enter(phase, state)
        if phase is FlightPhase.HOVER and self._loops.mask:
            self.set_entity_state(State.ERROR, "timed out while waiting for velocity")
        elif self._phase is not FlightPhase.BLIND:
            # A plan ends with this reason, not as it makes no progress.
            how = State.ERROR if self._landing and self._loops.mask else State.NORMAL
            self.set_entity_state(how, self._landing or phase.name.lower())

    def _land(self, reason: str) -> None:
        if not self._landing and self._phase is not FlightPhase.GROUND:
            self.log.warning(f"landing: {reason}")
            self._landing = f"landing: {reason}"

    def _enter(self, phase: FlightPhase, state: imc.EstimatedState) -> None:
        if FlightPhase.GROUND in (phase, self._phase):
            self._rest()
        before, self._phase = self._phase, phase
        self._hold, self._kept = self._law.stopping_point(state), state.psi
        if phase is FlightPhase.GROUND:
            if self._landing or before is FlightPhase.BLIND:
                self._loops.mask = 0  # a climb that was commanded meanwhile would lift it off again
            self._landing = ""
            self._blind.forget()
            self.publish(imc.SetThrusterActuation(id=0, value=0.0))
            self.set_entity_state(State.NORMAL, "on the ground")
        elif phase is FlightPhase.BLIND:
            self._law.falling = state.vz
            self._touchdown.reset()
            self._blind.begin(self.now, state.alt)
        self.publish_status()

    def _rest(self) -> None:
        self._law.reset()
        self._touchdown.reset()
        self._share, self._thrust = 0.0, GRAVITY
        self._hold: Vector = (0.0, 0.0, 0.0)
        self._kept = 0.0

    def _fly(self, state: imc.EstimatedState, dt: float) -> None:
        law, heading, vertical, now = self._law, self._kept, self._vertical, self.now
        if self._phase is FlightPhase.FOLLOW:
            wanted, heading = self._reference, self._kept if self._heading is None else self._heading
        elif self._phase is FlightPhase.LAND:
            wanted = law.landing_velocity(state, self._hold, self._dips.urgent_descent(now))
        else:
            wanted = law.position_hold_velocity(state, self._hold)
        height = max(state.alt, vertical.measured_height(now) or 0.0)
        wanted = law.below_fence(wanted, self._ceiling - height)
        force = vertical.measured_force(now, self._expected_force)
        command = law.step(state, wanted, heading, dt, force, at_once=self._dips.has_repeated(now))
        self._command(command)
        felt = vertical.fresh_force(now, BLIND_STEP)
        if self._touchdown.update(now, law.velocity[2], state.vz, command.thrust / law.weight, felt):
            self._enter(FlightPhase.GROUND, state)

    def _command(self, command: MultirotorCommand) -> None:
        self._share = rotor_actuation(command.thrust, self.hover_actuation)
        self._thrust, self._mast = command.thrust, down_axis(command.roll, command.pitch)
        self.publish(imc.DesiredRoll(value=command.roll))
        self.publish(imc.DesiredPitch(value=command.pitch))
        self.publish(imc.DesiredHeadingRate(value=command.heading_rate))
        self.publish(imc.SetThrusterActuation(id=0, value=self._share))

    @periodic(1.0)
    def publish_status(self) -> None:
        rests, states = self._phase is FlightPhase.GROUND, imc.ArmingState.State
        self.publish(imc.ArmingState(state=states.DISARMED if rests else states.ARMED))
        self.publish(imc.AutopilotMode(autonomy=imc.AutopilotMode.Autonomy.AUTO, mode=self._phase.value))
        self.publish(imc.Throttle(value=100.0 * self._share))
        if rests and not (self._follows and self._reference[2] < -RISES):
            self.set_entity_state(State.NORMAL, "on the ground")
