"""Detects mini underwater gliders in the pictures of cameras."""

import importlib
import importlib.util
import math
from collections import Counter
from collections.abc import Mapping
from functools import partial
from typing import Any, ClassVar, NamedTuple

import numpy as np

import imc
from runtime import Frame, ParameterError, State, Task, consume, param
from runtime.task import SharedOption
from support.log_limit import Trouble
from tasks.pose_history import DURATION, PoseEstimate, PoseHistory
from tasks.simulated_world import world_of
from tasks.vision.detection_function import DetectionFunction, find_marks, load_detection_function
from world import SECTIONS
from world.detection import (
    MARKER_FAMILIES,
    YELLOW,
    BlobDetector,
    DetectionAccuracy,
    Floats,
    ImageDetection,
    MarkerDetector,
    ObjectTrack,
    PlaneDetection,
    PoseOverPlane,
    Tracker,
    TrackerSettings,
    fits_size,
    project_to_plane,
)
from world.optics import row_time

ERRORS = (
    *("pixel_error", "shape_error", "attitude_error", "heading_error", "height_error", "height_error_share"),
    *("position_error", "attitude_error_time", "height_error_time", "position_error_time"),
)
WALKS = 0.002  # m/√s, of things that lie still
STEADY = 0.1  # of the speed, by which it changes in a second
LEAST_HUE = 10.0  # of 255, between the colors
SILENT = 10.0  # s without a frame, after which the fault of a camera is over
MOST_HELD = 8  # frames that wait for a state
SLOPES = 3  # steps to where a ray meets the bottom of a map


class FrameModel(NamedTuple):
    """The data of a frame besides its pixels."""

    time: float
    camera: str
    optics: Any
    mount: Floats
    readout: float


