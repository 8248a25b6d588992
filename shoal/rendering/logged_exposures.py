"""Times and poses of the pictures of a logged run: cameras run on the logged states, without rendering."""

import math
import tempfile
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import imc
from runtime.kernel import VirtualClock, nanoseconds
from runtime.logs import logs_of_run, read_log_run_position
from runtime.vehicle import Vehicle, build
from shoal.logs.export import matches_optics
from shoal.rendering.camera_world_files import apply_camera_file, apply_world_file
from shoal.rendering.logged_frame_times import (
    FrameScheduler,
    LoggedFrame,
    logged_frames,
    logged_optics,
    tick_rates_by_label,
    vehicle_start_time,
)
from shoal.rerun import (
    LoggedRun,
    ResimulationError,
    TimestampResolver,
    find_run_of_log,
    logged_profile,
    summarize_log,
    tick_rates,
)
from tasks.vision.cameras.camera_metadata import CAMERAS_FILE
from tasks.vision.cameras.image_saver import PHOTOS_FOLDER
from tasks.vision.cameras.picture_files import write_picture
from tasks.vision.cameras.rendered_camera import RenderedCameraTask
from world.rendering import Board, Glider, SceneCamera, ScenePose, Shutter

STATE_MESSAGES = (imc.LoggingControl, imc.SimulatedState, imc.EstimatedState)  # what moves a camera and its pictures
CHANGE = imc.SetEntityParameters  # of a camera during the run; those of plans (Push, Pop) do not change cameras
BESIDE = (imc.CameraFrame, imc.Announce, imc.EntityParameters)  # the times of frames, of the start, and of changes
Op = imc.LoggingControl.Op
Offload = Callable[..., None]


class ExposedPicture(NamedTuple):
    """A picture: the label of its camera, when it was exposed (s since 1970 UTC), its file, and how it is rendered.

    The shutter's `take_picture(*shutter_arguments)` makes it, with the camera as it was then, that of `camera_number`
    with this label, and its `labels` name its content: from `standpoints`, one for each band of rows, with gliders
    and boards. With `optics_changed` the run took it with another lens or size.
    """

    camera: str
    time: float
    name: str
    image_format: str
    shutter_arguments: tuple[Any, ...]
    standpoints: tuple[ScenePose, ...]
    gliders: tuple[Glider, ...]
    boards: tuple[Board, ...] = ()
    camera_number: int = 0
    optics_changed: bool = False


class CameraVersion(NamedTuple):
    """A camera and its shutter."""

    camera: SceneCamera
    shutter: Shutter


@dataclass
class LoggedExposures:
    """The pictures of a log in order of time, and what describes their cameras in the folder of pictures.

    cameras: by label, each one as often as its parameters changed. notes: what is odd about the pictures, and why there
    is none of a camera.
    """

    cameras: dict[str, list[CameraVersion]]
    pictures: list[ExposedPicture]
    description: bytes
    notes: list[str]

    def camera_of(self, shot: ExposedPicture) -> CameraVersion:
        """The camera of a picture."""
        return self.cameras[shot.camera][shot.camera_number]


