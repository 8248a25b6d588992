"""Play, pause, speed and seek of a log, as viewers of Foxglove's protocol and the page share them."""

from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

from runtime.kernel import nanoseconds
from shoal.console.foxglove.protocol import PlaybackRequest, PlaybackStatus

BILLION = 1_000_000_000


class Playback(Protocol):
    """A log that is played. Times are in s since 1970 UTC."""

    speed: float
    is_playing: bool

    @property
    def now(self) -> float: ...
    @property
    def start(self) -> float: ...
    @property
    def end(self) -> float: ...

    def on_jump(self, listener: Callable[[], object]) -> None:
        """Call a function before the state at another place comes."""
        ...

    async def control(self, words: Mapping[str, object]) -> None:
        """Carry out `playing`, `speed` and `position` (s since the start). Raises ValueError."""
        ...


class PlaybackState(NamedTuple):
    """The state of a playback for viewers; `jumps` counts how often its time was changed."""

    status: PlaybackStatus
    speed: float
    jumps: int


def playback_state(playback: Playback, jumps: int) -> PlaybackState:
    """The present state."""
    if playback.is_playing:
        status = PlaybackStatus.PLAYING
    else:
        status = PlaybackStatus.ENDED if playback.now >= playback.end else PlaybackStatus.PAUSED
    return PlaybackState(status, playback.speed, jumps)


def control_words(request: PlaybackRequest, playback: Playback) -> Mapping[str, object]:
    """A request as `Playback.control` takes it. A viewer of speed 0 leaves the speed as it is."""
    words: dict[str, object] = {"playing": request.plays}
    if request.speed > 0.0:
        words["speed"] = request.speed
    if request.seek is not None:
        words["position"] = request.seek / BILLION - playback.start
    return words


def playback_time(time: float) -> int:
    """A time (s since 1970 UTC) in ns; 0 for one that the protocol does not have."""
    return nanoseconds(time) if 0.0 <= time < float(1 << 33) else 0
