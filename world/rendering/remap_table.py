"""The inverse map of a picture: for each pixel, the point of a face that it shows."""

import math

import numpy as np
from numpy.typing import NDArray

from world.optics import CameraModel, Floats
from world.rendering.cube_faces import WIDEST_OF_FIVE, face_rotations

OUTSIDE, VOID = -2, -1
STRIP = 32  # rows that are looked up together: their temporary arrays fit into the L2 cache
FINEST = 8192  # px


def uncovered_warning(fov: float, faces: int) -> str:
    """A warning if faces leave gaps in a field of view (rad), else empty."""
    if faces > 5 or fov <= WIDEST_OF_FIVE:
        return ""
    return (
        f"five faces fill {math.degrees(WIDEST_OF_FIVE):.2f}° only; at {math.degrees(fov):g}° "
        "the diagonals have black gaps: use six faces"
    )


def finest_face_width(optics: CameraModel) -> int:
    """Width (px) of a face whose pixels, at its middle, are as large as those of a camera on its axis.

    If that of the picture is even, so is that of a face: else all pixels would look at borders between those of the
    face, and the nearest one would always be the outer one.
    """
    odd = optics.width % 2
    return min(FINEST, max(1, odd + 2 * round(np.abs(optics.jacobian([0.0, 0.0, 1.0])).max() - 0.5 * odd)))


class RemapTable:
    """The face, and the point of it, that each pixel of a picture (height, width) shows.

    `face` (height, width) int8 is the face of each pixel, VOID if no face covers it, OUTSIDE where the camera sees
    nothing. `u`, `v` (height, width) float64 is the point of that face, px, 0 at the center of its first pixel; NaN
    without a face. `rows[f]` and `columns[f]` are those of face f that are used, as (first, last + 1).
    Raises ValueError for a face without pixels, and unless there are five or six faces.
    """

    def __init__(self, optics: CameraModel, face_width: int, faces: int = 5):
        if face_width < 1:
            raise ValueError(f"a face of {face_width} px has no pixels")
        self.shape: tuple[int, int] = optics.height, optics.width
        self.face_width = face_width
        self.faces = faces
        self.face: NDArray[np.int8] = np.empty(self.shape, np.int8)
        self.u: NDArray[np.float64] = np.empty(self.shape)
        self.v: NDArray[np.float64] = np.empty(self.shape)
        turns, spans = face_rotations(faces), np.tile((np.inf, -np.inf), (faces, 2, 1))
        rays, inside = optics.pixel_rays()
        for first in range(0, optics.height, STRIP):
            rows = slice(first, first + STRIP)
            self._fill(rows, np.ascontiguousarray(np.moveaxis(rays[rows], -1, 0)), inside[rows], turns, spans)
        self.columns: tuple[tuple[int, int], ...]
        self.rows: tuple[tuple[int, int], ...]
        self.columns, self.rows = (tuple(self._span(*ends) for ends in spans[:, axis].tolist()) for axis in (0, 1))

    @property
    def uncovered_share(self) -> float:
        """Share of the image circle that no face fills."""
        return float(np.sum(self.face == VOID) / np.sum(self.face != OUTSIDE))

    def _fill(self, rows: slice, rays: Floats, inside: NDArray[np.bool_], turns: Floats, spans: Floats) -> None:
        """Fills rows by their rays (3, n, width).

        `spans` (faces, 2, 2) are the least and the largest u, and v, of each face so far.
        """
        face = self.face[rows] = _nearest_face(rays, inside, self.faces)
        places, half = np.full((2, face.size), np.nan), self.face_width / 2
        rays = rays.reshape(3, -1)
        for number, turn in enumerate(turns):
            shown = np.flatnonzero(face == number)
            if not shown.size:
                continue
            axes = np.abs(turn).argmax(axis=0)  # a face is turned by right angles
            x, y, z = (rays[axis].take(shown) * turn[axis, k] for k, axis in enumerate(axes.tolist()))
            for along, place, ends in zip((x, y), places, spans[number], strict=True):
                found = (along / z + 1) * half - 0.5
                place[shown] = found
                ends[:] = min(ends[0], found.min()), max(ends[1], found.max())
        self.u[rows], self.v[rows] = places.reshape(2, *face.shape)

    def _span(self, least: float, largest: float) -> tuple[int, int]:
        """The pixels around places; a bilinear blend reads those on both sides."""
        if least > largest:
            return 0, 0
        return max(0, math.floor(least)), min(self.face_width, math.floor(largest) + 2)


def _nearest_face(rays: Floats, inside: NDArray[np.bool_], faces: int) -> NDArray[np.int8]:
    """The face (n, m) whose axis is nearest to each ray (3, n, m); the first of equally near ones."""
    x, y, z = rays
    face = np.zeros(inside.shape, dtype=np.int8)
    nearest = z.copy()
    with np.errstate(invalid="ignore"):
        for number, along in ((1, -y), (2, x), (3, y), (4, -x), (5 if faces > 5 else VOID, -z)):
            closer = along > nearest
            np.copyto(face, np.int8(number), where=closer)
            np.copyto(nearest, along, where=closer)
    face[~inside] = OUTSIDE
    return face
