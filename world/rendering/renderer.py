"""Renders the surroundings of a vehicle into the faces of a camera."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.pose import DOWN, Pose
from support.rotations import rotation
from world.rendering.cube_faces import empty_atlas, face_rotations
from world.rendering.light import scene_colors
from world.rendering.light.caustics import Caustics
from world.rendering.light.lamps import Lamp, LampBeam, lamp_beams
from world.rendering.objects import calibration_targets, marine_snow, walls
from world.rendering.objects.calibration_targets import Board
from world.rendering.objects.glider import CameraGlider, Glider, Pixels, draw_glider, glider_contact_geometry
from world.rendering.objects.marine_snow import MarineSnow
from world.rendering.objects.seabed_and_walls import RestingBody, SeabedAndWalls
from world.rendering.scenes import Scene, ScenePose, SeabedScene
from world.rendering.seabed.ray_interpolation import rotate
from world.rendering.seabed.seabed_renderer import SeabedRenderer
from world.rendering.textured_planes import PlaneCaster

Floats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]

# Columns are the x (right), y (down) and z (ahead) of a picture in the frame of the sensor that takes it.
OPTICAL = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def optical_to_body_transform(mount: Pose) -> NDArray[np.float64]:
    """(4, 4), from the optical frame of a camera to the frame in which it has a pose: T_BS of a data set."""
    turn = np.eye(4)
    turn[:3, :3] = OPTICAL
    return np.asarray(mount.transform @ turn, np.float64)


def optical_to_ned_rotation(pose: ScenePose, mount: Pose = DOWN) -> NDArray[np.float64]:
    """(3, 3) rotation from the optical frame of the camera to NED."""
    return np.array(rotation(pose.roll, pose.pitch, pose.yaw)) @ optical_to_body_transform(mount)[:3, :3]


class Renderer:
    """Draws `rows` and `columns` (see RemapTable) of five or six faces of `width` px, all by default."""

    def __init__(
        self,
        scene: Scene,
        width: int,
        faces: int = 5,
        rows: Sequence[tuple[int, int]] = (),
        columns: Sequence[tuple[int, int]] = (),
        mount: Pose = DOWN,
        lamps: Sequence[Lamp] = (),
        snow: MarineSnow | None = None,
        caustics: Caustics | None = None,
        landscape: SeabedAndWalls | None = None,
    ):
        self.scene = scene
        self.width = width
        self.faces: NDArray[np.float64] = face_rotations(faces)
        self.rows: tuple[tuple[int, int], ...]
        self.columns: tuple[tuple[int, int], ...]
        self.rows, self.columns = (tuple(some) or ((0, width),) * faces for some in (rows, columns))
        self.mount: Pose = mount
        self.lamps: tuple[Lamp, ...] = tuple(lamps)
        self.snow: MarineSnow | None = snow
        self.caustics: Caustics | None = caustics
        self.caster: PlaneCaster = PlaneCaster(width)
        self.terrain: SeabedRenderer | None = None
        self.windows: list[tuple[tuple[int, int], tuple[int, int]]] = list(zip(self.rows, self.columns, strict=True))
        self.landscape: SeabedAndWalls = landscape or SeabedAndWalls()
        if self.landscape.relief is not None and isinstance(scene, SeabedScene):
            self.terrain = SeabedRenderer(self.landscape.relief, width, self.faces, self.windows)

    def render(
        self, vehicle: ScenePose, gliders: Sequence[Glider] = (), flat: Sequence[Board] = ()
    ) -> NDArray[np.uint32]:
        """The atlas of the faces (see cube_faces.empty_atlas); the camera's height must be positive."""
        atlas = empty_atlas(len(self.faces), self.width)
        pose, eye = vehicle.at_mount(self.mount), optical_to_ned_rotation(vehicle, self.mount)
        turns, windows = eye @ self.faces, self.windows
        lights = lamp_beams(self.lamps, vehicle.pose, self.mount)
        pixels = atlas[:-1].view(np.uint8).reshape(len(turns), self.width, self.width, 4)
        near = self._surroundings(atlas, eye, pose, lights)
        where = pose.north, pose.east, pose.depth
        here = replace(pose, height=self.landscape.height_above_ground(*where, pose.height))
        if self.caustics is not None and isinstance(self.scene, SeabedScene):
            place, shown = (*where, here.height), self.scene.ground_sunlight_share(here, lights)
            for number, (face, turn, window) in enumerate(zip(pixels, turns, windows, strict=True)):
                close = None if near is None else near[number]
                self.caustics.apply(face, turn, window, self.caster.axis, place, pose.time, shown, close)
        for board in flat:
            offset = board.north - pose.north, board.east - pose.east, pose.height - board.height
            look, cover = (
                self.scene.body_appearance(here, offset, lights),
                self._cover(pose, near, calibration_targets.board_contact_geometry(board, pose.depth + offset[2])),
            )
            for number, (face, turn, window) in enumerate(zip(pixels, turns, windows, strict=True)):
                calibration_targets.draw_board(
                    face, turn, window, board, offset, look, cover and partial(cover, number, turn)
                )
        for mug in _seen(pose, gliders):
            look, cover = (
                self.scene.body_appearance(here, mug.center, lights),
                self._cover(pose, near, _lying(mug, pose)),
            )
            for number, (face, turn, window) in enumerate(zip(pixels, turns, windows, strict=True)):
                draw_glider(face, turn, window, mug, look, self.scene.sun, cover and partial(cover, number, turn))
        if lights and isinstance(self.scene, SeabedScene):
            for face, turn, (rows, columns) in zip(pixels, turns, windows, strict=True):
                window = slice(*rows), slice(*columns)
                scene_colors.add_backscatter(
                    face[window], self.scene.lamp_backscatter(here, turn, self.width, lights)[:, *window]
                )
        if self.snow is not None and isinstance(self.scene, SeabedScene):
            flakes = self.snow.flakes_around(*where, here.height, pose.time)
            shine = self.scene.flake_light(here, flakes.points, lights)
            for face, turn, window in zip(pixels, turns, windows, strict=True):
                marine_snow.draw_flakes(face, turn, window, flakes, shine)
        return atlas

    def _surroundings(
        self, atlas: NDArray[np.uint32], eye: NDArray[np.float64], pose: ScenePose, lights: Sequence[LampBeam]
    ) -> NDArray[np.float32] | None:
        """Draw what is around. Where it can hide bodies: 1 over its distance along the axis of each face (f, w, w)."""
        scene, turns, position = self.scene, eye @ self.faces, (pose.north, pose.east)
        if not isinstance(scene, SeabedScene) or (self.terrain is None and not self.landscape.walls):
            self.caster.draw_planes(atlas, turns, self.windows, scene.planes(pose, lights), position, pose.time)
            return None
        near = np.zeros((len(turns), self.width, self.width), dtype=np.float32)
        if self.terrain is not None:
            self.terrain.draw(atlas, near, eye, pose, scene, lights)
        else:
            planes = scene.planes(pose, lights)
            self.caster.draw_planes(atlas, turns, self.windows, planes, position, pose.time)
            for turn, (rows, columns), close in zip(turns, self.windows, near, strict=True):
                strip = slice(*rows), slice(*columns)
                down = self.caster.linear_field(turn[2], strip)
                below, above = (plane.distance for plane in planes)
                close[strip] = np.where(down > 0.0, down / below, -down / above)
        pixels = atlas[:-1].reshape(near.shape)
        for wall in self.landscape.walls:
            for face, close, turn, window in zip(pixels, near, turns, self.windows, strict=True):
                walls.draw_wall(face, close, turn, window, wall, pose, scene, lights)
        return near

    def _cover(
        self, pose: ScenePose, near: NDArray[np.float32] | None, lying: RestingBody
    ) -> Callable[[int, NDArray[np.float64], Pixels, Floats], Bools] | None:
        """Function that finds the pixels of a body on a face, whose frame `turn` rotates to NED, that are hidden."""
        if near is None:
            return None
        place, bed = (pose.north, pose.east, pose.depth), self.landscape.sink_depth(*lying)

        def cover(number: int, turn: NDArray[np.float64], pixels: Pixels, body: Floats) -> Bools:
            found = near[number][pixels] > body
            (own,) = np.nonzero(found)
            if own.size:
                y, x = (self.caster.axis[each[own]].astype(np.float64) for each in pixels)
                rays = rotate(turn, np.stack((x, y, np.ones_like(x))))
                found[own] = self.landscape.occludes(place, rays, body[own], bed)
            return found

        return cover


def _lying(mug: CameraGlider, pose: ScenePose) -> RestingBody:
    north, east, down = mug.center
    return glider_contact_geometry(
        pose.north + north, pose.east + east, pose.depth + down, mug.heading, mug.length, mug.radius
    )


def _seen(pose: ScenePose, gliders: Sequence[Glider]) -> list[CameraGlider]:
    """The gliders as seen from the camera, the farthest first; one at the camera's very place is not seen."""
    mugs = [
        CameraGlider(
            (g.north - pose.north, g.east - pose.east, pose.height - g.height), g.heading, g.length, g.diameter / 2
        )
        for g in gliders
    ]
    return sorted((mug for mug in mugs if any(mug.center)), key=lambda mug: -float(np.linalg.norm(mug.center)))
