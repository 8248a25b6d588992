"""The inverse map of a fisheye picture: for each pixel, the point of a face that it shows."""

import math

import numpy as np
from numpy.typing import NDArray

from world.optics import Floats, Projection
from world.pictures.faces import WIDEST_OF_FIVE, rotations

OUTSIDE, VOID = -2, -1


def void_warning(fov: float, faces: int) -> str:
    """A warning if faces leave gaps in a field of view (rad), else empty."""
    if faces > 5 or fov <= WIDEST_OF_FIVE:
        return ""
    return (
        f"five faces fill {math.degrees(WIDEST_OF_FIVE):.2f}° only; at {math.degrees(fov):g}° "
        "the diagonals have black gaps: use six faces"
    )


class Lookup:
    """For each pixel of a picture of `projection.size` px, the face that it shows and the point of that face.

    `face` (size, size) int8 is the face of each pixel, VOID if no face covers it, OUTSIDE beyond the image circle.
    `u`, `v` (size, size) float64 is the point of that face, px, 0 at the center of its first pixel; NaN without a face.
    `rows[f]` are the rows of face f that are used, as (first, last + 1).
    Raises ValueError for a face without pixels, and unless there are five or six faces.
    """

    def __init__(self, projection: Projection, face_width: int, faces: int = 5):
        if face_width < 1:
            raise ValueError(f"a face of {face_width} px has no pixels")
        self.size = projection.size
        self.face_width = face_width
        self.faces = faces
        turn = rotations(faces)
        rays, inside = projection.rays()
        self.face = _nearest_face(rays, inside, faces)
        self.u = np.full(self.face.shape, np.nan)
        self.v = np.full(self.face.shape, np.nan)
        self.rows = tuple(self._place(rays, f, turn[f]) for f in range(faces))

    @property
    def void(self) -> float:
        """Share of the image circle that no face fills."""
        return float(np.sum(self.face == VOID) / np.sum(self.face != OUTSIDE))

    def _place(self, rays: Floats, face: int, turn: NDArray[np.float64]) -> tuple[int, int]:
        shown = self.face == face
        x, y, z = np.moveaxis(rays[shown] @ turn, -1, 0)
        half = self.face_width / 2
        self.u[shown] = (x / z + 1) * half - 0.5
        self.v[shown] = v = (y / z + 1) * half - 0.5
        if not v.size:
            return 0, 0
        # A bilinear blend reads the rows on both sides.
        return max(0, math.floor(v.min())), min(self.face_width, math.floor(v.max()) + 2)


def _nearest_face(rays: Floats, inside: NDArray[np.bool_], faces: int) -> NDArray[np.int8]:
    """The face whose axis is nearest to each ray; the first of equally near ones."""
    x, y, z = np.moveaxis(rays, -1, 0)
    face = np.zeros(inside.shape, dtype=np.int8)
    nearest = z.copy()
    for number, along in ((1, -y), (2, x), (3, y), (4, -x), (5 if faces > 5 else VOID, -z)):
        closer = along > nearest
        face[closer] = number
        np.copyto(nearest, along, where=closer)
    face[~inside] = OUTSIDE
    return face
