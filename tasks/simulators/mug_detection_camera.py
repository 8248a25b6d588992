"""Simulates a camera that detects mini underwater gliders below the vehicle."""

import math
from collections import Counter

import imc
from runtime import ParameterError, State, Task, consume, param
from tasks.surroundings import Chart, Placed, Truth, check_older, world_of
from world import SECTIONS, Spot, Thing
from world.attitude import rotation
from world.optics import Pinhole
from world.sensors import (
    UNIFORM_ERROR,
    CameraPose,
    Offset,
    detect,
    detect_originally,
    gsd_sigma,
    mug_original,
)

SMALLEST_FIELD = 1e-3  # °
NO_ALTITUDE = "no altitude"
SETTLING = 2.0  # s from the start, in which a missing altitude is not logged
TIMING = 1e-3  # of a period: how early an image may be, since the resolution of timestamps is 0.24 µs


class MUGDetectionCamera(Task):
    """Publishes an EstimatedMugState for each glider in the image: its offset north and east (m), and its number.

    The gliders are those of [World]. A detection goes from where vehicle and glider really are (SimulatedState) to the
    pixel, back through the pixel's center to the depth of the glider, with the attitude and altitude that the vehicle
    believes, and gets an error that grows with the height. Without SimulatedState, the estimate counts as the truth.
    Without `Mount Orientation` the camera looks to the side where the glider is: down, or up from below the surface.

    `Original` follows the README of the original task, `Original Code` its source: both at every state, with its flaws
    (see mug_original). The source assumes an altitude of 10 m and adds the same error to each detection.
    """

    reads = SECTIONS

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
        "Error of position: uniform within 0.5 m at 10 m (the default), normal from pixel, attitude and height (GSD), "
        "or the constant of the original code (Frozen, the default of Original Code).",
        choices=("Default", "Uniform", "GSD", "Frozen", "None"),
    )
    maximum_altitude: float = param(200.0, "m", "Altitude above which gliders are too small to detect.", minimum=0)
    maximum_age: float = param(1.0, "s", "Older states are skipped.", minimum=0)

    def configure(self) -> None:
        self.errors = self.error_model
        if self.errors == "Default":
            self.errors = "Frozen" if self.fidelity == "Original Code" else "Uniform"
        angles = self.horizontal_field_of_view, self.vertical_field_of_view
        blind = [angle for angle in angles if not 0.0 < angle < 180.0]
        self.blindness = f"a field of view of {blind[0]:g}° sees nothing" if blind else ""
        fields = [math.radians(min(max(angle, SMALLEST_FIELD), 180.0 - SMALLEST_FIELD)) for angle in angles]
        self.camera = Pinhole(self.horizontal_resolution, self.vertical_resolution, fields[0], fields[1])
        if len(self.mount_orientation) not in (0, 3):
            raise ParameterError("Mount Orientation", "must be roll, pitch and yaw, or nothing")
        check_older(self, "MUGs", "Target Plane", "Target Depth")
        world_of(self)

    def start(self) -> None:
        self.skipped: Counter[str] = Counter()
        self._truth, self._chart = Truth(world_of(self).origin), Chart(world_of(self).origin)
        self._seen_something = False
        self._first = self._last = -math.inf
        self._image = -1
        self._warned, self._began = -math.inf, self.now
        self.set_entity_state(State.BOOT, "waiting for EstimatedState")

    @consume
    def follow(self, truth: imc.SimulatedState) -> None:
        self._truth.follow(truth)

    @consume
    def look(self, state: imc.EstimatedState) -> None:
        fault = self._fault(state)
        if fault:
            self._skip(fault)
            return
        place = self._chart.place(state)
        self._seen_something = True
        if not self._due(state.timestamp):
            return
        truth = self._truth.at(self.now, self.maximum_age) if self.fidelity == "Physical" else None
        estimated = truth is None and self.fidelity == "Physical"
        self.set_entity_state(State.NORMAL, "active, looks from EstimatedState" if estimated else "active")
        angles = state.phi, state.theta, state.psi
        world = world_of(self)
        for thing in world.objects:
            draws = self._draw()
            spot = world.spot(thing, self.now - self.vehicle.start_time)
            believed = CameraPose(*angles, self._height(state, thing))
            if not math.isfinite(believed.height):
                continue
            if truth is None:
                view, mug = believed, Placed(*place, state.z, angles).to(spot)
            else:
                view, mug = self._true_view(truth, spot, believed.height), truth.to(spot)
            seen = self._detect(view, mug, believed)
            if seen is not None:
                scale = self._error_scale(abs(view.height), mug)
                x, y = seen[0] + scale[0] * draws[0], seen[1] + scale[1] * draws[1]
                self.publish(imc.EstimatedMugState(id=thing.id, x=x, y=y))

    def _true_view(self, truth: Placed, spot: Spot, believed_height: float) -> CameraPose:
        """The pose of the camera, with its height above a glider; on an unknown bottom that is the believed one."""
        return CameraPose(*truth.angles, believed_height if spot.down is None else spot.down - truth.down)

    def _detect(self, view: CameraPose, mug: Offset, believed: CameraPose) -> Offset | None:
        if self.fidelity != "Physical":
            return detect_originally(self.camera, view, mug)
        roll, pitch, yaw = self.mount_orientation or ((0.0 if view.height > 0.0 else 180.0), 0.0, 0.0)
        mount = rotation(math.radians(roll), math.radians(pitch), math.radians(yaw))
        return detect(self.camera, view, mug, believed, mount)

    def _fault(self, state: imc.EstimatedState) -> str:
        if self.blindness:
            return self.blindness
        pose = state.lat + state.lon + state.x + state.y + state.z + state.phi + state.theta + state.psi
        if not math.isfinite(pose):
            return "no position or attitude"
        on_seabed = all(thing.depth is None for thing in world_of(self).objects)
        by_altitude = self.fidelity == "Original" or (self.fidelity == "Physical" and on_seabed)
        if by_altitude and not 0.0 < state.alt < math.inf:
            return NO_ALTITUDE
        if by_altitude and state.alt > self.maximum_altitude:
            return "altitude out of range"
        if state.timestamp < self._last:
            self._first = self._last = state.timestamp
            self._image = -1
            return "time goes backwards"
        if self.now - state.timestamp > self.maximum_age:
            return "no recent state"
        return ""

    def _skip(self, fault: str) -> None:
        self.skipped[fault] += 1
        description = f"{fault} ({self.skipped[fault]} skipped)"
        self.set_entity_state(State.FAULT, description)
        seen_nothing_yet = not self._seen_something and self.now - self._began < SETTLING
        if fault == NO_ALTITUDE and seen_nothing_yet:
            return
        if self.now - self._warned >= 1.0:
            self._warned = self.now
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

    def _height(self, state: imc.EstimatedState, thing: Thing) -> float:
        """How far above an object the vehicle believes to be (m)."""
        if self.fidelity == "Original Code":
            return mug_original.ALTITUDE
        if self.fidelity == "Original" or thing.depth is None:
            return state.alt if 0.0 < state.alt <= self.maximum_altitude else math.nan
        return thing.depth - state.z

    def _draw(self) -> Offset:
        """Two random numbers, drawn also for a glider that is out of sight, so that the others' stay the same."""
        if self.errors == "GSD":
            north, east = self.random.standard_normal(2).tolist()
        elif self.errors == "Uniform":
            north, east = self.random.uniform(-1.0, 1.0, 2).tolist()
        else:
            north, east = mug_original.FROZEN
        return north, east

    def _error_scale(self, height: float, mug: Offset) -> Offset:
        """Scale (m) of the numbers of `_draw`."""
        if self.errors == "None":
            return 0.0, 0.0
        if self.errors == "GSD":
            sigma = gsd_sigma(self.camera, height, mug)
            return sigma, sigma
        if self.fidelity == "Physical":
            return UNIFORM_ERROR * height, UNIFORM_ERROR * height
        return mug_original.error_bound(self.camera, height)
