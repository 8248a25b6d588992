"""Judges the detections of a log by the truth: the gliders of its world, and where the vehicle really was."""

import math
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import imc
from imc.coordinates import NOWHERE
from runtime.kernel import VirtualClock
from runtime.logs import Array, LogSummary
from runtime.profile import Profile, default_label, load_profile
from runtime.task import ParameterError, Task
from shoal.logs.inspect.chart_reference import read_chart_reference
from support.diagnostics import ProfileError
from support.rotations import rotation
from support.wgs84 import offset
from world import World, WorldError, WorldObject, read_world
from world.detection import (
    DetectionAccuracy,
    DetectionStatistics,
    PoseOverPlane,
    detection_statistics,
    match_objects,
    project_to_plane,
)
from world.optics import project_by_row, row_time

SIMULATED, DETECTOR = "Simulators.MUGDetectionCamera", "Vision.MUGDetector"
CAMERAS = (SIMULATED, "Vision.FisheyeCamera", "Vision.Camera")
MOST_LOOKS = 20000
MOST_SPREADS = 3000
LONGEST = 30 * 86400.0  # s of a run
SAME = 1e-4  # s by which a time may be rounded
NO_DELIVERIES: Array = np.empty((0, 2))


class DetectionScore(NamedTuple):
    """Detections of an entity, and the numbers of the gliders that its score has, in their order."""

    label: str
    gliders: tuple[int, ...]
    score: DetectionStatistics


class _Camera(NamedTuple):
    """A camera: its model, where it is (4, 4) for what is below and above it, and what its errors are.

    `blur` is a further error per height; the accuracy is None where it is not published. What is seen on fewer pixels
    than `least` is not expected to be found. What is detected before `shared`, s since 1970, is of a picture before
    the log. `sea`: gliders without a depth lie on the surface. `readout` (s) passes over all rows of a rolling shutter.
    `deliveries` (n, 2) has when frames were shared, and when they were exposed; after `latency` (s) of a virtual clock,
    the detector publishes.
    """

    optics: Any
    mounts: tuple[Array, Array]
    looks: Array
    accuracy: DetectionAccuracy | None
    blur: float = 0.0
    least: float = 0.0
    shared: float = -math.inf
    sea: bool = False
    readout: float = 0.0
    deliveries: Array = NO_DELIVERIES
    latency: float = 0.0

    def exposures(self, times: Array) -> Array:
        """(n,) when the pictures were taken of which detections were published at `times`; those without frames."""
        shared, exposed = self.deliveries[:, 0], self.deliveries[:, 1]
        if not len(shared):
            return times
        newest, exact = (np.searchsorted(shared, times + late, "right") - 1 for late in (SAME, SAME - self.latency))
        of = np.where((exact >= 0) & (times - self.latency - shared[exact] < 2.0 * SAME), exact, newest)
        return np.where(of >= 0, exposed[of], times)


class _Truth(NamedTuple):
    """Arrays of a vehicle's true motion: time (s since 1970), places (n, 3) in the world, angles (n, 3), unwrapped.

    `ground` (n,) is the vehicle's estimate of the ground below it (m, down); NaN if unknown.
    """

    time: Array
    places: Array
    angles: Array
    ground: Array

    def at(self, times: Array) -> tuple[Array, Array]:
        return self._column(self.places, times), self._column(self.angles, times)

    def _column(self, rows: Array, times: Array) -> Array:
        return np.stack([np.interp(times, self.time, row) for row in (rows[:, 0], rows[:, 1], rows[:, 2])], axis=-1)


class DetectionScoreError(ValueError):
    """The detections of a log cannot be compared with its truth; the text is the reason."""


