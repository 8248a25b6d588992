"""Draws the relief of the seabed into square faces."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.rotations import Vector
from world.rendering.cube_faces import Window
from world.rendering.light import LampBeam, rgba_words
from world.rendering.procedural_textures import TONES
from world.rendering.scenes import SHALLOWEST, ScenePose, SeabedScene
from world.rendering.seabed.ray_interpolation import PITCH, TINY, RayGrid, interpolate_nodes, rotate
from world.rendering.seabed.seabed_intersection import SeabedIntersector
from world.rendering.textured_planes import (
    BITS,
    GRAZING,
    PlaneCaster,
    PlaneShader,
    Strip,
    TexturedPlane,
    TextureSampler,
    Words,
    to_texels,
)

Floats = NDArray[np.floating[Any]]
Bools = NDArray[np.bool_]

LENGTHS = 7.0  # attenuation lengths after which the ground is not looked for
SEEN = 4.5  # attenuation lengths within which its edges are sharp
FAINT = 0.4  # of the nearness of one attenuation length: where the ground may be elsewhere by twice as much
FARTHEST = 1000.0  # m
ERROR = 0.25  # px by which a point of the ground may be elsewhere between the rays of the lattice
FLATTEST = 0.02  # sine of the angle between a ray and the ground, below which texture is invisible
BAND = 64  # rows of a face that are painted together
FIELDS = 8  # nearness, coarseness of the texture, light on the ground by color, and that of the water before it


class SeabedRenderer:
    """The relief in a camera's faces of `width` px, of which `windows` are drawn; `turns` as in RayGrid."""

    def __init__(self, relief: SeabedIntersector, width: int, turns: NDArray[np.float64], windows: Sequence[Window]):
        self.relief: SeabedIntersector = relief
        self.width: int = width
        self.turns: NDArray[np.float64] = turns
        self.windows: Sequence[Window] = windows
        self.lattice: RayGrid = RayGrid(width, turns, windows)
        self.caster: PlaneCaster = PlaneCaster(width)

    def draw(
        self,
        atlas: Words,
        near: NDArray[np.float32],
        camera: NDArray[np.float64],
        pose: ScenePose,
        scene: SeabedScene,
        lights: Sequence[LampBeam],
    ) -> None:
        """Fill the windows, and `near` (f, w, w) with 1 over the distance along the axis of each face.

        `camera` (3, 3) rotates the camera's frame to NED, and `pose` is the camera's own place.
        """
        pose = replace(pose, height=self.relief.sea.depth(pose.north, pose.east) - pose.depth)
        view = _View(self, camera, pose, scene, lights)
        lattice = self.lattice
        rays = rotate(camera, lattice.rays)
        view.highest = float((-rays[2] / np.sqrt(np.sum(rays * rays, axis=0))).max(initial=0.0)) + lattice.cell
        nearness, rough = view.meet(rays, lattice.cell)
        fields, sine = view.fields(rays, nearness)
        close = np.abs(nearness)
        error = ERROR * 2.0 / self.width / sine * (close + view.faint / np.maximum(close, view.nearest)) + TINY
        cells = [worst > 1.0 for worst in lattice.interpolation_errors(nearness, rough, error, view.nearest)]
        masks = [spot.repeat(PITCH, axis=0).repeat(PITCH, axis=1) if spot.any() else None for spot in cells]
        exact = self._in_the_rough(view, camera, masks)
        pixels = atlas[:-1].reshape(len(self.turns), self.width, self.width)
        done = 0
        for patch, turn, window, face, close, mask in zip(
            lattice.patches, camera @ self.turns, self.windows, pixels, near, masks, strict=True
        ):
            nodes = patch.select_face_values(fields)
            (first, last), (left, right) = window
            for cell in range(0, max(0, nodes.shape[1] - 1), BAND // PITCH):
                rows = slice(cell, min(cell + BAND // PITCH, nodes.shape[1] - 1))
                values = interpolate_nodes(nodes, rows)
                if mask is not None:
                    own = mask[rows.start * PITCH : rows.stop * PITCH]
                    count = np.count_nonzero(own)
                    values[:, own] = exact[:, done : done + count]
                    done += count
                top, side = (patch.row + cell) * PITCH, patch.column * PITCH
                strip = slice(max(first, top), min(last, top + values.shape[1])), slice(left, right)
                if strip[0].start < strip[0].stop:
                    inner = values[:, strip[0].start - top : strip[0].stop - top, left - side : right - side]
                    close[strip] = view.paint(face[strip], turn, strip, inner)

    def _in_the_rough(self, view: "_View", camera: NDArray[np.float64], masks: Sequence[Bools | None]) -> Floats:
        """The fields (FIELDS, n) of the pixels that `masks` of the patches choose, ray by ray."""
        found: list[Floats] = []
        for mask, patch, turn in zip(masks, self.lattice.patches, self.turns, strict=True):
            if mask is not None:
                j, i = np.nonzero(mask)
                y, x = (
                    (2.0 * (place + PITCH * start) + 1.0) / self.width - 1.0
                    for place, start in ((j, patch.row), (i, patch.column))
                )
                found.append(rotate(turn, np.stack((x, y, np.ones_like(x)))))
        if not found:
            return np.empty((FIELDS, 0), dtype=np.float32)
        rays = rotate(camera, np.concatenate(found, axis=1))
        nearness, _ = view.meet(rays, 0.0)
        return view.fields(rays, nearness)[0]


class _View:
    """One picture of a terrain: its water_optics, and its textures."""

    def __init__(
        self,
        terrain: SeabedRenderer,
        camera: NDArray[np.float64],
        pose: ScenePose,
        scene: SeabedScene,
        lights: Sequence[LampBeam],
    ):
        self.terrain, self.pose, self.scene, self.lights = terrain, pose, scene, lights
        self.place: Vector = (pose.north, pose.east, pose.depth)
        length = 1.0 / float(scene.water.attenuation.min())
        self.reach, self.nearest = min(LENGTHS * length, FARTHEST), 1.0 / (SEEN * length)
        self.faint = (FAINT / length) ** 2
        self.surface: PlaneShader | None = None
        self.highest = 1.0
        bottom = TexturedPlane(1, 1.0, scene.bottom_layers, np.empty(0, dtype=np.uint32))
        self.prints = [
            TextureSampler(layer, bottom, 1.0, (pose.north, pose.east), pose.time) for layer in scene.bottom_layers
        ]
        self.texels = [np.float32(np.log2(layer.texel)) for layer in scene.bottom_layers]
        self.coarsest = min(layer.coarsest + texel for layer, texel in zip(self.prints, self.texels, strict=True))
        self.colors = scene.bottom_colors[:, 0]

    def meet(self, rays: Floats, cell: float) -> tuple[Floats, Bools]:
        return self.terrain.relief.intersect(self.place, rays, self.reach, cell=cell)

    def fields(self, rays: Floats, nearness: Floats) -> tuple[Floats, Floats]:
        """(FIELDS, n) of what rays (3, n; NED) meet at a nearness (n,), and the sines (n,) of their angles with it."""
        length = np.sqrt(np.sum(rays * rays, axis=0))
        away = np.minimum(length / np.maximum(nearness, 1e-9), self.reach)
        points = rays * (away / length)
        slopes = self.terrain.relief.slopes(self.place, points, self.reach)
        steep = np.sqrt(1.0 + slopes[0] ** 2 + slopes[1] ** 2)
        sine = np.abs(slopes[0] * points[0] + slopes[1] * points[1] - points[2]) / (steep * away)
        sine = np.maximum(sine, FLATTEST)
        facing = self.scene.daylight_share_by_normal(slopes[0] / steep, slopes[1] / steep, 1.0 / steep)
        found = np.empty((FIELDS, len(nearness)), dtype=np.float32)
        found[0] = nearness
        coarseness = np.log2(2.0 / self.terrain.width * away) - 0.75 * np.log2(sine) - 0.3
        np.minimum(coarseness, self.coarsest, out=found[1], casting="same_kind")
        found[2:5], found[5:8] = self.scene.ground_and_veil_light(self.pose, self.lights, points, facing)
        return found, sine

    def paint(self, out: Words, turn: NDArray[np.float64], strip: Strip, fields: Floats) -> Floats:
        """Color the pixels (n, m) of a strip, whose fields are (FIELDS, n, m), and return how near they are."""
        nearness = fields[0]
        up = self.terrain.caster.linear_field(-turn[2] / max(self.pose.depth, SHALLOWEST), strip)
        over = up > nearness
        ground, water = _box(~over), _box(over)
        if ground is not None:
            self._paint_ground(out[ground], turn, _part(strip, ground), fields[:, *ground])
        if water is not None:
            self._paint_surface(out[water], turn, _part(strip, water), over[water])
            nearness = np.maximum(nearness, up)
        return nearness

    def _paint_ground(self, out: Words, turn: NDArray[np.float64], strip: Strip, fields: Floats) -> None:
        caster, nearness = self.terrain.caster, fields[0]
        scale = np.reciprocal(np.maximum(nearness, np.float32(0.5 / self.reach)))
        index, bend = np.zeros(nearness.shape, dtype=np.uint16), None
        for layer, texel in zip(self.prints, self.texels, strict=True):
            level = np.ceil(fields[1] - texel).astype(np.int32)
            np.maximum(level, 0, out=level)
            across, down = (
                to_texels(caster.linear_field(axis[:2] @ turn[:2], strip), scale, np.float32(axis[2]))
                for axis in layer.axes
            )
            if bend is not None:
                across += bend
            tones = layer.sample(across, down, level)
            if layer.bends:
                bend = tones >> BITS
                tones &= TONES - 1
            index += tones
        linear = self.colors.take(index, axis=1, mode="clip")
        linear *= fields[2:5]
        out[...] = rgba_words(linear, fields[5:8]).reshape(out.shape)

    def _paint_surface(self, out: Words, turn: NDArray[np.float64], strip: Strip, over: Bools) -> None:
        caster = self.terrain.caster
        if self.surface is None:
            top = self.scene.surface_plane(self.pose, self.lights, self.highest)
            self.surface = PlaneShader(caster, top, (self.pose.north, self.pose.east), self.pose.time)
        sky = np.empty_like(out)
        self.surface.shade(sky, turn, strip, np.maximum(caster.linear_field(-turn[2], strip), GRAZING))
        np.copyto(out, sky, where=over)


def _box(mask: Bools) -> Strip | None:
    """The rows and columns that hold all that a mask chooses; None if that is nothing."""
    spans: list[slice] = []
    for axis in (1, 0):
        own = np.flatnonzero(mask.any(axis=axis))
        if not own.size:
            return None
        spans.append(slice(int(own[0]), int(own[-1]) + 1))
    return spans[0], spans[1]


def _part(strip: Strip, box: Strip) -> Strip:
    rows, columns = (slice(of.start + own.start, of.start + own.stop) for of, own in zip(strip, box, strict=True))
    return rows, columns