def find_exposures(log: imc.Log, cameras: Path | None = None, world: Path | None = None) -> LoggedExposures:
    """The pictures that the cameras of an ini file, by default the vehicle's own, take in a log.

    They start with the run, whose earlier logs are read as well; the vehicle's own cameras change as they did in it. Of
    a virtual run they are those that the cameras would have taken in it, if each is exposed before or after the states
    of the same instant by its rate. On a wall clock a camera whose label and rate are those of one of the run is
    exposed when that was, others at their rate.
    `world` is an ini file whose options of [World] replace those of the run. Raises ResimulationError, ProfileError,
    OSError.
    """
    run = find_run_of_log(log)
    about = summarize_log(run)
    if about is None:
        raise ResimulationError(f"{log.path}: the log has no messages")
    for kind in STATE_MESSAGES[1:]:
        if not about.counts[kind.ID]:
            why = "cameras look from where a simulated vehicle truly was, and begin with its first position"
            raise ResimulationError(f"{log.path}: the log has no {kind.__name__}: {why}")
    loaded, notes = logged_profile(run.logs[0], about, None)
    loaded.raise_errors()
    virtual = about.begin == loaded.start_time
    start = loaded.start_time_ns if virtual else nanoseconds(about.begin)
    instants = TimestampResolver(start, [rate for _, rate in tick_rates(loaded)], virtual=virtual)
    packets = _read_messages(run, instants, about.owner)
    name = _name(log.schema, packets[imc.LoggingControl.ID])
    taken = {} if virtual else logged_frames(log.schema, packets[imc.CameraFrame.ID])
    rates = tick_rates_by_label(loaded)
    before = len(loaded.file_problems)
    apply_world_file(loaded, world)
    sections = apply_camera_file(loaded, cameras)
    if not sections:
        why = "the vehicle had no camera: describe one in an ini file, and name it with --camera"
        raise ResimulationError(f"{log.path}: {why}")
    notes += map(str, loaded.file_problems[before:])
    for section in sections:
        loaded.override(f"{section}:Save Images=true")
    loaded.override(f"General:Vehicle={loaded.vehicle}")
    if cameras is not None:
        loaded.path = cameras
    with tempfile.TemporaryDirectory() as folder:
        made = build(
            loaded,
            clock=VirtualClock(start),
            keep_going=False,
            log_root=Path(folder) / "log",
            state_folder=Path(folder) / "db",
            only=sections,
        )
        vehicle = made.vehicle
        try:
            for reason, skipped in made.skipped.items():
                raise ResimulationError(f"{', '.join(skipped)}: {reason}")
            recorders = [_ExposureRecorder(task) for task in vehicle.tasks if isinstance(task, RenderedCameraTask)]
            for kind in STATE_MESSAGES if cameras else (CHANGE, *STATE_MESSAGES):
                _LoggedPublisher(vehicle, log.schema, packets[kind.ID], last=kind is imc.LoggingControl).schedule_next()
            if not virtual:
                vehicle.start_time = vehicle_start_time(log.schema, packets[imc.Announce.ID], about.begin)
                for recorder in recorders:
                    label = recorder.task.entity.label
                    frames = taken.get(about.entity_ids.get(label, -1))
                    if frames is not None and recorder.task.frame_rate in rates.get(label, ()):
                        recorder.expose_at(frames)
                    else:
                        notes.append(f"cut, or made on a wall clock: the log does not contain when {label} was exposed")
            vehicle.start()
            # A run ends before the events of its last instant, but a log that another one follows after some of them.
            end = instants.resolve(about.end)
            vehicle.kernel.run(until=end if about.ends_cleanly and not _has_next_log(log) else end + 1)
        finally:
            vehicle.close()
        pictures = vehicle.log_root / vehicle.name / name / PHOTOS_FOLDER
        shots = [shot for recorder in recorders for path, shot in recorder.pictures if path.parent == pictures]
        described = (pictures / CAMERAS_FILE).read_bytes() if (pictures / CAMERAS_FILE).is_file() else b""
    entities = [recorder.task.entity for recorder in recorders]
    blind = [entity for entity in entities if not any(shot.camera == entity.label for shot in shots)]
    notes += [f"no picture of {entity.label}: {entity.description}" for entity in blind]
    shots.sort(key=lambda shot: (shot.time, shot.camera))
    seen = LoggedExposures({each.task.entity.label: each.cameras for each in recorders}, shots, described, notes)
    if cameras is None:
        _compare(seen, about.entity_ids, logged_optics(log.schema, packets[imc.CameraFrame.ID]))
    return seen


def _compare(
    seen: LoggedExposures, entities: Mapping[str, int], optics_by_frame: Mapping[tuple[int, float], tuple[float, ...]]
) -> None:
    """Mark the pictures whose CameraFrame in the log has another lens or size than theirs."""
    for number, shot in enumerate(seen.pictures):
        optics = optics_by_frame.get((entities.get(shot.camera, -1), shot.time))
        if optics is not None and not matches_optics(seen.camera_of(shot).camera.optics, optics):
            seen.pictures[number] = shot._replace(optics_changed=True)
    unlike = Counter(shot.camera for shot in seen.pictures if shot.optics_changed)
    for label, count in sorted(unlike.items()):
        seen.notes.append(f"{count} frames of {label} were taken with another lens or size, which changed unnoticed")