def score_detections(log: imc.Log, summary: LogSummary, labels: Callable[[int], str]) -> list[DetectionScore]:
    """Judge all entities that detect gliders; none of a log without truth or configuration.

    Raises DetectionScoreError if the configuration cannot be used, as without the chart that it names.

    `labels` returns the label of an entity. Of the configuration, which may come from others, only Shoal's own
    cameras are made, and nothing runs.
    """
    path = log.path.parent / "Config.ini"
    wanted = {"EstimatedMugState", "SimulatedState"}
    if not path.is_file() or not wanted <= {name for name, tally in summary.by_type.items() if tally.count}:
        return []
    try:
        profile = load_profile(path)
        world = read_world(profile.value, offset, profile.find_file)
        truth = _truth(log, summary, world)
        eyes = _eyes(log, profile, summary, labels)
    except (ProfileError, WorldError, ParameterError, ValueError, OSError, KeyError) as error:
        chart = read_chart_reference(path.parent)
        if chart is not None and not chart.is_found:
            raise DetectionScoreError(f"the chart {chart.describe()}") from None
        # Of a log that is no run of Shoal, or of another version.
        reason = next(iter(str(error).splitlines()), type(error).__name__)
        raise DetectionScoreError(f"{path.name} of the log cannot be used: {reason}") from None
    if truth is None or not world.objects:
        return []
    began = profile.start_time if 0.0 <= summary.start - profile.start_time <= LONGEST else summary.start
    rows = log.array("EstimatedMugState", src=summary.owner)
    rows = rows[(rows["timestamp"] >= truth.time[0]) & (rows["timestamp"] <= truth.time[-1])]
    rows = rows[np.isfinite(rows["x"] + rows["y"]) & (np.abs(rows["x"]) + np.abs(rows["y"]) < 1e6)]
    found: list[DetectionScore] = []
    for entity in np.unique(rows["src_ent"]).tolist():
        label = labels(entity)
        mine = rows[rows["src_ent"] == entity]
        found.append(_judged(label, mine[np.argsort(mine["timestamp"], kind="stable")], truth, world, began, eyes))
    return found


def _judged(
    label: str, rows: Array, truth: _Truth, world: World, began: float, eyes: Mapping[str, Sequence[_Camera]]
) -> DetectionScore:
    looking = eyes.get(label, ())
    rows = rows[rows["timestamp"] >= min((eye.shared for eye in looking), default=-math.inf)]
    offsets = np.stack([rows["x"], rows["y"]], axis=-1).astype(np.float64)
    to = _gliders(world, world.objects, truth, rows["timestamp"], began, sea=any(eye.sea for eye in looking[:1]))
    spreads = np.full((len(rows), 2, 2), np.nan)
    of = match_objects(offsets, to[..., :2])
    for eye in looking[:1]:
        times = eye.exposures(rows["timestamp"])
        every = np.arange(len(rows)) % max(1, math.ceil(len(rows) / MOST_SPREADS)) == 0
        for number, thing in enumerate(world.objects):
            mine = np.flatnonzero(every & (of == number))
            spreads[mine] = _spreads(eye, truth, world, thing, times[mine], began)
    shown = [_shown(eye, truth, world, began) for eye in looking if len(eye.looks)]
    seen = np.concatenate(shown) if shown else None
    found = detection_statistics(rows["id"], offsets, to[..., :2], spreads, seen)
    return DetectionScore(label, tuple(thing.id for thing in world.objects), found)


def _gliders(
    world: World, things: Sequence[WorldObject], truth: _Truth, times: Array, began: float, *, sea: bool
) -> Array:
    """(n, k, 3) from the vehicle to objects, in m; down is NaN on an unknown bottom."""
    spots = [[world.object_position(thing, time) for thing in things] for time in (times - began).tolist()]
    on_bottom = np.array([thing.depth is None for thing in things])
    places = np.array(
        [[(s.north, s.east, math.nan if s.down is None else s.down) for s in row] for row in spots], float
    )
    places = places.reshape(len(times), len(things), 3)
    if sea:
        places[:, on_bottom, 2] = 0.0
    elif world.seabed is None:
        places[:, on_bottom, 2] = np.interp(times, truth.time, truth.ground)[:, None]
    return places - truth.at(times)[0][:, None]


