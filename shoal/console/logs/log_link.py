"""Plays a log as a network of the vehicles in it: play, pause, speed, seek. Nothing is sent to them."""

import asyncio
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import imc
from runtime.logs import logs_of_run
from shoal.logs.log_states import LogStates
from shoal.network import ConsoleIdentity, LinkListener, ReceivedPacket
from support.number_parsing import finite_number
from support.terminal_text import printable

TICK = 0.1  # s between looks at the log while it plays
FASTEST, SLOWEST = 1000.0, 0.01
MOST_REASONS = 3
CONFIGURATION = "Config.ini"
"""The profile of a run, beside its log."""


class LogLink:
    """A `NetworkLink` over a log: each system in it is there, with the state that it had at the present time.

    At any speed, it brings the last message of each kind and entity in a tick. logs: the logs that it plays as one.
    Times are in s since the start of the log.
    """

    name: str = "log"
    trouble: str = ""
    delivers_all: bool = True
    fragment_size: int = 0
    discovery_timeout: float = 0.0

    def __init__(self, states: LogStates, logs: Sequence[Path] = ()) -> None:
        self.states: LogStates = states
        self.logs: Sequence[Path] = logs or [states.path]
        self._of_run = 1
        if len(self.logs) == 1:
            with suppress(OSError, ValueError):
                self._of_run = len(logs_of_run(states.path.parent if states.path.is_file() else states.path))
        self.position: float = 0.0
        self.speed: float = 1.0
        self.is_playing: bool = False
        self._jump_listeners: list[Callable[[], object]] = []
        self._listener: LinkListener | None = None
        self._wanted: float | None = 0.0  # where to jump
        self._woken = asyncio.Event()
        self._landed = asyncio.Condition()
        self._names = {number: states.names.system_name(number) for number in states.systems}

    @property
    def now(self) -> float:
        """The present time in the log (s since 1970 UTC)."""
        return self.states.start + self.position

    @property
    def notice(self) -> str:
        """The damage of the log, and whether its run has others that are not played, for people; empty if neither."""
        losses = self.states.losses
        others = f"this is 1 of {self._of_run} logs of its run: --run plays all of them" if self._of_run > 1 else ""
        if not losses:
            return others
        reasons = list(dict.fromkeys(loss.reason for loss in losses))[:MOST_REASONS]
        places = "1 damaged place" if len(losses) == 1 else f"{len(losses)} damaged places"
        return printable(
            "; ".join(filter(None, [f"this log is not complete: {places} ({', '.join(reasons)})", others]))
        )

    def system_name(self, number: int) -> str:
        """The name of a system, as the network lists it."""
        return self._names.get(number, "")

    @property
    def awaits_answers(self) -> bool:
        return False

    async def open(self, listener: LinkListener, console: ConsoleIdentity) -> None:
        self._listener = listener
        for number, name in self._names.items():
            listener.on_appeared(self, name, "", "", number)

    def subscribe(self, system: str, messages: Collection[str]) -> None:
        """The log brings everything."""

    def unsubscribe(self, system: str, messages: Collection[str]) -> bool:
        """The log brings everything."""
        return False

    def send(self, system: str, message: imc.Message, packet: bytes) -> None:
        """Do nothing: a log takes no messages."""

    async def close(self) -> None:
        self._listener = None
        self.states.close()

    @property
    def start(self) -> float:
        """The first time of the log (s since 1970 UTC)."""
        return self.states.start

    @property
    def end(self) -> float:
        """The last time of the log (s since 1970 UTC)."""
        return self.states.start + self.states.duration

    def on_jump(self, listener: Callable[[], object]) -> None:
        """Call a function before the state at another place comes."""
        self._jump_listeners.append(listener)

    def describe(self) -> dict[str, object]:
        """The page's data of the replay: times in s since the start of the log, `start` in s since 1970 UTC.

        `owner` is the name of the system that wrote the log.
        """
        return {
            "owner": self.system_name(self.states.owner),
            "start": self.states.start,
            "duration": self.states.duration,
            "position": round(self.position, 2),
            "speed": self.speed,
            "playing": self.is_playing,
            "notice": self.notice,
            "resume": resumes(self.states.path),
        }

    async def control(self, words: Mapping[str, object]) -> None:
        """Take orders of the page: `playing`, `speed`, `position`; returns when they have effect. Raises ValueError."""
        speed, position, playing = words.get("speed"), words.get("position"), words.get("playing")
        if speed is not None:
            self.speed = min(FASTEST, max(SLOWEST, _number("speed", speed)))
        if position is not None:
            self._wanted = min(self.states.duration, max(0.0, _number("position", position)))
        if playing is not None:
            if playing is True and position is None and self.position >= self.states.duration:
                self._wanted = 0.0
            self.is_playing = playing is True
        self._woken.set()
        async with self._landed:
            await self._landed.wait_for(lambda: self._wanted is None)

    async def run(self) -> None:
        """Play until it is cancelled. Raises OSError if the log cannot be read."""
        before = time.monotonic()
        while True:
            if self._wanted is not None:
                await self._jump()
            now = time.monotonic()
            if self.is_playing:
                await self._advance((now - before) * self.speed)
            before = now
            self._woken.clear()
            if self._wanted is None:
                await self._pause()

    async def _pause(self) -> None:
        try:
            async with asyncio.timeout(TICK if self.is_playing else None):
                await self._woken.wait()
        except TimeoutError:
            pass

    async def _jump(self) -> None:
        wanted = self._wanted
        assert wanted is not None
        packets = await asyncio.to_thread(self.states.state_at, wanted)
        async with self._landed:
            if self._wanted == wanted:
                self._wanted = None
                self.position = wanted
                for listener in self._jump_listeners:
                    listener()
                self._deliver(packets)
                self._landed.notify_all()

    async def _advance(self, seconds: float) -> None:
        end = min(self.states.duration, self.position + seconds)
        packets = await asyncio.to_thread(self.states.changes, self.position, end)
        if self._wanted is not None:
            return
        self.position = end
        self.is_playing = self.is_playing and end < self.states.duration
        self._deliver(packets)

    def _deliver(self, packets: Sequence[bytes]) -> None:
        if self._listener is None:
            return
        labels = self.states.names.labels
        for packet in packets:
            head = imc.header(packet)
            name = self._names.get(head.src)
            if name is not None:
                label = labels.get((head.src, head.src_ent), "")
                self._listener.on_packet(self, ReceivedPacket(packet, name, label))


def _number(name: str, value: object) -> float:
    number = finite_number(value)
    if number is None:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        raise ValueError(f"{name} is a finite number" if is_number else f"{name} is a number, not {value!r}")
    return number


def resumes(path: Path) -> bool:
    """Whether a log may be of a run that can be resumed: it has the configuration of a vehicle."""
    return (path.parent / CONFIGURATION).is_file()
