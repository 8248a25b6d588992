"""Positions that a program sends again and again: PX4's offboard mode, ArduPilot's guided mode."""

import math
from typing import Any

import imc
from autonomy.plans import sequential_plan
from mavlink import Mode, ReceivedMessage, positions, statustext
from mavlink.missions import MissionError, MissionResult
from mavlink.vehicle.command.hold_and_abort import VehicleControl
from mavlink.vehicle.command.request import DONE, CommandResult, Finish, MavResult
from mavlink.vehicle.mission import PlanReply
from mavlink.vehicle.session import Session
from support import wgs84
from support.planar_geometry import north_and_east
from support.wgs84 import is_on_earth

NO_POSITION, NO_VELOCITY = 0x07, 0x38  # POSITION_TARGET_TYPEMASK
NO_THROTTLE, NO_ATTITUDE = 0x40, 0x80  # ATTITUDE_TARGET_TYPEMASK
AHEAD = 200.0  # m on a course, to the place that is followed
LOCAL, LOCAL_OFFSET, BODY, BODY_OFFSET = 1, 7, 8, 9  # MAV_FRAME
RELATIVE = 6
FRESH = 0.5  # s that a target is young enough to begin with
SILENCE = 2.0  # s without a target after which an offboard vehicle holds
PATIENCE = 10.0  # s without a reference after which the maneuver gives up
SOON = 0.2  # s between references of a stream
RESTED = 2.0  # s between targets of an aircraft: each is a plan
AGAIN = 1.0  # s between repeated references
Has = imc.Reference.Flags