def _shown(eye: _Camera, truth: _Truth, world: World, began: float) -> Array:
    """(m, k): which look showed which object."""
    times = eye.looks[(eye.looks >= truth.time[0]) & (eye.looks <= truth.time[-1])]
    shown = [_shown_thing(eye, truth, world, thing, times, began) for thing in world.objects]
    return np.stack(shown, axis=-1)


def _shown_thing(eye: _Camera, truth: _Truth, world: World, thing: WorldObject, times: Array, began: float) -> Array:
    """(m,): which look showed an object."""
    points_at = _moving_points(eye, truth, world, thing, times, began)
    _, inside = project_by_row(eye.optics, eye.readout, points_at, times.shape)
    distances = np.sum(points_at(np.zeros(times.shape)) ** 2, axis=-1)
    return inside & (thing.length * thing.diameter * eye.optics.fx * eye.optics.fy / distances >= eye.least)


def _moving_points(
    eye: _Camera, truth: _Truth, world: World, thing: WorldObject, times: Array, began: float
) -> Callable[[Array], Array]:
    """A function from s after `times` (m,) to places (m, 3) of an object in the optical frame."""

    def points_at(offsets: Array) -> Array:
        _, angles = truth.at(times + offsets)
        to = _gliders(world, (thing,), truth, times + offsets, began, sea=eye.sea)[:, 0]
        turns = np.array([rotation(*row) for row in angles.tolist()], float).reshape(-1, 3, 3)
        body = np.einsum("nji,nj->ni", turns, to)
        below, above = ((body - mount[:3, 3]) @ mount[:3, :3] for mount in eye.mounts)
        points = below.copy()
        points[to[:, 2] <= 0.0] = above[to[:, 2] <= 0.0]
        return points

    return points_at


def _spreads(eye: _Camera, truth: _Truth, world: World, thing: WorldObject, times: Array, began: float) -> Array:
    """(m, 2, 2) of detections in pictures of `times`, from where each row was exposed, by the errors of the camera."""
    found = np.full((len(times), 2, 2), np.nan)
    if eye.accuracy is None or not len(times):
        return found
    points_at = _moving_points(eye, truth, world, thing, times, began)
    pixels, _ = project_by_row(eye.optics, eye.readout, points_at, times.shape)
    exposed = times + row_time(eye.readout, pixels[:, 1], eye.optics.height) if eye.readout else times
    offsets = _gliders(world, (thing,), truth, exposed, began, sea=eye.sea)[:, 0]
    for k, (down, angles) in enumerate(zip(offsets[:, 2].tolist(), truth.at(exposed)[1].tolist(), strict=True)):
        standing = PoseOverPlane(0.0, 0.0, down, tuple(angles))
        (seen,) = project_to_plane(eye.optics, eye.mounts[int(down <= 0.0)], standing, pixels[k], eye.accuracy)
        if seen is not None:
            of_pose = eye.accuracy.pose_error_variances(abs(down))
            found[k] = seen.covariance(of_pose) + (eye.blur * down) ** 2 * np.eye(2)
    return found


def _truth(log: imc.Log, summary: LogSummary, world: World) -> _Truth | None:
    rows = log.array("SimulatedState", src=summary.owner)
    rows = rows[np.argsort(rows["timestamp"], kind="stable")]
    table = np.stack([rows[name].astype(np.float64) for name in ("x", "y", "z", "phi", "theta", "psi")], axis=-1)
    good = np.isfinite(table).all(axis=1)
    rows, table = rows[good], table[good]
    if len(rows) < 2:
        return None
    origin = world.origin
    for lat, lon in np.unique(np.stack([rows["lat"], rows["lon"]], axis=-1), axis=0).tolist():
        if origin is not None and (lat, lon) != NOWHERE:
            table[(rows["lat"] == lat) & (rows["lon"] == lon), :2] += offset(*origin, lat, lon)
    if origin is None:
        table[:, :2] -= table[0, :2]
    ground = _ground(log, summary, rows["timestamp"])
    return _Truth(rows["timestamp"], table[:, :3], np.unwrap(table[:, 3:], axis=0), ground)


