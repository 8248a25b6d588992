"""Interfaces that the vehicle's side of MAVLink needs of its program: a vehicle, its entities, parameters and files."""

from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import imc


class VehiclePort(Protocol):
    """The way to the vehicle: what is published goes to its tasks, and `profile_limit` reads its profile."""

    @property
    def imc_id(self) -> int: ...

    def age(self, time: float) -> float:
        """Seconds since a time (s since 1970) in which the program could receive something."""
        ...

    def publish(self, message: imc.Message) -> object: ...

    def set_parameter(self, entity: str, name: str, text: str) -> object:
        """Ask for a change, which the vehicle answers with EntityParameters."""
        ...

    def profile_limit(self, option: str) -> float:
        """A limit of the vehicle by its option; infinite if there is none."""
        ...


class VehicleOptions(Protocol):
    """Options that people can change while the vehicle runs: each is read when it is needed."""

    @property
    def rates(self) -> Mapping[str, float]:
        """Rates of the messages streamed by default, in Hz."""
        ...

    @property
    def hold_speed(self) -> float:
        """Speed back to the position that it holds, in m/s."""
        ...

    @property
    def guided_speed(self) -> float:
        """Speed of orders that name none, in m/s; 0 for `hold_speed`."""
        ...

    @property
    def hold_radius(self) -> float:
        """Radius of the circle on which an AUV under water holds, in m; 0 for the usual one."""
        ...

    @property
    def takeoff_altitude(self) -> float:
        """Altitude of a takeoff that names none, in m above home."""
        ...

    @property
    def gcs_timeout(self) -> float:
        """Silence of all ground stations after which the vehicle does `gcs_action`, in s; 0 for never."""
        ...

    @property
    def gcs_action(self) -> str: ...

    @property
    def clock_speed(self) -> float:
        """Seconds of the vehicle's clock per second of ground stations."""
        ...

    @property
    def detection_markers(self) -> bool:
        """Whether detected objects are shown on maps."""
        ...


class EntityView(Protocol):
    """A part of the vehicle; `stateful` is whether it has ever reported its state."""

    @property
    def label(self) -> str: ...

    @property
    def state(self) -> imc.EntityState.State: ...

    @property
    def description(self) -> str: ...

    @property
    def stateful(self) -> bool: ...


class ParameterDeclaration(Protocol):
    """Declaration of a parameter; `type` is bool, int, float or str, with `is_list` of each item."""

    @property
    def name(self) -> str: ...

    @property
    def unit(self) -> str: ...

    @property
    def description(self) -> str: ...

    @property
    def type(self) -> "type[bool] | type[int] | type[float] | type[str]": ...

    @property
    def is_list(self) -> bool: ...

    @property
    def editable(self) -> bool: ...

    @property
    def visibility(self) -> str: ...

    @property
    def default(self) -> Any: ...

    @property
    def choices(self) -> tuple[Any, ...]: ...

    @property
    def minimum(self) -> float | None: ...

    @property
    def maximum(self) -> float | None: ...

    def parse(self, text: str) -> Any:
        """The checked value of a text. Raises ValueError."""
        ...

    def check(self, value: Any) -> Any:
        """A value, if it is allowed. Raises ValueError."""
        ...

    def format(self, value: Any) -> str:
        """A value as written in a profile."""
        ...


class ParameterView(Protocol):
    """A parameter of the entity with a label, in a section of the profile, with its present value."""

    @property
    def label(self) -> str: ...

    @property
    def section(self) -> str: ...

    @property
    def declaration(self) -> ParameterDeclaration: ...

    def value(self) -> Any: ...

    def text(self) -> str:
        """The present value as written in a profile."""
        ...


class CameraView(Protocol):
    """A camera of the vehicle; `video` is the address of its RTSP stream, empty if it has none."""

    @property
    def entity(self) -> EntityView: ...

    @property
    def parameters(self) -> Sequence[ParameterView]: ...

    @property
    def video_url(self) -> str: ...


@dataclass(frozen=True, slots=True)
class FileEntry:
    """A file or folder; `changed` is in s since 1970, 0 if unknown."""

    name: bytes
    is_folder: bool = False
    size: int = 0
    changed: int = 0


class OpenFile(Protocol):
    """A file as long as it was when it was opened: stations take more than the announced length for an error.

    A file that is removed meanwhile can still be read, one that is truncated ends earlier.
    """

    @property
    def size(self) -> int: ...

    def read(self, offset: int, count: int) -> bytes:
        """Bytes from an offset on, at most `count`; none at the end. Raises OSError."""
        ...

    def close(self) -> None: ...


class FileStore(Protocol):
    """Folders that stations can read; a path is the names in it, of which the first is that of a folder.

    Only folders and regular files exist in it: no links, so that nothing leads out, and neither pipes nor devices.
    """

    def roots(self) -> Iterable[bytes]:
        """The names of the folders that exist now."""
        ...

    def list_entry_names(self, path: Sequence[bytes]) -> list[tuple[bytes, bool]]:
        """Names of what is in a folder, sorted, and whether each is a folder itself. Raises OSError."""
        ...

    def entries(self, path: Sequence[bytes], names: Iterable[bytes]) -> Generator[FileEntry | None]:
        """Entries of a folder by these names; None if it was removed. Raises OSError."""
        ...

    def open(self, path: Sequence[bytes]) -> OpenFile:
        """Raises OSError."""
        ...


class Thumbnail(NamedTuple):
    """A small picture; `jpeg` is empty if it cannot be read."""

    jpeg: bytes = b""
    width: int = 0
    height: int = 0


class PictureStore(Protocol):
    """Store of the vehicle's pictures; a file is a path below the folder of its logs."""

    def usage(self) -> tuple[float, float, float]:
        """Total, used and free bytes; 0: unknown."""
        ...

    def has(self, file: str) -> bool: ...

    def make_thumbnail(self, file: str, side: int, quality: int, then: Callable[[Thumbnail], object]) -> None:
        """Call `then`, now or later, with a JPEG of a picture, at most `side` pixels wide and high."""
        ...
