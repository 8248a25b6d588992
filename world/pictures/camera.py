"""A fisheye camera that looks down from a vehicle into a rendered scene."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from zlib import crc32

import numpy as np
from numpy.random import PCG64, Generator, SeedSequence
from numpy.typing import NDArray

from world.optics import Projection
from world.pictures.lookup import Lookup
from world.pictures.mug import Glider
from world.pictures.renderer import Renderer
from world.pictures.sampling import sampler
from world.pictures.scenes import Pose, surroundings
from world.sea import Waves
from world.sun import Sun


@dataclass(frozen=True)
class Camera:
    """All that a picture depends on except the pose. `visibility` is in m; 0 takes the default of the scene.

    `mugs` are positions of gliders in m north and east of the scene's origin, on the ground beneath the camera. All
    cameras with the same seed see the same seabed. The first picture takes some tenths of a second longer, since it
    builds the tables.
    """

    projection: Projection
    face_width: int = 512
    faces: int = 5
    interpolation: str = "nearest"
    scene: str = "Seabed"
    visibility: float = 0.0
    mugs: tuple[tuple[float, float], ...] = ()
    seed: int = 0
    waves: Waves = field(default_factory=Waves)
    sun: Sun = field(default_factory=Sun)

    def picture(self, pose: Pose, gliders: Sequence[Glider] | None = None) -> NDArray[np.uint8]:
        """RGBA (size, size, 4) at a pose; all zero outside the image circle. `gliders` replace those at `mugs`."""
        assemble, renderer = self._tables
        if gliders is None:
            gliders = [Glider(north, east) for north, east in self.mugs]
        return assemble(renderer.render(pose, gliders))

    @cached_property
    def _tables(self) -> tuple[Callable[[NDArray[np.uint32]], NDArray[np.uint8]], Renderer]:
        lookup = Lookup(self.projection, self.face_width, self.faces)
        random = Generator(PCG64(SeedSequence([self.seed, crc32(self.scene.encode())])))
        scene = surroundings(self.scene, self.visibility, random, self.waves, self.sun)
        renderer = Renderer(scene, self.face_width, self.faces, lookup.rows)
        return sampler(lookup, self.interpolation), renderer
