"""A picture of one camera, shared between the tasks of a process without going through the codec."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray  # slow to import, and most programs have no pictures


class Optics(Protocol):
    """Maps points of the optical frame of a camera (x right, y down, z ahead; m) to pixels, and back to unit rays.

    Both also mark which of them are valid.
    """

    @property
    def width(self) -> int: ...

    @property
    def height(self) -> int: ...

    def project(self, points: "ArrayLike") -> "tuple[NDArray[np.floating[Any]], NDArray[np.bool_]]": ...

    def unproject(self, pixels: "ArrayLike") -> "tuple[NDArray[np.floating[Any]], NDArray[np.bool_]]": ...


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One picture.

    `time` is the moment of exposure in s since 1970 UTC, `camera` the entity label of the camera, `index` counts its
    frames from 0. `image` is RGBA, uint8, (height, width, 4), row 0 on top; it becomes read-only, because all receivers
    share it. `info` carries further figures in SI units. `optics` is the camera's model; `mount` (4, 4) leads from its
    optical frame to the body of the vehicle, `pose` (4, 4) from its optical frame to north, east and down of the world,
    where the camera truly was at the exposure. Each is None where it is not known, as in a frame of another process.
    Raises ValueError for an array of another type or shape.
    """

    time: float
    camera: str
    index: int
    image: "NDArray[np.uint8]"
    info: dict[str, float] = field(default_factory=dict[str, float])
    optics: Optics | None = None
    mount: "NDArray[np.floating[Any]] | None" = None
    pose: "NDArray[np.floating[Any]] | None" = None

    def __post_init__(self) -> None:
        if self.image.dtype != "uint8" or self.image.ndim != 3 or self.image.shape[2] != 4:
            raise ValueError(f"a frame is uint8 (height, width, 4), not {self.image.dtype} {self.image.shape}")
        self.image.setflags(write=False)


class FrameTransport(Protocol):
    """Carries frames between the processes of a vehicle."""

    def send(self, frame: Frame) -> None:
        """Send a frame to the other processes that subscribe to it. Never blocks."""
        ...

    def subscribe(self, receive: Callable[[Frame], None]) -> None:
        """Take the frames of other processes from now on; `receive` is called from any thread."""
        ...
