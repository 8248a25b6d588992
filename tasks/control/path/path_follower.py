"""Common parts of both path controllers: paths in, headings out, progress and its supervision."""

import math
from collections.abc import Mapping

import imc
from autonomy.guidance import (
    AlongTrack,
    BottomGuard,
    CrossTrack,
    DivergenceMonitor,
    Point,
    SteeringLaw,
    Track,
    TrackGuidance,
    TrackGuidanceGains,
    circle_side,
    eta_field,
    length_violation,
    loiters_here,
    path_control_state,
)
from imc.coordinates import absolute_position
from runtime import State, consume, param, periodic
from runtime.vehicle import general_number
from support.rotations import wrap
from support.wgs84 import offset
from tasks.control.desired_path import EARLY, DesiredPathTask

Flags = imc.DesiredPath.Flags
Loops = imc.CLoopsMask
DEPTH, ALTITUDE = Loops.DEPTH.value, Loops.ALTITUDE.value
YAW, SPEED = Loops.YAW.value, Loops.SPEED.value
Z_LOOPS: Mapping[int, int] = {imc.ZUnits.DEPTH: Loops.DEPTH, imc.ZUnits.ALTITUDE: Loops.ALTITUDE}
RECENT = 1.0  # s
LONGEST_BRAKE = 30.0  # s
SILENCE = 2.0  # s without EstimatedState


