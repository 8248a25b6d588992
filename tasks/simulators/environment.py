"""Simulates what the vehicle's sonars measure: distances to the bottom, the surface and a pier."""

import math
from collections.abc import Mapping
from typing import ClassVar

import imc
from runtime import ParameterError, State, param, periodic
from runtime.task import SharedOption
from support.rotations import Vector
from support.wgs84 import offset
from tasks.simulated_world import adopt_world_options, world_of
from tasks.simulators.true_state_sensor import TrueStateSensorTask
from world import SECTIONS
from world.sea import Bathymetry
from world.sensors import SonarBeam

NEAREST = 0.2  # m, of the echo sounder
DEEP, DEEPEST = 120.0, 11000.0  # m
OLDER = "Older place of [World]"
SLOPE_STEPS = 3


class Environment(TrueStateSensorTask):
    """Publishes Distance of two entities: an altimeter that looks down and an echo sounder that looks ahead.

    The bottom is that of [World]. Both measure along their beams. As in DUNE, the echo sounder detects the bottom with
    the lower edge of its beam, and the surface with its axis.
    """

    reads: ClassVar[Mapping[str, Mapping[str, SharedOption]]] = SECTIONS
    transient: ClassVar[tuple[str, ...]] = ("_bathymetry",)

    execution_frequency: float = param(5.0, "Hz", "Rate of both distances.", minimum=0.1, maximum=100)
    location: str = param("", "", "Name of the place; not used, soundings come from [Bathymetry].")
    tide_level: float = param(0.0, "m", f"{OLDER} Tide Level.", minimum=-20, maximum=20, editable=False)
    out_of_bounds_depth: float = param(
        DEEP,
        "m",
        f"{OLDER} Out Of Bounds Depth.",
        name="Out Of Bounds Depth",
        minimum=0,
        maximum=DEEPEST,
        editable=False,
    )
    sounding_radius: float = param(10.0, "m", f"{OLDER} Sounding Radius.", minimum=0.1, editable=False)

    bottom_label: str = param(
        "Altimeter", "", "Label of the altimeter.", name="Entity Label - Bottom Distance", editable=False
    )
    bottom_noise: float = param(
        0.05, "m", "Standard deviation of the altimeter.", name="Bottom Distance Standard Deviation", minimum=0
    )
    bottom_beam_width: float = param(-1.0, "°", "Beam width of the altimeter; -1 if unknown.", minimum=-1, maximum=180)
    bottom_sonar_position: list[float] = param(
        [0.0, 0.0, 0.0], "m", "Position in the vehicle: forward, starboard and down.", size=3
    )
    bottom_sonar_orientation: list[float] = param(
        [0.0, -90.0, 0.0], "°", "Orientation in the vehicle: roll, pitch and yaw.", size=3
    )

    forward_label: str = param(
        "Echo Sounder", "", "Label of the echo sounder.", name="Entity Label - Forward Distance", editable=False
    )
    forward_noise: float = param(
        0.3, "m", "Standard deviation of the echo sounder.", name="Forward Distance Standard Deviation", minimum=0
    )
    forward_range: float = param(30.0, "m", "Range; reported if nothing is detected.", minimum=NEAREST, maximum=1000)
    forward_beam_width: float = param(10.0, "°", "Beam width of the echo sounder.", minimum=0, maximum=180)
    forward_sonar_position: list[float] = param(
        [1.0, 0.0, 0.0], "m", "Position in the vehicle: forward, starboard and down.", size=3
    )
    forward_sonar_orientation: list[float] = param(
        [0.0, 0.0, 0.0], "°", "Orientation in the vehicle: roll, pitch and yaw.", size=3
    )
    bottom_intersection_method: bool = param(True, "", "Whether the echo sounder detects the bottom.")
    simulate_pier: bool = param(False, "", "Whether there is a pier.")
    pier_points: list[float] = param(
        [], "rad", "Latitude and longitude of both ends of the pier.", size=(0, 4), editable=False
    )

    def configure(self) -> None:
        adopt_world_options(self, "Tide Level", "Out Of Bounds Depth", "Sounding Radius")
        self._bathymetry = world_of(self).seabed or Bathymetry((), self.sounding_radius, DEEP)
        if len(self.pier_points) not in (0, 4) or (self.simulate_pier and not self.pier_points):
            raise ParameterError(
                "Pier Points", f"must be two positions (4 numbers), not {len(self.pier_points)} numbers"
            )
        self._altimeter = self.reserve_entity(self.bottom_label)
        self._echo_sounder = self.reserve_entity(self.forward_label)
        self._bottom = _blank(self.bottom_sonar_position, self.bottom_sonar_orientation, self.bottom_beam_width)
        self._forward = _blank(self.forward_sonar_position, self.forward_sonar_orientation, self.forward_beam_width)

    def start(self) -> None:
        self._origin = (math.nan, math.nan)
        super().start()

    @periodic("execution_frequency")
    def measure_distances(self) -> None:
        bottom_noise, forward_noise = self.random.standard_normal(2).tolist()
        truth = self.true_state()
        if truth is None:
            return
        if self._origin != (truth.lat, truth.lon):
            self._move(truth.lat, truth.lon)
        place = truth.x, truth.y, truth.z
        angles = truth.phi, truth.theta, truth.psi
        altitude = self._look_down(place, angles) + self.bottom_noise * bottom_noise
        ahead = self._look_ahead(place, angles)
        if ahead < self.forward_range:
            ahead += self.forward_noise * forward_noise
        ahead = max(NEAREST, min(self.forward_range, ahead))
        self.publish(self._bottom.replace(value=max(0.0, altitude)), entity=self._altimeter)
        self.publish(self._forward.replace(value=ahead), entity=self._echo_sounder)

    def _depth(self, north: float, east: float) -> float:
        return self._bathymetry.depth(self._north + north, self._east + east)

    def _shallowest_near(self, north: float, east: float) -> float:
        return self._bathymetry.shallowest_near(self._north + north, self._east + east)

    def _look_down(self, place: Vector, angles: Vector) -> float:
        beam = _beam(place, angles, self.bottom_sonar_position, self.bottom_sonar_orientation, 0.0)
        below = self._depth(place[0], place[1]) - beam.start[2]
        down = beam.direction[2]
        if down < 0.1 or below <= 0.0:
            return max(0.0, below)
        for _ in range(SLOPE_STEPS):
            north, east = (beam.start[i] + below / down * beam.direction[i] for i in (0, 1))
            below = max(0.0, self._depth(north, east) - beam.start[2])
        return below / down

    def _look_ahead(self, place: Vector, angles: Vector) -> float:
        position, orientation = self.forward_sonar_position, self.forward_sonar_orientation
        axis = _beam(place, angles, position, orientation, 0.0)
        nearest = axis.distance_to_surface()
        if self.bottom_intersection_method:
            sea = self._bathymetry
            edge = _beam(place, angles, position, orientation, -0.5 * math.radians(self.forward_beam_width))
            extent = sea.shallowest, sea.deepest, sea.sampling_step
            nearest = min(
                nearest, edge.distance_to_bottom(self._depth, self.forward_range, *extent, self._shallowest_near)
            )
        if self.simulate_pier:
            nearest = min(nearest, axis.distance_to_wall(*self._pier))
        return nearest

    def _move(self, lat: float, lon: float) -> None:
        self._origin = lat, lon
        self._north, self._east = offset(*self._bathymetry.reference, lat, lon)
        if self.pier_points:
            a, b, c, d = self.pier_points
            self._pier = offset(lat, lon, a, b), offset(lat, lon, c, d)

    def report_state(self, state: State, description: str) -> None:
        for entity in (self.entity, self._altimeter, self._echo_sounder):
            self.set_entity_state(state, description, entity=entity)


def _blank(position: list[float], orientation: list[float], width: float) -> imc.Distance:
    x, y, z = position
    phi, theta, psi = map(math.radians, orientation)
    beam = imc.BeamConfig(beam_width=math.radians(width), beam_height=math.radians(width))
    location = imc.DeviceState(x=x, y=y, z=z, phi=phi, theta=theta, psi=psi)
    return imc.Distance(validity=imc.Distance.Validity.VALID, location=(location,), beam_config=(beam,))


def _beam(place: Vector, angles: Vector, position: list[float], orientation: list[float], tilt: float) -> SonarBeam:
    x, y, z = position
    return SonarBeam.from_vehicle(
        place, angles, (x, y, z), math.radians(orientation[2]), math.radians(orientation[1]) + tilt
    )
