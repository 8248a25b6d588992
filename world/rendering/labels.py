"""Exact labels of what a camera sees: distance, depth, class, instance, boxes and optical flow, without a picture."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from support.pose import DOWN, Pose
from world.optics import CameraModel, Floats
from world.rendering.camera_pose import (
    CameraPose,
    board_cut_share,
    board_pixels_and_distances,
    check_scene_name,
    number_gliders,
)
from world.rendering.depth_image import DepthImage
from world.rendering.objects.calibration_targets import Board, board_contact_geometry
from world.rendering.objects.capsule import Capsule
from world.rendering.objects.glider import Glider
from world.rendering.objects.seabed_and_walls import SeabedAndWalls
from world.rendering.optical_flow import compute_flow
from world.rendering.pixel_rays import Bools, PixelRays, Places
from world.rendering.scenes import ScenePose
from world.rendering.seabed.ray_interpolation import rotate

BLOCK = 1 << 14  # pixels per step: their arrays fit into the L2 cache


class PixelClass(IntEnum):
    """Class of a pixel: the numbers of `ImageLabels.kinds`."""

    VOID = 0
    """No object: the lens does not reach there."""
    SEABED = 1
    SURFACE = 2
    """The surface of the sea, from below or from above."""
    SKY = 3
    GLIDER = 4
    BOARD = 5
    WALL = 6


class ObjectBox(NamedTuple):
    """Visible part of one object. Boxes are left, top, right, bottom (px): pixels [left, right) x [top, bottom).

    `box` and `area` (px) count what is visible, all zero behind other objects; `whole_box` and `whole_area` what would
    be seen if the object were alone. `cut_share` is the share, 0 to 1, of its view that lies beyond the picture.
    """

    instance: int
    kind: PixelClass
    box: tuple[int, int, int, int]
    area: int
    whole_box: tuple[int, int, int, int]
    whole_area: int
    cut_share: float

    @property
    def occluded_share(self) -> float:
        """The share, 0 to 1, that other objects hide of what the picture would show."""
        return 1.0 - self.area / self.whole_area


@dataclass(frozen=True, slots=True, eq=False)
class ImageLabels:
    """The labels of one picture, (height, width) as it is, true at the pixel centers.

    `distance` (m, float32) is along the ray, `depth` (m, float32) along the camera's axis, negative behind it; both are
    infinite in the sky and NaN in the void. `kinds` (uint8) are numbers of PixelClass; `instances` (uint16) those of
    the objects, 0 elsewhere. `boxes` are those of the objects that the picture would show if they were alone, in the
    order in which they were given. `flow` (height, width, 2; px, float32) leads to where the same point is seen in the
    next picture, also beside it; it is NaN in the void, for objects that are gone, and for what the lens no longer
    covers.
    """

    distance: NDArray[np.float32]
    depth: NDArray[np.float32]
    kinds: NDArray[np.uint8]
    instances: NDArray[np.uint16]
    boxes: tuple[ObjectBox, ...] = ()
    flow: NDArray[np.float32] | None = None


class Labeler:
    """Labels the pictures of a camera with a mount in the vehicle, in one of SCENES. Raises ValueError for another one.

    As in the pictures, the surface is a plane, and so is the seabed in a landscape without a relief; planes never hide
    a glider. The flow of a plane is that of its points, not of the waves on it.
    """

    def __init__(
        self,
        optics: CameraModel,
        mount: Pose = DOWN,
        scene: str = "Seabed",
        landscape: SeabedAndWalls | None = None,
    ):
        check_scene_name(scene)
        self.optics: CameraModel = optics
        self.mount: Pose = mount
        self.scene: str = scene
        self.landscape: SeabedAndWalls = landscape or SeabedAndWalls()
        self._rays = PixelRays(optics)
        relief = self.landscape.relief
        self._ranging = None if relief is None else DepthImage(optics, self._rays, relief)
        self._below, self._above = (
            (PixelClass.SEABED, PixelClass.SURFACE) if scene == "Seabed" else (PixelClass.SURFACE, PixelClass.SKY)
        )

    def labels(
        self,
        standpoint: ScenePose,
        gliders: Sequence[Glider] = (),
        following: tuple[ScenePose, Sequence[Glider]] | None = None,
        boards: Sequence[Board] = (),
    ) -> ImageLabels:
        """The labels at a standpoint, with flow if standpoint and gliders of the following picture are given.

        Gliders without any number are numbered from 1 in their order. Boards lie still, and have boxes if they have a
        number. Raises ValueError if the camera is within an
        object or under the ground, and for numbers that are not finite, or of two objects.
        """
        gliders = number_gliders(gliders)
        sight = CameraPose.from_pose(standpoint, self.mount, self.scene, self.landscape)
        bodies = {glider.id: sight.capsule_of(glider) for glider in gliders}
        distance, kinds = self._planes(sight) if self._ranging is None else self._ground(sight, self._ranging)
        self._wall_in(sight, distance, kinds)
        instances = np.zeros(distance.shape, dtype=np.uint16)
        flat = [(board, self._lay(board, sight, distance, kinds, instances)) for board in boards]
        beds = {glider.id: self.landscape.sink_depth(*sight.glider_contact_geometry(glider)) for glider in gliders}
        boxes = self._draw(bodies, beds, sight, distance, kinds, instances)
        boxes += tuple(
            ObjectBox(
                board.id,
                PixelClass.BOARD,
                *self._extents(pixels, instances, board.id),
                board_cut_share(board, sight, self.optics),
            )
            for board, pixels in flat
            if board.id and pixels.size
        )
        moved = None
        if following is not None:
            bodies_alone = np.where(kinds == PixelClass.BOARD, np.uint16(0), instances)
            moved = self._flow(distance, bodies_alone, (sight, gliders), following)
        shape = self.optics.height, self.optics.width
        return ImageLabels(
            distance.astype(np.float32).reshape(shape),
            self._depth(distance).reshape(shape),
            kinds.reshape(shape),
            instances.reshape(shape),
            boxes,
            None if moved is None else moved.reshape(*shape, 2),
        )

    def flow(
        self,
        labels: ImageLabels,
        standpoint: ScenePose,
        gliders: Sequence[Glider],
        following: tuple[ScenePose, Sequence[Glider]],
    ) -> NDArray[np.float32]:
        """The flow (height, width, 2) of labels at a standpoint, to another one than theirs may have been made for."""
        sight = CameraPose.from_pose(standpoint, self.mount, self.scene, self.landscape)
        bodies_alone = np.where(labels.kinds == PixelClass.BOARD, np.uint16(0), labels.instances).ravel()
        distance = labels.distance.ravel().astype(np.float64)
        moved = self._flow(distance, bodies_alone, (sight, number_gliders(gliders)), following)
        return moved.reshape(*labels.kinds.shape, 2)

    def _flow(
        self,
        distance: Floats,
        bodies: NDArray[np.uint16],
        now: tuple[CameraPose, Sequence[Glider]],
        following: tuple[ScenePose, Sequence[Glider]],
    ) -> NDArray[np.float32]:
        after = CameraPose.from_pose(following[0], self.mount, self.scene, self.landscape)
        here, there = ({glider.id: glider for glider in each} for each in (now[1], number_gliders(following[1])))
        return compute_flow(
            self.optics,
            self._rays.directions,
            distance,
            bodies,
            (now[0], here),
            (after, there),
            level=self._ranging is None,
        )

    def _planes(self, sight: CameraPose) -> tuple[Floats, NDArray[np.uint8]]:
        """Distances (n,) to the planes below and above, and the kinds (n,) of what is there."""
        count = self._rays.directions.shape[1]
        distance, kinds = np.empty(count), np.empty(count, dtype=np.uint8)
        a, b, c = sight.rotation[2].tolist()
        for start in range(0, count, BLOCK):
            part = slice(start, start + BLOCK)
            x, y, z = self._rays.directions[:, part]
            down = a * x + b * y + c * z
            up = down < 0.0
            with np.errstate(divide="ignore"):
                np.divide(np.where(up, sight.depth, sight.height), np.abs(down), out=distance[part])
            kinds[part] = np.where(up, np.uint8(self._above), np.uint8(self._below))
        kinds[~self._rays.covered] = PixelClass.VOID
        return distance, kinds

    def _ground(self, sight: CameraPose, ranging: DepthImage) -> tuple[Floats, NDArray[np.uint8]]:
        """The same with a relief below."""
        near, (a, b, c) = ranging.inverse_distances(sight.position, sight.rotation), sight.rotation[2].tolist()
        distance, kinds = np.empty(near.size), np.empty(near.size, dtype=np.uint8)
        a, b, c = (each * (-1.0 / sight.depth) for each in (a, b, c))
        with np.errstate(divide="ignore"):
            for start in range(0, near.size, BLOCK):
                part = slice(start, start + BLOCK)
                own, (x, y, z) = near[part], self._rays.directions[:, part]
                top, more = a * x, b * y
                top += more
                top += np.multiply(z, c, out=more)
                np.multiply(top > own, np.uint8(self._above - self._below), out=kinds[part])
                np.maximum(top, own, out=top)
                np.divide(1.0, np.maximum(top, 0.0, out=top), out=distance[part])
        kinds += np.uint8(self._below)
        kinds *= self._rays.covered
        return distance, kinds

    def _wall_in(self, sight: CameraPose, distance: Floats, kinds: NDArray[np.uint8]) -> None:
        """Set the pixels that show walls."""
        if not self.landscape.walls:
            return
        for start in range(0, distance.size, BLOCK):
            part = slice(start, start + BLOCK)
            near = self.landscape.inverse_wall_range(
                sight.position, rotate(sight.rotation, self._rays.directions[:, part])
            )
            with np.errstate(invalid="ignore"):
                (own,) = np.nonzero(near * distance[part] > 1.0)
            distance[start + own], kinds[start + own] = 1.0 / near[own], PixelClass.WALL

    def _behind(self, sight: CameraPose, pixels: Places, far: Floats, distance: Floats, bed: float) -> Bools:
        """Pixels of a body, at distances `far`, that ground or walls hide."""
        found = np.zeros(pixels.shape, dtype=np.bool_)
        if self._ranging is not None or self.landscape.walls:
            (own,) = np.nonzero(distance[pixels] < far)
            rays = rotate(sight.rotation, self._rays.directions.take(pixels[own], axis=1))
            found[own] = self.landscape.occludes(sight.position, rays, 1.0 / far[own], bed)
        return found

    def _lay(
        self,
        board: Board,
        sight: CameraPose,
        distance: Floats,
        kinds: NDArray[np.uint8],
        instances: NDArray[np.uint16],
    ) -> Places:
        """Set the pixels that show a board, and return them; one that was laid before is under it."""
        pixels, far = board_pixels_and_distances(board, sight, self._rays.directions)
        bed = self.landscape.sink_depth(*board_contact_geometry(board, sight.down + sight.height - board.height))
        shown = ~self._behind(sight, pixels, far, distance, bed)
        own = pixels[shown]
        distance[own], kinds[own], instances[own] = far[shown], PixelClass.BOARD, board.id
        return pixels

    def _draw(
        self,
        bodies: Mapping[int, Capsule],
        beds: Mapping[int, float],
        sight: CameraPose,
        distance: Floats,
        kinds: NDArray[np.uint8],
        instances: NDArray[np.uint16],
    ) -> tuple[ObjectBox, ...]:
        """Set the pixels that show bodies, and return the boxes."""
        seen: list[tuple[int, Places, float]] = []
        for number, body in bodies.items():
            pixels, rim = self._rays.pixels_seeing(body)
            far = body.ray_distances(self._rays.directions.take(pixels, axis=1))
            pixels, far = pixels[far < math.inf], far[far < math.inf]
            if pixels.size:
                shown = (instances[pixels] == 0) | (far < distance[pixels])
                shown &= ~self._behind(sight, pixels, far, distance, beds[number])
                own = pixels[shown]
                distance[own], kinds[own], instances[own] = far[shown], PixelClass.GLIDER, number
                seen.append((number, pixels, 1.0 - body.in_image_share(self.optics) if rim else 0.0))
        return tuple(self._box(number, pixels, instances, cut) for number, pixels, cut in seen)

    def _box(self, number: int, whole: Places, instances: NDArray[np.uint16], cut: float) -> ObjectBox:
        return ObjectBox(number, PixelClass.GLIDER, *self._extents(whole, instances, number), cut)

    def _extents(
        self, whole: Places, instances: NDArray[np.uint16], number: int
    ) -> tuple[tuple[int, int, int, int], int, tuple[int, int, int, int], int]:
        visible = whole[instances[whole] == number]
        return self._corners(visible), visible.size, self._corners(whole), whole.size

    def _corners(self, pixels: Places) -> tuple[int, int, int, int]:
        if not pixels.size:
            return 0, 0, 0, 0
        rows, columns = np.divmod(pixels, self.optics.width)
        return int(columns.min()), int(rows.min()), int(columns.max()) + 1, int(rows.max()) + 1

    def _depth(self, distance: Floats) -> NDArray[np.float32]:
        depth = distance * self._rays.directions[2]
        depth[np.isinf(distance)] = math.inf
        return depth.astype(np.float32)
