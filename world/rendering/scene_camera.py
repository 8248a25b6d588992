"""A camera on a vehicle that looks into a rendered scene."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from support.pose import DOWN, Pose
from world.optics import CameraModel
from world.rendering.camera_pose import CameraPose, board_cut_share, number_gliders
from world.rendering.labels import ImageLabels, Labeler
from world.rendering.light.caustics import Caustics
from world.rendering.light.lamps import Lamp
from world.rendering.objects.calibration_targets import Board
from world.rendering.objects.glider import Glider
from world.rendering.objects.marine_snow import MarineSnow
from world.rendering.objects.seabed_and_walls import SeabedAndWalls, Wall
from world.rendering.remap_interpolation import make_resampler
from world.rendering.remap_table import RemapTable, finest_face_width
from world.rendering.renderer import Renderer
from world.rendering.scenes import Scene, ScenePose, SeabedScene, make_scene
from world.sea import Bathymetry, SeaState
from world.sun import Sun


@dataclass(frozen=True)
class SceneCamera:
    """All that a picture depends on except the pose. `visibility` is in m; 0 takes the default of the scene.

    `mount` is where the camera is in its vehicle; by default it looks down, the top of the picture toward the bow.
    `face_width` (px) is that of the square views of 90° that make up a picture; 0 is as fine as the picture itself.
    `water` is one of Jerlov's types, which has a visibility of its own. `lamps` are those of the vehicle; they shine
    under water only. `marine_snow` is how many flakes are in a cubic meter of it. `caustics` is how much light the
    waves gather on the ground, 0 to 1 for a clear sky. With soundings, `seabed` is the ground, in place of a plane
    `height` m below the vehicle; `walls` reach from the ground to the surface. `glider_positions` are positions of
    gliders in m north and east of the scene's origin, on the ground beneath the camera. All cameras with the same seed
    see the same seabed. The first picture takes some tenths of a second longer, since it builds the tables.
    """

    optics: CameraModel
    face_width: int = 512
    faces: int = 5
    interpolation: str = "nearest"
    scene: str = "Seabed"
    visibility: float = 0.0
    glider_positions: tuple[tuple[float, float], ...] = ()
    seed: int = 0
    waves: SeaState = field(default_factory=SeaState)
    sun: Sun = field(default_factory=Sun)
    mount: Pose = DOWN
    water: str = ""
    lamps: tuple[Lamp, ...] = ()
    marine_snow: float = 0.0
    caustics: float = 0.0
    seabed: Bathymetry | None = None
    walls: tuple[Wall, ...] = ()

    def take_picture(
        self, pose: ScenePose, gliders: Sequence[Glider] | None = None, boards: Sequence[Board] = ()
    ) -> NDArray[np.uint8]:
        """RGBA (height, width, 4) from where the vehicle is; all zero where the camera sees nothing.

        `gliders` replace those at `glider_positions`. Raises ValueError for a height that contradicts depth and seabed.
        """
        self._landscape.check_height(pose.north, pose.east, pose.depth, pose.height)
        assemble, renderer = self._tables
        return assemble(renderer.render(pose, self._gliders(gliders), boards))

    def labels(
        self,
        pose: ScenePose,
        gliders: Sequence[Glider] | None = None,
        following: tuple[ScenePose, Sequence[Glider]] | None = None,
        boards: Sequence[Board] = (),
    ) -> ImageLabels:
        """Labels for `take_picture` there; see Labeler.labels."""
        return self._labeller.labels(pose, self._gliders(gliders), following, boards)

    def flow(
        self,
        labels: ImageLabels,
        pose: ScenePose,
        gliders: Sequence[Glider] | None,
        following: tuple[ScenePose, Sequence[Glider]],
    ) -> NDArray[np.float32]:
        """The flow (height, width, 2) of labels that were made at a pose; see Labeler.flow."""
        return self._labeller.flow(labels, pose, self._gliders(gliders), following)

    def cut_share(self, pose: ScenePose, thing: Glider | Board) -> float:
        """The share, 0 to 1, of the view of an object that lies beyond the picture. Raises ValueError like `labels`."""
        sight = CameraPose.from_pose(pose, self.mount, self.scene, self._landscape)
        if isinstance(thing, Board):
            return board_cut_share(thing, sight, self.optics)
        return 1.0 - sight.capsule_of(thing).in_image_share(self.optics)

    def obstruction(self, pose: ScenePose) -> str:
        """Reason why there is no picture from this place: the camera is in the ground or in a wall; else empty."""
        place = pose.at_mount(self.mount)
        return self._landscape.obstruction((place.north, place.east, place.depth), place.height)

    def numbered_gliders(self, given: Sequence[Glider] | None) -> tuple[Glider, ...]:
        """Gliders with the numbers that `labels` gives them. Raises ValueError for numbers that it rejects."""
        return number_gliders(self._gliders(given))

    def _gliders(self, given: Sequence[Glider] | None) -> Sequence[Glider]:
        return [Glider(north, east) for north, east in self.glider_positions] if given is None else given

    @cached_property
    def _labeller(self) -> Labeler:
        return Labeler(self.optics, self.mount, self.scene, self._landscape)

    def split_into_bands(self, count: int) -> tuple["SceneCamera", ...]:
        """Cameras that see `count` bands of rows of about the same height, from the top, in the same scene."""
        if count == 1:
            return (self,)
        optics, borders = self.optics, [self.optics.height * n // count for n in range(count + 1)]
        parts = [
            replace(self, optics=replace(optics, height=last - first, cy=optics.cy - first))
            for first, last in pairwise(borders)
        ]
        for part in parts:
            vars(part)["_scene"] = self._scene  # its textures take long to make
            vars(part)["_snow"], vars(part)["_caustics"] = self._snow, self._caustics
            vars(part)["_landscape"] = self._landscape
        return tuple(parts)

    @cached_property
    def _scene(self) -> Scene:
        return make_scene(self.scene, self.visibility, self.seed, self.waves, self.sun, self.water)

    @cached_property
    def _snow(self) -> MarineSnow | None:
        return MarineSnow(self.marine_snow, self.seed) if self.marine_snow else None

    @cached_property
    def _caustics(self) -> Caustics | None:
        if not self.caustics or not isinstance(self._scene, SeabedScene):
            return None
        return Caustics(self.caustics, self.waves, self.sun, self._scene.water, self.seed)

    @cached_property
    def _landscape(self) -> SeabedAndWalls:
        return SeabedAndWalls(self.seabed, self.walls) if self.scene == "Seabed" else SeabedAndWalls()

    @cached_property
    def _tables(self) -> tuple[Callable[[NDArray[np.uint32]], NDArray[np.uint8]], Renderer]:
        width = self.face_width or finest_face_width(self.optics)
        lookup = RemapTable(self.optics, width, self.faces)
        seen, water = (lookup.rows, lookup.columns), (self._snow, self._caustics)
        renderer = Renderer(self._scene, width, self.faces, *seen, self.mount, self.lamps, *water, self._landscape)
        return make_resampler(lookup, self.interpolation), renderer
