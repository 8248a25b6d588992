"""Context of the conversion of a mission: the vehicle, its home and its limits; and altitudes in MAVLink's frames."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import imc
from mavlink.missions.enums import (
    GLOBAL_FRAMES,
    POSITIONS,
    RELATIVE_INT,
    TERRAIN_FRAMES,
    TERRAIN_INT,
    MissionError,
    MissionResult,
)
from mavlink.missions.item import to_float32
from mavlink.modes import VehicleKind
from mavlink.positions import Home

Units = imc.ZUnits
SUBMARINE, PLANE = 12, 1  # MAV_TYPE
FARTHEST_UP = 11_000.0  # m up or down; plans may not ask for more
WAVES = 0.5  # m; a console sends a boat to the altitude that it shows
DIGITS = 9  # decimals that a float of 32 bits may need


class Level(NamedTuple):
    """Vertical position of a maneuver, as in its fields."""

    z: float
    z_units: int


@dataclass(frozen=True, slots=True)
class ConversionContext:
    """The vehicle for which missions are converted.

    `z` (m below the surface, above home for aircraft) and `speed` (m/s) hold until an item gives another. Circles and
    stations without a radius have `radius` (m); the vehicle turns no tighter than `tightest` (m). `fastest` is in m/s,
    `deepest` (1 m within what the plan engine allows, which keeps a margin) and `highest` (above home or ground) in m.
    `switch` of the entity `camera` is true while it takes pictures; no
    label means no camera. `aloft`: the mission of an aircraft begins in the air. `area` has the area that the vehicle
    does not leave. `name` is the plan's.
    """

    kind: VehicleKind
    home: Home | None = None
    speed: float = 1.0
    z: float = 0.0
    radius: float = 15.0
    tightest: float = 0.0
    deepest: float = math.inf
    highest: float = math.inf
    fastest: float = math.inf
    camera: str = ""
    switch: str = "Active"
    aloft: bool = False
    area: imc.OperationalLimits | None = None
    name: str = "mavlink"

    @property
    def dives(self) -> bool:
        """Whether the vehicle is a submarine."""
        return self.kind.type == SUBMARINE

    @property
    def flies(self) -> bool:
        """Whether the vehicle is an aircraft."""
        return not self.kind.afloat

    @property
    def keeps_station(self) -> bool:
        """Whether the vehicle keeps a station; a plane can only circle."""
        return self.kind.type != PLANE

    @property
    def usual_speed(self) -> tuple[float, int]:
        """Speed and units before a mission changes them."""
        return to_float32(min(self.speed, self.fastest)), int(imc.SpeedUnits.METERS_PS)

    @property
    def usual_level(self) -> Level:
        """The level before a mission has one."""
        if not self.flies:
            return Level(to_float32(max(0.0, min(self.z, self.deepest))) if self.dives else 0.0, Units.DEPTH)
        if self.home is None:
            return Level(to_float32(self.z), Units.ALTITUDE)
        return Level(to_float32(self.home.height + self.z), Units.HEIGHT)

    def altitude_above_ground(self, level: Level) -> float:
        """The altitude (m) of an aircraft above home or ground, NaN if unknown."""
        if level.z_units == Units.ALTITUDE:
            return level.z
        known = level.z_units == Units.HEIGHT and self.home is not None
        return level.z - self.home.height if known and self.home is not None else math.nan

    def level(self, frame: int, z: float) -> Level:
        """The level of an item. Raises MissionError."""
        if frame not in POSITIONS:
            raise MissionError(MissionResult.UNSUPPORTED_FRAME, f"frame {frame} has no meaning for a position")
        if math.isnan(z):
            raise _bad_z("altitude is not a number")
        if abs(z) > FARTHEST_UP:
            raise _bad_z(f"altitude {z:g} m is out of range")
        if self.flies:
            return self._aloft(frame, z)
        return self._under_water(frame, z) if self.dives else self._at_surface(frame, z)

    def frame_and_z(self, level: Level) -> tuple[int, float] | None:
        """Frame and z of a level, None if no frame has it."""
        z, units = level
        if not math.isfinite(z) or abs(z) > FARTHEST_UP:
            return None
        if units == Units.ALTITUDE:
            return TERRAIN_INT, to_float32(z)
        if units == Units.DEPTH:
            return RELATIVE_INT, to_float32(0.0 - z)
        if units == Units.HEIGHT and self.home is not None:
            height = self.home.height
            return RELATIVE_INT, shortest_decimal(z - height, lambda up: to_float32(height + up) == to_float32(z))
        return None

    def _aloft(self, frame: int, z: float) -> Level:
        if frame in TERRAIN_FRAMES:
            if z < 0.0:
                raise _bad_z(f"altitude {z:g} m is below the ground")
            above, level = z, Level(to_float32(z), Units.ALTITUDE)
        elif self.home is None:
            raise MissionError(MissionResult.ERROR, "home is not known yet, so altitudes mean nothing")
        else:
            above = z - (self.home.altitude if frame in GLOBAL_FRAMES else 0.0)
            if above < 0.0:
                raise _bad_z(f"altitude {above:g} m above home is below the ground there")
            level = Level(to_float32(self.home.height + above), Units.HEIGHT)
        if abs(level.z) > FARTHEST_UP:
            raise _bad_z(f"height {level.z:g} m above the ellipsoid is out of range")
        if above > self.highest:
            raise _bad_z(f"altitude {above:g} m is above the vehicle's limit of {self.highest:g} m")
        return level

    def _under_water(self, frame: int, z: float) -> Level:
        if frame in TERRAIN_FRAMES:
            if z < 0.0:
                raise _bad_z(f"altitude {z:g} m is below the seabed")
            return Level(to_float32(z), Units.ALTITUDE)
        depth = to_float32(0.0 - z)
        if depth < 0.0:
            raise _bad_z(f"altitude {z:g} m is above the surface; depths are negative altitudes")
        if depth > self.deepest:
            raise _bad_z(f"depth {depth:g} m is below the vehicle's limit of {self.deepest:g} m")
        return Level(depth, Units.DEPTH)

    def _at_surface(self, frame: int, z: float) -> Level:
        """Rovers and boats of ArduPilot ignore altitudes, and consoles send 50 or 100 m by default."""
        if frame in TERRAIN_FRAMES:
            raise MissionError(MissionResult.UNSUPPORTED_FRAME, f"frame {frame}: a boat cannot keep an altitude")
        if z < -WAVES:
            raise _bad_z(f"altitude {z:g} m is below the surface, and a boat stays there")
        return Level(0.0, Units.DEPTH)


def shortest_decimal(value: float, fits: Callable[[float], bool]) -> float:
    """`value` with as few decimals as still fit, so that 20 m comes back as 20 and not as 20.000002."""
    for digits in range(DIGITS):
        short = to_float32(round(value, digits) + 0.0)  # not -0
        if fits(short):
            return short
    return to_float32(value)


def _bad_z(reason: str) -> MissionError:
    return MissionError(MissionResult.INVALID_PARAM7, reason)
