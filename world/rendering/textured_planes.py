"""Casts the rays of square faces onto textured horizontal planes below and above the camera."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from world.rendering.cube_faces import Window, pixel_axis
from world.rendering.light.scene_colors import ROWS, SUMS
from world.rendering.procedural_textures import TONES, WIDE

Floats = NDArray[np.floating[Any]]
Words = NDArray[np.uint32]
Strip = tuple[slice, slice]

STRIP = 32  # rows of a face that are cast together: their temporary arrays fit into the L2 cache
BITS = TONES.bit_length() - 1
GRAZING = 1e-4  # sine of the elevation, next to the horizon, below which texture is invisible
FAR = 8 * WIDE  # keeps texture coordinates positive, so that truncation rounds down


@dataclass(frozen=True)
class TextureLayer:
    """A texture laid on a plane: pyramid (see procedural_textures), texel size in m, heading in rad, drift in m/s."""

    pyramid: NDArray[np.uint8] | NDArray[np.uint16]
    texel: float
    heading: float = 0.0
    drift: float = 0.0


@dataclass(frozen=True)
class TexturedPlane:
    """A plane in one picture: `distance` m below (side 1) or above (side -1) the camera.

    The tones of both layers are added; the first one may shift the second (tone_and_shift_pyramid), so
    that places where both are the same are far apart. `palette` (ROWS * SUMS) holds the RGBA words by elevation and sum
    of tones. Where the light is not the same everywhere, `shade(points, tones)` colors points (3, n, m; m, NED from the
    camera).
    """

    side: int
    distance: float
    layers: tuple[TextureLayer, TextureLayer]
    palette: Words
    shade: Callable[[Floats, NDArray[Any]], Words] | None = None


class PlaneCaster:
    """Casts faces of `width` px strip by strip."""

    def __init__(self, width: int):
        self.width = width
        self.axis: NDArray[np.float32] = pixel_axis(width)
        length = np.sqrt(1 + self.axis[np.newaxis, :] ** 2 + self.axis[:, np.newaxis] ** 2)
        # Times the height of the ray through a pixel, this is its row of the palette: the sine of its elevation * ROWS.
        self.steps: NDArray[np.float32] = (ROWS / length).astype(np.float32)

    def draw_planes(
        self,
        atlas: Words,
        faces: NDArray[np.float64],
        windows: Sequence[Window],
        planes: tuple[TexturedPlane, TexturedPlane],
        position: tuple[float, float],
        time: float,
    ) -> None:
        """Fills a window of each face.

        `faces` (n, 3, 3) rotate optical frames to NED, `position` is north and east in m.
        """
        below, above = (PlaneShader(self, plane, position, time) for plane in planes)
        pixels = atlas[:-1].reshape(len(faces), self.width, self.width)
        for turn, ((first, last), columns), face in zip(faces, windows, pixels, strict=True):
            for start in range(first, last, STRIP):
                strip = slice(start, min(start + STRIP, last)), slice(*columns)
                out, down = face[strip], self.linear_field(turn[2], strip)
                if down.min() > GRAZING:
                    below.shade(out, turn, strip, down)
                elif down.max() < -GRAZING:
                    above.shade(out, turn, strip, -down)
                else:
                    sky = np.empty_like(out)
                    above.shade(sky, turn, strip, np.maximum(-down, GRAZING))
                    below.shade(out, turn, strip, np.maximum(down, GRAZING))
                    np.copyto(out, sky, where=down < 0)

    def linear_field(self, row: NDArray[np.float64], strip: Strip) -> Floats:
        """row · (x, y, 1) at the pixels of a strip, for x, y from -1 to 1 across the face."""
        a, b, c = row.astype(np.float32)
        rows, columns = strip
        return a * self.axis[np.newaxis, columns] + (b * self.axis[rows, np.newaxis] + c)


class PlaneShader:
    """A plane with all that is constant in one picture of it."""

    def __init__(self, caster: PlaneCaster, plane: TexturedPlane, position: tuple[float, float], time: float):
        self.caster = caster
        self.plane = plane
        self.prints: list[TextureSampler] = [
            TextureSampler(layer, plane, 2 / caster.width, position, time) for layer in plane.layers
        ]

    def shade(self, out: Words, turn: NDArray[np.float64], strip: Strip, height: Floats) -> None:
        """Colors pixels whose rays, of length 1 along the face's axis, approach the plane by `height` > 0."""
        step = (height * self.caster.steps[strip]).astype(np.int64)
        np.minimum(step, ROWS - 1, out=step)
        index = step * SUMS if self.plane.shade is None else np.zeros_like(step)
        scale = np.reciprocal(height)
        bend = None
        for layer in self.prints:
            across, down = (to_texels(self.caster.linear_field(axis @ turn, strip), scale) for axis in layer.axes)
            if bend is not None:
                across += bend
            tones = layer.sample(across, down, layer.level.take(step, mode="clip"))
            if layer.bends:
                bend = tones >> BITS
                tones &= TONES - 1
            index += tones
        if self.plane.shade is None:
            np.take(self.plane.palette, index, out=out, mode="clip")
        else:
            points = np.stack([self.caster.linear_field(axis, strip) * scale for axis in turn]) * self.plane.distance
            out[...] = self.plane.shade(points, index)


def to_texels(texels: Floats, scale: Floats, origin: np.float32 | None = None) -> NDArray[np.int32]:
    """Texels from places on the plane that is a unit away, rounded down."""
    texels *= scale
    if origin is not None:
        texels += origin
    with np.errstate(invalid="ignore"):  # out of range next to the horizon, where the texture is one texel
        return texels.astype(np.int32)


class TextureSampler:
    """A layer in one picture.

    `axes` (2, 3) maps directions in NED that approach the plane by 1 to texels across and down the texture.
    """

    def __init__(
        self, layer: TextureLayer, plane: TexturedPlane, pixel: float, position: tuple[float, float], time: float
    ):
        self.stride: int
        size, self.stride = layer.pyramid.shape
        self.mask: int = size - 1
        self.pyramid: NDArray[np.uint8] | NDArray[np.uint16] = layer.pyramid
        self.bends: bool = layer.pyramid.dtype == np.uint16
        cos, sin = math.cos(layer.heading) / layer.texel, math.sin(layer.heading) / layer.texel
        axes = np.array([[-sin, cos, 0.0], [cos, sin, 0.0]])
        self.axes: NDArray[np.float64] = axes * plane.distance
        origin = axes[:, :2] @ np.array(position) + (layer.drift * time / layer.texel, 0.0)
        self.axes[:, 2] = plane.side * (origin % size + FAR)
        sine = (np.arange(ROWS) + 0.5) / ROWS
        # A compromise: the extent of a pixel grows with sine**-2 along the view, with sine**-1 across it.
        footprint = pixel * plane.distance / layer.texel * sine**-1.75
        self.coarsest: int = size.bit_length() - 1
        self.level: NDArray[np.int32] = np.clip(np.ceil(np.log2(footprint) - 0.3), 0, self.coarsest).astype(np.int32)

    def sample(self, column: NDArray[np.int32], row: NDArray[np.int32], level: NDArray[np.int32]) -> NDArray[Any]:
        """The texture at whole texels, 2**level times as coarse. Overwrites what it is given."""
        for place in (column, row):
            place &= self.mask
            place >>= level
        row *= self.stride
        row += column
        row += self.stride
        np.right_shift(self.stride, level, out=level)
        row -= level
        return self.pyramid.take(row, mode="clip")
