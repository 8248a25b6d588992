"""Simulates a camera that detects mini underwater gliders below the vehicle."""

import math
from collections import Counter
from collections.abc import Mapping
from typing import ClassVar

import imc
from runtime import ParameterError, State, Task, consume, param, periodic
from runtime.task import SharedOption
from support.log_limit import ReportLimit
from support.pose import DOWN, Pose
from tasks.pose_history import PoseHistory
from tasks.simulated_world import (
    TrueState,
    WorldFrame,
    WorldPose,
    adopt_world_options,
    has_valid_pose,
    position_param,
    world_of,
)
from world import SECTIONS, ObjectPosition, WorldObject
from world.detection import DetectionAccuracy, DetectionProbability, Floats, PlaneDetection
from world.optics import FieldOfViewCamera, PinholeModel
from world.rendering import optical_to_body_transform
from world.sensors import (
    ACCURACY,
    UNIFORM_ERROR,
    AttitudeAndHeight,
    DetectionErrorModel,
    NorthEastOffset,
    detect_target,
    detection_at_pixel,
    locate_like_original_camera,
    locate_target_on_plane,
    original_mug_camera,
    target_in_camera,
)

UP = math.pi, 0.0, 0.0  # of a camera that looked down
SMALLEST_FIELD = 1e-3  # °
NO_ALTITUDE = "no altitude"
SETTLING = 2.0  # s from the start, in which a missing altitude is no fault: the DVL measures less often
TIMING = 1e-3  # of a period: how early an image may be, since the resolution of timestamps is 0.24 µs


