"""All messages of the network for viewers of Foxglove's protocol, encoded once, and only if somebody has subscribed."""

import asyncio
import secrets
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable
from functools import partial
from itertools import islice
from typing import NamedTuple, Protocol

import imc
from imc.reserved_ids import UNKNOWN_ENTITY
from runtime.kernel import nanoseconds
from runtime.logs import label_text
from shoal.console.cameras.camera_picture import CameraPicture
from shoal.console.cameras.detection_marks import Mark, RecentDetections
from shoal.console.cameras.live_pictures import LIVE_RATE, PictureSubscription
from shoal.console.foxglove import protocol
from shoal.console.foxglove.camera_topics import camera_topics
from shoal.console.foxglove.playback import Playback, PlaybackState, playback_state, playback_time
from shoal.logs.export import CdrError, MessageTopic, MessageTopics, TopicChannels
from shoal.network import MessageListener, Network, NetworkSystem

BATCH = 0.02  # s in which messages are collected
BREATH = 32  # messages that are encoded without a break
TIME_PERIOD = 0.1  # s between two messages of time
LABEL_PATIENCE = 3.0  # s for the label of an entity, which names its topics
MOST_CHANNELS = 8192
ADVERTISED_AT_ONCE = 64  # channels in a message, whose types are long
LATEST = 1 << 31  # s since 1970, as in an MCAP file: what is later is no time
BILLION = 1_000_000_000
PICTURE = "CompressedImage"


class LiveViewer(Protocol):
    """A viewer, as the feed needs it."""

    def on_channels(self, channels: Iterable[protocol.Json]) -> None: ...
    def on_message(self, channel: int, time: int, data: bytes) -> None: ...
    def on_time(self, frame: bytes) -> None: ...
    def on_parameters(self, system: NetworkSystem, message: imc.EntityParameters) -> None: ...
    def on_playback(self, state: PlaybackState) -> None: ...


class LiveChannel(NamedTuple):
    """A channel, and the topic whose messages are on it."""

    number: int
    topic: MessageTopic


class _Sink:
    """Takes the channels; all that were not advertised yet are in `new`."""

    def __init__(self) -> None:
        self.channels: dict[int, protocol.Json] = {}
        self.new: list[protocol.Json] = []
        self._schemas: list[tuple[str, str]] = []

    def add_schema(self, name: str, definition: str) -> int:
        self._schemas.append((name, definition))
        return len(self._schemas)

    def add_channel(self, topic: str, schema: int, metadata: dict[str, str]) -> int:
        name, definition = self._schemas[schema - 1]
        number = len(self.channels) + 1
        type_ = {"schemaName": name, "schema": definition, "schemaEncoding": "ros2msg"}
        self.channels[number] = {"id": number, "topic": topic, "encoding": "cdr", **type_}
        self.new.append(self.channels[number])
        return number


