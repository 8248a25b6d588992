"""The inverse map of a picture: for each pixel, the point of a face that it shows."""

import math

import numpy as np
from numpy.typing import NDArray

from world.optics import CameraModel, Floats
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
    """For each pixel of a picture (height, width), the face that it shows and the point of that face.

    `face` (height, width) int8 is the face of each pixel, VOID if no face covers it, OUTSIDE where the camera sees
    nothing. `u`, `v` (height, width) float64 is the point of that face, px, 0 at the center of its first pixel; NaN
    without a face. `rows[f]` and `columns[f]` are those of face f that are used, as (first, last + 1).
    Raises ValueError for a face without pixels, and unless there are five or six faces.
    """

    def __init__(self, optics: CameraModel, face_width: int, faces: int = 5):
        if face_width < 1:
            raise ValueError(f"a face of {face_width} px has no pixels")
        self.shape = optics.height, optics.width
        self.face_width = face_width
        self.faces = faces
        turn = rotations(faces)
        rays, inside = optics.centers()
        self.face = _nearest_face(rays, inside, faces)
        self.u = np.full(self.shape, np.nan)
        self.v = np.full(self.shape, np.nan)
        windows = [self._place(rays, f, turn[f]) for f in range(faces)]
        self.columns = tuple(columns for columns, _ in windows)
        self.rows = tuple(rows for _, rows in windows)

    @property
    def void(self) -> float:
        """Share of the image circle that no face fills."""
        return float(np.sum(self.face == VOID) / np.sum(self.face != OUTSIDE))

    def _place(self, rays: Floats, face: int, turn: NDArray[np.float64]) -> tuple[tuple[int, int], tuple[int, int]]:
        shown = self.face == face
        x, y, z = np.moveaxis(rays[shown] @ turn, -1, 0)
        half = self.face_width / 2
        self.u[shown] = u = (x / z + 1) * half - 0.5
        self.v[shown] = v = (y / z + 1) * half - 0.5
        return self._span(u), self._span(v)

    def _span(self, places: Floats) -> tuple[int, int]:
        """The pixels around places; a bilinear blend reads those on both sides."""
        if not places.size:
            return 0, 0
        return max(0, math.floor(places.min())), min(self.face_width, math.floor(places.max()) + 2)


def _nearest_face(rays: Floats, inside: NDArray[np.bool_], faces: int) -> NDArray[np.int8]:
    """The face whose axis is nearest to each ray; the first of equally near ones."""
    x, y, z = np.moveaxis(np.where(inside[..., np.newaxis], rays, 1.0), -1, 0)
    face = np.zeros(inside.shape, dtype=np.int8)
    nearest = z.copy()
    for number, along in ((1, -y), (2, x), (3, y), (4, -x), (5 if faces > 5 else VOID, -z)):
        closer = along > nearest
        face[closer] = number
        np.copyto(nearest, along, where=closer)
    face[~inside] = OUTSIDE
    return face
