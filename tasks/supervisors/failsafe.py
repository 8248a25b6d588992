"""The last resort: motors off, fins neutral, when a link of the chain that controls the vehicle is silent."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import imc
from autonomy.control import AscentMonitor, ImmersionDetector, MeasuredDepth, ascent_fins, blind_ascent_fins
from autonomy.limits import OperatingLimits
from autonomy.navigation import LARGEST_PITCH, LARGEST_ROLL, AttitudeRange
from runtime import ParameterError, State, Task, consume, param, periodic
from runtime.bus import Subscription
from runtime.vehicle import general_number
from support.rotations import Vector
from tasks.supervisors.required_messages import count_silence, parse_requirement

Loops = imc.CLoopsMask
Command = imc.SetThrusterActuation | imc.SetServoPosition
RESTING = imc.VehicleState.OpMode.SERVICE, imc.VehicleState.OpMode.ERROR
COMMANDS = (imc.SetThrusterActuation, imc.SetServoPosition)
CROSS = 4  # fins: below, port, starboard, above
DEPTH_TIMEOUT = ATTITUDE_TIMEOUT = 2.0  # s
FIX_TIMEOUT, DEEPEST_FIX = 2.5, 5.0  # s; m that a depth sensor may be wrong at the surface
STEADY = 8.0  # s of fixes in which the motor changes nothing: the depth is wrong by more
ASCENT_PERIOD = 0.1  # s
LARGEST_DEFLECTION = math.radians(25.0)
SINKS = 0.5  # m; a vehicle that has not risen by this much does not rise
VALID_POS = imc.GpsFix.Validity.VALID_POS.value


class Failsafe(Task):
    """Takes over when a link of the chain of control is silent or the vehicle is too deep, and obeys each Abort.

    It stops the maneuver, disables all control loops, publishes Abort for those who land, and answers each command for
    a thruster or servo with a neutral one: an AUV rises by its buoyancy, a boat drifts, a multirotor lands. This lasts
    until messages of all links arrive and the vehicle is at the surface; until then its entity is in ERROR. It needs no
    other task, and its Heartbeat shows that it works. Silence is counted in ticks, so a late kernel is not silence.

    With an `Ascent Thrust`, an uncontrolled vehicle under water that does not rise by itself comes up with
    motor and fins, and is kept at the surface; if that brings nothing, as with fins that are stuck, it
    goes astern, and ahead while its bow is up. The motor of a vehicle that may stand on a bench does not turn: no
    control loop has been enabled since the start, no depth was greater than 5 m (and at most 10 m beyond the limit) for
    1 s, and no altitude has decreased by 1 m as the depth has increased, or as the vertical speed shows.
    """

    execution_frequency: float = param(4.0, "Hz", "Rate of the checks.", minimum=1, maximum=100)
    required_messages: list[str] = param(
        ["EstimatedState", "VehicleState"],
        "",
        "Messages that must not stop once begun; `Name: LOOP LOOP` only while one of these control loops is enabled.",
        editable=False,
    )
    silence_timeout: float = param(
        3.0,
        "s",
        "Longest time without a required message, unless `[General] Longest Radio Gap` is longer.",
        minimum=0.5,
        maximum=60,
    )
    thrusters: list[int] = param([], "1", "Thrusters to stop; none if the vehicle must not stop them.", editable=False)
    servos: list[int] = param([], "1", "Servos to turn to the middle.", editable=False)
    depth_margin: float = param(
        0.5, "m", "How much deeper than the limit the depth sensor may measure.", minimum=0, maximum=5
    )
    drop_weight_channel: str = param(
        "", "", "Power channel that is switched on to drop the weight; empty if there is none.", editable=False
    )
    drop_weight_delay: float = param(
        60.0, "s", "The weight is dropped if the vehicle does not rise for this time.", minimum=1, maximum=600
    )

    ascent_thrust: float = param(
        0.0,
        "1",
        "Thrust that brings up an underwater vehicle with four fins whose buoyancy does not; 0 for none.",
        minimum=0,
        maximum=1,
    )
    ascent_pitch: float = param(20.0, "°", "Pitch of the powered ascent.", minimum=5, maximum=45, editable=False)
    ascent_delay: float = param(
        20.0,
        "s",
        "How long a vehicle without control loops may take to begin to rise by itself.",
        minimum=5,
        maximum=120,
        editable=False,
    )

    def configure(self) -> None:
        if self.ascent_thrust and not (self.thrusters and len(self.servos) == CROSS):
            raise ParameterError("Ascent Thrust", f"needs Thrusters, and Servos of {CROSS} fins")
        self._required = dict(map(parse_requirement, self.required_messages))
        number = partial(general_number, self.vehicle.profile)
        self._own = OperatingLimits.from_options(number, deepest=math.inf)
        self._gap = number("Longest Radio Gap", 0.0)
        self._surface = general_number(self.vehicle.profile, "Underwater Depth Threshold", 0.3)

    def subscribe_handlers(self) -> None:
        super().subscribe_handlers()
        for name in self._required:
            self._bus.subscribe(Subscription(imc.builtin()[name], self._note_message, self))

    def start(self) -> None:
        self._ascent = AscentMonitor(self._surface, self.ascent_delay)
        self._angles: Vector = (0.0, 0.0, 0.0)
        self._rates: Vector = (0.0, 0.0, 0.0)
        self._sensed = MeasuredDepth()
        self._felt = self._fixed = self._estimated = self._surfaced = -math.inf
        self._floats = False
        self._estimated_depth = -math.inf
        self._estimated_rising: float | None = None
        self._estimated_pitch = self._speed = self._altitude = math.nan
        self._ascending = self._reported = False
        # Kept over restarts of this task at sea, which receives no second order of what is under way.
        self._missed: dict[str, int] = getattr(self, "_missed", {})
        self._immersion = getattr(self, "_immersion", ImmersionDetector(self._own.deepest))
        self._loops, self._scope = getattr(self, "_loops", 0), getattr(self, "_scope", 0)
        self._is_loop_doubtful = self._loops != 0
        self._limit = self._own.deepest
        self._sensor = ""
        self._reason = ""
        self.set_entity_state(State.NORMAL, "active")

    def stop(self) -> None:
        if self._ascending:
            self._command(0.0, [0.0] * len(self.servos))

    @consume
    def on_control_loops(self, loops: imc.ControlLoops) -> None:
        self._immersion.is_at_sea |= loops.enable == loops.Enable.ENABLE and loops.mask != 0
        if loops.scope_ref >= self._scope:
            self._scope = loops.scope_ref
            self._loops = self._loops | loops.mask if loops.enable else self._loops & ~loops.mask

    @consume
    def on_vehicle_state(self, state: imc.VehicleState) -> None:
        """Clear the loops after a restart, an error for others: the order that disables them came in between."""
        if self._is_loop_doubtful and state.op_mode in RESTING:
            self._loops = 0
        self._is_loop_doubtful = False

    @consume
    def on_operational_limits(self, limits: imc.OperationalLimits) -> None:
        self._limit = (self._own.tightened(limits) if limits.max_depth >= 0.0 else self._own).deepest

    @consume
    def check_depth(self, depth: imc.Depth) -> None:
        """Compare the measured depth itself, and where it leads, with the limit: navigation may be wrong or silent."""
        if not math.isfinite(depth.value):
            return  # no measurement
        self._sensed.update(self.now, depth.value, self._limit + self.depth_margin)
        self._immersion.record_depth(self.now, depth.value)
        self._sensor = self.vehicle.entities.label(depth.src, depth.src_ent)

    @consume
    def record_estimated_depth(self, state: imc.EstimatedState) -> None:
        """Use the estimate where the sensor is silent, and its vertical speed where the sensor is wrong."""
        if math.isfinite(state.depth):
            self._estimated, self._estimated_depth = self.now, state.depth
            self._immersion.record_estimate(self.now, state.depth, state.alt, state.vz)
            self._estimated_rising = -state.vz if math.isfinite(state.vz) else None
            self._estimated_pitch, self._speed, self._altitude = state.theta, state.u, state.alt

    @consume
    def record_fix(self, fix: imc.GpsFix) -> None:
        """A receiver with a fix is above the water, unless the depth is far from it."""
        if fix.validity & VALID_POS and fix.type != imc.GpsFix.Type.MANUAL_INPUT:
            if self.age(self._fixed) > FIX_TIMEOUT:
                self._surfaced, self._floats, self._sensed.jumped = self.now, False, 0.0
            self._fixed = self.now

    @consume(others=True)
    def stop_vehicle_on_abort(self, abort: imc.Abort) -> None:
        """Obey, whether or not the supervisor does."""
        if self.is_addressed_or_broadcast(abort):
            self._neutralize()

    @periodic("execution_frequency")
    def handle_faults(self) -> None:
        faults = self._faults()
        if faults and not self._reason:
            self._take_over(faults)
        elif self._reason and not faults and not self._sensed.depth > self._surface:
            self._release()
        elif self._reason:
            self._neutralize(again=False)
            self._rise()
        self._watch_ascent()

    @periodic(1.0)
    def publish_heartbeat(self) -> None:
        self.publish(imc.Heartbeat())

    def _note_message(self, message: imc.Message) -> None:
        self._missed[type(message).__name__] = 0

    def _faults(self) -> str:
        """The faults; empty if there are none."""
        longest = max(self.silence_timeout, self._gap)
        most = longest * self.execution_frequency
        silent = count_silence(self._required, self._missed, self._loops, most)
        found = [f"no {name} for {longest:g} s" for name in silent]
        if self._sensed.is_too_deep:
            depth, sensor = self._sensed.depth, f" ({self._sensor})" if self._sensor else ""
            sinks = f"sinks at {-self._sensed.rising:.1f} m/s, too fast for"
            far = "is deeper than" if depth > self._limit else sinks
            found.append(f"depth {depth:.1f} m{sensor} {far} the limit of {self._limit:g} m")
        return ", ".join(found)

    def _take_over(self, reason: str) -> None:
        self._reason = reason
        for kind in COMMANDS:
            self._bus.subscribe(Subscription(kind, self._overrule, self))
        self._began, self._from, self._dropped = self.now, self._sensed.depth, False
        self.set_entity_state(State.ERROR, reason)
        self.log.error(f"{reason}: stopping the maneuver, all control loops and the motors")
        self.publish(imc.Abort(dst=self.system))
        self._neutralize()

    def _release(self) -> None:
        self._reason = ""
        self._unsubscribe(self._overrule)
        self.log.info("released")
        self.set_entity_state(State.NORMAL, "active")

    def _unsubscribe(self, handler: Callable[[Any], None]) -> None:
        for subscription in self._bus.subscriptions:
            if subscription.owner is self and subscription.handler == handler:
                self._bus.remove_subscription(subscription)

    def _neutralize(self, *, again: bool = True) -> None:
        """Stop the maneuver and the controllers, `again` even if no loop is known to be enabled; then the actuators."""
        if again or self._loops:
            self.publish(imc.StopManeuver())
            self._scope, self._loops = self._scope + 1, 0
            disable = imc.ControlLoops.Enable.DISABLE
            self.publish(imc.ControlLoops(enable=disable, mask=Loops.ALL, scope_ref=self._scope))
        if not self._ascending:
            self._command(0.0, [0.0] * len(self.servos))

    def _command(self, thrust: float, fins: Sequence[float]) -> None:
        for number in self.thrusters:
            self.publish(imc.SetThrusterActuation(id=number, value=thrust))
        for number, angle in zip(self.servos, fins, strict=True):
            self.publish(imc.SetServoPosition(id=number, value=angle))

    def _overrule(self, command: Command) -> None:
        """Stop what others command; in an ascent the next own command is near."""
        ours = self.thrusters if isinstance(command, imc.SetThrusterActuation) else self.servos
        if command.value and command.id in ours and not self._ascending:
            self.publish(type(command)(id=command.id, value=0.0))

    def _watch_ascent(self) -> None:
        """Begin and end the powered ascent of an uncontrolled vehicle."""
        ascent, now, before = self._ascent, self.now_without_stalls, self._ascent.failed
        if self._loops or not self._immersion.is_at_sea or not self.ascent_thrust:
            ascent.reset(now)
            ascent.heavy = self._reported = False
        elif self.age(max(self._sensed.time, self._estimated)) < DEPTH_TIMEOUT:
            depth = self._known_depth
            fixed = self.age(self._fixed) < FIX_TIMEOUT
            # Deep, with fixes, and the motor changes nothing: the depth drifts, and the vehicle is at the surface.
            self._floats |= self.age(self._surfaced) > STEADY and ascent.has_stalled(now, STEADY)
            surfaced = fixed and (depth < DEEPEST_FIX or ascent.failed or self._floats)
            rising = self._estimated_rising if self.age(self._estimated) < DEPTH_TIMEOUT else None
            ascent.update(now, depth, surfaced, self.age(self._fixed) > FIX_TIMEOUT, rising, self._sensed.jumped_up)
            if rising is not None:
                ascent.watch_bottom(now, self._altitude, self._speed, min(rising, self._sensed.rising))
            if rising is not None and abs(self._estimated_pitch) <= LARGEST_PITCH and not surfaced:
                ascent.stop_dive(now, self._estimated_pitch, rising)
        else:
            ascent.update_without_depth(now, self._sensed.depth, self.age(self._sensed.time))
        if ascent.failed and not before:
            self.log.error("motor and fins do not bring the vehicle up")
            self._drop_weight()
        if ascent.helping != self._ascending:
            self._switch_ascent(ascent.helping)
        if not self._reason:
            help_ = "the bow is far down: going astern" if ascent.stops_dive else "motor and fins bring the vehicle up"
            fault = "the vehicle does not rise by itself: motor and fins keep it up" if ascent.heavy else help_
            helps = ascent.heavy or ascent.helping
            self.set_entity_state(*((State.ERROR, fault) if helps else (State.NORMAL, "active")))

    @property
    def _known_depth(self) -> float:
        """The measured depth (m), else the estimated one."""
        measured = self.age(self._sensed.time) < DEPTH_TIMEOUT or math.isinf(self._estimated_depth)
        return self._sensed.depth if measured else self._estimated_depth

    def _switch_ascent(self, on: bool) -> None:
        self._ascending = on
        if on:
            depth = self._known_depth
            if self._ascent.stops_dive:
                down = math.degrees(-self._estimated_pitch)
                self.log.error(f"the bow is down by {down:.0f}° at {depth:.1f} m: going astern")
            elif not self._reported:
                self._reported, why = True, "does not rise" if depth > self._surface else "has no fix"
                self.log.error(f"the vehicle {why} at {depth:.1f} m: ascending with motor and fins")
            self._felt, self._possible = -math.inf, AttitudeRange(LARGEST_ROLL, LARGEST_PITCH)
            for kind in (imc.EulerAngles, imc.AngularVelocity):
                self._bus.subscribe(Subscription(kind, self._feel, self))
            self.after(0.0, self._ascend)
            return
        self._unsubscribe(self._feel)
        self._command(0.0, [0.0] * len(self.servos))

    def _feel(self, measured: imc.EulerAngles | imc.AngularVelocity) -> None:
        if isinstance(measured, imc.EulerAngles):
            angles = measured.phi, measured.theta, measured.psi
            if self._possible.accepts(self.now, *angles):
                self._angles, self._felt = angles, self.now
        else:
            self._rates = measured.x, measured.y, measured.z

    def _ascend(self) -> None:
        """Steer by the attitude, else by the depth, which is also what counts where they contradict each other."""
        if not self._ascending:
            return
        ascent, fins = self._ascent, [0.0] * CROSS
        measured = self.now - self._sensed.time < DEPTH_TIMEOUT
        felt = self.now - self._felt < ATTITUDE_TIMEOUT and all(map(math.isfinite, self._rates))
        if felt:
            now = self.now_without_stalls
            ascent.record_pitch(now, self._angles[1], self._rates[1], self._sensed.rising if measured else 0.0)
        if felt and not (ascent.pitch_faulty and measured):
            fins = ascent_fins(self._angles, self._rates, math.radians(self.ascent_pitch), LARGEST_DEFLECTION)
        elif measured:
            fins = blind_ascent_fins(self._sensed.rising, LARGEST_DEFLECTION)
        share = ascent.share
        self._command(self.ascent_thrust * share, [0.0] * CROSS if share < 0.0 else fins)
        self.after(ASCENT_PERIOD, self._ascend)

    def _rise(self) -> None:
        """Drop the weight if the vehicle does not rise."""
        if self._dropped or not self.drop_weight_channel or self.age(self._began) < self.drop_weight_delay:
            return
        if self._sensed.depth > self._from - SINKS:
            self._drop_weight()
        self._began, self._from = self.now, self._sensed.depth

    def _drop_weight(self) -> None:
        if self.drop_weight_channel:
            self._dropped = True
            self.log.error("the vehicle does not rise: dropping the weight")
            self.publish(imc.PowerChannelControl(name=self.drop_weight_channel, op=imc.PowerChannelControl.Op.TURN_ON))
