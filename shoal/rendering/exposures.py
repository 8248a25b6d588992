"""Which pictures cameras take in a logged run, and from where: cameras run on the logged states, and render none."""

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
from runtime.logs import logs_of_run, run_position
from runtime.vehicle import Vehicle, build
from shoal.logs.export import is_like
from shoal.rendering.cameras import take_cameras, take_world
from shoal.rendering.frames import FrameTimes, Taken, frame_rates, logged_frames, logged_optics, start_time
from shoal.rerun import Instants, LoggedRun, ResimulationError, outline, profile_of, run_of, tick_rates
from tasks.simulated_world import world_of
from tasks.vision.cameras.camera_records import FILE
from tasks.vision.cameras.image_saver import FOLDER
from tasks.vision.cameras.image_writer import write_picture
from tasks.vision.cameras.rendered_camera import RenderedCamera
from tasks.vision.cameras.viewpoint import View
from world.rendering import Board, Camera, Glider, Shutter, Standpoint

TOLD = (imc.LoggingControl, imc.SimulatedState, imc.EstimatedState)  # all that moves a camera, and its pictures
CHANGE = imc.SetEntityParameters  # of a camera during the run; those of plans (Push, Pop) do not change cameras
BESIDE = (imc.CameraFrame, imc.Announce, imc.EntityParameters)  # the times of frames, of the start, and of changes
Op = imc.LoggingControl.Op
Offload = Callable[..., None]


class Shot(NamedTuple):
    """A picture: the label of its camera, when it was exposed (s since 1970 UTC), its file, and how it is rendered.

    The shutter's `picture(*given)` makes it, with the camera as it was then, the one of number `eye` with that label.
    At its instant, the vehicle was at a standpoint among gliders and boards. The run took an `unlike` picture with
    another lens or size.
    """

    camera: str
    time: float
    name: str
    form: str
    given: tuple[Any, ...]
    standpoint: Standpoint
    gliders: tuple[Glider, ...]
    boards: tuple[Board, ...] = ()
    eye: int = 0
    unlike: bool = False


class Eye(NamedTuple):
    """A camera and its shutter."""

    camera: Camera
    shutter: Shutter


@dataclass
class Exposures:
    """The pictures of a log in order of time, and what describes their cameras in the folder of pictures.

    eyes: the cameras by label, each one as often as its parameters changed. notes: what is odd about the pictures, and
    why there is none of a camera.
    """

    eyes: dict[str, list[Eye]]
    shots: list[Shot]
    description: bytes
    notes: list[str]

    def eye(self, shot: Shot) -> Eye:
        """The camera of a picture."""
        return self.eyes[shot.camera][shot.eye]


