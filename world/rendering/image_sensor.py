"""Model of an image sensor: shutter and motion, photons, noise and vignetting."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any
from zlib import crc32

import numpy as np
from numpy.random import PCG64, Generator, SeedSequence
from numpy.typing import NDArray

from world.rendering.band_labels import label_bands
from world.rendering.labels import ImageLabels
from world.rendering.objects.calibration_targets import Board
from world.rendering.objects.glider import Glider
from world.rendering.scene_camera import SceneCamera
from world.rendering.scenes import ScenePose

Image = NDArray[np.uint8]
Floats = NDArray[np.floating[Any]]

STEPS = np.float32(255.0)


@dataclass(frozen=True)
class Exposure:
    """The sensor behind a lens. By default it is perfect: an instant, no noise, all rows at once.

    The scene is exposed right for any `time` (s): that is only for how long motion smears the picture, as the
    mean of `samples` instants. A `gain` above 1 makes up for light that is missing: fewer photons for the same
    brightness. `full_well` is how many electrons are white at a gain of 1; 0 means more than can be counted.
    `read_noise` is the root mean square of electrons that are none. `vignetting` is the share of light that the corner
    farthest from the middle loses; it grows with the square of the distance. `readout` (s) passes from the first to the
    last row of a rolling shutter. Raises ValueError.
    """

    time: float = 0.0
    gain: float = 1.0
    full_well: float = 0.0
    read_noise: float = 0.0
    vignetting: float = 0.0
    samples: int = 1
    readout: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            if not 0.0 <= getattr(self, field.name) < math.inf:
                raise ValueError(f"{field.name} = {getattr(self, field.name):g} is not a finite number from 0")
        if self.gain < 1.0 or self.samples < 1:
            raise ValueError(f"gain = {self.gain:g} and samples = {self.samples} must be at least 1")
        if self.vignetting > 1.0:
            raise ValueError(f"vignetting = {self.vignetting:g} is more than all light")
        if self.read_noise and not self.full_well:
            raise ValueError(f"read_noise = {self.read_noise:g} electrons needs a full_well")

    def row_times(self, rows: int) -> Floats:
        """(rows,) s from the instant of the picture to the middle of the exposure of each row."""
        return self.readout * ((np.arange(rows) + 0.5) / rows - 0.5)

    def sample_times(self, bands: int) -> Floats:
        """(bands * samples,) s from the instant of the picture: the poses that a Shutter of as many bands needs."""
        smear = self.time * ((np.arange(self.samples) + 0.5) / self.samples - 0.5)
        return (self.row_times(bands)[:, np.newaxis] + smear).ravel()

    def add_vignetting_and_noise(self, image: Image, random: Generator) -> Image:
        """A picture (height, width, 4) with vignetting, photon and read noise; where it is void, it stays so.

        In linear light (white is 1) of mean m the variance is m gain / full_well + (gain read_noise / full_well)^2;
        photons are taken as normally distributed, which is right from about twenty on. Takes as many numbers from
        `random` as there are colors in the picture.
        """
        if not self.vignetting and not self.full_well:
            return image
        light = to_linear_light(image)
        if self.vignetting:
            light *= (1.0 - self.vignetting * squared_radius(*image.shape[:2]))[..., np.newaxis]
        if self.full_well:
            electron = self.gain / self.full_well
            spread = np.sqrt(light * np.float32(electron) + np.float32((electron * self.read_noise) ** 2))
            light += spread * random.standard_normal(light.shape, dtype=np.float32)
        return to_counts(light, image[..., 3])


class Shutter:
    """Takes pictures with a camera whose sensor takes time.

    The rows of a rolling shutter are rendered in `bands`, each from a pose of its own: a row is off by at most
    readout / (2 bands), 1 px at a motion of 2 bands px per readout. Each band costs some 1.5 ms more than its pixels.
    """

    def __init__(self, camera: SceneCamera, exposure: Exposure, bands: int = 16):
        self.exposure = exposure
        self.bands: int = min(bands, camera.optics.height) if exposure.readout else 1
        self.camera: SceneCamera = camera
        self.cameras: tuple[SceneCamera, ...] = camera.split_into_bands(self.bands)

    @property
    def band_times(self) -> Floats:
        """(bands,) s from the instant of a picture, at which `labels` needs standpoints."""
        return self.exposure.row_times(self.bands)

    def labels(
        self,
        standpoints: Sequence[ScenePose],
        gliders: Sequence[Glider] | None = None,
        following: tuple[Sequence[ScenePose], Sequence[Glider]] | None = None,
        boards: Sequence[Board] = (),
    ) -> ImageLabels:
        """Labels for `take_picture`, of each row in the middle of its exposure, from the standpoints at `band_times`.

        `following` has those of the next picture. Raises ValueError for another number of them, and like
        Labeler.labels.
        """
        for path in (standpoints, standpoints if following is None else following[0]):
            if len(path) != self.bands:
                raise ValueError(f"{len(path)} standpoints are not {self.bands}")
        if self.bands > 1:
            return label_bands(self.camera, self.cameras, standpoints, gliders, following, boards)
        after = None if following is None else (following[0][0], following[1])
        return self.camera.labels(standpoints[0], gliders, after, boards)

    @property
    def sample_times(self) -> Floats:
        """s from the instant of a picture, at which `take_picture` needs standpoints."""
        return self.exposure.sample_times(self.bands)

    def take_picture(
        self,
        standpoints: Sequence[ScenePose],
        gliders: Sequence[Glider] | None,
        random: Generator,
        boards: Sequence[Board] = (),
    ) -> Image:
        """RGBA (height, width, 4), from where the vehicle is at the `sample_times`. Raises ValueError for others."""
        samples = self.exposure.samples
        if len(standpoints) != self.bands * samples:
            raise ValueError(f"{len(standpoints)} standpoints are not {self.bands} times {samples}")
        parts = [
            mean_image(
                [
                    camera.take_picture(standpoint, gliders, boards)
                    for standpoint in standpoints[n * samples : (n + 1) * samples]
                ]
            )
            for n, camera in enumerate(self.cameras)
        ]
        return self.exposure.add_vignetting_and_noise(np.vstack(parts) if len(parts) > 1 else parts[0], random)


def frame_random(seed: int, camera: str, frame: int) -> Generator:
    """Random numbers for a frame of a camera: always the same for the same seed, also after other frames."""
    return Generator(PCG64(SeedSequence([seed, crc32(camera.encode()), frame])))


def to_linear_light(image: Image) -> Floats:
    """(height, width, 3) linear light, 0 to 1, in the middle of what each count stands for (see gamma_encode)."""
    light = image[..., :3] + np.float32(0.5)
    light /= STEPS
    light *= light
    return light


def to_counts(light: Floats, alpha: NDArray[np.uint8]) -> Image:
    """RGBA of linear light (height, width, 3) with an opacity (height, width); void where that is 0."""
    image = np.empty((*alpha.shape, 4), dtype=np.uint8)
    image[..., :3] = np.sqrt(np.clip(light, 0.0, 1.0)) * STEPS
    image[..., 3] = alpha
    image[alpha == 0] = 0
    return image


def mean_image(images: Sequence[Image]) -> Image:
    """The mean of the light of pictures of one size."""
    if len(images) == 1:
        return images[0]
    light = to_linear_light(images[0])
    for image in images[1:]:
        light += to_linear_light(image)
    light /= len(images)
    return to_counts(light, images[0][..., 3])


def squared_radius(height: int, width: int) -> Floats:
    """(height, width) square of the distance to the middle of a picture, 1 in the centers of its corners."""
    y, x = (np.arange(size, dtype=np.float32) - np.float32((size - 1) / 2) for size in (height, width))
    far = x[:, np.newaxis].T ** 2 + y[:, np.newaxis] ** 2
    return far / max(float(far[0, 0]), 1e-12)
