"""An image of one camera, shared inside the process beside the bus."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One picture.

    `time` is the moment of exposure in seconds since 1970 UTC, `camera` the entity label of the camera, `index` counts
    its frames from 0. `image` is RGBA, uint8, (height, width, 4), row 0 on top; it is made read-only, since all
    receivers look at the same array. `info` carries figures beside the picture, each in SI units. Raises ValueError for
    another array.
    """

    time: float
    camera: str
    index: int
    image: NDArray[np.uint8]
    info: dict[str, float] = field(default_factory=dict[str, float])

    def __post_init__(self) -> None:
        if self.image.dtype != np.uint8 or self.image.ndim != 3 or self.image.shape[2] != 4:
            raise ValueError(f"a frame is uint8 (height, width, 4), not {self.image.dtype} {self.image.shape}")
        self.image.setflags(write=False)
