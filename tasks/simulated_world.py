"""The simulated world that the tasks of a vehicle share, and where a vehicle is in it."""

import math
from collections import deque
from collections.abc import Iterator, Sequence
from math import hypot, tau
from typing import Any, NamedTuple

import imc
from imc.coordinates import NOWHERE, LocalOrigin
from runtime import ConfigWarning, ParameterError, Task, param
from runtime.vehicle import ProfileValues
from support.pose import Pose
from support.rotations import Vector, wrap
from support.wgs84 import offset
from world import (
    ObjectPosition,
    World,
    WorldError,
    has_same_words,
    older_option_text,
    older_places,
    read_world,
    world_option_name,
)
from world.sensors import BodyMotion

FARTHEST = 1e7  # m; m/s, rad, rad/s: beyond it, a number is no place of a vehicle, and no motion
MOST_LATITUDE = 0.5 * math.pi
FARTHEST_MOUNT = 1000.0  # m forward, right or down of the vehicle, either way: beyond it, a device is not on it
FARTHEST_CORRECTION, LARGEST_CORRECTION = 1.0, 0.2  # m, rad; a state farther from its forecast is of another motion
INVALID_TRUTH = "SimulatedState makes no sense"


def world_of(task: Task) -> World:
    """The world that the profile describes, in [World]; the same for all tasks of a vehicle. Raises ParameterError."""
    try:
        return task.vehicle.effective_config.shared_object(_read)
    except WorldError as error:
        raise ParameterError("World", str(error)) from None


def adopt_world_options(task: Task, *options: str) -> None:
    """Give older options of a task that the profile does not set the values of its world. Raises ParameterError.

    Invalid values of the world are rejected. When a value changes while the vehicle runs, the world is read again,
    so that all tasks see the change, and other tasks with the option report the new value, too.
    """
    profile, section, changed = task.vehicle.profile, task.name.partition("/")[0], dict[str, str]()
    for parameter in (task.parameters()[option] for option in options):
        default, text = parameter.format(parameter.default), task.parameter_set.text(parameter)
        own = profile.value(task.name, parameter.name)
        before = task.vehicle.effective_config.text_before(task, parameter.name)
        try:
            world = older_option_text(profile.value, section, parameter.name)
            if before is None and text == default and not own:
                task.parameter_set.set(parameter, parameter.parse(world))
            elif section != task.name and not has_same_words(text, world):
                raise WorldError(
                    f"there is one world for all tasks: set its {world_option_name(section, parameter.name)} in [World]"
                )
        except ValueError as error:
            raise ParameterError(parameter.name, str(error)) from None
        if not has_same_words(text, before or own or default):
            changed[parameter.name] = text

    def value(section: str, option: str) -> str:
        own = changed.get(option) if section == task.name else None
        return profile.value(section, option) if own is None else own

    try:
        if changed:
            read_world(value, offset, profile.find_file)
            task.after(0.0, _update_other_tasks, task, tuple(changed))  # by then the values are accepted, or restored
    except WorldError as error:
        raise ParameterError(next(iter(changed)), str(error)) from None


def _update_other_tasks(changed: Task, options: Sequence[str]) -> None:
    """Give the options of other tasks that stand for the same of the world the text that one task has changed."""
    vehicle = changed.vehicle
    for option in options:
        places = set(older_places(changed.name.partition("/")[0], option))
        for task in vehicle.tasks:
            section = task.name.partition("/")[0]
            if task is changed or (section, option) not in places:
                continue
            parameter = task.parameters()[option]
            try:
                text = older_option_text(vehicle.profile.value, section, option)
            except WorldError:
                continue  # a contradiction, which the next change of the options reports
            if not has_same_words(task.parameter_set.text(parameter), text):
                task.parameter_set.set(parameter, parameter.parse(text))
                vehicle.effective_config.adopt(task, option)


def _read(profile: ProfileValues) -> World:
    return read_world(profile.value, offset, profile.find_file)


def chart_warnings(task: Task) -> Iterator[ConfigWarning]:
    """The part of the window of a chart in which no depth is known."""
    world = world_of(task)
    if world.chart is not None and world.seabed is not None and (gaps := world.chart.describe_gaps(world.seabed)):
        yield ConfigWarning("Data", gaps, "", "Bathymetry")


def log_chart(task: Task) -> None:
    """Log from which chart the bottom is."""
    if (chart := world_of(task).chart) is not None:
        task.log.info(chart.describe())
        for warning in chart_warnings(task):
            task.log.warning(warning.text)


def log_unknown_depth(task: Task, north: float, east: float, before: bool) -> bool:
    """Whether the chart has no depth at a place (m); logs it when that differs from `before`."""
    world = world_of(task)
    if world.chart is None or world.seabed is None:
        return False
    unknown = not world.seabed.is_known(north, east)
    if unknown and not before:
        depth = world.seabed.default_depth
        task.log.warning(f"{world.chart.name} has no depth here: the bottom is at Out Of Bounds Depth, {depth:g} m")
    elif before and not unknown:
        task.log.info(f"{world.chart.name} has depths here")
    return unknown