class LiveFeed:
    """The channels of all vehicles, and their messages for all viewers.

    It receives all messages while there is a viewer, and asks cameras for pictures while somebody has subscribed to
    them. Channels keep their numbers. `counts` are of what went wrong, by reason. `playback`: the log that is played.
    """

    def __init__(
        self, network: Network, clock: Callable[[], float] = time.time, playback: Playback | None = None
    ) -> None:
        self.playback: Playback | None = playback
        self._jumps = 0
        self._listener: MessageListener | None = None
        self._pictures = PictureSubscription(network)
        self._cameras: dict[int, tuple[str, int]] = {}  # by channel: the vehicle and the entity
        self._detections: defaultdict[str, RecentDetections] = defaultdict(RecentDetections)
        if playback is not None:
            playback.on_jump(self._restart)
        self.session: str = secrets.token_hex(8)
        self.counts: Counter[str] = Counter()
        self._network, self._clock = network, clock
        self._topics = MessageTopics(network.messages)
        self._sink = _Sink()
        self._numbers = TopicChannels(self._sink)
        self._known: dict[tuple[str, str, int], tuple[LiveChannel, ...]] = {}
        self._first: dict[tuple[str, int], float] = {}
        self._latest: dict[int, tuple[imc.Message, LiveChannel]] = {}
        self._viewers: dict[LiveViewer, Counter[int]] = {}
        self._time = 0
        self._running: asyncio.Task[None] | None = None

    @property
    def network(self) -> Network:
        return self._network

    @property
    def channels(self) -> dict[int, protocol.Json]:
        """The channels as they are advertised, by number."""
        return self._sink.channels

    def publishers(self) -> Iterable[tuple[str, int, str]]:
        """System, entity and topic of each channel."""
        for (system, _, entity), channels in self._known.items():
            for channel in channels:
                yield system, entity, self.channels[channel.number]["topic"]

    def add(self, viewer: LiveViewer) -> "asyncio.Task[None]":
        """Feed a viewer from now on; returns what runs, and raises if it fails."""
        if self._running is None or self._running.done():
            self._running = asyncio.create_task(self._run())
        self._viewers[viewer] = Counter()
        soon = {channel["id"] for channel in self._sink.new}
        for batch in _batches(channel for number, channel in self.channels.items() if number not in soon):
            viewer.on_channels(batch)
        return self._running

    def remove(self, viewer: LiveViewer) -> None:
        self._viewers.pop(viewer, None)
        if not self._viewers and self._running is not None:
            self._running.cancel()
            self._running = None

    def subscribe(self, viewer: LiveViewer, channel: int) -> None:
        """Give a viewer the messages of a channel, and the last one before."""
        self._viewers[viewer][channel] += 1
        if channel in self._latest:
            message, found = self._latest[channel]
            moment = self._time_of(message)
            if (data := self._encode(found, message, moment)) is not None:
                viewer.on_message(channel, moment, data)

    def unsubscribe(self, viewer: LiveViewer, channel: int) -> None:
        self._viewers[viewer][channel] -= 1

    @property
    def playback_state(self) -> PlaybackState | None:
        """The present state of the log; None without one."""
        return None if self.playback is None else playback_state(self.playback, self._jumps)

    def _restart(self) -> None:
        """Forget what viewers have received: the log continues elsewhere."""
        self._jumps += 1
        self._latest.clear()
        self._detections.clear()
        self._time = 0
        if self._listener is not None:
            self._listener.take_all()

    async def _run(self) -> None:
        listener = self._listener = self._network.listen()
        try:
            for system in self._network.vehicles():
                self._network.request_labels(system)
                for message in list(system.latest.values()):
                    self._take(system, message)
            sent = 0.0
            while True:
                await self._take_messages(listener)
                if self._sink.new:
                    new, self._sink.new = self._sink.new, []
                    for batch in _batches(new):
                        for viewer in self._viewers:
                            viewer.on_channels(batch)
                self._ask_for_pictures()
                if (state := self.playback_state) is not None:
                    self._time = max(self._time, playback_time(self.playback.now if self.playback else 0.0))
                    for viewer in self._viewers:
                        viewer.on_playback(state)
                if self._time and time.monotonic() - sent >= TIME_PERIOD:
                    sent = time.monotonic()
                    frame = protocol.time_message(self._time)
                    for viewer in self._viewers:
                        viewer.on_time(frame)
        finally:
            self.counts["messages lost: this computer is too slow"] += listener.lost
            self._network.close_listener(listener)
            self._listener = None

    def _ask_for_pictures(self) -> None:
        for channel, (name, entity) in self._cameras.items():
            system = self._network.systems.get(name)
            if system is not None and any(wanted[channel] > 0 for wanted in self._viewers.values()):
                self._pictures.renew(system, entity, LIVE_RATE)

    async def _take_messages(self, listener: MessageListener) -> None:
        try:
            first = await listener.next(TIME_PERIOD)
        except TimeoutError:
            return
        jumps = self._jumps
        await asyncio.sleep(BATCH)
        for number, (system, message) in enumerate([first, *listener.take_all()]):
            if jumps != self._jumps:
                return  # these are from before the jump
            self._take(system, message)
            if number % BREATH == BREATH - 1:
                await asyncio.sleep(0)  # viewers take what waits for them meanwhile

    def _take(self, system: NetworkSystem, message: imc.Message) -> None:
        if message.src not in system.ids or not system.is_vehicle:
            return  # sent to it, not by it
        if isinstance(message, imc.EntityParameters):
            for viewer in self._viewers:
                viewer.on_parameters(system, message)
        if isinstance(message, imc.EstimatedState | imc.EstimatedMugState):
            self._detections[system.name].add(message)
        place = system.name, type(message).__name__, message.src_ent
        channels = self._known.get(place)
        if channels is None:
            channels = self._open(system, message)
        if isinstance(message, imc.CameraFrame) and (system.name, PICTURE, message.src_ent) not in self._known:
            self._open(system, imc.CompressedImage(src=message.src, src_ent=message.src_ent))
        if not channels:
            return
        moment = self._time_of(message)
        self._time = max(self._time, moment)
        for channel in channels:
            self._latest[channel.number] = message, channel
            wanting = [viewer for viewer, wanted in self._viewers.items() if wanted[channel.number] > 0]
            if wanting and (data := self._encode(channel, message, moment)) is not None:
                for viewer in wanting:
                    viewer.on_message(channel.number, moment, data)

    def _open(self, system: NetworkSystem, message: imc.Message) -> tuple[LiveChannel, ...]:
        """The channels of messages of a new kind; none yet while the label of their entity may still come."""
        entity = message.src_ent
        label = system.labels.get(entity)
        if label is None and entity != UNKNOWN_ENTITY and self.playback is None:  # a log answers nothing
            now = time.monotonic()
            if (system.name, entity) not in self._first:
                self._first[system.name, entity] = now
                self._network.request_labels(system)
            if now - self._first[system.name, entity] < LABEL_PATIENCE:
                return ()
        if len(self.channels) >= MOST_CHANNELS:
            self.counts[f"more than {MOST_CHANNELS} channels"] += 1
            return ()
        topics = self._topics.topics_of(message, system.name, label)
        if isinstance(message, imc.CompressedImage):
            topics += camera_topics(system.name, label_text(label, entity), partial(self._marks, system))
        names = {"system": system.name, "message": type(message).__name__}
        found = tuple(LiveChannel(self._numbers.channel(each.parts, each.type, **names), each) for each in topics)
        self._known[system.name, type(message).__name__, entity] = found
        if isinstance(message, imc.CompressedImage):
            own = [channel.number for channel in found if channel.topic.parts[0] == system.name]
            self._cameras |= dict.fromkeys(own, (system.name, entity))
        return found

    def _marks(self, system: NetworkSystem, picture: CameraPicture) -> list[Mark]:
        return self._detections[system.name].marks(picture, system.label)

    def _encode(self, channel: LiveChannel, message: imc.Message, moment: int) -> bytes | None:
        try:
            return channel.topic.encode(message, moment)
        except CdrError as error:
            self.counts[str(error)] += 1
            return None

    def _time_of(self, message: imc.Message) -> int:
        """Time stamp of a message in ns; now if it is no time."""
        stamp = message.timestamp
        return nanoseconds(stamp if 0.0 <= stamp < LATEST else self._clock())


def _batches(channels: Iterable[protocol.Json]) -> Iterable[list[protocol.Json]]:
    left = iter(list(channels))
    while batch := list(islice(left, ADVERTISED_AT_ONCE)):
        yield batch
