"""Controls heading, depth or altitude, pitch and roll of an underwater vehicle."""

import math
from collections.abc import Mapping

import imc
from autonomy.control import PID, BottomEstimator, EnabledLoops
from runtime import Entity, State, Task, consume, param, periodic
from runtime.vehicle import general_number
from support.numbers import clamp
from support.rotations import wrap

Loops = imc.CLoopsMask
Units = imc.ZUnits
PITCH, YAW, YAW_RATE = Loops.PITCH.value, Loops.YAW.value, Loops.YAW_RATE.value
VERTICAL = Loops.DEPTH.value | Loops.ALTITUDE.value | PITCH
HORIZONTAL = YAW | YAW_RATE
TORQUES = imc.DesiredControl.Flags.K | imc.DesiredControl.Flags.M | imc.DesiredControl.Flags.N
SURFACE = 0.3  # m
DEPTH_MARGIN = 1.0  # m between the maximum depth and the deepest reference
FLOOR_MARGIN = 0.5  # m between the maximum depth and where no reference leads deeper
LONGEST_STEP = 1.0  # s
SILENCE = 2.0  # s; without EstimatedState for longer, the vehicle is not controlled
STEEPEST = 0.1  # least cosine of pitch; Euler rates are singular at 90°
PARCELS = ("Heading", "Heading Rate", "Depth", "Altitude", "Pitch", "Roll")


