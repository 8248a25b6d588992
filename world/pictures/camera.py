"""A fisheye camera that looks down from a vehicle into a rendered scene."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from zlib import crc32

import numpy as np
from numpy.random import PCG64, Generator, SeedSequence
from numpy.typing import NDArray

from world.optics import Projection
from world.pictures.lookup import Lookup
from world.pictures.renderer import Renderer
from world.pictures.sampling import sampler
from world.pictures.scenes import Pose, surroundings


@dataclass(frozen=True)
class Camera:
    """All that a picture depends on except the pose. `visibility` is in m; 0 takes the default of the scene.

    `mugs` are positions of gliders in m north and east of the scene's origin. All cameras with the same seed see the
    same seabed. The first picture takes some tenths of a second longer, since it builds the tables.
    """

    projection: Projection
    face_width: int = 512
    faces: int = 5
    interpolation: str = "nearest"
    scene: str = "Seabed"
    visibility: float = 0.0
    mugs: tuple[tuple[float, float], ...] = ()
    seed: int = 0

    def picture(self, pose: Pose, rises: Sequence[float] = ()) -> NDArray[np.uint8]:
        """RGBA (size, size, 4) at a pose; all zero outside the image circle.

        `rises` (m) says how much higher each glider lies than the ground beneath the camera; 0 by default.
        """
        assemble, renderer = self._tables
        return assemble(renderer.render(pose, rises))

    @cached_property
    def _tables(self) -> tuple[Callable[[NDArray[np.uint32]], NDArray[np.uint8]], Renderer]:
        lookup = Lookup(self.projection, self.face_width, self.faces)
        random = Generator(PCG64(SeedSequence([self.seed, crc32(self.scene.encode())])))
        scene = surroundings(self.scene, self.visibility, random)
        renderer = Renderer(scene, self.face_width, self.faces, lookup.rows, self.mugs)
        return sampler(lookup, self.interpolation), renderer
