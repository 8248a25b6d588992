"""Leads a multirotor along lines and circles in space."""

import math
from dataclasses import replace
from functools import partial

import imc
from autonomy.guidance import (
    NOWHERE,
    AlongTrack,
    Circle,
    CrossTrack,
    DivergenceMonitor,
    Line,
    MotionLimits,
    MultirotorGuidance,
    MultirotorGuidanceGains,
    MultirotorLimits,
    PathProgress,
    circle_side,
    eta_field,
    ground_z,
    length_violation,
    loiters_here,
    path_control_state,
)
from autonomy.limits import OperatingLimits
from runtime import State, consume, param
from runtime.vehicle import general_number
from support.planar_geometry import along_and_across
from support.rotations import wrap
from support.wgs84 import offset
from tasks.control.desired_path import DesiredPathTask

Flags = imc.DesiredPath.Flags
Loops = imc.CLoopsMask
Units = imc.ZUnits
WANTED = int(Loops.VELOCITY | Loops.YAW)
Axes = imc.DesiredVelocity.Flags
ALL_AXES = int(Axes.SURGE | Axes.SWAY | Axes.HEAVE)
PATIENCE = 3.0  # s without ArmingState, which comes once per second


class Path(DesiredPathTask):
    """Follows DesiredPath while the loop PATH is enabled: publishes DesiredVelocity and DesiredHeading.

    A path is a straight line in space from the end of the last path to its own end, where the vehicle stops; with a
    loitering radius it is a circle. `u`, `v`, `w` of DesiredVelocity are m/s ahead, to starboard and down, in a level
    frame. Paths end at heights and altitudes, not at depths. On the ground only a path with the flag TAKEOFF is
    followed, straight up; a path with the flag LAND descends at its end. The entity is in ERROR without progress.
    """

    near_radius: float = param(
        1.5, "m", "A path is done within this distance of its end.", name="Radius To Endpoint", minimum=0.1
    )
    takeoff_tolerance: float = param(0.5, "m", "A takeoff is done within this distance of its height.", minimum=0.1)
    gain: float = param(0.8, "1/s", "Speed toward a path per distance from it.", minimum=0.05, maximum=5)
    maximum_speed: float = param(10.0, "m/s", "Highest speed over ground.", minimum=0.1)
    maximum_climb_rate: float = param(2.5, "m/s", "Fastest climb.", minimum=0.1)
    maximum_descent_rate: float = param(1.5, "m/s", "Fastest descent.", minimum=0.1)
    maximum_acceleration: float = param(2.0, "m/s²", "Largest acceleration of braking and turning.", minimum=0.1)
    landing_rate: float = param(0.5, "m/s", "Descent near the ground.", minimum=0.05)
    landing_altitude: float = param(5.0, "m", "The landing rate applies below this altitude.", minimum=0)
    altitude_margin: float = param(0.5, "m", "Distance kept from the limits of altitude.", minimum=0)
    watch_along: bool = param(True, "", "Monitor the progress along the line.", name="Along-track -- Monitor")
    along_period: float = param(
        20.0, "s", "Period of the progress check.", name="Along-track -- Check Period", minimum=1
    )
    along_speed: float = param(
        0.05, "m/s", "Least speed along the line.", name="Along-track -- Minimum Speed", minimum=0
    )
    watch_cross: bool = param(True, "", "Monitor the distance from the line.", name="Cross-track -- Monitor")
    cross_distance: float = param(
        15.0, "m", "Largest distance from the line.", name="Cross-track -- Distance Limit", minimum=0
    )
    cross_time: float = param(
        10.0, "s", "How long the distance may be larger.", name="Cross-track -- Time Limit", minimum=0
    )

    _limits = MultirotorLimits()

    def configure(self) -> None:
        number = partial(general_number, self.vehicle.profile)
        self._highest = OperatingLimits.from_options(number, highest=math.inf).highest
        gains = MultirotorGuidanceGains(
            self.near_radius, self.takeoff_tolerance, self.landing_rate, self.landing_altitude
        )
        if not hasattr(self, "_guidance"):  # the path stays if parameters change
            self._guidance = MultirotorGuidance(gains)
        self._guidance.gains = gains
        self._divergence = DivergenceMonitor(
            AlongTrack(self.along_period, self.along_speed, 0.0) if self.watch_along else None,
            CrossTrack(self.cross_distance, self.cross_time) if self.watch_cross else None,
        )

    def start(self) -> None:
        super().start()
        self._enabled = self._stands = False
        self._guidance.begin(NOWHERE, None, 0.0)
        self._received_at = math.inf
        self.set_entity_state(State.NORMAL, "idle")

    @consume
    def on_control_loops(self, loops: imc.ControlLoops) -> None:
        if not self._loops.receive(loops):
            return
        if not self._loops.mask:
            if loops.mask != Loops.ALL and self._enabled:
                self._switch(imc.ControlLoops.Enable.DISABLE)
            self._enabled = False
            self._path = self._waiting = None
        self.set_entity_state(State.NORMAL, "enabled" if self._loops.mask else "idle")

    @consume
    def on_operational_limits(self, limits: imc.OperationalLimits) -> None:
        """Set limits of altitude and speed. They are sent only once, so they survive new parameters and a restart."""
        before, self._limits = self._limits, MultirotorLimits.from_message(limits) or self._limits
        if self._path is not None and self._state is not None and before != self._limits:
            self._shift(self._path, self._state)

    @consume
    def on_arming_state(self, arming: imc.ArmingState) -> None:
        """A disarmed vehicle is on the ground."""
        self._stands, self._received_at = arming.state == imc.ArmingState.State.DISARMED, self.now

    def path_fault(self, path: imc.DesiredPath) -> str:
        if fault := super().path_fault(path):
            return fault
        if path.end_z_units == Units.DEPTH and not path.flags & Flags.NO_Z:
            return "an aerial vehicle cannot go to a depth"
        return "" if path.speed_units == imc.SpeedUnits.METERS_PS else "the speed of an aerial vehicle must be in m/s"

    def steer_along(self, path: imc.DesiredPath, before: imc.EstimatedState | None, state: imc.EstimatedState) -> None:
        if before is not None and (before.lat, before.lon, before.height) != (state.lat, state.lon, state.height):
            self.fail("the reference position has changed")
        elif self._stands and not path.flags & (Flags.TAKEOFF | Flags.LAND):
            self.fail("on the ground: take off first")
        elif self.age(self._received_at) > PATIENCE:
            self.fail("no ArmingState from the autopilot")
        else:
            self._cycle(path, state)

    def begin_path(self, path: imc.DesiredPath, state: imc.EstimatedState) -> None:
        at, guidance = (state.x, state.y, state.z), self._guidance
        before, ended = guidance.line.end, guidance.near and not guidance.loitering
        resumes = self._path is not None and ended and not path.flags & Flags.DIRECT
        start = before if resumes and math.dist(before, at) < 3.0 * self.near_radius else at
        if path.flags & Flags.START:
            start = (*self._over_ground(state, path.start_lat, path.start_lon), start[2])
        here = path.flags & Flags.TAKEOFF or loiters_here(path)
        north, east = at[:2] if here else self._over_ground(state, path.end_lat, path.end_lon)
        end = north, east, self._down(path, state)
        if violation := length_violation(math.dist(start, end)):
            self.fail(violation)
            return
        circle = Circle(end, path.lradius, circle_side(path)) if path.lradius > 0.0 else None
        takes_off, lands = bool(path.flags & Flags.TAKEOFF), bool(path.flags & Flags.LAND)
        guidance.begin(Line(start, end), circle, state.psi, takes_off=takes_off, lands=lands)
        self._path, self._reported = path, -math.inf
        self._divergence.restart(self.now)
        if not self._enabled:
            self._enabled = True
            self._switch(imc.ControlLoops.Enable.ENABLE)
        self.publish(imc.DesiredSpeed(value=path.speed, speed_units=path.speed_units))
        self.set_entity_state(State.NORMAL, "active")

    def _shift(self, path: imc.DesiredPath, state: imc.EstimatedState) -> None:
        """Move the current path within new limits of altitude."""
        if path.flags & Flags.NO_Z or path.end_z_units == Units.NONE:
            return
        guidance = self._guidance
        start, end, circle = guidance.line.start, guidance.line.end, guidance.circle
        end = end[0], end[1], self._down(path, state)
        line = Line((start[0], start[1], self._limited(start[2], path, state)), end)
        guidance.update_path_coordinates(line, replace(circle, center=end) if circle is not None else None)
        self._reported = -math.inf
        self._divergence.restart(self.now)

    def _over_ground(self, state: imc.EstimatedState, lat: float, lon: float) -> tuple[float, float]:
        return offset(state.lat, state.lon, lat, lon)

    def _down(self, path: imc.DesiredPath, state: imc.EstimatedState) -> float:
        """The end of a path, m below the reference, within the limits; publishes it as DesiredZ."""
        if path.flags & Flags.NO_Z or path.end_z_units == Units.NONE:
            return state.z
        down = (state.height if path.end_z_units == Units.HEIGHT else ground_z(state)) - path.end_z
        limited = self._limited(down, path, state)
        value = path.end_z + (down - limited if limited != down else 0.0)
        self.publish(imc.DesiredZ(value=value, z_units=path.end_z_units))
        return limited

    def _limited(self, down: float, path: imc.DesiredPath, state: imc.EstimatedState) -> float:
        """A height of a path within the limits, m below the reference."""
        lowest = 0.0 if path.flags & Flags.LAND else self._limits.lowest
        highest = min(self._limits.highest, self._highest)
        return MultirotorLimits(lowest, highest).limit_height(down, state, self.altitude_margin)

    def _cycle(self, path: imc.DesiredPath, state: imc.EstimatedState) -> None:
        guidance = self._guidance
        speed = max(0.0, min(path.speed, self.maximum_speed, self._limits.speed))
        limits = MotionLimits(speed, min(self.maximum_climb_rate, speed), self.maximum_descent_rate,
                              self.maximum_acceleration, self.gain)  # fmt: skip
        before = guidance.near, guidance.loitering
        wanted = guidance.step(state, limits, stands=self._stands)
        if before != (guidance.near, guidance.loitering):
            self._reported = -math.inf
        ahead, starboard = along_and_across(wanted[0], wanted[1], state.psi)
        self.publish(imc.DesiredVelocity(u=ahead, v=starboard, w=wanted[2], flags=ALL_AXES))
        self.publish(imc.DesiredHeading(value=guidance.heading))
        where = guidance.progress(state)
        if self.is_report_due(state):
            self._report(path, where, state, speed)
        if not guidance.near and not guidance.loitering:
            error = self._divergence.error_text(self.now, where, where.course, 0.0)
            if error:
                self.fail(error)

    def _report(self, path: imc.DesiredPath, where: PathProgress, state: imc.EstimatedState, speed: float) -> None:
        guidance = self._guidance
        report = path_control_state(path, near=guidance.near, loitering=guidance.loitering)
        self.publish(
            report.replace(
                flags=report.flags | (imc.PathControlState.Flags.NO_Z if guidance.landing else 0),
                x=0.0 if guidance.loitering else where.left,
                y=where.y,
                z=state.z - guidance.line.end[2],
                vx=where.vx,
                vy=where.vy,
                vz=state.vz,
                course_error=wrap(where.line_of_sight - where.course),
                eta=eta_field(guidance.eta(where, speed)),
            )
        )

    def fail(self, reason: str) -> None:
        self._path = None
        super().fail(reason)

    def _switch(self, enable: int) -> None:
        self.publish(imc.ControlLoops(enable=enable, mask=WANTED, scope_ref=self._loops.scope))