def expose(log: imc.Log, cameras: Path | None = None, world: Path | None = None) -> Exposures:
    """The pictures that the cameras of an ini file, by default the vehicle's own, take in a log.

    They start with the run, whose earlier logs are read as well; the vehicle's own cameras change as they did in it. Of
    a virtual run they are those that the cameras would have taken in it, if each is exposed before or after the states
    of the same instant as its rate says. On a wall clock a camera whose label and rate are those of one of the run is
    exposed when that was, others at their rate.
    `world` is an ini file whose options of [World] replace those of the run. Raises ResimulationError, ProfileError,
    OSError.
    """
    run = run_of(log)
    about = outline(run)
    if about is None:
        raise ResimulationError(f"{log.path}: the log has no messages")
    for kind in TOLD[1:]:
        if not about.counts[kind.ID]:
            why = "cameras look from where a simulated vehicle truly was, and begin when it knows where it is"
            raise ResimulationError(f"{log.path}: the log has no {kind.__name__}: {why}")
    loaded, notes = profile_of(run.logs[0], about, None)
    loaded.raise_errors()
    virtual = about.begin == loaded.start_time
    start = loaded.start_time_ns if virtual else nanoseconds(about.begin)
    instants = Instants(start, [rate for _, rate in tick_rates(loaded)], virtual=virtual)
    told = _told(run, instants, about.owner)
    name = _name(log.schema, told[imc.LoggingControl.ID])
    taken = {} if virtual else logged_frames(log.schema, told[imc.CameraFrame.ID])
    rates = frame_rates(loaded)
    before = len(loaded.problems)
    take_world(loaded, world)
    sections = take_cameras(loaded, cameras)
    if not sections:
        why = "the vehicle had no camera: describe one in an ini file, and name it with --camera"
        raise ResimulationError(f"{log.path}: {why}")
    notes += map(str, loaded.problems[before:])
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
            recorders = [_Recorder(task) for task in vehicle.tasks if isinstance(task, RenderedCamera)]
            for kind in TOLD if cameras else (CHANGE, *TOLD):
                _Chain(vehicle, log.schema, told[kind.ID], last=kind is imc.LoggingControl).ask()
            if not virtual:
                vehicle.start_time = start_time(log.schema, told[imc.Announce.ID], about.begin)
                for recorder in recorders:
                    label = recorder.task.entity.label
                    frames = taken.get(about.labels.get(label, -1))
                    if frames is not None and recorder.task.frame_rate in rates.get(label, ()):
                        recorder.follow(frames)
                    else:
                        notes.append(f"cut, or made on a wall clock: the log does not tell when {label} was exposed")
            vehicle.start()
            # A run ends before the events of its last instant, but a log that another one follows after some of them.
            end = instants.of(about.end)
            vehicle.kernel.run(until=end if about.closed and not _goes_on(log) else end + 1)
        finally:
            vehicle.close()
        pictures = vehicle.log_root / vehicle.name / name / FOLDER
        shots = [shot for recorder in recorders for path, shot in recorder.shots if path.parent == pictures]
        described = (pictures / FILE).read_bytes() if (pictures / FILE).is_file() else b""
    entities = [recorder.task.entity for recorder in recorders]
    blind = [entity for entity in entities if not any(shot.camera == entity.label for shot in shots)]
    notes += [f"no picture of {entity.label}: {entity.description}" for entity in blind]
    shots.sort(key=lambda shot: (shot.time, shot.camera))
    seen = Exposures({each.task.entity.label: each.eyes for each in recorders}, shots, described, notes)
    if cameras is None:
        _compare(seen, about.labels, logged_optics(log.schema, told[imc.CameraFrame.ID]))
    return seen


def _compare(seen: Exposures, entities: Mapping[str, int], told: Mapping[tuple[int, float], tuple[float, ...]]) -> None:
    """Mark the pictures whose CameraFrame in the log tells of another lens or size than theirs."""
    for number, shot in enumerate(seen.shots):
        optics = told.get((entities.get(shot.camera, -1), shot.time))
        if optics is not None and not is_like(seen.eye(shot).camera.optics, optics):
            seen.shots[number] = shot._replace(unlike=True)
    unlike = Counter(shot.camera for shot in seen.shots if shot.unlike)
    for label, count in sorted(unlike.items()):
        seen.notes.append(f"{count} frames of {label} were taken with another lens or size, which changed unnoticed")


