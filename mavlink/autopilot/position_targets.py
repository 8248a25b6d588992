"""Times at which an autopilot is sent a position target: once for a place, and again only if it was lost."""

import math
from typing import NamedTuple

from mavlink import Fields
from mavlink.autopilot.leg import Leg, ReportedPosition
from mavlink.autopilot.setpoints import position_target
from mavlink.autopilot.vehicle_modes import SteeredVehicle
from support.rotations import wrap
from support.wgs84 import displace, ground_distance, offset

CONFIRMATION = 2.0  # s in which the autopilot shows its target
REPLAN = 6.0  # s; one that plans its path anew for each copy stands still if they come faster
LONGEST_REPLAN = 24.0  # s
SAME_TARGET = 2.0  # m; the autopilot rounds
APPROACH = 0.05  # m/s; one that comes closer so fast has its target
SAGITTA = 1.0  # m between a circle and the chords on which a submarine follows it
LARGEST_STEP = math.radians(45.0)
CORRECTION, LARGEST_CORRECTION = 0.4, 0.35  # of what a chord missed; of the radius
CORNER = 1.5  # m; so near to the end of a chord the next one begins


class Target(NamedTuple):
    """A place (rad) and a height (m) above home."""

    lat: float
    lon: float
    height: float


class PositionTargets:
    """The SET_POSITION_TARGET_GLOBAL_INT that is due for one leg.

    A target counts as received if the autopilot shows it in POSITION_TARGET_GLOBAL_INT, or comes closer. ArduSub plans
    its path anew for each one, from a standstill (`SteeredVehicle.replans`): it gets a circle as chords, and no copy
    while it moves. Others get a target that moves ahead on the circle with each call.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Begin a new leg."""
        self._target: Target | None = None
        self._sent_at = self._shown_at = -math.inf
        self._wait, self._away = CONFIRMATION, math.inf
        self._shown: tuple[float, float] | None = None
        self._angle = math.nan  # of the end of a chord
        self._outwards, self._radii = 0.0, list[float]()  # m

    @property
    def sent(self) -> bool:
        """Whether a target of this leg was sent."""
        return self._target is not None

    def repeat(self) -> None:
        """Send the last target again with the next call, since it seems to be lost."""
        self._sent_at = -math.inf

    def receive_shown(self, lat: float, lon: float, now: float) -> None:
        """Take the target that the autopilot shows (rad)."""
        self._shown, self._shown_at = (lat, lon), now

    def due(self, vehicle: SteeredVehicle, leg: Leg, at: ReportedPosition, now: float) -> Fields | None:
        """Target that has to be sent now; None without one."""
        if leg.radius and vehicle.replans:
            target = self._end_of_chord(leg, at)
        else:
            target = Target(*leg.steering_target(at), leg.height)
        if target != self._target:
            self._target = target
            self._wait = REPLAN if vehicle.replans else CONFIRMATION
        elif not self._is_lost(target, at, now):
            return None
        elif vehicle.replans:
            self._wait = min(LONGEST_REPLAN, 2.0 * self._wait)
        self._sent_at, self._away = now, _distance(target, at)
        return position_target(*target)

    def _is_lost(self, target: Target, at: ReportedPosition, now: float) -> bool:
        if now - self._sent_at < self._wait:
            return False
        if (
            self._shown is not None
            and self._shown_at >= self._sent_at
            and ground_distance(*self._shown, target.lat, target.lon) <= SAME_TARGET
        ):
            return False
        away = _distance(target, at)
        closer = self._away - away >= APPROACH * (now - self._sent_at)
        if closer:
            self._sent_at, self._away = now, away
        return not closer and away > CORNER

    def _end_of_chord(self, leg: Leg, at: ReportedPosition) -> Target:
        """The corner to which a submarine goes; the corners move out or in until the way has the radius on average."""
        north, east = offset(leg.lat, leg.lon, at.lat, at.lon)
        angle, away = math.atan2(east, north), math.hypot(north, east)
        half = min(0.5 * LARGEST_STEP, math.acos(max(0.0, 1.0 - SAGITTA / max(leg.radius, SAGITTA))))
        if math.isnan(self._angle):
            self._angle = angle if away > leg.radius + SAGITTA else angle + leg.side * 2.0 * half
        self._radii.append(away)
        end = _corner(leg, leg.radius + self._outwards, self._angle)
        passed = leg.side * wrap(angle - self._angle) > 0.0 and away > 0.5 * leg.radius
        if passed or ground_distance(at.lat, at.lon, end.lat, end.lon) < CORNER:
            if leg.loitering:
                most = LARGEST_CORRECTION * leg.radius
                missed = leg.radius - math.fsum(self._radii) / len(self._radii)
                self._outwards = max(-most, min(most, self._outwards + CORRECTION * missed))
            self._radii.clear()
            self._angle = wrap(self._angle + leg.side * 2.0 * half)
            end = _corner(leg, leg.radius + self._outwards, self._angle)
        return end


def _corner(leg: Leg, radius: float, angle: float) -> Target:
    lat, lon, _ = displace(leg.lat, leg.lon, 0.0, radius * math.cos(angle), radius * math.sin(angle))
    return Target(lat, lon, leg.height)


def _distance(target: Target, at: ReportedPosition) -> float:
    north, east = offset(at.lat, at.lon, target.lat, target.lon)
    return math.hypot(north, east, target.height - at.above_home)
