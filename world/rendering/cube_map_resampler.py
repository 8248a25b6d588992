"""A picture from views that somebody else has taken."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from world.optics import CameraModel
from world.rendering.cube_faces import face_rotations, stack_faces
from world.rendering.remap_interpolation import make_resampler
from world.rendering.remap_table import RemapTable

Image = NDArray[np.uint8]


class CubeMapAssembler:
    """Makes pictures of a camera with `optics` from five or six square 90° views: down, front, right, back, left, up.

    They look down, front and so on for a camera that looks down: `face_rotations` (N, 3, 3) lead from the optical frame
    of each view to that of the first, which is the camera's. Raises ValueError for another number of views.
    """

    def __init__(self, optics: CameraModel, views: int, interpolation: str = "nearest"):
        self.face_rotations: NDArray[np.float64] = face_rotations(views)
        self.optics = optics
        self._interpolation = interpolation
        self._width = 0
        self._assemble: Callable[[NDArray[np.uint32]], Image] | None = None

    def assemble_camera_image(self, views: Sequence[Image]) -> Image:
        """RGBA (height, width, 4) from views (w, w, 3 or 4); tables are made when their size changes.

        Raises ValueError if they are not squares of one size.
        """
        atlas = stack_faces(views)
        if self._assemble is None or views[0].shape[0] != self._width:
            self._width = views[0].shape[0]
            self._assemble = make_resampler(
                RemapTable(self.optics, self._width, len(self.face_rotations)), self._interpolation
            )
        return self._assemble(atlas)