class _ExposureRecorder:
    """Takes down what a camera would compute; in place of a picture it gets an empty one, which takes no memory."""

    def __init__(self, task: RenderedCameraTask):
        self.task = task
        self.pictures: list[tuple[Path, ExposedPicture]] = []
        self.cameras: list[CameraVersion] = []
        self._taken: dict[int, tuple[NDArray[np.uint8], ExposedPicture]] = {}
        self._latency: float | None = None
        self._offload: Offload = task.offload
        task.offload = self.offload

    def expose_at(self, frames: deque[LoggedFrame]) -> None:
        """Expose when these frames were taken, not at the camera's rate."""
        self._frames = {frame.time: frame for frame in frames}
        self._take, self.task.take = self.task.take, self._take_logged
        scheduler = FrameScheduler(self.task.vehicle.kernel, frames, lambda _: self.task.expose())
        self.task.begin_ticking = scheduler.schedule_next

    def _take_logged(self, time: float, state: imc.EstimatedState) -> None:
        frame = self._frames[nanoseconds(time)]
        late = self.task.now - time
        self.task.taken, self._latency = frame.number, max(0.0, frame.latency - late)
        self._take(time, state)

    def offload(self, function: Callable[..., Any], *args: Any, then: Callable[[Any], object], latency: float = 0.0):
        """Replaces Task.offload."""
        task = self.task
        if getattr(function, "__self__", None) is task.shutter:
            time, view = task.exposed
            result = np.broadcast_to(np.zeros(4, np.uint8), (task.camera.optics.height, task.camera.optics.width, 4))
            if not self.cameras or self.cameras[-1].shutter is not task.shutter:
                self.cameras.append(CameraVersion(task.camera, task.shutter))
            rows = tuple(task.path(task.shutter.band_times))
            number = len(self.cameras) - 1
            shot = ExposedPicture(task.entity.label, time, "", "", args, rows, view.gliders, view.boards, number)
            self._taken[id(result)] = result, shot
            latency = latency if self._latency is None else self._latency
        elif function is write_picture:
            path, image, form = args
            _, shot = self._taken.pop(id(image))
            self.pictures.append((path, shot._replace(name=path.name, image_format=form)))
            result = ""
        else:
            result = function(*args)
        self._offload(lambda: result, then=then, latency=latency)


class _LoggedPublisher:
    """Publishes the logged messages of one type, and asks for the next one whenever it has published one.

    That is when the task asked for its next tick that published them; so ticks of cameras at the same instant come
    before or after them as they did in the run. Messages that come `last` follow all that is due at their instant.
    """

    def __init__(self, vehicle: Vehicle, schema: imc.Schema, entries: deque[tuple[int, bytes]], *, last: bool):
        self._vehicle, self._schema, self._entries, self._last = vehicle, schema, entries, last

    def schedule_next(self) -> None:
        kernel = self._vehicle.kernel
        if self._entries and self._last:
            kernel.at(self._entries[0][0], kernel.soon, self._publish)
        elif self._entries:
            kernel.at(self._entries[0][0], self._publish)

    def _publish(self) -> None:
        while self._entries and self._entries[0][0] <= self._vehicle.kernel.now_ns:
            _, packet = self._entries.popleft()
            self._vehicle.bus.deliver_and_send(self._schema.decode(packet), packet, None)
        self.schedule_next()


def _read_messages(run: LoggedRun, instants: TimestampResolver, owner: int) -> Mapping[int, deque[tuple[int, bytes]]]:
    """Times (ns) of the messages of STATE_MESSAGES, CHANGE and BESIDE, and their packets, by message id."""
    found = {kind.ID: deque[tuple[int, bytes]]() for kind in (*STATE_MESSAGES, CHANGE, *BESIDE)}
    # Few packets are of these: the others, known by two bytes in either order, are not looked at.
    numbers = {number.to_bytes(2, order) for number in found for order in ("little", "big")}
    latest, asked = 0, deque[bytes]()
    for _, packet in run.packets():
        if packet[2:4] not in numbers:
            continue
        header = imc.header(packet)
        if header.src == owner and header.id in found and math.isfinite(header.timestamp):
            latest = max(latest, instants.resolve(header.timestamp))
            found[header.id].append((latest, packet))
            while asked and header.id == imc.EntityParameters.ID:
                found[CHANGE.ID].append((latest, asked.popleft()))
        elif header.id == CHANGE.ID:  # by a console, whose clock is another: the vehicle's answer has the time
            asked.append(packet)
    return found


def _has_next_log(log: imc.Log) -> bool:
    """Whether the run continues in another log beside this one."""
    place = read_log_run_position(log.path.parent)
    return place is not None and len(logs_of_run(log.path.parent)) > place.number


def _name(schema: imc.Schema, packets: Iterable[tuple[int, bytes]]) -> str:
    """The name of the last log that LoggingControl names, by which its pictures are kept; empty if none does."""
    name = ""
    for _, packet in packets:
        said = schema.decode(packet)
        name = getattr(said, "name", "") if getattr(said, "op", None) in (Op.STARTED, Op.CURRENT_NAME) else name
    return name
