"""A picture of one camera, shared between the tasks of a process without going through the codec."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray  # slow to import, and most programs have no pictures


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One picture.

    `time` is the moment of exposure in s since 1970 UTC, `camera` the entity label of the camera, `index` counts its
    frames from 0. `image` is RGBA, uint8, (height, width, 4), row 0 on top; it becomes read-only, because all receivers
    share it. `info` carries further figures in SI units. Raises ValueError for an array of another type or shape.
    """

    time: float
    camera: str
    index: int
    image: "NDArray[np.uint8]"
    info: dict[str, float] = field(default_factory=dict[str, float])

    def __post_init__(self) -> None:
        if self.image.dtype != "uint8" or self.image.ndim != 3 or self.image.shape[2] != 4:
            raise ValueError(f"a frame is uint8 (height, width, 4), not {self.image.dtype} {self.image.shape}")
        self.image.setflags(write=False)


class FrameCarrier(Protocol):
    """Carries frames between the processes of a vehicle."""

    def share(self, frame: Frame) -> None:
        """Send a frame to the other processes that want it. Never blocks."""
        ...

    def want(self, receive: Callable[[Frame], None]) -> None:
        """Take the frames of other processes from now on; `receive` is called from any thread."""
        ...
