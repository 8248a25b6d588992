"""Controls heading, depth or altitude, pitch and roll of an underwater vehicle."""

import math
from collections.abc import Mapping
from functools import partial

import imc
from autonomy.control import (
    AttitudeController,
    AttitudeGains,
    AttitudeReference,
    BottomEstimator,
    DepthController,
    DepthGains,
    EnabledLoops,
    PIDGains,
)
from autonomy.limits import OperatingLimits
from runtime import Entity, State, Task, consume, param, periodic
from runtime.vehicle import general_number
from support.number_parsing import clamp_magnitude

Loops = imc.CLoopsMask
Units = imc.ZUnits
PITCH, YAW, YAW_RATE = Loops.PITCH.value, Loops.YAW.value, Loops.YAW_RATE.value
VERTICAL = Loops.DEPTH.value | Loops.ALTITUDE.value | PITCH
HORIZONTAL = YAW | YAW_RATE
TORQUES = imc.DesiredControl.Flags.K | imc.DesiredControl.Flags.M | imc.DesiredControl.Flags.N
LONGEST_STEP = 1.0  # s
UNMEASURED = 0.5  # s for which a pitch that is measured may stay the same
SILENCE = 2.0  # s; without EstimatedState for longer, the vehicle is not controlled
PARCELS = ("Heading", "Heading Rate", "Depth", "Altitude", "Pitch", "Roll")