class PathFollowerTask(DesiredPathTask):
    """Follows DesiredPath while the loop PATH is enabled: publishes DesiredHeading, DesiredZ and DesiredSpeed.

    Enables the loops that it needs in the scope of the maneuver, publishes PathControlState, and is in ERROR if the
    vehicle is stuck or strays from the path, or EstimatedState falls silent. Subclasses define how to steer.
    """

    control_frequency: float = param(
        10.0, "Hz", "Highest rate of DesiredHeading; 0 or less for that of EstimatedState.", maximum=1000
    )
    course_control: bool = param(True, "", "Control the course instead of the heading.")
    eta_minimum_speed: float = param(
        0.1, "m/s", "Lowest speed assumed for the time of arrival.", name="ETA Minimum Speed", minimum=0.01
    )
    new_reference_timeout: float = param(5.0, "s", "Longest time from the end of a path to the next path.", minimum=0)
    position_jump: float = param(
        10.0, "m", "A larger jump of the position pauses the supervision.", name="Position Jump Threshold", minimum=0
    )
    jump_factor: float = param(
        0.5,
        "m/s",
        "The pause is the length of the jump divided by this speed.",
        name="Position Jump Time Factor",
        minimum=0.01,
    )
    watch_along: bool = param(False, "", "Monitor the progress along the track.", name="Along-track -- Monitor")
    along_period: float = param(
        20.0, "s", "Period of the progress check.", name="Along-track -- Check Period", minimum=0.1
    )
    along_speed: float = param(
        0.05, "m/s", "Least speed along the track.", name="Along-track -- Minimum Speed", minimum=0
    )
    along_yaw: float = param(
        2.0, "°/s", "Least rate of turn toward the path.", name="Along-track -- Minimum Yaw", minimum=0
    )
    watch_cross: bool = param(False, "", "Monitor the distance from the track.", name="Cross-track -- Monitor")
    cross_distance: float = param(
        25.0, "m", "Largest distance from the track.", name="Cross-track -- Distance Limit", minimum=0
    )
    cross_time: float = param(
        20.0, "s", "How long the distance may be larger.", name="Cross-track -- Time Limit", minimum=0
    )
    cross_uncertainty: float = param(
        1.0,
        "1",
        "Fraction of the uncertainty added to the limit; 0 or less for none.",
        name="Cross-track -- Nav. Unc. Factor",
    )

    watch_bottom: bool = param(
        False,
        "",
        "Hold an altitude if the depth of a path is too near to the bottom.",
        name="Bottom Track -- Enabled",
    )
    lowest: float = param(
        2.5, "m", "Altitude to hold over the bottom.", name="Bottom Track -- Admissible Altitude", minimum=0
    )

    def steering_law(self) -> SteeringLaw:
        """The law that follows tracks, with the present parameters."""
        raise NotImplementedError

    def configure(self) -> None:
        early = general_number(self.vehicle.profile, "Time Of Arrival Factor", 5.0)
        gains, law = TrackGuidanceGains(self.course_control, early, self.eta_minimum_speed), self.steering_law()
        if not hasattr(self, "_guidance"):  # the path stays if parameters change
            self._guidance = TrackGuidance(gains, law)
        self._guidance.gains, self._guidance.law = gains, law
        turning = math.radians(self.along_yaw)
        self._divergence = DivergenceMonitor(
            AlongTrack(self.along_period, self.along_speed, turning) if self.watch_along else None,
            CrossTrack(self.cross_distance, self.cross_time) if self.watch_cross else None,
        )

    def start(self) -> None:
        super().start()
        self._enabled = 0
        self._uncertainty = 0.0
        self._before: imc.DesiredPath | None = None
        self._guidance.begin(Track((0.0, 0.0), (0.0, 0.0)))
        self._cycled = self._left = -math.inf
        self.set_entity_state(State.NORMAL, "idle")

    @consume
    def on_control_loops(self, loops: imc.ControlLoops) -> None:
        if not self._loops.receive(loops):
            return
        if self._loops.mask:
            self.set_entity_state(State.NORMAL, "enabled")
            return
        if loops.mask != Loops.ALL and self._enabled:  # ALL has disabled the loops below as well
            self._switch(imc.ControlLoops.Enable.DISABLE, self._enabled)
        self._enabled = 0
        if self._path is not None:
            self._before, self._left = self._path, self.now
        self._path = self._waiting = None
        self.set_entity_state(State.NORMAL, "idle")

    @consume
    def set_cross_track_uncertainty(self, uncertainty: imc.NavigationUncertainty) -> None:
        """Set the uncertainty from the variance of the position."""
        largest = max(uncertainty.x, uncertainty.y)
        self._uncertainty = max(0.0, self.cross_uncertainty) * math.sqrt(largest) if 0.0 <= largest < math.inf else 0.0

    @consume
    def restart_divergence_monitor(self, brake: imc.Brake) -> None:
        self._divergence.restart(self.now_without_stalls + (LONGEST_BRAKE if brake.op == imc.Brake.Op.START else 0.0))

    def steer_along(self, path: imc.DesiredPath, before: imc.EstimatedState | None, state: imc.EstimatedState) -> None:
        if before is not None and (before.lat, before.lon) != (state.lat, state.lon):
            self._guidance.update_track_coordinates(self._track_of(path, state))
        elif before is not None:
            self._notice_jump(math.hypot(state.x - before.x, state.y - before.y))
        if self.control_frequency <= 0.0 or state.timestamp - self._cycled >= 1.0 / self.control_frequency - EARLY:
            self._cycled = state.timestamp
            self._cycle(path, state)

    @periodic(1.0)
    def watch_navigation(self) -> None:
        if self._path is not None and self._state is not None and self.age(self._state.timestamp) > SILENCE:
            self.fail("EstimatedState is missing")

    def begin_path(self, path: imc.DesiredPath, state: imc.EstimatedState) -> None:
        start_lat, start_lon = self._start_of(path, state)
        end_lat, end_lon = path.end_lat, path.end_lon
        if loiters_here(path):
            end_lat, end_lon = _position(state)
        path = path.replace(start_lat=start_lat, start_lon=start_lon, end_lat=end_lat, end_lon=end_lon)
        still = self._path is not None and self._guidance.loitering and path.lradius > 0.0
        track, at = self._track_of(path, state), (state.x, state.y)
        distance = math.dist(at, track.end)
        is_point = track.length == 0.0 and path.lradius <= 0.0
        if violation := length_violation(distance if is_point else track.length):
            self.fail(violation)
            return
        loitering = path.lradius > 0.0 and (
            distance <= path.lradius or (still and 0.75 * path.lradius <= distance <= 1.25 * path.lradius)
        )
        self._guidance.begin(track, loitering=loitering)
        self._path, self._ended = path, -math.inf
        self._reported = self._cycled = -math.inf
        self._divergence.restart(self.now_without_stalls)
        self._bottom = BottomGuard(self.lowest)
        self._enable_for(path)
        self.set_entity_state(State.NORMAL, "active")

    def _start_of(self, path: imc.DesiredPath, state: imc.EstimatedState) -> Point:
        """Start of the path, as in DUNE: the end of the previous one, also of a circle, if the vehicle is there."""
        if path.flags & Flags.START:
            return path.start_lat, path.start_lon
        if self._path is not None:
            before, recent = self._path, state.timestamp - self._cycled <= RECENT
        else:  # other loops may have been enabled in between
            before, recent = self._before, self.now - self._left <= RECENT
        if (
            before is None
            or not recent
            or not (self._guidance.near or self._guidance.loitering)
            or path.flags & Flags.DIRECT
        ):
            return _position(state)
        return before.end_lat, before.end_lon

    def _track_of(self, path: imc.DesiredPath, state: imc.EstimatedState) -> Track:
        """The path in meters from the reference position of the state."""
        lat, lon = state.lat, state.lon
        start = offset(lat, lon, path.start_lat, path.start_lon)
        end = offset(lat, lon, path.end_lat, path.end_lon)
        return Track(start, end, max(0.0, path.lradius), circle_side(path))

    def _enable_for(self, path: imc.DesiredPath) -> None:
        wanted = YAW | SPEED
        if not path.flags & Flags.NO_Z:
            wanted |= Z_LOOPS.get(path.end_z_units, 0)
        if self._enabled & ~wanted:
            self._switch(imc.ControlLoops.Enable.DISABLE, self._enabled & ~wanted)
        if wanted & ~self._enabled:
            self._switch(imc.ControlLoops.Enable.ENABLE, wanted & ~self._enabled)
        self._enabled = wanted
        if wanted & (DEPTH | ALTITUDE):
            self.publish(imc.DesiredZ(value=path.end_z, z_units=path.end_z_units))
        self.publish(imc.DesiredSpeed(value=path.speed, speed_units=path.speed_units))

    def _notice_jump(self, jump: float) -> None:
        if jump > self.position_jump:
            self._divergence.restart(self.now_without_stalls + jump / self.jump_factor)

    def _cycle(self, path: imc.DesiredPath, state: imc.EstimatedState) -> None:
        guidance = self._guidance
        before = guidance.near, guidance.loitering
        heading = guidance.step(state)
        if before != (guidance.near, guidance.loitering):
            self._ended = state.timestamp if guidance.near else self._ended
            self._reported = -math.inf
        self.publish(imc.DesiredHeading(value=heading))
        if self.is_report_due(state):
            self._report(path, state)
        self._supervise()
        if self.watch_bottom and self._enabled & DEPTH and self._bottom.update(path.end_z, state.depth, state.alt):
            avoids = imc.DesiredZ(value=self.lowest, z_units=imc.ZUnits.ALTITUDE)
            self.publish(avoids if self._bottom.active else imc.DesiredZ(value=path.end_z, z_units=path.end_z_units))

    def _report(self, path: imc.DesiredPath, state: imc.EstimatedState) -> None:
        guidance, where = self._guidance, self._guidance.where
        loitering, y = guidance.loitering, where.y
        if loitering:
            y = math.dist((state.x, state.y), guidance.track.end) - guidance.track.radius
        now = state.alt if path.end_z_units == imc.ZUnits.ALTITUDE else state.depth
        self.publish(
            path_control_state(path, near=guidance.near, loitering=loitering).replace(
                x=0.0 if loitering else where.left,
                y=y,
                z=path.end_z - now,
                vx=where.vx,
                vy=where.vy,
                vz=state.vz,
                course_error=wrap(guidance.target - guidance.course),
                eta=0 if loitering else eta_field(guidance.eta),
            )
        )

    def _supervise(self) -> None:
        guidance = self._guidance
        if guidance.near and self.age(self._ended) > self.new_reference_timeout:
            self.fail("expected new path control reference")
        elif not guidance.loitering and not guidance.near:
            error = self._divergence.error_text(
                self.now_without_stalls, guidance.where, guidance.target, self._uncertainty
            )
            if error:
                self.fail(error)

    def _switch(self, enable: int, mask: int) -> None:
        self.publish(imc.ControlLoops(enable=enable, mask=mask, scope_ref=self._loops.scope))


def _position(state: imc.EstimatedState) -> Point:
    return absolute_position(state)[:2]
