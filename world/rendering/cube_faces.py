"""The five or six square 90° views that make up a fisheye picture."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from support.rotations import matrix_from_quaternion

Window = tuple[tuple[int, int], tuple[int, int]]
"""First and last + 1 of rows, and of columns, of a face."""

FACE_NAMES = ("down", "front", "right", "back", "left", "up")

# Widest field of view, rad, that five faces fill: the upper corners of the side faces lie acos(-1/√3) off the axis.
WIDEST_OF_FIVE = 2 * math.acos(-1 / math.sqrt(3))

# From the optical frame of a face (x right, y down, z forward) to that of the face `down`, as [w, x, y, z].
_H = math.sqrt(0.5)
QUATERNIONS = (
    (1.0, 0.0, 0.0, 0.0),
    (_H, _H, 0.0, 0.0),
    (0.5, 0.5, 0.5, 0.5),
    (0.0, 0.0, _H, _H),
    (0.5, 0.5, -0.5, -0.5),
    (0.0, 1.0, 0.0, 0.0),
)


def face_rotations(count: int) -> NDArray[np.float64]:
    """(count, 3, 3) matrices from each face's optical frame to that of `down`. Raises ValueError unless 5 or 6."""
    if count not in (5, 6):
        raise ValueError(f"a fisheye picture has 5 or 6 faces, not {count}")
    return np.rint([matrix_from_quaternion(q) for q in QUATERNIONS[:count]])


def pixel_axis(width: int) -> NDArray[np.float32]:
    """Tangents of the angles between a face's axis and the pixels across it: from -1 to 1."""
    return np.linspace(1 / width - 1, 1 - 1 / width, width, dtype=np.float32)


def empty_atlas(count: int, width: int) -> NDArray[np.uint32]:
    """A flat array for `count` faces of RGBA pixels, one below the other, and one black pixel after them."""
    if width < 1:
        raise ValueError(f"a face of {width} px has no pixels")
    atlas = np.empty(count * width * width + 1, dtype=np.uint32)
    atlas[-1] = 0
    return atlas


def stack_faces(faces: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint32]:
    """The atlas of faces (w, w, 4) RGBA or (w, w, 3) RGB, in the order of NAMES.

    Raises ValueError if they are not 5 or 6 squares of one size.
    """
    face_rotations(len(faces))
    width = faces[0].shape[0]
    atlas = empty_atlas(len(faces), width)
    pixels = atlas[:-1].view(np.uint8).reshape(len(faces), width, width, 4)
    pixels[..., 3] = 255
    for name, face, room in zip(FACE_NAMES, faces, pixels, strict=False):
        if face.ndim != 3 or face.shape[:2] != (width, width) or face.shape[2] not in (3, 4):
            raise ValueError(f"the face {name} has shape {face.shape}, not ({width}, {width}, 3 or 4)")
        room[..., : face.shape[2]] = face
    return atlas