def _ground(log: imc.Log, summary: LogSummary, times: Array) -> Array:
    """(n,) the vehicle's estimate of the ground below it (m, down); NaN without altitudes."""
    rows = log.array("EstimatedState", src=summary.owner)
    down = rows["z"].astype(np.float64) + rows["alt"]
    good = np.isfinite(down) & (rows["alt"] > 0.0)
    rows, down = rows[good], down[good]
    order = np.argsort(rows["timestamp"], kind="stable")
    return np.interp(times, rows["timestamp"][order], down[order]) if len(rows) else np.full(len(times), np.nan)


def _eyes(
    log: imc.Log, profile: Profile, summary: LogSummary, labels: Callable[[int], str]
) -> dict[str, Sequence[_Camera]]:
    """The cameras behind the entities that detect gliders, by label."""
    from runtime.vehicle import build  # slow to import, as tasks are
    from tasks.simulators.mug_detection_camera import MUGDetectionCamera
    from tasks.vision.cameras.rendered_camera import RenderedCameraTask
    from tasks.vision.mug_detector import MUGDetector, accuracy_from_parameters
    from world.rendering import optical_to_body_transform

    sections = list(profile.config.sections)
    only = [name for name in sections if name.partition("/")[0] in CAMERAS]
    with tempfile.TemporaryDirectory() as folder:
        clock = VirtualClock(profile.start_time_ns)
        root = Path(folder)
        vehicle = build(profile, clock=clock, only=only, log_root=root / "log", state_folder=root / "db").vehicle
        tasks: dict[str, Task] = {task.entity.label: task for task in vehicle.tasks}
        vehicle.close()
    frames = log.array("CameraFrame", src=summary.owner) if "CameraFrame" in summary.by_type else None
    found: dict[str, Sequence[_Camera]] = {}
    for label, task in tasks.items():
        if isinstance(task, MUGDetectionCamera):
            rate = task.detection_rate or 20.0
            looks = np.arange(summary.start, summary.end, max(1.0 / rate, (summary.end - summary.start) / MOST_LOOKS))
            exact = task.fidelity == "Physical"
            optics, accuracy, blur = task.camera_and_accuracy()
            found[label] = [_Camera(optics, task.mounts, looks, accuracy if exact else None, blur, task.least_pixels)]
    for section in (name for name in sections if name.partition("/")[0] == DETECTOR):
        options = profile.options(section)
        values = {
            p.attribute: p.parse(options.get(n, "") or p.format(p.default)) for n, p in MUGDetector.parameters().items()
        }
        eyes: list[_Camera] = []
        for label, task in tasks.items():
            if isinstance(task, RenderedCameraTask) and values["camera"] in ("", label):
                looks, deliveries = (np.empty(0), NO_DELIVERIES) if frames is None else _looks(frames, label, labels)
                shared = float(deliveries[0, 0]) if len(deliveries) else -math.inf
                mount = optical_to_body_transform(task.mount)
                least = 2.0 * values["least_pixels"]
                accuracy, sea = accuracy_from_parameters(values), task.scene == "Sea Surface"
                eyes.append(
                    _Camera(
                        *(task.camera.optics, (mount, mount), looks, accuracy, 0.0, least, shared, sea),
                        *(task.row_readout_time, deliveries, values["latency"]),
                    )
                )
        found[options.get("Entity Label", "") or default_label(section)] = eyes
    return found


def _looks(frames: Array, label: str, labels: Callable[[int], str]) -> tuple[Array, Array]:
    """Times of exposure of a camera, not too many, and `_Camera.deliveries`."""
    mine = [entity for entity in np.unique(frames["src_ent"]).tolist() if labels(entity) == label]
    own = frames[np.isin(frames["src_ent"], mine)]
    times = np.sort(own["time"])
    own = own[np.argsort(own["timestamp"], kind="stable")]
    return times[:: max(1, math.ceil(len(times) / MOST_LOOKS))], np.stack([own["timestamp"], own["time"]], axis=-1)
