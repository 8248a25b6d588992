"""Echoes of sonar beams in a world: the nearest object, and its speed."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from support.rotations import Vector
from world.objects import GLIDER, NorthEast, ObjectPosition, WorldObject
from world.sea import Bathymetry
from world.sensors.sonar_beam import SonarBeam

MOMENT = 0.1  # s, over which the velocity of an object is taken
LEAST_BEAMS = 3  # for a velocity
FLATTEST = 0.05  # least singular value of the directions of beams, of at most about 1


class AcousticScene(Protocol):
    """The world, as far as it returns an echo."""

    @property
    def seabed(self) -> Bathymetry | None: ...
    @property
    def walls(self) -> tuple[tuple[NorthEast, NorthEast], ...]: ...
    @property
    def objects(self) -> tuple[WorldObject, ...]: ...
    @property
    def object_position(self) -> Callable[[WorldObject, float], ObjectPosition]: ...


class BeamEcho(NamedTuple):
    """An echo in a beam: its distance (m), what it is, and its velocity (m/s; north, east, down)."""

    distance: float
    source: str
    velocity: Vector = (0.0, 0.0, 0.0)


def nearest_echo(
    world: AcousticScene, beam: SonarBeam, time: float, stream: Vector, blanking: float, reach: float
) -> BeamEcho | None:
    """The nearest echo of a beam at a time (s from the start of the run); None out of the water.

    Nothing beyond `reach` m returns an echo. What is nearer than `blanking` m returns none, and hides the rest. The
    surface moves with the `stream` (m/s; north, east, down).
    """
    if not beam.start[2] > 0.0:
        return None
    found = [BeamEcho(beam.distance_to_surface(), "surface", stream)]
    if world.seabed is not None:
        found.append(BeamEcho(distance_to_bottom(beam, world.seabed, reach), "bottom"))
    found += [BeamEcho(beam.distance_to_wall(*wall), "wall") for wall in world.walls]
    found += [echo for thing in world.objects if (echo := _of(world, thing, beam, time)) is not None]
    nearest = min(found, key=lambda echo: echo.distance)
    return nearest if blanking <= nearest.distance <= reach else None


def distance_to_bottom(beam: SonarBeam, seabed: Bathymetry, reach: float) -> float:
    """Distance (m) along a beam to a bottom within `reach`; infinite if the beam does not hit it."""
    return beam.distance_to_bottom(
        seabed.depth, reach, seabed.shallowest, seabed.deepest, seabed.sampling_step, seabed.shallowest_near
    )


def _of(world: AcousticScene, thing: WorldObject, beam: SonarBeam, time: float) -> BeamEcho | None:
    spot = world.object_position(thing, time)
    if spot.down is None or thing.kind != GLIDER:  # boards are too thin to return an echo
        return None
    middle = spot.north, spot.east, spot.down
    distance = beam.distance_to_capsule(middle, spot.heading, thing.length, thing.diameter)
    if distance == math.inf:
        return None
    before = world.object_position(thing, time - MOMENT)
    down = 0.0 if before.down is None else (spot.down - before.down) / MOMENT
    velocity = (spot.north - before.north) / MOMENT, (spot.east - before.east) / MOMENT, down
    return BeamEcho(distance, f"{thing.kind} {thing.id}", velocity)


def janus_directions(tilt: float) -> tuple[Vector, ...]:
    """Directions of four beams around the z axis, `tilt` (rad) off it: between forward, right, back and left."""
    across, along = math.sin(tilt) * math.sqrt(0.5), math.cos(tilt)
    return tuple((across * x, across * y, along) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1)))


def velocity_from_beams(directions: Sequence[Vector], speeds: Sequence[float]) -> Vector | None:
    """The velocity (m/s) of a sensor whose beams measure speeds along their directions; None if too few do.

    With more than three, by least squares.
    """
    if len(directions) < LEAST_BEAMS:
        return None
    matrix = np.array(directions)
    if np.linalg.svd(matrix, compute_uv=False)[-1] < FLATTEST:
        return None
    x, y, z = np.linalg.lstsq(matrix, np.array(speeds), rcond=None)[0].tolist()
    return x, y, z