class Attitude(Task):
    """Turns references of heading, heading rate, depth, altitude and pitch into the torques of DesiredControl.

    A cascade of PIDs: depth or altitude to pitch, heading to heading rate. Runs while one of the loops YAW, YAW_RATE,
    DEPTH, ALTITUDE, PITCH is enabled. DesiredZ is kept within the limits of depth and altitude; so is the vehicle,
    for any reference: near a limit it pitches down no more than holds it there. Without altitude, the bottom seen
    last counts. A pitch that stays far from its reference, as with fins that are jammed, is an error.
    """

    heading_gains: list[float] = param([1.5, 0.0, 0.15], "1/s", "P, I, D.", name="Heading PID Gains", size=3)
    heading_integral_limit: float = param(-1.0, "°/s", "Limit of the integral; below 0 for none.")
    heading_rate_gains: list[float] = param([1.2, 0.0, 0.0], "N m s", "P, I, D.", name="Heading Rate PID Gains", size=3)
    heading_rate_integral_limit: float = param(-1.0, "°", "Limit of the integral; below 0 for none.")
    maximum_heading_rate: float = param(30.0, "°/s", "Largest heading rate that is commanded.", minimum=0)
    maximum_fin_rotation: float = param(25.0, "°", "Limit of the torques about roll and yaw, in N m/rad.", minimum=0)
    depth_gains: list[float] = param([0.5, 0.06, 0.7], "rad/m", "P, I, D.", name="Depth PID Gains", size=3)
    depth_integral_limit: float = param(10.0, "°", "Limit of the integral; below 0 for none.")
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
    altitude_integral_limit: float = param(6.0, "°", "Limit of the integral; below 0 for none.")
    altitude_reference_margin: float = param(0.2, "m", "Margin above the minimum altitude.", minimum=0)
    altitude_timeout: float = param(60.0, "s", "How long altitude may be unknown when it is needed.", minimum=0)
    maximum_pitch_reference: float = param(15.0, "°", "Largest pitch that is commanded.", minimum=0, maximum=80)
    force_pitch_at_surface: bool = param(False, "", "At the surface, hold a pitch instead of the depth.")
    pitch_angle_at_surface: float = param(0.0, "°", "Pitch held at the surface.", minimum=-90, maximum=90)
    pitch_gains: list[float] = param([1.5, 0.09, 0.5], "N m/rad", "P, I, D.", name="Pitch PID Gains", size=3)
    pitch_integral_limit: float = param(1.0, "°", "Limit of the integral; below 0 for none.")
    maximum_pitch_error: float = param(
        35.0, "°", "Pitch may differ from its reference by more only for Pitch Error Timeout; 0 for ever.", minimum=0
    )
    pitch_error_timeout: float = param(2.0, "s", "Longest time with a larger error of pitch.", minimum=0)
    maximum_pitch_actuation: float = param(25.0, "°", "Limit of the torque about pitch, in N m/rad.", minimum=0)
    roll_enabled: bool = param(True, "", "Keep the vehicle level.", name="Enable roll controller")
    roll_gains: list[float] = param([1.0, 0.02, 0.2], "N m/rad", "P, I, D.", name="Roll PID Gains", size=3)
    roll_integral_limit: float = param(1.0, "°", "Limit of the integral; below 0 for none.")
    reference_timeout: float = param(5.0, "s", "How long an enabled loop may be without a reference.", minimum=0)
    log_parcels: bool = param(False, "", "Publish the parts of each control law.", name="Log PID Parcels")

    def configure(self) -> None:
        def pid(gains: list[float], integral_limit: float, limit: float) -> PIDGains:
            bound = math.radians(integral_limit) if integral_limit >= 0.0 else math.inf
            return PIDGains(*gains, integral_limit=bound, limit=math.radians(limit))

        rate, fin = self.maximum_heading_rate, self.maximum_fin_rotation
        steepest = self.maximum_pitch_reference
        attitude = AttitudeGains(
            pid(self.heading_gains, self.heading_integral_limit, rate),
            pid(self.heading_rate_gains, self.heading_rate_integral_limit, fin),
            pid(self.pitch_gains, self.pitch_integral_limit, self.maximum_pitch_actuation),
            pid(self.roll_gains, self.roll_integral_limit, fin),
            self.roll_enabled,
        )
        altitude = pid(self.altitude_gains, self.altitude_integral_limit, steepest)
        depth = DepthGains(
            pid(self.depth_gains, self.depth_integral_limit, steepest),
            altitude if self.altitude_enabled else None,
            self.altitude_reference_margin,
            math.radians(self.pitch_angle_at_surface) if self.force_pitch_at_surface else None,
        )
        if not hasattr(self, "_depth"):  # what they remember stays if parameters change
            self._depth, self._attitude = DepthController(depth), AttitudeController(attitude)
        self._depth.set_gains(depth)
        self._attitude.set_gains(attitude)
        self._depth.limits = self._own_limits()
        names = PARCELS if self.log_parcels else ()
        self._parcels: Mapping[str, Entity] = {name: self.reserve_entity(f"{name} Parcel") for name in names}

    def start(self) -> None:
        self._loops = EnabledLoops(VERTICAL | HORIZONTAL)
        self._controlled = -math.inf
        self._depth.bottom = BottomEstimator(self.altitude_weights)
        self._begin_vertical()
        self._begin_horizontal()
        self.set_entity_state(State.NORMAL, "idle")

    @consume
    def on_control_loops(self, loops: imc.ControlLoops) -> None:
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
    def on_operational_limits(self, limits: imc.OperationalLimits) -> None:
        """Apply limits of depth and altitude if they are stricter than the vehicle's own."""
        self._depth.limits = self._own_limits().tightened(limits)

    @consume
    def set_desired_z(self, desired: imc.DesiredZ) -> None:
        """Set the desired depth or altitude; publish it again if a limit changes it."""
        if not self._loops.mask & VERTICAL or not self._is_number(desired.value, "depth or altitude"):
            return
        if desired.z_units not in (Units.DEPTH, Units.ALTITUDE):
            self.log.warning(f"desired z in unit {desired.z_units} is neither a depth nor an altitude")
            return
        limited = self._depth.clamp_to_limits(desired)
        if limited != desired.value:
            desired = imc.DesiredZ(value=limited, z_units=desired.z_units)
            self.publish(desired)
        before, self._z = self._z, desired
        if before is None or before.z_units != desired.z_units:
            self._depth.reset()

    @consume
    def set_desired_pitch(self, desired: imc.DesiredPitch) -> None:
        if self._is_number(desired.value, "pitch"):
            self._pitch_reference = clamp_magnitude(desired.value, math.radians(self.maximum_pitch_reference))

    @consume
    def set_desired_heading(self, desired: imc.DesiredHeading) -> None:
        if self._is_number(desired.value, "heading"):
            self._heading_reference = desired.value

    @consume
    def set_desired_heading_rate(self, desired: imc.DesiredHeadingRate) -> None:
        if self._is_number(desired.value, "heading rate"):
            self._rate_reference = clamp_magnitude(desired.value, math.radians(self.maximum_heading_rate))

    @consume
    def control(self, state: imc.EstimatedState) -> None:
        before, self._controlled = self._controlled, state.timestamp
        elapsed = state.timestamp - before
        dt = elapsed if 0.0 < elapsed <= LONGEST_STEP else 0.0
        self._depth.bottom.update(state.alt, state.depth, dt)
        mask = self._loops.mask
        if not mask:
            return
        for_z = mask & VERTICAL and not mask & PITCH
        desired = self._z if for_z else self._pitch_reference
        pitch = self._depth.step(state, desired, dt)
        if for_z and desired is not None:
            self.publish(imc.DesiredPitch(value=pitch))
        heading = self._heading_reference if mask & YAW and not mask & YAW_RATE else None
        rate = self._rate_reference if mask & YAW_RATE else None
        if mask & VERTICAL:
            self._compare_pitch(pitch, state.theta)
        k, m, n = self._attitude.step(state, AttitudeReference(pitch, heading, rate), dt)
        if heading is not None:
            self.publish(imc.DesiredHeadingRate(value=self._attitude.rate))
        self.publish(imc.DesiredControl(k=k, m=m, n=n or 0.0, flags=TORQUES))
        turns = heading is not None or rate is not None
        self._report(desired is not None or not mask & VERTICAL, turns or not mask & HORIZONTAL)

    @periodic(1.0)
    def report_missing_state(self) -> None:
        """Report an error if EstimatedState falls silent; the allocator then centers the fins."""
        if self._loops.mask and self.age(max(self._controlled, self._began)) > SILENCE:
            self.set_entity_state(State.ERROR, "EstimatedState is missing")

    def _report(self, vertical: bool, horizontal: bool) -> None:
        """Publish the parts of the control laws; set an error if a reference or the altitude is missing too long."""
        depth, attitude = self._depth, self._attitude
        laws = attitude.heading, attitude.heading_rate, depth.depth, depth.altitude, attitude.pitch, attitude.roll
        for law, entity in zip(laws, self._parcels.values(), strict=False):
            self.publish(imc.ControlParcel(p=law.p, i=law.i, d=law.d, a=law.p + law.i + law.d), entity=entity)
        if depth.bottom.is_known:
            self._missed = None
        elif depth.lacks_altitude and self._missed is None:
            self._missed = self.now
        missing = "" if vertical else "vertical"
        missing = missing if horizontal else "yaw"
        if self.age(self._astray_since) > self.pitch_error_timeout:
            self.set_entity_state(State.ERROR, "pitch does not follow its reference")
        elif missing and self.age(self._began) > self.reference_timeout:
            self.set_entity_state(State.ERROR, f"timed out while waiting for {missing} control mode")
        elif self._missed is not None and self.age(self._missed) > self.altitude_timeout:
            self.set_entity_state(State.ERROR, "altitude has been unknown for too long")
        elif not missing:
            self.set_entity_state(State.NORMAL, f"active, kept off the {depth.held}" if depth.held else "active")

    def _compare_pitch(self, reference: float, pitch: float) -> None:
        """Note since when pitch (rad) is far from its reference.

        One that does not change at all is not measured, and a process that stands still controls it badly.
        """
        if pitch != self._pitch:
            self._pitch, self._measured = pitch, self.now
        astray = abs(reference - pitch) > math.radians(self.maximum_pitch_error or 180.0)
        measured = self.age(self._measured) < UNMEASURED
        counts = astray and measured and not self.recent_stall
        self._astray_since = min(self._astray_since, self.now) if counts else math.inf

    def _begin_vertical(self) -> None:
        self._z: imc.DesiredZ | None = None
        self._pitch_reference: float | None = None
        self._missed: float | None = None
        self._pitch, self._measured, self._astray_since = math.nan, self.now, math.inf
        self._began = self.now
        self._depth.reset()
        self._attitude.reset_pitch()

    def _begin_horizontal(self) -> None:
        self._heading_reference: float | None = None
        self._rate_reference: float | None = None
        self._began = self.now
        self._attitude.reset_heading()

    def _own_limits(self) -> OperatingLimits:
        """The maximum depth and the minimum altitude in the profile. Raises ParameterError."""
        number = partial(general_number, self.vehicle.profile)
        return OperatingLimits.from_options(number, deepest=math.inf, lowest=0.0)

    def _is_number(self, value: float, what: str) -> bool:
        if not math.isfinite(value):
            self.log.warning(f"desired {what} is not a number")
        return math.isfinite(value)
