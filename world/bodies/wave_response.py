"""The ride of a boat on waves."""

from typing import NamedTuple, Protocol

from support.rotations import Vector, rotation, to_body
from world.bodies.boat import Boat


class BoatMotion(NamedTuple):
    """Place (m north, east, down), velocity through the water (m/s; body), angles (rad), and rates p, q, r (rad/s)."""

    place: Vector
    velocity: Vector
    angles: Vector
    rates: Vector


class HullMotionSource(Protocol):
    """Source of the motion of a hull by waves: `world.sea.WindSea` is one."""

    def hull_motion(
        self,
        place: tuple[float, float],
        velocity: Vector,
        heading: float,
        turn: float,
        size: tuple[float, float],
        time: float,
    ) -> tuple[Vector, Vector, Vector, Vector]:
        """Offset and velocity (m, m/s; NED), angles and rates (rad, rad/s)."""
        ...


def motion_in_waves(boat: Boat, sea: HullMotionSource, start: tuple[float, float], time: float) -> BoatMotion:
    """The motion of a boat in a sea at a time (s); its place counts from `start`, m north and east of the sea's origin.

    Water that waves move counts as at rest: velocity and stream together are still those over ground.
    """
    _, _, heading = boat.euler_angles()
    sailed = boat.ground_velocity
    place = start[0] + boat.x, start[1] + boat.y
    (north, east, down), (vn, ve, vd), angles, rates = sea.hull_motion(
        place, sailed, heading, boat.r, boat.model.waterplane, time
    )
    through = sailed[0] + vn - boat.stream[0], sailed[1] + ve - boat.stream[1], sailed[2] + vd - boat.stream[2]
    return BoatMotion(
        (boat.x + north, boat.y + east, boat.z + down),
        to_body(rotation(*angles), through),
        angles,
        rates,
    )