class MUGDetector(Task):
    """Publishes an EstimatedMugState for each glider that a frame shows: its offset north and east (m), and its number.

    It receives the frames of cameras, finds gliders in them, and follows each one on the map: what is published is the
    track, from where the vehicle is by then. Pixels become places with the attitude, position and height that the
    vehicle estimated at the exposure. Numbers count from 1, and a glider keeps its own while its place
    is known. A glider counts when three of five frames of a camera have shown it. On a wall clock, a frame that
    comes while the one before is still looked at is dropped and counted.
    """

    reads: ClassVar[Mapping[str, Mapping[str, SharedOption]]] = SECTIONS
    transient: ClassVar[tuple[str, ...]] = ("_find",)

    camera: str = param("", "", "Label of the camera's entity; empty for all cameras.")
    detector: str = param(
        "Color",
        "",
        "Target of the search: a color, or markers on the gliders (OpenCV), or the findings of a function of yours.",
        choices=("Color", "Marker", "Function"),
    )
    color: list[float] = param(list(YELLOW), "1", "Red, green and blue of the gliders, 0 to 255.", size=(3, 3))
    contrast: float = param(
        3.5, "σ", "Least contrast of a pixel with those around it, in their deviations.", minimum=2, maximum=100
    )
    least_pixels: int = param(6, "px", "Pixels of the smallest glider.", minimum=1, maximum=1000000)
    marker_family: str = param("4X4_50", "", "Family of markers.", choices=MARKER_FAMILIES)
    function: str = param(
        "",
        "",
        "module:function: takes a picture (height, width, 4; RGBA, uint8), returns rows of column and row (px), and "
        "optionally a number.",
        editable=False,
    )
    target_length: float = param(0.8, "m", "Length of a glider; 0 for any size.", minimum=0, maximum=1000)
    target_diameter: float = param(0.16, "m", "Diameter of a glider.", minimum=0.001, maximum=1000)
    target_speed: float = param(0.0, "m/s", "Speed of gliders; 0 if they lie still.", minimum=0, maximum=10)
    target_plane: str = param(
        "Seabed",
        "",
        "Location of gliders: on the seabed, below by the altitude or where [World] has it (Map), or at a depth.",
        choices=("Seabed", "Map", "Surface", "Depth"),
    )
    target_depth: float = param(0.0, "m", "Depth of the gliders, for Depth.", minimum=0, maximum=11000)
    maximum_range: float = param(100.0, "m", "Distance beyond which nothing is taken for a glider.", minimum=0.1)
    pixel_error: float = param(0.5, "px", "Standard deviation of what is found in a picture.", minimum=0)
    shape_error: float = param(0.02, "m", "The same of the middle of what is seen of a glider.", minimum=0)
    attitude_error: float = param(0.3, "°", "The same of roll and pitch.", minimum=0, maximum=90)
    heading_error: float = param(0.5, "°", "The same of the heading.", minimum=0, maximum=180)
    height_error: float = param(0.1, "m", "The same of the height above the gliders.", minimum=0)
    height_error_share: float = param(1.0, "%", "A further one, per height.", minimum=0, maximum=100)
    position_error: float = param(0.3, "m", "The same of the position, north and east each.", minimum=0)
    attitude_error_time: float = param(5.0, "s", "How long an error of the attitude lasts.", minimum=0)
    height_error_time: float = param(10.0, "s", "How long an error of the height lasts.", minimum=0)
    position_error_time: float = param(60.0, "s", "How long an error of the position lasts.", minimum=0)
    memory: float = param(900.0, "s", "How long a glider keeps its number without being seen.", minimum=0)
    maximum_age: float = param(1.0, "s", "For how long the last state is carried on.", minimum=0, maximum=60)
    patience: float = param(5.0, "s", "After which a detector that does not answer is a fault.", minimum=0.1)
    latency: float = param(0.05, "s", "Time of detection on a virtual clock.", minimum=0, maximum=60)

    def configure(self) -> None:
        self.accuracy: DetectionAccuracy = accuracy_from_parameters({name: getattr(self, name) for name in ERRORS})
        speed = self.target_speed
        self.tracker_settings: TrackerSettings = TrackerSettings(
            WALKS, speed, STEADY * speed, memory=self.memory, least_separation=self.target_length
        )
        self._find = self._finder()
        if hasattr(self, "tracker"):
            self.tracker.accuracy, self.tracker.settings = self.accuracy, self.tracker_settings
            self.pose_history.duration = DURATION + self.latency
            self._received_at = {name: time for name, time in self._received_at.items() if self.camera in ("", name)}
        world_of(self)

    def start(self) -> None:
        self.tracker: Tracker = Tracker(self.accuracy, self.tracker_settings)
        self.pose_history: PoseHistory = PoseHistory(world_of(self).origin, DURATION + self.latency)
        self.skipped: Counter[str] = Counter()
        self.searched: int = 0
        self.dropped: int = 0
        self._asked = -math.inf
        self._busy = False
        self._held = list[tuple[FrameModel, list[ImageDetection]]]()
        self._last: dict[str, float] = {}
        self._received_at: dict[str, float] = {}
        self._faults: dict[str, Trouble] = {}
        self.set_entity_state(State.BOOT, "waiting for frames")

    def after_restore(self) -> None:
        self._find = self._finder()

    @consume
    def on_estimated_state(self, state: imc.EstimatedState) -> None:
        fault = self.pose_history.add(state)
        if fault:
            self._skip("", fault)
        held, self._held = self._held, []
        for shot, marks in held:
            self._follow(shot, marks, may_wait=False)

    @consume
    def on_frame(self, frame: Frame) -> None:
        if self.camera and frame.camera != self.camera:
            return
        self._received_at[frame.camera] = self.now
        fault = _fault(frame)
        if fault:
            self._skip(frame.camera, fault)
            return
        if frame.time < self._last.get(frame.camera, -math.inf):
            self.tracker.drop_all_tracks()
            self._skip(frame.camera, "time goes backwards")
        self._last[frame.camera] = frame.time
        if self._busy and not self.vehicle.has_virtual_time:
            self.dropped += 1
            if self.age(self._asked) > self.patience:
                self._skip(frame.camera, f"the detector has not answered for {self.patience:g} s")
            return
        self._busy, self._asked = True, self.now
        mount, readout = np.asarray(frame.mount, np.float64), frame.info.get("readout_time", 0.0)
        shot = FrameModel(frame.time, frame.camera, frame.optics, mount, readout)
        self.offload(find_marks, self._find, frame.image, then=partial(self._locate, shot), latency=self.latency)

    def _locate(self, shot: FrameModel, found: tuple[list[ImageDetection], str]) -> None:
        self._busy = False
        marks, error = found
        if error:
            self._skip(shot.camera, error)
        else:
            self._follow(shot, marks, may_wait=True)

    def _follow(self, shot: FrameModel, marks: list[ImageDetection], *, may_wait: bool) -> None:
        """Publish the tracks after a frame. Just after a stall, in which nobody could publish, it waits for a state."""
        belief, here = (self.pose_history.estimate_at(time, self.maximum_age) for time in (shot.time, self.now))
        if isinstance(belief, str) or isinstance(here, str):
            if not self.recent_stall:
                self._skip(shot.camera, next(text for text in (belief, here) if isinstance(text, str)))
            elif may_wait and len(self._held) < MOST_HELD:
                self._held.append((shot, marks))
            else:
                self.dropped += 1
            return
        standing = self._standing(belief)
        if not math.isfinite(standing.height):
            self._skip(shot.camera, "[World] has no bottom here" if self.target_plane == "Map" else "no altitude")
            return
        seen = self._sightings(shot, belief, marks)
        sightings, markers = [sighting for sighting, _ in seen], [marker for _, marker in seen]
        for track in self.tracker.update(shot.time, standing, sightings, markers, shot.camera):
            x, y, _ = self._offset(track, here)
            self.publish(imc.EstimatedMugState(id=track.id or 0, x=x, y=y))
        self.searched += 1
        self._faults.pop(shot.camera, None)
        self._faults.pop("", None)
        self._report_state()

    def glider_offset(self, number: int) -> tuple[float, float, Floats]:
        """North and east (m) of the vehicle, as it is now, of a glider, and the covariance (2, 2).

        Raises LookupError for a number that no glider has, or without a recent state.
        """
        track = next((track for track in self.tracker.tracks if track.id == number), None)
        here = self.pose_history.estimate_at(self.now, self.maximum_age)
        if track is None or isinstance(here, str):
            raise LookupError(f"no glider {number}" if track is None else here)
        return self._offset(track, here)

    def _offset(self, track: ObjectTrack, here: PoseEstimate) -> tuple[float, float, Floats]:
        return track.predicted(self.now, self.accuracy, self.tracker_settings).offset(
            self._standing(here), self.accuracy
        )

    def _sightings(
        self, shot: FrameModel, belief: PoseEstimate, marks: list[ImageDetection]
    ) -> list[tuple[PlaneDetection, int | None]]:
        """The candidates for gliders, with the numbers of their markers."""
        found: list[tuple[PlaneDetection, int | None]] = []
        for mark in marks:
            seen = self._in_row(shot, belief, mark)
            if seen is None or seen.distance > self.maximum_range:
                continue
            sized = self.detector == "Color" and self.target_length > 0.0
            if not sized or fits_size(seen, mark.pixels, self.target_length, self.target_diameter):
                found.append((seen, mark.marker))
        return found

    def _in_row(self, shot: FrameModel, belief: PoseEstimate, mark: ImageDetection) -> PlaneDetection | None:
        """A sighting from where the vehicle was when the shutter exposed its row, as an offset from `belief`."""
        time = shot.time + float(row_time(shot.readout, mark.v, shot.optics.height))
        there = self.pose_history.estimate_at(time, self.maximum_age) if shot.readout else belief
        here = belief if isinstance(there, str) else there
        (seen,) = project_to_plane(shot.optics, shot.mount, self._standing(here), (mark.u, mark.v), self.accuracy)
        if self.target_plane == "Map":
            seen = self._on_map(shot, here, mark, seen)
        return seen and seen._replace(
            north=seen.north + here.north - belief.north, east=seen.east + here.east - belief.east
        )

    def _on_map(
        self, shot: FrameModel, belief: PoseEstimate, mark: ImageDetection, seen: PlaneDetection | None
    ) -> PlaneDetection | None:
        """A sighting on a bottom that is not level."""
        for _ in range(SLOPES):
            if seen is None:
                return None
            bottom = world_of(self).seabed_depth(belief.north + seen.north, belief.east + seen.east)
            if bottom is None:
                return None
            standing = PoseOverPlane(belief.north, belief.east, bottom - belief.down, belief.angles)
            (seen,) = project_to_plane(shot.optics, shot.mount, standing, (mark.u, mark.v), self.accuracy)
        return seen

    def _standing(self, belief: PoseEstimate) -> PoseOverPlane:
        plane = {"Seabed": belief.bottom, "Surface": 0.0, "Depth": self.target_depth}.get(self.target_plane)
        if plane is None:
            bottom = world_of(self).seabed_depth(belief.north, belief.east)
            plane = math.nan if bottom is None else bottom
        return PoseOverPlane(belief.north, belief.east, plane - belief.down, belief.angles)

    def _skip(self, camera: str, fault: str) -> None:
        self.skipped[fault] += 1
        text = f"{camera}: {fault}" if camera else fault
        self._faults.setdefault(camera, Trouble()).report(fault, self.log.warning, text)
        self._report_state()

    def _report_state(self) -> None:
        for camera in list(self._faults):
            if camera and self.age(self._received_at.get(camera, -math.inf)) > SILENT:
                del self._faults[camera]
        if self._faults:
            camera, trouble = next(iter(self._faults.items()))
            fault = trouble.reason
            text = f"{camera}: {fault}" if camera else fault
            self.set_entity_state(State.FAULT, f"{text} ({self.skipped[fault]} skipped)")
            return
        number = len([track for track in self.tracker.tracks if track.id is not None])
        counts = f"{self.searched} frames, {self.dropped} dropped, {number} glider{'s' if number != 1 else ''}"
        skipped = self.skipped.total()
        self.set_entity_state(State.NORMAL, f"{counts}, {skipped} skipped" if skipped else counts)

    def _finder(self) -> DetectionFunction:
        if self.detector == "Color":
            red, green, blue = self.color
            if max(self.color) - min(self.color) < LEAST_HUE:
                raise ParameterError("Color", "is gray, and only a hue distinguishes a color from others")
            return BlobDetector((red, green, blue), self.contrast, least_pixels=self.least_pixels).detect
        if self.detector == "Marker":
            if importlib.util.find_spec("cv2") is None:
                raise ParameterError("Detector", "markers need `pip install opencv-python-headless`")
            return MarkerDetector(self.marker_family).detect
        return load_detection_function(self.function)


def accuracy_from_parameters(values: Mapping[str, Any]) -> DetectionAccuracy:
    """The errors of detections by the parameters (by attribute)."""
    degrees = math.radians(values["attitude_error"]), math.radians(values["heading_error"])
    pixel, shape, *_, height, share, place, attitude_time, height_time, place_time = (values[name] for name in ERRORS)
    share = share / 100.0
    return DetectionAccuracy(pixel, shape, *degrees, height, share, place, attitude_time, height_time, place_time)


def _fault(frame: Frame) -> str:
    """Reason why nothing can be located in a frame."""
    if frame.optics is None or frame.mount is None:
        return f"frames without {'the camera model' if frame.optics is None else 'the mount of the camera'}"
    height, width = frame.image.shape[:2]
    if (frame.optics.width, frame.optics.height) != (width, height):
        return f"frames of {width} x {height} px, model of {frame.optics.width} x {frame.optics.height} px"
    if not math.isfinite(frame.time) or frame.mount.shape != (4, 4) or not np.isfinite(frame.mount).all():
        return "frames without time or mount"
    return ""
