"""The simulated world that the tasks of a vehicle share, and where a vehicle is in it."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import imc
from imc.coordinates import NOWHERE, LocalOrigin
from runtime import ParameterError, Task
from support.pose import Pose
from support.rotations import Vector
from support.wgs84 import offset
from world import ObjectPosition, World, WorldError, read_world
from world.sensors import BodyMotion

FARTHEST = 1e7  # m; m/s, rad, rad/s: beyond it, a number is no place of a vehicle, and no motion
FARTHEST_MOUNT = 1000.0  # m forward, right or down of the vehicle, either way: beyond it, a device is not on it
INVALID_TRUTH = "SimulatedState makes no sense"


def world_of(task: Task) -> World:
    """The world that the profile describes, in [World]; the same for all tasks of a vehicle. Raises ParameterError."""
    try:
        return task.vehicle.effective_config.shared_object(_read)
    except WorldError as error:
        raise ParameterError("World", str(error)) from None


def validate_legacy_options(task: Task, *options: str) -> None:
    """Refuse values of older options of a task that its world cannot have. Raises ParameterError.

    When a value changes while the vehicle runs, the world is read again, so that all tasks see the change.
    """
    profile, changed = task.vehicle.profile, dict[str, str]()
    for parameter in (task.parameters()[option] for option in options):
        text, before = task.parameter_set.text(parameter), profile.value(task.name, parameter.name)
        if (before or text != parameter.format(parameter.default)) and "/" in task.name:
            raise ParameterError(parameter.name, "there is one world for all cameras: set its gliders in [World]")
        if text != (before or parameter.format(parameter.default)):
            changed[parameter.name] = text

    def value(section: str, option: str) -> str:
        own = changed.get(option) if section == task.name else None
        return profile.value(section, option) if own is None else own

    try:
        if changed:
            _read(value)
    except WorldError as error:
        raise ParameterError(next(iter(changed)), str(error)) from None


def _read(value: Callable[[str, str], str]) -> World:
    return read_world(value, offset)


def mount_pose(position: Sequence[float], orientation: Sequence[float] = ()) -> Pose:
    """Where a device is in its vehicle, by its options Device Position (m) and Device Orientation (°).

    Each has three numbers, or none. Raises ParameterError.
    """
    for name, value in (("Device Position", position), ("Device Orientation", orientation)):
        if len(value) not in (0, 3):
            raise ParameterError(name, f"{len(value)} numbers instead of three")
    x, y, z = position or (0.0, 0.0, 0.0)
    roll, pitch, yaw = map(math.radians, orientation or (0.0, 0.0, 0.0))
    return Pose(x, y, z, roll, pitch, yaw)


def has_valid_pose(state: imc.EstimatedState | imc.SimulatedState) -> bool:
    """Whether position and attitude are numbers that a vehicle on Earth can have."""
    on_earth = abs(state.lat) <= 0.5 * math.pi and abs(state.lon) <= math.tau
    return on_earth and math.hypot(state.x, state.y, state.z, state.phi, state.theta, state.psi) < FARTHEST


def is_valid_truth(truth: imc.SimulatedState) -> bool:
    """Whether position, attitude and motion are numbers that a vehicle on Earth can have."""
    motion = truth.u, truth.v, truth.w, truth.p, truth.q, truth.r, truth.svx, truth.svy, truth.svz
    return has_valid_pose(truth) and math.hypot(truth.height, *motion) < FARTHEST


class WorldPose(NamedTuple):
    """A vehicle in the world: m north and east of its origin, m below the surface, Euler angles in rad."""

    north: float
    east: float
    down: float
    angles: Vector

    def offset_to(self, spot: ObjectPosition) -> tuple[float, float]:
        """North and east (m) from the vehicle to an object."""
        return spot.north - self.north, spot.east - self.east


class WorldFrame:
    """Turns positions of states into places in the world: m from its origin (rad), or from the first state of all."""

    def __init__(self, origin: tuple[float, float] | None):
        self._origin = origin
        self._start = LocalOrigin()
        self._reference, self._offset = NOWHERE, (0.0, 0.0)

    def position(self, state: imc.EstimatedState | imc.SimulatedState) -> tuple[float, float]:
        """North and east (m) of the world's origin; the position of the state must be finite."""
        if self._origin is None:
            self._start.update(state)
            return state.x - self._start.north, state.y - self._start.east
        if (state.lat, state.lon) != self._reference:
            self._reference = state.lat, state.lon
            self._offset = (0.0, 0.0) if self._reference == NOWHERE else offset(*self._origin, *self._reference)
        return self._offset[0] + state.x, self._offset[1] + state.y


class TrueState:
    """Follows SimulatedState, and carries it on by its velocities and rates to a moment.

    `fault` is what is wrong with the newest one.
    """

    fault = ""

    def __init__(self, origin: tuple[float, float] | None):
        self._chart = WorldFrame(origin)
        self._state: imc.SimulatedState | None = None
        self._place = (0.0, 0.0)

    def update(self, state: imc.SimulatedState) -> None:
        """Take the next state; one that makes no sense is passed over."""
        self.fault = "" if is_valid_truth(state) else INVALID_TRUTH
        if not self.fault:
            self._state, self._place = state, self._chart.position(state)

    def pose_at(self, now: float, oldest: float) -> WorldPose | None:
        """Where the vehicle is at `now` (s since 1970); None without a state of the last `oldest` s."""
        state = self._state
        if state is None or abs(now - state.timestamp) > oldest:  # also of a clock that was set back
            return None
        (north, east, down), angles = BodyMotion.from_state(state).predict_displacement_and_angles(
            now - state.timestamp
        )
        return WorldPose(self._place[0] + north, self._place[1] + east, state.z + down, angles)
