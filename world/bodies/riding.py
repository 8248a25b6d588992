"""The ride of a boat on waves."""

from typing import NamedTuple

from world.attitude import Vector, rotation, to_body
from world.bodies.boat import Boat
from world.sea import WindSea


class Riding(NamedTuple):
    """Place (m north, east, down), velocity through the water (m/s; body), angles (rad), and rates p, q, r (rad/s)."""

    place: Vector
    velocity: Vector
    angles: Vector
    rates: Vector


def ride(boat: Boat, sea: WindSea, start: tuple[float, float], time: float) -> Riding:
    """The motion of a boat in a sea at a time (s); its place counts from `start`, m north and east of the sea's origin.

    Water that waves move counts as at rest: velocity and stream together are still those over ground.
    """
    _, _, heading = boat.euler_angles()
    sailed = boat.over_ground
    found = sea.ride((start[0] + boat.x, start[1] + boat.y), sailed, heading, boat.r, boat.model.waterplane, time)
    (north, east, down), (vn, ve, vd) = found.offset, found.velocity
    through = sailed[0] + vn - boat.stream[0], sailed[1] + ve - boat.stream[1], sailed[2] + vd - boat.stream[2]
    return Riding(
        (boat.x + north, boat.y + east, boat.z + down),
        to_body(rotation(*found.angles), through),
        found.angles,
        found.rates,
    )
