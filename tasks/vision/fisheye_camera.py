"""Simulates a fisheye camera that looks down from the vehicle."""

import math

from runtime import ParameterError, param
from support.pose import DOWN, Pose
from tasks.simulated_world import adopt_world_options
from tasks.vision.cameras.rendered_camera import RenderedCameraTask
from tasks.vision.cameras.viewpoint import VehicleView
from world import optics
from world.optics import LENS_PRESETS, CameraModel, Lens, preset_lens
from world.rendering import uncovered_warning


class FisheyeCamera(RenderedCameraTask):
    """Shares frames of the seabed under a diving vehicle, or of the sea under a flying one, and of gliders.

    The top of the image points to the bow. Bottom, gliders, water and sun are those of [World]. The camera is where
    the vehicle really is at the exposure: SimulatedState. Without it, it is where EstimatedState is, and the entity
    reports it; the altitude is then the height above seabed or sea; without it, the sea is at z = 0. On a wall clock, a
    frame that is due while the previous one is still computed is dropped and counted. Each frame is reported by
    CameraFrame, each picture that is written by an Event "Picture"; Events "Take Pictures" and "Stop Pictures" ask for
    some.
    """

    size: int = param(1024, "px", "Width and height of the image.", minimum=1, maximum=4096)
    face_size: int = param(512, "px", "Width of the views that make up the image.", minimum=1, maximum=4096)
    faces: int = param(5, "", "Number of views; the sixth looks up.", choices=(5, 6))
    field_of_view: float = param(180.0, "°", "Angle between opposite points of the image's rim.")
    lens: str = param("equidistant", "", "Kind of lens.", choices=tuple(LENS_PRESETS))
    lens_coefficients: list[float] = param(
        [], "1", "k1 to k4 of r = k1 φ + k2 φ² + k3 φ³ + k4 φ⁴, φ in rad; they replace those of the lens.", size=(0, 4)
    )
    focal_length: float = param(
        0.0,
        "px",
        "Pixels per unit of r: 1 for coefficients in px/radⁿ; 0 fits the field of view to the image.",
        minimum=0,
    )

    mugs: list[str] = param(["1.0 0.3"], "", "Older place of [World] Gliders, which all cameras see.", name="MUGs")

    def configure(self) -> None:
        adopt_world_options(self, "MUGs")
        super().configure()
        model = self.camera_model()
        warnings = [uncovered_warning(model.lens.fov, self.faces)]
        if model.circle_diameter > self.size + 1e-6:
            warnings.append(f"the image circle of {model.circle_diameter:.0f} px is cut off at {self.size} px")
        for text in filter(None, warnings):
            self.after(0.0, self.log.warning, text)  # later: at load, no task receives messages yet

    def face_width_and_count(self) -> tuple[int, int]:
        return self.face_size, self.faces

    @property
    def mount(self) -> Pose:
        return DOWN

    def camera_model(self) -> optics.FisheyeModel:
        fov = math.radians(self.field_of_view)
        name = "Field of View"
        try:
            if self.lens_coefficients:
                name = "Lens Coefficients" if 0.0 < self.field_of_view <= 360.0 else name
                lens = Lens(tuple(self.lens_coefficients), fov)
            else:
                lens = preset_lens(self.lens, fov)
            return optics.FisheyeModel.from_lens(lens, self.size, self.focal_length)
        except ValueError as error:
            raise ParameterError(name, str(error)) from None

    def pose_and_lens_metadata(self, view: VehicleView, camera: CameraModel) -> dict[str, float]:
        fov = {"fov": camera.lens.fov} if isinstance(camera, optics.FisheyeModel) else {}
        return {**fov, **super().pose_and_lens_metadata(view, camera)}