def position_param(description: str, default: Sequence[float] = ()) -> Any:
    """A parameter for a place in the vehicle (m); without a default it may be empty."""
    size = 3 if default else (0, 3)
    return param(list(default), "m", description, size=size, minimum=-FARTHEST_MOUNT, maximum=FARTHEST_MOUNT)


def mount_pose(position: Sequence[float], orientation: Sequence[float] = ()) -> Pose:
    """The pose of a device in its vehicle, by its options Device Position (m) and Device Orientation (°).

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
    on_earth = abs(state.lat) <= MOST_LATITUDE and abs(state.lon) <= math.tau
    return on_earth and math.hypot(state.x, state.y, state.z, state.phi, state.theta, state.psi) < FARTHEST


def is_valid_truth(truth: imc.SimulatedState) -> bool:
    """Whether position, attitude and motion are numbers that a vehicle on Earth can have."""
    t = truth
    size = hypot(
        t.x, t.y, t.z, t.phi, t.theta, t.psi, t.height, t.u, t.v, t.w, t.p, t.q, t.r, t.svx, t.svy, t.svz
    )  # all by name: a list of them costs twice as much
    return size < FARTHEST and -MOST_LATITUDE <= t.lat <= MOST_LATITUDE and -tau <= t.lon <= tau


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
    """Follows SimulatedState: where a vehicle is at a moment between two states, or is carried on to after the last.

    `fault` is what is wrong with the newest one. States are remembered for `duration` (s).
    """

    fault = ""

    def __init__(self, origin: tuple[float, float] | None, duration: float = 0.0):
        self.duration = duration
        self._chart = WorldFrame(origin)
        # With north and east (m). Most states are replaced before anybody asks for a pose, so each is kept as it came.
        self._states: deque[tuple[imc.SimulatedState, tuple[float, float]]] = deque()

    def update(self, state: imc.SimulatedState) -> None:
        """Take the next state; one that makes no sense is passed over. After a jump back, it is the first."""
        self.fault: str = "" if is_valid_truth(state) else INVALID_TRUTH
        if self.fault:
            return
        states, time = self._states, state.timestamp
        if states and time < states[-1][0].timestamp:
            states.clear()
        states.append((state, self._chart.position(state)))
        while time - states[0][0].timestamp > self.duration:
            states.popleft()

    @property
    def latest_time(self) -> float:
        """Time at which the newest state was true (s since 1970); -infinity without any."""
        return self._states[-1][0].timestamp if self._states else -math.inf

    def pose_at(self, time: float, oldest: float) -> WorldPose | None:
        """The place of the vehicle at a time (s since 1970); None without a state of `oldest` s around it.

        A state before that is older, as after a stall of the process, does not count beside the one after.
        """
        if not self._states:
            return None
        following: tuple[imc.SimulatedState, tuple[float, float]] | None = None
        for before in reversed(self._states):
            if before[0].timestamp <= time:
                break
            following = before
        else:
            before, following = self._states[0], None
        if following is not None and time - before[0].timestamp > oldest:
            before, following = following, None
        since = time - before[0].timestamp
        if abs(since) > oldest:  # also of a clock that was set back
            return None
        motion, place = BodyMotion.from_state(before[0]), _world_pose(*before)
        carried = _carried(motion, place, since)
        if following is None:
            return carried
        period = following[0].timestamp - motion.time
        return _corrected(carried, _carried(motion, place, period), _world_pose(*following), (since / period) ** 2)


def _world_pose(state: imc.SimulatedState, place: tuple[float, float]) -> WorldPose:
    return WorldPose(*place, state.z, (state.phi, state.theta, state.psi))


def _carried(motion: BodyMotion, place: WorldPose, seconds: float) -> WorldPose:
    """Carry a state on by its velocities and rates."""
    (north, east, down), angles = motion.predict_displacement_and_angles(seconds)
    return WorldPose(place.north + north, place.east + east, place.down + down, angles)


def _corrected(carried: WorldPose, forecast: WorldPose, found: WorldPose, share: float) -> WorldPose:
    """A pose with a share of the error of a forecast of the next state, unless that is a jump, or beyond the zenith."""
    wrong = [b - a for a, b in zip(forecast[:3], found[:3], strict=True)]
    turned = [wrap(b - a) for a, b in zip(forecast.angles, found.angles, strict=True)]
    if math.hypot(*wrong) > FARTHEST_CORRECTION or math.hypot(*turned) > LARGEST_CORRECTION:
        return carried
    north, east, down = (a + share * b for a, b in zip(carried[:3], wrong, strict=True))
    phi, theta, psi = (a + share * b for a, b in zip(carried.angles, turned, strict=True))
    return WorldPose(north, east, down, (phi, theta, psi))