class OffboardTarget:
    """The place that a program sends, and since when the vehicle follows it."""

    def __init__(self, control: VehicleControl) -> None:
        self._control = control
        self._reference: imc.Reference | None = None
        self._received_at = self._published_at = -math.inf
        self._streams = self._steers = False
        self._level: tuple[float, float] = (-math.inf, 0.0)  # when a course was last given, and its altitude

    def receive(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """Take a target; the vehicle follows it if it is in guided or offboard mode."""
        try:
            if message.name == "SET_ATTITUDE_TARGET":
                self._reference, self._steers = self._course(message.values, now), True
            else:
                self._reference, self._steers = self._reference_of(message), False
        except MissionError as refusal:
            session.send_statustext(statustext.WARNING, f"Target rejected: {refusal}", now)
            return
        self._received_at = now
        control = self._control
        if not control.model.kind.afloat:
            self._fly(self._reference, session, now)
        elif control.model.active_guided_plan_id == "follow":
            if now - self._published_at >= SOON:
                self._publish(now)
        elif control.model.chosen_mode is Mode.GUIDED and control.model.mode in (Mode.HOLD, Mode.GUIDED):
            self.follow(
                lambda reply: session.send_statustext(statustext.WARNING, reply.reason, now) if reply.reason else None,
                now,
            )

    def _fly(self, reference: imc.Reference, session: Session, now: float) -> None:
        """Send an aircraft in guided mode to a place, as for a change of its altitude; it follows no stream."""
        control = self._control
        if control.model.chosen_mode is not Mode.GUIDED or control.model.mode not in (
            Mode.HOLD,
            Mode.GUIDED,
            Mode.TAKEOFF,
        ):
            return
        if now - self._published_at < RESTED:
            session.send_statustext(
                statustext.WARNING, f"An aircraft takes a target every {RESTED:g} s, and follows no stream", now
            )
            return
        self._published_at = now
        assert isinstance(reference.z, imc.DesiredZ)
        assert isinstance(reference.speed, imc.DesiredSpeed)
        leg = imc.Goto(
            lat=reference.lat,
            lon=reference.lon,
            z=reference.z.value,
            z_units=reference.z.z_units,
            speed=reference.speed.value,
            speed_units=reference.speed.speed_units,
        )
        stay = imc.StationKeeping(
            lat=leg.lat, lon=leg.lon, z=leg.z, z_units=leg.z_units, speed=leg.speed, speed_units=leg.speed_units
        )

        def judge(outcome: PlanReply) -> None:
            if not outcome.done:
                session.send_statustext(statustext.WARNING, f"Cannot go there: {outcome.reason}", now)

        control.plans.start(sequential_plan("goto", {"1": leg, "2": stay}), judge, now)

    def follow(self, finish: Finish, now: float, *, streams: bool = False) -> CommandResult | None:
        """Follow the targets; if they come as a stream, its end is a reason to hold."""
        control = self._control
        if not control.model.kind.afloat:
            return CommandResult(MavResult.DENIED, "An aircraft does not follow targets here: send it to a place")
        if streams and control.age(self._received_at) > FRESH:
            return CommandResult(MavResult.TEMPORARILY_REJECTED, "Offboard denied: no position target has come")
        self._streams = streams

        def judge(outcome: PlanReply) -> None:
            finish(DONE if outcome.done else CommandResult(MavResult.FAILED, f"Cannot follow: {outcome.reason}"))
            self._publish(now)

        maneuver = imc.FollowReference(control_src=control.imc_id, control_ent=0xFF, timeout=PATIENCE)
        control.plans.start(sequential_plan("follow", {"1": maneuver}), judge, now)
        return None

    def repeat_target_or_hold(self, now: float) -> None:
        """Repeat the target, or hold if no more come."""
        control = self._control
        if control.model.active_guided_plan_id != "follow":
            return
        if (self._streams or self._steers) and control.age(self._received_at) > SILENCE:
            control.send_statustext(statustext.WARNING, "No more targets: holding")
            control.hold(now)
        elif now - self._published_at >= AGAIN:
            self._publish(now)

    def _publish(self, now: float) -> None:
        if self._reference is not None:
            self._published_at = now
            self._control.publish(self._reference)

    def _reference_of(self, message: ReceivedMessage) -> imc.Reference:
        """The reference of a target. Raises MissionError."""
        control, values = self._control, message.values
        settings, found = control.model.conversion_settings(), control.model.state_and_position()
        if values["type_mask"] & NO_POSITION:
            raise MissionError(MissionResult.INVALID, "only positions are followed, no velocities or accelerations")
        if found is None:
            raise MissionError(MissionResult.ERROR, "the position is unknown")
        if message.name == "SET_POSITION_TARGET_LOCAL_NED":
            lat, lon, frame, z = self._local(values, *found)
        else:
            lat, lon = (math.radians(values[name] * 1e-7) for name in ("lat_int", "lon_int"))
            frame, z = values["coordinate_frame"], values["alt"]
        if not (is_on_earth(lat, lon) and math.isfinite(z)):
            raise MissionError(MissionResult.INVALID, "the position is not on earth")
        speed = 0.0
        if not values["type_mask"] & NO_VELOCITY:
            speed = math.hypot(values["vx"], values["vy"], values["vz"])
        return self._to(lat, lon, frame, min(0.0, z) if settings.kind.afloat and z < 1.0 else z, speed)

    def _course(self, values: dict[str, Any], now: float) -> imc.Reference:
        """The reference of an attitude: a place far ahead on its heading, at the depth where the course began."""
        control = self._control
        settings, found = control.model.conversion_settings(), control.model.state_and_position()
        if not settings.kind.afloat:
            raise MissionError(
                MissionResult.UNSUPPORTED, "an aircraft does not follow attitudes here: send it to a place"
            )
        if values["type_mask"] & NO_ATTITUDE:
            raise MissionError(MissionResult.INVALID, "only headings are followed, no rates alone")
        w, x, y, z = values["q"]
        size, thrust = w * w + x * x + y * y + z * z, values["thrust"]
        if not 0.5 < size < 2.0:
            raise MissionError(MissionResult.INVALID, "the attitude is no rotation")
        if found is None:
            raise MissionError(MissionResult.ERROR, "the position is unknown")
        place = found[1]
        began, altitude = self._level
        self._level = now, (altitude if control.age(began) <= SILENCE else place.relative)
        speed, way = 0.0, AHEAD
        if not values["type_mask"] & NO_THROTTLE:
            if not 0.0 <= thrust <= 1.0:
                raise MissionError(MissionResult.INVALID, f"a thrust of {thrust:g} is not within 0 to 1")
            fastest = settings.fastest if math.isfinite(settings.fastest) else control.model.guided_speed
            speed, way = thrust * fastest, AHEAD if thrust else 0.0
        heading = math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
        lat, lon, _ = wgs84.displace(place.lat, place.lon, 0.0, way * math.cos(heading), way * math.sin(heading))
        return self._to(lat, lon, RELATIVE, min(0.0, self._level[1]), speed)

    def _to(self, lat: float, lon: float, frame: int, z: float, speed: float) -> imc.Reference:
        """The reference of a place; a speed of 0 is the usual one. Raises MissionError."""
        control, settings = self._control, self._control.model.conversion_settings()
        level = settings.level(frame, z)
        speed = control.model.guided_speed if speed == 0.0 else speed
        if not 0.0 < speed <= settings.fastest:
            raise MissionError(MissionResult.INVALID, f"{speed:g} m/s is no speed of the vehicle")
        return imc.Reference(
            flags=Has.LOCATION | Has.SPEED | Has.Z | Has.DIRECT,
            lat=lat,
            lon=lon,
            z=imc.DesiredZ(value=level.z, z_units=level.z_units),
            speed=imc.DesiredSpeed(value=speed, speed_units=imc.SpeedUnits.METERS_PS),
        )

    def _local(
        self, values: dict[str, Any], state: imc.EstimatedState, place: positions.GlobalPosition
    ) -> tuple[float, float, int, float]:
        """Latitude, longitude, frame and altitude of a target in meters from home or from the vehicle."""
        north, east, down, kind = (values[name] for name in ("x", "y", "z", "coordinate_frame"))
        home = self._control.model.home
        if not all(map(math.isfinite, (north, east, down))) or home is None:
            raise MissionError(MissionResult.INVALID, "the position is not a number")
        if kind in (BODY, BODY_OFFSET):
            north, east = north_and_east(north, east, state.psi)
        elif kind not in (LOCAL, LOCAL_OFFSET):
            raise MissionError(MissionResult.UNSUPPORTED_FRAME, f"frame {kind} has no meaning for a target")
        if kind == LOCAL:
            lat, lon, _ = wgs84.displace(home.lat, home.lon, 0.0, north, east)
            return lat, lon, RELATIVE, -down
        lat, lon, _ = wgs84.displace(place.lat, place.lon, 0.0, north, east)
        return lat, lon, RELATIVE, place.relative - down