class _Recorder:
    """Takes down what a camera would compute; in place of a picture it gets an empty one, which takes no memory."""

    def __init__(self, task: RenderedCamera):
        self.task = task
        self.shots: list[tuple[Path, Shot]] = []
        self.eyes: list[Eye] = []
        self._taken: dict[int, tuple[NDArray[np.uint8], Shot]] = {}
        self._latency: float | None = None
        self._offload: Offload = task.offload
        task.offload = self.offload

    def follow(self, frames: deque[Taken]) -> None:
        """Expose when these frames were taken, not at the camera's rate."""
        self.task.begin_ticking = FrameTimes(self.task.vehicle.kernel, frames, self._expose).ask

    def _expose(self, frame: Taken) -> None:
        self.task.taken, self._latency = frame.number, frame.latency
        self.task.expose()

    def offload(self, function: Callable[..., Any], *args: Any, then: Callable[[Any], object], latency: float = 0.0):
        """In place of Task.offload."""
        task = self.task
        if getattr(function, "__self__", None) is task.shutter:
            view = task.viewpoint.view(world_of(task), task.now, task.vehicle.start_time)
            assert isinstance(view, View)
            result = np.broadcast_to(np.zeros(4, np.uint8), (task.camera.optics.height, task.camera.optics.width, 4))
            if not self.eyes or self.eyes[-1].shutter is not task.shutter:
                self.eyes.append(Eye(task.camera, task.shutter))
            eye = len(self.eyes) - 1
            shot = Shot(task.entity.label, task.now, "", "", args, view.vehicle, view.gliders, view.boards, eye)
            self._taken[id(result)] = result, shot
            latency = latency if self._latency is None else self._latency
        elif function is write_picture:
            path, image, form = args
            _, shot = self._taken.pop(id(image))
            self.shots.append((path, shot._replace(name=path.name, form=form)))
            result = ""
        else:
            result = function(*args)
        self._offload(lambda: result, then=then, latency=latency)


class _Chain:
    """Publishes the logged messages of one type, and asks for the next one whenever it has published one.

    That is when the task asked for its next tick that published them; so ticks of cameras at the same instant come
    before or after them as they did in the run. Messages that come `last` follow all that is due at their instant.
    """

    def __init__(self, vehicle: Vehicle, schema: imc.Schema, entries: deque[tuple[int, bytes]], *, last: bool):
        self._vehicle, self._schema, self._entries, self._last = vehicle, schema, entries, last

    def ask(self) -> None:
        kernel = self._vehicle.kernel
        if self._entries and self._last:
            kernel.at(self._entries[0][0], kernel.soon, self._tell)
        elif self._entries:
            kernel.at(self._entries[0][0], self._tell)

    def _tell(self) -> None:
        while self._entries and self._entries[0][0] <= self._vehicle.kernel.now_ns:
            _, packet = self._entries.popleft()
            self._vehicle.bus.publish(self._schema.decode(packet), packet, None)
        self.ask()


def _told(run: LoggedRun, instants: Instants, owner: int) -> Mapping[int, deque[tuple[int, bytes]]]:
    """When the messages of TOLD, CHANGE and BESIDE were published (ns), and their packets, by message id."""
    found = {kind.ID: deque[tuple[int, bytes]]() for kind in (*TOLD, CHANGE, *BESIDE)}
    # Few packets are of these: the others, known by two bytes in either order, are not looked at.
    numbers = {number.to_bytes(2, order) for number in found for order in ("little", "big")}
    latest, asked = 0, deque[bytes]()
    for _, packet in run.packets():
        if packet[2:4] not in numbers:
            continue
        header = imc.header(packet)
        if header.src == owner and header.id in found and math.isfinite(header.timestamp):
            latest = max(latest, instants.of(header.timestamp))
            found[header.id].append((latest, packet))
            while asked and header.id == imc.EntityParameters.ID:
                found[CHANGE.ID].append((latest, asked.popleft()))
        elif header.id == CHANGE.ID:  # by a console, whose clock is another: the vehicle's answer has the time
            asked.append(packet)
    return found


def _goes_on(log: imc.Log) -> bool:
    """Whether the run goes on in another log beside this one."""
    place = run_position(log.path.parent)
    return place is not None and len(logs_of_run(log.path.parent)) > place.number


def _name(schema: imc.Schema, told: Iterable[tuple[int, bytes]]) -> str:
    """The name of the last log that LoggingControl tells of, by which its pictures are kept; empty if none does."""
    name = ""
    for _, packet in told:
        said = schema.decode(packet)
        name = getattr(said, "name", "") if getattr(said, "op", None) in (Op.STARTED, Op.CURRENT_NAME) else name
    return name