class Attitude(Task):
    """Turns references of heading, heading rate, depth, altitude and pitch into the torques of DesiredControl.

    A cascade of PIDs: depth or altitude to pitch, heading to heading rate. Runs while one of the loops YAW, YAW_RATE,
    DEPTH, ALTITUDE, PITCH is enabled. DesiredZ is kept within the limits of depth and altitude; so is the vehicle,
    whatever is desired: near a limit it pitches down no more than holds it there. Without altitude, the bottom seen
    last counts.
    """

    heading_gains: list[float] = param([1.5, 0.0, 0.15], "1/s", "P, I, D.", name="Heading PID Gains", size=3)
    heading_integral_limit: float = param(-1.0, "°/s", "Limit of the integral; -1 for none.", minimum=-1)
    heading_rate_gains: list[float] = param([1.2, 0.0, 0.0], "N m s", "P, I, D.", name="Heading Rate PID Gains", size=3)
    heading_rate_integral_limit: float = param(-1.0, "°", "Limit of the integral; -1 for none.", minimum=-1)
    maximum_heading_rate: float = param(30.0, "°/s", "Largest heading rate that is commanded.", minimum=0)
    maximum_fin_rotation: float = param(25.0, "°", "Limit of the torques about roll and yaw, in N m/rad.", minimum=0)
    depth_gains: list[float] = param([0.5, 0.06, 0.7], "rad/m", "P, I, D.", name="Depth PID Gains", size=3)
    depth_integral_limit: float = param(10.0, "°", "Limit of the integral; -1 for none.", minimum=-1)
    altitude_enabled: bool = param(
        True, "", "Control altitude with its own gains, not with those of depth.", name="Altitude Control -- Enabled"
    )
    altitude_weights: list[float] = param(
        [],
        "1",
        "Weights of the filter of altitude, latest sample last.",
        name="Altitude Control -- Filter Weights",
        editable=False,
    )
    altitude_gains: list[float] = param([2.0, 0.01, 4.0], "rad/m", "P, I, D.", name="Altitude PID Gains", size=3)
    altitude_integral_limit: float = param(6.0, "°", "Limit of the integral; -1 for none.", minimum=-1)
    altitude_reference_margin: float = param(0.2, "m", "Margin above the minimum altitude.", minimum=0)
    altitude_timeout: float = param(60.0, "s", "How long altitude may be unknown when it is needed.", minimum=0)
    maximum_pitch_reference: float = param(15.0, "°", "Largest pitch that is commanded.", minimum=0, maximum=80)
    force_pitch_at_surface: bool = param(False, "", "At the surface, hold a pitch instead of the depth.")
    pitch_angle_at_surface: float = param(0.0, "°", "Pitch held at the surface.", minimum=-45, maximum=45)
    pitch_gains: list[float] = param([1.5, 0.09, 0.5], "N m/rad", "P, I, D.", name="Pitch PID Gains", size=3)
    pitch_integral_limit: float = param(1.0, "°", "Limit of the integral; -1 for none.", minimum=-1)
    maximum_pitch_actuation: float = param(25.0, "°", "Limit of the torque about pitch, in N m/rad.", minimum=0)
    roll_enabled: bool = param(True, "", "Keep the vehicle level.", name="Enable roll controller")
    roll_gains: list[float] = param([1.0, 0.02, 0.2], "N m/rad", "P, I, D.", name="Roll PID Gains", size=3)
    roll_integral_limit: float = param(1.0, "°", "Limit of the integral; -1 for none.", minimum=-1)
    reference_timeout: float = param(5.0, "s", "How long an enabled loop may be without a reference.", minimum=0)
    log_parcels: bool = param(False, "", "Publish the parts of each control law.", name="Log PID Parcels")

    def configure(self) -> None:
        def pid(gains: list[float], integral_limit: float, limit: float) -> PID:
            return PID(
                gains,
                limit=math.radians(limit),
                integral_limit=math.radians(integral_limit) if integral_limit >= 0.0 else math.inf,
            )

        rate, fin = self.maximum_heading_rate, self.maximum_fin_rotation
        steepest = self.maximum_pitch_reference
        self._heading = pid(self.heading_gains, self.heading_integral_limit, rate)
        self._heading_rate = pid(self.heading_rate_gains, self.heading_rate_integral_limit, fin)
        self._depth = pid(self.depth_gains, self.depth_integral_limit, steepest)
        self._altitude = pid(self.altitude_gains, self.altitude_integral_limit, steepest)
        self._pitch = pid(self.pitch_gains, self.pitch_integral_limit, self.maximum_pitch_actuation)
        self._roll = pid(self.roll_gains, self.roll_integral_limit, fin)
        self._pids = self._heading, self._heading_rate, self._depth, self._altitude, self._pitch, self._roll
        self._deepest, self._lowest = self._own_limits()
        names = PARCELS if self.log_parcels else ()
        self._parcels: Mapping[str, Entity] = {name: self.reserve(f"{name} Parcel") for name in names}

    def start(self) -> None:
        self._loops = EnabledLoops(VERTICAL | HORIZONTAL)
        self._controlled = -math.inf
        self._bottom = BottomEstimator(self.altitude_weights)
        self._begin_vertical()
        self._begin_horizontal()
        self.set_entity_state(State.NORMAL, "idle")

    @consume
    def enable(self, loops: imc.ControlLoops) -> None:
        before = self._loops.mask
        if not self._loops.receive(loops):
            return
        mask = self._loops.mask
        if mask & VERTICAL & ~before:
            self._begin_vertical()
        if mask & HORIZONTAL & ~before:
            self._begin_horizontal()
        if bool(mask) != bool(before):
            self.publish(imc.ControlLoops(enable=bool(mask), mask=Loops.TORQUE, scope_ref=self._loops.scope))
        self.set_entity_state(State.NORMAL, "active" if mask else "idle")

    @consume
    def limit(self, limits: imc.OperationalLimits) -> None:
        """Apply limits of depth and altitude if they are stricter than the vehicle's own."""
        self._deepest, self._lowest = self._own_limits()
        if limits.mask & imc.OpLimitsMask.MAX_DEPTH and math.isfinite(limits.max_depth):
            self._deepest = min(self._deepest, limits.max_depth)
        if limits.mask & imc.OpLimitsMask.MIN_ALT and math.isfinite(limits.min_altitude):
            self._lowest = max(self._lowest, limits.min_altitude)

    @consume
    def go_to_z(self, desired: imc.DesiredZ) -> None:
        """Set the desired depth or altitude; publish it again if a limit changes it."""
        if not self._loops.mask & VERTICAL or not self._is_number(desired.value, "depth or altitude"):
            return
        if desired.z_units == Units.DEPTH:
            limited = max(0.0, min(desired.value, self._deepest - DEPTH_MARGIN))
        elif desired.z_units == Units.ALTITUDE:
            limited = max(desired.value, self._lowest + self.altitude_reference_margin)
        else:
            self.log.warning(f"desired z in unit {desired.z_units} is neither a depth nor an altitude")
            return
        if limited != desired.value:
            desired = imc.DesiredZ(value=limited, z_units=desired.z_units)
            self.publish(desired)
        before, self._z = self._z, desired
        if before is None or before.z_units != desired.z_units:
            self._depth.reset()
            self._altitude.reset()
            self._kept = None

    @consume
    def go_to_pitch(self, desired: imc.DesiredPitch) -> None:
        if self._is_number(desired.value, "pitch"):
            self._pitch_reference = clamp(desired.value, math.radians(self.maximum_pitch_reference))

    @consume
    def go_to_heading(self, desired: imc.DesiredHeading) -> None:
        if self._is_number(desired.value, "heading"):
            self._heading_reference = desired.value

    @consume
    def go_to_heading_rate(self, desired: imc.DesiredHeadingRate) -> None:
        if self._is_number(desired.value, "heading rate"):
            self._rate_reference = clamp(desired.value, math.radians(self.maximum_heading_rate))

    @consume
    def control(self, state: imc.EstimatedState) -> None:
        before, self._controlled = self._controlled, state.timestamp
        elapsed = state.timestamp - before
        dt = elapsed if 0.0 < elapsed <= LONGEST_STEP else 0.0
        self._bottom.update(state.alt, state.depth, dt)
        if not self._loops.mask:
            return
        sr, cr = math.sin(state.phi), math.cos(state.phi)
        turning = (sr * state.q + cr * state.r) / max(STEEPEST, math.cos(state.theta))
        m, n = self._pitch_torque(state, dt, cr * state.q - sr * state.r), self._yaw_torque(state, dt, turning)
        k = 0.0
        if self.roll_enabled:
            k = self._roll.step(dt, -state.phi, -(state.p + math.sin(state.theta) * turning))
        self.publish(imc.DesiredControl(k=k, m=m, n=n or 0.0, flags=TORQUES))
        self._report(self._is_led, n is not None)

    @periodic(1.0)
    def supervise(self) -> None:
        """Report an error if EstimatedState falls silent; the allocator then centers the fins."""
        if self._loops.mask and self.now - max(self._controlled, self._began) > SILENCE:
            self.set_entity_state(State.ERROR, "EstimatedState is missing")

    def _pitch_torque(self, state: imc.EstimatedState, dt: float, pitching: float) -> float:
        """Without a vertical reference the vehicle is kept level: with neutral fins it would dive."""
        sp, cp, sr, cr = math.sin(state.theta), math.cos(state.theta), math.sin(state.phi), math.cos(state.phi)
        sinking = -sp * state.u + cp * (sr * state.v + cr * state.w)
        for_z = self._loops.mask & VERTICAL and not self._loops.mask & PITCH
        wanted = self._pitch_for_z(state, sinking, dt) if for_z else self._pitch_reference
        self._is_led = wanted is not None or not self._loops.mask & VERTICAL
        command = self._keep_off(wanted or 0.0, state.depth, sinking)
        if for_z and wanted is not None:
            self.publish(imc.DesiredPitch(value=command))
        change = (command - self._command) / dt if dt and self._command is not None else 0.0
        self._command = command
        return self._pitch.step(dt, command - state.theta, change - pitching)

    def _keep_off(self, command: float, depth: float, sinking: float) -> float:
        """The pitch (rad), raised as far as needed to stay above the bottom and the maximum depth.

        Both are held with the gains of depth, and the larger pitch is taken, so the change is smooth (override control;
        Åström & Hägglund, Advanced PID Control, 2006, ch. 13.3).
        """
        floor, rate, self._held = self._deepest - FLOOR_MARGIN, 0.0, ""
        lowest = self._bottom.depth - self._lowest
        near_bottom = lowest < floor
        if near_bottom:
            floor, rate = lowest, self._bottom.rate
        if floor == math.inf:
            return command
        proportional, _, derivative = self.depth_gains
        needed = proportional * (depth - max(0.0, floor)) + derivative * (sinking - rate)
        if needed <= command:
            return command
        self._held = "bottom" if near_bottom else "maximum depth"
        if near_bottom and not self._bottom.is_known:
            self._miss_altitude()
        return min(needed, math.radians(self.maximum_pitch_reference))

    def _pitch_for_z(self, state: imc.EstimatedState, sinking: float, dt: float) -> float | None:
        if self._z is None:
            return None
        if self._z.z_units == Units.ALTITUDE:
            bottom = self._bottom
            if bottom.is_known:
                wanted, rate, self._kept = bottom.depth - self._z.value, bottom.rate, None
            else:
                self._miss_altitude()
                self._kept = state.depth if self._kept is None else self._kept
                wanted, rate = self._kept, 0.0
            wanted = max(0.0, min(wanted, self._deepest - DEPTH_MARGIN))
            law = self._altitude if self.altitude_enabled else self._depth
            return -law.step(dt, wanted - state.depth, rate - sinking)
        error = self._z.value - state.depth
        if self.force_pitch_at_surface and self._z.value < SURFACE and abs(error) < SURFACE:
            self._depth.reset()
            return math.radians(self.pitch_angle_at_surface)
        return -self._depth.step(dt, error, -sinking)

    def _miss_altitude(self) -> None:
        self._missed = self.now if self._missed is None else self._missed

    def _yaw_torque(self, state: imc.EstimatedState, dt: float, turning: float) -> float | None:
        if self._loops.mask & YAW_RATE:
            command = self._rate_reference
        elif self._loops.mask & YAW:
            if self._heading_reference is None:
                return None
            command = self._heading.step(dt, wrap(self._heading_reference - state.psi), -turning)
            self.publish(imc.DesiredHeadingRate(value=command))
        else:
            return 0.0
        return None if command is None else self._heading_rate.step(dt, command - state.r)

    def _report(self, vertical: bool, horizontal: bool) -> None:
        """Publish the parts of the control laws; set an error if a reference or the altitude is missing too long."""
        for law, entity in zip(self._pids, self._parcels.values(), strict=False):
            self.publish(imc.ControlParcel(p=law.p, i=law.i, d=law.d, a=law.p + law.i + law.d), entity=entity)
        if self._bottom.is_known:
            self._missed = None
        missing = "" if vertical else "vertical"
        missing = missing if horizontal else "yaw"
        if missing and self.now - self._began > self.reference_timeout:
            self.set_entity_state(State.ERROR, f"timed out while waiting for {missing} control mode")
        elif self._missed is not None and self.now - self._missed > self.altitude_timeout:
            self.set_entity_state(State.ERROR, "altitude has been unknown for too long")
        elif not missing:
            self.set_entity_state(State.NORMAL, f"active, kept off the {self._held}" if self._held else "active")

    def _begin_vertical(self) -> None:
        self._z: imc.DesiredZ | None = None
        self._pitch_reference: float | None = None
        self._command: float | None = None
        self._kept: float | None = None
        self._missed: float | None = None
        self._held, self._is_led = "", False
        self._began = self.now
        for law in (self._depth, self._altitude, self._pitch):
            law.reset()

    def _begin_horizontal(self) -> None:
        self._heading_reference: float | None = None
        self._rate_reference: float | None = None
        self._began = self.now
        for law in (self._heading, self._heading_rate, self._roll):
            law.reset()

    def _own_limits(self) -> tuple[float, float]:
        """The maximum depth and the minimum altitude (m) in the profile. Raises ParameterError."""
        profile = self.vehicle.profile
        deepest = general_number(profile, "Absolute Maximum Depth", math.inf)
        return deepest, general_number(profile, "Absolute Minimum Altitude", 0.0)

    def _is_number(self, value: float, what: str) -> bool:
        if not math.isfinite(value):
            self.log.warning(f"desired {what} is not a number")
        return math.isfinite(value)
