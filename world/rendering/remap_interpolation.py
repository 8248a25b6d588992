"""Assembles a picture from its faces with a lookup table."""

import importlib
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from world.rendering.remap_table import STRIP, RemapTable

Atlas = NDArray[np.uint32]
Image = NDArray[np.uint8]

INTERPOLATIONS = ("nearest", "bilinear", "opencv")
TILE = 1 << 15  # pixels per step of the blend: as many as fit into the L2 cache
EVEN_BYTES = np.uint32(0x00FF00FF)
HALVES = np.uint32(0x00800080)
EIGHT = np.uint32(8)
WHOLE = np.uint32(256)


def make_resampler(lookup: RemapTable, interpolation: str) -> Callable[[Atlas], Image]:
    """A function from an atlas (see cube_faces.empty_atlas) to a picture (height, width, 4), by one of INTERPOLATIONS.

    "opencv" is bilinear, too, faster, and differs by 1 in a few of a hundred values. Raises ImportError without OpenCV.
    """
    kinds = {"nearest": NearestResampler, "bilinear": BilinearResampler, "opencv": OpencvResampler}
    return kinds[interpolation](lookup)


class NearestResampler:
    """The nearest pixel of the face."""

    def __init__(self, lookup: RemapTable):
        self.shape: tuple[int, int] = lookup.shape
        self.pixels: int = _pixels(lookup)
        last = lookup.face_width - 1
        column, row = (np.empty(self.shape, dtype=np.int64) for _ in range(2))
        for start in range(0, len(column), STRIP):
            rows = slice(start, start + STRIP)
            for found, place in ((column, lookup.u), (row, lookup.v)):
                found[rows] = np.minimum(np.fmax(np.floor(place[rows] + 0.5), 0.0), last)  # 0 in place of NaN
        self.index: NDArray[np.int64] = _index(lookup, column, row)

    def __call__(self, atlas: Atlas) -> Image:
        _check(atlas, self.pixels)
        picture = np.empty(math.prod(self.shape), dtype=np.uint32)
        # With an int64 index and mode clip, np.take neither copies the index nor buffers the output.
        np.take(atlas, self.index, out=picture, mode="clip")
        return _image(picture, self.shape)


class BilinearResampler:
    """The four nearest pixels of the same face, blended in NumPy: two channels at a time in the halves of a word."""

    def __init__(self, lookup: RemapTable):
        self.shape: tuple[int, int] = lookup.shape
        self.pixels: int = _pixels(lookup)
        self.width: int = lookup.face_width
        last = lookup.face_width - 1
        u, v = (np.clip(np.nan_to_num(a), 0, last) for a in (lookup.u, lookup.v))
        column, row = (np.clip(np.floor(a), 0, max(0, last - 1)).astype(np.int64) for a in (u, v))
        self.corner: NDArray[np.int64] = _index(lookup, column, row)
        self.right: NDArray[np.uint32]
        self.below: NDArray[np.uint32]
        self.right, self.below = (np.rint(a.ravel() * 256).astype(np.uint32) for a in (u - column, v - row))

    def __call__(self, atlas: Atlas) -> Image:
        _check(atlas, self.pixels)
        picture = np.zeros(math.prod(self.shape), dtype=np.uint32)
        for start in range(0, picture.size, TILE):
            part = slice(start, start + TILE)
            corner, right, below = self.corner[part], self.right[part], self.below[part]
            upper = atlas.take(corner, mode="clip"), atlas.take(corner + 1, mode="clip")
            corner = corner + self.width
            lower = atlas.take(corner, mode="clip"), atlas.take(corner + 1, mode="clip")
            for shift in (np.uint32(0), EIGHT):
                top, bottom = (_mix(left >> shift, other >> shift, right) for left, other in (upper, lower))
                picture[part] |= _mix(top, bottom, below) << shift
        return _image(picture, self.shape)


class OpencvResampler:
    """The four nearest pixels of the same face, blended by OpenCV."""

    def __init__(self, lookup: RemapTable):
        self.cv2: Any = importlib.import_module("cv2")
        self.shape: tuple[int, int] = lookup.shape
        self.pixels: int = _pixels(lookup)
        self.width: int = lookup.face_width
        last, nowhere = lookup.face_width - 1, -10.0
        below = np.clip(lookup.v, 0, last) + lookup.face.astype(np.float64) * lookup.face_width
        self.x: NDArray[np.float32] = np.nan_to_num(np.clip(lookup.u, 0, last), nan=nowhere).astype(np.float32)
        self.y: NDArray[np.float32] = np.nan_to_num(below, nan=nowhere).astype(np.float32)

    def __call__(self, atlas: Atlas) -> Image:
        _check(atlas, self.pixels)
        pixels = atlas[:-1].view(np.uint8).reshape(-1, self.width, 4)
        return np.asarray(self.cv2.remap(pixels, self.x, self.y, self.cv2.INTER_LINEAR), dtype=np.uint8)


def _pixels(lookup: RemapTable) -> int:
    return lookup.faces * lookup.face_width**2


def _index(lookup: RemapTable, column: NDArray[np.int64], row: NDArray[np.int64]) -> NDArray[np.int64]:
    """Flat index into the atlas; without a face, that of the black pixel after the faces."""
    index = (lookup.face.astype(np.int64) * lookup.face_width + row) * lookup.face_width + column
    index[lookup.face < 0] = _pixels(lookup)
    return index.ravel()


def _mix(first: Atlas, second: Atlas, weight: NDArray[np.uint32]) -> Atlas:
    """Mix bytes 0 and 2 of two words, with `weight`/256 of the second, rounded."""
    mixed, other = first & EVEN_BYTES, second & EVEN_BYTES
    mixed *= WHOLE - weight
    other *= weight
    mixed += other
    mixed += HALVES
    mixed >>= EIGHT
    mixed &= EVEN_BYTES
    return mixed


def _check(atlas: Atlas, pixels: int) -> None:
    if atlas.shape != (pixels + 1,):
        raise ValueError(f"the atlas has {atlas.size} pixels, not {pixels + 1}: those of the faces and a black one")


def _image(picture: Atlas, shape: tuple[int, int]) -> Image:
    return picture.view(np.uint8).reshape(*shape, 4)