class MUGDetectionCamera(Task):
    """Publishes an EstimatedMugState for each glider in the image: its offset north and east (m), and its number.

    The gliders are those of [World]. A detection goes from where vehicle and glider really are (SimulatedState) to the
    pixel, back through the pixel's center to the depth of the glider, with the attitude and altitude that the vehicle
    estimates, and gets an error that grows with the height. Without SimulatedState, the estimate counts as the truth.
    Without `Mount Orientation` the camera looks to the side where the glider is: down, or up from below the surface.
    With a probability it misses gliders; it may be late, and detect what is not there, with numbers of its own.

    `Original` follows the README of the original task, `Original Code` its source: both at every state, with its flaws
    (see original_mug_camera). The source assumes an altitude of 10 m and adds the same error to each detection.
    """

    reads: ClassVar[Mapping[str, Mapping[str, SharedOption]]] = SECTIONS

    fidelity: str = param(
        "Physical", "", "Physically right, or like the original.", choices=("Physical", "Original", "Original Code")
    )
    horizontal_field_of_view: float = param(
        92.8,
        "°",
        "Angle between the left and right border.",
        name="Horizontal Field of View",
        minimum=0,
        maximum=180,
        aliases=("Camera - Horizontal FOV",),
    )
    vertical_field_of_view: float = param(
        50.0,
        "°",
        "Angle between the upper and lower border.",
        name="Vertical Field of View",
        minimum=0,
        maximum=180,
        aliases=("Camera - Vertical FOV",),
    )
    horizontal_resolution: int = param(
        1280, "px", "Width of the image.", minimum=1, maximum=65535, aliases=("Camera - horizontal resolution",)
    )
    vertical_resolution: int = param(
        960, "px", "Height of the image.", minimum=1, maximum=65535, aliases=("Camera - vertical resolution",)
    )
    detection_rate: float = param(10.0, "Hz", "Images per second; 0 for one at every state.", minimum=0, maximum=1000)
    mount_orientation: list[float] = param(
        [], "°", "Roll, pitch and yaw in the vehicle of a camera that looks down.", size=(0, 3)
    )
    mount_position: list[float] = position_param(
        "Position of the camera in the vehicle: forward, right, down.", [0.0, 0.0, 0.0]
    )
    mugs: list[str] = param(["1.0 0.3"], "", "Older place of [World] Gliders, which all cameras see.", name="MUGs")
    target_plane: str = param(
        "Seabed",
        "",
        "Older place of [World] Gliders Lie On.",
        choices=("Surface", "Seabed", "Depth"),
    )
    target_depth: float = param(0.0, "m", "Older place of [World] Gliders Depth.", minimum=0, maximum=11000)
    error_model: str = param(
        "Default",
        "",
        "Error of position: uniform within 0.5 m at 10 m (the default), normal from pixel, attitude and height (GSD; "
        "Covariance in their true directions), or the constant of the original code (Frozen, its default).",
        choices=("Default", "Uniform", "GSD", "Covariance", "Frozen", "None"),
    )
    detection_probability: float = param(1.0, "1", "Of a glider that is near and large.", minimum=0, maximum=1)
    visibility: float = param(
        0.0, "m", "Distance at which half of that is left; 0 for no effect.", minimum=0, maximum=1e6
    )
    least_pixels: float = param(
        0.0, "px", "Pixels of a glider of which half are detected; 0 for no effect.", minimum=0, maximum=1e6
    )
    false_alarm_rate: float = param(
        0.0, "Hz", "False alarms per second, anywhere in the image.", minimum=0, maximum=100
    )
    latency: float = param(0.0, "s", "Time from an image to its detections.", minimum=0, maximum=60)
    maximum_altitude: float = param(200.0, "m", "Altitude above which gliders are too small to detect.", minimum=0)
    maximum_age: float = param(1.0, "s", "Older states are skipped.", minimum=0)

    def configure(self) -> None:
        self.errors = self.error_model
        if self.errors == "Default":
            self.errors: str = "Frozen" if self.fidelity == "Original Code" else "Uniform"
        angles = self.horizontal_field_of_view, self.vertical_field_of_view
        blind = [angle for angle in angles if not 0.0 < angle < 180.0]
        self.blindness: str = f"a field of view of {blind[0]:g}° sees nothing" if blind else ""
        fields = [math.radians(min(max(angle, SMALLEST_FIELD), 180.0 - SMALLEST_FIELD)) for angle in angles]
        self.camera: FieldOfViewCamera = FieldOfViewCamera(
            self.horizontal_resolution, self.vertical_resolution, fields[0], fields[1]
        )
        self._error = DetectionErrorModel(self.errors, self.camera, is_physical=self.fidelity == "Physical")
        if len(self.mount_orientation) not in (0, 3):
            raise ParameterError("Mount Orientation", "must be roll, pitch and yaw, or nothing")
        roll, pitch, yaw = map(math.radians, self.mount_orientation or (0.0, 0.0, 0.0))
        self.mounts: tuple[Floats, Floats] = (
            self._mount(roll, pitch, yaw),
            self._mount(*((roll, pitch, yaw) if self.mount_orientation else UP)),
        )
        self.probability: DetectionProbability = DetectionProbability(
            self.detection_probability, self.visibility, self.least_pixels
        )
        adopt_world_options(self, "MUGs", "Target Plane", "Target Depth")
        world_of(self)

    def camera_and_accuracy(self) -> tuple[PinholeModel, DetectionAccuracy, float]:
        """The model of the camera, the errors of its detections, and a further one per height (standard deviation)."""
        across, down = self.camera.focal_lengths
        width, height = self.camera.width, self.camera.height
        model = PinholeModel(width, height, across, down, width / 2, height / 2)
        return model, ACCURACY, UNIFORM_ERROR / math.sqrt(3.0) if self.errors == "Uniform" else 0.0

    def start(self) -> None:
        self.skipped: Counter[str] = Counter()
        self._truth, self._chart = TrueState(world_of(self).origin), WorldFrame(world_of(self).origin)
        self.pose_history: PoseHistory = PoseHistory(world_of(self).origin)
        (self._chance,) = self.random.spawn(1)  # so that errors are the same with and without misses and false alarms
        self._false_alarms = 0
        self._seen_something = False
        self._first = self._last = -math.inf
        self._image = -1
        self._warnings, self._began = ReportLimit(1.0), self.now
        self.set_entity_state(State.BOOT, "waiting for EstimatedState")

    @consume
    def update_truth(self, truth: imc.SimulatedState) -> None:
        self._truth.update(truth)

    @consume
    def detect_gliders(self, state: imc.EstimatedState) -> None:
        fault = self._fault(state)
        if fault:
            self._skip(fault)
            return
        place = self._chart.position(state)
        self.pose_history.add(state)
        self._seen_something = True
        since = max(0.0, state.timestamp - self._last) if self._last > -math.inf else 0.0
        if not self._due(state.timestamp):
            return
        if self.fidelity == "Physical":
            self.after(0.0, self._look, state, place, since)  # when the true state of this instant is here, too
        else:
            self._look(state, place, since)

    def _look(self, state: imc.EstimatedState, place: NorthEastOffset, since: float) -> None:
        truth = self._truth.pose_at(self.now, self.maximum_age) if self.fidelity == "Physical" else None
        estimated = truth is None and self.fidelity == "Physical"
        self.set_entity_state(State.NORMAL, "active, looks from EstimatedState" if estimated else "active")
        if truth is not None:  # the picture is of now, which a late state is not
            here = self.pose_history.estimate_at(self.now, math.inf)
            place = place if isinstance(here, str) else (here.north, here.east)
        angles = state.phi, state.theta, state.psi
        world = world_of(self)
        for thing in world.gliders:
            draws = self._error.draw(self.random)
            spot = world.object_position(thing, self.now - self.vehicle.start_time)
            estimated_view = AttitudeAndHeight(*angles, self._height(state, thing))
            if not math.isfinite(estimated_view.height):
                continue
            if truth is None:
                view, mug = estimated_view, WorldPose(*place, state.z, angles).offset_to(spot)
            else:
                view, mug = self._true_view(truth, spot, estimated_view.height), truth.offset_to(spot)
            seen = self._detect(view, mug, estimated_view)
            if seen is not None and self._is_noticed(thing, view, mug):
                x, y = self._error.apply(seen, draws, abs(view.height), mug)
                if math.isfinite(x) and math.isfinite(y):
                    self._publish_detection(thing.id, x, y, place)
        if self.false_alarm_rate > 0.0 and self.fidelity == "Physical":
            self._alarm_falsely(state, place, 1.0 / self.detection_rate if self.detection_rate > 0.0 else since)

    @periodic(1.0)
    def check_state_age(self) -> None:
        silent = self.age(self._last) if self._last > -math.inf else 0.0
        if silent > max(self.maximum_age, 1.0) and self.entity.state is not State.FAULT:
            self.set_entity_state(State.FAULT, "no recent EstimatedState")

    def _true_view(self, truth: WorldPose, spot: ObjectPosition, estimated_height: float) -> AttitudeAndHeight:
        """The pose of the vehicle, with its height above a glider; on an unknown bottom that is the estimated one."""
        return AttitudeAndHeight(*truth.angles, estimated_height if spot.down is None else spot.down - truth.down)

    def _mount(self, roll: float, pitch: float, yaw: float) -> Floats:
        """Transform from the optical frame to the body, (4, 4), of a camera that is turned after it looked down."""
        x, y, z = self.mount_position
        return optical_to_body_transform(Pose(x, y, z, roll, pitch, yaw).compose(DOWN))

    def _detect(
        self, view: AttitudeAndHeight, mug: NorthEastOffset, estimated_view: AttitudeAndHeight
    ) -> PlaneDetection | NorthEastOffset | None:
        if self.fidelity != "Physical":
            return locate_like_original_camera(self.camera, view, mug)
        see = detect_target if self.errors == "Covariance" else locate_target_on_plane
        return see(self.camera, view, mug, estimated_view, self.mounts[view.height <= 0.0])

    def _is_noticed(self, thing: WorldObject, view: AttitudeAndHeight, mug: NorthEastOffset) -> bool:
        """Whether a glider in the image is detected; no number is drawn if all are."""
        if self.probability == DetectionProbability() or self.fidelity != "Physical":
            return True
        x, y, z = target_in_camera(view, mug, self.mounts[view.height <= 0.0])
        across, down = self.camera.focal_lengths
        pixels = thing.length * thing.diameter * across * down / (z * z)
        return float(self._chance.random()) < self.probability.probability(math.hypot(x, y, z), pixels)

    def _alarm_falsely(self, state: imc.EstimatedState, place: NorthEastOffset, seconds: float) -> None:
        """False alarms of an image, as if on the plane of the first object, or on the seabed."""
        count = int(self._chance.poisson(self.false_alarm_rate * min(seconds, self.maximum_age)))
        points = self._chance.random((count, 2)).tolist()
        objects = world_of(self).gliders
        height = self._height(state, objects[0]) if objects else state.alt
        view = AttitudeAndHeight(state.phi, state.theta, state.psi, height)
        for u, v in points:
            mount = self.mounts[height <= 0.0]
            seen = detection_at_pixel(self.camera, u * self.camera.width, v * self.camera.height, view, mount)
            if seen is not None:
                self._false_alarms += 1
                number = max((thing.id for thing in objects), default=0) + self._false_alarms
                self._publish_detection(number, seen.north, seen.east, place)

    def _publish_detection(self, number: int, north: float, east: float, place: NorthEastOffset) -> None:
        """Publish a detection, m from a vehicle whose estimate is a place of the world."""
        if self.latency == 0.0 or self.fidelity != "Physical":
            self.publish(imc.EstimatedMugState(id=number, x=north, y=east))
        else:
            self.after(self.latency, self._publish_late, number, place[0] + north, place[1] + east)

    def _publish_late(self, number: int, north: float, east: float) -> None:
        """The vehicle has moved on meanwhile."""
        here = self.pose_history.estimate_at(self.now, self.maximum_age)
        if isinstance(here, str):
            self._skip(here)
        else:
            self.publish(imc.EstimatedMugState(id=number, x=north - here.north, y=east - here.east))

    def _fault(self, state: imc.EstimatedState) -> str:
        if self.blindness:
            return self.blindness
        if not has_valid_pose(state):
            return "no position or attitude"
        if self.fidelity == "Physical" and self._truth.fault:
            return self._truth.fault
        on_seabed = all(thing.depth is None for thing in world_of(self).gliders)
        by_altitude = self.fidelity == "Original" or (self.fidelity == "Physical" and on_seabed)
        if by_altitude and not 0.0 < state.alt < math.inf:
            return NO_ALTITUDE
        if by_altitude and state.alt > self.maximum_altitude:
            return "altitude out of range"
        if state.timestamp < self._last:
            self._first = self._last = state.timestamp
            self._image = -1
            return "time goes backwards"
        if self.age(state.timestamp) > self.maximum_age:
            return "no recent state"
        return ""

    def _skip(self, fault: str) -> None:
        self.skipped[fault] += 1
        if fault == NO_ALTITUDE and not self._seen_something and self.age(self._began) < SETTLING:
            self.set_entity_state(State.BOOT, "waiting for an altitude")
            return
        description = f"{fault} ({self.skipped[fault]} skipped)"
        self.set_entity_state(State.FAULT, description)
        if self._warnings.is_due(now=self.now):
            self.log.warning(description)

    def _due(self, time: float) -> bool:
        if self._first == -math.inf:
            self._first = time
        self._last = time
        if self.fidelity != "Physical" or self.detection_rate == 0.0:
            return True
        image = math.floor((time - self._first) * self.detection_rate + TIMING)
        due, self._image = image > self._image, image
        return due

    def _height(self, state: imc.EstimatedState, thing: WorldObject) -> float:
        """The estimated height above an object (m)."""
        if self.fidelity == "Original Code":
            return original_mug_camera.ALTITUDE
        if self.fidelity == "Original" or thing.depth is None:
            return state.alt if 0.0 < state.alt <= self.maximum_altitude else math.nan
        return thing.depth - state.z
